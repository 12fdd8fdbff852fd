"""What a pass leaves to the next one: aged, accepted or dropped, and better than the elements where it can be."""

import asyncio
import pickle
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from conftest import needs_data
from made_orbits import circular, site, visible
from real_passes import noisy, sky_angles_deg
from script_modules import load

from acu_daemon.assist.estimators.estimator import ESTIMATORS, has_covariance
from acu_daemon.assist.estimators.full.aged_prior import aged_prior, first_fit
from acu_daemon.assist.estimators.full.carry_over import LONGEST_S, CarryOver, carry_over_of, why_not, why_not_resume
from acu_daemon.assist.estimators.full.carry_over_test import CarryOverTest
from acu_daemon.assist.estimators.full.estimated_states import BIAS, ORBIT, Prior, correction_of, make_prior
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.full.normal_points import sights
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.model import AngleBias, AxisLimits, Correction, FitResult, Readings, Site
from acu_daemon.orbit.brouwer import BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S, DEG, Array

figures = load("figures_carry_over")

SIGMA_DEG = 0.03
SETTINGS = EstimatorSettings(SIGMA_DEG, SIGMA_DEG, orbit_sigmas=ElementSigmas())
AZIMUTH = AxisLimits(-270.0, 270.0, 20.0, 10.0)
LATE = Correction(delta_raan_rad=0.005 * DEG, delta_mean_anomaly_rad=-0.3 * DEG)
BIAS_DEG = AngleBias(az_deg=0.05, el_deg=-0.04)
SOURCE, WHERE = circular(66.0, 0.001), site(4.0)
TRUTH = SOURCE.corrected(LATE)
FIRST_TAI_S = visible(TRUTH, WHERE, 1.0)


def shown(truth: Any, where: Site, tai_s: Array, bias: AngleBias = BIAS_DEG, seed: int = 1) -> Readings:
    """What the encoders show of the truth, with noise."""
    seen = look_at(truth, tai_s, where)
    az_deg, el_deg = seen.az_deg + bias.az_deg, seen.el_deg + bias.el_deg
    return noisy(az_deg, el_deg, tai_s, SIGMA_DEG, np.random.default_rng(seed))


def fitted(source: Any, where: Site, readings: Readings, carried: CarryOver | None = None) -> FitResult:
    estimator = FullEstimator(source, where, SETTINGS, carried)
    estimator.add(readings)
    fit = estimator.fit()
    assert fit is not None
    return fit


def left_by_the_first_pass() -> CarryOver:
    carried = carry_over_of(fitted(SOURCE, WHERE, shown(TRUTH, WHERE, FIRST_TAI_S)), SOURCE, WHERE)
    assert carried is not None
    return carried


CARRIED = left_by_the_first_pass()


def next_pass(where: Site = WHERE) -> Array:
    """Times of a later pass, 1 Hz."""
    begin = float(FIRST_TAI_S[-1]) + 3600.0
    coming = find_passes(TRUTH, where, begin, begin + 2.0 * DAY_S, 5.0)
    long = next(one for one in coming if one.duration_s > 400.0)
    return np.arange(long.rise_tai_s, long.set_tai_s)


def errors_deg(fit: FitResult | None, truth: Any, where: Site, tai_s: Array, bias: AngleBias = BIAS_DEG) -> Array:
    source = SOURCE if fit is None else SOURCE.corrected(fit.correction)
    seen, real = encoder_look(source, tai_s, where, fit), look_at(truth, tai_s, where)
    return sky_angles_deg(seen.az_deg, seen.el_deg, real.az_deg + bias.az_deg, real.el_deg + bias.el_deg)


def start_of(tai_s: Array, where: Site = WHERE, carried: CarryOver = CARRIED) -> FitResult:
    return first_fit(carried, aged_prior(carried, SOURCE, where, SETTINGS, float(tai_s[0])))


# The next pass


def test_the_next_pass_begins_on_the_satellite_where_the_elements_miss_it() -> None:
    tai_s = next_pass()
    assert errors_deg(None, TRUTH, WHERE, tai_s).max() > 1.0
    assert errors_deg(start_of(tai_s), TRUTH, WHERE, tai_s).max() < 0.1


