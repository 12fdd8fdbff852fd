"""The `full` estimator: six orbit corrections, angle biases and the station's place, with an honest covariance."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import real_passes
from conftest import needs_data
from made_orbits import EPOCH_TAI_S, circular, site, visible
from real_passes import noisy, sky_angles_deg

from acu_daemon.assist import mount_model
from acu_daemon.assist.estimators.full.estimated_states import (
    STATE_COUNT,
    STEPS,
    bias_of,
    correction_of,
    make_prior,
    shift_of,
    states_of,
)
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator, shift_for_people
from acu_daemon.assist.estimators.full.path_partials import (
    moved_site,
    node_times,
    orbit_partials_itrs,
    path_itrs,
    sky_partials,
)
from acu_daemon.assist.mount_model import encoder_look, sigma_deg, sky_covariance
from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION
from acu_daemon.assist.session.prediction import predict
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings, StateSigmas
from acu_daemon.model import AngleBias, AxisLimits, Correction, Readings
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DEG

ISS = """ISS (ZARYA)
1 25544U 98067A   19343.69339541  .00001764  00000-0  38792-4 0  9991
2 25544  51.6439 211.2001 0007417  17.6667  85.6398 15.50103472202482
"""
TRUE = Correction(0.008 * DEG, -0.3 * DEG, 3e-9, 3e-5, -2e-5, 0.004 * DEG)
BIAS = AngleBias(az_deg=0.05, el_deg=-0.04)
SIGMA_DEG = 0.03
SETTINGS = EstimatorSettings(SIGMA_DEG, SIGMA_DEG, orbit_sigmas=ElementSigmas())
WORST_REAL_DEG = 0.035
MEDIAN_REAL_DEG = 0.015


def _iss() -> Sgp4Propagator:
    (elements,), _ = parse_tle(ISS, "test")
    return Sgp4Propagator(elements)


def _part(readings, start, end):
    return Readings(readings.tai_s[start:end], readings.az_deg[start:end], readings.el_deg[start:end])


def _shown(truth, where, tai_s, bias=BIAS):
    """What the encoders show of the truth: azimuth, elevation."""
    seen = look_at(truth, tai_s, where)
    return seen.az_deg + bias.az_deg, seen.el_deg + bias.el_deg


def _fit(source, where, readings, settings=SETTINGS):
    estimator = FullEstimator(source, where, settings)
    estimator.add(readings)
    fit = estimator.fit()
    assert fit is not None
    return fit


def _errors_deg(source, where, fit, tai_s, az_deg, el_deg):
    seen = encoder_look(source.corrected(fit.correction), tai_s, where, fit)
    return sky_angles_deg(seen.az_deg, seen.el_deg, az_deg, el_deg)


# Corrections of the sources


def test_a_correction_of_an_element_set_is_the_set_with_other_elements():
    iss = _iss()
    e = iss.elements
    moved = iss.corrected(Correction(1e-3, 2e-3, 3e-9, 0.0, 0.0, 4e-4))
    other = replace(
        e,
        raan_rad=e.raan_rad + 1e-3,
        mean_anomaly_rad=e.mean_anomaly_rad + 2e-3,
        mean_motion_rad_s=e.mean_motion_rad_s + 3e-9,
        inclination_rad=e.inclination_rad + 4e-4,
    )
    tai_s = e.epoch_tai_s + np.arange(0.0, 90000.0, 3000.0)
    assert np.allclose(moved.states_teme(tai_s)[0], Sgp4Propagator(other).states_teme(tai_s)[0], rtol=0, atol=1e-3)


@pytest.mark.parametrize("source", [_iss(), circular(98.6, 0.0), circular(23.8, 0.0436)])
def test_a_change_of_the_eccentricity_vector_leaves_the_mean_place_on_the_orbit_where_it_is(source):
    """The distance swings by a de, 7000 km x 1e-4 = 0.7 km, and the place along the track by twice that."""
    moved = source.corrected(Correction(delta_e_cos_argp=1e-4))
    tai_s = source.epoch_tai_s + np.arange(0.0, 6000.0, 60.0)
    (r0, v0), (r1, _) = source.states_teme(tai_s), moved.states_teme(tai_s)
    a_m = float(osculating_from_state(r0, v0).a_m.mean())
    radial = np.sum((r1 - r0) * r0, axis=1) / np.linalg.norm(r0, axis=1)
    along = np.sum((r1 - r0) * v0, axis=1) / np.linalg.norm(v0, axis=1)
    assert np.ptp(radial) / 2 == pytest.approx(1e-4 * a_m, rel=0.15)
    assert np.ptp(along) / 2 == pytest.approx(2e-4 * a_m, rel=0.15)
    assert abs(along.mean()) < 0.2e-4 * a_m


def test_a_higher_mean_motion_lowers_a_brouwer_orbit_by_keplers_third_law():
    source = circular(98.6, 0.0)
    n_rad_s = np.sqrt(3.986004418e14 / 7180e3**3)
    r_m, _ = source.corrected(Correction(delta_mean_motion_rad_s=1e-4 * n_rad_s)).states_teme(np.array([EPOCH_TAI_S]))
    assert np.linalg.norm(r_m) == pytest.approx(7180e3 * (1.0 - 2e-4 / 3.0), abs=1.0)


def test_a_correction_survives_pickling_and_no_correction_gives_the_source_itself():
    tai_s = np.array([EPOCH_TAI_S + 500.0])
    for source in (_iss(), circular(66.0, 0.001)):
        again = pickle.loads(pickle.dumps(source.corrected(TRUE)))
        assert (again.states_teme(tai_s)[0] == source.corrected(TRUE).states_teme(tai_s)[0]).all()
        assert (again.corrected(Correction()).states_teme(tai_s)[0] == source.states_teme(tai_s)[0]).all()


# Partials and the encoder frame


def test_partials_are_what_small_changes_of_every_state_do_to_the_directions():
    source, where = circular(66.0, 0.01), site(6.0, 10.0)
    tai_s = visible(source, where, 40.0)
    nodes, zero = node_times(tai_s[0], tai_s[-1]), np.zeros(STATE_COUNT)
    path, partials = orbit_partials_itrs(source, zero, where, nodes)
    h = sky_partials(path.at(tai_s), partials.at(tai_s), where, True)
    steps = np.concatenate((10.0 * np.array(STEPS), np.full(4, 1e-4), np.full(3, 100.0), np.full(4, 1e-4)))
    plain = look_at(source, tai_s, where)
    for k, step in enumerate(steps):
        x = zero.copy()
        x[k] = step
        fit = replace(
            _fit(source, where, Readings(tai_s[:1], plain.az_deg[:1], plain.el_deg[:1])),
            bias=bias_of(x),
            station_shift_enu_m=shift_of(x),
        )
        seen = encoder_look(source.corrected(correction_of(x)), tai_s, where, fit)
        across = (seen.az_deg - plain.az_deg + 180.0) % 360.0 - 180.0
        assert np.allclose(across * np.cos(plain.el_deg * DEG) * DEG / step, h[k, 0], rtol=0.02, atol=1e-8), k
        assert np.allclose((seen.el_deg - plain.el_deg) * DEG / step, h[k, 1], rtol=0.02, atol=1e-8), k


def test_the_path_between_nodes_is_the_propagators():
    source, where = _iss(), site()
    tai_s = source.epoch_tai_s + np.arange(0.0, 900.0, 7.3)
    x = np.zeros(STATE_COUNT)
    curve = path_itrs(source, x, where, node_times(tai_s[0], tai_s[-1]))
    exact, _ = itrs_from_teme(*source.states_teme(tai_s), tai_s, where.orientation)
    assert np.abs(curve.at(tai_s) - exact.T).max() < 0.03  # metres


def test_rates_in_the_encoder_frame_are_those_of_the_angles():
    source, where = circular(), site()
    tai_s = visible(source, where, 0.1)
    fit = _fit(source, where, Readings(tai_s[:1], *(x[:1] for x in _shown(source, where, tai_s))))
    fit = replace(fit, bias=AngleBias(0.05, 0.05, -0.04, 0.05, 0.02, -0.03, 0.04, 0.03))
    seen, plain = encoder_look(source, tai_s, where, fit), look_at(source, tai_s, where)
    bias_el_deg, bias_az_deg = seen.el_deg - plain.el_deg, (seen.az_deg - plain.az_deg + 180.0) % 360.0 - 180.0
    bias_el_rate, bias_az_rate = seen.el_rate_deg_s - plain.el_rate_deg_s, seen.az_rate_deg_s - plain.az_rate_deg_s
    assert np.allclose(np.gradient(bias_el_deg, 0.1)[1:-1], bias_el_rate[1:-1], rtol=0.01, atol=1e-6)
    assert np.allclose(np.gradient(bias_az_deg, 0.1)[1:-1], bias_az_rate[1:-1], rtol=0.01, atol=1e-6)


def test_a_moved_station_sees_its_vertical_turn():
    """6 km to the north, 6378 km from the centre: the vertical turns by 0.0539 degrees."""
    moved = moved_site(site(3.0, 10.0), (0.0, 6000.0, 0.0)).station
    assert moved.latitude_deg - 10.0 == pytest.approx(0.0539, abs=1e-4)


# The estimate


@pytest.mark.parametrize("source", [_iss(), circular(66.0, 0.001), circular(98.6, 0.0), circular(23.8, 0.0436)])
def test_readings_without_noise_give_back_the_orbit(source):
    where = site(4.0) if source.kind == "brouwer" else site(*_below(source))
    truth = source.corrected(TRUE)
    tai_s = visible(truth, where, 1.0) if source.kind == "brouwer" else _around_epoch(truth, where)
    az_deg, el_deg = _shown(truth, where, tai_s)
    half = tai_s.size // 2
    fit = _fit(source, where, _part(Readings(tai_s, az_deg % 360.0, el_deg), 0, half))
    assert _errors_deg(source, where, fit, tai_s, az_deg, el_deg)[:half].max() < 0.003
    assert _errors_deg(source, where, fit, tai_s, az_deg, el_deg)[half:].max() < 0.01
    assert fit.residual_rms_deg < 0.003


def _below(source):
    """Longitude and latitude where the satellite is at its epoch, two degrees aside."""
    epoch = np.array([source.epoch_tai_s])
    (r_m,), _ = itrs_from_teme(*source.states_teme(epoch), epoch, site().orientation)
    return np.degrees(np.arctan2(r_m[1], r_m[0])) + 2.0, np.degrees(np.arctan2(r_m[2], np.hypot(*r_m[:2])))


def _around_epoch(source, where):
    tai_s = source.epoch_tai_s + np.arange(-900.0, 900.0)
    return tai_s[look_at(source, tai_s, where).el_deg >= 5.0]


def test_the_result_does_not_depend_on_how_the_readings_are_cut():
    source, where = circular(66.0, 0.001), site(4.0)
    truth = source.corrected(TRUE)
    tai_s = visible(truth, where, 0.5)
    readings = noisy(*_shown(truth, where, tai_s), tai_s, SIGMA_DEG, np.random.default_rng(3))
    at_once = _fit(source, where, readings)
    estimator, k, rng = FullEstimator(source, where, SETTINGS), 0, np.random.default_rng(4)
    while k < len(readings):
        step = int(rng.integers(1, 60))
        estimator.add(_part(readings, k, k + step))
        in_parts = estimator.fit()
        k += step
    one = encoder_look(source.corrected(at_once.correction), tai_s, where, at_once)
    assert _errors_deg(source, where, in_parts, tai_s, one.az_deg, one.el_deg).max() < 1e-5
    assert in_parts.reading_count == at_once.reading_count


def test_elements_300_km_off_are_found_from_half_a_pass_at_once():
    """Overhead, where the first guess is tens of degrees beside the readings and must not pass for noise."""
    source, where = circular(82.0, 0.001, 6888.0), site(-0.7, -8.0)
    truth = source.corrected(replace(TRUE, delta_mean_anomaly_rad=-2.4 * DEG))
    tai_s = visible(truth, where, 1.0)
    az_deg, el_deg = _shown(truth, where, tai_s)
    half = tai_s.size // 2
    readings = _part(noisy(az_deg, el_deg, tai_s, SIGMA_DEG, np.random.default_rng(8)), 0, half)
    fit = _fit(source, where, readings)
    assert _errors_deg(source, where, fit, tai_s, az_deg, el_deg)[half:].max() < WORST_REAL_DEG
    assert fit.reading_count == np.count_nonzero(readings.el_deg <= SETTINGS.max_fit_elevation_deg)


def test_a_bias_of_the_encoders_goes_into_the_commands():
    source, where = circular(66.0, 0.001), site(4.0)
    truth = source.corrected(TRUE)
    tai_s = visible(truth, where, 1.0)
    az_deg, el_deg = _shown(truth, where, tai_s)
    readings = noisy(az_deg, el_deg, tai_s, SIGMA_DEG, np.random.default_rng(5))
    fit = _fit(source, where, _part(readings, 0, len(readings) // 2))
    corrected = source.corrected(fit.correction)
    buffer = predict(corrected, where, tai_s[-200], tai_s[0], "FITTED", az_deg[-200], horizon_s=60.0, fit=fit)
    point = buffer.at(tai_s[-150])
    assert point is not None
    assert point.el_deg == pytest.approx(el_deg[-150], abs=0.03)
    assert fit.bias.el_deg == pytest.approx(BIAS.el_deg, abs=0.03)


def test_a_station_whose_place_is_in_question_is_moved_to_where_the_readings_put_it():
    """The station's place and the orbit's look alike; together they give the right directions."""
    source, given = circular(23.8, 0.0436), site(4.0)
    real = moved_site(given, (5000.0, -4000.0, 0.0))
    tai_s = visible(source, real, 1.0)
    az_deg, el_deg = _shown(source, real, tai_s, AngleBias())
    readings = noisy(az_deg, el_deg, tai_s, SIGMA_DEG, np.random.default_rng(6))
    half = tai_s.size // 2
    worst = []
    for station_sigma_m in (0.0, 5000.0):
        settings = replace(SETTINGS, station_sigma_m=station_sigma_m, orbit_sigmas=StateSigmas(100.0, 0.1))
        fit = _fit(source, given, _part(readings, 0, half), settings)
        worst.append(_errors_deg(source, given, fit, tai_s, az_deg, el_deg)[half:].max())
    assert worst[1] < 0.03 < worst[0]


def test_wild_readings_are_left_out_and_counted():
    source, where = circular(66.0, 0.001), site(4.0)
    truth = source.corrected(TRUE)
    tai_s = visible(truth, where, 1.0)
    az_deg, el_deg = _shown(truth, where, tai_s)
    rng = np.random.default_rng(7)
    readings = noisy(az_deg, el_deg, tai_s, SIGMA_DEG, rng)
    wild = rng.random(tai_s.size) < 0.15
    dirty = Readings(tai_s, (readings.az_deg + 3.0 * wild) % 360.0, readings.el_deg + 2.0 * wild)
    half = tai_s.size // 2
    fit = _fit(source, where, _part(dirty, 0, half))
    assert fit.rejected_count == np.count_nonzero(wild[:half])
    assert fit.reading_count + fit.rejected_count == half
    assert _errors_deg(source, where, fit, tai_s, az_deg, el_deg)[half:].max() < 0.06


def test_readings_above_the_highest_elevation_for_fits_are_not_used():
    source, where = circular(66.0, 0.001), site(1.0)
    tai_s = visible(source, where, 1.0)
    az_deg, el_deg = _shown(source, where, tai_s, AngleBias())
    high = el_deg > 60.0
    assert high.any()
    settings = replace(SETTINGS, max_fit_elevation_deg=60.0)
    estimator = FullEstimator(source, where, settings)
    estimator.add(Readings(tai_s, (az_deg + 20.0 * high) % 360.0, el_deg))
    fit = estimator.fit()
    assert fit is not None
    assert _errors_deg(source, where, fit, tai_s, az_deg, el_deg)[~high].max() < 0.01
    assert {one.reason for one in estimator.rejected} == {ABOVE_MAX_ELEVATION}
    assert fit.rejected_count == np.count_nonzero(high)


def test_the_correction_is_shown_as_seconds_and_degrees():
    source, where = circular(98.6, 0.0), site(0.0)
    n_rad_s = np.sqrt(3.986004418e14 / 7180e3**3)
    along_s, across_deg = shift_for_people(source, Correction(0.0, 2.5 * n_rad_s), EPOCH_TAI_S, where)
    assert along_s == pytest.approx(-2.5, rel=1e-3)
    assert abs(across_deg) < 1e-6
    _, across_deg = shift_for_people(source, Correction(0.01 * DEG), EPOCH_TAI_S, where)
    assert across_deg == pytest.approx(0.01 * np.sin(98.6 * DEG) * 7180.0 / (7180.0 - 6378.137 - 0.1), rel=1e-2)


# The covariance


def test_the_prior_of_a_state_is_that_state_in_elements():
    """At the node the velocity tilts the plane and the position turns it; 1 m/s faster is 2 a dv / v higher."""
    source = circular(66.0, 0.0)
    settings = EstimatorSettings(orbit_sigmas=StateSigmas(1.0, 3.0))
    sigma = np.sqrt(np.diag(make_prior(source, settings, EPOCH_TAI_S).covariance))
    v_m_s = 7180e3 * np.sqrt(3.986004418e14 / 7180e3**3)
    assert sigma[5] == pytest.approx(3.0 / v_m_s, rel=0.01)
    assert sigma[0] == pytest.approx(1.0 / 7180e3 / np.sin(66.0 * DEG), rel=0.01)
    assert sigma[2] == pytest.approx(3.0 * 3.0 / v_m_s * np.sqrt(3.986004418e14 / 7180e3**3), rel=0.01)


@pytest.mark.long
def test_errors_lie_inside_the_ellipses_as_often_as_they_should():
    source, inside = circular(66.0, 0.001), []
    for run in range(60):
        rng = np.random.default_rng(run)
        where = site(rng.uniform(-9.0, 9.0), rng.uniform(-40.0, 40.0))
        covariance = make_prior(source, SETTINGS, EPOCH_TAI_S).covariance
        truth = source.corrected(correction_of(0.3 * np.linalg.cholesky(covariance[:6, :6]) @ rng.normal(size=6)))
        bias = AngleBias(az_deg=0.1 * rng.normal(), el_deg=0.1 * rng.normal())
        tai_s = visible(truth, where, 2.0)
        if tai_s.size < 60:
            continue
        az_deg, el_deg = _shown(truth, where, tai_s, bias)
        half = tai_s.size // 2
        fit = _fit(source, where, _part(noisy(az_deg, el_deg, tai_s, SIGMA_DEG, rng), 0, half))
        corrected = source.corrected(fit.correction)
        seen = encoder_look(corrected, tai_s[half:], where, fit)
        d_az = ((seen.az_deg - az_deg[half:] + 180.0) % 360.0 - 180.0) * np.cos(el_deg[half:] * DEG) * DEG
        d_el = (seen.el_deg - el_deg[half:]) * DEG
        c, b, e = sky_covariance(corrected, tai_s[half:], where, fit)
        distance2 = (d_az**2 * e - 2.0 * b * d_az * d_el + d_el**2 * c) / (c * e - b * b)
        inside.append([(distance2 < 1.0).mean(), (distance2 < 4.0).mean()])
    one_sigma, two_sigma = np.mean(inside, axis=0)
    assert len(inside) > 30
    assert one_sigma == pytest.approx(0.39, abs=0.15)  # of some 40 passes; a pass counts about once
    assert two_sigma == pytest.approx(0.86, abs=0.12)


def test_a_sigma_from_partials_remembered_of_a_path_nearby_is_that_of_the_path(monkeypatch):
    source, where = circular(66.0, 0.001), site(4.0)
    tai_s = visible(source, where, 1.0)
    fit = _fit(source, where, Readings(tai_s[:200], *(one[:200] for one in _shown(source, where, tai_s))))
    corrections = [
        Correction(*(states_of(fit.correction, fit.bias, (0.0, 0.0, 0.0))[:6] + k * np.array(STEPS)))
        for k in (-4.0, 0.0, 1.5, 4.0)
    ]
    fits = [replace(fit, correction=correction) for correction in corrections]
    seen = [sigma_deg(source.corrected(one.correction), tai_s, where, one) for one in fits]
    monkeypatch.setattr(mount_model, "_NEAR_STEPS", 1e-6 * np.array(STEPS))
    exact = [sigma_deg(source.corrected(one.correction), tai_s, where, one) for one in fits]
    assert np.allclose(seen, exact, rtol=0.01, atol=0.0)
    assert not np.array_equal(seen, exact)  # the two ways differ


def test_sigma_grows_into_the_future_and_shrinks_with_readings():
    source, where = circular(66.0, 0.001), site(4.0)
    tai_s = visible(source, where, 1.0)
    readings = Readings(tai_s, *_shown(source, where, tai_s, AngleBias()))
    ahead = tai_s[400:600]
    few, many = (_fit(source, where, _part(readings, 0, n)) for n in (100, 400))
    wide, narrow = (sigma_deg(source.corrected(fit.correction), ahead, where, fit) for fit in (few, many))
    assert (narrow < wide / 3.0).all()
    assert narrow[-1] > narrow[0]


def test_a_prediction_carries_its_sigma_from_the_refit_on():
    source, where = circular(66.0, 0.001), site(4.0)
    tai_s = visible(source, where, 1.0)[:60]
    readings = Readings(tai_s, *_shown(source, where, tai_s, AngleBias()))
    setup = RefitSetup(source, where, "full", SETTINGS, AxisLimits(-270.0, 270.0, 20.0, 10.0))
    refitter = Refitter(setup)
    nothing = Readings(np.empty(0), np.empty(0), np.empty(0))
    before = refitter.refit(RefitRequest(nothing, tai_s[0], 90.0, tai_s[0], 180.0))
    assert before.fit is None
    assert before.prediction.sigma_deg is None
    reply = pickle.loads(pickle.dumps(refitter.refit(RefitRequest(readings, tai_s[-1], 90.0, tai_s[-1], 180.0))))
    assert reply.fit.estimator == "full"
    assert reply.prediction.sigma_deg.shape == reply.prediction.az_deg.shape
    assert (reply.prediction.sigma_deg > 0.0).all()


# Real passes


def _real(name):
    real = real_passes.load(name)
    (elements,), _ = parse_tle(real.tle_path.read_text(), real.tle_path.name)
    return real, elements


def _unseen_half_deg(real, source, bias, seed):
    az_deg, el_deg = real.sky(real.tai_s)
    az_deg, el_deg = az_deg + bias.az_deg, el_deg + bias.el_deg
    half = real.tai_s.size // 2
    readings = noisy(az_deg, el_deg, real.tai_s, SIGMA_DEG, np.random.default_rng(seed))
    fit = _fit(source, real.site, _part(readings, 0, half))
    return _errors_deg(source, real.site, fit, real.tai_s, az_deg, el_deg)[half:].max()


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("bias", [AngleBias(), BIAS])
def test_after_half_of_a_real_pass_the_other_half_is_predicted(bias):
    worst = []
    for name in real_passes.names():
        real, elements = _real(name)
        worst += [_unseen_half_deg(real, Sgp4Propagator(elements), bias, seed) for seed in range(3)]
    assert max(worst) < WORST_REAL_DEG
    assert np.median(worst) < MEDIAN_REAL_DEG


@needs_data
@pytest.mark.parametrize("along_s", [-12.0, 12.0])
def test_elements_90_km_off_along_the_track_are_as_good_as_right_ones(along_s):
    worst = []
    for name in real_passes.names():
        real, e = _real(name)
        wrong = replace(
            e,
            mean_anomaly_rad=e.mean_anomaly_rad + along_s * e.mean_motion_rad_s,
            raan_rad=e.raan_rad + 0.03 * DEG,
        )
        worst.append(_unseen_half_deg(real, Sgp4Propagator(wrong), BIAS, 1))
    assert max(worst) < WORST_REAL_DEG
    assert np.median(worst) < MEDIAN_REAL_DEG
