"""One axis outside its limits, in whole flights: it goes as near as they allow, and the other one follows."""

from functools import cache

import pytest
from flights import (
    DEMO_ANTENNA,
    DEMO_TAI_S,
    RISING_TAI_S,
    SCD_HIGH_TAI_S,
    Flight,
    demo_target,
    events_named,
    flight_of,
    rows_between,
    scd_target,
    sky_of,
    state_at,
    the_pass,
    worst_error_deg,
)

from acu_daemon.cli.options import Target
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.units import wrap_180

AXIS_DEG = 0.1
AZ_DEG = 0.2
HELD_DEG = 0.3  # of the prediction, from 20 s of readings, a minute or two later


def with_elevation(target: Target, **values: float) -> Target:
    """The target at a station whose elevation has other limits."""
    station = target.station
    elevation = station.acu.elevation.model_copy(update=values)
    return Target(
        station.model_copy(update={"acu": station.acu.model_copy(update={"elevation": elevation})}),
        target.satellite,
        target.elements,
    )


@cache
def under_a_ceiling() -> Flight:
    """The climb of the demo's pass below an elevation limit that the satellite crosses 25 s later, the signal lost."""
    target = with_elevation(demo_target(), max_deg=58.0)
    antenna = AcuChoice(azimuth_deg=168.0, elevation_deg=40.0)
    return flight_of(target, DEMO_TAI_S - 40.0, 60.0, antenna=antenna, losses=[(25.0, 90.0)])


@pytest.mark.long
def test_p5_an_elevation_below_the_satellite_is_held_at_its_limit_and_the_azimuth_follows() -> None:
    flight, sky = under_a_ceiling(), sky_of(demo_target())
    beyond = [row for row in flight.rows if (sky.direction(row.tai_s) or (0, 0, 0))[1] > 58.5]
    assert len(beyond) > 100
    for row in beyond:
        truth = sky.direction(row.tai_s)
        assert abs(wrap_180(row.encoder_az_deg - truth[0])) < AXIS_DEG
        assert row.encoder_el_deg == pytest.approx(58.0, abs=AXIS_DEG)
    assert flight.outcome.limited_count > 100
    assert flight.outcome.refusal_count == 0


@cache
def scd_below_66_deg() -> tuple[Flight, Target]:
    """SCD-1 culminates 1.4 deg above this elevation limit."""
    target = with_elevation(scd_target(SCD_HIGH_TAI_S), max_deg=66.0)
    begin_tai_s = the_pass(target, SCD_HIGH_TAI_S).culmination_tai_s - 40.0
    truth = sky_of(target).direction(begin_tai_s)
    antenna = AcuChoice(azimuth_deg=truth[0], elevation_deg=truth[1])
    return flight_of(target, begin_tai_s, 80.0, antenna=antenna), target


@pytest.mark.long
def test_p5_a_satellite_above_the_elevation_limit_for_50_s_is_followed_in_azimuth_and_taken_again_below_it() -> None:
    flight, target = scd_below_66_deg()
    sky = sky_of(target)
    beyond = [(row, sky.direction(row.tai_s)) for row in flight.rows if sky.direction(row.tai_s)[1] > 66.0]
    assert beyond[-1][0].tai_s - beyond[0][0].tai_s == pytest.approx(49.6, abs=0.6)
    assert max(truth[1] for _, truth in beyond) == pytest.approx(67.4, abs=0.05)
    assert max(abs(wrap_180(row.encoder_az_deg - truth[0])) for row, truth in beyond) < AZ_DEG
    assert max(abs(row.encoder_el_deg - min(truth[1], 66.0)) for row, truth in beyond) < AXIS_DEG
    assert worst_error_deg(flight, flight.rows[-1].tai_s - 5.0, flight.rows[-1].tai_s) < AXIS_DEG
    [told] = [one for one in events_named(flight, "pass.beyond_limits") if one["axis"] == "elevation"]
    assert told["for_s"] == pytest.approx(49.6, abs=0.6)
    assert told["what"].startswith("elevation above 66 deg for 50 s, 1989-02-01T")


def test_an_axis_at_its_limit_is_told_once_and_shown_while_it_lasts() -> None:
    flight = under_a_ceiling()
    [event] = events_named(flight, "gate.limited")
    assert event["axis"] == "elevation outside 0 to 58 deg, held at 58"
    assert flight.snapshots[-1].limit_alarm == event["axis"]
    assert flight.snapshots[200].limit_alarm == ""


@pytest.mark.long
def test_with_a_lowest_driven_elevation_above_the_rise_it_prepositions_there_and_takes_the_signal() -> None:
    target = with_elevation(demo_target(), min_deg=7.0)
    rise_tai_s = the_pass(target, RISING_TAI_S).rise_tai_s
    flight = flight_of(target, rise_tai_s - 60.0, 110.0, antenna=AcuChoice(azimuth_deg=100.0, elevation_deg=30.0))
    assert state_at(flight, rise_tai_s - 30.0) == "PREPOSITION"
    waiting = rows_between(flight, rise_tai_s - 10.0, rise_tai_s)
    truth = sky_of(target).direction(rise_tai_s)
    assert all(row.encoder_el_deg == pytest.approx(7.0, abs=AXIS_DEG) for row in waiting)
    assert all(abs(wrap_180(row.encoder_az_deg - truth[0])) < 0.5 for row in waiting)
    assert state_at(flight, rise_tai_s) == "ACQUIRE/TLE"
    assert flight.states()[-1] == "AUTOTRACK/FITTED"
    assert worst_error_deg(flight, rise_tai_s + 45.0, rise_tai_s + 50.0) < AXIS_DEG


@pytest.mark.long
@pytest.mark.parametrize("ends_deg", [(100.0, 250.0), (-10.0, 200.0), (140.0, 300.0)])
def test_an_azimuth_narrower_than_the_pass_stands_at_the_nearer_end_while_the_elevation_follows(ends_deg) -> None:
    """The demo's pass crosses the zenith: its azimuth leaves 168 deg for 348 deg, which these ranges do not hold."""
    target = demo_target(azimuth={"min_deg": ends_deg[0], "max_deg": ends_deg[1]})
    flight = flight_of(target, DEMO_TAI_S, 130.0, antenna=DEMO_ANTENNA, losses=[(20.0, 200.0)])
    sky = sky_of(target)
    for row in rows_between(flight, DEMO_TAI_S + 90.0, DEMO_TAI_S + 125.0):
        truth = sky.direction(row.tai_s)
        assert row.encoder_el_deg == pytest.approx(truth[1], abs=HELD_DEG)
        nearer_deg = min(ends_deg, key=lambda end: abs(wrap_180(end - truth[0])))
        assert row.encoder_az_deg == pytest.approx(nearer_deg, abs=AXIS_DEG)
    assert flight.outcome.refusal_count == 0
    assert flight.snapshots[-1].limit_alarm.startswith("azimuth outside")
