"""What a person changes of how a pass is steered: autotrack left for the prediction, the path moved.  Pure.

Owner of `ByHand`.  A nudge is an offset beside the path in seconds late and degrees right (see track_frame), of the
model that the prediction is made from: where another one takes its place, by a fit for one, it ends, since what it
mended is in the new one.  Both end with the pass.
"""

from dataclasses import replace

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ByHand, ControlState, Nudge
from acu_daemon.control.tick_input import HoldWish, NudgeWish, Sky, TickInput
from acu_daemon.control.tracking.causes import path_point
from acu_daemon.control.tracking.path_offset import learned_offset
from acu_daemon.control.tracking.state_table import TRACKING, TrackState
from acu_daemon.control.tracking.track_frame import beside
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Pointing

S = TrackState
NUDGED = TRACKING - {S.SEARCH, S.ZENITH, S.FALSE_LOCK}  # a search looks about the path itself


def steer_by_hand(state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]) -> ControlState:
    """Take what a person wants of this pass, and end a nudge whose model has gone."""
    if not config.is_shadow:
        for asking in given.seen.requests:
            if isinstance(asking, HoldWish) and asking.is_wanted is not state.by_hand.is_held:
                events.append(Event("hold.begins" if asking.is_wanted else "hold.ends"))
                state = with_parts(state, by_hand=replace(state.by_hand, is_held=asking.is_wanted))
            elif isinstance(asking, NudgeWish):
                state = _nudge(state, asking, events)
    return _of_model(state, given.sky, events)


def _nudge(state: ControlState, wish: NudgeWish, events: list[Event]) -> ControlState:
    nudge = replace(state.by_hand.nudge or Nudge(0.0, 0.0), along_s=wish.along_s, across_deg=wish.across_deg)
    events.append(Event("nudge", {"along_s": nudge.along_s, "across_deg": nudge.across_deg}))
    is_none = nudge.along_s == 0.0 and nudge.across_deg == 0.0
    return with_parts(state, by_hand=replace(state.by_hand, nudge=None if is_none else nudge))


def _of_model(state: ControlState, sky: Sky, events: list[Event]) -> ControlState:
    """A nudge belongs to the first model that it is used with."""
    nudge, prediction = state.by_hand.nudge, sky.prediction
    if nudge is None or prediction is None or nudge.model is prediction.model:
        return state
    if nudge.model is None:
        return with_parts(state, by_hand=replace(state.by_hand, nudge=replace(nudge, model=prediction.model)))
    fields = {"along_s": nudge.along_s, "across_deg": nudge.across_deg, "path": str(prediction.model)}
    events.append(Event("nudge.ends", fields))
    return with_parts(state, by_hand=replace(state.by_hand, nudge=None))


def by_hand_before(*, is_held: bool = False, nudge: Nudge | None = None) -> ByHand:
    """What a person had changed of the pass before the daemon was started again in it."""
    return ByHand(is_held, nudge)


def nudge_in_force(state: ControlState) -> Nudge | None:
    """The nudge by which the path is moved now; None: by none."""
    return state.by_hand.nudge if state.tracking.track in NUDGED else None


def steered_point(state: ControlState, sky: Sky, tai_s: float, *, follow: bool) -> Pointing | None:
    """Where the path leads at an instant, as autotrack showed it before the first fit, and moved as a person wants."""
    learned, nudge, prediction = learned_offset(state, sky), nudge_in_force(state), sky.prediction
    if prediction is None or (learned is None and nudge is None):
        return path_point(sky, tai_s, follow=follow)
    along_s, across_deg = learned or (0.0, 0.0)
    if nudge is not None:
        along_s, across_deg = along_s + nudge.along_s, across_deg + nudge.across_deg
    is_before = sky.plan is not None and tai_s < sky.plan.start_tai_s and learned is None
    if is_before and sky.plan is not None:
        point = beside(prediction, sky.plan.start_tai_s, (along_s, across_deg), follow=follow)
        return None if point is None else replace(point, az_rate_deg_s=0.0, el_rate_deg_s=0.0)
    point = beside(prediction, tai_s, (along_s, across_deg), follow=follow)
    return point or path_point(sky, tai_s, follow=follow)
