"""pointing.axis: the rate- and acceleration-limited follower of one axis."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.axis import AxisState, step

LIMITS = AxisLimits(-270.0, 270.0, 20.0, 10.0)
DT_S = 0.1
ROUNDING = 1e-9


def _run(state: AxisState, targets: list[tuple[float, float]]) -> list[AxisState]:
    states = [state]
    for target, rate in targets:
        states.append(step(states[-1], target, rate, DT_S, LIMITS))
    return states


def _moving(start_deg: float, rate_deg_s: float, count: int) -> list[tuple[float, float]]:
    return [(start_deg + rate_deg_s * DT_S * (k + 1), rate_deg_s) for k in range(count)]


@pytest.mark.long
@given(
    start=st.floats(-200.0, 200.0),
    target=st.floats(-200.0, 200.0),
    own_rate=st.floats(-20.0, 20.0),
    rate=st.floats(-18.0, 18.0),
)
def test_a_target_of_constant_rate_is_reached_exactly_and_then_held_exactly(start, target, own_rate, rate):
    targets = _moving(target, rate, 3500)
    states = _run(AxisState(start, own_rate), targets)
    assert states[-1] == AxisState(*targets[-1])
    first = next(k for k, (s, t) in enumerate(zip(states[1:], targets, strict=True)) if s == AxisState(*t))
    assert all(s == AxisState(*t) for s, t in zip(states[1 + first :], targets[first:], strict=True))


@given(
    start=st.floats(-200.0, 200.0),
    own_rate=st.floats(-20.0, 20.0),
    path=st.lists(st.tuples(st.floats(-300.0, 300.0), st.floats(-100.0, 100.0)), min_size=1, max_size=60),
)
def test_whatever_the_target_does_rate_and_acceleration_stay_within_the_drive(start, own_rate, path):
    states = _run(AxisState(start, own_rate), path)
    position, rate = np.array([(s.position_deg, s.rate_deg_s) for s in states]).T
    assert np.all(np.abs(rate) <= LIMITS.max_rate_deg_s + ROUNDING)
    assert np.all(np.abs(np.diff(rate)) <= LIMITS.max_acceleration_deg_s2 * DT_S + ROUNDING)
    assert np.all(np.abs(np.diff(position)) <= LIMITS.max_rate_deg_s * DT_S + ROUNDING)


@given(distance=st.floats(-180.0, 180.0), rate=st.floats(-10.0, 10.0))
def test_from_the_targets_own_rate_it_closes_in_without_overshoot(distance, rate):
    targets = _moving(0.0, rate, 1500)
    states = _run(AxisState(-distance, rate), targets)
    left = np.array([t[0] - s.position_deg for s, t in zip(states[1:], targets, strict=True)]) * np.sign(distance)
    assert np.all(left >= -ROUNDING)


def test_a_half_turn_takes_the_time_of_a_trapezoid():
    """20 deg/s and 10 deg/s^2: 180/20 + 20/10 = 11 s; the steps may cost a few tenths."""
    states = _run(AxisState(0.0), [(180.0, 0.0)] * 200)
    first = next(k for k, s in enumerate(states) if s.position_deg == 180.0)
    assert 11.0 <= first * DT_S <= 11.3


def test_a_smooth_path_within_the_limits_is_followed_without_any_lag():
    t = DT_S * np.arange(1, 600)
    path = list(zip((40 * np.sin(t / 3)).tolist(), (40 / 3 * np.cos(t / 3)).tolist(), strict=True))
    states = _run(AxisState(0.0, 40 / 3), path)
    assert [s.position_deg for s in states[1:]] == [p for p, _ in path]
