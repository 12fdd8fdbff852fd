"""The estimators by name, behind one protocol.  Pure."""

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from acu_daemon.assist.estimators.averages import CircularEstimator, DeterministicEstimator
from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.full.pedestal_prior import PedestalPrior
from acu_daemon.assist.estimators.kalman import KalmanEstimator
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.errors import UsageError
from acu_daemon.model import AngleBias, FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator

__all__ = ["ESTIMATORS", "Estimator", "EstimatorSettings", "has_covariance", "make_estimator"]


class Estimator(Protocol):
    """Learns from readings where the orbit really is.  Mutable; one owner."""

    @property
    def name(self) -> str:
        """The method that runs."""

    @property
    def notes(self) -> list[str]:
        """What people should be told; whoever tells them empties it."""

    def add(self, readings: Readings) -> None:
        """Take new readings only, oldest first, encoder angles."""

    def fit(self) -> FitResult | None:
        """Give the fit to all readings so far; None while there are too few."""


ESTIMATORS: dict[str, Callable[[Propagator, Site, EstimatorSettings], Estimator]] = {
    "circular": CircularEstimator,
    "deterministic": DeterministicEstimator,
    "kalman": KalmanEstimator,
    "full": FullEstimator,
}


def has_covariance(name: str) -> bool:
    """Whether an estimator knows a covariance: only then a pass's fit can be the next one's prior."""
    return ESTIMATORS.get(name) is FullEstimator


def make_estimator(
    name: str,
    propagator: Propagator,
    site: Site,
    settings: EstimatorSettings,
    carried: CarryOver | None = None,
    pedestal: PedestalPrior | None = None,
) -> Estimator:
    """Make an estimator that corrects a source.

    name: circular, deterministic, kalman or full.
    carried: what an earlier pass left, an accepted one; without a meaning for estimators without covariance.
    pedestal: what passes of any satellite showed of the antenna.  Estimators without covariance see readings less its
    means, and their fits have them as biases.
    Raises:  UsageError: no such estimator.
    """
    if name not in ESTIMATORS:
        raise UsageError(f"no estimator {name!r}: expected one of {', '.join(ESTIMATORS)}")
    if has_covariance(name):
        return FullEstimator(propagator, site, settings, carried, may_widen=True, pedestal=pedestal)
    known = AngleBias() if pedestal is None else pedestal.bias
    return ESTIMATORS[name](propagator, site, replace(settings, known_bias=known))
