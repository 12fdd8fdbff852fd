"""Constants with their source, and the few angle helpers every room needs.

SGP4 keeps constants of its own (WGS72, inside the sgp4 package); those here serve everything else.
"""

from math import pi

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

MU_M3_S2 = 3.986004418e14  # geocentric gravitational constant, IERS Conventions 2010, table 1.1
EARTH_EQUATORIAL_RADIUS_M = 6378137.0  # WGS84 (NIMA TR8350.2)
EARTH_FLATTENING = 1.0 / 298.257223563  # WGS84 (NIMA TR8350.2)
EARTH_RATE_RAD_S = 7.292115e-5  # WGS84 (NIMA TR8350.2)
J2 = 1.08262668e-3  # EGM96, unnormalised
J3 = -2.53265649e-6  # EGM96, unnormalised
J4 = -1.61962159e-6  # EGM96, unnormalised

DEG = pi / 180.0
ARCSEC = DEG / 3600.0
DAY_S = 86400.0


def wrap_180(angle_deg: float) -> float:
    """Turn an angle, or a difference of two, into [-180, 180) degrees."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def wrap_pi_array(angle_rad: Array) -> Array:
    """Turn angles of any shape into [-pi, pi) radians."""
    return (angle_rad + pi) % (2.0 * pi) - pi


def wrap_180_array(angle_deg: Array) -> Array:
    """Turn angles of any shape into [-180, 180) degrees."""
    return (angle_deg + 180.0) % 360.0 - 180.0
