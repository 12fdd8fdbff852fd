"""The lag from command to encoder is learned from the staircase that the servo is given."""

from math import exp

import numpy as np
import pytest

from acu_daemon.control.tracking.lag import PRIOR_LAG_S, LagEstimate

PERIOD_S = 0.1
EFFECT_S, SAMPLE_S = 0.020, 0.010
PHASE_S = PERIOD_S - EFFECT_S + SAMPLE_S
CODE_DEG = 360.0 / 65536


def learn(lag_s: float, rate_deg_s: float, seconds: float, noise_deg: float = 0.0) -> LagEstimate:
    """Feed the estimate from a simulated first-order servo that gets steps of a ramp."""
    rng = np.random.default_rng(1)
    estimate = LagEstimate()
    position, step = 0.0, rate_deg_s * PERIOD_S
    for k in range(int(seconds / PERIOD_S)):
        command = k * step
        sampled = command + (position - command) * exp(-PHASE_S / lag_s)
        position = command + (position - command) * exp(-PERIOD_S / lag_s)
        seen = round((sampled + noise_deg * rng.standard_normal()) / CODE_DEG) * CODE_DEG
        if k > 20:
            estimate = estimate.seen(step, command - seen)
    return estimate


@pytest.mark.parametrize("lag_s", [0.02, 0.05, 0.1])
def test_the_lag_of_a_first_order_servo_is_found_within_five_milliseconds(lag_s):
    assert learn(lag_s, 1.0, 60.0).lag_s(PHASE_S, PERIOD_S) == pytest.approx(lag_s, abs=0.006)


def test_noise_of_the_encoder_does_not_pretend_a_lag():
    assert learn(0.02, 1.0, 60.0, noise_deg=0.01).lag_s(PHASE_S, PERIOD_S) == pytest.approx(0.02, abs=0.01)


def test_nothing_learned_gives_the_prior():
    assert LagEstimate().lag_s(PHASE_S, PERIOD_S) == PRIOR_LAG_S


def test_a_jump_of_the_encoder_is_not_taken_for_a_lag():
    estimate = learn(0.02, 1.0, 30.0)
    assert estimate.seen(0.1, 10.0) == estimate


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_readings_of_a_line_in_trouble_pretend_no_lag(count: int):
    """Each tells of an antenna four steps behind, 0.4 s at 0.55 deg/s: 0.2 deg of lead, if it were believed."""
    estimate = LagEstimate()
    for _ in range(count):
        estimate = estimate.seen(0.055, 0.2)
    assert (estimate.lag_s(PHASE_S, PERIOD_S) - PRIOR_LAG_S) * 0.55 < 0.03


@pytest.mark.parametrize("lag_s", [0.02, 0.05, 0.1])
def test_a_real_lag_is_learned_within_ten_seconds(lag_s):
    assert learn(lag_s, 0.5, 12.0).lag_s(PHASE_S, PERIOD_S) == pytest.approx(lag_s, abs=0.006)
