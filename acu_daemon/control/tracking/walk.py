"""The state of tracking: causes are found, the table is walked, and what a new state begins is begun.

Owner of `Tracking`.  Pure.  control.tracking.state_table is the table, control.tracking.causes finds what drives it.
"""

from dataclasses import replace

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.extra_exchange import forget_asked
from acu_daemon.control.intake import doubt_place
from acu_daemon.control.orders import Event
from acu_daemon.control.registers import forget_writes
from acu_daemon.control.safety.axis_latch import forget_motion
from acu_daemon.control.startup import begin_after_lost_link
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky, TickInput
from acu_daemon.control.tracking.causes import find_causes
from acu_daemon.control.tracking.hills import hidden_until_tai_s, is_hidden
from acu_daemon.control.tracking.late_arrival import lateness
from acu_daemon.control.tracking.state_table import HOLDING, Cause, TrackState, transition
from acu_daemon.control.with_parts import with_parts

HIDDEN = (Cause.HIDDEN, Cause.HIDDEN_FITTED)
ALARMS = (TrackState.LINK_LOST, TrackState.FAULT, TrackState.SEARCH)


def walk(state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]) -> ControlState:
    """Go to the next state, where a cause of it is present."""
    causes = find_causes(state, given, config)
    tracking, now_tai_s = state.tracking, given.now_tai_s
    if tracking.track in HOLDING and _keeps_holding(given.sky, now_tai_s, config):
        tracking = replace(tracking, hold_from_tai_s=now_tai_s)
    step = transition(tracking.track, causes)
    if step is None:
        return state if tracking is state.tracking else with_parts(state, tracking=tracking)
    before, (track, cause) = tracking.track, step
    fields: dict[str, object] = {"state": str(track), "before": str(before), "cause": str(cause)}
    if cause in HIDDEN and (until_tai_s := hidden_until_tai_s(given.sky, now_tai_s)) is not None:
        fields["back_in_s"] = round(until_tai_s - now_tai_s, 1)
    events.append(Event("state.changed", fields, is_warning=track in ALARMS))
    if track is TrackState.PREPOSITION:
        events += lateness(state, given.sky, now_tai_s, config)
    begins_hold = track in HOLDING and before not in HOLDING
    hold_from_tai_s = now_tai_s if begins_hold else tracking.hold_from_tai_s
    tracking = replace(tracking, track=track, entered_tai_s=now_tai_s, hold_from_tai_s=hold_from_tai_s)
    state = with_parts(state, tracking=tracking)
    if track is TrackState.LINK_LOST:
        state = doubt_place(forget_motion(forget_writes(forget_asked(begin_after_lost_link(state)))))
    return state


def _keeps_holding(sky: Sky, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether a hold need not end: behind the mask, or 3 sigma of the prediction still lie within half the beam.

    The latter only for estimators that know a sigma.
    """
    if is_hidden(sky, now_tai_s, config):
        return True
    inside_s = sky.prediction.seconds_inside(now_tai_s, config.beamwidth_deg / 2) if sky.prediction else None
    return inside_s is not None and inside_s > 0.0
