"""P1, P6 in flight: an axis fails, a person disarms, somebody else steers, the register watchdog bites."""

from functools import cache

import pytest
from flights import (
    ORDERS,
    RISING_ANTENNA,
    RISING_TAI_S,
    climb,
    commands_between,
    demo_target,
    events_named,
    seconds_to_state,
    sky_of,
    state_at,
    worst_error_deg,
)

from acu_daemon.acu.commands import READS, AcuMode, Backup, SelectBackup, SelectMode, Stop
from acu_daemon.cli.virtual_pass import Flight, ScriptAccess
from acu_daemon.drivers.sa3842.messages import (
    Command,
    Nak,
    Parameter,
    ReadParameter,
    ReadRegisters,
    Reply,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.sim.acu import FakeAcu

QUESTIONS = (*READS, ReadRegisters, ReadParameter)  # on the wire
T = RISING_TAI_S
FAULT_S, LOST_S, END_S = 15.0, 12.0, 30.0
HOLD_DEG = 0.1
TICK_PART_S = 0.06  # a tick's snapshot comes after its exchanges


def says(line: str):
    """A person's word to the running daemon."""
    return lambda stage: (stage.service.answer(line), None)[1]


def acu_hears(*commands: Command):
    """What another hand tells the ACU."""

    def action(stage: ScriptAccess) -> None:
        for command in commands:
            stage.acu.answer(command)

    return action


@cache
def failing(fault: str, is_lost: bool = True) -> Flight:
    losses = [(LOST_S, END_S + 30.0)] if is_lost else []
    return climb(END_S, losses=losses, faults=[f"{fault} start_s={FAULT_S} duration_s=60"])


LATCHES = {
    "stuck axis=elevation": "elevation stands still away from its command",
    "reversed axis=elevation": "elevation moves away from its command",
    "reversed axis=azimuth": "azimuth moves away from its command",
    "runaway axis=azimuth": "azimuth moves away from its command",
}


@pytest.mark.long
@pytest.mark.parametrize("fault", LATCHES)
def test_p6_a_failing_axis_is_stopped_and_latched_and_nothing_moves_it_any_more(fault: str) -> None:
    flight = failing(fault)
    [event] = events_named(flight, "axis.latched")
    assert event["problem"] == LATCHES[fault] == flight.snapshots[-1].latch
    latched_tai_s = next(seen.tai_s for seen in flight.snapshots if seen.latch)
    sent = commands_between(flight, latched_tai_s - TICK_PART_S, T + END_S - 0.2)
    assert [command for command in sent if not isinstance(command, QUESTIONS)] == [Stop()]
    assert state_at(flight, T + END_S) == "FAULT"


@pytest.mark.parametrize("fault", [fault for fault in LATCHES if "stuck" not in fault])
def test_p6_a_reversed_or_runaway_axis_moves_less_than_ten_degrees_before_it_is_stopped(fault: str) -> None:
    flight = failing(fault)
    angles = [row for row in flight.rows if row.tai_s >= T + FAULT_S]
    latched_tai_s = next(seen.tai_s for seen in flight.snapshots if seen.latch)
    before = [row for row in angles if row.tai_s <= latched_tai_s + 0.1]
    assert latched_tai_s - T - FAULT_S < 3.0
    assert max(abs(row.encoder_el_deg - angles[0].encoder_el_deg) for row in before) < 10.0
    assert max(abs(row.encoder_az_deg - angles[0].encoder_az_deg) for row in before) < 13.0
    assert all(row.mode is AcuMode.STANDBY for row in angles if row.tai_s > latched_tai_s + 0.2)


def test_p6_a_runaway_in_autotrack_is_latched_too() -> None:
    assert failing("runaway axis=azimuth", is_lost=False).snapshots[-1].latch


@pytest.mark.long
def test_p6_cleared_while_the_axis_still_fails_it_is_latched_again_and_cleared_when_mended_it_goes_on() -> None:
    flight = climb(
        60.0,
        losses=[(LOST_S, 58.0)],
        faults=[f"stuck axis=elevation start_s={FAULT_S} duration_s=25"],
        script=[(26.0, says("clear")), (44.0, says("clear"))],
    )
    assert len(events_named(flight, "axis.latched")) == 2
    assert len(events_named(flight, "latch.cleared")) == 2
    assert flight.snapshots[-1].latch == ""
    assert worst_error_deg(flight, T + 52.0, T + 57.0) < HOLD_DEG


@pytest.mark.long
@pytest.mark.parametrize("fault", ["slow-drive axis=both", "wind axis=both", "backlash axis=both", "encoder-jump"])
def test_p6_a_slow_drive_wind_backlash_and_a_slipped_encoder_latch_nothing(fault: str) -> None:
    assert failing(fault).snapshots[-1].latch == ""


def test_a_frozen_encoder_in_autotrack_is_an_alarm_its_readings_are_not_fitted_and_the_pass_goes_on() -> None:
    flight = failing("frozen-encoder axis=elevation", is_lost=False)
    assert events_named(flight, "encoder.frozen")
    assert flight.snapshots[-1].encoder_problem == "elevation encoder frozen"
    assert flight.snapshots[-1].latch == ""
    assert state_at(flight, T + END_S) == "AUTOTRACK/FITTED"
    assert worst_error_deg(flight, T + FAULT_S, T + END_S) < 0.5


# Arming


def test_p1_with_manual_arming_nothing_is_written_until_a_person_arms() -> None:
    flight = climb(20.0, demo_target(safety={"arm": "manual"}), script=[(8.0, says("arm"))])
    assert all(isinstance(command, QUESTIONS) for command in commands_between(flight, T, T + 8.0))
    assert {row.encoder_az_deg for row in flight.rows if row.tai_s < T + 8.0} == {RISING_ANTENNA.azimuth_deg}
    first = next(command for _, command in flight.commands if isinstance(command, ORDERS))
    assert isinstance(first, WriteRegisters)
    assert state_at(flight, T + 20.0) == "AUTOTRACK/FITTED"


@pytest.mark.long
def test_p1_disarmed_in_mid_pass_the_antenna_stands_and_armed_again_it_goes_back_to_the_fit() -> None:
    flight = climb(40.0, losses=[(LOST_S, 38.0)], script=[(15.0, says("disarm")), (25.0, says("arm"))])
    sent = [command for command in commands_between(flight, T + 15.005, T + 25.0) if not isinstance(command, QUESTIONS)]
    assert sent == [Stop(), WriteParameter("W", 0)]
    assert flight.states()[-3:] == ["IDLE", "HOLD/FITTED", "AUTOTRACK/FITTED"]
    assert worst_error_deg(flight, T + 30.0, T + 38.0) < HOLD_DEG


def test_p1_disarmed_it_ends_without_another_stop() -> None:
    flight = climb(20.0, script=[(12.0, says("disarm"))])
    assert [
        command for command in commands_between(flight, T + 14.0, T + 21.0) if not isinstance(command, QUESTIONS)
    ] == []


@pytest.mark.long
def test_a_stop_by_another_hand_in_mid_pass_is_respected_until_a_person_arms() -> None:
    flight = climb(45.0, losses=[(LOST_S, 43.0)], script=[(15.05, acu_hears(Stop())), (25.0, says("arm"))])
    assert events_named(flight, "disarmed")[0]["by"] == "another hand that stopped the antenna"
    assert {row.mode for row in flight.rows if T + 15.1 < row.tai_s < T + 25.0} == {AcuMode.STANDBY}
    assert worst_error_deg(flight, T + 30.0, T + 43.0) < HOLD_DEG


# Shadow


def somebody_steers(stage: ScriptAccess) -> None:
    az_deg, el_deg, _ = sky_of(demo_target()).direction(stage.clock.tai_s() + 2.0) or (0.0, 0.0, 0.0)
    for command in (WriteRegisters(az_deg, el_deg), SelectBackup(Backup.REMOTE), SelectMode(AcuMode.AUTOTRACK)):
        stage.acu.answer(command)


@pytest.fixture(scope="module")
def shadow() -> Flight:
    return climb(40.0, losses=[(25.0, 28.0)], script=[(5.0, somebody_steers), (20.0, says("arm"))], is_shadow=True)


@pytest.mark.long
def test_p1_a_shadow_sends_nothing_but_questions(shadow: Flight) -> None:
    assert all(isinstance(command, QUESTIONS) for _, command in shadow.commands)
    assert shadow.outcome is not None
    assert (shadow.outcome.write_count, shadow.outcome.is_stopped) == (0, True)


def test_the_states_of_a_shadow_follow_what_the_acu_does(shadow: Flight) -> None:
    states = shadow.states()
    assert states[:3] == ["IDLE", "ACQUIRE/TLE", "AUTOTRACK/TLE"]
    assert states[-2:] == ["AUTOTRACK/FITTED", "HOLD/FITTED"]  # nobody refreshed the registers for the loss
    assert {seen.arming for seen in shadow.snapshots} == {"shadow"}


def test_a_shadow_shows_what_it_would_have_written(shadow: Flight) -> None:
    seen = next(one for one in shadow.snapshots if one.tai_s > T + 22.0)
    truth = sky_of(demo_target()).direction(seen.tai_s + 0.07)
    assert truth is not None
    assert seen.command_az_deg == pytest.approx(truth[0], abs=0.2)
    assert seen.command_el_deg == pytest.approx(truth[1], abs=0.2)


# The register watchdog


def parameter_w(acu: FakeAcu) -> int:
    reply = acu.answer(ReadParameter("W"))
    assert isinstance(reply, Parameter)
    return reply.code


class Kept(FakeAcu):
    """Can be asked after the flight."""

    made: list[FakeAcu]

    def __init__(self, parts) -> None:
        super().__init__(parts)
        type(self).made = [self]


def w_at(at_s: float, seen: list[int]):
    return (at_s, lambda stage: seen.append(parameter_w(stage.acu)))


@pytest.mark.long
def test_p4_the_register_watchdog_is_set_for_the_pass_again_after_a_power_cycle_and_cleared_at_the_end() -> None:
    codes: list[int] = []
    power_cycle = (12.05, lambda stage: stage.acu.power_cycle(stage.clock.tai_s()))
    flight = climb(25.0, make_acu=Kept, script=[w_at(5.0, codes), power_cycle, w_at(12.06, codes), w_at(20.0, codes)])
    assert codes == [250, 0, 250]
    assert parameter_w(Kept.made[-1]) == 0
    assert state_at(flight, T + 25.0) == "AUTOTRACK/FITTED"


@pytest.mark.long
def test_p4_a_silent_host_in_a_loss_is_stopped_by_the_acu_and_a_new_link_goes_on() -> None:
    def cut(is_cut: bool):
        return lambda stage: setattr(stage.link, "is_cut", is_cut)

    flight = climb(45.0, losses=[(12.0, 43.0)], script=[(15.0, cut(True)), (25.0, cut(False))])
    modes = {row.mode for row in flight.rows if T + 20.2 < row.tai_s < T + 24.9}
    assert modes == {AcuMode.STANDBY}
    assert not events_named(flight, "disarmed")
    assert seconds_to_state(flight, "HOLD/FITTED", T + 25.0) < 3.0
    assert worst_error_deg(flight, T + 32.0, T + 43.0) < HOLD_DEG


@pytest.mark.long
def test_p4_a_watchdog_left_on_by_a_predecessor_hurts_nothing() -> None:
    def left(stage: ScriptAccess) -> None:
        stage.acu.answer(WriteParameter("W", 50))

    flight = climb(20.0, demo_target(safety={"register_watchdog_s": 0.0}), script=[(0.0, left)])
    assert state_at(flight, T + 20.0) == "AUTOTRACK/FITTED"
    assert not any(command == ReadParameter("W") for _, command in flight.commands)


class Stubborn(FakeAcu):
    """Refuses every WRITE PARAMETER, and has a sector preference."""

    def answer(self, command: Command) -> Reply:
        if command == ReadParameter("S"):
            return Parameter("S", 1)
        return Nak() if isinstance(command, WriteParameter) else super().answer(command)


@pytest.mark.long
def test_an_acu_that_refuses_write_parameter_is_warned_of_once_and_tracked() -> None:
    flight = climb(25.0, make_acu=Stubborn)
    assert len(events_named(flight, "acu.sector_refused")) == 1
    assert len(events_named(flight, "acu.watchdog_refused")) == 1
    assert state_at(flight, T + 25.0) == "AUTOTRACK/FITTED"
