"""The turn of the cable wrap in whole flights: a sector bit not driven, random or stuck; P1 on any range."""

from dataclasses import replace
from functools import cache

import pytest
from flights import (
    DEMO_ANTENNA,
    DEMO_TAI_S,
    RISING_ANTENNA,
    RISING_TAI_S,
    climb,
    demo_target,
    events_named,
    flight_of,
    rows_between,
    seconds_to_state,
    state_at,
    the_pass,
    worst_error_deg,
)

from acu_daemon.acu.commands import AcuMode, SelectMode, Stop
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.drivers.sa3842.messages import Command, Nak, Reply, Status, WriteAndPoll, WriteRegisters
from acu_daemon.pointing.wrap import nearest_turn
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.units import wrap_180

pytestmark = pytest.mark.long

MOVING = (WriteAndPoll, WriteRegisters, SelectMode, Stop)
T = RISING_TAI_S
LSB_DEG = 360.0 / 65536
BITS = ("driven", "undriven", "random", "stuck-0", "stuck-1")


@cache
def on_range(min_deg: float, max_deg: float, az_deg: float, bit: str, mode: str = "remote", el_deg: float = 20.0):
    """A start, the antenna left in REMOTE as by a daemon that crashed: whatever is written moves it."""
    target = demo_target(azimuth={"min_deg": min_deg, "max_deg": max_deg})
    antenna = replace(RISING_ANTENNA, azimuth_deg=az_deg, elevation_deg=el_deg, sector_bit=bit, mode=mode)
    return climb(20.0, target, antenna=antenna, noise_deg=0.0)


def first_write_deg(flight: Flight) -> float:
    return next(command.az_deg for _, command in flight.commands if isinstance(command, WriteRegisters))


@pytest.mark.parametrize("bit", BITS)
@pytest.mark.parametrize(
    ("min_deg", "max_deg", "az_deg"),
    [(0.0, 360.0, 300.0), (-90.0, 270.0, -60.0), (-180.0, 180.0, 170.0), (0.0, 450.0, 300.0), (0.0, 360.0, 360.0)],
)
def test_p1_the_first_write_is_the_present_azimuth_whatever_the_sector_bit(min_deg, max_deg, az_deg, bit) -> None:
    flight = on_range(min_deg, max_deg, az_deg, bit)
    assert abs(wrap_180(first_write_deg(flight) - az_deg)) <= LSB_DEG
    first_s = next(tai_s for tai_s, command in flight.commands if isinstance(command, WriteRegisters))
    before = [row.encoder_az_deg for row in flight.rows if row.tai_s < first_s + 0.1]
    assert max(before) - min(before) <= LSB_DEG
    assert not any(seen.latch for seen in flight.snapshots)
    assert state_at(flight, T + 20.0) == "AUTOTRACK/FITTED"
    assert worst_error_deg(flight, T + 19.0, T + 20.0) < 0.1


def test_p1_an_antenna_an_lsb_beyond_the_lower_end_of_a_whole_turn_is_not_sent_round() -> None:
    flight = on_range(0.0, 360.0, 0.0, "random")
    assert first_write_deg(flight) % 360.0 == 0.0


# A range of more than a turn, and a sector bit that is stuck


class WithoutEnds(FakeAcu):
    """Its limit switches do not show."""

    def status(self) -> Status:
        return replace(super().status(), is_at_cw_limit=False, is_at_ccw_limit=False)


class WithoutUnwinding(WithoutEnds):
    """Refuses a bearing that it would have to go the long way round for."""

    def answer(self, command: Command) -> Reply:
        if isinstance(command, WriteAndPoll) and self._modes.follows_registers:
            here_deg = self.antenna.az.angle_deg
            turn_deg = nearest_turn(command.az_deg % 360.0, here_deg, self.parts.azimuth)
            if turn_deg is None or abs(turn_deg - here_deg) > 180.0:
                return Nak()
        return super().answer(command)


WRONG = {  # range, where the antenna is, the bit, where the nearer stop is then, the half believed
    "bit stuck at 0": ((0.0, 540.0), 500.0, "stuck-0", 1, "turn"),
    "bit stuck at 1": ((-540.0, 0.0), -500.0, "stuck-1", -1, "turn"),
    "the wrap of the template": ((-270.0, 270.0), 200.0, "stuck-0", 1, "turn"),
}
RISE_S, AHEAD_S = 60.0, 100.0


