"""Offsets that are correlated in time: an axis that hunts, or a track that is drawn off its path slowly.  Pure.

White noise averages out; correlated offsets do not, and no orbit can follow them.  The measure is the autocovariance of
the offsets at lags of a few readings, against that of the readings believed.
"""

from collections.abc import Callable

import numpy as np

from acu_daemon.assist.screening.offsets import Flags, Offsets
from acu_daemon.assist.screening.orbit_test import OrbitTest
from acu_daemon.assist.screening_limits import (
    CORRELATED_RATIO,
    JUDGED_S,
    REACH,
    RESET_S,
    WINDOW_COUNT,
    WINDOW_S,
    YOUNG_S,
)
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings

LAGS = (1, 2, 3, 4)  # slow readings of a fast axis change their sign from one to the next
_NONE = Readings.of([])


def correlated_deg2(seen: Offsets) -> float:
    """The mean product of offsets some readings apart, the largest: 0 for white noise, or up to the mean square."""
    right, up = seen.right_deg, seen.up_deg
    return max(float(right[k:] @ right[:-k] + up[k:] @ up[:-k]) / (right.size - k) for k in LAGS)


class CorrelatedOffsets:
    """Takes readings off the path by little, oldest first.  Mutable; one owner.

    begin_tai_s: since when the newest ones are correlated; infinite while they are not.
    """

    def __init__(self, orbit_test: OrbitTest, settings: EstimatorSettings) -> None:
        self._orbit_test = orbit_test
        self._noise_deg2 = settings.sigma_azimuth_deg**2 + settings.sigma_elevation_deg**2
        self._recent = _NONE
        self.begin_tai_s = np.inf

    def is_within(self, seen: Offsets) -> Flags:
        """Which readings to ask about: the near ones; while others are correlated, those farther off too."""
        within: Flags = seen.angle_deg <= (REACH if np.isfinite(self.begin_tai_s) else 1.0) * seen.near_deg
        return within

    def take(self, readings: Readings) -> None:
        """Take the next readings that `are_correlated` asks about."""
        recent = Readings.joined([self._recent, readings])
        count = max(WINDOW_COUNT, int(np.count_nonzero(recent.tai_s > recent.tai_s[-1] - YOUNG_S)), len(readings))
        self._recent = recent.part(slice(-count, None))

    def are_correlated(self, kept: Readings, offsets_of: Callable[[Readings], Offsets]) -> bool:
        """Say whether the newest offsets are correlated; after RESET_S such readings are better than none.

        offsets_of: from the fit to the kept ones.  Where offsets are about the path as it was extrapolated, the orbit
        through them and those kept decides.
        """
        tai_s = self._recent.tai_s
        newest_count = max(WINDOW_COUNT, int(np.count_nonzero(tai_s > tai_s[-1] - WINDOW_S)))
        newest = offsets_of(self._recent.part(slice(-newest_count, None)))
        if not self._is_no_orbits(kept, newest):
            self.begin_tai_s = np.inf
            return False
        if np.isinf(self.begin_tai_s):
            self.begin_tai_s = self._likely_begin_tai_s(newest) - WINDOW_S  # two bad readings cost more than three good
        return float(tai_s[-1]) < self.begin_tai_s + RESET_S

    def _is_no_orbits(self, kept: Readings, newest: Offsets) -> bool:
        if newest.tai_s.size < WINDOW_COUNT or correlated_deg2(newest) <= CORRELATED_RATIO * self._noise_deg2:
            return False
        count = max(newest.tai_s.size, int(np.count_nonzero(self._recent.tai_s >= self.begin_tai_s)))
        window = self._recent.part(slice(-count, None))
        before = kept.part((kept.tai_s < window.tai_s[0]) & (kept.tai_s > window.tai_s[0] - JUDGED_S))
        if len(before) < WINDOW_COUNT:
            return False
        together = self._orbit_test.best_offsets(Readings.joined([before, window]), 1.0)
        if together is None:
            return False
        old, new = together.part(slice(None, len(before))), together.part(slice(len(before), None))
        return correlated_deg2(new) > CORRELATED_RATIO * max(
            self._noise_deg2, _noise_seen_deg2(old), correlated_deg2(old)
        )

    def _likely_begin_tai_s(self, seen: Offsets) -> float:
        """The instant from which on, most likely, the offsets are more than the configured noise."""
        square = seen.angle_deg**2 / self._noise_deg2
        count = np.arange(square.size, 0, -1)
        later = np.cumsum(square[::-1])[::-1] / count
        cost = np.cumsum(square) - square + count * (1.0 + np.log(np.maximum(later, 1.0)))
        return float(seen.tai_s[int(np.argmin(cost))])


def _noise_seen_deg2(seen: Offsets) -> float:
    """What offsets show of noise, both components: half the mean square of their differences."""
    return float(np.mean(np.square(np.diff(seen.right_deg)) + np.square(np.diff(seen.up_deg)))) / 2.0
