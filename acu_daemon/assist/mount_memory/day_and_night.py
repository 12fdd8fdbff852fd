"""What sun and night do to the zero points: a cosine and a sine of the time of day, beside the mean of a day.  Pure.

A memory keeps twelve states: the eight terms, each the mean over a day, and IA and IE by cosine and sine.  A pass of a
quarter of an hour sees eight: IA + c cos w + s sin w, w = 2 pi times the share of the day.  Of zero points that hold
still c and s are 0.
"""

import numpy as np

from acu_daemon.assist.estimators.full.pedestal_prior import IA, IE, PEDESTAL_TERMS
from acu_daemon.units import DAY_S, DEG, Array

COUNT = len(PEDESTAL_TERMS)
SWINGS = ("IA cos", "IA sin", "IE cos", "IE sin")
STATE_COUNT = COUNT + len(SWINGS)
SWING_DEG = 0.014  # 1 sigma of each: 0.02 of the amplitude
_SWING_WALK_DEG = 0.002  # per square root of a day: the weather, the season
_MOST_SHARE = 0.5  # of a zero point's variance before any pass


def at_time_of_day(tai_s: float) -> Array:
    """What a pass at a time sees of the states (12,): (8, 12)."""
    h = np.eye(COUNT, STATE_COUNT)
    angle = 2.0 * np.pi * (tai_s % DAY_S) / DAY_S
    for k, term in enumerate((IA, IE)):
        first = COUNT + 2 * k
        h[term, first : first + 2] = np.cos(angle), np.sin(angle)
    return h


def before_any_pass(sigma: Array, *, is_still: bool = False) -> Array:
    """Variances (12,) of the states, of terms with these sigmas (8,): a pass at any time sees terms with them."""
    swing = np.minimum(0.0 if is_still else (SWING_DEG * DEG) ** 2, _MOST_SHARE * sigma[[IA, IE]] ** 2)
    variance = sigma**2
    variance[[IA, IE]] -= swing
    return np.concatenate((variance, np.repeat(swing, 2)))


def swing_walk(sigma: Array) -> Array:
    """Variances (4,) that a day adds to the swings; none where the zero point is not estimated."""
    return np.where(np.repeat(sigma[[IA, IE]], 2) > 0.0, (_SWING_WALK_DEG * DEG) ** 2, 0.0)


def without_swings(mean: Array, covariance: Array) -> tuple[Array, Array]:
    """States (12,) and their covariance that have the terms alone, as zero points that hold still have them."""
    is_term = np.arange(STATE_COUNT) < COUNT
    return np.where(is_term, mean, 0.0), np.where(np.outer(is_term, is_term), covariance, 0.0)


def swing_of(mean: Array, term: int) -> tuple[float, float]:
    """Amplitude, rad, of IA or IE in the states (12,), and the time of day, 0 to 1 of tai_s's day, of the highest."""
    first = COUNT + 2 * (IA, IE).index(term)
    cosine, sine = mean[first : first + 2].tolist()
    return float(np.hypot(cosine, sine)), float(np.arctan2(sine, cosine) / (2.0 * np.pi) % 1.0)
