"""pointing.wrap: the turn of the cable wrap for a whole pass."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.wrap import choose_turn, encoder_continuous, nearest_end_deg, nearest_turn, sector_for

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


RANGES_OF_ONE_TURN = [(0.0, 360.0), (-180.0, 180.0), (-90.0, 270.0), (10.0, 350.0), (-170.0, 170.0), (30.0, 200.0)]


def _limits(min_deg: float, max_deg: float) -> AxisLimits:
    return AxisLimits(min_deg, max_deg, 20.0, 10.0)


@pytest.mark.parametrize("bit", [False, True])
@pytest.mark.parametrize(("min_deg", "max_deg"), RANGES_OF_ONE_TURN)
@given(share=st.floats(0.0005, 0.9995))
def test_with_a_range_of_at_most_a_turn_the_only_turn_inside_is_taken_whatever_the_bit_says(
    min_deg, max_deg, bit, share
):
    continuous = min_deg + share * (max_deg - min_deg)
    assert encoder_continuous(continuous % 360.0, bit, _limits(min_deg, max_deg)) == pytest.approx(continuous, abs=1e-9)


@pytest.mark.parametrize("bit", [False, True])
def test_an_azimuth_of_300_in_a_range_of_0_to_360_is_300(bit):
    assert encoder_continuous(300.0, bit, _limits(0.0, 360.0)) == 300.0


@pytest.mark.parametrize("bit", [False, True])
@pytest.mark.parametrize(("bearing", "continuous"), [(300.0, 300.0), (91.0, 91.0), (359.0, 359.0)])
def test_in_a_wider_range_a_bearing_that_one_turn_reaches_needs_no_bit(bearing, continuous, bit):
    assert encoder_continuous(bearing, bit, _limits(0.0, 450.0)) == continuous


@given(continuous=st.floats(0.0, 450.0), min_deg=st.sampled_from([0.0, -90.0, -270.0]))
def test_in_a_wider_range_a_right_bit_gives_the_right_turn(continuous, min_deg):
    limits, there = _limits(min_deg, min_deg + 450.0), continuous + min_deg
    assert encoder_continuous(there % 360.0, there >= min_deg + 225.0, limits) == pytest.approx(there, abs=1e-9)


@given(continuous=st.floats(-270.0, 270.0), step=st.floats(-150.0, 150.0), bit=st.booleans())
def test_where_the_axis_was_decides_before_the_bit(continuous, step, bit):
    near = min(max(continuous + step, -270.0), 270.0)
    assert encoder_continuous(continuous % 360.0, bit, WRAP, near_deg=near) == pytest.approx(continuous, abs=1e-9)


@pytest.mark.parametrize(
    ("bearing", "end", "near", "continuous"),
    [
        (359.9945, -1, None, -0.0055),  # an LSB below the lower end
        (0.0055, 1, None, 360.0055),
        (0.0, 1, None, 360.0),
        (359.9945, 0, 0.003, -0.0055),
        (0.0055, 0, 359.99, 360.0055),
        (359.9945, 0, None, 359.9945),
        (0.0055, 0, None, 0.0055),
    ],
)
def test_at_the_ends_of_exactly_a_turn_the_limit_switch_and_the_last_place_decide(bearing, end, near, continuous):
    found = encoder_continuous(bearing, False, _limits(0.0, 360.0), near_deg=near, end=end)
    assert found == pytest.approx(continuous, abs=1e-9)


def test_a_bearing_that_no_turn_reaches_is_shown_beside_the_end_it_is_nearest_to():
    limits = _limits(-170.0, 160.0)
    assert encoder_continuous(185.0, True, limits) == -175.0
    assert encoder_continuous(165.0, False, limits) == 165.0


def test_a_bearing_between_the_ends_goes_to_the_nearer_one_and_in_the_middle_stays_where_it_is():
    limits = _limits(-150.0, 150.0)
    assert nearest_end_deg(160.0, 0.0, limits) == 150.0
    assert nearest_end_deg(200.0, 0.0, limits) == -150.0
    assert nearest_end_deg(178.0, -100.0, limits) == nearest_end_deg(182.0, -100.0, limits) == -150.0
    assert nearest_end_deg(178.0, 100.0, limits) == nearest_end_deg(182.0, 100.0, limits) == 150.0


def test_of_turns_that_do_not_hold_the_start_the_one_that_holds_most_is_taken():
    az, el = _path(250.0, -150.0, 40.0)
    turn = choose_turn(az, el, _limits(0.0, 200.0), present_az_deg=10.0)
    assert (turn.offset_deg, turn.held_fraction) == (0.0, 0.0)
    assert 0.3 < turn.inside_fraction < 0.9
