"""pointing.wrap: the turn of the cable wrap for a whole pass."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.wrap import choose_turn, encoder_continuous, nearest_turn, sector_for

WRAP = AxisLimits(-270.0, 270.0, 20.0, 10.0)


def _path(start_deg: float, turn_deg: float, top_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Azimuth and elevation of a straight pass at closest approach top_deg, turning by turn_deg in all."""
    x = np.linspace(-1.0, 1.0, 401)
    slant = 1.0 / np.tan(np.radians(top_deg))
    along = 8.0 * x
    az = np.degrees(np.arctan2(along, slant))
    return start_deg + turn_deg / 2 * (1 + az / az[-1]), np.degrees(np.arctan2(1.0, np.hypot(along, slant)))


def test_the_whole_pass_fits_the_wrap_and_lies_nearest_to_the_present_angle():
    az, el = _path(300.0, 150.0, 40.0)  # 300 to 450: at -360 it runs from -60 to 90
    turn = choose_turn(az, el, WRAP, present_az_deg=250.0)
    assert (turn.offset_deg, turn.holds_path, turn.held_fraction) == (-360.0, True, 1.0)


def test_of_two_turns_that_fit_the_nearest_to_the_present_angle_is_taken():
    az, el = _path(120.0, 100.0, 40.0)  # 120 to 220, or -240 to -140
    assert choose_turn(az, el, WRAP, present_az_deg=30.0).offset_deg == 0.0
    assert choose_turn(az, el, WRAP, present_az_deg=-200.0).offset_deg == -360.0


def test_near_the_zenith_the_turn_that_holds_both_ways_round_is_preferred():
    """100 -> 275 clockwise, else 100 -> -85; at -360 the ways end at -85 and at -445, beyond the wrap."""
    limits = AxisLimits(-300.0, 300.0, 20.0, 10.0)
    az, el = _path(100.0, 175.0, 89.0)
    turn = choose_turn(az, el, limits, present_az_deg=-270.0)
    assert (turn.offset_deg, turn.holds_either_way) == (0.0, True)
    low_az, low_el = _path(100.0, 175.0, 80.0)
    assert choose_turn(low_az, low_el, limits, present_az_deg=-270.0).offset_deg == -360.0


def test_a_turn_that_holds_the_prediction_only_says_so():
    az, el = _path(200.0, 178.0, 89.5)
    turn = choose_turn(az, el, WRAP, present_az_deg=0.0)
    assert (turn.offset_deg, turn.holds_path, turn.holds_either_way) == (-360.0, True, False)
    assert "other side" in turn.reason


def test_if_nothing_fits_the_turn_that_holds_the_path_longest_is_taken_and_it_says_so():
    limits = AxisLimits(-170.0, 170.0, 20.0, 10.0)
    az, el = _path(90.0, 120.0, 40.0)  # leaves at 170 after more than half
    turn = choose_turn(az, el, limits, present_az_deg=0.0)
    assert turn.offset_deg == 0.0
    assert not turn.holds_path
    assert 0.5 < turn.held_fraction < 0.9
    assert "no turn holds" in turn.reason


@given(az=st.floats(0.0, 359.999), near=st.floats(-270.0, 270.0))
def test_the_nearest_turn_has_the_bearing_and_lies_within_the_limits(az, near):
    turn = nearest_turn(az, near, WRAP)
    assert turn is not None
    assert WRAP.min_deg <= turn <= WRAP.max_deg
    assert (turn - az + 1e-6) % 360.0 == pytest.approx(1e-6, abs=1e-7)
    others = [az + 360.0 * k for k in range(-2, 3) if WRAP.min_deg <= az + 360.0 * k <= WRAP.max_deg]
    assert abs(turn - near) <= min(abs(other - near) for other in others) + 1e-9


def test_a_bearing_that_no_turn_reaches_is_none():
    assert nearest_turn(180.0, 0.0, AxisLimits(-170.0, 170.0, 20.0, 10.0)) is None


@given(continuous=st.floats(-270.0, 270.0))
def test_bearing_and_sector_give_back_the_continuous_angle(continuous):
    again = encoder_continuous(continuous % 360.0, sector_for(continuous, WRAP) == 2, WRAP)
    assert again == pytest.approx(continuous, abs=1e-9)


def test_a_bearing_rounded_across_the_middle_stays_beside_it():
    assert encoder_continuous(359.9945, True, WRAP) == pytest.approx(-0.0055)
    assert encoder_continuous(0.0, False, WRAP) == pytest.approx(0.0)
