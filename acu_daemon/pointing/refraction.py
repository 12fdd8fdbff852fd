"""Refraction at radio frequencies: where a satellite at its distance appears, and back.  Pure.

Air of refractivity N(h) = N_s exp(-(h - h_s) / H) in spherical shells about the Earth's centre of curvature, N_s at the
antenna, H = 7.35 km (ITU-R P.453's reference atmosphere, scaled to the air at the antenna).

A ray that leaves the antenna (radius r0, index n0) at the apparent elevation e keeps p = n0 r0 cos e (Bouguer).  The
air bends it by tau(e) in all, so beyond the air it is a straight line of direction E = e - tau(e), at the distance p
from the centre.  The line of the same direction through the antenna passes it at b = p - r0 cos E, and a satellite on
the ray at the distance d from the antenna has the geometric elevation

    g = E + arcsin(b / d)

which is exact above the air, whatever the satellite's height; at 600 km and 5 deg of elevation the refraction is 0.006
deg less than that of a source at infinity.  So only tau(e) is integrated and tabulated, at the start, and both ways
agree: apparent to geometric is this formula, geometric to apparent its solution by Newton.

tau = -integral of dn/dr cot(elevation) / n dr.  With q = n r sin(elevation), d(n r) / q = dq / (n r), and the integrand
is smooth from the antenna (also where the ray first descends) to the top of the air.

Below -1 deg apparent (about -2.3 geometric) rays meet the ground; from there the difference goes on smoothly to a
limit, so that a path that comes up from below has no step.  Beyond the zenith (plunge, elevation above 90) all is
mirrored.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import sin

import numpy as np
import numpy.typing as npt

from acu_daemon.model import Station
from acu_daemon.units import DEG, EARTH_EQUATORIAL_RADIUS_M, EARTH_FLATTENING, Array

SCALE_HEIGHT_M = 7350.0  # ITU-R P.453, reference atmosphere for terrestrial paths
MOST_N = 450.0  # saturated air of 35 deg C
LOWEST_TRACED_DEG = -1.0  # apparent; lower rays of an antenna on a mountain or a mast are extrapolated
NEAREST_M = 100e3  # a target nearer than this is in the air itself, and taken at this distance
_TOP_M = 200e3  # N there: 1e-12 of that at the ground
_DEGREE = 14  # of the polynomial in 1 / (sin e + _POLE)
_POLE = 0.055
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(96)
_FADE_DEG = 0.5  # how soon the bending settles below the lowest traced ray
_SMALL_STEP_DEG = 1e-4  # of Newton's: what is left after it is below 1e-8 deg
_MOST_STEPS = 12


@dataclass(frozen=True, slots=True)
class Refraction:
    """Refraction in one air, at one antenna: made by `traced`.

    All angles in degrees, of shape () or (N,); range_m from the antenna, metres, broadcast, inf allowed.
    scale multiplies the difference apparent - geometric at a given apparent elevation: air with more or less
    refractivity than told, to 2 % of the difference (docs/antenna-model.md).
    """

    surface_n: float
    radius_m: float
    coefficients: tuple[float, ...]  # of tau / cos e, highest power first

    def geometric_el_deg(self, apparent_el_deg: npt.ArrayLike, range_m: npt.ArrayLike, scale: float = 1.0) -> Array:
        """Turn the elevation at which the beam meets a satellite into the one in a vacuum."""
        apparent: Array = np.asarray(apparent_el_deg, dtype=np.float64)
        raised, _ = self.raised_deg(apparent, range_m)
        return np.asarray(apparent - scale * raised)

    def apparent_el_deg(self, geometric_el_deg: npt.ArrayLike, range_m: npt.ArrayLike, scale: float = 1.0) -> Array:
        """Turn the elevation in a vacuum into the one at which the beam meets the satellite."""
        return self.apparent_with_slope(geometric_el_deg, range_m, scale)[0]

    def apparent_with_slope(
        self, geometric_el_deg: npt.ArrayLike, range_m: npt.ArrayLike, scale: float = 1.0
    ) -> tuple[Array, Array, Array]:
        """Give the apparent elevation, its derivative by the geometric one, and that by the scale (deg)."""
        geometric = np.asarray(geometric_el_deg, dtype=np.float64)
        apparent = geometric
        for _ in range(_MOST_STEPS):
            raised, slope = self.raised_deg(apparent, range_m)
            step = (geometric - apparent + scale * raised) / (1.0 - scale * slope)
            apparent = apparent + step
            if not np.any(np.abs(step) > _SMALL_STEP_DEG):
                break
        by_geometric = 1.0 / (1.0 - scale * slope)
        return apparent, by_geometric, raised * by_geometric

    def raised_deg(self, apparent_el_deg: Array, range_m: npt.ArrayLike) -> tuple[Array, Array]:
        """Give apparent less geometric elevation at a given apparent one, and its derivative by that."""
        beyond = apparent_el_deg - 90.0
        side = -np.sign(beyond)
        el_deg = 90.0 - np.abs(beyond)
        traced_deg = np.maximum(el_deg, LOWEST_TRACED_DEG)
        bending, by_el = self._bending_deg(traced_deg)
        e, out = traced_deg * DEG, (traced_deg - bending) * DEG
        distance = np.maximum(range_m, NEAREST_M) / self.radius_m
        n0 = 1.0 + 1e-6 * self.surface_n
        aside = (n0 * np.cos(e) - np.cos(out)) / distance
        aside_slope = (np.sin(out) * (1.0 - by_el) - n0 * np.sin(e)) / distance / np.sqrt(1.0 - aside * aside)
        raised, slope = bending - np.arcsin(aside) / DEG, by_el - aside_slope
        if np.any(el_deg < LOWEST_TRACED_DEG):
            faded = np.exp((el_deg - traced_deg) / _FADE_DEG)
            raised, slope = raised - slope * _FADE_DEG * (1.0 - faded), slope * faded
        return side * raised, slope

    def _bending_deg(self, el_deg: Array) -> tuple[Array, Array]:
        """tau and its derivative by the apparent elevation, which is LOWEST_TRACED_DEG to 90 deg."""
        sine, cosine = np.sin(el_deg * DEG), np.cos(el_deg * DEG)
        x = _abscissa(sine)
        value, by_x = _with_slope(self.coefficients) @ _powers(x)
        return value * cosine, (by_x * _abscissa_slope(sine) * cosine * cosine - value * sine) * DEG


@lru_cache(maxsize=64)
def _with_slope(coefficients: tuple[float, ...]) -> Array:
    """Coefficients of a polynomial and of its derivative, lowest power first, (2, N)."""
    rising = np.array(coefficients[::-1])
    return np.stack((rising, np.append(rising[1:] * np.arange(1, rising.size), 0.0)))


def _powers(x: Array) -> Array:
    """Powers 0 to _DEGREE of x, (_DEGREE + 1, N), by doubling: small arrays cost by the number of operations."""
    powers = np.ones((_DEGREE + 1, *x.shape))
    known, top = 1, x
    while known <= _DEGREE:
        powers[known : 2 * known] = powers[: min(known, _DEGREE + 1 - known)] * top
        known, top = 2 * known, top * top
    return powers


def traced(surface_n: float, station: Station, scale_height_m: float = SCALE_HEIGHT_M) -> Refraction:
    """Trace the rays of the air with surface_n (N-units) at the station and tabulate their bending; 2 ms.

    ValueError: surface_n is not from 0 to MOST_N, beyond which air may guide rays around the Earth.
    """
    if not 0.0 <= surface_n <= MOST_N:
        raise ValueError(f"a surface refractivity of {surface_n:g}: expected 0 to {MOST_N:g} N-units")
    radius_m = curvature_radius_m(station)
    knots = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
    sines = _sine_at(knots)
    el_deg = np.arcsin(np.clip(sines, -1.0, 1.0)) / DEG
    values = integrated_bending_deg(el_deg, surface_n, radius_m, scale_height_m) / np.cos(el_deg * DEG)
    series = np.polynomial.chebyshev.chebfit(knots, values, _DEGREE)
    rising = np.polynomial.chebyshev.cheb2poly(series)
    rising = np.pad(rising, (0, _DEGREE + 1 - rising.size))  # without air all but one are left out
    return Refraction(surface_n, radius_m, tuple(rising[::-1].tolist()))


def curvature_radius_m(station: Station) -> float:
    """Radius at the station of the sphere whose centre is the Earth's mean centre of curvature there."""
    e2 = EARTH_FLATTENING * (2.0 - EARTH_FLATTENING)
    w2 = 1.0 - e2 * sin(station.latitude_deg * DEG) ** 2
    return EARTH_EQUATORIAL_RADIUS_M * float(np.sqrt(1.0 - e2)) / w2 + station.height_m


