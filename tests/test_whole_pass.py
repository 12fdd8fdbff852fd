"""Whole passes in virtual time: the real daemon, the real codec, the simulated ACU, pedestal and sky."""

import numpy as np
import pytest
from conftest import needs_data
from flights import (
    DEMO_ANTENNA,
    DEMO_TAI_S,
    climb,
    count,
    demo_target,
    events_named,
    fastest_followed_deg_s,
    flight_of,
    loss,
    register_errors_deg,
    rows_between,
    scd_target,
    shifted,
    sky_of,
    state_at,
    the_pass,
    worst_error_deg,
)
from real_pass import truth_path, truth_span, write_config

from acu_daemon.acu.commands import Stop
from acu_daemon.cli.options import Target, load_target
from acu_daemon.cli.virtual_pass import Flight, fly
from acu_daemon.drivers.sa3842.messages import WriteAndPoll, WriteParameter
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.keyhole import KeyholeRules, SkyPath, follow_path
from acu_daemon.sim.scenario import AcuChoice, Encoder, Scenario, SkyErrors

pytestmark = pytest.mark.long

LEAD_S = 30.0
LOSS_SHARES = (0.25, 0.37)
HALF_BEAM_DEG = 0.5
REGISTER_DEG = 0.1
HOLD_DEG = 0.1
KEYHOLE_S = 7.0  # half the window that the azimuth drive needs for half a turn, with room
AZ_RATE_DEG_S, EL_RATE_DEG_S = 20.0, 5.0


@pytest.fixture(scope="module")
def whole() -> Flight:
    """The demo's pass from 30 s before its rise to the end, through the zenith, with a loss in its climb."""
    target = demo_target()
    coming = the_pass(target, DEMO_TAI_S)
    return flight_of(
        target,
        coming.rise_tai_s - LEAD_S,
        coming.duration_s + 2 * LEAD_S,
        antenna=AcuChoice(azimuth_deg=0.0, elevation_deg=45.0),
        losses=[tuple(LEAD_S + share * coming.duration_s for share in LOSS_SHARES)],
    )


def loss_of_whole() -> tuple[float, float]:
    coming = the_pass(demo_target(), DEMO_TAI_S)
    begin, end = (coming.rise_tai_s + share * coming.duration_s for share in LOSS_SHARES)
    return begin, end


def test_a_whole_pass_goes_through_its_states_in_order(whole: Flight) -> None:
    assert whole.states()[:6] == [
        *("IDLE", "PREPOSITION", "ACQUIRE/TLE", "AUTOTRACK/TLE", "AUTOTRACK/FITTED", "HOLD/FITTED"),
    ]
    assert whole.states()[6] == "AUTOTRACK/FITTED"
    assert whole.states()[-2:] == ["AUTOTRACK/FITTED", "IDLE"]


def test_a_whole_pass_ends_by_itself_with_a_safe_stop(whole: Flight) -> None:
    assert whole.outcome is not None
    assert whole.outcome.reason == "pass over"
    assert whole.outcome.is_stopped
    assert whole.outcome.has_acquired
    assert whole.outcome.has_begun
    assert [command for _, command in whole.commands[-2:]] == [Stop(), WriteParameter("W", 0)]
    assert count(whole, Stop) == 1


def test_the_counts_of_the_outcome_are_those_of_the_wire(whole: Flight) -> None:
    assert whole.outcome is not None
    assert whole.outcome.write_count == count(whole, WriteAndPoll)
    assert whole.outcome.skipped_tick_count == 0
    assert whole.outcome.refit_failed_count == 0
    assert whole.outcome.connect_count == 1


def test_ten_registers_are_written_each_second_of_a_whole_pass(whole: Flight) -> None:
    times = np.array([tai_s for tai_s, command in whole.commands if isinstance(command, WriteAndPoll)])
    assert np.diff(times[1:]) == pytest.approx(0.1, abs=1e-3)  # the first one ends the start, within its tick


