"""The outlook over a whole history, drag factor and manoeuvres in it, and a node from a pass' own fit."""

from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from groundtrack_world import CRAFT

from acu_daemon.groundtrack import seen_pass as module
from acu_daemon.groundtrack.environment import EPOCH_TAI_S, Flux, FreeMotion, free_motion, running_integral
from acu_daemon.groundtrack.history import History, crossing_near
from acu_daemon.groundtrack.kinks import FoundManoeuvre
from acu_daemon.groundtrack.our_controller import FORECAST_S, DriftFilter, Forecast
from acu_daemon.groundtrack.outlook import Outlook, outlook
from acu_daemon.groundtrack.seen_pass import SeenPass, _mean_orbit, _sigma_m, seen_pass
from acu_daemon.model import Correction, Readings
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, Array

START = EPOCH_TAI_S + 40.0 * DAY_S
FLUX = Flux(EPOCH_TAI_S, np.full(300, 120.0), np.full(300, 2.0))
HOUR_S = 3600.0
PER_M = CRAFT.reference.by_a.drift


@lru_cache
def free(days: float) -> FreeMotion:
    return free_motion(CRAFT, days, FLUX, start_tai_s=START, step_s=HOUR_S, has_semi_annual=True)


def true_d_m(hours: Array, share: float, rate_m_day: float, pushes: dict[float, float]) -> Array:
    """D from rest at 300 m with a drift, a drag of (1 + share) times the model's, and pushes of so many metres."""
    whole = free(60.0)
    bent = (1.0 + share) * whole.drag_m_s2 + whole.lunisolar_m_s2
    path = running_integral(running_integral(bent, HOUR_S), HOUR_S)
    d = 300.0 + rate_m_day / 24.0 * hours + path[np.round(hours).astype(int)]
    for hour, size_m in pushes.items():
        d = d + PER_M * size_m * HOUR_S * np.maximum(hours - hour, 0.0)
    return d


def history(hours: Array, d_m: Array) -> History:
    return History(CRAFT.reference, START + hours * HOUR_S, d_m, np.zeros(hours.size))


def push(hour: float, size_m: float, sigma_m: float = 0.01) -> FoundManoeuvre:
    return FoundManoeuvre(START + hour * HOUR_S, size_m, sigma_m)


@pytest.mark.parametrize("share", [-0.4, 0.3])
@pytest.mark.parametrize("pushes", [{}, {300.0: 25.0}, {300.0: 25.0, 301.0: -10.0, 700.0: 15.0}])
def test_drift_and_drag_are_found_whatever_was_steered(pushes: dict[float, float], share: float) -> None:
    hours = np.arange(0.0, 960.0, 24.0)
    d_m = true_d_m(hours, share, -40.0, pushes)
    found = outlook(CRAFT, FLUX, history(hours, d_m), np.full(hours.size, 1.0), [push(*one) for one in pushes.items()])
    assert found.tai_s == START + hours[-1] * HOUR_S
    assert found.d_m == pytest.approx(d_m[-1], abs=5.0)
    ahead = true_d_m(hours[-1] + np.array([-1.0, 1.0]), share, -40.0, pushes)
    assert found.rate_m_day == pytest.approx(12.0 * (ahead[1] - ahead[0]), abs=max(1.0, 5.0 * found.rate_sigma_m_day))
    assert found.drag_factor == pytest.approx(1.0 + share, abs=max(0.03, 4.0 * found.drag_factor_sigma))
    assert found.drag_factor_sigma < 0.3
    assert found.ahead_tai_s[-1] >= found.tai_s + FORECAST_S - DAY_S


def by_hand(sigmas: Array, d_m: Array, count_days: float) -> DriftFilter:
    far = free_motion(CRAFT, count_days + 122.0, FLUX, start_tai_s=START, step_s=HOUR_S, has_semi_annual=True)
    drift = DriftFilter(
        Forecast(HOUR_S, far.drag_m_s2, far.lunisolar_m_s2), (sigmas[0], 1000.0 / DAY_S, 1.0), 365.0 * DAY_S
    )
    drift.state[0] = d_m[0]
    return drift


