"""What autotrack tells of the path before there is a fit, and what it tells of the satellite at all.  Pure.

Only what is held while the table says that it is this pass's satellite counts; another pass knows nothing of it.
"""

from acu_daemon.control.causes import is_acquired
from acu_daemon.control.changed import changed
from acu_daemon.control.state import ControlConfig, ControlState, Event, Observation, PathOffset, Scan, Sky
from acu_daemon.control.states import AUTOTRACKING, TrackState
from acu_daemon.control.track_frame import beside, extents, is_within, offset_of
from acu_daemon.model import Pointing, Reading

GAIN = 0.6  # of the newest reading in the smoothed offset: autotrack pulls in quickly


def forget_other_pass(state: ControlState, sky: Sky) -> ControlState:
    """What was learned of a satellite in another pass is not this one's."""
    if sky.plan is None or sky.plan.rise_tai_s == state.pass_rise_tai_s:
        return state
    if state.pass_rise_tai_s is not None:
        state = changed(
            state, scan=Scan(), offset=None, acquired_since_tai_s=None, has_locked=False, has_acquired=False
        )
    return changed(state, pass_rise_tai_s=sky.plan.rise_tai_s)


def learn_of_signal(
    state: ControlState, seen: Observation, sky: Sky, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Take a reading of the satellite's own signal, by the state that the table has just given."""
    if seen.status is None or seen.reading is None:
        return state
    if not is_acquired(seen.status) or state.track not in AUTOTRACKING:
        return changed(state, acquired_since_tai_s=None) if state.acquired_since_tai_s is not None else state
    since_tai_s = state.acquired_since_tai_s or seen.reading.tai_s
    state = changed(
        state,
        acquired_since_tai_s=since_tai_s,
        has_acquired=True,
        has_locked=state.has_locked or seen.reading.tai_s - since_tai_s >= config.lock_dwell_s,
    )
    if state.track is not TrackState.AUTOTRACK_TLE or not seen.is_in_step:
        return state
    return _learn_offset(state, seen.reading, sky, config, events)


def _learn_offset(
    state: ControlState, reading: Reading, sky: Sky, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Follow the distance between reading and prediction: it carries the path until the first fit."""
    prediction = sky.prediction
    new = offset_of(prediction, reading.tai_s, reading.az_deg, reading.el_deg) if prediction is not None else None
    if prediction is None or new is None:
        return state
    most_along_s, most_across_deg = extents(prediction, config)
    if not is_within(new, (most_along_s, most_across_deg)):
        if not state.is_offset_refused:
            fields = {
                "along_s": round(new[0], 1),
                "across_deg": round(new[1], 2),
                "most_along_s": round(most_along_s, 1),
                "most_across_deg": round(most_across_deg, 2),
            }
            events.append(Event("offset.refused", fields, is_warning=True))
        return changed(state, is_offset_refused=True)
    old = state.offset
    if old is not None and old.model is prediction.model:
        new = old.along_s + GAIN * (new[0] - old.along_s), old.across_deg + GAIN * (new[1] - old.across_deg)
    return changed(state, offset=PathOffset(*new, prediction.model), is_offset_refused=False)


def learned_point(state: ControlState, sky: Sky, tai_s: float, *, follow: bool) -> Pointing | None:
    """The path as autotrack showed it before the first fit; None: as it is predicted."""
    offset, prediction = state.offset, sky.prediction
    if offset is None or prediction is None or offset.model is not prediction.model:
        return None
    if state.track not in (TrackState.AUTOTRACK_TLE, TrackState.HOLD_TLE):
        return None
    return beside(prediction, tai_s, (offset.along_s, offset.across_deg), follow=follow)
