"""Model choice: the newest locked residuals decide; a fit that is bad three times in a row starts afresh."""

from dataclasses import replace

import numpy as np
import pytest
from made_orbits import circular, site, visible

from acu_daemon.assist.model_choice import Model, ModelChoice, choose, newest_residual_deg
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.control.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.model import AxisLimits, Correction, FitResult, Readings
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
    off_deg = newest_residual_deg(source, where, None, Readings(tai_s, seen.az_deg, el_deg), EstimatorSettings())
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
