"""How long a prediction stays in the beam by its own sigma."""

from dataclasses import replace

import numpy as np
import pytest

from acu_daemon.model import Prediction

STEADY = np.full(901, 30.0)
BUFFER = Prediction(100.0, 0.1, STEADY, STEADY, STEADY, STEADY, STEADY, STEADY, "FITTED", 100.0)


def test_the_seconds_until_three_sigma_leave_the_limit_count_from_now():
    growing = replace(BUFFER, sigma_deg=0.01 * 0.1 * np.arange(901))  # 0.01 deg each second
    assert growing.seconds_inside(100.0, 0.5) == pytest.approx(0.5 / 3 / 0.01, abs=0.11)
    assert growing.seconds_inside(110.0, 0.5) == pytest.approx(0.5 / 3 / 0.01 - 10.0, abs=0.11)


def test_a_prediction_that_is_already_too_uncertain_has_no_second_left():
    assert replace(BUFFER, sigma_deg=np.full(901, 1.0)).seconds_inside(105.0, 0.5) == 0.0


def test_a_sure_prediction_is_told_to_the_end_of_the_buffer_and_no_further():
    assert replace(BUFFER, sigma_deg=np.full(901, 0.001)).seconds_inside(140.0, 0.5) == pytest.approx(50.0)


def test_an_estimator_without_sigma_promises_nothing():
    assert BUFFER.seconds_inside(100.0, 0.5) is None
