"""The safety gate: nothing beyond the limits, nothing faster than the axis, and why."""

from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.intake import RATE_READINGS
from acu_daemon.control.state import ControlState
from acu_daemon.control.tracking.register_limiter import _reachable, limit
from acu_daemon.model import AxisLimits, Pointing
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope

CONFIG = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
DT_S = 0.1
RATE_TOLERANCE_DEG = 0.006  # one 16-bit code
CHASE_S = 5.0  # is enough for 3 degrees, at any rate of the path here

any_angle = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-400, 400)


def at(az_deg: float, el_deg: float, az_rate: float = 0.0, el_rate: float = 0.0) -> ControlState:
    return remembering(
        status=AcuStatus(az_deg % 360.0, el_deg, AcuMode.REMOTE),
        az_deg=az_deg,
        axis_az=AxisState(az_deg, az_rate),
        axis_el=AxisState(el_deg, el_rate),
        was_followed=True,
    )


@given(any_angle, any_angle, any_angle, any_angle, st.booleans())
def test_p5_what_passes_is_always_finite_and_within_the_limits(az, el, az_rate, el_rate, is_followed):
    passed = limit(
        Pointing(az, el, az_rate, el_rate), at(100.0, 45.0), 0.0, is_followed=is_followed, dt_s=DT_S, config=CONFIG
    )
    assert -270.0 <= passed.az.position_deg <= 270.0
    assert 0.0 <= passed.el.position_deg <= 90.0


@given(st.floats(-270, 270), st.floats(0, 90), st.lists(st.tuples(st.floats(-270, 270), st.floats(0, 90)), max_size=20))
def test_p5_followed_registers_never_move_faster_than_the_axis(az, el, targets):
    state = at(az, el)
    for target_az, target_el in targets:
        passed = limit(Pointing(target_az, target_el, 0.0, 0.0), state, 0.0, is_followed=True, dt_s=DT_S, config=CONFIG)
        before_az, before_el = state.registers.axis_az.position_deg, state.registers.axis_el.position_deg
        assert abs(passed.az.position_deg - before_az) <= 20.0 * DT_S + RATE_TOLERANCE_DEG
        assert abs(passed.el.position_deg - before_el) <= 5.0 * DT_S + RATE_TOLERANCE_DEG
        state = remembering(at(passed.az.position_deg, passed.el.position_deg), axis_az=passed.az, axis_el=passed.el)


def test_registers_that_are_not_followed_hold_the_true_path_at_any_speed():
    passed = limit(Pointing(-80.0, 89.9, 170.0, 0.0), at(100.0, 89.8), 0.0, is_followed=False, dt_s=DT_S, config=CONFIG)
    assert passed.az.position_deg == pytest.approx(-80.0, abs=RATE_TOLERANCE_DEG)
    assert not passed.is_held_back


@pytest.mark.parametrize("is_followed", [True, False])
@pytest.mark.parametrize(
    ("az_deg", "el_deg"), [(0.0, 0.0), (30.0, 0.0), (-30.0, 0.0), (0.0, 20.0), (0.0, -20.0), (30.0, 20.0)]
)
def test_what_one_axis_alone_cannot_do_is_held_back_where_it_is_followed(az_deg, el_deg, is_followed):
    wanted = Pointing(100.0 + az_deg, 45.0 + el_deg, 0.0, 0.0)
    passed = limit(wanted, at(100.0, 45.0), 0.0, is_followed=is_followed, dt_s=DT_S, config=CONFIG)
    assert passed.is_held_back == (is_followed and (az_deg, el_deg) != (0.0, 0.0))


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_a_bad_azimuth_is_refused_with_a_reason_and_the_last_good_value_stays(bad):
    passed = limit(Pointing(bad, 45.0, 0.0, 0.0), at(100.0, 45.0), 0.0, is_followed=False, dt_s=DT_S, config=CONFIG)
    assert passed.refusal
    assert passed.az.position_deg == pytest.approx(100.0, abs=RATE_TOLERANCE_DEG)


