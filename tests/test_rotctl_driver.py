"""The dialogue with a rotctld: what is sent, and which command an answer belongs to."""

import pytest

from acu_daemon.acu.commands import AcuMode, Backup, Identify, PointAt, Poll, ReadFaults, SelectBackup, SelectMode, Stop
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, FaultReport, Refused, Reply, beyond_own_limits
from acu_daemon.drivers.rotctl.rotctl_driver import RotctlDriver
from acu_daemon.model import AxisLimits

REJECTED = Refused("RPRT -9 (command rejected)")
STATE_1 = (
    b"1\n1\nmin_az=-180.000000\nmax_az=450.000000\nmin_el=0.000000\nmax_el=90.000000\n"
    b"south_zero=0\nrot_type=AzEl\ndone\n"
)


def ask(driver: RotctlDriver, command, answer: bytes, now_s: float = 0.0) -> tuple[bytes, Reply | None]:
    sent = driver.begin(command, now_s)
    return sent, driver.receive(answer, now_s + 0.01)


def test_a_position_is_a_status_in_the_mode_that_the_driver_keeps() -> None:
    sent, reply = ask(RotctlDriver(), Poll(), b"-10.00\n10.39\n")
    assert sent == b"p\n"
    assert reply == AcuStatus(350.0, 10.39, AcuMode.REMOTE, turns_deg=-10.0)


@pytest.mark.parametrize("size", [1, 2, 3, 7])
def test_an_answer_may_come_in_any_pieces(size: int) -> None:
    driver, text = RotctlDriver(), b"123.40\r\n56.70\r\n"
    driver.begin(Poll(), 0.0)
    replies = [driver.receive(text[i : i + size], 0.01) for i in range(0, len(text), size)]
    assert [reply for reply in replies if reply] == [AcuStatus(123.4, 56.7, AcuMode.REMOTE, turns_deg=123.4)]
    assert not driver.is_outstanding


def test_another_angle_is_sent_only_beyond_the_dead_band_of_the_last_one_that_was_taken() -> None:
    driver = RotctlDriver(dead_band_deg=0.5)
    assert ask(driver, PointAt(100.0, 20.0), b"RPRT 0\n") == (b"P 100.00 20.00\n", Done())
    assert ask(driver, PointAt(100.4, 20.5), b"") == (b"", Done())
    assert ask(driver, PointAt(100.4, 20.51), b"RPRT -9\n") == (
        b"P 100.40 20.51\n",
        Refused("RPRT -9 (command rejected)"),
    )
    assert ask(driver, PointAt(100.4, 20.4), b"") == (b"", Done())
    assert ask(driver, PointAt(100.6, 20.0), b"RPRT 0\n")[0] == b"P 100.60 20.00\n"


def test_after_a_stop_angles_are_taken_and_not_sent_until_remote_is_selected() -> None:
    driver = RotctlDriver()
    ask(driver, PointAt(100.0, 20.0), b"RPRT 0\n")
    assert ask(driver, Stop(), b"RPRT 0\n") == (b"S\n", Done())
    assert ask(driver, PointAt(150.0, 20.0), b"") == (b"", Done())
    reply = ask(driver, Poll(), b"100.0\n20.0\n")[1]
    assert isinstance(reply, AcuStatus)
    assert (reply.mode, reply.follows_registers) == (AcuMode.STANDBY, False)
    assert ask(driver, SelectMode(AcuMode.REMOTE), b"") == (b"", Done())
    assert ask(driver, PointAt(100.0, 20.0), b"RPRT 0\n")[0] == b"P 100.00 20.00\n"


def test_a_stop_that_is_refused_is_none() -> None:
    driver = RotctlDriver()
    assert ask(driver, Stop(), b"RPRT -4\n")[1] == Refused("RPRT -4 (not implemented)")
    reply = ask(driver, Poll(), b"100.0\n20.0\n")[1]
    assert isinstance(reply, AcuStatus)
    assert reply.mode is AcuMode.REMOTE


def test_an_answer_that_comes_too_late_is_not_the_next_polls() -> None:
    driver = RotctlDriver()
    driver.begin(Poll(), 0.0)
    driver.fail(1.0)
    driver.begin(Poll(), 1.1)
    assert driver.receive(b"10.0\n20.0\n", 1.2) is None
    assert (driver.late_count, driver.late_s) == (1, pytest.approx(1.2))
    reply = driver.receive(b"11.0\n21.0\n", 1.3)
    assert isinstance(reply, AcuStatus)
    assert reply.az_deg == 11.0


def test_a_half_of_a_late_answer_and_the_rest_of_it_are_not_the_next_polls() -> None:
    driver = RotctlDriver()
    driver.begin(Poll(), 0.0)
    assert driver.receive(b"10.0\n2", 0.5) is None
    driver.fail(1.0)
    driver.begin(Poll(), 1.1)
    assert driver.receive(b"0.0\n11.0\n", 1.2) is None
    reply = driver.receive(b"21.0\n", 1.3)
    assert isinstance(reply, AcuStatus)
    assert (reply.az_deg, reply.el_deg) == (11.0, 21.0)