@cache
def believed_wrongly(name: str, rate_deg_s: float = 20.0, acu: type[FakeAcu] = WithoutEnds) -> Flight:
    (min_deg, max_deg), az_deg, bit, _, _ = WRONG[name]
    drive = {"max_rate_deg_s": rate_deg_s, "max_acceleration_deg_s2": rate_deg_s / 2.0}
    target = demo_target(azimuth={"min_deg": min_deg, "max_deg": max_deg} | drive)
    begin_tai_s = the_pass(target, T).rise_tai_s - RISE_S
    antenna = AcuChoice(azimuth_deg=az_deg, elevation_deg=30.0, sector_bit=bit)
    return flight_of(target, begin_tai_s, AHEAD_S, antenna=antenna, make_acu=acu)


def doubted_tai_s(flight: Flight) -> float:
    return next(seen.tai_s for seen in flight.snapshots if seen.turn_alarm.startswith("turn doubted"))


@pytest.mark.parametrize("acu", [WithoutEnds, WithoutUnwinding])
@pytest.mark.parametrize("name", WRONG)
def test_an_antenna_on_another_turn_than_believed_is_told_stopped_and_learned_anew_and_the_pass_is_tracked(
    name: str, acu: type[FakeAcu]
) -> None:
    flight = believed_wrongly(name, acu=acu)
    [event] = events_named(flight, "turn.doubted")
    assert abs(abs(event["az_deg"] - event["other_turn_deg"]) - 360.0) < 1e-6
    assert event["goal_deg"] is not None
    assert event["el_deg"] is not None
    [learned] = events_named(flight, "turn.learned")
    assert learned["by"] == "the antenna follows on it"
    assert not events_named(flight, "axis.latched")
    assert not events_named(flight, "disarmed")
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    assert worst_error_deg(flight, flight.rows[-1].tai_s - 20.0, flight.rows[-1].tai_s) < 0.1


@pytest.mark.parametrize("name", WRONG)
def test_it_stops_the_antenna_first_and_then_moves_it_a_few_degrees_away_from_the_nearer_stop(name: str) -> None:
    flight, side = believed_wrongly(name), WRONG[name][3]
    doubted = doubted_tai_s(flight)
    orders = [command for tai_s, command in flight.commands if tai_s > doubted - 0.05 and isinstance(command, MOVING)]
    assert orders[0] == Stop()
    assert isinstance(orders[1], WriteRegisters)  # the present angles, read back, before anything moves
    learned_tai_s = next(e.tai_s for e in flight.snapshots if e.tai_s > doubted and not e.turn_alarm.startswith("turn"))
    standing = [row for row in flight.rows if doubted < row.tai_s < learned_tai_s and row.mode is AcuMode.STANDBY]
    assert abs(wrap_180(orders[1].az_deg - standing[-1].encoder_az_deg)) < 0.1
    moved = [side * row.encoder_az_deg for row in flight.rows if standing[-1].tai_s <= row.tai_s <= learned_tai_s]
    assert 3.0 < moved[0] - moved[-1] < 7.0
    assert max(moved) <= moved[0] + 0.1


@pytest.mark.parametrize(("az_deg", "bit"), [(270.0, "stuck-0"), (-270.0, "stuck-1")])
def test_a_limit_switch_tells_the_turn_whatever_the_bit_says(az_deg: float, bit: str) -> None:
    antenna = AcuChoice(azimuth_deg=az_deg, elevation_deg=30.0, sector_bit=bit)
    begin_tai_s = the_pass(demo_target(), T).rise_tai_s - RISE_S
    flight = flight_of(demo_target(), begin_tai_s, 60.0, antenna=antenna)
    assert not events_named(flight, "turn.doubted")
    assert events_named(flight, "sector.wrong")
    assert "sector bit is wrong" in flight.snapshots[-1].turn_alarm
    goal_deg = events_named(flight, "pass.planned")[0]["start_az_deg"]
    on_way = [row.encoder_az_deg for row in flight.rows if row.tai_s < begin_tai_s + 50.0]
    assert on_way[-1] == pytest.approx(goal_deg, abs=0.5)
    assert max(on_way) - min(on_way) == pytest.approx(abs(goal_deg - az_deg), abs=1.0)


LOST_S, BACK_S = 20.0, 120.0


def test_a_stop_that_the_path_meets_in_a_loss_of_mid_pass_is_found_out_and_the_signal_taken_when_it_is_back() -> None:
    """Through the zenith, where the azimuth's noise is many degrees, on the other turn than believed."""
    antenna = AcuChoice(azimuth_deg=-192.6, elevation_deg=58.0, sector_bit="stuck-1")
    flight = flight_of(demo_target(), DEMO_TAI_S, 130.0, antenna=antenna, losses=[(LOST_S, BACK_S)])
    assert len(events_named(flight, "turn.doubted")) == len(events_named(flight, "turn.learned")) == 1
    assert not events_named(flight, "axis.latched")
    assert worst_error_deg(flight, DEMO_TAI_S + 95.0, DEMO_TAI_S + BACK_S) < 0.5
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


