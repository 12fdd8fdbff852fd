"""What every driver must do, whatever its ACU (docs/adding-an-acu.md).  A new one goes into driver_benches.BENCHES."""

from dataclasses import replace
from math import isfinite

import pytest
from driver_benches import BENCHES, Bench, OnBench
from hypothesis import given
from hypothesis import strategies as st
from test_tick import CONFIG, NOW, ready
from test_tick import status as of_autotrack

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import (
    STOW_MODES,
    AcuMode,
    Backup,
    Command,
    FreeTurnChoice,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadCommanded,
    ReadFaults,
    ReadTurnChoice,
    ReadWatchdog,
    SelectBackup,
    SelectMode,
    SetWatchdog,
    Stop,
    Stow,
)
from acu_daemon.acu.driver import AcuDriver
from acu_daemon.acu.replies import (
    AcuIdentity,
    AcuStatus,
    Commanded,
    Done,
    FaultReport,
    Refused,
    Reply,
    TurnChoice,
    WatchdogTime,
)
from acu_daemon.control.hear import hear
from acu_daemon.control.tick_input import Arrival, Observation
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.drivers.dialects import DIALECTS
from acu_daemon.units import wrap_180

THERE = PointAt(32.37, 42.26)  # a little beside where every bench begins, azimuth 30, elevation 40
STEP_S = 0.1
SETTLED_S = 5.0
PROMISED: list[tuple[Command, type[Reply], str]] = [  # the reply, and the capability that promises it
    (Poll(), AcuStatus, ""),
    (THERE, Done, ""),
    (Stop(), Done, ""),
    (SelectMode(AcuMode.STANDBY), Done, ""),
    (SelectMode(AcuMode.REMOTE), Done, ""),
    (Identify(), AcuIdentity, ""),
    (ReadFaults(), FaultReport, ""),
    (PointAndPoll(30.5, 40.5), AcuStatus, "has_combined_write"),
    (SelectBackup(Backup.REMOTE), Done, "has_backup"),
    (SelectMode(AcuMode.AUTOTRACK), Done, "has_autotrack"),
    (ReadCommanded(), Commanded, "has_read_back"),
    (ReadTurnChoice(), TurnChoice, "has_turn_choice"),
    (FreeTurnChoice(), Done, "has_turn_choice"),
    (ReadWatchdog(), WatchdogTime, "has_register_watchdog"),
    (SetWatchdog(5.0), Done, "has_register_watchdog"),
    (Stow(), Done, "has_stow"),
]
benches = pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: bench.name)


class Table:
    """A driver and its ACU, and the time that passes between them."""

    def __init__(self, bench: Bench, piece_bytes: int = 1000) -> None:
        self.driver: AcuDriver = bench.driver()
        self.acu: OnBench = bench.acu()
        self.now_s, self.piece_bytes = 0.0, piece_bytes
        self.sent: list[bytes] = []

    def said(self, command: Command) -> bytes:
        """Begin a command; what the ACU says to it, not yet received."""
        self.now_s += STEP_S
        self.sent.append(self.driver.begin(command, self.now_s))
        return self.acu.answer(self.sent[-1], self.now_s) if self.sent[-1] else b""

    def ask(self, command: Command) -> Reply | None:
        said = self.said(command)
        pieces = [said[i : i + self.piece_bytes] for i in range(0, len(said), self.piece_bytes)] or [b""]
        replies = [self.driver.receive(piece, self.now_s + 0.01) for piece in pieces]
        return next((reply for reply in replies if reply is not None), None)

    def status(self) -> AcuStatus:
        status = self.ask(Poll())
        assert isinstance(status, AcuStatus)
        return status

    def lead(self, command: PointAt, for_s: float = SETTLED_S) -> None:
        for _ in range(round(for_s / STEP_S)):
            self.ask(command)

    def off_deg(self, command: PointAt) -> float:
        az_deg, el_deg = self.acu.place(self.now_s)
        return max(abs(wrap_180(az_deg - command.az_deg)), abs(el_deg - command.el_deg))


def test_every_dialect_has_its_bench() -> None:
    without = set(DIALECTS) - {bench.name for bench in BENCHES}
    assert not without, "a line of its own in driver_benches.BENCHES, named as the dialect"


@benches
def test_what_an_acu_can_do_hangs_together(bench: Bench) -> None:
    can = bench.driver().capabilities
    assert can.has_backup or not can.has_autotrack
    assert 0.0 < can.angle_step_deg <= 1.0
    assert can.dead_band_deg >= 0.0
    assert 0.0 < can.reply_deadline_s < can.silence_s <= 10.0


