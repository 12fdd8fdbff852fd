"""Boresight, backlash and the turn of the cable of the satellite's antenna, on either side and in both directions."""

import numpy as np
import pytest

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.corrections import after_backlash, aimed, best_turn_deg, with_backlash
from acu_daemon.onboard.gimbal_frames import Gimbal, angles_between_deg, beam_direction
from acu_daemon.onboard.quintic import Path

EXACT_DEG = 1e-9
ALIGNED = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("cross_deg", [-0.7, 0.0, 0.7])
@pytest.mark.parametrize("up_deg", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("from_deg", [-190.0, 20.0, 150.0])
def test_the_beam_of_any_boresight_is_put_on_its_targets(from_deg: float, up_deg: float, cross_deg: float) -> None:
    az_deg = np.linspace(from_deg, from_deg + 80.0, 21)
    el_deg = np.linspace(3.0, 110.0, 21)
    p = 2.0e6 * beam_direction(Gimbal(az_deg, el_deg), ALIGNED)
    cone = Cone(2.0, up_deg, cross_deg)
    gimbal = aimed(p, cone)
    off = angles_between_deg(beam_direction(gimbal, cone.boresight), p / 2.0e6)
    assert np.max(off) < EXACT_DEG
    assert np.max(np.abs(np.diff(gimbal.az_deg))) < 20.0
    assert gimbal.el_deg == pytest.approx(el_deg - up_deg, abs=0.1)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_axis_leads_against_the_offset_across_the_more_the_nearer_to_the_zenith(sign: float) -> None:
    p = beam_direction(Gimbal(np.full(2, 40.0), np.array([90.0, 30.0])), ALIGNED)
    got = aimed(p, Cone(2.0, 0.0, sign * 0.5))
    assert got.az_deg[0] == pytest.approx(40.0 - sign * 0.5, abs=1e-6)
    assert got.az_deg[1] == pytest.approx(40.0 - sign * 1.0, abs=1e-3)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_nearer_to_the_axis_than_the_offset_the_beam_comes_as_near_as_it_can(sign: float) -> None:
    p = beam_direction(Gimbal(np.full(1, 10.0), np.full(1, 0.2)), ALIGNED)
    cone = Cone(2.0, 0.0, sign * 0.5)
    gimbal = aimed(p, cone)
    assert gimbal.az_deg[0] == pytest.approx(10.0 - sign * 90.0)
    assert angles_between_deg(beam_direction(gimbal, cone.boresight), p)[0] == pytest.approx(0.3, abs=EXACT_DEG)
    on_axis = aimed(ALIGNED[None], cone)
    assert np.isfinite(on_axis.az_deg).all()
    assert angles_between_deg(beam_direction(on_axis, cone.boresight), ALIGNED[None])[0] == pytest.approx(0.5)


def straight(rate_deg_s: float) -> Path:
    return Path(np.zeros(1), np.full(1, 100.0), np.array([[7.0, rate_deg_s, 0.0, 0.0, 0.0, 0.0]]))


@pytest.mark.parametrize(
    ("rate", "share"), [(0.02, 0.5**0.5), (-0.02, -(0.5**0.5)), (5.0, 1.0), (-5.0, -1.0), (0.0, 0.0)]
)
def test_commands_lead_by_half_the_backlash_in_the_direction_of_the_motion(rate: float, share: float) -> None:
    time_s = np.array([0.0, 1.0, 10.0])
    led = with_backlash(straight(rate), time_s, 0.6)
    assert led == pytest.approx(7.0 + rate * time_s + 0.3 * share, abs=1e-5)
    assert with_backlash(straight(rate), time_s, 0.0) == pytest.approx(7.0 + rate * time_s, abs=EXACT_DEG)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_antenna_follows_half_the_backlash_behind_and_rests_while_the_play_is_taken_up(sign: float) -> None:
    commands = sign * np.array([0.0, 1.0, 2.0, 1.8, 1.5, 1.2, 0.0, 0.3, 0.6, 2.0])
    antenna = sign * np.array([-0.25, 0.75, 1.75, 1.75, 1.75, 1.45, 0.25, 0.25, 0.35, 1.75])
    assert after_backlash(commands, 0.5) == pytest.approx(antenna, abs=EXACT_DEG)


def test_without_motion_at_the_start_the_antenna_stands_where_it_is_told() -> None:
    assert after_backlash(np.array([3.0, 3.0, 3.1, 3.4]), 0.4) == pytest.approx([3.0, 3.0, 3.0, 3.2], abs=EXACT_DEG)


def test_without_backlash_the_antenna_is_where_the_motor_is() -> None:
    assert after_backlash(np.array([1.0, -2.0]), 0.0).tolist() == [1.0, -2.0]


@pytest.mark.parametrize(
    ("low", "high", "limits", "turn_deg"),
    [
        (-50.0, 60.0, (-270.0, 270.0), 0.0),
        (190.0, 300.0, (-270.0, 270.0), -360.0),
        (-300.0, -190.0, (-270.0, 270.0), 360.0),
        (600.0, 700.0, (-270.0, 270.0), -720.0),
        (-700.0, -600.0, (-270.0, 270.0), 720.0),
        (0.0, 90.0, (-360.0, 720.0), 0.0),  # all of three turns fit: the most central one
        (-90.0, 0.0, (-360.0, 720.0), 360.0),
        (-20.0, 10.0, (300.0, 760.0), 360.0),  # 340 to 370, not 700 to 730
        (150.0, 200.0, (-180.0, 180.0), 0.0),  # none fits: 20 over, on the other turn 30
        (160.0, 220.0, (-180.0, 180.0), -360.0),
        (-220.0, -160.0, (-180.0, 180.0), 360.0),
        (100.0, 200.0, (-270.0, 180.0), -360.0),  # it fits, where the other one is nearer to the middle but over
        (-200.0, -100.0, (-180.0, 270.0), 360.0),
        (-170.0, 170.0, (-100.0, 100.0), 0.0),  # over on both sides
        (180.0, 270.0, (-270.0, 270.0), -360.0),  # as far as the end is in, and more central
        (-180.0, 0.0, (-180.0, 300.0), 0.0),
    ],
)
def test_the_turn_is_the_one_in_range_or_nearest_to_it_and_the_most_central_of_several(
    low: float, high: float, limits: tuple[float, float], turn_deg: float
) -> None:
    az_deg = np.array([(low + high) / 2.0, high, low])
    assert best_turn_deg(az_deg, AxisLimits(*limits, 10.0, 10.0)) == turn_deg
