"""assist.estimators.kalman: Kuga and Carrara 1988, section 4."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_orbits import circular, site, visible
from real_passes import noisy

from acu_daemon.assist.estimators.estimator import EstimatorSettings, make_estimator
from acu_daemon.assist.estimators.kalman import Estimate, KalmanEstimator, initial_estimate, linearise, update
from acu_daemon.assist.reading_gate import OUTLIER
from acu_daemon.assist.settings import DAEMON, PAPER, KalmanTuning
from acu_daemon.model import Correction, Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DEG

SIGMA_DEG = 0.03
SETTINGS = EstimatorSettings(SIGMA_DEG, SIGMA_DEG)
STATIC = KalmanTuning(0.2, 2.0, 0.0, 0.0)  # without process noise
TRUE = Correction(0.05 * DEG, -0.3 * DEG)
BATCHING_DEG = 1e-4


def _readings(source, where, seed=5, step_s=0.1, sigma_deg=SIGMA_DEG):
    truth = source.corrected(TRUE)
    tai_s = visible(truth, where, step_s)
    seen = look_at(truth, tai_s, where)
    return noisy(seen.az_deg, seen.el_deg, tai_s, sigma_deg, np.random.default_rng(seed))


def _part(readings, start, end):
    return Readings(readings.tai_s[start:end], readings.az_deg[start:end], readings.el_deg[start:end])


def _kalman(source, where, tuning=DAEMON):
    return KalmanEstimator(source, where, EstimatorSettings(SIGMA_DEG, SIGMA_DEG, kalman=tuning))


@pytest.mark.parametrize(("i_deg", "e"), [(23.8, 0.0436), (66.0, 0.001), (98.6, 0.0001), (144.0, 0.05)])
def test_the_partials_are_the_differences_of_the_angles(i_deg, e):
    """Eqs 4.8-4.11 against central differences of the look angles."""
    source, where = circular(i_deg, e), site(5.0, 3.0)
    tai_s = visible(source, where, 60.0)
    line = linearise(source, 0.0, 0.0, tai_s, where)
    h = 1e-5
    for by_az, by_el, plus, minus in (
        (line.az_by_raan, line.el_by_raan, Correction(h, 0.0), Correction(-h, 0.0)),
        (line.az_by_mean_anomaly, line.el_by_mean_anomaly, Correction(0.0, h), Correction(0.0, -h)),
    ):
        after, before = (look_at(source.corrected(c), tai_s, where) for c in (plus, minus))
        d_az = np.radians((after.az_deg - before.az_deg + 180.0) % 360.0 - 180.0) / (2 * h)
        d_el = np.radians(after.el_deg - before.el_deg) / (2 * h)
        assert np.allclose(by_az, d_az, rtol=1e-5, atol=1e-5)
        assert np.allclose(by_el, d_el, rtol=1e-5, atol=1e-5)


def test_the_predicted_angles_are_the_look_angles():
    source, where = circular(), site()
    tai_s = visible(source, where, 30.0)
    line = linearise(source, TRUE.delta_raan_rad, TRUE.delta_mean_anomaly_rad, tai_s, where)
    seen = look_at(source.corrected(TRUE), tai_s, where)
    assert np.allclose(np.degrees(line.az) % 360.0, seen.az_deg, atol=1e-9)
    assert np.allclose(np.degrees(line.el), seen.el_deg, atol=1e-9)


@given(
    h=st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)),
    observed=st.floats(-1.0, 1.0),
    variance=st.floats(1e-4, 1.0),
    p_rm=st.floats(-0.5, 0.5),
)
def test_one_update_is_the_matrix_formula_of_the_textbook(h, observed, variance, p_rm):
    """Jazwinski 1970: K = P H^T (H P H^T + R)^-1, x + K (y - H x), P - K H P."""
    x, p, row = np.array([0.1, -0.2]), np.array([[1.0, p_rm], [p_rm, 0.5]]), np.array([h])
    k = p @ row.T @ np.linalg.inv(row @ p @ row.T + variance)
    new_x, new_p = x + k @ (observed - row @ x), p - k @ row @ p
    got = update(Estimate(0.1, -0.2, 1.0, p_rm, 0.5), h, observed, variance)
    assert np.allclose(got, [*new_x, new_p[0, 0], new_p[0, 1], new_p[1, 1]], atol=1e-9)


def test_without_process_noise_the_filter_is_least_squares_with_the_prior():
    source, where = circular(66.0, 0.01), site(6.0)
    readings = _readings(source, where, step_s=1.0)
    kalman = _kalman(source, where, STATIC)
    kalman.add(readings)
    keep = readings.el_deg <= 80.0
    x = np.zeros(2)
    for _ in range(5):
        line = linearise(source, *x, readings.tai_s[keep], where)
        az_sigma = SIGMA_DEG * DEG / np.cos(np.radians(readings.el_deg[keep]))
        d_az = (np.radians(readings.az_deg[keep]) - line.az + np.pi) % (2 * np.pi) - np.pi
        rows = [
            np.stack((line.az_by_raan, line.az_by_mean_anomaly), axis=1) / az_sigma[:, None],
            np.stack((line.el_by_raan, line.el_by_mean_anomaly), axis=1) / (SIGMA_DEG * DEG),
            np.diag([1 / (0.2 * DEG), 1 / (2.0 * DEG)]),
        ]
        left = [d_az / az_sigma, (np.radians(readings.el_deg[keep]) - line.el) / (SIGMA_DEG * DEG)]
        left.append(-x * [1 / (0.2 * DEG), 1 / (2.0 * DEG)])
        x = x + np.linalg.lstsq(np.concatenate(rows), np.concatenate(left), rcond=None)[0]
    covariance = np.linalg.inv(np.concatenate(rows).T @ np.concatenate(rows))
    estimate = kalman.state.estimate
    assert np.allclose(estimate[:2], x, atol=1e-5 * DEG)
    assert np.allclose(estimate[2:], [covariance[0, 0], covariance[0, 1], covariance[1, 1]], rtol=2e-3)


def test_the_error_is_what_the_covariance_says():
    """40 noisy passes without process noise: the mean of e^T P^-1 e is 2, its spread 2/sqrt(40)."""
    source, where = circular(66.0, 0.001), site(6.0)
    distances = []
    for seed in range(40):
        kalman = _kalman(source, where, STATIC)
        kalman.add(_part(_readings(source, where, seed, step_s=5.0), 0, 80))
        raan, mean_anomaly, p_rr, p_rm, p_mm = kalman.state.estimate
        error = np.array([raan - TRUE.delta_raan_rad, mean_anomaly - TRUE.delta_mean_anomaly_rad])
        distances.append(error @ np.linalg.inv([[p_rr, p_rm], [p_rm, p_mm]]) @ error)
    assert abs(np.mean(distances) - 2.0) < 4 * 2.0 / np.sqrt(40)


@pytest.mark.long
@settings(max_examples=12, deadline=None)
@given(cuts=st.lists(st.integers(1, 2999), max_size=40, unique=True))
def test_how_the_readings_are_cut_into_batches_does_not_matter(cuts):
    source, where = circular(), site(4.0)
    readings = _part(_readings(source, where), 0, 3000)
    whole, cut = _kalman(source, where), _kalman(source, where)
    whole.add(readings)
    edges = [0, *sorted(cuts), len(readings)]
    for start, end in zip(edges, edges[1:], strict=False):
        cut.add(_part(readings, start, end))
    _same_estimate(whole, cut)


def test_one_reading_at_a_time_gives_the_same_as_all_at_once():
    source, where = circular(), site(4.0)
    readings = _part(_readings(source, where), 0, 600)
    whole, cut = _kalman(source, where), _kalman(source, where)
    whole.add(readings)
    for k in range(len(readings)):
        cut.add(_part(readings, k, k + 1))
    _same_estimate(whole, cut)


def _same_estimate(a, b):
    assert np.allclose(a.state.estimate[:2], b.state.estimate[:2], atol=BATCHING_DEG * DEG, rtol=0.0)


@pytest.mark.parametrize("tuning", [PAPER, DAEMON])
def test_a_single_wild_reading_is_left_out_and_moves_nothing(tuning):
    source, where = circular(), site(4.0)
    readings = _part(_readings(source, where), 0, 1000)
    wild = Readings(readings.tai_s, readings.az_deg, readings.el_deg.copy())
    wild.el_deg[900] += 3.0
    clean, hit = _kalman(source, where, tuning), _kalman(source, where, tuning)
    clean.add(readings)
    hit.add(wild)
    assert [(r.tai_s, r.reason) for r in hit.rejected] == [(readings.tai_s[900], OUTLIER)]
    assert np.allclose(clean.state.estimate[:2], hit.state.estimate[:2], atol=1e-3 * DEG)


def test_readings_that_stay_elsewhere_are_believed_after_a_while():
    """A filter that converged on a wrong thing (a side lobe) must not lock the right readings out for ever."""
    source, where = circular(), site(4.0)
    readings = _part(_readings(source, where), 0, 3000)
    moved = Readings(readings.tai_s, readings.az_deg, readings.el_deg.copy())
    moved.el_deg[:1500] += 1.5
    kalman = _kalman(source, where)
    kalman.add(moved)
    assert 20 <= len(kalman.rejected) <= 60
    assert kalman.state.estimate.mean_anomaly == pytest.approx(TRUE.delta_mean_anomaly_rad, abs=0.01 * DEG)


def test_the_seeds_floor_keeps_the_covariance_open():
    """Kuga and Carrara 1988, 5.3: noise of (0.01 deg)^2 a second enters while a sigma is below 0.05 deg."""
    source, where = circular(), site(4.0)
    readings = _readings(source, where, step_s=1.0)
    seed, static = _kalman(source, where, PAPER), _kalman(source, where, STATIC)
    for kalman in (seed, static):
        kalman.add(readings)
    assert seed.state.estimate.p_mm > 30 * static.state.estimate.p_mm
    assert initial_estimate(PAPER).p_rr == pytest.approx((1.0 * DEG) ** 2)


def test_process_noise_counts_seconds_and_not_readings():
    """The same span at 1 Hz, and at 10 Hz with the noise that makes it worth the same."""
    source, where = circular(), site(4.0)
    slow, fast = _readings(source, where, step_s=1.0), _readings(source, where, step_s=0.1)
    one = KalmanEstimator(source, where, EstimatorSettings(SIGMA_DEG, SIGMA_DEG))
    ten_sigma = SIGMA_DEG * np.sqrt(10.0)
    ten = KalmanEstimator(source, where, EstimatorSettings(ten_sigma, ten_sigma))
    one.add(_part(slow, 0, 400))
    ten.add(_part(fast, 0, 4000))
    assert np.allclose(one.state.estimate[2:], ten.state.estimate[2:], rtol=0.05)


def test_the_azimuth_innovation_is_taken_the_short_way_round_north():
    source, where = circular(51.6), site(6.0, -3.0)  # from south-west over north to north-east
    readings = _readings(source, where, step_s=1.0)
    assert readings.az_deg.max() > 350.0 and readings.az_deg.min() < 10.0
    estimator = make_estimator("kalman", source, where, SETTINGS)
    estimator.add(readings)
    fit = estimator.fit()
    assert fit is not None
    assert fit.correction.delta_mean_anomaly_rad == pytest.approx(TRUE.delta_mean_anomaly_rad, abs=0.01 * DEG)
    assert fit.rejected_count == 0
