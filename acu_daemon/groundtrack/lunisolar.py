"""What Sun and Moon do to a circular orbit, averaged over a revolution.

The averaged torque of a body in direction s at distance d on an orbit with the unit normal n is
    -(3 mu a^2 / (2 d^3)) (n.s) (n x s)   per unit of mass,
it tilts the plane; the averaged potential R = mu a^2 / (4 d^3) (1 - 3 (n.s)^2) speeds the satellite along its orbit by
-(2 / (n a)) dR/da = -4 R / (n a^2).  Source: Kaula, Theory of Satellite Geodesy (1966), section 3.2, degree 2, e = 0.

Positions of Sun and Moon: Montenbruck and Gill, Satellite Orbits (2000), section 3.3.2, of date; the Sun to 0.02 deg,
the Moon to 0.1 deg.  That is a relative error of 2e-3 in a force that is itself a thousandth of J2's.
"""

from typing import NamedTuple

import numpy as np

from acu_daemon.units import DAY_S, DEG, MU_M3_S2, Array

MU_SUN_M3_S2 = 1.32712440041e20  # IERS Conventions 2010, table 1.1
MU_MOON_M3_S2 = 4.902800066e12  # DE421, from IERS Conventions 2010, table 1.1
_CENTURY_S = 36525.0 * DAY_S
_PRECESSION_DEG = 1.3972  # of the equinox in a century


class ThirdBody(NamedTuple):
    """A body in the equatorial frame of date: unit vectors (N, 3), distances (N,)."""

    direction: Array
    distance_m: Array


class PlaneRates(NamedTuple):
    """Averaged rates of a circular orbit, rad/s, each (N,); alpha's without what the semi-major axis makes."""

    inclination: Array
    raan: Array
    alpha: Array


def sun(tai_s: Array) -> ThirdBody:
    """The Sun at the times (N,)."""
    t = tai_s / _CENTURY_S
    m = (357.5256 + 35999.049 * t) * DEG
    longitude = (
        (282.9400 + _PRECESSION_DEG * t) * DEG + m + (6892.0 * np.sin(m) + 72.0 * np.sin(2.0 * m)) / 3600.0 * DEG
    )
    distance_m = (149.619 - 2.499 * np.cos(m) - 0.021 * np.cos(2.0 * m)) * 1e9
    return ThirdBody(_equatorial(longitude, np.zeros_like(longitude)), distance_m)


def moon(tai_s: Array) -> ThirdBody:
    """The Moon at the times (N,)."""
    t = tai_s / _CENTURY_S
    l0 = (218.31617 + 481267.88088 * t) * DEG  # of date: the source's, with the precession left in
    el = (134.96292 + 477198.86753 * t) * DEG
    es = (357.52543 + 35999.04944 * t) * DEG
    f = (93.27283 + 483202.01873 * t) * DEG
    d = (297.85027 + 445267.11135 * t) * DEG
    sin, arcsec = np.sin, DEG / 3600.0
    longitude = l0 + arcsec * (
        22640.0 * sin(el) + 769.0 * sin(2 * el) - 4586.0 * sin(el - 2 * d) + 2370.0 * sin(2 * d)
        - 668.0 * sin(es) - 412.0 * sin(2 * f) - 212.0 * sin(2 * el - 2 * d) - 206.0 * sin(el + es - 2 * d)
        + 192.0 * sin(el + 2 * d) - 165.0 * sin(es - 2 * d) + 148.0 * sin(el - es) - 125.0 * sin(d)
        - 110.0 * sin(el + es) - 55.0 * sin(2 * f - 2 * d)
    )  # fmt: skip
    latitude = arcsec * (
        18520.0 * sin(f + longitude - l0 + arcsec * (412.0 * sin(2 * f) + 541.0 * sin(es)))
        - 526.0 * sin(f - 2 * d) + 44.0 * sin(el + f - 2 * d) - 31.0 * sin(-el + f - 2 * d)
        - 25.0 * sin(-2 * el + f) - 23.0 * sin(es + f - 2 * d) + 21.0 * sin(-el + f) + 11.0 * sin(-es + f - 2 * d)
    )  # fmt: skip
    distance_m = 1e3 * (
        385000.0 - 20905.0 * np.cos(el) - 3699.0 * np.cos(2 * d - el) - 2956.0 * np.cos(2 * d)
        - 570.0 * np.cos(2 * el) + 246.0 * np.cos(2 * el - 2 * d) - 205.0 * np.cos(es - 2 * d)
        - 171.0 * np.cos(el + 2 * d) - 152.0 * np.cos(el + es - 2 * d)
    )  # fmt: skip
    return ThirdBody(_equatorial(longitude, latitude), distance_m)


def plane_rates(tai_s: Array, a_m: float, i_rad: float, raan_rad: Array) -> PlaneRates:
    """What Sun and Moon together do to the orbit with the node at `raan_rad` (N,)."""
    si, ci = np.sin(i_rad), np.cos(i_rad)
    so, co = np.sin(raan_rad), np.cos(raan_rad)
    normal = np.stack([si * so, -si * co, np.full_like(so, ci)], axis=-1)
    node = np.stack([co, so, np.zeros_like(so)], axis=-1)
    across = np.cross(normal, node)
    mean_motion = np.sqrt(MU_M3_S2 / a_m**3)
    total = np.zeros((3, tai_s.size))
    for body, mu in ((sun(tai_s), MU_SUN_M3_S2), (moon(tai_s), MU_MOON_M3_S2)):
        strength = mu / (body.distance_m**3 * mean_motion)  # over the orbit's momentum n a^2
        cosine = np.sum(normal * body.direction, axis=1)
        tilt = -1.5 * (strength * cosine)[:, None] * np.cross(normal, body.direction)
        inclination = -np.sum(tilt * across, axis=1)
        raan = np.sum(tilt * node, axis=1) / si
        total += np.array([inclination, raan, -strength * (1.0 - 3.0 * cosine**2) - ci * raan])
    return PlaneRates(*total)


def _equatorial(longitude_rad: Array, latitude_rad: Array) -> Array:
    tilt = 23.43929111 * DEG  # obliquity of J2000.0; 0.013 deg in a century
    x, y = np.cos(latitude_rad) * np.cos(longitude_rad), np.cos(latitude_rad) * np.sin(longitude_rad)
    z = np.sin(latitude_rad)
    return np.stack([x, y * np.cos(tilt) - z * np.sin(tilt), y * np.sin(tilt) + z * np.cos(tilt)], axis=-1)
