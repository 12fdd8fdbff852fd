"""What stops the daemon's own commands: people, another hand, the interlock, an axis that does not obey.  Pure."""

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.safety.arming import owe_no_stop_to_others, owe_stop
from acu_daemon.control.safety.axis_latch import latch, watch_antenna
from acu_daemon.control.safety.axis_watch import AWAY
from acu_daemon.control.safety.foreign_stop import ANOTHER_HAND, take_faults, watch_for_stop
from acu_daemon.control.safety.fresh_start import disarm, obey
from acu_daemon.control.safety.interlock import watch_interlock
from acu_daemon.control.safety.stow import watch_stow
from acu_daemon.control.safety.turn_doubt import doubt, may_be_other_turn, watch_turn
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Observation
from acu_daemon.control.tracking.learned_lag import forget_lag

AZIMUTH_AWAY = f"azimuth {AWAY}"


def supervise(
    before: ControlState, state: ControlState, seen: Observation, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Obey people, yield to other hands, and judge what the antenna does.  before: the memory one tick ago."""
    state = obey(state, seen.requests, config, events)
    state, is_stopped = watch_for_stop(before, state, config)
    state = disarm(state, ANOTHER_HAND, events) if is_stopped else state
    state, is_stopped = take_faults(state, seen)
    state = disarm(state, ANOTHER_HAND, events) if is_stopped else state
    state, is_left = watch_stow(before, state, events)
    state = disarm(state, ANOTHER_HAND, events) if is_left and state.is_armed_by_people(config) else state
    state, person = watch_interlock(state, seen, config)
    state = disarm(state, person, events) if person else state
    state, problem = watch_antenna(state, seen, config)
    if problem == AZIMUTH_AWAY and may_be_other_turn(state, config):
        state, problem = doubt(state, config, events, problem), ""
    state = _stop_for(state, problem, events)
    state, problem = watch_turn(owe_no_stop_to_others(state), seen, config, events)
    return _stop_for(state, problem, events)


def _stop_for(state: ControlState, problem: str, events: list[Event]) -> ControlState:
    return forget_lag(owe_stop(latch(state, problem, events))) if problem else state