def compare(found: Outlook, drift: DriftFilter) -> None:
    d_m, rate_m_s, share = drift.state
    assert (found.d_m, found.rate_m_day) == (pytest.approx(d_m), pytest.approx(rate_m_s * DAY_S))
    assert found.drag_factor == pytest.approx(1.0 + share)
    sigmas = np.sqrt(np.diag(drift.covariance))
    assert found.d_sigma_m == pytest.approx(sigmas[0])
    assert found.rate_sigma_m_day == pytest.approx(sigmas[1] * DAY_S)
    assert found.drag_factor_sigma == pytest.approx(sigmas[2])


@pytest.mark.parametrize(
    ("size_m", "sigma_m", "used_m"), [(20.0, 0.1, 1.0), (-20.0, 0.1, 1.0), (20.0, 2.0, 6.0), (-1.0, 0.02, 0.06)]
)
def test_a_manoeuvre_is_unsure_by_three_of_its_sigmas_or_a_twentieth(
    size_m: float, sigma_m: float, used_m: float
) -> None:
    hours, sigmas, d_m = np.array([0.0, 24.0, 48.0]), np.array([2.0, 3.0, 4.0]), np.array([10.0, 60.0, 90.0])
    found = outlook(CRAFT, FLUX, history(hours, d_m), sigmas, [push(30.0, size_m, sigma_m)])
    drift = by_hand(sigmas, d_m, 2.0)
    drift.advance(0, 24)
    drift.update(60.0, 3.0)
    drift.advance(24, 30)
    drift.push(PER_M * size_m, abs(PER_M) * used_m)
    drift.advance(30, 48)
    drift.update(90.0, 4.0)
    compare(found, drift)


@pytest.mark.parametrize(("hour", "counts"), [(-1.0, False), (0.0, False), (0.6, True), (48.0, True), (48.6, False)])
def test_manoeuvres_after_the_first_point_count_up_to_the_last_one(hour: float, counts: bool) -> None:
    hours, sigmas, d_m = np.array([0.0, 48.0]), np.full(2, 1.0), np.array([10.0, 60.0])
    plain = outlook(CRAFT, FLUX, history(hours, d_m), sigmas, [])
    pushed = outlook(CRAFT, FLUX, history(hours, d_m), sigmas, [push(hour, 20.0)])
    assert (pushed.rate_m_day != plain.rate_m_day) == counts


def test_two_points_of_one_hour_are_two_observations_of_the_same_instant() -> None:
    hours, sigmas, d_m = np.array([0.0, 24.0, 24.3, 47.6]), np.full(4, 5.0), np.array([10.0, 60.0, 70.0, 90.0])
    found = outlook(CRAFT, FLUX, history(hours, d_m), sigmas, [])
    drift = by_hand(sigmas, d_m, 47.6 / 24.0)
    drift.advance(0, 24)
    drift.update(60.0, 5.0)
    drift.update(70.0, 5.0)
    drift.advance(24, 48)
    drift.update(90.0, 5.0)
    compare(found, drift)
    assert found.tai_s == START + 48.0 * HOUR_S


def test_the_limit_is_the_one_given_nought_too_or_where_the_last_ones_up_were_made() -> None:
    hours = np.arange(0.0, 240.0, 24.0)
    d_m = true_d_m(hours, 0.0, -400.0, {120.0: 5.0})
    made = [push(120.0, 5.0)]
    sigmas = np.full(hours.size, 1.0)
    assert outlook(CRAFT, FLUX, history(hours, d_m), sigmas, made, 0.0).limit_m == 0.0
    assert outlook(CRAFT, FLUX, history(hours, d_m), sigmas, made, 77.0).limit_m == 77.0
    usual = outlook(CRAFT, FLUX, history(hours, d_m), sigmas, made).limit_m
    assert usual == pytest.approx(d_m[5])
    assert outlook(CRAFT, FLUX, history(hours, d_m), sigmas, []).limit_m is None


