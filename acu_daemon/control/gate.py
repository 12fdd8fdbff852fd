"""The safety gate: the last thing that happens to a register write; none passes beside it (design section 3).

Not finite or outside the limits: refused with a reason, the last good value stays.  Registers that the antenna follows
are clamped to what the axis can do; registers it does not follow hold the true path, also through the zenith.
"""

from dataclasses import dataclass, replace
from math import isfinite

from acu_daemon.control.state import ControlConfig, ControlState
from acu_daemon.model import AxisLimits, Pointing
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.protocol.angles import clamp_deg

LIMIT_SLACK_DEG = 0.1  # noise of a reading at a limit is clamped; more than that is refused
RATE_MARGIN = 0.98  # of the drive's limits: the time between two writes is only nominally the period
STRAY_DEG = 0.5  # an antenna this far from the register it is about to follow starts from where it is
WINDUP_S = 0.6  # a followed register may lead the antenna by this much of its motion, and a little more


@dataclass(frozen=True, slots=True)
class Passed:
    """What may be sent: axis states (their positions are exact wire angles within the limits), or why nothing new."""

    az: AxisState
    el: AxisState
    is_held_back: bool
    refusal: str = ""


def gate(wanted: Pointing, state: ControlState, *, is_followed: bool, dt_s: float, config: ControlConfig) -> Passed:
    """Let a wanted pointing pass, hold it back, or refuse it.  dt_s: since the last write."""
    az, el = _from(state, is_followed=is_followed)
    refusal = _refusal(wanted, config)
    if refusal:
        return Passed(_legal(replace(az, rate_deg_s=0.0), config.azimuth), _legal(el, config.elevation), True, refusal)
    new_az, new_el = (
        AxisState(wanted.az_deg, wanted.az_rate_deg_s),
        AxisState(wanted.el_deg, wanted.el_rate_deg_s),
    )
    if is_followed:
        new_az = _reachable(az, new_az, dt_s, config.azimuth)
        new_el = _reachable(el, new_el, dt_s, config.elevation)
    is_held_back = new_az.position_deg != wanted.az_deg or new_el.position_deg != wanted.el_deg
    return Passed(_legal(new_az, config.azimuth), _legal(new_el, config.elevation), is_held_back)


def _refusal(wanted: Pointing, config: ControlConfig) -> str:
    values = (wanted.az_deg, wanted.el_deg, wanted.az_rate_deg_s, wanted.el_rate_deg_s)
    if not all(isfinite(value) for value in values):
        return "not a finite angle"
    for name, angle_deg, limits in (
        ("azimuth", wanted.az_deg, config.azimuth),
        ("elevation", wanted.el_deg, config.elevation),
    ):
        if not limits.min_deg - LIMIT_SLACK_DEG <= angle_deg <= limits.max_deg + LIMIT_SLACK_DEG:
            return f"{name} {angle_deg:.2f} deg is outside [{limits.min_deg:g}, {limits.max_deg:g}]"
    return ""


def _from(state: ControlState, *, is_followed: bool) -> tuple[AxisState, AxisState]:
    """Where a followed register starts from: the last command, or the antenna when it is not there."""
    status = state.status
    el_deg = status.el_deg if status is not None else 0.0
    return (
        _anchor(state.axis_az, state.az_deg, state.az_rate_deg_s, state, is_followed=is_followed),
        _anchor(state.axis_el, el_deg, state.el_rate_deg_s, state, is_followed=is_followed),
    )


def _anchor(
    last: AxisState | None, encoder_deg: float, rate_deg_s: float, state: ControlState, *, is_followed: bool
) -> AxisState:
    here = AxisState(encoder_deg, rate_deg_s)
    if last is None:
        return AxisState(encoder_deg, 0.0)
    away_deg = abs(last.position_deg - encoder_deg - 0.2 * last.rate_deg_s)
    if is_followed and not state.was_followed and away_deg > STRAY_DEG:
        return here
    if is_followed and away_deg > 10.0 + WINDUP_S * abs(last.rate_deg_s):
        return here
    return last


def _reachable(start: AxisState, wanted: AxisState, dt_s: float, limits: AxisLimits) -> AxisState:
    safe = replace(
        limits,
        max_rate_deg_s=limits.max_rate_deg_s * RATE_MARGIN,
        max_acceleration_deg_s2=limits.max_acceleration_deg_s2 * RATE_MARGIN,
    )
    bounded = replace(start, rate_deg_s=min(max(start.rate_deg_s, -safe.max_rate_deg_s), safe.max_rate_deg_s))
    return step(bounded, wanted.position_deg, wanted.rate_deg_s, dt_s, safe)


def _legal(axis: AxisState, limits: AxisLimits) -> AxisState:
    return replace(axis, position_deg=clamp_deg(axis.position_deg, limits.min_deg, limits.max_deg))