@benches
@pytest.mark.parametrize(("command", "reply", "promise"), PROMISED, ids=lambda one: getattr(one, "__name__", str(one)))
def test_what_is_promised_is_answered_and_what_is_not_is_no_accident(
    bench: Bench, command: Command, reply: type[Reply], promise: str
) -> None:
    table = Table(bench)
    table.status()
    is_promised = not promise or getattr(table.driver.capabilities, promise)
    answer = table.ask(command)
    if is_promised:
        assert isinstance(answer, reply)
    else:
        assert isinstance(answer, reply | Refused)
    assert not table.driver.is_outstanding
    table.status()


@benches
@pytest.mark.parametrize("piece_bytes", [1, 2, 5])
def test_bytes_may_be_cut_anywhere(bench: Bench, piece_bytes: int) -> None:
    whole, cut = Table(bench), Table(bench, piece_bytes)
    for command in (Poll(), Identify(), THERE, Poll(), Stop(), Poll()):
        assert cut.ask(command) == whole.ask(command)


@benches
def test_the_same_questions_are_the_same_bytes(bench: Bench) -> None:
    sent = []
    for _ in range(2):
        table = Table(bench)
        for command, _, promise in PROMISED:
            if not promise:
                table.ask(command)
        sent.append(table.sent)
    assert sent[0] == sent[1]


@benches
def test_an_acu_that_takes_bearings_is_sent_one_whatever_the_turn(bench: Bench) -> None:
    can = bench.driver().capabilities
    if can.is_azimuth_continuous:
        return

    def sent(az_deg: float) -> bytes:
        return bench.driver().begin(PointAt(az_deg, 42.0), 0.0)

    assert sent(392.0) == sent(-328.0) == sent(32.0), "modulo 360"
    assert sent(-0.2 * can.angle_step_deg) == sent(360.0) == sent(0.0), "rounded first, then modulo: 0, never 360"


@benches
def test_one_command_at_a_time(bench: Bench) -> None:
    driver = bench.driver()
    driver.begin(Poll(), 0.0)
    assert driver.is_outstanding
    with pytest.raises(RuntimeError):
        driver.begin(Poll(), 0.1)
    driver.fail(0.2)
    assert not driver.is_outstanding


@benches
def test_the_antenna_goes_where_it_is_told_in_remote_and_its_status_says_so(bench: Bench) -> None:
    table = Table(bench)
    table.ask(THERE)
    assert table.ask(SelectMode(AcuMode.REMOTE)) == Done()
    table.lead(THERE)
    can, status = table.driver.capabilities, table.status()
    assert status.mode is AcuMode.REMOTE
    assert status.follows_registers
    assert 0.0 <= status.az_deg < 360.0
    assert table.off_deg(THERE) <= can.dead_band_deg + 2.0 * can.angle_step_deg
    assert abs(wrap_180(status.az_deg - THERE.az_deg)) <= can.dead_band_deg + 0.2
    assert (status.turns_deg is not None) is can.is_azimuth_continuous


@benches
def test_with_a_stow_it_goes_there_whatever_is_commanded_and_standby_leaves_it(bench: Bench) -> None:
    table = Table(bench)
    if not table.driver.capabilities.has_stow:
        return
    table.ask(THERE)
    table.ask(SelectMode(AcuMode.REMOTE))
    assert table.ask(Stow()) == Done()
    assert table.status().mode in STOW_MODES
    table.lead(THERE)
    assert table.off_deg(THERE) > 1.0
    assert table.status().mode in STOW_MODES
    assert table.ask(SelectMode(AcuMode.STANDBY)) == Done()
    assert table.status().mode is AcuMode.STANDBY


@benches
def test_after_a_stop_it_stands_until_remote_is_selected_whatever_is_commanded(bench: Bench) -> None:
    table, far = Table(bench), PointAt(60.0, 60.0)
    table.ask(SelectMode(AcuMode.REMOTE))
    table.lead(far, 1.0)
    assert table.ask(Stop()) == Done()
    table.lead(far, 1.0)  # it may brake
    az_deg, el_deg = table.acu.place(table.now_s)
    table.lead(far)
    assert table.off_deg(PointAt(az_deg, el_deg)) < 0.1
    assert table.status().mode is AcuMode.STANDBY
    table.ask(SelectMode(AcuMode.REMOTE))
    table.lead(far, 2.0)
    assert table.off_deg(PointAt(az_deg, el_deg)) > 1.0