@pytest.mark.parametrize("before", [b"10.0\n", b"10.0\n2", b"-170.25\r\n"])
@pytest.mark.parametrize("command", [PointAt(1.0, 2.0), Stop()])
@pytest.mark.parametrize("code", [0, -9])
def test_a_report_after_half_a_position_is_the_next_commands(before: bytes, command: PointAt | Stop, code: int) -> None:
    driver = RotctlDriver()
    driver.begin(Poll(), 0.0)
    assert driver.receive(before, 0.5) is None
    driver.fail(1.0)
    driver.begin(command, 1.1)
    rest = b"" if before.endswith(b"\n") else b"\n"
    assert driver.receive(rest, 1.15) is None
    assert driver.receive(f"RPRT {code}\n".encode(), 1.2) == (Done() if code == 0 else REJECTED)
    assert not driver.is_outstanding


def test_an_answer_that_was_lost_does_not_hold_up_the_next_one() -> None:
    driver = RotctlDriver()
    driver.begin(PointAt(1.0, 2.0), 0.0)
    driver.fail(1.0)
    assert ask(driver, Poll(), b"10.0\n20.0\n", 1.1)[1] is not None


def test_an_angle_whose_answer_did_not_come_is_sent_again() -> None:
    driver = RotctlDriver()
    driver.begin(PointAt(100.0, 20.0), 0.0)
    driver.fail(1.0)
    assert driver.begin(PointAt(100.0, 20.0), 1.1) == b"P 100.00 20.00\n"


@pytest.mark.parametrize("answer", [b"nan\nnan\n", b"inf\n1\n", b"what?\n", b"\x00\xff\n1\n", b"9" * 500])
def test_what_is_no_position_is_no_reply(answer: bytes) -> None:
    driver = RotctlDriver()
    assert ask(driver, Poll(), answer)[1] is None
    assert driver.garbled_count > 0
    driver.fail(1.0)
    driver.forget()
    assert ask(driver, Poll(), b"10.0\n20.0\n", 1.1)[1] is not None


@pytest.mark.parametrize(("code", "has_no_contact"), [(1, False), (5, True), (6, True), (8, True), (9, False)])
def test_a_refusal_says_why_and_whether_the_rotator_is_there(code: int, has_no_contact: bool) -> None:
    reply = ask(RotctlDriver(), Poll(), f"RPRT -{code}\n".encode())[1]
    assert isinstance(reply, Refused)
    assert reply.why.startswith(f"RPRT -{code} (")
    assert reply.has_no_contact is has_no_contact


def test_hamlibs_dummy_is_simulated_and_its_limits_are_known() -> None:
    sent, reply = ask(RotctlDriver(), Identify(), STATE_1)
    assert sent == b"\\dump_state\n"
    assert isinstance(reply, AcuIdentity)
    assert reply.is_simulated
    assert beyond_own_limits(reply, AxisLimits(-180, 450, 6, 6), AxisLimits(0, 90, 3, 3)) == ""
    for beyond in ((-181, 450, 0, 90), (-180, 451, 0, 90), (-180, 450, -1, 90), (-180, 450, 0, 181)):
        azimuth, elevation = AxisLimits(*beyond[:2], 6, 6), AxisLimits(*beyond[2:], 3, 3)
        assert beyond_own_limits(reply, azimuth, elevation).count("set min_deg and max_deg") == 1, beyond


def test_a_server_of_protocol_0_tells_the_same_without_an_end() -> None:
    reply = ask(RotctlDriver(), Identify(), b"0\n603\n0.000000\n450.000000\n0.000000\n180.000000\n")[1]
    assert isinstance(reply, AcuIdentity)
    assert not reply.is_simulated
    assert reply.azimuth is not None
    assert (reply.azimuth.min_deg, reply.azimuth.max_deg) == (0.0, 450.0)


def test_a_server_that_does_not_know_the_question_is_taken_for_a_real_rotator() -> None:
    driver = RotctlDriver()
    for now_s in (0.0, 2.0):
        assert driver.begin(Identify(), now_s) == b"\\dump_state\n"
        driver.fail(now_s + 1.0)
        assert ask(driver, Poll(), b"1.0\n2.0\n", now_s + 1.5)[1] is not None
    reply = ask(driver, Identify(), b"", 4.0)[1]
    assert isinstance(reply, AcuIdentity)
    assert (reply.is_known, reply.is_simulated) == (True, False)


def test_what_a_rotator_has_not_is_answered_without_asking_it() -> None:
    driver = RotctlDriver()
    assert ask(driver, ReadFaults(), b"") == (b"", FaultReport())
    for command in (SelectBackup(Backup.REMOTE), SelectMode(AcuMode.AUTOTRACK)):
        sent, reply = ask(driver, command, b"")
        assert sent == b""
        assert isinstance(reply, Refused)