def test_another_station_is_left_the_orbit_but_not_the_biases() -> None:
    other = site(30.0, 20.0)
    tai_s = next_pass(other)
    start = start_of(tai_s, other)
    assert start.bias == AngleBias()
    assert start_of(tai_s).bias.el_deg == pytest.approx(BIAS_DEG.el_deg, abs=0.03)
    assert errors_deg(start, TRUTH, other, tai_s, AngleBias()).max() < 0.1
    assert start.covariance is not None
    fresh = make_prior(SOURCE, SETTINGS, float(tai_s[0])).covariance
    assert (start.covariance[BIAS, BIAS] == fresh[BIAS, BIAS]).all()
    assert not start.covariance[ORBIT, BIAS].any()


def test_a_few_readings_of_the_next_pass_tell_more_with_what_was_left() -> None:
    tai_s = next_pass()
    readings = shown(TRUTH, WHERE, tai_s, seed=2)
    few = Readings(readings.tai_s[:20], readings.az_deg[:20], readings.el_deg[:20])
    plain, better = (fitted(SOURCE, WHERE, few, carried) for carried in (None, CARRIED))
    worst = [errors_deg(fit, TRUTH, WHERE, tai_s[20:]).max() for fit in (plain, better)]
    assert worst[1] < 0.8 * worst[0]
    assert better.reading_count == 20


def test_uncertainty_grows_with_time_and_holds_no_negative_variance() -> None:
    ages = np.array([0.0, 0.1, 1.0, 5.0]) * DAY_S
    priors = [aged_prior(CARRIED, SOURCE, WHERE, SETTINGS, CARRIED.at_tai_s + age) for age in ages.tolist()]
    sigmas = [np.sqrt(np.diag(prior.covariance)) for prior in priors]
    assert all((after >= before).all() for before, after in pairwise(sigmas))
    assert all(np.linalg.eigvalsh(_correlation(prior.covariance)).min() > -1e-9 for prior in priors)
    along = [float(_along_rad(prior, CARRIED.at_tai_s + age)) for prior, age in zip(priors, ages, strict=True)]
    assert along == sorted(along)
    assert along[0] == pytest.approx(1e-4, rel=0.5)  # at once: what comes and goes within hours
    assert along[2] > 5e-4  # after a day: 1e-6 rad/min a day, half of it times 1440 min


def _correlation(covariance: Array) -> Array:
    sigma = np.sqrt(np.diag(covariance))
    sigma[sigma == 0.0] = 1.0
    correlation: Array = covariance / np.outer(sigma, sigma)
    return correlation


def _along_rad(prior: Prior, at_tai_s: float) -> float:
    """1 sigma of mean anomaly plus perigee at an instant."""
    row = np.zeros(17)
    row[1], row[2] = 1.0, at_tai_s - SOURCE.epoch_tai_s
    return float(np.sqrt(row @ prior.covariance @ row))


def test_what_a_low_orbit_leaves_is_worth_less_than_what_a_high_one_does() -> None:
    """After three days 4e-7 rad/min a day of drag are 18 km; perigee and mean motion add a tenth."""
    at_tai_s = CARRIED.at_tai_s + 3.0 * DAY_S
    sigmas = []
    for height_km in (400.0, 800.0):
        states = CARRIED.states.copy()
        states[:, :3] *= (6378.137 + height_km) / 7180.0
        states[:, 3:] *= np.sqrt(7180.0 / (6378.137 + height_km))
        right = replace(CARRIED, states=states, correction=Correction())
        prior = aged_prior(right, SOURCE, WHERE, SETTINGS, at_tai_s)
        sigmas.append(_along_rad(prior, at_tai_s))
    assert 4.0 < sigmas[0] / sigmas[1] < 20.0
    assert sigmas[0] == pytest.approx(1.1 * 0.5 * 4e-7 * 1440.0 * 9.0, rel=0.1)


def test_a_correction_that_is_no_more_than_its_uncertainty_leaves_the_elements_alone() -> None:
    exact = carry_over_of(fitted(SOURCE, WHERE, shown(SOURCE, WHERE, FIRST_TAI_S)), SOURCE, WHERE)
    assert exact is not None
    assert any(abs(value) > 1e-7 for value in (exact.correction.delta_raan_rad, exact.correction.delta_e_cos_argp))
    tai_s = next_pass()
    assert start_of(tai_s, carried=exact).correction == Correction()


