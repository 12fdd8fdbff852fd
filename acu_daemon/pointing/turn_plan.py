"""The turns of the cable wrap that a pass is flown on, planned as a whole: dynamic programming over the pass.  Pure.

A turn is the path moved by a multiple of 360 deg.  Where the path leaves the axis's range on one turn, the antenna has
to unwind to another, out of the beam for as long as its drive needs.  From the end of the pass backwards, each instant
on each turn has the least cost of what is left; the cost is, in this order: seconds out of the beam while the satellite
can be seen, whether the turn holds also a pass on the other side of the zenith, degrees of travel.  So an antenna that
is found on the wrong turn in mid-pass weighs unwinding now against what it would lose later.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import ceil, floor, inf

import numpy as np
import numpy.typing as npt

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.wrap import ROUNDING_DEG
from acu_daemon.units import Array

MOST_STEPS = 800
EITHER_WAY_COST_S, TRAVEL_COST_S_DEG = 1e-2, 1e-6  # of what decides only where the seconds are the same
ON_PATH_DEG = 0.5  # an antenna this near to a turn's path needs no way to it


@dataclass(frozen=True, slots=True)
class Unwinding:
    """A change of turn within the pass: when it begins, how far the azimuth goes, how long that takes."""

    tai_s: float
    by_deg: float
    for_s: float


@dataclass(frozen=True, slots=True)
class TurnPlan:
    """offset_deg: added to the path at its start."""

    offset_deg: float
    unwindings: tuple[Unwinding, ...]

    @property
    def unwinding_s(self) -> float:
        return sum(one.for_s for one in self.unwindings)


@dataclass(frozen=True, slots=True)
class TurnAsk:
    """A pass and an antenna.

    tai_s, az_deg: (N,) at even steps, azimuth continuous; is_seen: (N,), not behind a hill.
    present_az_deg, now_tai_s: where the antenna stands and when it may set out.  way_s: seconds for so many degrees.
    is_either_way: whether a turn also holds the pass on the other side of the zenith, by its offset.
    """

    tai_s: Array
    az_deg: Array
    is_seen: npt.NDArray[np.bool_]
    limits: AxisLimits
    present_az_deg: float
    now_tai_s: float
    way_s: Callable[[float], float]
    is_either_way: Callable[[float], bool]


def plan_turns(ask: TurnAsk) -> TurnPlan:
    """Choose the turn to begin on, and where the path is left for another one."""
    every = max(1, ask.tai_s.size // MOST_STEPS)
    tai_s, az_deg = ask.tai_s[::every], ask.az_deg[::every]
    step_s = float(tai_s[1] - tai_s[0]) if tai_s.size > 1 else 1.0
    offsets = _offsets(ask.az_deg, ask.limits)
    on_turn = az_deg + offsets[:, None]
    slack = ROUNDING_DEG
    is_reached = (on_turn >= ask.limits.min_deg - slack) & (on_turn <= ask.limits.max_deg + slack)
    seen_s = step_s * ask.is_seen[::every].astype(np.float64)
    steps = np.array([[ceil(ask.way_s(abs(b - a)) / step_s) if a != b else 0 for b in offsets] for a in offsets])
    cost, then = _least(is_reached, seen_s, steps, np.abs(offsets[:, None] - offsets))
    firsts = [_first(ask, offset, k, cost, seen_s, step_s) for k, offset in enumerate(offsets.tolist())]
    k = int(np.argmin(firsts))
    return TurnPlan(float(offsets[k]), tuple(_unwindings(k, then, steps, offsets, tai_s, step_s)))


def _offsets(az_deg: Array, limits: AxisLimits) -> Array:
    first = floor((limits.min_deg - float(az_deg.max())) / 360.0)
    last = ceil((limits.max_deg - float(az_deg.min())) / 360.0)
    return 360.0 * np.arange(first, last + 1, dtype=np.float64)


def _least(
    is_reached: npt.NDArray[np.bool_], seen_s: Array, steps: npt.NDArray[np.int64], travel_deg: Array
) -> tuple[Array, npt.NDArray[np.int64]]:
    """The least cost from each instant on, on each turn, (turns, N + 1), and the turn that is taken there."""
    count, size = is_reached.shape
    passed_s, lost_s = np.concatenate(([0.0], np.cumsum(seen_s))).tolist(), seen_s.tolist()
    reached, ahead = is_reached.tolist(), np.maximum(steps, 1).tolist()  # lists: an array of a few turns costs more
    travel_s = (TRAVEL_COST_S_DEG * travel_deg).tolist()
    cost, then = [[0.0] * (size + 1) for _ in range(count)], [[0] * size for _ in range(count)]
    for i in range(size - 1, -1, -1):
        for k in range(count):
            least_s, stays_s = inf, (0.0 if reached[k][i] else lost_s[i]) + cost[k][i + 1]
            for n in range(count):
                if n == k:
                    way_s, weighed_s = stays_s, stays_s - 1e-12  # as good as staying is staying
                else:
                    to = min(i + ahead[k][n], size)
                    way_s = weighed_s = passed_s[to] - passed_s[i] + cost[n][to] + travel_s[k][n]
                if weighed_s < least_s:
                    least_s, cost[k][i], then[k][i] = weighed_s, way_s, n
    return np.array(cost), np.array(then)


def _first(ask: TurnAsk, offset_deg: float, k: int, cost: Array, seen_s: Array, step_s: float) -> float:
    """The cost of a turn from where the antenna stands."""
    way_deg = abs(float(ask.az_deg[0]) + offset_deg - ask.present_az_deg)
    way_s = ask.way_s(way_deg) if way_deg > ON_PATH_DEG else 0.0
    late_s = max(way_s - max(float(ask.tai_s[0]) - ask.now_tai_s, 0.0), 0.0)
    late = min(ceil(late_s / step_s), seen_s.size)
    either_way_s = 0.0 if ask.is_either_way(offset_deg) else EITHER_WAY_COST_S
    return float(seen_s[:late].sum() + cost[k, late]) + either_way_s + TRAVEL_COST_S_DEG * way_deg


def _unwindings(
    k: int, then: npt.NDArray[np.int64], steps: npt.NDArray[np.int64], offsets: Array, tai_s: Array, step_s: float
) -> Iterator[Unwinding]:
    i = 0
    while i < then.shape[1]:
        to = int(then[k, i])
        if to == k:
            i += 1
            continue
        yield Unwinding(float(tai_s[i]), float(offsets[to] - offsets[k]), float(steps[k, to]) * step_s)
        i, k = i + max(int(steps[k, to]), 1), to
