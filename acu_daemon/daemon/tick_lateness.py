"""How late the ticks came: the newest of them, and their percentiles."""

from dataclasses import dataclass
from typing import Any

import numpy as np

KEPT = 36000  # an hour of ticks


@dataclass(frozen=True, slots=True)
class LatenessFigures:
    """Percentiles in milliseconds; zeros where nothing was measured."""

    p50_ms: float = 0.0
    p99_ms: float = 0.0
    max_ms: float = 0.0


class Lateness:
    """The lateness of the newest ticks.  Owned by the loop."""

    def __init__(self) -> None:
        self._late_s = np.zeros(KEPT)
        self._count = 0

    def add(self, late_s: float) -> None:
        """Take the lateness of one tick, seconds."""
        self._late_s[self._count % KEPT] = late_s
        self._count += 1

    def newest_ms(self, most: int = KEPT) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Lateness of the newest ticks, at most so many, milliseconds, oldest first."""
        newest = np.arange(self._count - min(most, KEPT, self._count), self._count)
        return 1e3 * self._late_s[newest % KEPT]

    def figures(self, most: int = KEPT) -> LatenessFigures:
        """Sum up the newest ticks, at most so many."""
        late_ms = np.sort(self.newest_ms(most))
        if late_ms.size == 0:
            return LatenessFigures()
        p50_ms, p99_ms = (float(late_ms[int(share * (late_ms.size - 1))]) for share in (0.5, 0.99))
        return LatenessFigures(p50_ms, p99_ms, float(late_ms[-1]))
