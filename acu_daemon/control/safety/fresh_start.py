"""What begins the start anew: arming, disarming, a latch that is cleared, a turn that is learned.  Pure.

The latch stays until a person clears it, whatever the link and the ACU do.
"""

from collections.abc import Iterable

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.extra_exchange import forget_asked
from acu_daemon.control.orders import Event
from acu_daemon.control.registers import forget_axes
from acu_daemon.control.safety.arming import owe_stop, set_armed, set_disarmed
from acu_daemon.control.safety.axis_latch import clear_latch, forget_motion
from acu_daemon.control.safety.foreign_stop import forget_held, settle
from acu_daemon.control.safety.interlock import forget_faults
from acu_daemon.control.safety.stow import obey_stow
from acu_daemon.control.startup import begin_again
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Asking, Request, StowWish


def anew(state: ControlState, *, keeps_watchdog: bool = False) -> ControlState:
    """Before the next write the present angles are written, as at a start."""
    return settle(forget_motion(forget_axes(forget_asked(begin_again(state, keeps_watchdog=keeps_watchdog)))))


def disarm(state: ControlState, by: str, events: list[Event]) -> ControlState:
    """Command nothing more until a person arms."""
    advice = "`acu-daemon arm` goes on"
    events.append(Event("disarmed", {"by": by, "advice": advice}, is_warning=True))
    return set_disarmed(anew(state, keeps_watchdog=True), by)


def obey(state: ControlState, requests: Iterable[Asking], config: ControlConfig, events: list[Event]) -> ControlState:
    """Do what people ask."""
    for request in requests:
        is_stop_due = state.arming.is_stop_due
        if isinstance(request, StowWish):
            state = obey_stow(state, request, config, events)
        elif request is Request.CLEAR and state.latch.problem:
            events.append(Event("latch.cleared", {"latch": state.latch.problem}))
            state = owe_stop(clear_latch(anew(state)), is_due=is_stop_due and not state.is_armed(config))
        elif request is Request.ARM and not config.is_shadow:
            state = forget_held(state)  # whoever says so has seen how the antenna stands
            if not state.is_armed_by_people(config):
                events.append(Event("armed"))
                is_stop_due = is_stop_due and bool(state.latch.problem)
                state = forget_faults(set_armed(anew(state), is_stop_due=is_stop_due))
        elif request is Request.DISARM and state.is_armed_by_people(config):
            is_ours = state.registers.in_force is not None or state.foreign_stop.held is not None  # of one killed
            state = owe_stop(disarm(state, "a person", events), is_due=is_stop_due or is_ours)
        elif request is Request.STOP and not config.is_shadow:  # whoever moves it
            is_armed = state.is_armed_by_people(config)
            state = owe_stop(disarm(state, "a person", events) if is_armed else state)
    return state
