"""Tests whether readings are the satellite's: their best orbit must be one that the elements allow.  Pure.

Another satellite moves at other rates, so no small change of our elements goes through its readings for long; elements
that are wrong along the track by degrees are still ours.
"""

from dataclasses import astuple, replace

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import make_prior, states_of
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.screening.offsets import Offsets, offsets
from acu_daemon.assist.screening_limits import BEFORE_S, NARROW, NEAR_SHARE
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator


def fitted(
    source: Propagator, site: Site, settings: EstimatorSettings, readings: Readings
) -> tuple[FitResult, Offsets] | None:
    """The orbit that fits readings, and their offsets from it; None without one.

    The fit's own sigma is left out of what counts as near: it would excuse what the fit cannot explain.
    Raises:  OrbitError: the source has no answer for one of the times.
    """
    estimator = FullEstimator(source, site, settings)
    estimator.add(readings)
    fit = estimator.fit()
    return None if fit is None else (fit, offsets(source, site, replace(fit, covariance=None), readings, settings))


class OrbitTest:
    """Fits questioned readings, together with those believed before, to an orbit near the elements."""

    def __init__(self, source: Propagator, site: Site, settings: EstimatorSettings) -> None:
        self._source, self._site, self._settings = source, site, settings

    def best_offsets(self, readings: Readings, factor: float) -> Offsets | None:
        """Offsets from the orbit that fits the readings, its sigmas factor times as large; None without one."""
        sigmas = self._settings.sigmas_of(self._source.kind)
        wide = replace(self._settings, orbit_sigmas=type(sigmas)(*(factor * one for one in astuple(sigmas))))
        try:
            found = fitted(self._source, self._site, wide, readings)
        except (OrbitError, np.linalg.LinAlgError):
            return None
        return None if found is None else found[1]

    def verdict(self, before: Readings | None, questioned: Readings) -> Offsets | None:
        """Offsets of the questioned readings from the orbit that fits, or None: no orbit near the elements does."""
        seen = self.best_offsets(questioned if before is None else Readings.joined([before, questioned]), NARROW)
        if seen is None:
            return None
        old, new = seen.part(slice(None, -len(questioned))), seen.part(slice(-len(questioned), None))
        if float(np.mean(new.is_near)) < NEAR_SHARE:
            return None
        if before is not None and float(np.mean(old.is_near[old.tai_s >= old.tai_s[-1] - BEFORE_S])) < NEAR_SHARE:
            return None
        return new

    def strain(self, readings: Readings) -> float:
        """How far the orbit and the biases that fit readings are from what the elements say: sigmas, squared, summed.

        Infinite where the most likely orbit does not go through them.
        Raises:  OrbitError: the source has no answer for one of the times.
        """
        found = fitted(self._source, self._site, self._settings, readings)
        if found is None:
            return 0.0
        fit, seen = found
        if float(np.mean(seen.is_near)) < NEAR_SHARE:
            return np.inf
        x = states_of(fit.correction, fit.bias, fit.station_shift_enu_m)
        variance = np.diag(make_prior(self._source, self._settings, float(readings.tai_s[0])).covariance)
        is_open = variance > 0.0
        return float(np.sum(x[is_open] ** 2 / variance[is_open]))
