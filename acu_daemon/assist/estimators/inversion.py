"""From an azimuth and an elevation to the node and the mean anomaly, the other elements known.  Pure.

Kuga and Carrara 1990, eqs 1-16 (docs/estimation.md, The inversion).
Two corrections to the print: the denominator of eq 8 is x_e + rho c_x, and
the argument of eq 11 beyond [-1, 1] is refused with a reason (docs/decisions).
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from acu_daemon.model import Station
from acu_daemon.orbit.frames import enu_from_itrs
from acu_daemon.units import Array, wrap_pi_array

NO_INTERSECTION = "the line of sight does not meet the orbit's sphere"
BEYOND_LATITUDE = "the direction lies beyond the orbit's highest latitude"
NOT_CONVERGED = "the radius did not converge"

_RADIUS_TOLERANCE_M = 1e-3
_MAX_ITERATIONS = 20


@dataclass(frozen=True, slots=True)
class KnownElements:
    """What the inversion takes as known, at the time of each reading: arrays (N,), or (1,) for all."""

    a_m: Array
    e: Array
    i_rad: Array
    argp_rad: Array


@dataclass(frozen=True, slots=True)
class Inversion:
    """Node, mean anomaly and radius, (N,); NaN where `reasons` gives a reason instead of None."""

    raan_rad: Array
    mean_anomaly_rad: Array
    radius_m: Array
    reasons: tuple[str | None, ...]


def direction_cosines(az_deg: Array, el_deg: Array, station: Station) -> Array:
    """Turn azimuth (from north) and elevation into Earth-fixed unit vectors (N, 3), eqs 2 and 3."""
    az, el = np.radians(az_deg), np.radians(el_deg)
    enu = np.stack((np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)), axis=1)
    cosines: Array = enu @ enu_from_itrs(station)
    return cosines


def invert(
    cosines: Array,
    station_m: Array,
    sidereal_rad: Array,
    known: KnownElements,
    radius_m: Array,
    prior_raan_rad: Array,
) -> Inversion:
    """Find node and mean anomaly from directions.

    cosines (N, 3) from `direction_cosines`; station_m (3,) Earth-fixed; sidereal_rad (N,) Greenwich sidereal angle;
    radius_m (N,) first guess of the geocentric distance; prior_raan_rad (N,) chooses the ascending or the descending
    branch: the nearer one (Kuga and Carrara 1988, section 3).  Iterates the radius (eq 16) until it stands still.
    """
    radius = np.array(np.broadcast_to(radius_m, cosines.shape[:1]), dtype=float)
    with np.errstate(invalid="ignore", divide="ignore"):
        for _ in range(_MAX_ITERATIONS):
            raan, mean_anomaly, new_radius, sin_lambda = _once(
                cosines, station_m, sidereal_rad, known, radius, prior_raan_rad
            )
            moved = np.abs(new_radius - radius)
            radius = new_radius
            if not np.any(moved > _RADIUS_TOLERANCE_M):
                break
    is_moving, is_beyond = moved > _RADIUS_TOLERANCE_M, np.abs(sin_lambda) > 1.0
    is_bad = ~np.isfinite(mean_anomaly) | is_moving
    reasons = tuple(
        None if not bad else BEYOND_LATITUDE if beyond else NOT_CONVERGED if moving else NO_INTERSECTION
        for bad, beyond, moving in zip(is_bad.tolist(), is_beyond.tolist(), is_moving.tolist(), strict=True)
    )
    raan, mean_anomaly, radius = (np.where(is_bad, np.nan, x) for x in (raan, mean_anomaly, radius))
    return Inversion(raan, mean_anomaly, radius, reasons)


def _once(
    cosines: Array, station_m: Array, sidereal_rad: Array, known: KnownElements, radius: Array, prior_raan_rad: Array
) -> tuple[Array, Array, Array, Array]:
    """One pass through eqs 4-16: raan, mean anomaly, the radius they give, and sin(lambda_o)."""
    b = cosines @ station_m  # eq 5
    slant = np.sqrt(radius**2 - station_m @ station_m + b**2) - b  # eq 4
    slant = np.where(slant > 0.0, slant, np.nan)  # else the sphere lies behind
    x, y, z = (station_m + slant[:, None] * cosines).T  # eq 6
    tan_lat = z / np.hypot(x, y)  # eq 7
    sin_i = np.sin(known.i_rad)
    sin_lambda = tan_lat * np.cos(known.i_rad) / sin_i  # eq 11
    lambda_up = np.arcsin(sin_lambda)
    east = sidereal_rad + np.arctan2(y, x)  # eq 8, and theta_g of eqs 9 and 10
    raan_up, raan_down = east - lambda_up, east - (pi - lambda_up)  # eqs 9, 10
    is_up = np.abs(wrap_pi_array(raan_up - prior_raan_rad)) <= np.abs(wrap_pi_array(raan_down - prior_raan_rad))
    raan = np.where(is_up, raan_up, raan_down)
    cos_lambda = np.where(is_up, 1.0, -1.0) * np.cos(lambda_up)
    f = np.arctan2(tan_lat, cos_lambda * sin_i) - known.argp_rad  # eq 12
    sin_e = radius * np.sin(f) / (known.a_m * np.sqrt(1.0 - known.e**2))  # eq 13
    cos_e = (radius * np.cos(f) + known.a_m * known.e) / known.a_m  # eq 14
    eccentric = np.arctan2(sin_e, cos_e)
    mean_anomaly = eccentric - known.e * np.sin(eccentric)  # eq 15
    return wrap_pi_array(raan), wrap_pi_array(mean_anomaly), known.a_m * (1.0 - known.e * np.cos(eccentric)), sin_lambda