@pytest.mark.parametrize("is_followed", [True, False])
@pytest.mark.parametrize(
    ("az_deg", "el_deg", "outside"),
    [
        (270.0, 90.0, ""),
        (-270.0, 0.0, ""),
        (270.1, 90.1, ""),
        (-270.1, -0.1, ""),
        (100.0, 90.101, "elevation"),
        (100.0, -0.101, "elevation"),
    ],
)
def test_p5_the_limit_and_a_readings_noise_beyond_it_pass_as_the_limit_and_more_is_said(
    az_deg: float, el_deg: float, outside: str, is_followed: bool
) -> None:
    state = at(min(max(az_deg, -270.0), 270.0), min(max(el_deg, 0.0), 90.0))
    passed = limit(Pointing(az_deg, el_deg, 0.0, 0.0), state, 0.0, is_followed=is_followed, dt_s=DT_S, config=CONFIG)
    assert passed.limited.startswith(outside) and bool(passed.limited) is bool(outside)
    assert not passed.refusal
    assert -270.0 <= passed.az.position_deg <= 270.0
    assert 0.0 <= passed.el.position_deg <= 90.0


def test_p5_a_followed_register_that_stood_through_a_refusal_begins_again_from_a_standstill():
    state = at(100.0, 45.0, az_rate=5.0, el_rate=3.0)
    passed = limit(Pointing(nan, 45.3, 5.0, 3.0), state, 0.0, is_followed=True, dt_s=DT_S, config=CONFIG)
    assert (passed.az.rate_deg_s, passed.el.rate_deg_s) == (0.0, 0.0)
    state = remembering(state, axis_az=passed.az, axis_el=passed.el)
    passed = limit(Pointing(100.5, 45.6, 5.0, 3.0), state, 0.0, is_followed=True, dt_s=DT_S, config=CONFIG)
    assert passed.el.rate_deg_s <= 5.0 * DT_S


def test_a_hair_below_the_horizon_is_sent_as_the_limit_not_as_359_999():
    passed = limit(Pointing(0.0, -0.001, 0.0, 0.0), at(0.0, 0.0), 0.0, is_followed=False, dt_s=DT_S, config=CONFIG)
    assert passed.el.position_deg == 0.0
    assert not passed.refusal


def test_an_antenna_far_from_the_register_it_begins_to_follow_starts_from_where_it_is():
    state = remembering(at(100.0, 80.0), axis_az=AxisState(200.0), was_followed=False)
    passed = limit(Pointing(200.0, 80.0, 0.0, 0.0), state, 0.0, is_followed=True, dt_s=DT_S, config=CONFIG)
    assert abs(passed.az.position_deg - 100.0) < 1.0


def test_a_path_the_axis_can_follow_passes_unchanged():
    state = at(100.0, 45.0, az_rate=0.5, el_rate=0.3)
    passed = limit(Pointing(100.05, 45.03, 0.5, 0.3), state, 0.0, is_followed=True, dt_s=DT_S, config=CONFIG)
    assert not passed.is_held_back
    assert passed.az.position_deg == pytest.approx(100.05, abs=RATE_TOLERANCE_DEG / 2)


@pytest.mark.parametrize("el_deg", [10.0, 40.0, 60.0, 75.0, 85.0])
@pytest.mark.parametrize("rate_deg_s", [-4.0, -1.0, 0.5, 1.0, 2.0, 4.0])
def test_registers_that_begin_beside_a_moving_path_come_onto_it_and_not_only_to_the_edge_of_the_beam(
    el_deg: float, rate_deg_s: float
) -> None:
    state = at(100.0, el_deg)
    for tick in range(1, 1 + round(CHASE_S / DT_S)):
        path = Pointing(103.0 + rate_deg_s * DT_S * tick, el_deg, rate_deg_s, 0.0)
        passed = limit(path, state, 0.0, is_followed=True, dt_s=DT_S, config=CONFIG)
        state = remembering(at(passed.az.position_deg, passed.el.position_deg), axis_az=passed.az, axis_el=passed.el)
    assert passed.az.position_deg == pytest.approx(path.az_deg, abs=RATE_TOLERANCE_DEG)


@pytest.mark.parametrize("period_s", [0.1, 0.15])  # the shortest and the longest that station.toml allows
def test_the_antennas_own_rate_is_known_at_every_period(period_s: float) -> None:
    """An antenna that comes at 10 deg/s to a register that it is about to follow is met where it will be."""
    readings = tuple((period_s * k, 100.0 + 10.0 * period_s * k, 45.0) for k in range(RATE_READINGS))
    now_s = readings[-1][0] + period_s
    state = remembering(at(readings[-1][1], 45.0), axis_az=None, axis_el=None, track_of_readings=readings)
    here = Pointing(100.0 + 10.0 * now_s, 45.0, 0.0, 0.0)
    passed = limit(here, state, now_s, is_followed=True, dt_s=period_s, config=CONFIG)
    assert passed.az.position_deg == pytest.approx(here.az_deg, abs=RATE_TOLERANCE_DEG)


