"""The estimators by name, behind one protocol.  Pure."""

from collections.abc import Callable
from typing import Protocol

from acu_daemon.assist.averages import CircularEstimator, DeterministicEstimator
from acu_daemon.assist.full import FullEstimator
from acu_daemon.assist.kalman import KalmanEstimator
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.errors import UsageError
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator

__all__ = ["ESTIMATORS", "Estimator", "EstimatorSettings", "make_estimator"]


class Estimator(Protocol):
    """Learns from readings where the orbit really is.  Mutable; one owner."""

    @property
    def name(self) -> str:
        """The method that runs."""

    def add(self, readings: Readings) -> None:
        """Take new readings only, oldest first, encoder angles."""

    def fit(self) -> FitResult | None:
        """Give the fit to all readings so far; None while there are too few."""


ESTIMATORS: dict[str, Callable[[Propagator, Site, EstimatorSettings], Estimator]] = {
    "circular": CircularEstimator,
    "deterministic": DeterministicEstimator,
    "kalman": KalmanEstimator,
    "full": KalmanEstimator,  # the result names the method that ran
    "six": FullEstimator,
}


def make_estimator(name: str, propagator: Propagator, site: Site, settings: EstimatorSettings) -> Estimator:
    """Make an estimator that corrects a source.

    name: circular, deterministic, kalman or full; `full` runs `kalman`, and the caller says so (see `Estimator.name`).
    Raises:  UsageError: no such estimator.
    """
    if name not in ESTIMATORS:
        raise UsageError(f"no estimator {name!r}: expected one of {', '.join(ESTIMATORS)}")
    return ESTIMATORS[name](propagator, site, settings)