# Accepted or dropped


def test_what_was_left_is_used_for_the_same_elements_only() -> None:
    now = CARRIED.at_tai_s + 6000.0
    assert why_not(CARRIED, SOURCE, SETTINGS, now) == ""
    for changed in (
        replace(SOURCE.elements, epoch_tai_s=SOURCE.epoch_tai_s + 1.0),
        replace(SOURCE.elements, raan_rad=SOURCE.elements.raan_rad + 1e-6),
        replace(SOURCE.elements, a_m=SOURCE.elements.a_m + 1.0),
    ):
        other = BrouwerPropagator(changed, short_period=False)
        assert why_not(CARRIED, other, SETTINGS, now) == "the elements have changed"


def test_elements_that_differ_in_drag_alone_are_other_elements() -> None:
    text = """ISS
1 25544U 98067A   19343.69339541  .00001764  00000-0  38792-4 0  9991
2 25544  51.6439 211.2001 0007417  17.6667  85.6398 15.50103472202482
"""
    (elements,), _ = parse_tle(text, "test")
    source, other = (Sgp4Propagator(replace(elements, bstar_per_radius=b)) for b in (3.8792e-5, 5e-5))
    covariance = make_prior(source, SETTINGS, source.epoch_tai_s).covariance
    fit = FitResult("full", Correction(), source.epoch_tai_s + DAY_S, 100, 0, 0.0, 0.0, 0.0, covariance=covariance)
    carried = carry_over_of(fit, source, WHERE)
    assert carried is not None
    assert why_not(carried, source, SETTINGS, carried.at_tai_s) == ""
    assert why_not(carried, other, SETTINGS, carried.at_tai_s) == "the elements have changed"


def test_what_is_too_old_or_from_later_or_no_orbits_correction_is_dropped() -> None:
    at = CARRIED.at_tai_s
    assert why_not(CARRIED, SOURCE, SETTINGS, at + LONGEST_S + 1.0) == "it is 10.0 days old, the limit is 10"
    assert why_not(CARRIED, SOURCE, SETTINGS, at - 1.0) == "it is from a later time than now"
    wild = replace(CARRIED, correction=Correction(delta_raan_rad=1.0 * DEG))
    assert why_not(wild, SOURCE, SETTINGS, at) == "its correction is more than 5 sigma from the elements"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"correction": Correction(delta_raan_rad=50.0 * DEG)},
            "its correction is more than 5 sigma from the elements",
        ),
        ({"bias": AngleBias(az_deg=50.0)}, "its biases are more than 5 of the [readings] bias_sigma"),
        ({"bias": AngleBias(el_deg=-0.6)}, "its biases are more than 5 of the [readings] bias_sigma"),
        ({"station_shift_enu_m": (1e6, 0.0, 0.0)}, "its shift of the station is more than 5 times [station] uncert"),
        ({"covariance": np.zeros((17, 17))}, "its covariance is not that of a fit"),
        ({"covariance": 1e6 * CARRIED.covariance}, "its covariance is not that of a fit"),
    ],
)
def test_what_no_fit_leaves_is_dropped_from_the_next_pass_and_from_a_resumed_one(
    change: dict[str, Any], said: str
) -> None:
    settings = replace(SETTINGS, station_sigma_m=1000.0)
    wild, at = replace(CARRIED, **change), CARRIED.at_tai_s
    assert why_not(CARRIED, SOURCE, settings, at) == ""
    assert why_not(wild, SOURCE, settings, at).startswith(said)
    resume = partial(why_not_resume, source=SOURCE, site=WHERE, estimator="full", settings=settings, now_tai_s=at)
    assert resume(CARRIED, has_covariance=True) == ""
    assert resume(wild, has_covariance=True).startswith(said)


def test_a_widened_fit_is_gone_on_from_in_its_own_pass_only() -> None:
    far, at = replace(CARRIED, correction=Correction(delta_mean_anomaly_rad=6.0 * DEG)), CARRIED.at_tai_s
    assert why_not(far, SOURCE, SETTINGS, at) == "its correction is more than 5 sigma from the elements"
    assert why_not_resume(far, SOURCE, WHERE, "full", SETTINGS, at, has_covariance=True) == ""