def test_no_command_of_a_whole_pass_is_outside_the_limits(whole: Flight) -> None:
    assert all(0.0 <= write.el_deg <= 90.0 for write in whole.writes)
    assert all(-270.0 <= row.encoder_az_deg <= 270.0 for row in whole.rows)
    assert whole.outcome is not None
    assert whole.outcome.refusal_count == 0


def test_registers_that_are_followed_are_never_faster_than_the_axis_even_at_the_zenith(whole: Flight) -> None:
    az_deg_s, el_deg_s = fastest_followed_deg_s(whole)
    assert az_deg_s <= AZ_RATE_DEG_S
    assert el_deg_s <= EL_RATE_DEG_S


def test_registers_stay_on_the_satellite_while_autotrack_holds_it(whole: Flight) -> None:
    begin, end = loss_of_whole()
    sky = sky_of(demo_target())
    assert max(register_errors_deg(whole, sky, whole.rows[0].tai_s + LEAD_S + 15.0, begin)) < REGISTER_DEG
    zenith = the_pass(demo_target(), DEMO_TAI_S).culmination_tai_s
    assert max(register_errors_deg(whole, sky, end + 10.0, zenith - 15.0)) < REGISTER_DEG


def test_a_loss_of_83_seconds_is_held_on_the_prediction(whole: Flight) -> None:
    begin, end = loss_of_whole()
    assert state_at(whole, begin + 0.25) == "HOLD/FITTED"
    assert state_at(whole, end - 0.1) == "HOLD/FITTED"
    assert worst_error_deg(whole, begin, end) < HOLD_DEG


def test_the_prediction_buffer_never_runs_dry(whole: Flight) -> None:
    filled = [seen.buffer_s for seen in whole.snapshots if seen.buffer_kind]
    assert min(filled) >= 29.0


# The zenith


@pytest.mark.parametrize("late_s", [-0.6, 0.9])
def test_lost_over_the_zenith_the_beam_stays_within_the_keyhole_plan(late_s: float) -> None:
    errors = SkyErrors(along_track_s=late_s, delta_raan_deg=0.015)
    target = demo_target()
    flight = flight_of(target, DEMO_TAI_S, 90.0, antenna=DEMO_ANTENNA, losses=[(35.0, 85.0)], errors=errors)
    plan_deg = worst_of_the_plan_deg(target, errors)
    assert plan_deg > HALF_BEAM_DEG
    assert worst_error_deg(flight, DEMO_TAI_S + 35.0, DEMO_TAI_S + 85.0) < plan_deg + HOLD_DEG
    top = the_pass(target, DEMO_TAI_S).culmination_tai_s + late_s
    assert worst_error_deg(flight, DEMO_TAI_S + 35.0, top - KEYHOLE_S) < HOLD_DEG
    assert worst_error_deg(flight, top + KEYHOLE_S, DEMO_TAI_S + 85.0) < HOLD_DEG
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    az_deg_s, _ = fastest_followed_deg_s(flight)
    assert az_deg_s <= AZ_RATE_DEG_S


@pytest.mark.parametrize(("raan_deg", "late_s"), [(0.035, -0.6), (0.035, 0.4), (-0.01, -0.6)])
def test_autotrack_that_loses_the_satellite_at_the_zenith_is_given_it_back_once_and_keeps_it(
    raan_deg: float, late_s: float
) -> None:
    """Nothing fails but the azimuth drive; a chase that enters the beam too fast would be lost again and again."""
    errors = SkyErrors(along_track_s=late_s, delta_raan_deg=raan_deg)
    antenna = AcuChoice(azimuth_deg=165.0, elevation_deg=72.0)
    flight = flight_of(demo_target(), DEMO_TAI_S + 20.0, 65.0, antenna=antenna, errors=errors)
    rows = rows_between(flight, DEMO_TAI_S + 35.0, DEMO_TAI_S + 85.0)
    assert sum((row.beam_error_deg or 0.0) > HALF_BEAM_DEG for row in rows) * 0.1 < 11.0
    assert flight.states().count("HOLD/FITTED") <= 2
    assert flight.states()[-1] == "AUTOTRACK/FITTED"


