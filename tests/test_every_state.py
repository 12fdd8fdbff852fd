"""`full` with each of its states open, also those that are off by default: against a geometry of the test's own.

What the encoders show is made from vectors here: the true place on the ellipsoid with the vertical and the north that
belong to it, and the biases as docs and model.AngleBias define them; the mount's axes are the simulator's, which turn.
"""

from dataclasses import replace

import numpy as np
import pytest
from flights import demo_target
from made_orbits import EPOCH_TAI_S, circular, site, visible
from real_passes import noisy, sky_angles_deg

from acu_daemon.assist.estimators.full.estimated_states import (
    STATE_COUNT,
    bias_of,
    correction_of,
    make_prior,
    shift_of,
    states_of,
)
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.known_bias import without_bias
from acu_daemon.assist.mount_model import encoder_look, sky_covariance
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.model import Correction, FitResult, Readings
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.units import DEG

EQUATOR_M, FLATTENING = 6378137.0, 1.0 / 298.257223563  # WGS 84
E2 = FLATTENING * (2.0 - FLATTENING)
SOURCE, GIVEN = circular(66.0, 0.01), site(5.0, 20.0)
NOISE_DEG = 0.03
ORBIT_SIGMAS = {
    "raan_deg": 0.05,
    "mean_anomaly_deg": 0.3,
    "mean_motion_rad_min": 2e-5,
    "e_vector": 2e-4,
    "inclination_deg": 0.05,
}
BIAS_SIGMAS = {
    "bias_sigma_azimuth_deg": 0.11,
    "bias_sigma_azimuth_sec_deg": 0.07,
    "bias_sigma_elevation_deg": 0.13,
    "bias_sigma_elevation_cot_deg": 0.05,
}
STATION_SIGMA_M = 2000.0
ORBIT = (0.05 * DEG, 0.3 * DEG, 2e-5 / 60.0, 2e-4, 2e-4, 0.05 * DEG)
BIASES = (0.11 * DEG, 0.07 * DEG, 0.13 * DEG, 0.05 * DEG)
STATION_M = (2000.0, 2000.0, 200.0)  # heights are known ten times as well as places
MOUNT_SIGMAS_DEG = (0.08, 0.05, 0.06, 0.07)  # NPAE, AN, AW, TF
MOUNT = tuple(one * DEG for one in MOUNT_SIGMAS_DEG)
SIGMAS = np.array([*ORBIT, *BIASES, *STATION_M, *MOUNT])  # in the order of assist.estimators.full.estimated_states
NAMES = (
    *("raan", "mean anomaly", "mean motion", "e cos argp", "e sin argp", "inclination"),
    *("azimuth", "azimuth / cos h", "elevation", "elevation x cot h", "east", "north", "up"),
    *("npae", "an", "aw", "tf"),
)
OF_NAME = ("raan_deg", "mean_anomaly_deg", "mean_motion_rad_min", "e_vector", "e_vector", "inclination_deg")


def settings(states) -> EstimatorSettings:
    """Only these states may move."""
    orbit = {OF_NAME[k]: ORBIT_SIGMAS[OF_NAME[k]] for k in states if k < 6}
    closed = dict.fromkeys(ElementSigmas.__dataclass_fields__, 0.0)
    biases = {name: sigma if 6 + i in states else 0.0 for i, (name, sigma) in enumerate(BIAS_SIGMAS.items())}
    station_m = STATION_SIGMA_M if {10, 11, 12} & set(states) else 0.0
    sigmas = ElementSigmas(**closed | orbit)
    biases["mount_sigmas_deg"] = tuple(one if 13 + i in states else 0.0 for i, one in enumerate(MOUNT_SIGMAS_DEG))
    return EstimatorSettings(NOISE_DEG, NOISE_DEG, orbit_sigmas=sigmas, station_sigma_m=station_m, **biases)


def place(latitude_deg, longitude_deg, height_m):
    """Earth-fixed position, and axes east, north, up as rows."""
    lat, lon = latitude_deg * DEG, longitude_deg * DEG
    radius_m = EQUATOR_M / np.sqrt(1.0 - E2 * np.sin(lat) ** 2)
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    east = np.array([-np.sin(lon), np.cos(lon), 0.0])
    at_m = (radius_m + height_m) * up - np.array([0.0, 0.0, E2 * radius_m * np.sin(lat)])
    return at_m, np.array([east, np.cross(up, east), up])


def geodetic(at_m):
    """Latitude, longitude and height of an Earth-fixed position, by iteration."""
    x, y, z = at_m
    flat, lat = np.hypot(x, y), np.arctan2(z, np.hypot(x, y))
    for _ in range(10):
        radius_m = EQUATOR_M / np.sqrt(1.0 - E2 * np.sin(lat) ** 2)
        height_m = flat / np.cos(lat) - radius_m
        lat = np.arctan2(z, flat * (1.0 - E2 * radius_m / (radius_m + height_m)))
    return lat / DEG, np.arctan2(y, x) / DEG, height_m


