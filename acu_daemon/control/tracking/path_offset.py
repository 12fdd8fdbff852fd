"""What autotrack tells of the path before there is a fit, and what it tells of the satellite at all.  Pure.

Only what is held while the table says that it is this pass's satellite counts; another pass knows nothing of it.
Owner of `Signal`.
"""

from dataclasses import replace
from math import isfinite

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, PathOffset, Signal
from acu_daemon.control.tick_input import Sky, TickInput
from acu_daemon.control.tracking.causes import is_acquired
from acu_daemon.control.tracking.search import forget_search
from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.control.tracking.track_frame import extents, is_within, offset_of
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Reading

GAIN = 0.6  # of the newest reading in the smoothed offset: autotrack pulls in quickly

OFFSET_STATES = (TrackState.AUTOTRACK_TLE, TrackState.HOLD_TLE, TrackState.ZENITH, TrackState.AVOID)


def drop_unusable_offset(state: ControlState, refused: str) -> tuple[ControlState, str]:
    """An offset that is not finite carries no path.  refused: what else of a tick's input is not finite."""
    offset = state.signal.offset
    if offset is None or isfinite(offset.along_s + offset.across_deg):
        return state, refused
    return with_parts(state, signal=replace(state.signal, offset=None)), "offset"


def forget_other_pass(state: ControlState, sky: Sky) -> ControlState:
    """What was learned of a satellite in another pass is not this one's."""
    signal = state.signal
    if sky.plan is None or sky.plan.rise_tai_s == signal.pass_rise_tai_s:
        return state
    if signal.pass_rise_tai_s is not None:
        state, signal = forget_search(state), Signal()
    return with_parts(state, signal=replace(signal, pass_rise_tai_s=sky.plan.rise_tai_s))


def resume_pass(state: ControlState) -> ControlState:
    """The pass was acquired before the daemon was started again."""
    return with_parts(state, signal=replace(state.signal, has_acquired=True))


def learn_of_signal(state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]) -> ControlState:
    """Take a reading of the satellite's own signal, by the state that the table has just given."""
    seen = given.seen
    if seen.status is None or seen.reading is None:
        return state
    signal, track, tai_s = state.signal, state.tracking.track, seen.reading.tai_s
    is_ours = is_acquired(seen.status) and track in AUTOTRACKING
    if not is_ours and not (track is TrackState.PROGRAM and is_heard_beside(state, given.now_tai_s, config)):
        if signal.acquired_since_tai_s is None:
            return state
        return with_parts(state, signal=replace(signal, acquired_since_tai_s=None))
    since_tai_s = signal.acquired_since_tai_s or tai_s
    has_locked = signal.has_locked or tai_s - since_tai_s >= config.lock_dwell_s
    new = signal
    if signal.acquired_since_tai_s is None or not signal.has_acquired or has_locked is not signal.has_locked:
        new = replace(signal, acquired_since_tai_s=since_tai_s, has_acquired=True, has_locked=has_locked)
    if track is TrackState.AUTOTRACK_TLE and seen.is_in_step:
        new = _learn_offset(new, seen.reading, given.sky, config, events)
    return state if new is signal else with_parts(state, signal=new)


def is_heard_beside(state: ControlState, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether a receiver beside the ACU is locked, by a word that still counts."""
    rules, receiver = config.receiver, state.receiver
    return rules is not None and receiver.is_locked and receiver.is_known(now_tai_s, rules)


def _learn_offset(signal: Signal, reading: Reading, sky: Sky, config: ControlConfig, events: list[Event]) -> Signal:
    """Follow the distance between reading and prediction: it carries the path until the first fit."""
    prediction = sky.prediction
    new = offset_of(prediction, reading.tai_s, reading.az_deg, reading.el_deg) if prediction is not None else None
    if prediction is None or new is None:
        return signal
    most_along_s, most_across_deg = extents(prediction, config)
    if not is_within(new, (most_along_s, most_across_deg)):
        if not signal.is_offset_refused:
            fields = {
                "along_s": round(new[0], 1),
                "across_deg": round(new[1], 2),
                "most_along_s": round(most_along_s, 1),
                "most_across_deg": round(most_across_deg, 2),
            }
            events.append(Event("offset.refused", fields, is_warning=True))
        return replace(signal, is_offset_refused=True)
    old = signal.offset
    if old is not None and old.model is prediction.model:
        new = old.along_s + GAIN * (new[0] - old.along_s), old.across_deg + GAIN * (new[1] - old.across_deg)
    return replace(signal, offset=PathOffset(*new, prediction.model), is_offset_refused=False)


def learned_offset(state: ControlState, sky: Sky) -> tuple[float, float] | None:
    """By how many seconds late and degrees right autotrack showed the path before the first fit; None: as predicted."""
    offset, prediction = state.signal.offset, sky.prediction
    if offset is None or prediction is None or offset.model is not prediction.model:
        return None
    if state.tracking.track not in OFFSET_STATES:
        return None
    return offset.along_s, offset.across_deg
