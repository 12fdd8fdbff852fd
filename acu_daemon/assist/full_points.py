"""Readings against a path: residuals, the noise they show, robust weights, and normal points of one second.  Pure."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.full_path import Curve, cot_el, enu_m
from acu_daemon.assist.full_states import BIAS
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings, Site
from acu_daemon.units import DEG, Array

Indices = npt.NDArray[np.int64]

NORMAL_POINT_S = 1.0
_HUBER, _LAST_SIGMAS = 3.0, 10.0  # of both components together; from the first on weights fall, at the last to zero
_FALL_FROM = 6.0
_NOISE_WORTH_COUNT = 30.0  # the configured noise counts like so many readings against the noise seen
_SIGMA_PER_MEDIAN = 1.4826  # of the absolute value, Gaussian
_MOST_NOISE = 10.0  # times the configured one: beyond it the path is not found yet, and must not yield to the prior


@dataclass(frozen=True, slots=True)
class Sights:
    """Readings as unit vectors' tangents: across the elevation and in elevation, east-north-up, (N, 3)."""

    tai_s: Array
    across: Array
    upward: Array


def sights(readings: Readings) -> Sights:
    """Turn readings into tangents of the sky at the direction they show."""
    az, el = np.radians(readings.az_deg), np.radians(readings.el_deg)
    sin_az, cos_az, sin_el, cos_el = np.sin(az), np.cos(az), np.sin(el), np.cos(el)
    across = np.stack((cos_az, -sin_az, np.zeros_like(az)), axis=1)
    return Sights(readings.tai_s, across, np.stack((-sin_az * sin_el, -cos_az * sin_el, cos_el), axis=1))


@dataclass(frozen=True, slots=True)
class Residuals:
    """Readings minus what the states give, across and in elevation, (N, 2), rad.

    noise_rad: 1 sigma, (N, 2), the configured one x noise_scale (2,), by how much the readings differ from it.
    weights: robust ones, (N,), by the noise seen.
    """

    off_rad: Array
    noise_rad: Array
    noise_scale: Array
    weights: Array


def residuals(path: Curve, here: Site, x: Array, settings: EstimatorSettings, seen: Sights) -> Residuals:
    """Compare readings with a path, the site and the biases of the states x."""
    enu = enu_m(path.at(seen.tai_s), here)
    enu /= np.sqrt(np.einsum("ij,ij->i", enu, enu))[:, None]
    sin_el, cos_el = enu[:, 2], np.hypot(enu[:, 0], enu[:, 1])
    cot = cot_el(sin_el, cos_el)
    az, az_sec, el, el_cot = x[BIAS]
    off = np.empty((seen.tai_s.size, 2))
    off[:, 0] = -np.einsum("ij,ij->i", seen.across, enu) - az * cos_el - az_sec
    off[:, 1] = -np.einsum("ij,ij->i", seen.upward, enu) - el - el_cot * cot
    sigma = np.empty_like(off)
    sigma[:, 0] = settings.sigma_azimuth_deg * DEG
    sigma[:, 1] = (settings.sigma_elevation_deg + settings.sigma_elevation_cot_deg * cot) * DEG
    scale = _noise_scale(off / sigma)
    return Residuals(off, sigma * np.minimum(scale, _MOST_NOISE), scale, robust_weights(off / (sigma * scale)))


def _noise_scale(sigmas_off: Array) -> Array:
    """By how much the noise seen differs from the configured one, (2,): what few readings say counts little."""
    count = sigmas_off.shape[0]
    middle = [(count - 1) // 2, count // 2]
    median = np.partition(np.abs(sigmas_off), middle, axis=0)[middle].mean(axis=0)  # np.median takes 4 times as long
    seen = (_SIGMA_PER_MEDIAN * median) ** 2
    scale: Array = np.sqrt((_NOISE_WORTH_COUNT + count * seen) / (_NOISE_WORTH_COUNT + count))
    return scale


def robust_weights(sigmas_off: Array) -> Array:
    """Robust weights (N,): Huber's, falling to zero for what cannot be noise (Hampel)."""
    chi = np.maximum(np.sqrt(np.sum(sigmas_off**2, axis=1)), 1e-9)
    weights: Array = np.minimum(1.0, _HUBER / chi) * np.clip(
        (_LAST_SIGMAS - chi) / (_LAST_SIGMAS - _FALL_FROM), 0.0, 1.0
    )
    return weights


@dataclass(frozen=True, slots=True)
class Points:
    """Normal points: time (K,), mean residual and its sigma (K, 2)."""

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
    mean = np.add.reduceat(heavy[:, None] * seen.off_rad, starts, axis=0) / total[:, None]
    return Points(at, mean, np.sqrt(total)[:, None] / seen.noise_rad[starts])
