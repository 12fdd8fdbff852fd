"""When SGP4's answers are believed: as long as they are an orbit around the Earth near that of the elements.

SGP4 takes the drag into powers of the time since the epoch.  Past the decay these grow without bound: error 6 gives way
to error 4, and that to answers without an error on orbits of any size.  So a satellite is followed from the epoch
outwards, into the future and into the past, up to the first answer that is none:

    an error of SGP4; a perigee inside the Earth; a period or an energy far above that of the epoch.

Nothing beyond is believed, whatever SGP4 says of it.  A smaller orbit with its perigee outside the Earth is believed:
so decays an eccentric one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
import numpy.typing as npt

from acu_daemon.units import EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

NO_END, DECAYED = 0, 6  # SGP4's own errors: none, and a position inside the Earth
INSIDE_EARTH, TOO_LARGE = 254, 255  # beside SGP4's errors: the perigee; the orbit
LARGEST_SHARE = 1.15  # of the elements' semi-major axis, and what the flattening adds at a perigee near the Earth:
FLATTENING_SHARE = 0.01  # over 1 - e; three times J2
PERIGEE_SPARE_M = 30e3  # inside the Earth: an osculating perigee is that far from the mean one, and much farther on
HIGH_ORBIT_M = 30e6  # orbits higher than this, which Moon and Sun bend: it grows with the fourth power of the axis
_FIRST_DAY, _EVEN_COUNT = 1.0, 120  # up to there an even grid, about eight times a revolution of a low orbit
_LAST_DAYS, _GROWTH = 7300.0, 1.01  # the first answers that are none last at least a tenth of the time since the epoch
_FINER_COUNT = 64

Errors = npt.NDArray[np.uint8]  # (N,)
States = tuple[Errors, Array, Array]  # SGP4's errors, metres (N, 3), m/s (N, 3)


@dataclass(frozen=True, slots=True)
class BelievedSpan:
    """Days since the epoch between which answers are believed; the errors beyond are SGP4's or those above."""

    first_days: float
    last_days: float
    error_before: int = NO_END
    error_after: int = NO_END


def believed_span(states: Callable[[Array], States], a_m: float, e: float) -> BelievedSpan:
    """Follow a satellite to both sides of its epoch, for 20 years at most.

    states: SGP4's answers at days since the epoch (N,).  a_m, e: of the elements.
    """
    largest_m = (LARGEST_SHARE + FLATTENING_SHARE / (1.0 - e)) * a_m
    lowest_m = EARTH_EQUATORIAL_RADIUS_M - PERIGEE_SPARE_M * max(a_m / HIGH_ORBIT_M, 1.0) ** 4
    if a_m * (1.0 - e) < EARTH_EQUATORIAL_RADIUS_M:
        lowest_m = -inf  # so are the elements themselves: SGP4's own errors remain

    def errors(days: Array) -> Errors:
        codes, r_m, v_m_s = states(days)
        axis_m, low_m = _axis_and_perigee_m(r_m, v_m_s)
        codes = np.where((codes == NO_END) & ~(axis_m < largest_m), TOO_LARGE, codes)
        return np.where((codes == NO_END) & ~(low_m > lowest_m), INSIDE_EARTH, codes)

    last_days, error_after = _last_good(errors, _grid_days())
    first_days, error_before = _last_good(errors, -_grid_days())
    return BelievedSpan(first_days, last_days, error_before, error_after)


def _last_good(errors: Callable[[Array], Errors], days: Array) -> tuple[float, int]:
    """The last time of a grid before the first bad one, to a few seconds, and the error there; infinite where none is.

    At the epoch itself where that one is bad.
    """
    found = errors(days)
    if not found.any():
        return (inf if days[-1] > 0.0 else -inf), NO_END
    bad = int(np.argmax(found != NO_END))
    for _ in range(2 if bad else 0):
        days = np.linspace(days[bad - 1], days[bad], _FINER_COUNT + 1)
        found = errors(days)
        bad = max(int(np.argmax(found != NO_END)), 1)
    return float(days[max(bad - 1, 0)]), int(found[bad])


def _grid_days() -> Array:
    even = np.linspace(0.0, _FIRST_DAY, _EVEN_COUNT + 1)
    count = int(np.ceil(np.log(_LAST_DAYS / _FIRST_DAY) / np.log(_GROWTH)))
    return np.concatenate([even, _FIRST_DAY * _GROWTH ** np.arange(1, count + 1)])


def _axis_and_perigee_m(r_m: Array, v_m_s: Array) -> tuple[Array, Array]:
    """Osculating semi-major axes and distances of the perigee (N,); infinite and NaN where it is no ellipse."""
    with np.errstate(all="ignore"):
        r = np.linalg.norm(r_m, axis=1)
        inverse_a = 2.0 / r - np.sum(v_m_s**2, axis=1) / MU_M3_S2
        a_m = np.where(inverse_a > 0.0, 1.0 / inverse_a, inf)
        h2 = np.sum(np.cross(r_m, v_m_s) ** 2, axis=1)
        e = np.sqrt(np.maximum(1.0 - h2 * inverse_a / MU_M3_S2, 0.0))
        return a_m, a_m * (1.0 - e)
