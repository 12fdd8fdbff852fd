"""One axis of the antenna that follows a moving target without ever asking more than its drive gives.  Pure.

It is what registers that are being followed are clamped to.  Constant acceleration within a step, so the position
advances by the trapezoid of the rates, as the drive itself would do.
"""

from dataclasses import dataclass
from math import copysign, sqrt

from acu_daemon.model import AxisLimits


@dataclass(frozen=True, slots=True)
class AxisState:
    """Where one axis is (continuous angle) and how fast it moves."""

    position_deg: float
    rate_deg_s: float = 0.0


def step(state: AxisState, target_deg: float, target_rate_deg_s: float, dt_s: float, limits: AxisLimits) -> AxisState:
    """Move one axis by one step of dt_s > 0 towards a target; target and result are for the end of the step.

    If the drive can be on the target with the target's rate at the end of the step, the result is the target, exactly.
    Else it closes in as fast as rate and acceleration allow, braking early enough not to overshoot a target of
    constant rate.  Position limits are not applied here.
    """
    if _can_capture(state, target_deg, target_rate_deg_s, dt_s, limits):
        return AxisState(target_deg, target_rate_deg_s)
    rate_max, acceleration = limits.max_rate_deg_s, limits.max_acceleration_deg_s2
    # left to close if the rates matched; braking from a closing rate u takes u dt/2 + u^2/(2 acceleration)
    left_deg = target_deg - state.position_deg - (state.rate_deg_s + target_rate_deg_s) * dt_s / 2
    closing = acceleration * (sqrt(dt_s * dt_s / 4 + 2 * abs(left_deg) / acceleration) - dt_s / 2)
    wanted = min(max(target_rate_deg_s + copysign(closing, left_deg), -rate_max), rate_max)
    most = acceleration * dt_s
    rate = min(max(wanted, state.rate_deg_s - most), state.rate_deg_s + most)
    return AxisState(state.position_deg + (state.rate_deg_s + rate) * dt_s / 2, rate)


def _can_capture(state: AxisState, target_deg: float, rate_deg_s: float, dt_s: float, limits: AxisLimits) -> bool:
    """Whether some acceleration within the limit leads from the state onto the target within one step."""
    most = limits.max_acceleration_deg_s2 * dt_s
    change = abs(rate_deg_s - state.rate_deg_s)
    mean_rate = (target_deg - state.position_deg) / dt_s
    if change > most or max(abs(mean_rate), abs(rate_deg_s)) > limits.max_rate_deg_s:
        return False
    # two accelerations of opposite sign shift the end by at most this, the rates at both ends given
    slack_rate = (most - change * change / most) / 4
    return abs(mean_rate - (state.rate_deg_s + rate_deg_s) / 2) <= slack_rate
