"""Offsets that are correlated in time: an axis that hunts, or a track that is drawn off its path slowly.  Pure.

White noise averages out; correlated offsets do not, and no orbit can follow them.  The measure is the autocovariance of
the offsets at lags of a few readings, against that of the readings believed.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from acu_daemon.assist.reading_gate import ACCELERATION, OFF_PATH
from acu_daemon.assist.screening.offsets import Flags, Offsets
from acu_daemon.assist.screening.orbit_test import OrbitTest
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings

WINDOW_S, WINDOW_COUNT = 3.0, 8  # both at least
BEFORE_S = 120.0
LAGS = (1, 2, 3, 4)  # slow readings of a fast axis change their sign from one to the next
FACTOR = 2.0  # of the noise squared, and of what the readings believed show
REACH = 2.0  # times as far off as is near an axis may hunt
TURNING_S, TURNING_SHARE = 20.0, 0.3  # so much of them is left without their trend: an axis that hunts
LONGEST_S = 75.0  # then such readings are better than none
_NONE = Readings.of([])


def correlated_deg2(seen: Offsets) -> float:
    """The mean product of offsets some readings apart, the largest: 0 for white noise, or up to the mean square."""
    right, up = seen.right_deg, seen.up_deg
    return max(float(right[k:] @ right[:-k] + up[k:] @ up[:-k]) / (right.size - k) for k in LAGS)


class CorrelatedOffsets:
    """Takes readings off the path by little, oldest first.  Mutable; one owner.

    reason: of the newest readings, "" while they are not correlated.  begin_tai_s: since when the newest ones are.
    """

    def __init__(self, orbit_test: OrbitTest, settings: EstimatorSettings) -> None:
        self._orbit_test, self._settings = orbit_test, settings
        self._recent = _NONE
        self._since_tai_s: float | None = None
        self.reason = ""
        self.begin_tai_s = np.inf

    def is_within(self, seen: Offsets) -> Flags:
        """Which readings to ask about: the near ones; while others are correlated, those farther off too."""
        within: Flags = seen.angle_deg <= (REACH if self.reason else 1.0) * seen.near_deg
        return within

    def take(self, readings: Readings) -> None:
        """Take the next readings that `are_correlated` asks about."""
        recent = Readings.joined([self._recent, readings])
        count = max(WINDOW_COUNT, int(np.count_nonzero(recent.tai_s > recent.tai_s[-1] - TURNING_S)), len(readings))
        self._recent = recent.part(slice(-count, None))

    def are_correlated(self, kept: Readings, offsets_of: Callable[[Readings], Offsets]) -> bool:
        """Say whether the newest offsets are correlated.  offsets_of: from the fit to the kept ones.

        Where they are about the path as it was extrapolated, the orbit through them and those kept decides.
        """
        tai_s = self._recent.tai_s
        newest_count = max(WINDOW_COUNT, int(np.count_nonzero(tai_s > tai_s[-1] - WINDOW_S)))
        newest = offsets_of(self._recent.part(slice(-newest_count, None)))
        self.reason = self._reason(kept, newest, offsets_of)
        if not self.reason:
            self._since_tai_s = None
            return False
        if self._since_tai_s is None:
            self._since_tai_s = self.begin_tai_s = self._begin_tai_s(newest)
        return float(tai_s[-1]) < self._since_tai_s + LONGEST_S

    def _noise_deg2(self) -> float:
        return self._settings.sigma_azimuth_deg**2 + self._settings.sigma_elevation_deg**2

    def _reason(self, kept: Readings, newest: Offsets, offsets_of: Callable[[Readings], Offsets]) -> str:
        if newest.tai_s.size < WINDOW_COUNT or correlated_deg2(newest) <= FACTOR * self._noise_deg2():
            return ""
        count = int(np.count_nonzero(self._recent.tai_s >= self.begin_tai_s)) if self.reason else 0
        window = self._recent.part(slice(-max(count, newest.tai_s.size), None))
        before = kept.part((kept.tai_s < window.tai_s[0]) & (kept.tai_s > window.tai_s[0] - BEFORE_S))
        if len(before) < WINDOW_COUNT:
            return ""
        together = self._orbit_test.best_offsets(Readings.joined([before, window]), 1.0)
        if together is None:
            return ""
        old, new = together.part(slice(None, len(before))), together.part(slice(len(before), None))
        if correlated_deg2(new) <= FACTOR * max(self._noise_deg2(), _noise_seen_deg2(old), correlated_deg2(old)):
            return ""
        whole = offsets_of(window)
        return ACCELERATION if correlated_deg2(_turning(whole)) > TURNING_SHARE * correlated_deg2(whole) else OFF_PATH

    def _begin_tai_s(self, seen: Offsets) -> float:
        """Where the readings become more than noise: the most likely instant; where they drift, when that began."""
        noise_deg2 = self._noise_deg2()
        square = seen.angle_deg**2 / noise_deg2
        count = np.arange(square.size, 0, -1)
        later = np.cumsum(square[::-1])[::-1] / count
        cost = np.cumsum(square) - square + count * (1.0 + np.log(np.maximum(later, 1.0)))
        correlated = seen.part(slice(int(np.argmin(cost)), None))
        first_tai_s = float(correlated.tai_s[0])
        right, up = correlated.drift_deg_s(WINDOW_S)
        if self.reason != OFF_PATH or right == up == 0.0:
            return first_tai_s
        off = float(np.mean(correlated.right_deg) * right + np.mean(correlated.up_deg) * up)
        on_path_tai_s = float(np.mean(correlated.tai_s)) - off / (right * right + up * up)
        return min(max(on_path_tai_s, first_tai_s - WINDOW_S), first_tai_s)


def _turning(seen: Offsets) -> Offsets:
    """What is left of offsets without their mean and drift: much where an axis hunts."""
    t = seen.tai_s - seen.tai_s[0]
    right_deg, up_deg = (one - np.polyval(np.polyfit(t, one, 1), t) for one in (seen.right_deg, seen.up_deg))
    return replace(seen, right_deg=right_deg, up_deg=up_deg)


def _noise_seen_deg2(seen: Offsets) -> float:
    """What offsets show of noise, both components: half the mean square of their differences."""
    return float(np.mean(np.square(np.diff(seen.right_deg)) + np.square(np.diff(seen.up_deg)))) / 2.0
