"""Least squares with a prior and robust weights: the batch behind the `full` estimator.  Pure.

docs/estimation.md, The sweeps, has the equations.

Each sweep takes the residuals of all readings against the path that the present states give, compressed into normal
points; partials only set the direction of the step.  So the result does not depend on how the readings arrived.
"""

from dataclasses import dataclass, fields, replace
from math import log

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import STATION, Prior
from acu_daemon.assist.estimators.full.noise_correlation import WHITE, NoiseCorrelation, noise_correlation
from acu_daemon.assist.estimators.full.normal_points import (
    Points,
    Residuals,
    Sights,
    normal_points,
    residuals,
    seconds_of,
)
from acu_daemon.assist.estimators.full.path_partials import (
    node_times,
    orbit_partials_itrs,
    path_itrs,
    site_of,
    sky_partials,
)
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array

_MAX_SWEEPS = 15
_CONVERGED_RAD = 1e-7  # on the sky
_STALE_RAD = 3e-4  # partials from a path this far away only slow the sweeps down
_FIRST_S = 60.0
_OTHER_FACTOR = 0.2  # a factor of the noise that differs by more, in its logarithm, is worth another sweep
_DOUBTFUL_SHARE = 0.05  # of the weight lost to outliers: then the readings are solved from the prior too


@dataclass(frozen=True, slots=True)
class Batch:
    """What is solved for and what is known before the first reading.

    noise: how the noise of a second was seen to depend on that of the one before; None: it is taken as white.
    """

    source: Propagator
    site: Site
    settings: EstimatorSettings
    prior: Prior
    noise: NoiseCorrelation | None = None


class OrbitPartials:
    """Partials of the orbit's states, and how far the path has moved on the sky since.  Mutable; one owner."""

    def __init__(self, batch: Batch, x: Array, node_tai_s: Array) -> None:
        _, self.curve = orbit_partials_itrs(batch.source, x, batch.site, node_tai_s)
        self.moved_rad = 0.0


@dataclass(frozen=True, slots=True)
class Solution:
    """States, their covariance (17, 17), and what the readings left."""

    x: Array
    covariance: Array
    left: Residuals
    partials: OrbitPartials
    noise: NoiseCorrelation = WHITE


def solve(batch: Batch, seen: Sights, before: Solution | None) -> Solution:
    """Find the most likely states.  before: where to start from, such as the solution with fewer readings.

    Without it the first minute comes first: at low elevation even elements hundreds of kilometres off are near linear.
    Where many readings look like outliers, the start may be to blame: of two starts the one with less noise counts.

    Raises:  OrbitError: the source has no answer for one of the times, or for the states on the way.
    """
    start = before or _sweep(batch, _first_of(seen), batch.prior.mean, None)
    warm = _sweep(batch, seen, start.x, start.partials, None if before is None else before.noise)
    if float(np.mean(warm.left.weights)) > 1.0 - _DOUBTFUL_SHARE:
        return warm
    cold = _sweep(batch, seen, batch.prior.mean, None)
    return min(warm, cold, key=lambda one: float(np.sum(one.left.noise_scale)))


def _first_of(seen: Sights) -> Sights:
    end = int(np.searchsorted(seen.tai_s, seen.tai_s[0] + _FIRST_S))
    return Sights(*(getattr(seen, item.name)[:end] for item in fields(seen)))


def _sweep(
    batch: Batch, seen: Sights, x: Array, partials: OrbitPartials | None, noise: NoiseCorrelation | None = None
) -> Solution:
    """Solve from x on.  noise: what it was in a solution near by."""
    factor = (noise or batch.noise or WHITE).factor if batch.noise is not None else 1.0
    solution, points, fitted_count = _sweeps(batch, seen, x, partials, factor)
    if batch.noise is None:
        return solution
    found = noise_correlation(points, fitted_count, batch.noise)
    if abs(log(found.factor / factor)) > _OTHER_FACTOR:
        solution, _, _ = _sweeps(batch, seen, solution.x, solution.partials, found.factor)
    return replace(solution, noise=found)


def _sweeps(
    batch: Batch, seen: Sights, x: Array, partials: OrbitPartials | None, factor: float
) -> tuple[Solution, Points, float]:
    """Sweep until no point moves; also the points, and how many states the readings tell.  factor: of variances."""
    nodes = node_times(float(seen.tai_s[0]), float(seen.tai_s[-1]))
    if partials is None or not np.array_equal(partials.curve.node_tai_s, nodes):
        partials = OrbitPartials(batch, x, nodes)
    starts = seconds_of(seen.tai_s)
    has_shift = bool(batch.prior.covariance[STATION, STATION].any())
    for _ in range(_MAX_SWEEPS):
        path, here = path_itrs(batch.source, x, batch.site, nodes), site_of(batch.site, x)
        left = residuals(path, here, x, batch.settings, seen)
        points = normal_points(seen.tai_s, left, starts)
        moved = path.at(points.tai_s), partials.curve.at(points.tai_s)
        h = sky_partials(*moved, here, has_shift, seen.sense[starts])
        new, covariance, fitted_count = _step(batch.prior, x, h, points, factor)
        step_rad = float(np.max(np.abs(np.tensordot(new - x, h, 1)), initial=0.0))
        x = new
        if step_rad < _CONVERGED_RAD:
            break
        partials.moved_rad += step_rad
        if partials.moved_rad > _STALE_RAD:
            partials = OrbitPartials(batch, x, nodes)
    return Solution(x, covariance, left, partials), points, fitted_count


def _step(prior: Prior, x: Array, h: Array, points: Points, factor: float) -> tuple[Array, Array, float]:
    """Solve the linear batch about x for z, states = mean + root z: the prior is then a unit matrix."""
    root = prior.root
    per_sigma = points.per_sigma if factor == 1.0 else points.per_sigma / np.sqrt(factor)
    rows = (h * per_sigma).reshape(h.shape[0], -1)
    target = (points.off * per_sigma).reshape(-1) + (x - prior.mean) @ rows
    whitened = root.T @ rows
    information = whitened @ whitened.T + np.eye(whitened.shape[0])
    inverse = np.linalg.inv(information)
    new: Array = prior.mean + root @ (inverse @ (whitened @ target))
    covariance: Array = root @ inverse @ root.T
    return new, covariance, inverse.shape[0] - float(np.trace(inverse))
