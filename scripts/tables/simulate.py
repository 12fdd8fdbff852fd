"""One run of one pass: readings with errors, a method that learns from them, and how wrong its prediction is."""

import numpy as np

from acu_daemon.assist.estimators.estimator import make_estimator
from acu_daemon.assist.estimators.full.path_partials import moved_site
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array, wrap_180_array
from tables.errors_put_in import Errors, corrupted_state, readings_with
from tables.methods import Method
from tables.true_pass import TruePass


def largest_errors_deg(true_pass: TruePass, method: Method, errors: Errors) -> list[float]:
    """The papers' eps_max for each row of the pass: the largest error from the last reading to the set."""
    source = method.source(corrupted_state(errors, true_pass), float(true_pass.tai_s[0]))
    estimator = make_estimator(method.estimator, source, true_pass.rounded_site, method.settings)
    readings = readings_with(errors, true_pass)
    result, before = [], 0
    for row in true_pass.seed.rows:
        estimator.add(part_of(readings, before, row.used_s))
        d_az, d_el = direction_errors_deg(source, estimator.fit(), true_pass, row.used_s)
        result.append(float(np.hypot(d_az, d_el).max()))
        before = row.used_s
    return result


def errors_over_time_deg(true_pass: TruePass, method: Method, errors: Errors, used_s: int) -> tuple[Array, Array]:
    """Errors in azimuth and elevation each second, (N,): of the newest estimate, then of the last one's prediction."""
    source = method.source(corrupted_state(errors, true_pass), float(true_pass.tai_s[0]))
    estimator = make_estimator(method.estimator, source, true_pass.rounded_site, method.settings)
    readings = readings_with(errors, true_pass)
    az_deg, el_deg = np.empty(len(readings)), np.empty(len(readings))
    for k in range(used_s):
        estimator.add(part_of(readings, k, k + 1))
        last = used_s - 1 == k
        d_az, d_el = direction_errors_deg(source, estimator.fit(), true_pass, k, None if last else k + 1)
        az_deg[k : k + d_az.size], el_deg[k : k + d_el.size] = d_az, d_el
    return az_deg, el_deg


def direction_errors_deg(
    source: Propagator, fit: FitResult | None, true_pass: TruePass, begin: int, end: int | None = None
) -> tuple[Array, Array]:
    """Predicted minus true azimuth (without cos h) and elevation of the samples from begin to end."""
    az_deg, el_deg = predicted_deg(source, fit, true_pass.tai_s[begin:end], true_pass.rounded_site)
    return wrap_180_array(az_deg - true_pass.az_deg[begin:end]), el_deg - true_pass.el_deg[begin:end]


def predicted_deg(source: Propagator, fit: FitResult | None, tai_s: Array, site: Site) -> tuple[Array, Array]:
    """True direction of the satellite, without encoder bias, as the newest fit has orbit and station."""
    if fit is None:
        seen = look_at(source, tai_s, site)
    else:
        seen = look_at(source.corrected(fit.correction), tai_s, moved_site(site, fit.station_shift_enu_m))
    return seen.az_deg, seen.el_deg


def part_of(readings: Readings, begin: int, end: int) -> Readings:
    """Readings from begin to before end."""
    return Readings(readings.tai_s[begin:end], readings.az_deg[begin:end], readings.el_deg[begin:end])
