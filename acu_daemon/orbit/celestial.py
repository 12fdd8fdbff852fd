"""Celestial frames to TEME: GCRF (and ICRF axes), EME2000 and true-of-date, at the times (N,).

Precession IAU 2006 in Fukushima-Williams angles, with the frame bias; nutation the 27 largest luni-solar terms of
IAU 2000A, each above 1 mas.  Against the full series TEME is right to 0.006 arcsec, 0.2 m at 7000 km.  The older
IAU 1976/1980 models are off by 0.1 arcsec in longitude today, whatever number of terms is kept.

TEME is defined by what this package does with it: turned by the IAU 1982 sidereal time it is Earth-fixed.  So its
equinox lies where the apparent sidereal time of IAU 2006 and that of IAU 1982 differ, and the way from GCRF through
TEME to ITRS is the conventional one.
"""

from math import pi

import numpy as np

from acu_daemon.orbit.timescales import gmst_rad, utc_days
from acu_daemon.units import ARCSEC, DAY_S, Array

_TT_MINUS_TAI_S = 32.184
_CENTURY_S = 36525.0 * DAY_S
_MAS = ARCSEC / 1e3

# arcseconds, by rising powers of Julian centuries of TT; source: Hilton et al. 2006, as in SOFA iauPfw06
_GAMMA = (-0.052928, 10.556378, 0.4932044, -0.00031238, -0.000002788)
_PHI = (84381.412819, -46.811016, 0.0511268, 0.00053289, -0.000000440)
_PSI = (-0.041775, 5038.481484, 1.5584175, -0.00018522, -0.000026452)
_OBLIQUITY = (84381.406, -46.836769, -0.0001831, 0.00200340, -0.000000576)
_SIDEREAL = (0.014506, 4612.156534, 1.3915817, -0.00000044, -0.000029956)  # beyond the rotation angle, as in iauGmst06

# l, l', F, D, node of the Moon, arcseconds; source: Simon et al. 1994, linear as in SOFA iauNut00b
_ARGUMENTS = np.array([485868.249036, 1287104.79305, 335779.526232, 1072260.70369, 450160.398036])
_ARGUMENT_RATES = np.array([1717915923.2178, 129596581.0481, 1739527262.8478, 1602961601.2090, -6962890.5431])

# multiples of those; then of the sum's sine and cosine in longitude, cosine and sine in obliquity, mas
# source: IAU 2000A (Mathews, Herring, Buffett 2002), IERS Conventions 2010, tables 5.3a and 5.3b
_TERMS = np.array(
    [
        (0, 0, 0, 0, 1, -17206.42, 3.34, 9205.23, 1.54),
        (0, 0, 2, -2, 2, -1317.09, -1.37, 573.03, -0.46),
        (0, 0, 2, 0, 2, -227.64, 0.28, 97.85, 0.14),
        (0, 0, 0, 0, 2, 207.46, -0.07, -89.75, -0.03),
        (0, 1, 0, 0, 0, 147.59, 1.18, 7.39, -0.19),
        (1, 0, 0, 0, 0, 71.12, -0.09, -0.68, 0.04),
        (0, 1, 2, -2, 2, -51.68, -0.05, 22.44, -0.02),
        (0, 0, 2, 0, 1, -38.73, 0.04, 20.07, 0.03),
        (1, 0, 2, 0, 2, -30.15, 0.08, 12.9, 0.04),
        (0, -1, 2, -2, 2, 21.58, 0.01, -9.59, 0.01),
        (0, 0, 2, -2, 1, 12.82, 0.02, -6.9, 0.0),
        (-1, 0, 0, 2, 0, 15.7, -0.02, -0.12, 0.01),
        (-1, 0, 2, 0, 2, 12.35, 0.0, -5.33, 0.0),
        (1, 0, 0, 0, 1, 6.31, 0.0, -3.32, 0.0),
        (-1, 0, 0, 0, 1, -5.8, -0.02, 3.14, -0.01),
        (1, 0, 2, 0, 1, -5.16, 0.01, 2.64, 0.01),
        (-1, 0, 2, 2, 2, -5.96, 0.01, 2.55, 0.01),
        (0, 0, 0, 2, 0, 6.34, -0.01, -0.12, 0.0),
        (-2, 0, 2, 0, 1, 4.59, 0.0, -2.42, 0.0),
        (-2, 0, 0, 2, 0, -4.77, 0.0, 0.05, 0.0),
        (0, 0, 2, 2, 2, -3.86, 0.02, 1.65, 0.01),
        (0, -2, 2, -2, 2, 3.25, 0.0, -1.39, 0.0),
        (2, 0, 2, 0, 2, -3.1, 0.01, 1.32, 0.01),
        (1, 0, 2, -2, 2, 2.86, 0.0, -1.23, 0.0),
        (2, 0, 0, 0, 0, 2.92, -0.01, -0.06, 0.0),
        (-1, 0, 2, 0, 1, 2.04, 0.0, -1.08, 0.0),
        (0, 0, 2, 0, 0, 2.59, -0.01, -0.06, 0.0),
    ]
)
_NODE_PER_CENTURY_MAS = (-17.47, 0.91)  # how the first term's sine (longitude) and cosine (obliquity) grow


