"""What autotrack tells of the path before the first fit: only of this satellite, along and across its track."""

from dataclasses import replace

import numpy as np
import pytest
from flights import RISING_ANTENNA, RISING_TAI_S, demo_target, flight_of, worst_error_deg
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering
from test_daemon_events import NeverFitting
from test_tick import AZ_DEG, CONFIG, EL_DEG, NOW, PLAN, SKY, ready, saw, status

from acu_daemon.acu.commands import AcuMode, PointAndPoll
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.session.prediction import predict
from acu_daemon.control.state import ControlState, PathOffset
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Sky, TickInput
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.tracking.track_frame import beside, extents, offset_of
from acu_daemon.model import Model, Prediction, sky_angle_deg
from acu_daemon.sim.scenario import SkyErrors
from acu_daemon.sim.sky import DelayedPropagator

T = RISING_TAI_S
TRACK_DEG = 0.01
ROUND_TRIP = 0.002  # seconds, degrees


def real_path() -> Prediction:
    """The climb of the demo's pass, 60 s before T to 140 s after it."""
    target = demo_target()
    return predict(target.elements.propagator, target.station.site, T - 60.0, T, "TLE", 168.0, horizon_s=200.0)


PATH = real_path()


@pytest.mark.parametrize("late_s", [-20.0, -8.0, 3.0, 8.0, 20.0])
@pytest.mark.parametrize("at_s", [0.0, 60.0, 110.0])
def test_beside_the_path_is_where_a_satellite_is_seen_that_comes_late(late_s: float, at_s: float) -> None:
    target = demo_target()
    late = DelayedPropagator(target.elements.propagator, late_s)
    seen = encoder_look(late, np.array([T + at_s]), target.station.site, None)
    point = beside(PATH, T + at_s, (late_s, 0.0))
    assert point is not None
    assert sky_angle_deg(point.az_deg, point.el_deg, float(seen.az_deg[0]), float(seen.el_deg[0])) < TRACK_DEG


@given(st.floats(0.0, 110.0), st.floats(-25.0, 25.0), st.floats(-2.0, 2.0))
def test_a_direction_beside_the_path_is_told_as_the_offset_it_was_made_with(
    t: float, along: float, across: float
) -> None:
    point = beside(PATH, T + t, (along, across))
    assert point is not None
    found = offset_of(PATH, T + t, point.az_deg, point.el_deg)
    assert found == pytest.approx((along, across), abs=ROUND_TRIP)


def test_the_rates_beside_the_path_are_those_of_its_places() -> None:
    first, here, last = (beside(PATH, T + 50.0 + k, (5.0 - 0.5 * k, 0.7), pace=-0.5) for k in (-0.05, 0.0, 0.05))
    assert first is not None
    assert here is not None
    assert last is not None
    assert here.az_rate_deg_s == pytest.approx((last.az_deg - first.az_deg) / 0.1, rel=1e-6)
    assert here.el_rate_deg_s == pytest.approx((last.el_deg - first.el_deg) / 0.1, rel=1e-6)


# Learned only of this satellite


def far(az_deg: float = 40.0) -> tuple[float, float]:
    return AZ_DEG + az_deg, EL_DEG


@pytest.mark.parametrize("track", [TrackState.IDLE, TrackState.PREPOSITION, TrackState.MANUAL, TrackState.STOW])
def test_what_is_autotracked_in_another_state_tells_nothing_of_the_path_nor_of_the_satellite(track: TrackState) -> None:
    az_deg, el_deg = far()
    other = replace(status(), az_deg=az_deg, el_deg=el_deg, is_remote_enabled=track is not TrackState.MANUAL)
    state = ready(track, other)
    for k in range(30):
        reading = replace(saw(other).reading, tai_s=NOW - 200.0 + 0.1 * k)  # type: ignore[type-var]
        state, _ = tick(state, TickInput(replace(saw(other), reading=reading), SKY, NOW - 199.9 + 0.1 * k), CONFIG)
    assert (state.signal.offset, state.signal.has_acquired, state.signal.has_locked, state.encoders.problem) == (
        None,
        False,
        False,
        "",
    )