@benches
def test_with_autotrack_it_takes_the_signal_and_goes_by_command_when_it_is_lost(bench: Bench) -> None:
    table = Table(bench)
    if not table.driver.capabilities.has_autotrack:
        refused = table.ask(SelectMode(AcuMode.AUTOTRACK))
        assert isinstance(refused, Refused)
        assert table.status().mode is not AcuMode.AUTOTRACK
        return
    table.ask(PointAt(30.0, 40.0))
    table.ask(SelectBackup(Backup.REMOTE))
    table.ask(SelectMode(AcuMode.AUTOTRACK))
    status = table.status()
    assert (status.mode, status.is_autotrack_selected, status.is_acquired) == (AcuMode.ACQUIRE, True, False)
    assert status.follows_registers, "backup_selected is REMOTE, of an ACU with no other backup always"
    for _ in range(2):
        table.acu.hears(True)
        table.lead(PointAt(30.0, 40.0), 3.0)
        status = table.status()
        assert (status.mode, status.is_acquired, status.follows_registers) == (AcuMode.AUTOTRACK, True, False)
        table.acu.hears(False)
        table.lead(THERE)
        status = table.status()
        assert (status.mode, status.is_acquired, status.is_autotrack_selected) == (AcuMode.REMOTE_BACKUP, False, True)
        assert table.off_deg(THERE) < 0.2
        table.lead(PointAt(30.0, 40.0))
    assert status.contradictions == ()


@benches
def test_a_reply_that_comes_too_late_is_not_the_next_commands(bench: Bench) -> None:
    table, far = Table(bench), PointAt(60.0, 60.0)
    table.ask(SelectMode(AcuMode.REMOTE))
    table.lead(far, 1.0)
    late = table.said(Poll())
    was_deg = table.off_deg(far)
    table.now_s += min(table.driver.capabilities.reply_deadline_s, 3 * STEP_S)
    table.driver.fail(table.now_s)
    question = table.driver.question(table.now_s + STEP_S)
    assert question is not None
    said = table.said(question)
    assert abs(table.off_deg(far) - was_deg) > 0.1  # the antenna has moved: the late reply is wrong by now
    first = table.driver.receive(late, table.now_s + 0.01)
    if first is None:
        assert table.driver.receive(said, table.now_s + 0.02) is not None
    else:
        assert not table.driver.is_sure
    table.driver.forget()


@pytest.mark.long
@benches
@given(noise=st.lists(st.binary(max_size=60), max_size=8))
def test_noise_is_no_reply_and_raises_nothing_and_the_next_connection_is_clean(
    bench: Bench, noise: list[bytes]
) -> None:
    table = Table(bench)
    table.driver.begin(Poll(), 0.0)
    for piece in noise:
        reply = table.driver.receive(piece, 0.01)
        assert reply is None or isinstance(reply, AcuStatus | Refused)
    if table.driver.is_outstanding:
        table.driver.fail(0.1)
    table.driver.forget()
    table.now_s = 1.0
    for _ in range(4):
        question = table.driver.question(table.now_s)
        if question is not None and table.ask(question) is None:
            table.driver.fail(table.now_s)
    table.status()


@benches
def test_who_it_is_is_said_and_whether_it_is_simulated(bench: Bench) -> None:
    table = Table(bench)
    identity = table.ask(Identify())
    assert isinstance(identity, AcuIdentity)
    assert identity.is_known
    assert identity.is_simulated is bool(table.sent[0]), "the bench says that it is; who is not asked cannot"
    assert identity.text


@benches
@pytest.mark.parametrize("byte_time_s", [0.0, 10 / 9600])
def test_times_and_sizes_are_numbers(bench: Bench, byte_time_s: float) -> None:
    driver = bench.driver()
    timing = driver.timing(byte_time_s)
    for value_s in (timing.sample_delay_s, timing.poll_sample_delay_s, timing.effect_delay_s):
        assert isfinite(value_s)
        assert 0.0 <= value_s < 1.0
    assert driver.wire_bytes(PointAndPoll(0.0, 0.0)) >= 0
    assert driver.extra_bytes >= 0


@pytest.mark.parametrize("can", [Capabilities(), *(bench.driver().capabilities for bench in BENCHES)], ids=repr)
def test_only_readings_of_an_acu_that_autotracks_are_given_to_the_fit(can: Capabilities) -> None:
    """Whatever the status says: an antenna that follows our own commands tells nothing of the satellite."""
    config = replace(CONFIG, acu=can)
    state, count = ready(TrackState.AUTOTRACK_FITTED, of_autotrack()), 0
    for k in range(50):
        arrival = Arrival(Poll(), of_autotrack(), NOW + STEP_S * k)
        state, heard = hear(state, Observation(), arrival, config)
        count += heard.is_to_fit
    assert (count > 0) is can.has_autotrack
    assert count in (0, 40)
