"""The Kalman filter of Kuga and Carrara 1988 (docs/estimation.md, The Kalman filter).  Pure.

State: what to add to raan and mean anomaly of the source.

The state is the difference to the source, which moves by its own theory (eqs 4.1, 4.2); so the transition matrix is the
identity (eq 4.4 as printed divides by the state: docs/decisions).  Readings are taken one scalar at a time, azimuth
then elevation (section 4, after eq 4.15).  The source is evaluated once for a batch; if the state moves far while the
batch is taken in, the batch is taken again, linearised at the new state.
"""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from acu_daemon.assist.estimators.estimator_base import BaseEstimator, mean_motion_rad_s
from acu_daemon.assist.reading_gate import OUTLIER
from acu_daemon.assist.settings import EstimatorSettings, KalmanTuning
from acu_daemon.model import Correction, Readings, Site
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array, wrap_pi_array

_BATCH_COUNT = 50
_MAX_SWEEPS = 8
_MOVED_RAD = 3e-5  # a smaller move of the state leaves less than 1e-5 deg of curvature
_LEAST_COS_EL = 1e-3
_OUTLIER_SIGMAS = 6.0
_RESET_AFTER_COUNT = 20  # so many outliers in a row mean that the filter is wrong, not the readings


class Estimate(NamedTuple):
    """State and covariance, radians."""

    raan: float
    mean_anomaly: float
    p_rr: float
    p_rm: float
    p_mm: float


@dataclass(frozen=True, slots=True)
class FilterState:
    """What the filter knows after the reading at tai_s (None: before the first one)."""

    estimate: Estimate
    tai_s: float | None = None
    outlier_count: int = 0  # in a row


def initial_estimate(tuning: KalmanTuning) -> Estimate:
    """Give the estimate before the first reading: no correction, diagonal covariance (Kuga and Carrara 1988, 5.3)."""
    return Estimate(0.0, 0.0, (tuning.sigma_raan_deg * DEG) ** 2, 0.0, (tuning.sigma_mean_anomaly_deg * DEG) ** 2)


@dataclass(frozen=True, slots=True)
class Linearised:
    """Angles that a correction predicts, and their partials (eq 4.14); every array (N,), radians."""

    at: tuple[float, float]  # delta raan, delta mean anomaly
    az: Array
    el: Array
    az_by_raan: Array
    az_by_mean_anomaly: Array
    el_by_raan: Array
    el_by_mean_anomaly: Array


def linearise(source: Propagator, delta_raan: float, delta_mean_anomaly: float, tai_s: Array, site: Site) -> Linearised:
    """Evaluate h(x) and H(x), eqs 4.7-4.12, in east-north-up in place of the paper's south-east-up.

    The rotation of eq 4.10 is printed for the opposite direction (docs/decisions); here it is `itrs_from_teme` and
    `enu_from_itrs`, for positions and partials alike.
    """
    r_m, v_m_s = source.corrected(Correction(delta_raan, delta_mean_anomaly)).states_teme(tai_s)
    axes = enu_from_itrs(site.station).T
    by_raan = np.stack((-r_m[:, 1], r_m[:, 0], np.zeros_like(tai_s)), axis=1)  # eq 4.11
    by_mean_anomaly = v_m_s / mean_motion_rad_s(r_m, v_m_s)[:, None]

    def fixed(vectors: Array) -> Array:
        return itrs_from_teme(vectors, np.zeros_like(vectors), tai_s, site.orientation)[0]

    e, n, u = ((fixed(r_m) - station_itrs_m(site.station)) @ axes).T
    flat2 = np.maximum(e * e + n * n, 1e-6)
    flat, range2 = np.sqrt(flat2), flat2 + u * u

    def by(vectors: Array) -> tuple[Array, Array]:  # eqs 4.8, 4.9
        de, dn, du = (fixed(vectors) @ axes).T
        return (n * de - e * dn) / flat2, (flat * du - u * (e * de + n * dn) / flat) / range2

    (az_r, el_r), (az_m, el_m) = by(by_raan), by(by_mean_anomaly)
    return Linearised((delta_raan, delta_mean_anomaly), np.arctan2(e, n), np.arctan2(u, flat), az_r, az_m, el_r, el_m)


class KalmanEstimator(BaseEstimator):
    """Kuga and Carrara 1988, eqs 4.1-4.15, behind the `Estimator` protocol."""

    name = "kalman"

    def __init__(self, propagator: Propagator, site: Site, settings: EstimatorSettings) -> None:
        super().__init__(propagator, site, settings)
        self.state = FilterState(initial_estimate(settings.kalman))

    def _correction(self) -> Correction | None:
        estimate = self.state.estimate
        return Correction(estimate.raan, estimate.mean_anomaly) if self.used_count else None

    def _use(self, readings: Readings) -> list[str | None]:
        reasons: list[str | None] = []
        for k in range(0, len(readings), _BATCH_COUNT):
            reasons += self._take(readings.part(slice(k, k + _BATCH_COUNT)))
        return reasons

    def _take(self, batch: Readings) -> list[str | None]:
        after = self.state
        reasons: list[str | None] = []
        for _ in range(_MAX_SWEEPS):
            at = after.estimate
            line = linearise(self._source, at.raan, at.mean_anomaly, batch.tai_s, self._site)
            after, reasons = sweep(self.state, batch, line, self._settings)
            new = after.estimate
            if max(abs(new.raan - at.raan), abs(new.mean_anomaly - at.mean_anomaly)) < _MOVED_RAD:
                break
        self.state = after
        return reasons


