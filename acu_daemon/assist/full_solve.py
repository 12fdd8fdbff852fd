"""Least squares with a prior and robust weights: the batch behind the `full` estimator.  Pure.

Readings are compressed into normal points of one second: the mean residual against the present path, at the mean time.
Each sweep takes the residuals of all readings against the path that the present states give (no partials needed for
that, they only set the direction of the step), so the result does not depend on how the readings arrived.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.full_path import (
    Curve,
    cot_el,
    enu_m,
    node_times,
    orbit_partials_itrs,
    path_itrs,
    site_of,
    sky_partials,
)
from acu_daemon.assist.full_states import BIAS, STATION, Prior
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array

Indices = npt.NDArray[np.int64]

NORMAL_POINT_S = 1.0
_MAX_SWEEPS = 15
_CONVERGED_RAD = 1e-7  # on the sky
_STALE_RAD = 3e-4  # partials from a path this far away only slow the sweeps down
_HUBER, _LAST_SIGMAS = 3.0, 10.0  # of both components together; from the first on weights fall, at the last to zero
_FALL_FROM = 6.0
_NOISE_WORTH_COUNT = 30.0  # the configured noise counts like so many readings against the noise seen
_SIGMA_PER_MEDIAN = 1.4826  # of the absolute value, Gaussian


@dataclass(frozen=True, slots=True)
class Sights:
    """Readings as unit vectors' tangents: across the elevation and in elevation, east-north-up, (N, 3)."""

    tai_s: Array
    across: Array
    upward: Array


@dataclass(frozen=True, slots=True)
class Solution:
    """States, their covariance (13, 13), and what the readings left: residuals (N, 2) on the sky and weights (N,)."""

    x: Array
    covariance: Array
    residuals_rad: Array
    weights: Array
    line: "_Partials"


class _Partials:
    """Partials of the orbit's states, and how far the path has moved on the sky since.  Mutable; one owner."""

    def __init__(self, source: Propagator, x: Array, site: Site, node_tai_s: Array) -> None:
        self.curve = orbit_partials_itrs(source, x, site, node_tai_s)
        self.moved_rad = 0.0


def sights(readings: Readings) -> Sights:
    """Turn readings into tangents of the sky at the direction they show."""
    az, el = np.radians(readings.az_deg), np.radians(readings.el_deg)
    sin_az, cos_az, sin_el, cos_el = np.sin(az), np.cos(az), np.sin(el), np.cos(el)
    across = np.stack((cos_az, -sin_az, np.zeros_like(az)), axis=1)
    return Sights(readings.tai_s, across, np.stack((-sin_az * sin_el, -cos_az * sin_el, cos_el), axis=1))


def solve(
    source: Propagator, site: Site, settings: EstimatorSettings, prior: Prior, seen: Sights, before: Solution | None
) -> Solution:
    """Find the most likely states.  before: where to start from, such as the solution with fewer readings.

    Raises:  OrbitError: the source has no answer for one of the times, or for the states on the way.
    """
    nodes = node_times(float(seen.tai_s[0]), float(seen.tai_s[-1]))
    x = prior.mean if before is None else before.x
    line = _Partials(source, x, site, nodes) if before is None else before.line
    if not np.array_equal(line.curve.node_tai_s, nodes):
        line = _Partials(source, x, site, nodes)
    starts = np.flatnonzero(np.diff(np.floor(seen.tai_s / NORMAL_POINT_S), prepend=-np.inf))
    root = _root(prior.covariance)
    has_shift = bool(prior.covariance[STATION, STATION].any())
    for _ in range(_MAX_SWEEPS):
        path, here = path_itrs(source, x, site, nodes), site_of(site, x)
        off, sigma = _residuals(path, here, x, settings, seen)
        weights = _weights(off / sigma)
        points = _normal_points(seen.tai_s, off, sigma, weights, starts)
        h = sky_partials(path.at(points.tai_s), line.curve.at(points.tai_s), here, has_shift)
        new, covariance = _step(prior, root, x, h, points)
        step_rad = float(np.max(np.abs(np.tensordot(new - x, h, 1)), initial=0.0))
        x = new
        if step_rad < _CONVERGED_RAD:
            break
        line.moved_rad += step_rad
        if line.moved_rad > _STALE_RAD:
            line = _Partials(source, x, site, nodes)
    return Solution(x, covariance, off, weights, line)


def _root(covariance: Array) -> Array:
    """A root (13, M) of a covariance that may hold zeros: covariance = root root^T."""
    sigma = np.sqrt(np.diag(covariance))
    held = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(held, held))
    root: Array = held[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    root[sigma == 0.0] = 0.0
    return root


def _residuals(path: Curve, here: Site, x: Array, settings: EstimatorSettings, seen: Sights) -> tuple[Array, Array]:
    """Readings minus what the states give, across and in elevation, and the configured noise; each (N, 2), rad."""
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
    return off, sigma * _noise_scale(off / sigma)


def _noise_scale(sigmas_off: Array) -> Array:
    """By how much the noise seen differs from the configured one, (2,): what few readings say counts little."""
    count = sigmas_off.shape[0]
    seen = (_SIGMA_PER_MEDIAN * np.median(np.abs(sigmas_off), axis=0)) ** 2
    scale: Array = np.sqrt((_NOISE_WORTH_COUNT + count * seen) / (_NOISE_WORTH_COUNT + count))
    return scale


def _weights(sigmas_off: Array) -> Array:
    """Robust weights (N,): Huber's, falling to zero for what cannot be noise (Hampel)."""
    chi = np.maximum(np.sqrt(np.sum(sigmas_off**2, axis=1)), 1e-9)
    weights: Array = np.minimum(1.0, _HUBER / chi) * np.clip(
        (_LAST_SIGMAS - chi) / (_LAST_SIGMAS - _FALL_FROM), 0.0, 1.0
    )
    return weights


@dataclass(frozen=True, slots=True)
class _Points:
    """Normal points: time (K,), mean residual and its sigma (K, 2)."""

    tai_s: Array
    off: Array
    per_sigma: Array


def _normal_points(tai_s: Array, off: Array, sigma: Array, weights: Array, starts: Indices) -> _Points:
    """Average each second's readings; a second without weight gets the mean of its times and no weight."""
    heavy = weights + 1e-12
    total = np.add.reduceat(heavy, starts)
    since = tai_s - np.repeat(tai_s[starts], np.diff(starts, append=tai_s.size))
    at = tai_s[starts] + np.add.reduceat(heavy * since, starts) / total
    mean = np.add.reduceat(heavy[:, None] * off, starts, axis=0) / total[:, None]
    return _Points(at, mean, np.sqrt(total)[:, None] / sigma[starts])


def _step(prior: Prior, root: Array, x: Array, h: Array, points: _Points) -> tuple[Array, Array]:
    """Solve the linear problem about x for z, states = mean + root z: the prior is then a unit matrix."""
    rows = (h * points.per_sigma).reshape(h.shape[0], -1)
    target = (points.off * points.per_sigma).reshape(-1) + (x - prior.mean) @ rows
    whitened = root.T @ rows
    information = whitened @ whitened.T + np.eye(whitened.shape[0])
    inverse = np.linalg.inv(information)
    new: Array = prior.mean + root @ (inverse @ (whitened @ target))
    covariance: Array = root @ inverse @ root.T
    return new, covariance
