"""Where the sun stands, by the low-precision formulas of the Astronomical Almanac: to 0.01 deg from 1950 to 2050."""

import numpy as np

from acu_daemon.model import Site
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.look import look
from acu_daemon.units import DAY_S, DEG, Array

AU_M = 1.495978707e11  # IAU 2012 resolution B2
RISEN_EL_DEG = -0.833  # geometric elevation at sunrise and sunset: half a diameter and refraction at the horizon
_TT_MINUS_TAI_S = 32.184


def sun_teme_m(tai_s: Array) -> Array:
    """Apparent position of the sun at the times (N,): (N, 3) from the Earth's centre, mean equator and equinox of date.

    Source:  Astronomical Almanac, section C, low-precision formulas for the Sun's coordinates.
    """
    days = (tai_s + _TT_MINUS_TAI_S) / DAY_S  # of TT since J2000.0
    anomaly = (357.528 + 0.9856003 * days) * DEG
    longitude = (280.460 + 0.9856474 * days + 1.915 * np.sin(anomaly) + 0.020 * np.sin(2.0 * anomaly)) * DEG
    obliquity = (23.439 - 0.0000004 * days) * DEG
    distance_m = (1.00014 - 0.01671 * np.cos(anomaly) - 0.00014 * np.cos(2.0 * anomaly)) * AU_M
    flat = np.sin(longitude)
    toward = np.stack([np.cos(longitude), np.cos(obliquity) * flat, np.sin(obliquity) * flat], axis=-1)
    position_m: Array = distance_m[:, None] * toward
    return position_m


def sun_direction_deg(tai_s: Array, site: Site) -> tuple[Array, Array]:
    """Azimuth in [0, 360), clockwise from true north, and geometric elevation of the sun at the times (N,), degrees."""
    still = np.zeros((tai_s.size, 3))
    seen = look(*itrs_from_teme(sun_teme_m(tai_s), still, tai_s, site.orientation), site.station)
    return seen.az_deg, seen.el_deg