def sweep(
    state: FilterState, readings: Readings, line: Linearised, settings: EstimatorSettings
) -> tuple[FilterState, list[str | None]]:
    """Take a batch of readings in, one after the other (eqs 4.13, 4.15), and give a reason for each one left out.

    An outlier is far from the estimate by its sigma and by the beam.  After many in a row the covariance starts afresh,
    so that a wrong estimate does not lock the readings out.
    """
    tuning = settings.kalman
    sigma_az, sigma_el = settings.sigma_azimuth_deg * DEG, settings.sigma_elevation_deg * DEG
    far = settings.beamwidth_deg / 2 * DEG
    at_raan, at_mean_anomaly = line.at
    estimate, last_tai_s, outlier_count = state.estimate, state.tai_s, state.outlier_count
    reasons: list[str | None] = []
    cos_el = np.maximum(np.cos(np.radians(readings.el_deg)), _LEAST_COS_EL)
    az_off = wrap_pi_array(np.radians(readings.az_deg) - line.az)
    el_off = np.radians(readings.el_deg) - line.el
    columns = (readings.tai_s, cos_el, az_off, el_off, line.az_by_raan, line.az_by_mean_anomaly)
    rows = zip(*(x.tolist() for x in (*columns, line.el_by_raan, line.el_by_mean_anomaly)), strict=True)
    for tai_s, cos_h, az, el, az_r, az_m, el_r, el_m in rows:
        estimate = _age(estimate, 0.0 if last_tai_s is None else tai_s - last_tai_s, tuning)
        last_tai_s = tai_s
        by_az, by_el = (az_r, az_m), (el_r, el_m)
        az_at = az + az_r * at_raan + az_m * at_mean_anomaly  # what is left is (this) - H x
        el_at = el + el_r * at_raan + el_m * at_mean_anomaly
        r_az, r_el = (sigma_az / cos_h) ** 2, sigma_el**2
        if _is_far(estimate, by_az, az_at, r_az, far / cos_h) or _is_far(estimate, by_el, el_at, r_el, far):
            reasons.append(OUTLIER)
            outlier_count += 1
            if outlier_count == _RESET_AFTER_COUNT:
                estimate = Estimate(*estimate[:2], *initial_estimate(tuning)[2:])
                outlier_count = 0
            continue
        reasons.append(None)
        outlier_count = 0
        estimate = update(update(estimate, by_az, az_at, r_az), by_el, el_at, r_el)
    return FilterState(estimate, last_tai_s, outlier_count), reasons


def update(estimate: Estimate, h: tuple[float, float], observed: float, variance: float) -> Estimate:
    """Take in one scalar, observed = h . state + noise (eq 4.13, K with the transpose it lacks: docs/decisions)."""
    raan, mean_anomaly, p_rr, p_rm, p_mm = estimate
    c_r, c_m = p_rr * h[0] + p_rm * h[1], p_rm * h[0] + p_mm * h[1]
    s = h[0] * c_r + h[1] * c_m + variance
    k_r, k_m = c_r / s, c_m / s
    innovation = observed - h[0] * raan - h[1] * mean_anomaly
    return Estimate(
        raan + k_r * innovation,
        mean_anomaly + k_m * innovation,
        p_rr - k_r * c_r,
        p_rm - k_r * c_m,
        p_mm - k_m * c_m,
    )


def _age(estimate: Estimate, dt_s: float, tuning: KalmanTuning) -> Estimate:
    """Let the time between two readings pass: eq 4.15 with an identity for the transition."""
    floor = (tuning.floor_deg * DEG) ** 2
    raan, mean_anomaly, p_rr, p_rm, p_mm = estimate
    p_rr += (tuning.walk_raan_deg * DEG) ** 2 * dt_s if p_rr < floor else 0.0
    p_mm += (tuning.walk_mean_anomaly_deg * DEG) ** 2 * dt_s if p_mm < floor else 0.0
    return Estimate(raan, mean_anomaly, p_rr, p_rm, p_mm)


def _is_far(estimate: Estimate, h: tuple[float, float], observed: float, variance: float, far: float) -> bool:
    off = abs(observed - h[0] * estimate.raan - h[1] * estimate.mean_anomaly)
    if off <= far:
        return False
    s = h[0] * h[0] * estimate.p_rr + 2 * h[0] * h[1] * estimate.p_rm + h[1] * h[1] * estimate.p_mm + variance
    return off > _OUTLIER_SIGMAS * sqrt(s)
