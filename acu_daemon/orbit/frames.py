"""Frames: geodetic station to ITRS, and TEME (true equator, mean equinox of date) to and from ITRS.

TEME turns by the IAU 1982 mean sidereal time of UT1 into PEF (the pseudo Earth-fixed frame), and by polar motion into
ITRS.  Source: Vallado, Crawford, Hujsak, Kelso, Revisiting Spacetrack Report #3, AIAA 2006-6753, appendix C.
"""

from math import cos, sin, sqrt

import numpy as np

from acu_daemon.model import EarthOrientation, Station
from acu_daemon.orbit.timescales import gmst_rad
from acu_daemon.units import ARCSEC, DEG, EARTH_EQUATORIAL_RADIUS_M, EARTH_FLATTENING, EARTH_RATE_RAD_S, Array


def station_itrs_m(station: Station) -> Array:
    """Turn a geodetic WGS84 position into ITRS metres, shape (3,)."""
    lat, lon = station.latitude_deg * DEG, station.longitude_deg * DEG
    e2 = EARTH_FLATTENING * (2.0 - EARTH_FLATTENING)
    n_m = EARTH_EQUATORIAL_RADIUS_M / sqrt(1.0 - e2 * sin(lat) ** 2)
    axis_m = (n_m + station.height_m) * cos(lat)
    return np.array([axis_m * cos(lon), axis_m * sin(lon), (n_m * (1.0 - e2) + station.height_m) * sin(lat)])


def enu_from_itrs(station: Station) -> Array:
    """Rotation (3, 3) that turns ITRS column vectors into east-north-up at the station."""
    lat, lon = station.latitude_deg * DEG, station.longitude_deg * DEG
    return np.array(
        [
            [-sin(lon), cos(lon), 0.0],
            [-sin(lat) * cos(lon), -sin(lat) * sin(lon), cos(lat)],
            [cos(lat) * cos(lon), cos(lat) * sin(lon), sin(lat)],
        ]
    )


def itrs_from_teme(
    r_teme_m: Array, v_teme_m_s: Array, tai_s: Array, orientation: EarthOrientation
) -> tuple[Array, Array]:
    """Turn inertial states into Earth-fixed ones.

    Args:    r_teme_m, v_teme_m_s: (N, 3); tai_s: (N,).
    Returns: r_itrs_m, v_itrs_m_s: (N, 3); the velocity is that seen by an observer who turns with the Earth.
    """
    r_pef_m, v_pef_m_s = _turn_z(gmst_rad(tai_s, orientation.ut1_utc_s), r_teme_m, v_teme_m_s)
    v_pef_m_s[:, 0] += EARTH_RATE_RAD_S * r_pef_m[:, 1]
    v_pef_m_s[:, 1] -= EARTH_RATE_RAD_S * r_pef_m[:, 0]
    if orientation.polar_x_arcsec == 0.0 and orientation.polar_y_arcsec == 0.0:
        return r_pef_m, v_pef_m_s
    wobble = _itrs_from_pef(orientation).T
    return r_pef_m @ wobble, v_pef_m_s @ wobble


def teme_from_itrs(r_itrs_m: Array, tai_s: Array, orientation: EarthOrientation) -> Array:
    """Turn Earth-fixed positions (N, 3) or one (3,) into TEME positions (N, 3) at the times (N,)."""
    r_pef_m = np.broadcast_to(r_itrs_m @ _itrs_from_pef(orientation), (tai_s.size, 3))
    (r_teme_m,) = _turn_z(-gmst_rad(tai_s, orientation.ut1_utc_s), r_pef_m)
    return r_teme_m


def teme_from_itrs_states(
    r_itrs_m: Array, v_itrs_m_s: Array, tai_s: Array, orientation: EarthOrientation
) -> tuple[Array, Array]:
    """Turn Earth-fixed states into inertial ones, the inverse of `itrs_from_teme`; every array (N, 3)."""
    pef = _itrs_from_pef(orientation)
    r_pef_m, v_pef_m_s = r_itrs_m @ pef, v_itrs_m_s @ pef
    v_pef_m_s[:, 0] -= EARTH_RATE_RAD_S * r_pef_m[:, 1]
    v_pef_m_s[:, 1] += EARTH_RATE_RAD_S * r_pef_m[:, 0]
    r_teme_m, v_teme_m_s = _turn_z(-gmst_rad(tai_s, orientation.ut1_utc_s), r_pef_m, v_pef_m_s)
    return r_teme_m, v_teme_m_s


def _turn_z(angle_rad: Array, *vectors: Array) -> list[Array]:
    """Coordinates of vectors, (N, 3) each, in a frame turned by the angles (N,) about the z axis."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    turned = []
    for one in vectors:
        x, y = one[:, 0], one[:, 1]
        new = one.copy()
        new[:, 0], new[:, 1] = c * x + s * y, c * y - s * x
        turned.append(new)
    return turned


def _itrs_from_pef(orientation: EarthOrientation) -> Array:
    """Polar motion R1(-y) R2(-x), the transpose of the conventional ITRS-to-PEF matrix, (3, 3)."""
    x, y = orientation.polar_x_arcsec * ARCSEC, orientation.polar_y_arcsec * ARCSEC
    about_y = np.array([[cos(x), 0.0, sin(x)], [0.0, 1.0, 0.0], [-sin(x), 0.0, cos(x)]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos(y), -sin(y)], [0.0, sin(y), cos(y)]])
    wobble: Array = about_x @ about_y
    return wobble
