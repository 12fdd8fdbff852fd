"""What a rate limit would need that the margin does not allow: the least margin, or the least interruption."""

from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.onboard.branches import AZIMUTH_GUARD, least_bound
from acu_daemon.onboard.cone import Tube, azimuth_tube, windings
from acu_daemon.onboard.profile import RATE_GUARD, Task
from acu_daemon.units import Array

WIDEST_DEG = 30.0
_STEP_DEG = 0.01
_SPARE = 1.01  # a path of polynomials is that much above its bound


@dataclass(frozen=True, slots=True)
class Interruption:
    """A span without contact, seconds since the view's first sample."""

    start_s: float
    end_s: float

    @property
    def length_s(self) -> float:
        return self.end_s - self.start_s


def bound_at(task: Task, margin_deg: float) -> float:
    """The least largest azimuth rate with another margin; infinite where azimuth's range leaves no path."""
    bound = least_bound(replace(task, cone=replace(task.cone, margin_deg=margin_deg)))
    return np.inf if bound is None else bound.rate_deg_s


def least_margin_deg(task: Task, rate_deg_s: float) -> float | None:
    """The least margin, to 0.01 deg upwards, with which a path keeps to the rate; None where 30 deg do not suffice."""
    wanted = rate_deg_s * RATE_GUARD / _SPARE
    low, high = 0, round(WIDEST_DEG / _STEP_DEG)
    if bound_at(task, AZIMUTH_GUARD * WIDEST_DEG) > wanted:
        return None
    while high - low > 1:
        middle = (low + high) // 2
        if bound_at(task, AZIMUTH_GUARD * middle * _STEP_DEG) <= wanted:
            high = middle
        else:
            low = middle
    return high * _STEP_DEG


def least_interruption(task: Task, rate_deg_s: float) -> Interruption | None:
    """The shortest span to be left out so that the rest of the pass keeps to rate and margin; None where none does."""
    view = task.view.plan
    station = task.station_gimbal(view)
    cone = replace(task.cone, margin_deg=AZIMUTH_GUARD * task.margin_deg)
    tube = azimuth_tube(cone, view.time_s, station.az_deg, station.el_deg)
    rate = rate_deg_s * RATE_GUARD / _SPARE
    found = [one for path in windings(tube, station.az_deg) if (one := _shortest(path, rate)) is not None]
    return min(found, key=lambda one: one.length_s, default=None)


def _shortest(tube: Tube, rate: float) -> Interruption | None:
    """Leave out samples i+1 .. j-1: those up to i, those from j on, and the way between must each keep to the rate.

    What the samples so far allow at i is an interval, and so is what those to come allow at j; both are running
    extremes.  Leaving out more never makes it harder, so for every i the first j is found by halving.
    """
    t = tube.time_s
    before = _reach(t, tube.lower_deg, tube.upper_deg, rate)
    after = tuple(one[::-1] for one in _reach(-t[::-1], tube.lower_deg[::-1], tube.upper_deg[::-1], rate))
    size = t.size
    low = np.concatenate([[-np.inf], before[0]])  # entry k: after the first k samples
    high = np.concatenate([[np.inf], before[1]])
    is_good = np.concatenate([[True], np.minimum.accumulate(before[0] <= before[1])])
    is_good_after = np.append(np.minimum.accumulate((after[0] <= after[1])[::-1])[::-1], True)
    low_after, high_after = np.append(after[0], -np.inf), np.append(after[1], np.inf)
    padded = np.append(t, t[-1])
    kept = np.flatnonzero(is_good)
    best: Interruption | None = None
    for turn_deg in (0.0, 360.0, -360.0):
        first, last = kept.copy(), np.full(kept.size, size)
        from_s = padded[np.maximum(kept - 1, 0)]
        while (first < last).any():
            middle = (first + last) // 2
            room = rate * (padded[middle] - from_s)
            meets = (
                is_good_after[middle]
                & (low[kept] - room <= high_after[middle] + turn_deg)
                & (low_after[middle] + turn_deg - room <= high[kept])
            )
            last = np.where(meets, middle, last)
            first = np.where(meets, first, np.minimum(middle + 1, last))
        length = padded[np.minimum(last, size - 1)] - from_s
        k = int(np.argmin(length))
        one = Interruption(float(from_s[k]), float(from_s[k] + length[k]))
        if last[k] - kept[k] < size and (best is None or one.length_s < best.length_s):
            best = one
    return best


def _reach(t: Array, lower: Array, upper: Array, rate: float) -> tuple[Array, Array]:
    """Lowest and highest values at each time (N,) of the paths that kept to the bounds so far."""
    low = np.maximum.accumulate(lower + rate * t) - rate * t
    high = np.minimum.accumulate(upper - rate * t) + rate * t
    return low, high


def rate_against_margin(task: Task, margins_deg: Array) -> Array:
    """The bound (K,) for margins (K,)."""
    return np.array([bound_at(task, float(one)) for one in margins_deg])