def teme_from_gcrf(tai_s: Array) -> Array:
    """Rotations (N, 3, 3) that turn GCRF column vectors into TEME ones."""
    t = _centuries(tai_s)
    longitude, obliquity = _nutation_rad(t)
    tod = _from_gcrf(t, longitude, obliquity)
    turned: Array = _about_z(_equinox_rad(tai_s, t, longitude)) @ tod
    return turned


def teme_from_eme2000(tai_s: Array) -> Array:
    """Rotations (N, 3, 3) that turn EME2000 (mean equator and equinox of J2000.0) column vectors into TEME ones."""
    zero = np.zeros(1)
    bias = _from_gcrf(zero, zero, zero)[0]
    turned: Array = teme_from_gcrf(tai_s) @ bias.T
    return turned


def teme_from_tod(tai_s: Array) -> Array:
    """Rotations (N, 3, 3) that turn column vectors of the true equator and true equinox of date into TEME ones."""
    t = _centuries(tai_s)
    return _about_z(_equinox_rad(tai_s, t, _nutation_rad(t)[0]))


def ecliptic_rad(tai_s: Array) -> tuple[Array, Array]:
    """Nutation in longitude, and the true obliquity of the ecliptic, at the times (N,)."""
    t = _centuries(tai_s)
    longitude, obliquity = _nutation_rad(t)
    return longitude, _arcsec(_OBLIQUITY, t) + obliquity


def _centuries(tai_s: Array) -> Array:
    """Julian centuries of TT since J2000.0."""
    return (tai_s + _TT_MINUS_TAI_S) / _CENTURY_S


def _nutation_rad(t: Array) -> tuple[Array, Array]:
    """Nutation in longitude and in obliquity."""
    arguments = (_ARGUMENTS + _ARGUMENT_RATES * t[:, None]) % (360.0 * 3600.0) * ARCSEC
    angles = arguments @ _TERMS[:, :5].T
    sines, cosines = np.sin(angles), np.cos(angles)
    longitude = sines @ _TERMS[:, 5] + cosines @ _TERMS[:, 6] + _NODE_PER_CENTURY_MAS[0] * t * sines[:, 0]
    obliquity = cosines @ _TERMS[:, 7] + sines @ _TERMS[:, 8] + _NODE_PER_CENTURY_MAS[1] * t * cosines[:, 0]
    return longitude * _MAS, obliquity * _MAS


def _from_gcrf(t: Array, longitude_rad: Array, obliquity_rad: Array) -> Array:
    """GCRF to the true equator and equinox of date, (N, 3, 3); to the mean ones with zero nutation."""
    gamma, phi, psi, epsilon = (_arcsec(one, t) for one in (_GAMMA, _PHI, _PSI, _OBLIQUITY))
    turned: Array = (
        _about_x(-(epsilon + obliquity_rad)) @ _about_z(-(psi + longitude_rad)) @ _about_x(phi) @ _about_z(gamma)
    )
    return turned


def _equinox_rad(tai_s: Array, t: Array, longitude_rad: Array) -> Array:
    """Right ascension of TEME's equinox in the true-of-date frame: apparent sidereal time of IAU 2006 less IAU 1982's.

    UT1 is taken as UTC: it acts on both alike, to a microarcsecond.
    """
    day, fraction = utc_days(tai_s)
    ut1_days = (day - 2451545.0) + fraction
    rotation_rad = 2.0 * pi * ((ut1_days % 1.0) + 0.7790572732640 + 0.00273781191135448 * ut1_days)  # IAU 2000
    node = (_ARGUMENTS[4] + _ARGUMENT_RATES[4] * t) * ARCSEC
    complement = (2.64096 * np.sin(node) + 0.06352 * np.sin(2.0 * node)) * _MAS
    apparent_rad = rotation_rad + _arcsec(_SIDEREAL, t) + longitude_rad * np.cos(_arcsec(_OBLIQUITY, t)) + complement
    beyond: Array = (apparent_rad - gmst_rad(tai_s, 0.0) + pi) % (2.0 * pi) - pi
    return beyond


def _arcsec(coefficients: tuple[float, ...], t: Array) -> Array:
    """A polynomial in arcseconds, as radians."""
    value = np.zeros_like(t)
    for coefficient in reversed(coefficients):
        value = value * t + coefficient
    return value * ARCSEC


def _about_x(angle_rad: Array) -> Array:
    c, s, one, zero = np.cos(angle_rad), np.sin(angle_rad), np.ones_like(angle_rad), np.zeros_like(angle_rad)
    return np.stack([one, zero, zero, zero, c, s, zero, -s, c], axis=-1).reshape(-1, 3, 3)


def _about_z(angle_rad: Array) -> Array:
    c, s, one, zero = np.cos(angle_rad), np.sin(angle_rad), np.ones_like(angle_rad), np.zeros_like(angle_rad)
    return np.stack([c, s, zero, -s, c, zero, zero, zero, one], axis=-1).reshape(-1, 3, 3)
