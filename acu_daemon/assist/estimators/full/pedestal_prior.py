"""What is known of the pedestal before a pass, in place of the sigmas of the configuration, and the doubt in it.  Pure.

Theory: docs/estimation.md, Memory of the mount.
"""

from dataclasses import dataclass, field
from math import log

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import STATE_COUNT, Prior, bias_of
from acu_daemon.assist.estimators.full.noise_correlation import WHITE, NoiseCorrelation
from acu_daemon.model import AngleBias
from acu_daemon.units import DEG, Array

PEDESTAL = (6, 7, 8, 9, 13, 14, 15, 16)  # of the estimator's states
PEDESTAL_TERMS = ("IA", "CA", "IE", "RF", "NPAE", "AN", "AW", "TF")  # RF: of the refraction, at 45 deg of elevation
IA, CA, IE, RF = 0, 1, 2, 3
ZERO_POINTS = (IA, IE)  # what a re-zeroed encoder moves
REZEROED_DEG = 0.3  # 1 sigma of by how much
LOG_ODDS = log(0.03)  # of an encoder that was re-zeroed since the last pass


@dataclass(frozen=True)
class PedestalPrior:
    """Mean (8,), rad, and covariance (8, 8) of the states PEDESTAL; zero variance: that one stays as it is.

    noise: what earlier passes say of how the noise of a second depends on that of the one before.
    """

    mean: Array
    covariance: Array = field(repr=False)
    noise: NoiseCorrelation = WHITE

    def of(self, prior: Prior) -> Prior:
        """The prior with this in it; the orbit's part stays, without what it knew of the pedestal."""
        mean, covariance = prior.mean.copy(), prior.covariance.copy()
        which = list(PEDESTAL)
        mean[which] = self.mean
        covariance[which] = covariance[:, which] = 0.0
        covariance[np.ix_(which, which)] = self.covariance
        return Prior(mean, covariance)

    @property
    def bias(self) -> AngleBias:
        """The means, as what the encoders show."""
        x = np.zeros(STATE_COUNT)
        x[list(PEDESTAL)] = self.mean
        return bias_of(x)

    @property
    def rezeroed(self) -> "PedestalPrior":
        """The same if an encoder may have been re-zeroed: H1."""
        covariance = self.covariance.copy()
        for k in ZERO_POINTS:
            covariance[k, k] += _rezeroed_variance(self.covariance[k, k])
        return PedestalPrior(self.mean, covariance, self.noise)


@dataclass(frozen=True)
class Doubt:
    """What readings say of a shift of IA and IE against a prior: its gradient (2,) and information (2, 2), 1/rad.

    Of independent passes they add up.
    """

    gradient: Array
    information: Array = field(repr=False)

    def __add__(self, other: "Doubt") -> "Doubt":
        return Doubt(self.gradient + other.gradient, self.information + other.information)

    @property
    def shift_rad(self) -> Array:
        """By how much IA and IE are off the prior, by the readings alone."""
        shift: Array = self._pinv @ self.gradient
        return shift

    @property
    def covariance(self) -> Array:
        """Of the shift."""
        return self._pinv

    @property
    def chi2(self) -> float:
        """How far the shift is from none: sigmas squared, of two."""
        return float(self.gradient @ self._pinv @ self.gradient)

    @property
    def log_evidence(self) -> float:
        """How much more likely the readings are if the encoders were re-zeroed by 0.3 deg (1 sigma) than if not."""
        width = (REZEROED_DEG * DEG) ** 2
        determinant = float(np.linalg.det(np.eye(2) + width * self.information))
        wider = np.linalg.inv(self.information + np.eye(2) / width)
        return float(self.gradient @ wider @ self.gradient - np.log(determinant)) / 2.0

    @property
    def likely_shift_rad(self) -> Array:
        """By how much they are, with how far encoders are re-zeroed by."""
        shift: Array = np.linalg.inv(self.information + np.eye(2) / (REZEROED_DEG * DEG) ** 2) @ self.gradient
        return shift

    @property
    def is_rezeroed(self) -> bool:
        """Whether that is likelier than that the memory holds."""
        return self.log_evidence + LOG_ODDS > 0.0

    @property
    def _pinv(self) -> Array:
        inverse: Array = np.asarray(np.linalg.pinv(self.information, hermitian=True), dtype=np.float64)
        return inverse


NO_DOUBT = Doubt(np.zeros(2), np.zeros((2, 2)))


def doubt_of(prior: PedestalPrior, x: Array, covariance: Array, *, is_rezeroed: bool) -> Doubt:
    """What a solution x (17,), with its covariance, says against a prior.

    is_rezeroed: the solution is one with prior.rezeroed.  With S the covariance of readings' estimate about the prior's
    mean, P that prior, C the solution's: inv(S) = inv(P) - inv(P) C inv(P), of which IA and IE are looked at; a wider
    prior is made narrow again by Woodbury's identity.
    """
    used = prior.rezeroed if is_rezeroed else prior
    is_open = np.diag(used.covariance) > 0.0
    if not is_open[list(ZERO_POINTS)].all():
        return NO_DOUBT
    which = np.array(PEDESTAL)[is_open]
    sigma = np.sqrt(np.diag(used.covariance)[is_open])
    correlation = used.covariance[np.ix_(is_open, is_open)] / np.outer(sigma, sigma)
    zeros = np.searchsorted(which, np.array(PEDESTAL)[list(ZERO_POINTS)])
    inverse = np.linalg.inv(correlation) / np.outer(sigma, sigma)
    columns = inverse[:, zeros]
    gradient = columns.T @ (x[which] - used.mean[is_open])
    information = columns[zeros] - columns.T @ covariance[np.ix_(which, which)] @ columns
    information = (information + information.T) / 2.0
    if is_rezeroed:
        wide = np.diag([_rezeroed_variance(prior.covariance[k, k]) for k in ZERO_POINTS])
        information = np.linalg.inv(np.linalg.inv(information) - wide)
        gradient = (np.eye(2) + information @ wide) @ gradient
    return Doubt(gradient, information)


def with_shift(prior: PedestalPrior, x: Array, covariance: Array, doubt: Doubt) -> Array:
    """What a solution x (17,) with a prior becomes if the encoders were re-zeroed as its doubt has it."""
    is_open = np.diag(prior.covariance) > 0.0
    if not is_open[list(ZERO_POINTS)].all():
        return x
    which = np.array(PEDESTAL)[is_open]
    mean = np.zeros(len(PEDESTAL))
    mean[list(ZERO_POINTS)] = doubt.likely_shift_rad
    sigma = np.sqrt(np.diag(prior.covariance)[is_open])
    correlation = prior.covariance[np.ix_(is_open, is_open)] / np.outer(sigma, sigma)
    moved: Array = x + covariance[:, which] / sigma @ np.linalg.solve(correlation, mean[is_open] / sigma)
    return moved


def _rezeroed_variance(variance: float) -> float:
    """An encoder that is known without doubt (its variance is 0) is taken at that word."""
    return (REZEROED_DEG * DEG) ** 2 if variance > 0.0 else 0.0
