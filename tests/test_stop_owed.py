"""P1, P6: a STOP that is owed, and the end of the watchdog, are not lost by another word, a refusal or the end."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from flights import RISING_TAI_S, climb, commands_between
from memories import remembering
from promise_rig import Rig, demo_scene
from test_safety import GUARDED, latched, moving
from test_tick import FITTED, NOW, SKY, saw, status

from acu_daemon.acu.commands import READS, AcuMode, Command, SetWatchdog, Stop
from acu_daemon.acu.replies import AcuStatus, Refused, Reply
from acu_daemon.cli.virtual_pass import ScriptAccess as Rigged
from acu_daemon.control.safety.arming import begin_run
from acu_daemon.control.state import ControlState, Held, StartStage, Watchdog
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, Request, TickInput
from acu_daemon.drivers.sa3842.messages import ReadParameter, ReadRegisters
from acu_daemon.pointing.axis import AxisState

T = RISING_TAI_S
SILENT_S = 9.0


def asked(state: ControlState, *requests: Request) -> ControlState:
    """What a person says while the link is down."""
    return tick(state, TickInput(Observation(silence_s=SILENT_S, requests=requests), SKY, NOW), GUARDED)[0]


@pytest.mark.parametrize(
    "requests",
    [
        (Request.DISARM,),
        (Request.DISARM, Request.ARM),
        (Request.DISARM, Request.CLEAR),
    ],
    ids=lambda requests: " ".join(requests),
)
def test_p6_the_stop_of_a_latch_that_was_not_acknowledged_yet_outlives_what_a_person_says(requests) -> None:
    assert asked(latched(), *requests).arming.is_stop_due
    assert asked(remembering(latched(), in_force=None), *requests).arming.is_stop_due  # started again


def test_p1_disarmed_in_a_daemon_that_was_started_again_what_the_one_before_has_moved_is_stopped() -> None:
    assert asked(remembering(moving(), in_force=None), Request.DISARM).arming.is_stop_due
    assert not asked(remembering(moving(), in_force=None, held=None), Request.DISARM).arming.is_stop_due  # another's


@pytest.mark.parametrize(
    ("is_due", "is_held", "by_people"), list(product((True, False), (True, False), (True, False, None)))
)
@pytest.mark.parametrize("daemon", ["armed", "disarmed", "resting", "shadow"])
def test_p1_a_run_owes_the_stop_that_was_left_owing_and_a_resting_one_that_of_whoever_held_the_antenna(
    daemon: str, is_due: bool, is_held: bool, by_people: bool | None
) -> None:
    kinds = {"is_shadow": daemon == "shadow", "is_resting": daemon == "resting", "is_armed": daemon != "disarmed"}
    config = replace(GUARDED, **kinds)
    left = remembering(is_stop_due=is_due, held=Held() if is_held else None, by_people=by_people)
    is_armed = daemon == "armed" if by_people is None else by_people and daemon in ("armed", "disarmed")
    is_owed = {
        "shadow": False,
        "resting": is_held,  # it commands nothing in the passes to come before it was armed for them
        "armed": is_due and (is_armed or is_held),
        "disarmed": is_due and (is_armed or is_held),
    }[daemon]
    assert begin_run(left, config).arming.is_stop_due is is_owed


@pytest.mark.parametrize("requests", [(Request.CLEAR,), (Request.DISARM, Request.CLEAR, Request.ARM)])
def test_cleared_and_armed_the_daemon_goes_on_and_owes_no_stop(requests) -> None:
    assert not asked(latched(), *requests).arming.is_stop_due


@pytest.mark.parametrize("request_", [Request.ARM, Request.CLEAR])
def test_p1_armed_or_cleared_nothing_of_the_registers_before_is_gone_on_from(request_: Request) -> None:
    before = remembering(latched(), axis_az=AxisState(200.0, 5.0), axis_el=AxisState(60.0, 2.0), was_followed=True)
    before = remembering(before, by_people=False) if request_ is Request.ARM else before
    state, _ = tick(before, TickInput(saw(status(AcuMode.REMOTE), requests=(request_,)), FITTED, NOW), GUARDED)
    assert (state.registers.axis_az, state.registers.axis_el, state.registers.was_followed) == (None, None, False)


def extras(state: ControlState, seen: AcuStatus, reply: Reply | None) -> list[Command | None]:
    """Two seconds against an ACU that gives every extra exchange the same reply, or none."""
    sent: list[Command | None] = []
    extra = None
    for k in range(20):
        observed = saw(seen, extra=extra)
        observed = replace(observed, reading=replace(observed.reading, tai_s=NOW + 0.1 * k))
        state, orders = tick(state, TickInput(observed, FITTED, NOW + 0.1 * (k + 1)), GUARDED)
        extra = Exchange(orders.extra, reply) if orders.extra is not None else None
        sent.append(orders.extra)
    return sent


def test_p6_a_stop_that_was_garbled_into_a_refusal_is_repeated_at_once() -> None:
    assert extras(latched(), status(AcuMode.REMOTE), Refused()).count(Stop()) >= 5


def test_the_register_watchdog_is_cleared_again_when_nobody_answered_but_not_for_ever_when_it_is_refused() -> None:
    disarmed = remembering(moving(), by_people=False, stage=StartStage.REGISTERS_KNOWN)
    cleared = SetWatchdog(0.0)
    assert extras(disarmed, status(AcuMode.STANDBY), None).count(cleared) >= 5
    assert extras(disarmed, status(AcuMode.STANDBY), Refused()).count(cleared) == 1


@pytest.mark.parametrize("known", [Watchdog.SET, Watchdog.REFUSED])
def test_p4_after_a_lost_link_the_register_watchdog_is_asked_for_again_unless_there_is_none(known: Watchdog) -> None:
    lost = asked(remembering(moving(), watchdog=known))
    assert lost.startup.watchdog is (Watchdog.UNKNOWN if known is Watchdog.SET else known)


# In flight


def says(line: str):
    return lambda stage: (stage.service.answer(line), None)[1]


def cut(is_cut: bool):
    return lambda stage: setattr(stage.link, "is_cut", is_cut)


def ends(stage: Rigged) -> None:
    stage.service.stop("SIGTERM")


@pytest.mark.long
@pytest.mark.parametrize("back_s", [18.0, 60.0], ids=["the link comes back", "it does not"])
def test_p1_disarmed_and_ended_while_the_link_is_down_it_is_stopped_or_the_end_is_no_success(back_s: float) -> None:
    script = [(15.0, cut(True)), (16.0, says("disarm")), (17.0, ends), (back_s, cut(False))]
    flight = climb(30.0, losses=[(12.0, 60.0)], script=script)
    is_back = back_s < 30.0
    assert flight.outcome is not None
    assert flight.outcome.is_stopped is is_back
    assert (Stop() in commands_between(flight, T + 16.0, T + 30.0)) is is_back


def test_p1_disarmed_and_ended_before_stop_was_acknowledged_it_is_stopped() -> None:
    silence = "no-reply start_s=14.95 duration_s=0.2"
    flight = climb(30.0, faults=[silence], script=[(15.0, says("disarm")), (15.15, ends)])
    assert Stop() in commands_between(flight, T + 15.15, T + 30.0)


def test_disarmed_and_stopped_it_ends_at_once_though_the_link_is_down() -> None:
    flight = climb(30.0, script=[(12.0, says("disarm")), (15.0, cut(True)), (17.0, ends)])
    assert flight.outcome is not None
    assert flight.outcome.is_stopped
    assert flight.rows[-1].tai_s < T + 18.0


# Of the daemon before


@pytest.mark.parametrize("is_armed", [True, False], ids=["arm = auto", "arm = manual"])
def test_p1_a_latch_of_the_last_run_is_stopped_where_the_daemon_is_armed_and_else_nothing_is_sent(
    tmp_path: Path, is_armed: bool
) -> None:
    (tmp_path / "latch").write_text("azimuth moves away from its command\n2026-08-18T01:00:00Z\n")
    sent: list[Command] = []
    with Rig(tmp_path, demo_scene(), is_armed=is_armed) as rig:
        judge_sent = rig.judge.sent
        rig.judge.sent = lambda command: (sent.append(command), judge_sent(command))[1]  # type: ignore[method-assign]
        rig.wait(2.0)
        rig.end_and_run_again()
        rig.wait(1.0)
    orders = [command for command in sent if not isinstance(command, (*READS, ReadRegisters, ReadParameter))]
    assert set(orders) == ({Stop()} if is_armed else set())


@pytest.mark.long
@pytest.mark.parametrize("after_s", [0.001, 0.15, 0.4])
def test_p4_started_again_after_a_crash_and_ended_at_once_it_stops_what_the_one_before_has_left(
    tmp_path: Path, after_s: float
) -> None:
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(6.0)
        assert rig.acu.status().mode is AcuMode.AUTOTRACK
        rig.crash(0.0)
        rig.wait(after_s)
        service, task = rig.service, rig.task
        rig.end_and_run_again()
        assert rig.service is not service
        assert rig.acu.status().mode is AcuMode.STANDBY
        assert task.result().is_stopped


def test_p4_started_again_without_a_link_and_ended_it_stops_what_the_one_before_has_left_once_it_has_one(
    tmp_path: Path,
) -> None:
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(6.0)
        rig.crash(0.0)
        rig.link.is_cut = True
        rig.wait(0.5)
        assert rig.service.snapshot().az_deg is None
        rig.loop.call_later(2.0, setattr, rig.link, "is_cut", False)
        task = rig.task
        rig.end_and_run_again()
        assert rig.acu.status().mode is AcuMode.STANDBY
        assert task.result().is_stopped


@pytest.mark.long
@pytest.mark.parametrize("after_s", [0.001, 0.15, 0.4])
@pytest.mark.parametrize("is_cut", [False, True], ids=["", "the link comes back later"])
def test_p1_disarmed_soon_after_a_crash_it_stops_what_the_one_before_has_left(
    tmp_path: Path, after_s: float, *, is_cut: bool
) -> None:
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(6.0)
        rig.link.is_cut = is_cut
        rig.crash(0.0)
        rig.link.is_cut = is_cut
        rig.wait(after_s)
        rig.ask("disarm")
        rig.wait(1.0)
        rig.link.is_cut = False
        rig.wait(3.0)
        assert rig.acu.status().mode is AcuMode.STANDBY


@pytest.mark.long
@pytest.mark.parametrize("is_latched", [False, True])
def test_p1_disarmed_without_a_link_and_killed_the_next_one_stops_it_and_only_once(
    tmp_path: Path, *, is_latched: bool
) -> None:
    with Rig(tmp_path, demo_scene()) as rig:
        rig.wait(6.0)
        rig.link.is_cut = True
        rig.wait(1.0)
        if is_latched:
            (tmp_path / "latch").write_text("azimuth stands still\n2026-08-18T01:00:00Z\n")
        rig.ask("disarm")
        rig.wait(0.5)
        rig.crash(0.0)
        rig.link.is_cut = False
        rig.wait(3.0)
        assert rig.acu.status().mode is AcuMode.STANDBY
        sent: list[Command] = []
        judge_sent = rig.judge.sent
        rig.judge.sent = lambda command: (sent.append(command), judge_sent(command))[1]  # type: ignore[method-assign]
        rig.crash(0.0)
        rig.wait(3.0)
        assert sent
        assert Stop() not in sent