def shown(x, tai_s):
    """What the encoders show of the truth with the states x: azimuth and elevation, degrees."""
    station = GIVEN.station
    at_m, axes = place(station.latitude_deg, station.longitude_deg, station.height_m)
    at_m, axes = place(*geodetic(at_m + axes.T @ x[10:13]))
    r_m, v_m_s = SOURCE.corrected(correction_of(x)).states_teme(tai_s)
    east, north, up = axes @ (itrs_from_teme(r_m, v_m_s, tai_s, GIVEN.orientation)[0] - at_m).T
    el = np.arctan2(up, np.hypot(east, north))
    az_deg = np.arctan2(east, north) / DEG + (x[6] + x[7] / np.cos(el)) / DEG
    el_deg = (el + x[8] + x[9] / np.tan(el)) / DEG
    axes_at = MountAxes(0.0, 0.0, 0.0, *(x[13:] / DEG).tolist())
    encoders = np.array([axes_at.encoders_deg(*one) for one in zip(az_deg.tolist(), el_deg.tolist(), strict=True)]).T
    return encoders[0] % 360.0, encoders[1]


def fit_of(readings, chosen):
    estimator = FullEstimator(SOURCE, GIVEN, chosen)
    estimator.add(readings)
    fit = estimator.fit()
    assert fit is not None
    return fit


def found_of(fit):
    return states_of(fit.correction, fit.bias, fit.station_shift_enu_m)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("state", range(STATE_COUNT), ids=NAMES)
def test_a_state_that_alone_is_open_is_found_with_its_sign_and_goes_into_the_prediction(state: int, sign: float):
    x = np.zeros(STATE_COUNT)
    x[state] = sign * SIGMAS[state]
    tai_s = visible(SOURCE, GIVEN, 1.0)
    az_deg, el_deg = shown(x, tai_s)
    assert el_deg.min() < 7.0
    assert el_deg.max() > 60.0
    fit = fit_of(Readings(tai_s, az_deg, el_deg), settings({state}))
    found = found_of(fit)
    others = [k for k in range(STATE_COUNT) if k != state]
    assert found[state] == pytest.approx(x[state], rel=0.05)
    assert np.abs(found[others] / SIGMAS[others]).max() < 0.05
    seen = encoder_look(SOURCE.corrected(fit.correction), tai_s, GIVEN, fit)
    assert sky_angles_deg(seen.az_deg, seen.el_deg, az_deg, el_deg).max() < 0.002


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("state", [*range(6, 10), *range(13, 17)], ids=lambda one: NAMES[one])
def test_a_bias_that_is_known_alone_is_taken_away_with_its_sign(state: int, sign: float):
    x = np.zeros(STATE_COUNT)
    x[state] = sign * SIGMAS[state]
    tai_s = visible(SOURCE, GIVEN, 1.0)
    seen = encoder_look(SOURCE, tai_s, GIVEN, None)
    fit = FitResult("full", Correction(), float(tai_s[0]), 9, 0, 0.0, 0.0, 0.0, bias=bias_of(x))
    shown_at = encoder_look(SOURCE, tai_s, GIVEN, fit)
    left = without_bias(Readings(tai_s, shown_at.az_deg, shown_at.el_deg), fit.bias, GIVEN, seen.range_m)
    added_deg = sky_angles_deg(shown_at.az_deg, shown_at.el_deg, seen.az_deg, seen.el_deg).max()
    assert added_deg > 0.02
    assert sky_angles_deg(left.az_deg, left.el_deg, seen.az_deg, seen.el_deg).max() < 0.2 * added_deg  # to its square


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("state", [*range(6, 10), *range(13, 17)], ids=lambda one: NAMES[one])
def test_a_bias_that_alone_is_open_is_found_with_its_sign_from_beyond_the_zenith(state: int, sign: float):
    x = np.zeros(STATE_COUNT)
    x[state] = sign * SIGMAS[state]
    tai_s = visible(SOURCE, GIVEN, 1.0)
    truth = FitResult("full", Correction(), float(tai_s[0]), 9, 0, 0.0, 0.0, 0.0, bias=bias_of(x))
    beyond = encoder_look(SOURCE, tai_s, GIVEN, truth, is_plunged=True)
    assert beyond.el_deg.min() > 90.0
    found = found_of(fit_of(Readings(tai_s, beyond.az_deg, beyond.el_deg), settings({state})))
    assert found[state] == pytest.approx(x[state], rel=0.05)


