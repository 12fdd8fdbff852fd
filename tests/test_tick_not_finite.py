"""The whole tick on what is no number: any field of any input not finite never raises, and never reaches a command."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from math import inf, isfinite, nan
from typing import Any

import numpy as np
import pytest
from flights import RISING_TAI_S, climb, demo_target, events_named, worst_error_deg
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering
from test_tick import CONFIG, FITTED, NOW, PLAN, ready, saw, status

from acu_daemon.acu.commands import AcuMode, PointAndPoll, PointAt
from acu_daemon.assist.session.refit import RefitReply, RefitRequest
from acu_daemon.control.orders import Orders
from acu_daemon.control.state import ControlState, PathOffset, StartStage
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Observation, Sky, TickInput
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.model import Correction, FitResult, Model
from acu_daemon.pointing.axis import AxisState

FIT = FitResult("full", Correction(), NOW - 5.0, 40, 0, 0.02, 0.5, 0.01)
SIGMA = np.full(FITTED.prediction.az_deg.size, 0.01)
DRIFT = np.full((2, FITTED.prediction.az_deg.size), 0.01)
SKY = Sky(replace(FITTED.prediction, sigma_deg=SIGMA, spread=(1.0, 0.1), late_drift_deg_s=DRIFT), FIT, PLAN)
NOT_FINITE = (nan, inf, -inf, 1e308, -1e300)
MODES = (AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP, AcuMode.REMOTE, AcuMode.STANDBY, AcuMode.ACQUIRE)


def places(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every field that holds a number or an array of them."""
    if is_dataclass(value):
        for one in fields(value):
            yield from places(getattr(value, one.name), (*path, one.name))
    elif isinstance(value, float | np.ndarray) or (isinstance(value, tuple) and value):
        yield path


def spoiled(value: Any, path: tuple[str, ...], bad: float) -> Any:
    if path:
        return replace(value, **{path[0]: spoiled(getattr(value, path[0]), path[1:], bad)})
    if isinstance(value, np.ndarray):
        return np.full(value.shape, bad)
    return tuple(bad if isinstance(one, float) else one for one in value) if isinstance(value, tuple) else bad


def seen_in(mode: AcuMode) -> Observation:
    return saw(status(mode))


def memory(track: TrackState, mode: AcuMode) -> ControlState:
    state = ready(track, status(mode))
    return remembering(state, axis_az=AxisState(100.0), axis_el=AxisState(40.0), hold_from_tai_s=NOW)


INPUTS = {"seen": seen_in(AcuMode.AUTOTRACK), "sky": SKY}
PLACES = [(name, path) for name, value in INPUTS.items() for path in places(value)]


def check(orders: Orders) -> None:
    for command in (orders.first, orders.extra):
        if isinstance(command, PointAndPoll | PointAt):
            assert isfinite(command.az_deg) and isfinite(command.el_deg)
            assert -270.0 <= command.az_deg <= 270.0
            assert 0.0 <= command.el_deg <= 90.0


@given(
    where=st.sampled_from(PLACES),
    bad=st.sampled_from(NOT_FINITE),
    track=st.sampled_from(sorted(TrackState)),
    mode=st.sampled_from(MODES),
    stage=st.sampled_from([StartStage.READY, StartStage.READY, StartStage.SECTOR_FREE]),
)
def test_p5_one_field_that_is_not_finite_never_raises_and_never_reaches_a_command(where, bad, track, mode, stage):
    name, path = where
    state = remembering(memory(track, mode), stage=stage)
    for k in range(4):
        seen, sky = seen_in(mode), SKY
        if k in (1, 2):
            seen = spoiled(seen, path, bad) if name == "seen" else seen
            sky = spoiled(sky, path, bad) if name == "sky" else sky
        state, orders = tick(state, TickInput(seen, sky, NOW + 0.1 * k), CONFIG)
        check(orders)


