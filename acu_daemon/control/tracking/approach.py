"""How long the antenna takes to the point where the pass begins, and so how early it must set out.  Pure.

`preposition_s` is a floor: an antenna with slow drives, or one that has to unwind a turn first, sets out earlier.
"""

from dataclasses import dataclass
from math import sqrt

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.register_limiter import CHASE_ACCELERATION_MARGIN, CHASE_RATE_MARGIN
from acu_daemon.model import AxisLimits

ACQUIRE_LEAD_S = 20.0  # autotrack may be selected this long before the rise
BEGIN_S = 3.0  # backup and mode are selected, on a slow line too


@dataclass(frozen=True, slots=True)
class Way:
    """Seconds that each axis needs, from standing to standing."""

    azimuth_s: float
    elevation_s: float
    tilt_s: float = 0.0

    @property
    def both_s(self) -> float:
        """Until both are there, modes included."""
        return BEGIN_S + max(self.azimuth_s, self.elevation_s, self.tilt_s)


def way_s(distance_deg: float, axis: AxisLimits) -> float:
    """Seconds of an axis that speeds up, cruises and brakes as the register limiter lets it."""
    rate = CHASE_RATE_MARGIN * axis.max_rate_deg_s
    acceleration = CHASE_ACCELERATION_MARGIN * axis.max_acceleration_deg_s2
    distance_deg = abs(distance_deg)
    if distance_deg < rate * rate / acceleration:
        return 2.0 * sqrt(distance_deg / acceleration)
    return distance_deg / rate + rate / acceleration


def way_to(plan: PassPlan, state: ControlState, config: ControlConfig) -> Way:
    """From where the antenna stands to the point where the pass begins, on the turn of the plan."""
    el_deg = state.intake.status.el_deg if state.intake.status is not None else plan.start_el_deg
    way_az_deg, way_el_deg = plan.start_az_deg - state.intake.az_deg, plan.start_el_deg - el_deg
    return Way(way_s(way_az_deg, config.azimuth), way_s(way_el_deg, config.elevation), _tilt_s(state, config))


def _tilt_s(state: ControlState, config: ControlConfig) -> float:
    status = state.intake.status
    if config.tilt is None or config.tilt_deg is None or status is None or status.tilt_deg is None:
        return 0.0
    return way_s(config.tilt_deg - status.tilt_deg, config.tilt)


def lead_s(plan: PassPlan, state: ControlState, config: ControlConfig) -> float:
    """How long before the rise the antenna sets out."""
    return max(config.preposition_s, way_to(plan, state, config).both_s + ACQUIRE_LEAD_S)


def longest_lead_s(
    azimuth: AxisLimits, elevation: AxisLimits, preposition_s: float, tilt: AxisLimits | None = None
) -> float:
    """The same from wherever it, and a tilt that is moved, may stand."""
    axes = (azimuth, elevation, tilt)
    ways = Way(*(0.0 if axis is None else way_s(axis.max_deg - axis.min_deg, axis) for axis in axes))
    return max(preposition_s, ways.both_s + ACQUIRE_LEAD_S)