# A node from a pass


def source(correction: Correction | None = None, **changed: float) -> BrouwerPropagator:
    numbers = {"a_m": 7.15e6, "e": 1.5e-3, "i_rad": 1.72, "raan_rad": 1.0, "argp_rad": 1.4, "mean_anomaly_rad": 0.3}
    return BrouwerPropagator(BrouwerElements("made", START, **{**numbers, **changed}), correction=correction)


@pytest.mark.parametrize("i_rad", [0.7, 1.72])
@pytest.mark.parametrize("argp_rad", [1.4, -1.4, 3.0])
def test_the_mean_orbit_is_that_of_the_elements(argp_rad: float, i_rad: float) -> None:
    mean, revolution_s = _mean_orbit(source(argp_rad=argp_rad, i_rad=i_rad), START + 5000.0)
    assert mean.a_m == pytest.approx(7.15e6, abs=20.0)
    assert mean.e == pytest.approx(1.5e-3, abs=2e-5)
    assert mean.i_rad == pytest.approx(i_rad, abs=1e-6)
    assert revolution_s == pytest.approx(2.0 * np.pi * (7.15e6**3 / 3.986004418e14) ** 0.5, rel=1e-4)


def fit(covariance: Array | None, correction: Correction | None = None, **more: Any) -> Any:
    return SimpleNamespace(correction=correction or Correction(), covariance=covariance, **more)


def sigma_m(covariance: Array | None, correction: Correction | None = None, days: float = 0.0) -> float:
    given = correction or Correction()
    crossing = crossing_near(source(given), START + days * DAY_S, 6017.0)
    return _sigma_m(source(), fit(covariance, given), crossing, 6017.0)


def variance(*of: float) -> Array:
    covariance = np.zeros((17, 17))
    covariance[:6, :6] = np.outer(of, of)
    return covariance


CORRECTIONS = [None, Correction(0.03, -0.02, 1e-8, 2e-4, -1e-4, 0.01)]
PER_DAY = 14.36


@pytest.mark.parametrize("correction", CORRECTIONS)
def test_the_nodes_sigma_is_that_of_node_and_anomaly_together(correction: Correction | None) -> None:
    radius_m, alone = EARTH_EQUATORIAL_RADIUS_M, 1e-4
    assert sigma_m(variance(alone, 0, 0, 0, 0, 0), correction) == pytest.approx(radius_m * alone, rel=1e-3)
    anomaly_m = sigma_m(variance(0, alone, 0, 0, 0, 0), correction)
    assert anomaly_m == pytest.approx(radius_m * alone / PER_DAY, rel=0.02)
    assert sigma_m(variance(alone, alone, 0, 0, 0, 0), correction) == pytest.approx(
        radius_m * alone + anomaly_m, rel=0.01
    )
    assert sigma_m(variance(alone, -alone, 0, 0, 0, 0), correction) == pytest.approx(
        radius_m * alone - anomaly_m, rel=0.01
    )
    assert sigma_m(variance(0, 0, 0, 0, 0, alone), correction) < 0.05 * radius_m * alone


@pytest.mark.parametrize("days", [-1.0, 1.0])
def test_a_wrong_mean_motion_moves_the_node_the_more_the_farther_from_the_epoch(days: float) -> None:
    found = sigma_m(variance(0, 0, 1e-9, 0, 0, 0), days=days)
    assert found == pytest.approx(EARTH_EQUATORIAL_RADIUS_M * 1e-9 * DAY_S / PER_DAY, rel=0.1)


