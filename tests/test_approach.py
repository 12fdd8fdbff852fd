"""The antenna is at the rise point before the rise, however slow its drives; where it cannot be, it says how late."""

import numpy as np
import pytest
from flights import DEMO_TAI_S, demo_target, events_named, flight_of, the_pass
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering
from test_tick import AZ_DEG, CONFIG, NOW, SKY, ready, status

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.options import Target, not_covered
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.control.tracking.approach import longest_lead_s, way_s
from acu_daemon.control.tracking.late_arrival import lateness
from acu_daemon.control.tracking.register_limiter import CHASE_ACCELERATION_MARGIN, CHASE_RATE_MARGIN
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import AxisLimits
from acu_daemon.orbit.look import look_at
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.units import wrap_180

SLOW = {"max_rate_deg_s": 1.5, "max_acceleration_deg_s2": 1.0}
ON_POINT_DEG = 0.25
SAID_S = 3.0  # what is said and what is flown may differ by so much


def slow_target(**tracking: float) -> Target:
    return demo_target(azimuth=SLOW, tracking=tracking)


def far_from_rise(before_rise_s: float, until_s: float, target: Target, turn_deg: float) -> Flight:
    """Started so long before the rise and flown until so long after it, the antenna so far from its point."""
    coming = the_pass(target, DEMO_TAI_S)
    start_deg = wrap_180(coming.rise_az_deg)
    antenna = AcuChoice(azimuth_deg=start_deg + turn_deg, elevation_deg=80.0)
    begin_tai_s = coming.rise_tai_s - before_rise_s
    return flight_of(target, begin_tai_s, before_rise_s + until_s, antenna=antenna)


def off_the_rise_point_s(flight: Flight, target: Target) -> float:
    """From the rise on until the antenna is on the path."""
    rise_tai_s = the_pass(target, DEMO_TAI_S).rise_tai_s
    off = [row.tai_s for row in flight.rows if row.beam_error_deg is None or row.beam_error_deg > ON_POINT_DEG]
    return max(off) - rise_tai_s


@pytest.mark.long
@pytest.mark.parametrize("turn_deg", [-170.0, -155.0])
def test_an_azimuth_of_one_and_a_half_degrees_a_second_is_at_the_rise_point_before_the_rise(turn_deg: float) -> None:
    """It needs 127 s for the way, more than a preposition_s of 60 s."""
    target = slow_target(preposition_s=60.0)
    flight = far_from_rise(165.0, 8.0, target, turn_deg)
    rise_tai_s = the_pass(target, DEMO_TAI_S).rise_tai_s
    acquiring = [event for event in events_named(flight, "state.changed") if event["state"] == "ACQUIRE/TLE"]
    assert acquiring
    assert events_named(flight, "pass.late") == []
    assert off_the_rise_point_s(flight, target) < 2.0
    assert min(seen.tai_s for seen in flight.snapshots if seen.state == "ACQUIRE/TLE") < rise_tai_s - 15.0
    assert min(seen.tai_s for seen in flight.snapshots if seen.state == "PREPOSITION") < rise_tai_s - 138.0


def test_started_too_late_it_says_how_many_seconds_and_sets_out_at_once() -> None:
    target = slow_target()
    flight = far_from_rise(60.0, -50.0, target, -170.0)
    (said,) = events_named(flight, "pass.late")
    assert said["late_s"] == pytest.approx(71.0, abs=1.0)
    assert said["azimuth_s"] > said["elevation_s"]
    standing = min(seen.tai_s for seen in flight.snapshots if seen.state == "PREPOSITION")
    assert standing - the_pass(target, DEMO_TAI_S).rise_tai_s < -58.0


@pytest.mark.long
@pytest.mark.parametrize("off_deg", [0.0, 60.0])
def test_started_in_mid_pass_it_says_how_long_after_the_rise_and_until_it_is_on_the_path(off_deg: float) -> None:
    target = demo_target()
    begin_tai_s = the_pass(target, DEMO_TAI_S).rise_tai_s + 60.0
    look = look_at(target.elements.propagator, np.array([begin_tai_s]), target.station.site)
    antenna = AcuChoice(azimuth_deg=wrap_180(float(look.az_deg[0])) - off_deg, elevation_deg=float(look.el_deg[0]))
    flight = flight_of(target, begin_tai_s, 20.0, antenna=antenna)
    assert events_named(flight, "pass.late") == []
    (said,) = events_named(flight, "pass.joined")
    assert said["after_rise_s"] == pytest.approx(60.0, abs=3.0)
    reached_s = off_the_rise_point_s(flight, target) - said["after_rise_s"] if off_deg else 0.0
    assert said["on_path_s"] == pytest.approx(reached_s, abs=SAID_S)
    assert (said["off_path_deg"] > 30.0) == (off_deg > 0.0)


def test_in_mid_pass_the_way_goes_to_the_planned_turn_though_the_bearing_is_the_same() -> None:
    state = remembering(ready(TrackState.PREPOSITION, status(AcuMode.REMOTE)), az_deg=AZ_DEG - 360.0)
    (said,) = lateness(state, SKY, NOW, CONFIG)
    assert said.is_warning
    assert said.fields["off_path_deg"] == pytest.approx(0.0, abs=0.01)
    assert said.fields["on_path_s"] > way_s(360.0, CONFIG.azimuth)


def test_preposition_s_is_a_floor_for_quick_drives() -> None:
    target = demo_target()
    flight = far_from_rise(130.0, -115.0, target, 100.0)
    set_out = min(seen.tai_s for seen in flight.snapshots if seen.state == "PREPOSITION")
    assert set_out - the_pass(target, DEMO_TAI_S).rise_tai_s == pytest.approx(-120.0, abs=1.2)


@given(st.floats(0.1, 540.0), st.floats(0.2, 30.0), st.floats(0.1, 30.0))
def test_the_way_takes_as_long_as_an_axis_that_is_driven_takes(distance: float, rate: float, pull: float) -> None:
    limits = AxisLimits(-270.0, 270.0, rate, pull)
    driven = AxisLimits(-270.0, 270.0, CHASE_RATE_MARGIN * rate, CHASE_ACCELERATION_MARGIN * pull)
    dt_s = way_s(distance, limits) / 400.0
    state, steps = AxisState(0.0), 0
    while abs(state.position_deg - distance) > 0.01 * distance and steps < 1000:
        state, steps = step(state, distance, 0.0, dt_s, driven), steps + 1
    assert steps * dt_s == pytest.approx(way_s(distance, limits), rel=0.15)


def test_an_ephemeris_must_cover_the_approach_from_the_far_end() -> None:
    azimuth, elevation = AxisLimits(-270.0, 270.0, 1.5, 1.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
    assert longest_lead_s(azimuth, elevation, 120.0) == pytest.approx(540.0 / 1.35 + 1.35 / 0.6 + 23.0)
    assert not_covered(slow_target(), the_pass(slow_target(), DEMO_TAI_S), DEMO_TAI_S) == ""
