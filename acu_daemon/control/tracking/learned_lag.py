"""The lag from command to encoder, learned while the antenna follows the registers.  Owner of `Lag`.  Pure.

control.tracking.lag has the theory.
"""

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState, Lag
from acu_daemon.control.with_parts import with_parts

STEADY_SHARE = 0.1  # of a step of the registers: more change than that from one to the next is acceleration


def learn_lag(state: ControlState, az_deg: float, el_deg: float, config: ControlConfig) -> ControlState:
    """The newest of three commands is not in force yet when the angles are sampled: learn from the one before it."""
    if config.acu.dead_band_deg or len(state.registers.commands) < 3:  # a rotator that waits shows no lag
        return state
    before, in_force, newest = state.registers.commands[-3:]
    if before is None or in_force is None or newest is None:
        return state
    if not (before.is_free and in_force.is_free and newest.is_free):
        return state
    step_deg = config.acu.angle_step_deg
    if not (
        _is_steady(before.az_deg, in_force.az_deg, newest.az_deg, step_deg)
        and _is_steady(before.el_deg, in_force.el_deg, newest.el_deg, step_deg)
    ):
        return state
    lag = Lag(
        az=state.lag.az.seen(in_force.az_deg - before.az_deg, in_force.az_deg - az_deg),
        el=state.lag.el.seen(in_force.el_deg - before.el_deg, in_force.el_deg - el_deg),
    )
    return with_parts(state, lag=lag)


def forget_lag(state: ControlState) -> ControlState:
    """Of an axis that failed nothing is kept."""
    return with_parts(state, lag=Lag())


def _is_steady(before_deg: float, in_force_deg: float, newest_deg: float, step_deg: float) -> bool:
    """Whether an axis moves at a nearly constant rate, so that what it is short of is lag, not acceleration."""
    first_deg, next_deg = in_force_deg - before_deg, newest_deg - in_force_deg
    return abs(next_deg - first_deg) < STEADY_SHARE * abs(first_deg) + 2 * step_deg