@pytest.mark.parametrize("state", range(6))
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_what_the_widest_prior_leaves_within_five_sigmas_is_gone_on_from_and_what_is_farther_is_not(
    state: int, side: float
) -> None:
    """25 times the elements' own sigma, and along the track 5 deg beside it (docs/estimation.md, Prior inflation)."""
    at, x = CARRIED.at_tai_s, np.zeros(17)
    own = float(np.sqrt(make_prior(SOURCE, SETTINGS, at).covariance[state, state]))
    limit = 5.0 * np.hypot(25.0 * own, 5.0 * DEG if state == 1 else 0.0)
    for share, is_gone_on in ((0.99, True), (1.01, False)):
        x[state] = side * share * limit
        said = why_not_resume(
            replace(CARRIED, correction=correction_of(x)), SOURCE, WHERE, "full", SETTINGS, at, has_covariance=True
        )
        assert (said == "") == is_gone_on


def test_what_the_configuration_holds_fixed_is_not_judged() -> None:
    fixed = replace(SETTINGS, bias_sigma_azimuth_deg=0.0, bias_sigma_elevation_deg=0.0)
    assert why_not(CARRIED, SOURCE, fixed, CARRIED.at_tai_s) == ""
    start = first_fit(CARRIED, aged_prior(CARRIED, SOURCE, WHERE, fixed, CARRIED.at_tai_s))
    assert (start.bias.az_deg, start.bias.el_deg) == (0.0, 0.0)


def test_few_readings_or_no_covariance_leave_nothing() -> None:
    fit = fitted(SOURCE, WHERE, shown(TRUTH, WHERE, FIRST_TAI_S))
    assert carry_over_of(replace(fit, covariance=None), SOURCE, WHERE) is None
    assert carry_over_of(replace(fit, reading_count=29), SOURCE, WHERE) is None


def test_only_an_estimator_with_a_covariance_uses_what_was_left() -> None:
    assert [name for name in ESTIMATORS if has_covariance(name)] == ["full"]
    tai_s = next_pass()
    nothing = Readings(np.empty(0), np.empty(0), np.empty(0))
    for name in ESTIMATORS:
        setup = RefitSetup(SOURCE, WHERE, name, SETTINGS, AZIMUTH, carried=CARRIED)
        reply = Refitter(setup).refit(RefitRequest(nothing, float(tai_s[0]), 60.0, float(tai_s[0]), 180.0))
        point = reply.prediction.at(float(tai_s[10]))
        assert point is not None
        truth = look_at(TRUTH, tai_s[10:11], WHERE)
        error = sky_angles_deg(point.az_deg, point.el_deg, truth.az_deg + BIAS_DEG.az_deg, truth.el_deg - 0.04)
        assert (float(error[0]) < 0.1) == has_covariance(name)
        assert (reply.fit, reply.prediction.kind) == (None, "TLE")
        assert (reply.prediction.sigma_deg is not None) == has_covariance(name)


async def test_the_setup_with_what_was_left_goes_to_the_process_that_fits() -> None:
    tai_s = next_pass()
    setup = RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH, carried=CARRIED)
    request = RefitRequest(shown(TRUTH, WHERE, tai_s[:40]), float(tai_s[40]), 5.0, float(tai_s[40]), 180.0)
    here, there = (InlineFitRunner(one, 0.0) for one in (setup, pickle.loads(pickle.dumps(setup))))
    one, two = await asyncio.gather(here.refit(request), there.refit(request))
    assert one.fit == two.fit
    assert one.fit is not None


# Manoeuvres


def manoeuvred(by: Correction) -> tuple[Any, Array]:
    """The satellite after a burn, and the times of its next pass."""
    return SOURCE.corrected(by), next_pass()


BURN = replace(LATE, delta_raan_rad=0.4 * DEG)


