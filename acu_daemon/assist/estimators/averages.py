"""The estimators that average inversions: `circular` and `deterministic`.  Pure.

Equations: docs/estimation.md, The papers' averages.

Both correct any source.  At each reading the source's osculating a, e, i and argument of perigee are taken as known,
the reading is inverted with them, and what is averaged is the difference of raan and mean anomaly to the source's own.
For a source that moves by secular rates only, that is the paper's propagation of the mean to the next reading (eqs 18,
20, 21).
"""

from collections import deque

import numpy as np

from acu_daemon.assist.estimators.estimator_base import BaseEstimator
from acu_daemon.assist.estimators.inversion import Inversion, KnownElements, direction_cosines, invert
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, Readings, Site
from acu_daemon.orbit.frames import station_itrs_m
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.timescales import gmst_rad
from acu_daemon.units import Array, wrap_pi_array

_FEWEST_INVERSIONS = 3


def _invert(readings: Readings, site: Site, known: KnownElements, radius_m: Array, prior_raan_rad: Array) -> Inversion:
    return invert(
        direction_cosines(readings.az_deg, readings.el_deg, site.station),
        station_itrs_m(site.station),
        gmst_rad(readings.tai_s, site.orientation.ut1_utc_s),
        known,
        radius_m,
        prior_raan_rad,
    )


class DeterministicEstimator(BaseEstimator):
    """Each reading inverted to raan and mean anomaly, and their running mean: Kuga and Carrara 1990, eqs 1-19."""

    name = "deterministic"

    def __init__(self, propagator: Propagator, site: Site, settings: EstimatorSettings) -> None:
        super().__init__(propagator, site, settings)
        self._mean: tuple[float, float] | None = None
        self._count = 0

    def _correction(self) -> Correction | None:
        return None if self._mean is None else Correction(*self._mean)

    def _prior_raan(self) -> float:
        return self._mean[0] if self._mean else 0.0

    def _differences(self, readings: Readings) -> tuple[Array, Array, tuple[str | None, ...]]:
        """Give delta raan, delta mean anomaly and the reason if there are none, for each reading."""
        r_m, v_m_s = self._source.states_teme(readings.tai_s)
        own = osculating_from_state(r_m, v_m_s)
        known = KnownElements(own.a_m, own.e, own.i_rad, own.argp_rad)
        prior = own.raan_rad + self._prior_raan()
        found = _invert(readings, self._site, known, np.linalg.norm(r_m, axis=1), prior)
        return (
            wrap_pi_array(found.raan_rad - own.raan_rad),
            wrap_pi_array(found.mean_anomaly_rad - own.mean_anomaly_rad),
            found.reasons,
        )

    def _use(self, readings: Readings) -> list[str | None]:
        d_raan, d_mean_anomaly, reasons = self._differences(readings)
        for raan, mean_anomaly, reason in zip(d_raan.tolist(), d_mean_anomaly.tolist(), reasons, strict=True):
            if reason is None:
                self._average(raan, mean_anomaly)
        return list(reasons)

    def _average(self, raan: float, mean_anomaly: float) -> None:
        self._count += 1
        before = self._mean or (0.0, 0.0)
        rest = self._count - 1
        self._mean = ((raan + rest * before[0]) / self._count, (mean_anomaly + rest * before[1]) / self._count)


class CircularEstimator(DeterministicEstimator):
    """Aguirre and Medeiros 1988, 2.3 and 2.6c: circular orbit, the mean of the last 3 to 8 consecutive inversions.

    The sphere of step 1 has the radius at which the source has the satellite: for a circular source its a.  Mean
    anomaly is the argument of latitude.  The branch nearest to the mean of all inversions is taken: near the highest
    latitude the mean of a few walks off along the wrong one.
    """

    name = "circular"

    def __init__(self, propagator: Propagator, site: Site, settings: EstimatorSettings) -> None:
        super().__init__(propagator, site, settings)
        self._last: deque[tuple[float, float]] = deque(maxlen=settings.inversion_count)

    def _correction(self) -> Correction | None:
        if len(self._last) < _FEWEST_INVERSIONS:
            return None
        raan, mean_anomaly = np.mean(self._last, axis=0).tolist()
        return Correction(raan, mean_anomaly)

    def _differences(self, readings: Readings) -> tuple[Array, Array, tuple[str | None, ...]]:
        r_m, v_m_s = self._source.states_teme(readings.tai_s)
        radius_m = np.linalg.norm(r_m, axis=1)
        own = osculating_from_state(r_m, v_m_s)
        along = _argument_of_latitude(r_m, own.i_rad, own.raan_rad)
        zero = np.zeros_like(radius_m)
        prior = own.raan_rad + self._prior_raan()
        found = _invert(readings, self._site, KnownElements(radius_m, zero, own.i_rad, zero), radius_m, prior)
        return (
            wrap_pi_array(found.raan_rad - own.raan_rad),
            wrap_pi_array(found.mean_anomaly_rad - along),
            found.reasons,
        )

    def _average(self, raan: float, mean_anomaly: float) -> None:
        super()._average(raan, mean_anomaly)
        self._last.append((raan, mean_anomaly))


def _argument_of_latitude(r_m: Array, i_rad: Array, raan_rad: Array) -> Array:
    x, y, z = r_m.T
    at_node = x * np.cos(raan_rad) + y * np.sin(raan_rad)
    beside = (y * np.cos(raan_rad) - x * np.sin(raan_rad)) * np.cos(i_rad) + z * np.sin(i_rad)
    u: Array = np.arctan2(beside, at_node)
    return u