def test_without_a_covariance_there_is_no_sigma_and_biases_do_not_count() -> None:
    assert sigma_m(None) == 0.0
    covariance = np.zeros((17, 17))
    covariance[6:, 6:] = 1.0
    assert sigma_m(covariance) == 0.0


READINGS = Readings(START + 100.0 + 500.0 * np.arange(11.0), np.linspace(10.0, 90.0, 11), np.full(11, 30.0))
NOT_THE_SAME = {"reading_count": 9, "rejected_count": 2, "residual_rms_deg": 0.04}


def seen(monkeypatch: pytest.MonkeyPatch, found: Any, azimuth_deg: float = 0.02, elevation_deg: float = 0.01) -> Any:
    """What is made of a pass whose fit is this one."""
    asked: list[Any] = []

    class Fitter:
        def __init__(self, setup: Any) -> None:
            self.setup = setup

        def refit(self, request: Any) -> Any:
            asked.append(request)
            return SimpleNamespace(fit=found)

    monkeypatch.setattr(module, "Refitter", Fitter)
    settings = SimpleNamespace(sigma_azimuth_deg=azimuth_deg, sigma_elevation_deg=elevation_deg)
    setup: Any = SimpleNamespace(settings=settings, propagator=source())
    told = seen_pass(setup, READINGS)
    [request] = asked
    assert request.readings is READINGS
    assert (request.start_tai_s, request.now_tai_s, request.near_az_deg) == (START + 5100.0, START + 5100.0, 180.0)
    return told


SURE = variance(1e-5, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("found", [None, fit(None, **NOT_THE_SAME)])
def test_a_pass_without_a_fit_or_its_covariance_tells_nothing(monkeypatch: pytest.MonkeyPatch, found: Any) -> None:
    assert seen(monkeypatch, found).startswith("no fit: ")


@pytest.mark.parametrize("sigmas", [(0.02, 0.01), (0.01, 0.02)])
@pytest.mark.parametrize(("rms_deg", "is_kept"), [(0.0999, True), (0.1001, False)])
def test_residuals_may_be_five_times_the_larger_noise(
    monkeypatch: pytest.MonkeyPatch, rms_deg: float, is_kept: bool, sigmas: tuple[float, float]
) -> None:
    told = seen(monkeypatch, fit(SURE, **{**NOT_THE_SAME, "residual_rms_deg": rms_deg}), *sigmas)
    assert isinstance(told, SeenPass) == is_kept
    if not is_kept:
        assert told == "the readings are 0.10 deg rms off the fit: are they of another satellite?"


@pytest.mark.parametrize(("rejected", "is_kept"), [(8, True), (9, True), (10, False)])
def test_no_more_readings_may_be_rejected_than_used(
    monkeypatch: pytest.MonkeyPatch, rejected: int, is_kept: bool
) -> None:
    told = seen(monkeypatch, fit(SURE, **{**NOT_THE_SAME, "rejected_count": rejected}))
    assert isinstance(told, SeenPass) == is_kept
    if not is_kept:
        assert told == "10 of 11 readings do not fit the others: are they of another satellite?"


def test_a_seen_pass_has_the_node_nearest_to_its_middle_by_the_corrected_orbit(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = Correction(0.01, 0.02, 1e-8, 0.0, 0.0, 0.001)
    told = seen(monkeypatch, fit(SURE, moved, **NOT_THE_SAME))
    assert isinstance(told, SeenPass)
    crossing = crossing_near(source(moved), START + 2600.0, 6017.0)
    assert told.crossing.tai_s == pytest.approx(crossing.tai_s, abs=1e-3)
    assert told.crossing.longitude_rad == pytest.approx(crossing.longitude_rad, abs=1e-9)
    assert told.sigma_m == pytest.approx(EARTH_EQUATORIAL_RADIUS_M * 1e-5, rel=1e-3)
    assert told.mean.i_rad == pytest.approx(1.721, abs=1e-5)
    assert (told.reading_count, told.residual_rms_deg) == (9, 0.04)