@pytest.mark.parametrize("bit", BITS)
@pytest.mark.parametrize(("ends_deg", "az_deg"), [((-270.0, 270.0), 168.0), ((-270.0, 270.0), -192.0)])
def test_in_the_pass_a_signal_from_the_right_direction_is_taken_without_a_move_whatever_the_turn(
    ends_deg: tuple[float, float], az_deg: float, bit: str
) -> None:
    target = demo_target(azimuth={"min_deg": ends_deg[0], "max_deg": ends_deg[1]})
    antenna = replace(RISING_ANTENNA, azimuth_deg=az_deg, elevation_deg=18.5, sector_bit=bit)
    flight = climb(20.0, target, antenna=antenna)
    assert seconds_to_state(flight, "AUTOTRACK/TLE", T) < 2.0
    assert worst_error_deg(flight, T + 3.0, T + 20.0) < 0.1
    assert max(abs(row.encoder_az_deg - az_deg) for row in flight.rows) < 0.5


def test_a_sector_bit_that_changes_in_flight_changes_nothing_but_an_alarm() -> None:
    steady, wrong = climb(25.0), climb(25.0, faults=["encoder-turn start_s=8"])
    assert events_named(wrong, "sector.wrong")
    assert not events_named(steady, "sector.wrong")
    assert [row.encoder_az_deg for row in wrong.rows] == [row.encoder_az_deg for row in steady.rows]
    assert "sector bit" in wrong.snapshots[-1].turn_alarm


@pytest.mark.parametrize("seed", range(4))
def test_p1_with_a_random_bit_where_the_turn_is_open_no_register_leaves_the_antenna_at_the_start(seed: int) -> None:
    """Readings on two turns make no rate."""
    target = demo_target(azimuth={"min_deg": -90.0, "max_deg": 450.0, "max_rate_deg_s": 8.0})
    begin_tai_s = the_pass(target, T).rise_tai_s - RISE_S
    antenna = AcuChoice(azimuth_deg=-0.1, elevation_deg=10.0, sector_bit="random", mode="remote")
    flight = flight_of(target, begin_tai_s, 100.0, antenna=antenna, seed=seed)
    places = {round(row.tai_s, 1): row.encoder_az_deg for row in flight.rows}
    written = [(tai_s, one.az_deg) for tai_s, one in flight.commands if isinstance(one, WriteAndPoll | WriteRegisters)]
    for tai_s, az_deg in written[:30]:
        assert abs(wrap_180(az_deg - places[round(tai_s, 1)])) < 15.0
    assert not events_named(flight, "axis.latched")
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


FALSE_ALARMS = ("turn.doubted", "turn.tried", "turn.corrected", "sector.wrong", "azimuth.late", "axis.latched")


@pytest.mark.parametrize("rate_deg_s", [4.0, 8.0])
def test_a_path_that_runs_away_from_a_slow_azimuth_through_the_zenith_makes_no_turn_doubtful(rate_deg_s: float) -> None:
    """The signal is lost 5 s before the zenith: the azimuth falls behind by up to 150 deg, and catches up."""
    target = demo_target(azimuth={"max_rate_deg_s": rate_deg_s})
    flight = flight_of(target, DEMO_TAI_S, 110.0, antenna=DEMO_ANTENNA, losses=[(56.0, 1e3)])
    assert not [event for event in flight.events if event["event"] in FALSE_ALARMS]
    assert worst_error_deg(flight, DEMO_TAI_S + 108.0, DEMO_TAI_S + 110.0) < 0.1


@pytest.mark.parametrize("ends_deg", [(-270.0, 270.0), (0.0, 360.0)])
def test_an_azimuth_that_sticks_beside_the_zenith_is_latched_whether_its_turn_is_sure_or_not(
    ends_deg: tuple[float, float],
) -> None:
    """Above 84 deg, the elevation held: all that its register leads it by is less than a following error on the sky."""
    target = demo_target(azimuth={"min_deg": ends_deg[0], "max_deg": ends_deg[1], "max_rate_deg_s": 8.0})
    flight = flight_of(
        target, DEMO_TAI_S, 85.0, antenna=DEMO_ANTENNA, losses=[(50.0, 1e3)], faults=["stuck start_s=60"]
    )
    [event] = events_named(flight, "axis.latched")
    assert event["problem"] == "azimuth stands still away from its command"
    assert event["el_deg"] > 84.0
    stands = rows_between(flight, DEMO_TAI_S + 62.0, DEMO_TAI_S + 63.0)[0]
    assert abs(event["az_deg"] - stands.encoder_az_deg) < 1.0  # on the turn where it stood all the time
    assert not events_named(flight, "turn.learned")
    assert not events_named(flight, "sector.wrong")
