"""Model choice: the newest locked residuals decide; a fit that is bad three times in a row starts afresh."""

from dataclasses import replace

import numpy as np
import pytest
from made_orbits import circular, site, visible

from acu_daemon.assist.estimators.full.carry_over import CarryOver, carry_over_of
from acu_daemon.assist.reading_gate import BELIED, WRONG_TARGET
from acu_daemon.assist.session.model_choice import ModelChoice, choose, newest_residual_deg
from acu_daemon.assist.session.refit import CARRIED_S, DROPPED, RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AxisLimits, Correction, FitResult, Model, Readings
from acu_daemon.orbit.look import look_at

NOISE_DEG = 0.03
AZIMUTH = AxisLimits(-270.0, 270.0, 20.0, 10.0)


def test_the_new_fit_is_used_while_it_is_good_or_no_worse_than_the_others() -> None:
    for others_deg, fit_deg in [(1.0, 0.03), (0.01, 0.05), (0.2, 0.25)]:
        chosen = choose(ModelChoice(), {Model.ELEMENTS: others_deg, Model.NEW_FIT: fit_deg}, NOISE_DEG)
        assert chosen == ModelChoice(Model.NEW_FIT)


def test_before_a_fit_the_better_of_elements_and_last_pass_is_used() -> None:
    assert choose(ModelChoice(), {Model.ELEMENTS: 0.3, Model.LAST_PASS: 0.05}, NOISE_DEG).model is Model.LAST_PASS
    assert choose(ModelChoice(), {Model.ELEMENTS: 0.1, Model.LAST_PASS: 0.9}, NOISE_DEG).model is Model.ELEMENTS


def test_a_bad_fit_gives_way_at_once_and_starts_afresh_after_three_bad_ones_in_a_row() -> None:
    bad = {Model.ELEMENTS: 0.1, Model.LAST_PASS: 0.2, Model.NEW_FIT: 0.5}
    choice = ModelChoice(Model.NEW_FIT)
    for count in (1, 2, 3):
        choice = choose(choice, bad, NOISE_DEG)
        assert choice == ModelChoice(Model.ELEMENTS, count)
        assert choice.is_reset_due == (count == 3)
    assert choose(choice, bad | {Model.NEW_FIT: 0.04}, NOISE_DEG) == ModelChoice(Model.NEW_FIT)


def test_the_residual_of_a_model_is_the_median_of_the_newest_seconds() -> None:
    source, where = circular(), site()
    tai_s = visible(source, where, 1.0)[100:160]
    seen = look_at(source, tai_s, where)
    el_deg = seen.el_deg + np.where(tai_s >= tai_s[-1] - 5.0, 0.2, 3.0)
    el_deg[-1] += 7.0
    off_deg = newest_residual_deg(source, where, None, Readings(tai_s, seen.az_deg, el_deg))
    assert off_deg == pytest.approx(0.2, abs=1e-6)


def test_a_fit_that_goes_astray_is_left_for_the_elements_and_comes_back_from_the_newest_readings() -> None:
    source, where = circular(), site(6.0)
    tai_s = visible(source, where, 1.0)[60:140]
    seen = look_at(source, tai_s, where)
    refitter = Refitter(RefitSetup(source, where, "kalman", EstimatorSettings(NOISE_DEG, NOISE_DEG), AZIMUTH))

    def refit(k: int) -> Model:
        part = Readings(tai_s[k : k + 1], seen.az_deg[k : k + 1], seen.el_deg[k : k + 1])
        return refitter.refit(RefitRequest(part, tai_s[k], 2.0, tai_s[k], 180.0)).model

    assert {refit(k) for k in range(40)} == {Model.NEW_FIT}
    kalman = refitter._estimator
    kept_fit = kalman.fit

    def astray() -> FitResult | None:
        fit = kept_fit()
        return None if fit is None else replace(fit, correction=Correction(delta_mean_anomaly_rad=0.01))

    kalman.fit = astray  # type: ignore[method-assign]
    assert [refit(k) for k in range(40, 44)] == [Model.ELEMENTS, Model.ELEMENTS, Model.NEW_FIT, Model.NEW_FIT]
    assert refitter._estimator is not kalman


# What an earlier pass left, the gate, and fresh starts together


