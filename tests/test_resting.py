"""Between passes the daemon rests: it polls once a second, commands nothing, and hears people and the ACU."""

from collections import Counter

import pytest
from flights import RISING_ANTENNA, RISING_TAI_S, climb, commands_between, events_named, state_at

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.virtual_pass import Flight, ScriptAccess
from acu_daemon.drivers.sa3842.messages import Identify, Poll, ReadRegisters, SelectMode, Stop

T = RISING_TAI_S


def says(line: str):
    def say(access: ScriptAccess) -> None:
        assert access.service.answer(line).startswith("ok")

    return say


def rest(duration_s: float, **changes: object) -> Flight:
    return climb(duration_s, is_resting=True, **changes)


def test_it_polls_once_a_second_and_writes_nothing():
    flight = rest(120.0)
    assert Counter(type(command) for _, command in flight.commands) == {
        Poll: pytest.approx(120, abs=6),
        Identify: 1,
        ReadRegisters: 1,
    }
    times = [tai_s for tai_s, command in flight.commands if isinstance(command, Poll) and tai_s > T + 5.0]
    assert all(0.9 < later - earlier < 1.1 for earlier, later in zip(times, times[1:], strict=False))
    assert {row.mode for row in flight.rows} == {AcuMode.STANDBY}
    assert flight.outcome is not None
    assert flight.outcome.write_count == 0
    assert {seen.state for seen in flight.snapshots} <= {"IDLE", "LINK-LOST"}
    assert state_at(flight, T + 119.0) == "IDLE"


def test_a_dead_link_is_noticed_within_two_seconds_and_its_return_too():
    flight = rest(60.0, faults=["deaf start_s=20 duration_s=10"])
    lost = next(seen.tai_s for seen in flight.snapshots if seen.tai_s > T + 20.0 and not seen.is_link_up)
    assert lost - T - 20.0 < 2.0
    assert state_at(flight, T + 29.0) == "LINK-LOST"
    assert state_at(flight, T + 35.0) == "IDLE"
    assert len(events_named(flight, "link.lost")) == 1


def test_a_quiet_second_between_two_polls_is_no_silence():
    assert events_named(rest(60.0), "link.lost") == []


def test_people_disarm_and_arm_it_for_the_passes_to_come():
    flight = rest(40.0, script=[(10.0, says("disarm")), (25.0, says("arm"))])
    arming = {round(seen.tai_s - T): seen.arming for seen in flight.snapshots}
    assert (arming[8], arming[13], arming[38]) == ("armed", "disarmed", "armed")
    assert commands_between(flight, T + 5.0, T + 40.0) == [Poll()] * len(commands_between(flight, T + 5.0, T + 40.0))


def test_an_emergency_stop_disarms_it():
    flight = rest(40.0, faults=["emergency-stop start_s=10 duration_s=5"])
    assert flight.snapshots[-1].arming == "disarmed"
    assert flight.snapshots[-1].disarmed_by == "the emergency stop"


def test_an_antenna_that_somebody_else_moves_is_left_alone():
    def somebody_steers(access: ScriptAccess) -> None:
        access.acu.answer(SelectMode(AcuMode.AUTOTRACK))

    flight = rest(40.0, script=[(10.0, somebody_steers)], antenna=RISING_ANTENNA)
    assert flight.rows[-1].mode is AcuMode.AUTOTRACK
    assert not [command for _, command in flight.commands if isinstance(command, Stop | SelectMode)]


def test_a_stop_ends_the_rest_at_once_and_stops_an_antenna_that_somebody_else_moves():
    def somebody_steers(access: ScriptAccess) -> None:
        access.acu.answer(SelectMode(AcuMode.AUTOTRACK))

    flight = rest(30.0, script=[(10.0, somebody_steers), (20.35, says("stop"))], antenna=RISING_ANTENNA)
    stops = [tai_s for tai_s, command in flight.commands if isinstance(command, Stop)]
    assert 0.0 <= stops[0] - T - 20.35 <= 0.2
    assert len(stops) == 1
    seen = flight.snapshots[-1]
    assert (seen.arming, seen.is_stopping, flight.rows[-1].mode) == ("disarmed", False, AcuMode.STANDBY)
    assert seen.stop_sent_utc < seen.stop_confirmed_utc


def test_a_stop_of_a_disarmed_daemon_goes_out_too():
    flight = rest(30.0, script=[(10.0, says("disarm")), (20.0, says("stop"))])
    assert len([command for _, command in flight.commands if isinstance(command, Stop)]) == 1
