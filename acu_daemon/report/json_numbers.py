"""Numbers as they stand in the JSON of a report: rounded, and null where they are not known."""

from math import isfinite
from typing import Any

import numpy as np

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

MOST_POINTS = 500  # of a curve


def utc_of(tai_s: float) -> str:
    """A time of day to a tenth of a second."""
    return utc_text(tai_s, 1)


def rounded(value: float | None, digits: int) -> float | None:
    """A number; what is not finite is not known."""
    return None if value is None or not isfinite(value) else round(float(value), digits) + 0.0


def few(count: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Indices of at most MOST_POINTS of so many points, evenly spread, both ends among them."""
    return np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).astype(np.int64))


def all_rounded(values: Array, digits: int) -> list[float | None]:
    """All of them, (N,)."""
    return [rounded(one, digits) for one in values.tolist()]
