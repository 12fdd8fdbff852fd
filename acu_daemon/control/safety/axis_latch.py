"""The latch: an axis that does not do what it is told stops everything until a person clears it.  Pure.

control.safety.axis_watch judges the axes.  Owner of `Latch`.
"""

from dataclasses import replace

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.safety.axis_watch import AxisSeen, duty_of, sky_scale, watch_axes
from acu_daemon.control.state import ControlState, Latch, StartStage
from acu_daemon.control.tick_input import Observation
from acu_daemon.control.with_parts import with_parts
from acu_daemon.units import wrap_180

RATE_SPAN_S = 1.0


def watch_antenna(state: ControlState, seen: Observation, config: ControlConfig) -> tuple[ControlState, str]:
    """Judge the axes by a new reading.  Returns what they do wrong; empty: nothing."""
    is_watched = state.is_armed(config) and not state.latch.problem and state.startup.stage is StartStage.READY
    if not is_watched or config.following.error_s <= 0.0 or seen.status is None or seen.reading is None:
        return state, ""
    duty, tai_s, el_deg = duty_of(seen.status), seen.reading.tai_s, seen.status.el_deg
    az_deg, in_force = state.intake.az_deg, state.registers.in_force
    az_gap_deg = el_gap_deg = None
    if in_force is not None:
        az_gap_deg, el_gap_deg = wrap_180(in_force[1] - az_deg), in_force[2] - el_deg
    az_rate_deg_s, el_rate_deg_s = _rates_deg_s(state)
    axes, problem = watch_axes(
        state.latch.axes,
        seen.status,
        AxisSeen(tai_s, az_deg, az_rate_deg_s, duty, az_gap_deg, sky_scale(el_deg)),
        AxisSeen(tai_s, el_deg, el_rate_deg_s, duty, el_gap_deg),
        (config.azimuth, config.elevation),
        config.following,
    )
    return with_parts(state, latch=Latch(axes=axes)), problem


def _rates_deg_s(state: ControlState) -> tuple[float, float]:
    first, last = state.intake.track_of_readings[0], state.intake.track_of_readings[-1]
    span_s = last[0] - first[0]
    if not 0.0 < span_s < RATE_SPAN_S:
        return 0.0, 0.0
    return (last[1] - first[1]) / span_s, (last[2] - first[2]) / span_s


def latch(state: ControlState, problem: str, events: list[Event]) -> ControlState:
    """Latch what an axis did wrong."""
    el_deg = state.intake.status.el_deg if state.intake.status is not None else None
    advice = "look, then `acu-daemon clear`"
    fields = {"problem": problem, "az_deg": state.intake.az_deg, "el_deg": el_deg, "advice": advice}
    events.append(Event("axis.latched", fields, is_warning=True))
    return with_parts(state, latch=replace(state.latch, problem=problem))


def clear_latch(state: ControlState) -> ControlState:
    """A person has looked at the antenna."""
    return with_parts(state, latch=Latch())


def forget_motion(state: ControlState) -> ControlState:
    """Judge the axes from the next reading on, as if none had been."""
    return with_parts(state, latch=Latch(state.latch.problem))