def test_forty_degrees_aside_are_refused_once_told_and_drive_nothing() -> None:
    az_deg, el_deg = far()
    wrong = replace(status(), az_deg=az_deg, el_deg=el_deg)
    state, orders = tick(ready(TrackState.AUTOTRACK_TLE, wrong), TickInput(saw(wrong), SKY, NOW), CONFIG)
    assert [event.name for event in orders.events] == ["offset.refused"]
    assert state.signal.offset is None
    again, orders = tick(state, TickInput(saw(wrong), SKY, NOW + 0.1), CONFIG)
    assert [event.name for event in orders.events] == []
    assert isinstance(orders.first, PointAndPoll)
    assert orders.first.az_deg == pytest.approx(AZ_DEG, abs=0.2)
    held, _ = tick(again, TickInput(saw(status(AcuMode.REMOTE_BACKUP)), SKY, NOW + 0.2), CONFIG)
    assert (held.tracking.track, held.signal.offset) == (TrackState.HOLD_TLE, None)


def test_the_bound_is_the_searchs_or_three_sigma_of_the_elements() -> None:
    assert extents(SKY.prediction, CONFIG) == (CONFIG.search_along_s, CONFIG.search_across_deg)
    assert SKY.prediction is not None
    old = replace(SKY.prediction, spread=(16.0, 0.9))
    assert extents(old, CONFIG) == (48.0, pytest.approx(2.7))
    assert extents(replace(old, spread=(1.0, 0.1)), CONFIG) == (CONFIG.search_along_s, CONFIG.search_across_deg)


def learned() -> ControlState:
    state = remembering(ready(TrackState.AUTOTRACK_TLE, status()), pass_rise_tai_s=PLAN.rise_tai_s)
    return remembering(state, offset=PathOffset(2.0, 0.3, Model.ELEMENTS), has_locked=True, has_acquired=True)


def test_it_is_forgotten_with_the_pass() -> None:
    other = replace(SKY, plan=replace(PLAN, rise_tai_s=NOW - 50.0))
    lost = status(AcuMode.REMOTE_BACKUP)
    kept, _ = tick(learned(), TickInput(saw(lost), SKY, NOW), CONFIG)
    state, _ = tick(learned(), TickInput(saw(lost), other, NOW), CONFIG)
    known = PathOffset(2.0, 0.3, Model.ELEMENTS)
    assert (kept.signal.offset, kept.signal.has_locked, kept.signal.has_acquired) == (known, True, True)
    assert (state.signal.offset, state.signal.has_locked, state.signal.has_acquired) == (None, False, False)


def test_what_was_learned_beside_one_model_is_not_put_beside_another() -> None:
    assert SKY.prediction is not None
    other = Sky(replace(SKY.prediction, model=Model.LAST_PASS), None, PLAN)
    _, orders = tick(learned(), TickInput(saw(status(AcuMode.REMOTE_BACKUP)), other, NOW), CONFIG)
    assert isinstance(orders.first, PointAndPoll)
    assert orders.first.az_deg == pytest.approx(AZ_DEG, abs=0.1)


def test_what_is_learned_beside_another_model_begins_anew_and_beside_the_same_one_is_smoothed() -> None:
    assert SKY.prediction is not None
    beside_path = replace(status(), az_deg=AZ_DEG + 0.2)
    seen = saw(beside_path)
    assert seen.reading is not None
    measured = offset_of(SKY.prediction, seen.reading.tai_s, seen.reading.az_deg, seen.reading.el_deg)
    offsets = []
    for model in (Model.ELEMENTS, Model.LAST_PASS):
        sky = Sky(replace(SKY.prediction, model=model), None, PLAN)
        state, _ = tick(learned(), TickInput(seen, sky, NOW), CONFIG)
        assert state.signal.offset is not None
        assert state.signal.offset.model is model
        offsets.append((state.signal.offset.along_s, state.signal.offset.across_deg))
    assert measured is not None
    same, other = offsets
    assert other == pytest.approx(measured)
    assert same == pytest.approx((2.0 + 0.6 * (measured[0] - 2.0), 0.3 + 0.6 * (measured[1] - 0.3)))


@pytest.mark.long
def test_without_any_fit_what_was_learned_holds_the_path_through_the_pass() -> None:
    """The fit process never answers; the satellite is 3 s late: 0.2 deg of azimuth now, 3 deg a minute later."""
    flight = flight_of(
        demo_target(),
        T,
        130.0,
        antenna=RISING_ANTENNA,
        errors=SkyErrors(along_track_s=3.0, delta_raan_deg=0.02),
        losses=[(15.0, 128.0)],
        make_runner=NeverFitting,
    )
    assert flight.states()[-2:] == ["HOLD/TLE", "AUTOTRACK/TLE"]
    assert worst_error_deg(flight, T + 15.0, T + 128.0) < 0.15