NARROW = replace(CONFIG, envelope=replace(CONFIG.envelope, azimuth=AxisLimits(-150.0, 150.0, 20.0, 10.0)))


@pytest.mark.parametrize("is_followed", [True, False])
@pytest.mark.parametrize(
    ("az_deg", "from_deg", "held_deg"),
    [(160.0, 150.0, 150.0), (178.0, 150.0, 150.0), (178.0, -150.0, -150.0), (-160.0, -150.0, -150.0)],
)
def test_p5_an_azimuth_that_no_turn_reaches_is_held_at_the_nearer_end_and_the_elevation_follows(
    az_deg: float, from_deg: float, held_deg: float, is_followed: bool
) -> None:
    path = Pointing(az_deg, 45.03, 1.0, 0.3)
    passed = limit(path, at(from_deg, 45.0, 0.0, 0.3), 0.0, is_followed=is_followed, dt_s=DT_S, config=NARROW)
    assert passed.az.position_deg == pytest.approx(held_deg, abs=RATE_TOLERANCE_DEG)
    assert passed.el.position_deg == pytest.approx(45.03, abs=RATE_TOLERANCE_DEG)
    assert passed.limited == f"azimuth outside -150 to 150 deg, held at {held_deg:g}"
    assert not passed.is_held_back


@pytest.mark.parametrize("is_followed", [True, False])
def test_p5_an_elevation_outside_its_limits_is_held_at_the_nearer_one_and_the_azimuth_follows(is_followed) -> None:
    flat = replace(CONFIG, envelope=replace(CONFIG.envelope, elevation=AxisLimits(7.0, 66.0, 5.0, 5.0)))
    for el_deg, held_deg in ((67.4, 66.0), (5.0, 7.0)):
        state = at(100.0, held_deg, 2.0)
        passed = limit(Pointing(100.2, el_deg, 2.0, 0.0), state, 0.0, is_followed=is_followed, dt_s=DT_S, config=flat)
        assert passed.el.position_deg == pytest.approx(held_deg, abs=RATE_TOLERANCE_DEG)
        assert passed.az.position_deg == pytest.approx(100.2, abs=RATE_TOLERANCE_DEG)
        assert passed.limited.startswith("elevation outside 7 to 66 deg, held at")


AXIS_AT = {"position_deg": st.floats(-60.0, 60.0), "rate_deg_s": st.floats(-20.0, 20.0)}


@given(
    st.builds(AxisState, **AXIS_AT),
    st.builds(AxisState, **AXIS_AT),
    st.floats(0.05, 0.3),
    st.floats(0.5, 20.0),
)
def test_an_axis_comes_to_a_falling_path_as_it_comes_to_a_rising_one(start, wanted, dt_s, half_beam_deg) -> None:
    def mirrored(axis: AxisState) -> AxisState:
        return AxisState(-axis.position_deg, -axis.rate_deg_s)

    limits = AxisLimits(-270.0, 270.0, 20.0, 10.0)
    right = _reachable(start, wanted, dt_s, limits, half_beam_deg)
    left = mirrored(_reachable(mirrored(start), mirrored(wanted), dt_s, limits, half_beam_deg))
    assert (left.position_deg, left.rate_deg_s) == pytest.approx((right.position_deg, right.rate_deg_s), abs=1e-9)


@pytest.mark.parametrize("sign", [1, -1])
def test_an_axis_behind_a_path_that_takes_nearly_all_of_its_drive_is_let_run_faster_than_the_path(sign: int) -> None:
    limits = AxisLimits(-270.0, 270.0, 20.0, 10.0)
    axis, path_deg = AxisState(0.0, sign * 18.0), 30.0
    for k in range(100):
        axis = _reachable(axis, AxisState(sign * (path_deg + 1.9 * k), sign * 19.0), 0.1, limits, 0.5)
    assert sign * axis.rate_deg_s > 19.3
