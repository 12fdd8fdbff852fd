"""Where the sun stands, to 0.0008 deg from 1960 to 2060, by the greatest terms of VSOP87.

Source: Bretagnon and Francou, Planetary theories in rectangular and spherical variables, Astronomy and Astrophysics 202
(1988), its version D (mean equinox and ecliptic of date), each term of more than 0.4 arcsec.  The sun's latitude, 0.9
arcsec at most, is left out.  With the annual aberration, and nutation and obliquity of orbit.celestial.
"""

from math import pi

import numpy as np

from acu_daemon.model import Site
from acu_daemon.orbit.celestial import ecliptic_rad, teme_from_tod
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.look import look
from acu_daemon.units import ARCSEC, DAY_S, Array

AU_M = 1.495978707e11  # IAU 2012 resolution B2
RISEN_EL_DEG = -0.833  # geometric elevation at sunrise and sunset: half a diameter and refraction at the horizon
_TT_MINUS_TAI_S = 32.184
_MILLENNIUM_DAYS = 365250.0
_ABERRATION_RAD = 20.4955 * ARCSEC  # of light from one astronomical unit away

# 1e-8 rad (au for the distance), phase in rad, rad per Julian millennium since J2000.0; by the power of the millennia
_LONGITUDE = (
    np.array(
        [
            (175347046.0, 0.0, 0.0),
            (3341656.0, 4.6692568, 6283.07585),
            (34894.0, 4.6261, 12566.1517),
            (3497.0, 2.7441, 5753.3849),
            (3418.0, 2.8289, 3.5231),
            (3136.0, 3.6277, 77713.7715),
            (2676.0, 4.4181, 7860.4194),
            (2343.0, 6.1352, 3930.2097),
            (1324.0, 0.7425, 11506.7698),
            (1273.0, 2.0371, 529.6910),
            (1199.0, 1.1096, 1577.3435),
            (990.0, 5.233, 5884.927),
            (902.0, 2.045, 26.298),
            (857.0, 3.508, 398.149),
            (780.0, 1.179, 5223.694),
            (753.0, 2.533, 5507.553),
            (505.0, 4.583, 18849.228),
            (492.0, 4.205, 775.523),
            (357.0, 2.920, 0.067),
            (317.0, 5.849, 11790.629),
            (284.0, 1.899, 796.298),
            (271.0, 0.315, 10977.079),
            (243.0, 0.345, 5486.778),
            (206.0, 4.806, 2544.314),
            (205.0, 1.869, 5573.143),
            (202.0, 2.458, 6069.777),
        ]
    ),
    np.array([(628331966747.0, 0.0, 0.0), (206059.0, 2.678235, 6283.07585), (4303.0, 2.6351, 12566.1517)]),
    np.array([(52919.0, 0.0, 0.0), (8720.0, 1.0721, 6283.0758)]),
)
_DISTANCE = (
    np.array([(100013989.0, 0.0, 0.0), (1670700.0, 3.0984635, 6283.07585), (13956.0, 3.05525, 12566.1517)]),
    np.array([(103019.0, 1.10749, 6283.07585)]),
)


def sun_teme_m(tai_s: Array) -> Array:
    """Apparent position of the sun at the times (N,): (N, 3) from the Earth's centre, TEME."""
    millennia = (tai_s + _TT_MINUS_TAI_S) / DAY_S / _MILLENNIUM_DAYS
    distance = _sum(_DISTANCE, millennia)
    nutation_rad, obliquity_rad = ecliptic_rad(tai_s)
    longitude_rad = _sum(_LONGITUDE, millennia) + pi - _ABERRATION_RAD / distance + nutation_rad
    flat = np.sin(longitude_rad)
    toward = np.stack([np.cos(longitude_rad), np.cos(obliquity_rad) * flat, np.sin(obliquity_rad) * flat], axis=-1)
    position_m: Array = (teme_from_tod(tai_s) @ (distance[:, None] * AU_M * toward)[..., None])[..., 0]
    return position_m


def _sum(series: tuple[Array, ...], millennia: Array) -> Array:
    value = np.zeros_like(millennia)
    for terms in reversed(series):
        value = value * millennia + np.cos(terms[:, 1] + terms[:, 2] * millennia[:, None]) @ (1e-8 * terms[:, 0])
    return value


def sun_direction_deg(tai_s: Array, site: Site) -> tuple[Array, Array]:
    """Azimuth in [0, 360), clockwise from true north, and geometric elevation of the sun at the times (N,), degrees."""
    still = np.zeros((tai_s.size, 3))
    seen = look(*itrs_from_teme(sun_teme_m(tai_s), still, tai_s, site.orientation), site.station)
    return seen.az_deg, seen.el_deg