def worst_of_the_plan_deg(target: Target, errors: SkyErrors) -> float:
    """The best that the azimuth drive can do on the true path: the keyhole plan of the truth itself."""
    sky = sky_of(target, errors)
    tai_s = np.arange(DEMO_TAI_S + 30.0, DEMO_TAI_S + 90.0, 0.1)
    seen = [sky.direction(float(t)) for t in tai_s]
    az_deg = np.degrees(np.unwrap(np.radians([one[0] for one in seen if one])))
    el_deg = np.array([one[1] for one in seen if one])
    path = SkyPath(az_deg, el_deg, np.gradient(az_deg, 0.1), np.gradient(el_deg, 0.1), 0.1)
    _, crossing = follow_path(path, KeyholeRules(target.station.acu.azimuth.limits()))
    assert crossing is not None
    return crossing.largest_error_deg


# The cable wrap

WRAPS = [(-90.0, 450.0), (-180.0, 180.0), (-270.0, 270.0)]
THROUGH_NORTH = tai_from_utc("1989-02-01T09:13:42Z") + 386.0  # SCD-1 passes through north at 30 deg, eastwards


@pytest.mark.parametrize(("min_deg", "max_deg"), WRAPS[::2])
@pytest.mark.parametrize("found_deg", [-85.0, 10.0, 265.0])
def test_wherever_the_antenna_is_found_it_passes_north_without_unwinding(
    min_deg: float, max_deg: float, found_deg: float
) -> None:
    begin = THROUGH_NORTH - 30.0
    target = scd_target(begin, azimuth={"min_deg": min_deg, "max_deg": max_deg})
    antenna = AcuChoice(azimuth_deg=found_deg, elevation_deg=30.0)
    flight = flight_of(target, begin, 55.0, antenna=antenna, errors=SkyErrors(along_track_s=0.2), losses=[(26.0, 40.0)])
    arrived = begin + 25.0
    assert worst_error_deg(flight, arrived, begin + 55.0) < 0.3
    swing = [row.encoder_az_deg for row in rows_between(flight, arrived, begin + 55.0)]
    assert max(swing) - min(swing) < 30.0


@pytest.mark.parametrize("found_deg", [-170.0, 0.0, 170.0])
def test_with_half_a_turn_either_way_it_waits_on_the_one_turn_that_holds_the_whole_pass(found_deg: float) -> None:
    """SCD-1 goes from 264 through 360 to 404: between -180 and 180 the whole pass fits as -96 to 44."""
    begin = tai_from_utc("1989-02-01T09:13:42Z") + 20.0
    target = scd_target(begin, azimuth={"min_deg": -180.0, "max_deg": 180.0})
    antenna = AcuChoice(azimuth_deg=found_deg, elevation_deg=10.0)
    flight = flight_of(target, begin, 40.0, antenna=antenna, errors=SkyErrors(along_track_s=0.2))
    assert worst_error_deg(flight, begin + 25.0, begin + 40.0) < 0.1
    assert -100.0 < flight.rows[-1].encoder_az_deg < -80.0
    assert all(-180.0 <= row.encoder_az_deg <= 180.0 for row in flight.rows)