SOURCE, WHERE, SETTINGS = circular(), site(6.0), EstimatorSettings(NOISE_DEG, NOISE_DEG)
LATE = Correction(delta_mean_anomaly_rad=np.radians(-0.3))


def _path(correction: Correction, count: int, up_deg_s: float = 0.0) -> Readings:
    tai_s = visible(SOURCE.corrected(correction), WHERE, 1.0)[60 : 60 + count]
    seen = look_at(SOURCE.corrected(correction), tai_s, WHERE)
    noise_deg = NOISE_DEG * np.random.default_rng(1).standard_normal((2, count))
    el_deg = seen.el_deg + up_deg_s * np.arange(count) + noise_deg[0]
    return Readings(tai_s, (seen.az_deg + noise_deg[1] / np.cos(np.radians(el_deg))) % 360.0, el_deg)


def _left(correction: Correction) -> CarryOver:
    """What a pass an hour before left, of an orbit that was fitted from good readings."""
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH))
    readings = _path(correction, 200)
    fit = refitter.refit(RefitRequest(readings, readings.tai_s[-1], 2.0, readings.tai_s[-1], 180.0)).fit
    assert fit is not None
    carried = carry_over_of(fit, SOURCE, WHERE)
    assert carried is not None
    return replace(carried, at_tai_s=carried.at_tai_s - 3600.0)


def _replies(refitter: Refitter, readings: Readings) -> list[RefitReply]:
    parts = (readings.part(slice(k, k + 1)) for k in range(len(readings)))
    return [refitter.refit(RefitRequest(one, one.tai_s[0], 2.0, one.tai_s[0], 180.0)) for one in parts]


@pytest.mark.long
def test_another_satellite_does_not_shake_what_the_last_pass_left() -> None:
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH, carried=_left(LATE)))
    good = _path(LATE, 120)
    wrong = _path(LATE, 120, up_deg_s=0.25)
    replies = _replies(refitter, wrong.part(slice(0, 60)))
    assert {reply.model for reply in replies[15:]} == {Model.LAST_PASS}
    assert replies[-1].gate.counts[WRONG_TARGET] == 60
    assert not any(reply.notes for reply in replies)
    assert _replies(refitter, good.part(slice(60, 120)))[-1].model is Model.NEW_FIT


@pytest.mark.long
def test_a_carried_orbit_that_is_denied_is_gone_for_good_even_where_the_fit_starts_afresh_later() -> None:
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH, carried=_left(LATE)))
    moved = Correction(delta_mean_anomaly_rad=np.radians(0.3))
    replies = _replies(refitter, _path(moved, 60))
    notes = [note for reply in replies for note in reply.notes]
    assert notes == [DROPPED]
    assert [reply.model for reply in replies].index(Model.NEW_FIT) == CARRIED_S
    assert {reply.model for reply in replies[int(CARRIED_S) :]} == {Model.NEW_FIT}
    refitter._gate.restart(30.0)
    refitter._begin_fit()
    now_tai_s = replies[-1].prediction.start_tai_s
    later = refitter.refit(RefitRequest(Readings.of([]), now_tai_s, 2.0, now_tai_s, 180.0))
    assert (later.model, later.notes) == (Model.NEW_FIT, ())
    assert later.gate.counts[BELIED] == 29


def test_what_the_last_pass_left_is_no_model_for_an_estimator_without_a_covariance() -> None:
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "kalman", SETTINGS, AZIMUTH, carried=_left(LATE)))
    now_tai_s = float(_path(LATE, 1).tai_s[0])
    assert refitter.refit(RefitRequest(Readings.of([]), now_tai_s, 2.0, now_tai_s, 180.0)).model is Model.ELEMENTS


@pytest.mark.long
def test_the_buffer_says_what_it_is_made_from() -> None:
    refitter = Refitter(RefitSetup(SOURCE, WHERE, "full", SETTINGS, AZIMUTH, carried=_left(LATE)))
    readings = _path(LATE, 60)
    now_tai_s = float(readings.tai_s[0])
    first = refitter.refit(RefitRequest(Readings.of([]), now_tai_s, 2.0, now_tai_s, 180.0))
    replies = _replies(refitter, readings)
    assert (first.prediction.model, first.prediction.kind) == (Model.LAST_PASS, "TLE")
    assert (replies[-1].prediction.model, replies[-1].prediction.kind) == (Model.NEW_FIT, "FITTED")
