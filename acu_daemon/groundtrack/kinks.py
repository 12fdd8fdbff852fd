"""Manoeuvres as kinks in D: where its slope changes by more than drag and noise can make."""

from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from acu_daemon.groundtrack.history import History
from acu_daemon.units import DAY_S, Array

WINDOW_DAYS = 8.0  # on either side of a kink; the drag is steady within it
SIGMAS = 6.0
_DRAG_SHARE, _DRAG_DAYS = 0.1, 3.0  # so much the drag may change within so few days, which looks like a kink
_SHARES = np.linspace(0.0, 1.0, 21).tolist()  # where in its gap a manoeuvre may lie
_LEAST_SIZE_M = 0.5
_LEAST_NOISE_M = 1.0


class FoundManoeuvre(NamedTuple):
    """A step of the semi-major axis found in D, with 1 sigma; positive is up."""

    tai_s: float
    delta_a_m: float
    sigma_m: float


class _Kink(NamedTuple):
    day: float
    change_m_day: float
    sigma_m_day: float
    left_m2: float  # sum of the squared residuals

    @property
    def significance(self) -> float:
        return abs(self.change_m_day) / self.sigma_m_day


def find_manoeuvres(history: History) -> list[FoundManoeuvre]:
    """Steps of the semi-major axis between the points of a history, oldest first.

    About each gap between two points a cubic (drag that changes steadily) with a kink is fitted to the points within
    the window, but no further than the kinks found already; the most significant one is taken, until none is left.
    What Sun and Moon make of D, which bends within days, is taken out first.
    """
    t, d = (history.tai_s - history.tai_s[0]) / DAY_S, history.d_m - history.sky_m
    per_m = history.reference.drift_m_day_per_m
    noise_m = _noise_m(t, d)
    found: dict[int, _Kink] = {}
    kinks = {k: _kink_at(t, d, k, [], noise_m) for k in range(len(t) - 1)}
    while True:
        candidates = {
            k: kink
            for k, kink in kinks.items()
            if kink is not None
            and kink.significance > SIGMAS
            and abs(kink.change_m_day / per_m) > _LEAST_SIZE_M
            and all(abs(k - one) > 1 for one in found)
        }
        if not candidates:
            break
        best = max(candidates, key=lambda k: candidates[k].significance)
        found[best] = candidates[best]
        for k in kinks:
            if abs(t[k] - t[best]) <= 2.0 * WINDOW_DAYS:
                kinks[k] = _kink_at(t, d, k, sorted(one for one in found if one != k), noise_m)
    made = []
    for k in sorted(found):
        others = [one for one in found if one != k]
        placed = [_kink_at(t, d, k, others, noise_m, share) for share in _SHARES]
        kink = min((one for one in placed if one is not None), key=lambda one: one.left_m2, default=found[k])
        tai_s = float(history.tai_s[0]) + kink.day * DAY_S
        made.append(FoundManoeuvre(tai_s, kink.change_m_day / per_m, abs(kink.sigma_m_day / per_m)))
    return made


def _kink_at(t: Array, d: Array, k: int, found: list[int], noise_m: float, share: float = 0.5) -> _Kink | None:
    """The change of slope at a share of the gap between the points k and k + 1; None: too few points on a side."""
    day = float(t[k] + share * (t[k + 1] - t[k]))
    low = max([one + 1 for one in found if one < k], default=0)
    high = min([one for one in found if one > k], default=len(t) - 1)
    first = max(low, int(np.searchsorted(t, day - WINDOW_DAYS)))
    last = min(high, int(np.searchsorted(t, day + WINDOW_DAYS, side="right")) - 1)
    x = t[first : last + 1] - day
    if k - first < 2 or last - k < 3:
        return None
    design = np.stack([np.ones_like(x), x, x**2, x**3, np.maximum(x, 0.0)], axis=1)
    solved, left, rank, _ = np.linalg.lstsq(design, d[first : last + 1])
    if rank < 5:
        return None
    left_m2 = float(left[0]) if left.size else 0.0
    spread_m = sqrt(left_m2 / (x.size - 5)) if x.size > 5 else 0.0
    of_noise = max(noise_m, spread_m) * sqrt(float(np.linalg.inv(design.T @ design)[4, 4]))
    of_drag = _DRAG_SHARE * 2.0 * abs(float(solved[2])) * _DRAG_DAYS
    return _Kink(day, float(solved[4]), hypot(of_noise, of_drag), left_m2)


def _noise_m(t: Array, d: Array) -> float:
    """1 sigma of D's points: how far each is from the line between its neighbours, robustly."""
    share = (t[1:-1] - t[:-2]) / np.maximum(t[2:] - t[:-2], 1e-9)
    off = d[1:-1] - (d[:-2] + share * (d[2:] - d[:-2]))
    return max(_LEAST_NOISE_M, float(1.4826 * np.median(np.abs(off - np.median(off)))) / sqrt(1.5))
