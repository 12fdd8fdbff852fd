"""The least largest rate of any path in a tube, in closed form, with the pair of instants that proves it.

A path with rate R at the most, from the bound L at t1 to the bound U at t2, needs L(t1) - U(t2) <= R |t1 - t2|.  If all
pairs meet that, such a path exists (McShane's extension of Lipschitz functions).  So the least rate is

    R* = max over t1, t2 of (L(t1) - U(t2)) / |t1 - t2|,

and the pair is a certificate that anyone can check.  With a rate that is allowed to differ over time, |t1 - t2| becomes
the rate's integral.  Found by Dinkelbach's iteration: of all pairs, the one that violates the present rate most gives
the next one; two running maxima find it.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.onboard.cone import Tube
from acu_daemon.units import Array

_MOST_STEPS = 60


@dataclass(frozen=True, slots=True)
class Bound:
    """The least rate, and its certificate: azimuth is at least low_deg at one instant, at most high_deg at another."""

    rate_deg_s: float
    low_time_s: float
    low_deg: float
    high_time_s: float
    high_deg: float


def least_rate(tube: Tube, weight: Array | None = None) -> Bound:
    """The least R so that a path with |rate| <= R stays in the tube; weight: (N-1,), its share in each step."""
    ruler = tube.time_s if weight is None else np.concatenate([[0.0], np.cumsum(np.diff(tube.time_s) * weight)])
    rate = 0.0
    pair = (0, 0)
    for _ in range(_MOST_STEPS):
        (low, high), violation_deg = _worst_pair(tube, ruler, rate)
        if violation_deg <= 0.0 or ruler[low] == ruler[high]:
            break
        new = float((tube.lower_deg[low] - tube.upper_deg[high]) / abs(ruler[low] - ruler[high]))
        if new <= rate:
            break
        rate, pair = new, (low, high)
    low, high = pair
    return Bound(
        rate,
        float(tube.time_s[low]),
        float(tube.lower_deg[low]),
        float(tube.time_s[high]),
        float(tube.upper_deg[high]),
    )


def is_feasible(tube: Tube, rate_deg_s: float) -> bool:
    """Whether a path of that rate at the most stays in the tube."""
    return _worst_pair(tube, tube.time_s, rate_deg_s)[1] <= 0.0


def _worst_pair(tube: Tube, ruler: Array, rate: float) -> tuple[tuple[int, int], float]:
    """Indices of the lower and upper bound that are too far apart for the rate, the most of all, and by how much."""
    rise = rate * ruler
    before, at_before = _running_max(tube.lower_deg + rise)
    after, at_after = (one[::-1] for one in _running_max((tube.lower_deg - rise)[::-1]))
    over_before, over_after = before - rise - tube.upper_deg, after + rise - tube.upper_deg
    k, j = int(np.argmax(over_before)), int(np.argmax(over_after))
    if over_before[k] >= over_after[j]:
        return (int(at_before[k]), k), float(over_before[k])
    return (tube.time_s.size - 1 - int(at_after[j]), j), float(over_after[j])


def _running_max(values: Array) -> tuple[Array, Array]:
    """The largest value so far, and where it stands."""
    largest = np.maximum.accumulate(values)
    is_new = np.concatenate([[True], values[1:] > largest[:-1]])
    return largest, np.maximum.accumulate(np.where(is_new, np.arange(values.size), 0))