@given(bad=st.sampled_from(NOT_FINITE[:3]), track=st.sampled_from(sorted(TrackState)))
def test_p5_without_a_finite_time_it_polls(bad, track):
    state, orders = tick(memory(track, AcuMode.AUTOTRACK), TickInput(seen_in(AcuMode.AUTOTRACK), SKY, bad), CONFIG)
    check(orders)
    assert not isinstance(orders.first, PointAndPoll)
    assert state.refusals.refusal_count == 1


@pytest.mark.parametrize("bad", NOT_FINITE[:3])
@pytest.mark.parametrize("field", ["az_deg", "el_deg", "az_rate_deg_s", "el_rate_deg_s"])
def test_p5_a_prediction_that_is_not_finite_is_refused_and_counted_and_the_last_register_stays(field, bad):
    mode = AcuMode.AUTOTRACK
    state, first = tick(memory(TrackState.AUTOTRACK_FITTED, mode), TickInput(seen_in(mode), SKY, NOW), CONFIG)
    sky = spoiled(SKY, ("prediction", field), bad)
    state, orders = tick(state, TickInput(seen_in(mode), sky, NOW + 0.1), CONFIG)
    assert orders.first == first.first
    assert state.refusals.refusal_count == 1
    assert [event.name for event in orders.events] == ["gate.refused"]
    state, orders = tick(state, TickInput(seen_in(mode), SKY, NOW + 0.2), CONFIG)
    assert isinstance(orders.first, PointAndPoll)
    assert orders.first != first.first


@pytest.mark.parametrize("path", [("status", "az_deg"), ("reading", "el_deg"), ("reading", "tai_s")])
def test_p5_a_status_that_is_not_finite_is_not_taken_and_the_last_one_stays(path):
    mode = AcuMode.AUTOTRACK
    before = memory(TrackState.AUTOTRACK_FITTED, mode)
    state, orders = tick(before, TickInput(spoiled(seen_in(mode), path, nan), SKY, NOW), CONFIG)
    assert (state.intake.status, state.intake.az_deg) == (before.intake.status, before.intake.az_deg)
    assert state.refusals.refusal_count == 1
    assert orders.events[0].fields == {"input": "status", "reason": "not finite"}


@pytest.mark.parametrize("place", ["along_s", "across_deg"])
def test_p5_an_offset_that_is_not_finite_reaches_no_command(place):
    offset = replace(PathOffset(0.1, 0.1, SKY.prediction.model), **{place: nan})
    state = remembering(memory(TrackState.HOLD_TLE, AcuMode.REMOTE_BACKUP), offset=offset)
    sky = replace(SKY, prediction=replace(SKY.prediction, model=Model.ELEMENTS), fit=None)
    seen = saw(replace(status(AcuMode.REMOTE_BACKUP), is_acquired=False))
    state, orders = tick(state, TickInput(seen, sky, NOW), CONFIG)
    check(orders)
    assert state.refusals.refusal_count == 1


class Spoiling(InlineFitRunner):
    """From an instant on, its answers are no numbers."""

    from_tai_s = RISING_TAI_S + 10.0

    async def refit(self, request: RefitRequest) -> RefitReply:
        reply = await super().refit(request)
        if request.now_tai_s < self.from_tai_s:
            return reply
        return replace(reply, prediction=spoiled(reply.prediction, ("el_deg",), nan))


@pytest.mark.long
def test_p5_answers_of_the_fit_that_are_not_finite_are_refused_and_the_last_good_buffer_is_followed() -> None:
    target = demo_target(tracking={"horizon_s": 30.0, "low_water_s": 10.0})  # so that it would run dry
    flight = climb(60.0, target, losses=[(12.0, 58.0)], make_runner=Spoiling)
    assert events_named(flight, "fit.refused")
    assert flight.outcome is not None
    assert flight.outcome.refit_failed_count == len(events_named(flight, "fit.refused"))
    assert flight.outcome.refusal_count == 0
    assert worst_error_deg(flight, RISING_TAI_S + 12.5, RISING_TAI_S + 58.0) < 0.1
    assert min(seen.buffer_s for seen in flight.snapshots[200:]) > 5.0
