"""The Kalman filter of seed 002, section 4: state = what to add to raan and mean anomaly of the source.  Pure.

The state is the difference to the source, which moves by its own theory (eqs 4.1, 4.2); so the transition matrix is the
identity (eq 4.4 as printed divides by the state: docs/decisions).  Readings are taken one scalar at a time, azimuth
then elevation (section 4, after eq 4.15).  The source is evaluated once for a batch; if the state moves far while the
batch is taken in, the batch is taken again, linearised at the new state.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sqrt

import numpy as np

from acu_daemon.assist.base import BaseEstimator, mean_motion_rad_s
from acu_daemon.assist.gate import OUTLIER
from acu_daemon.assist.settings import EstimatorSettings, KalmanTuning
from acu_daemon.model import Correction, Readings, Site
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array

_BATCH_COUNT = 50
_MAX_SWEEPS = 8
_MOVED_RAD = 3e-5  # a smaller move of the state leaves less than 1e-5 deg of curvature
_OUTLIER_SIGMAS = 6.0
_RESET_AFTER_COUNT = 20  # so many outliers in a row mean that the filter is wrong, not the readings


@dataclass(frozen=True, slots=True)
class FilterState:
    """Estimate and covariance (radians) after the reading at tai_s."""

    raan: float
    mean_anomaly: float
    p_rr: float
    p_rm: float
    p_mm: float
    tai_s: float | None = None
    outlier_count: int = 0  # in a row


def initial_state(tuning: KalmanTuning) -> FilterState:
    """Give the state before the first reading: no correction, diagonal covariance (seed 002, 5.3)."""
    return FilterState(0.0, 0.0, (tuning.sigma_raan_deg * DEG) ** 2, 0.0, (tuning.sigma_mean_anomaly_deg * DEG) ** 2)


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
    """Evaluate h(x) and H(x), eqs 4.7-4.12, in east-north-up in place of the seed's south-east-up.

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
    """Seed 002, eqs 4.1-4.15, behind the `Estimator` protocol."""

    name = "kalman"

    def __init__(self, propagator: Propagator, site: Site, settings: EstimatorSettings) -> None:
        super().__init__(propagator, site, settings)
        self.state = initial_state(settings.kalman)

    def _correction(self) -> Correction | None:
        return Correction(self.state.raan, self.state.mean_anomaly) if self.used_count else None

    def _use(self, readings: Readings) -> list[str | None]:
        reasons: list[str | None] = []
        for k in range(0, len(readings), _BATCH_COUNT):
            part = slice(k, k + _BATCH_COUNT)
            batch = Readings(readings.tai_s[part], readings.az_deg[part], readings.el_deg[part])
            reasons += self._take(batch)
        return reasons

    def _take(self, batch: Readings) -> list[str | None]:
        before = after = self.state
        reasons: list[str | None] = []
        for _ in range(_MAX_SWEEPS):
            at = (after.raan, after.mean_anomaly)
            line = linearise(self._source, *at, batch.tai_s, self._site)
            after, reasons = sweep(before, batch, line, self._settings)
            if max(abs(after.raan - at[0]), abs(after.mean_anomaly - at[1])) < _MOVED_RAD:
                break
        self.state = after
        return reasons


def sweep(
    state: FilterState, readings: Readings, line: Linearised, settings: EstimatorSettings
) -> tuple[FilterState, list[str | None]]:
    """Take a batch of readings in, one after the other: eqs 4.13 (its K with the transpose it lacks) and 4.15."""
    tuning = settings.kalman
    q_raan, q_mean = (tuning.walk_raan_deg * DEG) ** 2, (tuning.walk_mean_anomaly_deg * DEG) ** 2
    floor2 = (tuning.floor_deg * DEG) ** 2
    r_az, r_el = (settings.sigma_azimuth_deg * DEG) ** 2, (settings.sigma_elevation_deg * DEG) ** 2
    far = settings.beamwidth_deg / 2 * DEG
    x1, x2, p11, p12, p22 = state.raan, state.mean_anomaly, state.p_rr, state.p_rm, state.p_mm
    last_tai_s, outlier_count = state.tai_s, state.outlier_count
    at1, at2 = line.at
    d_az = ((np.radians(readings.az_deg) - line.az + pi) % (2.0 * pi) - pi).tolist()
    d_el = (np.radians(readings.el_deg) - line.el).tolist()
    partials = zip(
        *(h.tolist() for h in (line.az_by_raan, line.az_by_mean_anomaly, line.el_by_raan, line.el_by_mean_anomaly)),
        strict=True,
    )
    rows = zip(readings.tai_s.tolist(), readings.el_deg.tolist(), d_az, d_el, partials, strict=True)
    reasons: list[str | None] = []
    for tai_s, el_deg, az_off, el_off, (a1, a2, e1, e2) in rows:
        dt_s = 0.0 if last_tai_s is None else tai_s - last_tai_s
        last_tai_s = tai_s
        p11 += q_raan * dt_s if p11 < floor2 else 0.0
        p22 += q_mean * dt_s if p22 < floor2 else 0.0
        cos_el = max(cos(radians(el_deg)), 1e-3)
        r = r_az / cos_el**2
        innovation = az_off - a1 * (x1 - at1) - a2 * (x2 - at2)
        c1, c2 = p11 * a1 + p12 * a2, p12 * a1 + p22 * a2
        s = a1 * c1 + a2 * c2 + r
        el_innovation = el_off - e1 * (x1 - at1) - e2 * (x2 - at2)
        el_s = e1 * (p11 * e1 + 2 * p12 * e2) + e2 * p22 * e2 + r_el
        is_outlier = (abs(innovation) > _OUTLIER_SIGMAS * sqrt(s) and abs(innovation) * cos_el > far) or (
            abs(el_innovation) > _OUTLIER_SIGMAS * sqrt(el_s) and abs(el_innovation) > far
        )
        if is_outlier:
            outlier_count += 1
            reasons.append(OUTLIER)
            if outlier_count >= _RESET_AFTER_COUNT:
                fresh = initial_state(tuning)
                p11, p12, p22, outlier_count = fresh.p_rr, fresh.p_rm, fresh.p_mm, 0
            continue
        outlier_count = 0
        reasons.append(None)
        k1, k2 = c1 / s, c2 / s
        x1, x2 = x1 + k1 * innovation, x2 + k2 * innovation
        p11, p12, p22 = p11 - k1 * c1, p12 - k1 * c2, p22 - k2 * c2
        c1, c2 = p11 * e1 + p12 * e2, p12 * e1 + p22 * e2
        s = e1 * c1 + e2 * c2 + r_el
        innovation = el_off - e1 * (x1 - at1) - e2 * (x2 - at2)
        k1, k2 = c1 / s, c2 / s
        x1, x2 = x1 + k1 * innovation, x2 + k2 * innovation
        p11, p12, p22 = p11 - k1 * c1, p12 - k1 * c2, p22 - k2 * c2
    return FilterState(x1, x2, p11, p12, p22, last_tai_s, outlier_count), reasons