def test_a_pass_that_no_turn_holds_is_followed_to_the_stop_then_the_long_way_round_and_never_past_it() -> None:
    begin = THROUGH_NORTH - 15.0
    target = scd_target(begin, azimuth={"min_deg": 0.0, "max_deg": 360.0})
    antenna = AcuChoice(azimuth_deg=340.0, elevation_deg=30.0)
    flight = flight_of(target, begin, 55.0, antenna=antenna, errors=SkyErrors(along_track_s=0.2))
    assert events_named(flight, "pass.wrap")
    assert flight.outcome is not None
    assert flight.outcome.refusal_count == 0
    assert all(0.0 <= row.encoder_az_deg <= 360.0 for row in flight.rows)
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    assert worst_error_deg(flight, begin + 50.0, begin + 55.0) < HOLD_DEG
    assert flight.rows[-1].encoder_az_deg < 20.0


# The calendar


@pytest.mark.parametrize("utc", ["2026-12-31T23:59:59.999Z", "2016-12-31T23:59:60Z", "2028-02-29T00:00:00Z"])
def test_year_end_leap_second_and_leap_day_in_mid_pass_are_ticks_like_any_other(utc: str) -> None:
    moment = tai_from_utc(utc)
    target = shifted(moment)
    coming = the_pass(target, moment)
    assert coming.rise_tai_s < moment - 25.0 < moment + 25.0 < coming.set_tai_s
    seen = look_at(target.elements.propagator, np.array([moment - 20.0]), target.station.site)
    antenna = AcuChoice(azimuth_deg=float(seen.az_deg[0]) % 360.0 - 180.0, elevation_deg=float(seen.el_deg[0]))
    flight = flight_of(
        target, moment - 30.0, 50.0, antenna=antenna, losses=[(27.0, 37.0)], errors=SkyErrors(along_track_s=0.2)
    )
    assert worst_error_deg(flight, moment - 5.0, moment + 20.0) < HOLD_DEG
    times = np.array([tai_s for tai_s, command in flight.commands if isinstance(command, WriteAndPoll)])
    assert np.diff(times[1:]) == pytest.approx(0.1, abs=1e-3)  # the first one ends the start, within its tick
    assert state_at(flight, moment + 5.0) == "HOLD/FITTED"


# Repeatability


def test_a_pass_repeats_bit_for_bit() -> None:
    first, second = (climb(25.0, losses=[(12.0, 20.0)]) for _ in range(2))
    assert first.commands == second.commands
    assert first.snapshots == second.snapshots
    assert first.rows == second.rows


def test_another_seed_gives_another_pass() -> None:
    first, second = (climb(5.0, seed=seed) for seed in (1, 2))
    assert first.commands != second.commands


# Real passes


@needs_data
@pytest.mark.parametrize("name", ["iss-2022-Huntsville-20220211T2156", "jason-1-Svalbard-20030107T1041"])
def test_on_a_real_pass_a_loss_at_culmination_is_held_and_relocked(name: str, tmp_path_factory: pytest.TempPathFactory):
    directory = tmp_path_factory.mktemp(name)
    satellite = write_config(directory, name)
    first, last = (tai_from_utc(utc) for utc in truth_span(name))
    target = load_target(directory, satellite, first)
    sky = sky_of(target, truth=truth_path(name))
    middle = (first + last) / 2
    begin, lost, back = middle - 75.0, middle - 25.0, middle + 35.0
    seen = sky.direction(begin)
    assert seen is not None
    scenario = Scenario(
        encoder=Encoder(noise_deg=0.03),
        acu=AcuChoice(azimuth_deg=seen[0] if seen[0] < 180 else seen[0] - 360.0, elevation_deg=seen[1]),
        losses=(loss(lost, back),),
    )
    flight = fly(target, sky, scenario, begin_tai_s=begin, end_tai_s=back + 5.0)
    assert worst_error_deg(flight, lost, back) < HOLD_DEG
    assert state_at(flight, back + 1.0) == "AUTOTRACK/FITTED"
    assert max(register_errors_deg(flight, sky, begin + 20.0, lost - 0.2)) < REGISTER_DEG
    az_deg_s, el_deg_s = fastest_followed_deg_s(flight)
    assert az_deg_s <= AZ_RATE_DEG_S
    assert el_deg_s <= EL_RATE_DEG_S