@pytest.mark.parametrize("uncertainty_m", [0.0, 30.0, 1000.0])
def test_how_well_a_station_is_known_is_shared_by_east_and_north_and_little_of_it_is_up(uncertainty_m: float):
    target = demo_target(station={"uncertainty_m": uncertainty_m})
    covariance = make_prior(SOURCE, estimator_settings(target.station, target.satellite), EPOCH_TAI_S).covariance
    east_m, north_m, up_m = np.sqrt(np.diag(covariance))[10:13]
    assert np.hypot(east_m, north_m) == pytest.approx(uncertainty_m)
    assert (east_m, up_m) == pytest.approx((north_m, 0.1 * north_m))


def test_every_sigma_of_a_survey_goes_to_its_own_state():
    surveyed = {f"{name}_sigma_deg": 0.01 * k for k, name in enumerate(("ia", "ca", "ie", "npae", "an", "aw", "tf"), 1)}
    target = demo_target(mount=surveyed)
    covariance = make_prior(SOURCE, estimator_settings(target.station, target.satellite), EPOCH_TAI_S).covariance
    states = [6, 7, 8, 13, 14, 15, 16]
    assert np.sqrt(np.diag(covariance))[states] / DEG == pytest.approx(list(surveyed.values()))


def test_every_sigma_goes_to_its_own_state():
    covariance = make_prior(SOURCE, settings(range(STATE_COUNT)), EPOCH_TAI_S).covariance
    assert np.allclose(np.sqrt(np.diag(covariance)), SIGMAS, rtol=1e-9)
    assert np.count_nonzero(covariance) == STATE_COUNT


@pytest.mark.parametrize("states", [{1}, {0, 5, 8}, set(range(STATE_COUNT))], ids=len)
def test_a_root_of_a_covariance_makes_it_again(states: set[int]):
    prior = make_prior(SOURCE, settings(states), EPOCH_TAI_S)
    mixed = np.linalg.qr(np.random.default_rng(1).normal(size=(STATE_COUNT, STATE_COUNT)))[0]
    sigma = np.sqrt(np.diag(prior.covariance))
    prior = replace(
        prior, covariance=np.outer(sigma, sigma) * (mixed @ np.diag(np.linspace(0.1, 2.0, STATE_COUNT)) @ mixed.T)
    )
    scale = np.where(sigma > 0.0, sigma, 1.0)
    assert prior.root.shape == (STATE_COUNT, len(states))
    assert np.allclose(prior.root @ prior.root.T / np.outer(scale, scale), prior.covariance / np.outer(scale, scale))


def test_states_are_taken_apart_and_put_together_in_one_order():
    x = np.arange(1.0, STATE_COUNT + 1.0)
    assert np.allclose(states_of(correction_of(x), bias_of(x), shift_of(x)), x)
    bias, shift_m = bias_of(x), shift_of(x)
    assert np.allclose(np.array([bias.az_deg, bias.az_sec_deg, bias.el_deg, bias.el_cot_deg]) * DEG, x[6:10])
    assert shift_m == (11.0, 12.0, 13.0)


@pytest.mark.long
def test_with_every_state_open_the_covariance_tells_the_errors_of_the_prediction():
    """Truths drawn from the prior; half a pass of readings; errors of the other half in their own sigmas."""
    chosen, squares, states = settings(range(STATE_COUNT)), [], []
    tai_s = visible(SOURCE, GIVEN, 3.0)
    half = tai_s.size // 2
    for run in range(25):
        rng = np.random.default_rng(run)
        x = SIGMAS * rng.normal(size=STATE_COUNT)
        az_deg, el_deg = shown(x, tai_s)
        fit = fit_of(noisy(az_deg[:half], el_deg[:half], tai_s[:half], NOISE_DEG, rng), chosen)
        corrected = SOURCE.corrected(fit.correction)
        seen = encoder_look(corrected, tai_s[half:], GIVEN, fit)
        across, both, upward = sky_covariance(corrected, tai_s[half:], GIVEN, fit)
        right = ((az_deg[half:] - seen.az_deg + 180.0) % 360.0 - 180.0) * np.cos(seen.el_deg * DEG) * DEG
        up = (el_deg[half:] - seen.el_deg) * DEG
        chi2 = (right**2 * upward - 2.0 * right * up * both + up**2 * across) / (across * upward - both**2)
        squares.append(float(np.mean(chi2)))
        states.append((found_of(fit) - x) / np.sqrt(np.diag(fit.covariance)))
    assert 1.0 < np.mean(squares) < 3.0  # two components
    rms = np.sqrt(np.mean(np.square(states), axis=0))
    assert ((rms > 0.6) & (rms < 1.5)).all(), dict(zip(NAMES, rms.round(2).tolist(), strict=True))
