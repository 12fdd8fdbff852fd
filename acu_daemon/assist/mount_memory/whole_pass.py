"""What the readings of one pass say of the pedestal: fitted under both memories, with what guards the memory.  Pure.

Theory: docs/estimation.md, Memory of the mount.
"""

from dataclasses import dataclass, field

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import ORBIT, make_prior
from acu_daemon.assist.estimators.full.least_squares import Batch, Solution, solve
from acu_daemon.assist.estimators.full.noise_correlation import NoiseCorrelation
from acu_daemon.assist.estimators.full.normal_points import Sights
from acu_daemon.assist.estimators.full.pedestal_prior import PEDESTAL, Doubt, doubt_of, with_shift
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, Remembered, priors
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array

LEAST_S = 60.0  # of readings, that a pass counts


@dataclass(frozen=True)
class PassEstimate:
    """What a pass says; const and mount: the fits under either memory.

    at_tai_s, span_s, reading_count: of its readings.  orbit_strain: how far the orbit is from its elements, sigmas
    squared, with encoders re-zeroed or not, whichever is less; noise_scale: by how much the readings are noisier than
    configured; evidence: how much likelier they are with `mount`, in its logarithm; doubt: what they say against its
    zero points.  Strain and doubt are judged by `mount`: with `const` the terms of a mount that is not square look like
    another orbit and other zero points.
    """

    at_tai_s: float
    span_s: float
    reading_count: int
    const: Remembered
    mount: Remembered
    evidence: float
    doubt: Doubt = field(repr=False)
    orbit_strain: float
    noise_scale: float
    noise: NoiseCorrelation

    @property
    def begin_tai_s(self) -> float:
        return self.at_tai_s - self.span_s


def estimate_pass(
    source: Propagator, site: Site, settings: EstimatorSettings, memory: PedestalMemory, seen: Sights
) -> PassEstimate | None:
    """Fit all readings of a pass, geometric, oldest first; None where there are too few.

    The orbit's prior is that of its elements: what an earlier pass of the satellite left came from the same pedestal.
    Raises:  OrbitError: the source has no answer for one of the times.
    """
    first, last = float(seen.tai_s[0]), float(seen.tai_s[-1])
    if last - first < LEAST_S:
        return None
    fresh = make_prior(source, settings, first)
    given = priors(memory, settings, first)[:2]
    batches = [Batch(source, site, settings, one.of(fresh), one.noise) for one in given]
    const, mount = (solve(batch, seen, None) for batch in batches)
    variance = np.diag(fresh.covariance)[ORBIT]
    doubt = doubt_of(given[1], mount.x, mount.covariance, is_rezeroed=False)
    if_rezeroed = with_shift(given[1], mount.x, mount.covariance, doubt)
    return PassEstimate(
        at_tai_s=last,
        span_s=last - first,
        reading_count=int(np.count_nonzero(mount.left.weights)),
        const=_pedestal(const),
        mount=_pedestal(mount),
        evidence=_evidence(batches[1], mount, mount) - _evidence(batches[0], const, mount),
        doubt=doubt,
        orbit_strain=min(_strain(x[ORBIT] - fresh.mean[ORBIT], variance) for x in (mount.x, if_rezeroed)),
        noise_scale=float(np.max(mount.left.noise_scale)),
        noise=mount.noise,
    )


def _strain(off: Array, variance: Array) -> float:
    is_open = variance > 0.0
    return float(np.sum(off[is_open] ** 2 / variance[is_open]))


def _pedestal(solution: Solution) -> Remembered:
    which = list(PEDESTAL)
    return Remembered(solution.x[which], solution.covariance[np.ix_(which, which)])


def _evidence(batch: Batch, solution: Solution, judge: Solution) -> float:
    """Logarithm of how likely the readings are under the batch's prior, but for a constant.

    Noise, weights and correlation are those of one judge for all that are compared.
    """
    sigma = np.sqrt(np.diag(batch.prior.covariance))
    is_open = sigma > 0.0
    which, unit = np.ix_(is_open, is_open), np.outer(sigma[is_open], sigma[is_open])
    of_prior, of_solution = batch.prior.covariance[which] / unit, solution.covariance[which] / unit
    off = (solution.x - batch.prior.mean)[is_open] / sigma[is_open]
    strain = float(off @ np.linalg.solve(of_prior, off))
    occam = float(np.linalg.slogdet(of_solution)[1] - np.linalg.slogdet(of_prior)[1])
    return (occam - _misfit(solution.left.off_rad, judge) / judge.noise.factor - strain) / 2.0


def _misfit(off_rad: Array, judge: Solution) -> float:
    left = judge.left
    return float(np.sum(left.weights * np.sum(np.square(off_rad / left.noise_rad), axis=0)))
