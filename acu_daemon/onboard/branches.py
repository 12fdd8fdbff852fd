"""The tubes that a path may take: on either side of the axis, on the turns of the cable, each with its least rate."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.bound import Bound, least_rate
from acu_daemon.onboard.cone import Tube, azimuth_tube, windings
from acu_daemon.onboard.profile import Task
from acu_daemon.onboard.view import PER_PLAN_STEP
from acu_daemon.units import Array

AZIMUTH_GUARD = 0.995  # of the margin, in plans: between the samples paths bulge
RANGE_GUARD_DEG = 0.02  # of the axes' ranges, in plans, likewise
_TURNS = (0, 1, -1, 2, -2)


@dataclass(frozen=True, slots=True)
class Branch:
    """A guarded tube at all samples of the view, within azimuth's range: one winding, on one turn of the cable."""

    tube: Tube
    guess_deg: Array
    rate_deg_s: float  # the least one of the guarded tube


def find_branches(task: Task) -> list[Branch]:
    """All windings, each on the best turn of the cable that azimuth's range allows, the least rate first."""
    station = task.station_gimbal(task.view)
    cone = replace(task.cone, margin_deg=AZIMUTH_GUARD * task.margin_deg)
    tube = azimuth_tube(cone, task.view.time_s, station.az_deg, station.el_deg)
    found = []
    for winding in windings(tube, station.az_deg):
        guess = _bridged(winding)
        turns = [
            Branch(within, np.clip(guess + turn_deg, within.lower_deg, within.upper_deg), _planned_rate(within))
            for turn_deg, within in _within_range(winding, _narrowed(task.azimuth))
        ]
        if turns:
            found.append(min(turns, key=_rank))
    return sorted(found, key=_rank)


def least_bound(task: Task) -> Bound | None:
    """The least largest azimuth rate of all paths within margin and azimuth's range; None where the range has none."""
    view = task.view.plan
    station = task.station_gimbal(view)
    tube = azimuth_tube(task.cone, view.time_s, station.az_deg, station.el_deg, is_outer=True)
    bounds = [
        least_rate(within)
        for winding in windings(tube, station.az_deg)
        for _, within in _within_range(winding, task.azimuth)
    ]
    return min(bounds, key=lambda one: (round(one.rate_deg_s, 9), abs(one.low_deg + one.high_deg)), default=None)


def _narrowed(limits: AxisLimits) -> AxisLimits:
    return replace(limits, min_deg=limits.min_deg + RANGE_GUARD_DEG, max_deg=limits.max_deg - RANGE_GUARD_DEG)


def _planned_rate(tube: Tube) -> float:
    every = slice(None, None, PER_PLAN_STEP)
    return least_rate(Tube(tube.time_s[every], tube.lower_deg[every], tube.upper_deg[every])).rate_deg_s


def _rank(branch: Branch) -> tuple[float, float]:
    """Slower first, then nearer to the middle of the cable."""
    return round(branch.rate_deg_s, 9), abs(float(branch.guess_deg.min() + branch.guess_deg.max()))


def _within_range(tube: Tube, limits: AxisLimits) -> Iterator[tuple[float, Tube]]:
    """The turns of the cable on which the tube keeps an azimuth at every sample, and what it keeps."""
    for turn in _TURNS:
        lower = np.maximum(tube.lower_deg + 360.0 * turn, limits.min_deg)
        upper = np.minimum(tube.upper_deg + 360.0 * turn, limits.max_deg)
        if (lower <= upper).all():
            yield 360.0 * turn, Tube(tube.time_s, lower, upper)


def _bridged(tube: Tube) -> Array:
    """The tube's middle, straight across spans without bounds."""
    is_bound = np.isfinite(tube.lower_deg)
    if not is_bound.any():
        return np.zeros(tube.time_s.size)
    middle = (tube.lower_deg[is_bound] + tube.upper_deg[is_bound]) / 2.0
    bridged: Array = np.interp(tube.time_s, tube.time_s[is_bound], middle)
    return bridged
