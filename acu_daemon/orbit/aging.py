"""What the age of elements costs: how far off a satellite is expected, as a time along its track and as an angle."""

from dataclasses import dataclass, replace
from math import atan2, exp, pi

import numpy as np

from acu_daemon.errors import OrbitError
from acu_daemon.orbit.brouwer import BrouwerElements
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.units import DAY_S, DEG, EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2

DRAG_SHARE = 0.5  # of the drag, unknown in advance: 34 km after five days on the ISS (docs/decisions/0023)
FRESH_M, FRESH_M_D = 1e3, 0.5e3  # of fresh elements, and what they lose in a day without drag
_BROUWER_M_D2, _AT_M, _SCALE_M = 22e3, 420e3, 85e3  # no drag at all: its whole, docs/decisions/0015, by height
PREDICTED_SHARE, DETERMINED_M, PREDICTED_M_D = 0.15, 10.0, 50.0
_LOST_SHARE = 0.25  # of a revolution


@dataclass(frozen=True, slots=True)
class ExpectedError:
    """How far off, metres along the track, of a satellite at a height on an orbit."""

    along_m: float
    a_m: float

    def __str__(self) -> str:
        """Seconds along the track, and degrees seen from below, where the satellite is nearest."""
        if not self.along_m < _LOST_SHARE * 2.0 * pi * self.a_m:
            return "the satellite may be anywhere on its orbit"
        along_s = self.along_m / (MU_M3_S2 / self.a_m) ** 0.5
        angle_deg = atan2(self.along_m, self.a_m - EARTH_EQUATORIAL_RADIUS_M) / DEG
        return f"expected error about {_rounded(along_s)} s along the track, {_rounded(angle_deg)} deg overhead"


def _rounded(value: float) -> str:
    """Two digits."""
    return f"{float(f'{value:.2g}'):g}"


def expected_error(elements: ElementSet | BrouwerElements, at_tai_s: float) -> ExpectedError:
    """The error of elements at another time than their epoch, later or earlier.

    Of an element set, what half its drag moves it; of Brouwer means, which have no drag, by the height.
    """
    if isinstance(elements, BrouwerElements):
        return _of_brouwer(elements, at_tai_s)
    a_m = elements.semi_major_axis_m
    with_more = replace(elements, bstar_per_radius=(1.0 + DRAG_SHARE) * elements.bstar_per_radius)
    at = np.array([at_tai_s])
    try:
        (r1_m, _), (r2_m, _) = (Sgp4Propagator(one).states_teme(at) for one in (elements, with_more))
    except OrbitError:
        return ExpectedError(np.inf, a_m)
    days = abs(at_tai_s - elements.epoch_tai_s) / DAY_S
    return ExpectedError(float(np.linalg.norm(r2_m - r1_m)) + FRESH_M + FRESH_M_D * days, a_m)


def predicted_error(a_m: float, since_s: float) -> ExpectedError:
    """The error of an ephemeris so long after what it was determined from; before that it is the determination's.

    A share of the drag stays unknown to whoever predicts (docs/decisions/0024), the rest is small.
    """
    days = max(since_s, 0.0) / DAY_S
    return ExpectedError(PREDICTED_SHARE * _drag_m_d2(a_m) * days**2 + DETERMINED_M + PREDICTED_M_D * days, a_m)


def _drag_m_d2(a_m: float) -> float:
    """What drag moves a satellite along its track, in the square of days."""
    return _BROUWER_M_D2 * exp(-(a_m - EARTH_EQUATORIAL_RADIUS_M - _AT_M) / _SCALE_M)


def _of_brouwer(elements: BrouwerElements, at_tai_s: float) -> ExpectedError:
    days = abs(at_tai_s - elements.epoch_tai_s) / DAY_S
    return ExpectedError(_drag_m_d2(elements.a_m) * days**2 + FRESH_M + FRESH_M_D * days, elements.a_m)
