"""What of a signal is learnt: whose it is, since when, for how long, and what of it carries the path; case by case."""

from itertools import product
from typing import Any

import numpy as np
import pytest
from memories import remembering

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.receiver_signal import ReceiverSignal, SignalRules
from acu_daemon.control.state import ControlState, PathOffset, Signal
from acu_daemon.control.tick_input import Observation, PassPlan, Sky, TickInput
from acu_daemon.control.tracking.path_offset import (
    GAIN,
    OFFSET_STATES,
    drop_unusable_offset,
    forget_other_pass,
    is_heard_beside,
    learn_of_signal,
    learned_offset,
)
from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.model import AxisLimits, Model, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope

NOW = 1000.0
CONFIG = ControlConfig(
    Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)),
    lock_dwell_s=2.0,
    search_along_s=4.0,
    search_across_deg=1.0,
    receiver=SignalRules(6.0, 4.0, 2.0),
)
PLAN = PassPlan(900.0, 1500.0, 900.0, 40.0, 5.0)


def path(model: Model = Model.ELEMENTS) -> Prediction:
    """Level at 60 deg, 0.2 deg/s in azimuth: 0.1 deg/s on the sky; 100 deg now."""
    t = np.arange(-50.0, 51.0)
    az, el, rate = 100.0 + 0.2 * t, np.full(t.size, 60.0), np.full(t.size, 0.2)
    return Prediction(NOW - 50.0, 1.0, az, el, rate, 0.0 * t, az, rate, "TLE", NOW, model=model)


def learnt(
    state: ControlState, *, is_acquired: bool = True, at: tuple[float, float] = (100.0, 60.0), **more: Any
) -> tuple[Signal, list[str]]:
    mode = AcuMode.AUTOTRACK if is_acquired else AcuMode.REMOTE
    status = AcuStatus(*at, mode, is_acquired=is_acquired)
    seen = Observation(Reading(NOW, *at, is_acquired), status, **more)
    events: list[Any] = []
    after = learn_of_signal(state, TickInput(seen, Sky(path(), None, PLAN), NOW), CONFIG, events)
    return after.signal, [one.name for one in events]


@pytest.mark.parametrize("track", TrackState)
def test_a_signal_is_the_satellites_where_autotrack_holds_it_or_program_track_is_told_of_it(track: TrackState) -> None:
    for is_acquired, is_locked, since_s, has_acquired, has_locked in product(
        (False, True), (False, True), (None, 998.5, 998.0), (False, True), (False, True)
    ):
        state = remembering(
            track=track,
            acquired_since_tai_s=since_s,
            has_acquired=has_acquired,
            has_locked=has_locked,
            receiver=ReceiverSignal(NOW, 9.0, is_locked),
        )
        is_ours = (is_acquired and track in AUTOTRACKING) or (is_locked and track is TrackState.PROGRAM)
        signal, _ = learnt(state, is_acquired=is_acquired)
        assert signal.acquired_since_tai_s == ((since_s or NOW) if is_ours else None)
        assert signal.has_acquired is (has_acquired or is_ours)
        assert signal.has_locked is (has_locked or (is_ours and since_s == 998.0))
        assert (signal.offset is not None) is (is_ours and track is TrackState.AUTOTRACK_TLE)


@pytest.mark.parametrize(
    ("age_s", "is_locked", "is_heard"), [(2.0, True, True), (2.001, True, False), (0.0, False, False)]
)
def test_a_receiver_beside_is_heard_while_its_word_counts(age_s: float, is_locked: bool, is_heard: bool) -> None:
    state = remembering(receiver=ReceiverSignal(NOW - age_s, 9.0, is_locked))
    assert is_heard_beside(state, NOW, CONFIG) is is_heard
    assert not is_heard_beside(state, NOW, ControlConfig(CONFIG.envelope))


@pytest.mark.parametrize("along_s", [-3.9, -1.0, 0.0, 1.0, 3.9, -4.1, 4.1])
@pytest.mark.parametrize("across_deg", [-0.9, 0.0, 0.9, -1.1, 1.1])
def test_an_offset_is_late_and_right_positive_smoothed_and_no_larger_than_a_search_would_look(
    along_s: float, across_deg: float
) -> None:
    """Late: the azimuth of seconds ago; right of a motion to the right: below."""
    at = 100.0 - 0.2 * along_s, 60.0 - across_deg
    is_taken = abs(along_s) < 4.0 and abs(across_deg) < 1.0
    tracking = remembering(track=TrackState.AUTOTRACK_TLE)
    signal, events = learnt(tracking, at=at)
    assert events == ([] if is_taken else ["offset.refused"])
    assert signal.is_offset_refused is not is_taken
    old = PathOffset(2.0, -0.5, Model.ELEMENTS)
    before = remembering(tracking, offset=old, is_offset_refused=True)
    smoothed, told = learnt(before, at=at)
    assert told == []  # a refusal is told once
    if not is_taken:
        assert (signal.offset, smoothed.offset) == (None, old)
        return
    assert signal.offset is not None
    assert smoothed.offset is not None
    assert (signal.offset.along_s, signal.offset.across_deg) == pytest.approx((along_s, across_deg), abs=0.03)
    expected = 2.0 + GAIN * (signal.offset.along_s - 2.0), -0.5 + GAIN * (signal.offset.across_deg + 0.5)
    assert (smoothed.offset.along_s, smoothed.offset.across_deg) == pytest.approx(expected)
    assert not smoothed.is_offset_refused
    other = remembering(tracking, offset=PathOffset(2.0, -0.5, Model.LAST_PASS))
    assert learnt(other, at=at)[0].offset == signal.offset  # of another model: begun anew
    assert learnt(before, at=at, is_in_step=False)[0].offset == old


@pytest.mark.parametrize("track", TrackState)
def test_an_offset_carries_the_path_of_its_own_model_in_the_states_that_go_by_it(track: TrackState) -> None:
    state = remembering(track=track, offset=PathOffset(2.0, -0.5, Model.ELEMENTS))
    assert learned_offset(state, Sky(path())) == ((2.0, -0.5) if track in OFFSET_STATES else None)
    assert learned_offset(state, Sky(path(Model.LAST_PASS))) is None
    assert learned_offset(state, Sky()) is None
    assert learned_offset(remembering(track=track), Sky(path())) is None


@pytest.mark.parametrize("offset", [(np.nan, 0.0), (0.0, np.inf), (1.0, 2.0), None])
def test_an_offset_that_is_not_finite_is_dropped_and_told(offset: tuple[float, float] | None) -> None:
    kept = None if offset is None else PathOffset(*offset, Model.ELEMENTS)
    state, refused = drop_unusable_offset(remembering(offset=kept), "")
    is_dropped = offset is not None and not np.isfinite(sum(offset))
    assert (state.signal.offset, refused) == ((None, "offset") if is_dropped else (kept, ""))


@pytest.mark.parametrize(("known_s", "is_forgotten"), [(None, False), (900.0, False), (800.0, True)])
def test_another_pass_knows_nothing_of_the_signal_before(known_s: float | None, is_forgotten: bool) -> None:
    state = remembering(pass_rise_tai_s=known_s, has_acquired=True, has_locked=True)
    signal = forget_other_pass(state, Sky(None, None, PLAN)).signal
    assert signal == Signal(pass_rise_tai_s=900.0, has_acquired=not is_forgotten, has_locked=not is_forgotten)
    assert forget_other_pass(state, Sky()) is state