def integrated_bending_deg(el_deg: Array, surface_n: float, radius_m: float, scale_height_m: float) -> Array:
    """Integrate tau over q for apparent elevations (N,), degrees."""
    n0, e = 1.0 + 1e-6 * surface_n, el_deg * DEG
    p, first = n0 * radius_m * np.cos(e), n0 * radius_m * np.sin(e)
    half = (np.sqrt((radius_m + _TOP_M) ** 2 - p * p) - first) / 2.0
    nr = np.hypot(p[:, None], first[:, None] + half[:, None] * (1.0 + _NODES))
    r = nr / n0
    for _ in range(30):  # Newton for n(r) r = nr
        m = 1e-6 * surface_n * np.exp((radius_m - r) / scale_height_m)
        step = (nr - (1.0 + m) * r) / (1.0 + m - r * m / scale_height_m)
        r = r + step
        if np.max(np.abs(step)) < 1e-6:
            break
    m = 1e-6 * surface_n * np.exp((radius_m - r) / scale_height_m)
    n, gradient = 1.0 + m, -m / scale_height_m
    integrand = -p[:, None] * gradient / (n * n * r * (n + r * gradient))
    bending: Array = (integrand @ _WEIGHTS) * half / DEG
    return bending


# The polynomial's abscissa in [-1, 1]: 1 / (sin e + _POLE), linear from the zenith (-1) to the lowest ray (1).
_ZENITH = 1.0 / (1.0 + _POLE)
_SPAN = 1.0 / (sin(LOWEST_TRACED_DEG * DEG) + _POLE) - _ZENITH


def _abscissa(sine: Array) -> Array:
    return 2.0 * (1.0 / (sine + _POLE) - _ZENITH) / _SPAN - 1.0


def _abscissa_slope(sine: Array) -> Array:
    return -2.0 / _SPAN / (sine + _POLE) ** 2


def _sine_at(abscissa: Array) -> Array:
    return 1.0 / ((abscissa + 1.0) / 2.0 * _SPAN + _ZENITH) - _POLE
