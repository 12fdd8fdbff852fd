"""assist.estimators.estimator: what all estimators do, and the two that average inversions."""

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site, visible
from real_passes import noisy, sky_angles_deg

from acu_daemon.assist.estimators.estimator import ESTIMATORS, EstimatorSettings, make_estimator
from acu_daemon.assist.estimators.estimator_base import for_people
from acu_daemon.assist.estimators.inversion import BEYOND_LATITUDE
from acu_daemon.errors import UsageError
from acu_daemon.model import Correction, Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DEG

TRUE = Correction(0.05 * DEG, -0.3 * DEG)
SETTINGS = EstimatorSettings(0.03, 0.03)


def _readings(source, where, sigma_deg=0.0, step_s=1.0):
    truth = source.corrected(TRUE)
    tai_s = visible(truth, where, step_s)
    seen = look_at(truth, tai_s, where)
    return noisy(seen.az_deg, seen.el_deg, tai_s, sigma_deg, np.random.default_rng(5))


def _part(readings, start, end):
    return Readings(readings.tai_s[start:end], readings.az_deg[start:end], readings.el_deg[start:end])


@pytest.mark.parametrize("name", ["deterministic", "kalman"])
@pytest.mark.parametrize(("i_deg", "e"), [(23.8, 0.0436), (66.0, 0.001), (98.6, 0.0001), (144.0, 0.02)])
@pytest.mark.parametrize("is_descending", [False, True])
def test_readings_without_noise_give_back_the_true_correction(name, i_deg, e, is_descending):
    source, where = circular(i_deg, e, is_descending=is_descending), site()
    estimator = make_estimator(name, source, where, SETTINGS)
    estimator.add(_readings(source, where))
    fit = estimator.fit()
    assert fit is not None
    assert fit.correction.delta_raan_rad == pytest.approx(TRUE.delta_raan_rad, abs=1e-5 * DEG)
    assert fit.correction.delta_mean_anomaly_rad == pytest.approx(TRUE.delta_mean_anomaly_rad, abs=1e-5 * DEG)
    assert fit.residual_rms_deg < 1e-4


@pytest.mark.parametrize("is_descending", [False, True])
def test_circular_gives_back_the_true_correction_of_a_circular_orbit_all_along_it(is_descending):
    source, where = circular(66.0, 0.0, is_descending=is_descending), site()
    estimator = make_estimator("circular", source, where, SETTINGS)
    readings = _readings(source, where)
    for start in range(0, len(readings), 8):
        estimator.add(_part(readings, start, start + 8))
        fit = estimator.fit()
        assert fit is not None
        assert fit.correction.delta_raan_rad == pytest.approx(TRUE.delta_raan_rad, abs=2e-4 * DEG)
        assert fit.correction.delta_mean_anomaly_rad == pytest.approx(TRUE.delta_mean_anomaly_rad, abs=2e-4 * DEG)


def test_circular_averages_the_last_eight_inversions_and_needs_three():
    source, where = circular(66.0, 0.0), site()
    readings = _readings(source, where, sigma_deg=0.03)
    long, short = (make_estimator("circular", source, where, SETTINGS) for _ in range(2))
    short.add(_part(readings, 100, 102))
    assert short.fit() is None
    short.add(_part(readings, 102, 108))
    long.add(_part(readings, 0, 108))
    a, b = long.fit(), short.fit()
    assert a is not None and b is not None
    assert a.correction.delta_raan_rad == pytest.approx(b.correction.delta_raan_rad, abs=1e-12)
    assert a.reading_count == 108


def test_the_running_mean_is_the_mean_whatever_the_batches():
    source, where = circular(66.0, 0.001), site()
    readings = _readings(source, where, sigma_deg=0.03)
    one, many = (make_estimator("deterministic", source, where, SETTINGS) for _ in range(2))
    one.add(readings)
    for k in range(0, len(readings), 7):
        many.add(_part(readings, k, k + 7))
    a, b = one.fit(), many.fit()
    assert a is not None and b is not None
    assert a.correction.delta_mean_anomaly_rad == pytest.approx(b.correction.delta_mean_anomaly_rad, abs=1e-9)


@pytest.mark.parametrize("name", ["circular", "deterministic"])
def test_readings_that_cannot_be_inverted_are_counted_with_their_reason(name):
    source, where = circular(30.0, 0.0), site(longitude_deg=85.0, latitude_deg=33.0)
    truth_s = EPOCH_TAI_S + np.arange(1300.0, 1600.0)
    seen = look_at(source, truth_s, where)
    readings = Readings(truth_s, seen.az_deg, seen.el_deg + 0.3)
    readings = _part(readings, *(np.flatnonzero(seen.el_deg > 10.0)[[0, -1]]))
    estimator = make_estimator(name, source, where, SETTINGS)
    estimator.add(readings)
    fit = estimator.fit()
    refused = [r for r in estimator.rejected if r.reason == BEYOND_LATITUDE]
    assert refused
    assert fit is None or fit.rejected_count == len(estimator.rejected)


@pytest.mark.parametrize("name", list(ESTIMATORS))
def test_before_any_reading_there_is_no_fit(name):
    estimator = make_estimator(name, circular(), site(), SETTINGS)
    assert estimator.fit() is None
    estimator.add(Readings(np.array([]), np.array([]), np.array([])))
    assert estimator.fit() is None


def test_an_unknown_estimator_is_refused_with_the_names_that_exist():
    with pytest.raises(UsageError, match="expected one of circular, deterministic, kalman, full"):
        make_estimator("best", circular(), site(), SETTINGS)


def test_a_satellite_ahead_of_its_elements_is_early_by_the_time_it_gains():
    source, where = circular(51.6, 0.0), site()
    n_rad_s = np.sqrt(3.986004418e14 / 7180e3**3)
    along_s, across_deg = for_people(source, Correction(0.0, 2.5 * n_rad_s), EPOCH_TAI_S, where)
    assert along_s == pytest.approx(-2.5, rel=1e-6)
    assert across_deg == 0.0


def test_a_node_further_east_puts_a_northbound_satellite_to_the_right():
    """Overhead at 802 km a shift across of a d_raan sin i is seen under that over the height."""
    source, where = circular(90.0, 0.0), site(longitude_deg=0.0)
    _, across_deg = for_people(source, Correction(0.01 * DEG, 0.0), EPOCH_TAI_S, where)
    assert across_deg == pytest.approx(0.01 * 7180.0 / (7180.0 - 6378.137 - 0.1), rel=1e-3)


def test_the_angle_across_is_what_a_station_sees():
    source, where = circular(66.0, 0.0), site(longitude_deg=8.0)
    correction = Correction(0.02 * DEG, -np.cos(np.radians(66.0)) * 0.02 * DEG)  # across only: the shift along undone
    _, across_deg = for_people(source, correction, EPOCH_TAI_S, where)
    at = np.array([EPOCH_TAI_S])
    old, new = look_at(source, at, where), look_at(source.corrected(correction), at, where)
    angle = sky_angles_deg(old.az_deg, old.el_deg, new.az_deg, new.el_deg)[0]
    assert abs(across_deg) == pytest.approx(angle, rel=2e-3)