def test_a_manoeuvre_shows_within_a_minute_and_what_was_left_is_dropped_with_a_note() -> None:
    truth, tai_s = manoeuvred(BURN)
    readings = shown(truth, WHERE, tai_s, seed=3)
    estimator = FullEstimator(SOURCE, WHERE, SETTINGS, CARRIED)
    plain = FullEstimator(SOURCE, WHERE, SETTINGS)
    for k in range(0, 75, 5):
        part = Readings(*(one[k : k + 5] for one in (readings.tai_s, readings.az_deg, readings.el_deg)))
        estimator.add(part)
        plain.add(part)
        estimator.fit()
        assert len(estimator.notes) == (k + 4 >= 60)
    (note,) = estimator.notes
    assert note.startswith("the last pass's orbit is dropped: for 60 s all readings were more than 5 sigma from it")
    one, two = estimator.fit(), plain.fit()
    assert one is not None
    assert two is not None
    assert errors_deg(one, truth, WHERE, tai_s) == pytest.approx(errors_deg(two, truth, WHERE, tai_s), abs=1e-3)


def test_without_a_manoeuvre_nothing_is_dropped() -> None:
    tai_s = next_pass()
    for seed in range(5):
        estimator = FullEstimator(SOURCE, WHERE, SETTINGS, CARRIED)
        estimator.add(shown(TRUTH, WHERE, tai_s, seed=seed))
        assert estimator.notes == []


@pytest.mark.parametrize(("step_s", "is_rejected"), [(1.0, True), (5.0, True), (15.0, False)])
def test_a_minute_needs_readings_without_long_gaps(step_s: float, is_rejected: bool) -> None:
    truth, tai_s = manoeuvred(BURN)
    prior = aged_prior(CARRIED, SOURCE, WHERE, SETTINGS, float(tai_s[0]))
    seen = sights(shown(truth, WHERE, np.arange(tai_s[0], tai_s[0] + 120.0, step_s)))
    assert CarryOverTest(SOURCE, WHERE, SETTINGS, prior).rejects(seen) == is_rejected


def test_one_reading_inside_begins_the_minute_again() -> None:
    truth, tai_s = manoeuvred(BURN)
    prior = aged_prior(CARRIED, SOURCE, WHERE, SETTINGS, float(tai_s[0]))
    off, on = (shown(one, WHERE, tai_s[:110]) for one in (truth, TRUTH))
    is_on = np.arange(110) == 55
    mixed = Readings(off.tai_s, np.where(is_on, on.az_deg, off.az_deg), np.where(is_on, on.el_deg, off.el_deg))
    test = CarryOverTest(SOURCE, WHERE, SETTINGS, prior)
    assert (test.sigmas(sights(mixed)) < 5.0).tolist() == is_on.tolist()
    assert not test.rejects(sights(mixed))


def test_innovations_are_as_large_as_the_prior_says() -> None:
    """Of satellites drawn from the prior 39 % lie inside 1 sigma; readings of one pass are not independent."""
    tai_s = next_pass()[::60]
    prior = aged_prior(CARRIED, SOURCE, WHERE, SETTINGS, float(tai_s[0]))
    root = np.linalg.cholesky(prior.covariance[:10, :10] + 1e-30 * np.eye(10))
    inside = []
    for seed in range(60):
        x = prior.mean[:10] + root @ np.random.default_rng(seed).normal(size=10)
        bias = AngleBias(*(x[6:] / DEG))
        seen = sights(shown(SOURCE.corrected(Correction(*x[:6])), WHERE, tai_s, bias, seed))
        inside.append((CarryOverTest(SOURCE, WHERE, SETTINGS, prior).sigmas(seen) < 1.0).mean())
    assert np.mean(inside) == pytest.approx(0.39, abs=0.08)


# Real passes


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("along_s", [0.0, 1.0, 12.0])
def test_a_second_real_pass_begins_nearer_to_the_satellite_than_the_first(along_s: float) -> None:
    has_air = along_s > 0.0  # air that is up to 10 % another outweighs what is left of good elements
    rows = [figures.row_of(*pair, along_s, 3, has_air) for pair in figures.pairs()]
    assert len(rows) == 8
    first, plain, carried = (
        np.array([getattr(row, f"{name}_aos_deg") for row in rows]) for name in ("first", "plain", "carried")
    )
    assert (carried < plain + 0.003).all()
    assert np.exp(np.mean(np.log(carried / first))) < 0.7
    sigma = np.array([row.orbit_sigma_deg for row in rows])
    assert (carried < 3.0 * sigma).all()
    if along_s:
        assert (carried < plain / 2).all()
        assert (carried < first / 2).all()
    else:
        assert (sigma < 0.05).all()
