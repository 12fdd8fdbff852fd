"""Inflates the prior of elements that are worse than their sigmas (docs/estimation.md, Prior inflation).  Pure.

Elements are mostly wrong along the track, by drag, a manoeuvre or a wrong clock, so that is inflated first.  Of
several priors the one under which the readings are most likely counts, their evidence (MacKay, Bayesian interpolation,
Neural Computation 4 (1992) 415, section 2): a wider one must earn its width.
"""

from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import ORBIT
from acu_daemon.assist.estimators.full.least_squares import Batch, Solution, solve
from acu_daemon.assist.estimators.full.normal_points import Sights
from acu_daemon.units import DEG, Array

STRAIN_LIMIT = 8.0  # sigmas squared, of six orbit states and the biases; the evidence then decides
NOISE_LIMIT = 3.0  # times the configured one: the fit may be caught far from the readings
_MEAN_ANOMALY = 1


@dataclass(frozen=True, slots=True)
class Width:
    """How much wider than given: the anomaly's sigma beside the given one, and a factor of all orbit states'."""

    along_deg: float = 0.0
    factor: float = 1.0

    def of(self, batch: Batch) -> Batch:
        """The batch with an orbit that is worth less; itself where it is not, with what it has computed."""
        if self == WIDTHS[0]:
            return batch
        return replace(batch, prior=replace(batch.prior, covariance=self.covariance(batch.prior.covariance)))

    def covariance(self, given: Array) -> Array:
        """The covariance (17, 17) of a prior with this width."""
        covariance = given.copy()
        covariance[ORBIT] *= self.factor
        covariance[:, ORBIT] *= self.factor
        covariance[_MEAN_ANOMALY, _MEAN_ANOMALY] += (self.along_deg * DEG) ** 2
        return covariance


WIDTHS = (Width(), Width(1.0), Width(1.0, 5.0), Width(5.0, 25.0))


def most_likely(batch: Batch, least: int, seen: Sights, given: Solution) -> tuple[Solution, int]:
    """The most likely solution among the widths from number `least` of WIDTHS on, whose own is given, and its number.

    Raises:  OrbitError: the source has no answer for one of the times, or for the states on the way.
    """
    best = given, least, evidence(WIDTHS[least].of(batch), given)
    for k in range(least + 1, len(WIDTHS)):
        wider = WIDTHS[k].of(batch)
        solution = solve(wider, seen, best[0])
        likely = evidence(wider, solution)
        if likely > best[2]:
            best = solution, k, likely
    return best[:2]


def is_strained(batch: Batch, solution: Solution) -> bool:
    """Whether a solution lies beyond the prior, or far from the readings because of it."""
    return _strain(batch, solution) > STRAIN_LIMIT or float(np.max(solution.left.noise_scale)) > NOISE_LIMIT


def evidence(batch: Batch, solution: Solution) -> float:
    """Logarithm of how likely the readings are under the prior, but for a constant (Laplace's approximation)."""
    (of_prior, _), (of_solution, _) = (_held(batch, one) for one in (batch.prior.covariance, solution.covariance))
    occam = float(np.linalg.slogdet(of_solution)[1] - np.linalg.slogdet(of_prior)[1])
    left = solution.left
    misfit = float(np.sum(left.weights * np.sum(np.square(left.off_rad / left.noise_rad), axis=0)))
    noise = 2.0 * left.off_rad.shape[1] * float(np.sum(np.log(left.noise_scale)))
    likely: float = (occam - misfit - noise - _strain(batch, solution)) / 2.0
    return likely


def _strain(batch: Batch, solution: Solution) -> float:
    """How far the states are from the prior's, sigmas squared."""
    correlation, off = _held(batch, batch.prior.covariance, solution.x - batch.prior.mean)
    return float(off @ np.linalg.solve(correlation, off))


def _held(batch: Batch, covariance: Array, off: Array | None = None) -> tuple[Array, Array]:
    """The states that the prior leaves open, in its sigmas."""
    sigma = np.sqrt(np.diag(batch.prior.covariance))
    is_open = sigma > 0.0
    unit = sigma[is_open]
    off = np.zeros(sigma.size) if off is None else off
    return covariance[np.ix_(is_open, is_open)] / np.outer(unit, unit), off[is_open] / unit
