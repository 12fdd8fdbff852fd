"""Readings against a path: residuals, the noise they show, robust weights, normal points of one second.  Pure.

Equations: docs/estimation.md, Residuals; docs/estimation.md, Noise and robust weights.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.estimators.full.estimated_states import BIAS, EL_COT, MOUNT
from acu_daemon.assist.estimators.full.path_partials import Curve, cot_el, enu_m, has_air, low_shape
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.assist.spaced_times import spaced
from acu_daemon.model import Readings, Site
from acu_daemon.pointing.mount import axes_on_the_sky
from acu_daemon.units import DEG, Array

Indices = npt.NDArray[np.int64]

NORMAL_POINT_S = 1.0
_SHAPE_STEP_S = 2.0
_HUBER, _LAST_SIGMAS = 3.0, 10.0  # of both components together; from the first on weights fall, at the last to zero
_FALL_FROM = 6.0
_NOISE_WORTH_COUNT = 30.0  # the configured noise counts like so many readings against the noise seen
_SIGMA_PER_MEDIAN = 1.4826  # of the absolute value, Gaussian
_MOST_NOISE = 10.0  # times the configured one: beyond it the path is not found yet, and must not yield to the prior


@dataclass(frozen=True, slots=True)
class Sights:
    """Readings, oldest first: their times, and sine and cosine of both angles; every array (N,).

    sense: -1 where the antenna was plunged, else 1: by which sign the states of PLUNGED_STATES show on the sky.
    """

    tai_s: Array
    sin_az: Array
    cos_az: Array
    sin_el: Array
    cos_el: Array
    sense: Array


def sights(readings: Readings) -> Sights:
    """Take sines and cosines of readings, once for all sweeps."""
    az, el = np.radians(readings.az_deg), np.radians(readings.el_deg)
    sense = np.ones(az.size) if readings.was_plunged is None else np.where(readings.was_plunged, -1.0, 1.0)
    return Sights(readings.tai_s, np.sin(az), np.cos(az), np.sin(el), np.cos(el), sense)


@dataclass(frozen=True, slots=True)
class Residuals:
    """Readings minus what the states give, across and in elevation, (2, N), rad.

    noise_rad: 1 sigma, (2, N), the configured one x noise_scale (2,), by how much the readings differ from it.
    weights: robust ones, (N,), by the noise seen.
    """

    off_rad: Array
    noise_rad: Array
    noise_scale: Array
    weights: Array


def residuals(path: Curve, here: Site, x: Array, settings: EstimatorSettings, seen: Sights) -> Residuals:
    """Compare readings with a path, the site and the biases of the states x."""
    (east, north, up), cos_el, _ = _directions(path, here, seen.tai_s)
    cot = cot_el(up, cos_el)
    low = _refraction_shape(path, here, seen.tai_s) if x[EL_COT] and has_air(here) else cot
    az, az_sec, el, el_cot = x[BIAS]
    off, sigma = np.empty((2, 2, seen.tai_s.size))
    off[0] = seen.sin_az * north - seen.cos_az * east - az * cos_el - az_sec * seen.sense
    off[1] = (
        seen.sin_el * (seen.sin_az * east + seen.cos_az * north) - seen.cos_el * up - el * seen.sense - el_cot * low
    )
    if x[MOUNT].any():
        flat = np.maximum(cos_el, 1e-9)
        axes = axes_on_the_sky(east / flat, north / flat, up, cos_el)
        axes[0] *= seen.sense
        off -= np.tensordot(x[MOUNT], axes, 1)
    sigma[0] = settings.sigma_azimuth_deg * DEG
    sigma[1] = (settings.sigma_elevation_deg + settings.sigma_elevation_cot_deg * cot) * DEG
    sigmas_off = off / sigma
    scale = _noise_scale(sigmas_off)
    noise = sigma * np.minimum(scale, _MOST_NOISE)[:, None]
    return Residuals(off, noise, scale, robust_weights(sigmas_off / scale[:, None]))


def _directions(path: Curve, here: Site, tai_s: Array) -> tuple[Array, Array, Array]:
    """East, north, up of the directions at the times (N,), (3, N), cosine of the elevation, distance (m)."""
    enu = enu_m(path.at(tai_s), here)
    range_m = np.sqrt((enu * enu).sum(axis=0))
    enu /= range_m
    return enu, np.sqrt(enu[0] * enu[0] + enu[1] * enu[1]), range_m


def _refraction_shape(path: Curve, here: Site, tai_s: Array) -> Array:
    """The shape of the refraction at the times (N,), interpolated, to 0.01 of it at 5 deg of elevation."""
    few = spaced(tai_s, _SHAPE_STEP_S)
    (_, _, up), cos_el, range_m = _directions(path, here, few)
    low: Array = np.interp(tai_s, few, low_shape(here, up, cos_el, range_m)[0])
    return low


def _noise_scale(sigmas_off: Array) -> Array:
    """By how much the noise seen differs from the configured one, (2,): what few readings say counts little."""
    count = sigmas_off.shape[1]
    middle = [(count - 1) // 2, count // 2]
    median = np.partition(np.abs(sigmas_off), middle)[:, middle].mean(axis=1)  # np.median takes 4 times as long
    seen = (_SIGMA_PER_MEDIAN * median) ** 2
    scale: Array = np.sqrt((_NOISE_WORTH_COUNT + count * seen) / (_NOISE_WORTH_COUNT + count))
    return scale


def robust_weights(sigmas_off: Array) -> Array:
    """Robust weights (N,): Huber's, falling to zero for what cannot be noise (Hampel)."""
    chi = np.maximum(np.sqrt((sigmas_off * sigmas_off).sum(axis=0)), 1e-9)
    falling = np.maximum((_LAST_SIGMAS - chi) / (_LAST_SIGMAS - _FALL_FROM), 0.0)
    weights: Array = np.minimum(1.0, _HUBER / chi) * np.minimum(falling, 1.0)
    return weights


@dataclass(frozen=True, slots=True)
class Points:
    """Normal points: time (K,), mean residual and its sigma (2, K)."""

    tai_s: Array
    off: Array
    per_sigma: Array  # 1 / rad


def seconds_of(tai_s: Array) -> Indices:
    """Where each whole second begins among the times (N,), oldest first."""
    return np.flatnonzero(np.diff(np.floor(tai_s / NORMAL_POINT_S), prepend=-np.inf))


def normal_points(tai_s: Array, seen: Residuals, starts: Indices) -> Points:
    """Average each second's readings; a second without weight gets the mean of its times and no weight."""
    heavy = seen.weights + 1e-12
    total = np.add.reduceat(heavy, starts)
    since = tai_s - np.repeat(tai_s[starts], np.diff(starts, append=tai_s.size))
    at = tai_s[starts] + np.add.reduceat(heavy * since, starts) / total
    mean = np.add.reduceat(heavy * seen.off_rad, starts, axis=1) / total
    return Points(at, mean, np.sqrt(total) / seen.noise_rad[:, starts])
