"""The least error that the readings allow (Cramer-Rao), with the station's place and the bias as unknowns."""

import numpy as np

from acu_daemon.model import Site, Station
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DEG, EARTH_EQUATORIAL_RADIUS_M, Array, wrap_180_array
from tables.errors_put_in import CORRUPTION, azimuth_model_deg, elevation_model_deg, taken_as_mean
from tables.true_pass import TruePass

STATION_SIGMA_M = np.array([6e3, 6e3, 100.0])  # east, north, up
BIAS_SIGMA_DEG = np.array([0.1, 0.01, 0.1, 0.01])  # constant and cot h, in azimuth and in elevation; as `full` has them
DRAW_COUNT = 2000
_STEPS = np.array([10.0, 10.0, 10.0, 0.01, 0.01, 0.01, 10.0, 10.0, 10.0])


def bounds_deg(true_pass: TruePass, rng: np.random.Generator) -> list[float]:
    """For each row of the pass: the median, over draws from the least covariance, of the largest eps.

    Unknowns: state at the rise (6), station (3), bias (4), each with a prior of the size of the error put in; readings
    weighted with the true noise.  eps leaves the bias out: it is judged against the true direction.
    """
    by_az, by_el = _partials(true_pass)
    shapes = np.stack((np.ones_like(true_pass.el_deg), 1.0 / np.tan(np.radians(true_pass.el_deg))), axis=1)
    none = np.zeros_like(shapes)
    sigma_az_deg = azimuth_model_deg(true_pass.el_deg, true_pass.range_km)
    rows_az = np.hstack((by_az, shapes, none)) / sigma_az_deg[:, None]
    rows_el = np.hstack((by_el, none, shapes)) / elevation_model_deg(true_pass.el_deg)[:, None]
    prior = np.concatenate((CORRUPTION, STATION_SIGMA_M, BIAS_SIGMA_DEG))
    result = []
    for row in true_pass.seed.rows:
        used = np.vstack((rows_az[: row.used_s], rows_el[: row.used_s])) * prior
        root = np.linalg.cholesky(np.linalg.inv(used.T @ used + np.eye(prior.size)))
        draws = (prior[:, None] * (root @ rng.standard_normal((prior.size, DRAW_COUNT))))[:9]
        eps = np.hypot(by_az[row.used_s :] @ draws, by_el[row.used_s :] @ draws)
        result.append(float(np.median(eps.max(axis=0))))
    return result


def _partials(true_pass: TruePass) -> tuple[Array, Array]:
    """How azimuth and elevation, degrees, (N, 9), change with state (m, m/s) and station (m east, north, up)."""
    columns_az, columns_el = [], []
    for step in np.diag(_STEPS):
        (az1, el1), (az0, el0) = _angles(true_pass, step), _angles(true_pass, -step)
        columns_az.append(wrap_180_array(az1 - az0) / (2.0 * step.max()))
        columns_el.append((el1 - el0) / (2.0 * step.max()))
    return np.stack(columns_az, axis=1), np.stack(columns_el, axis=1)


def _angles(true_pass: TruePass, change: Array) -> tuple[Array, Array]:
    source = taken_as_mean(true_pass.state_teme + change[:6], float(true_pass.tai_s[0]))
    seen = look_at(source, true_pass.tai_s, Site(_moved(true_pass.exact_site.station, *change[6:].tolist())))
    return seen.az_deg, seen.el_deg


def _moved(station: Station, east_m: float, north_m: float, up_m: float) -> Station:
    radius_m = EARTH_EQUATORIAL_RADIUS_M  # near enough for a partial
    latitude_deg = station.latitude_deg + north_m / radius_m / DEG
    longitude_deg = station.longitude_deg + east_m / radius_m / np.cos(station.latitude_deg * DEG) / DEG
    return Station(station.name, latitude_deg, longitude_deg, station.height_m + up_m)
