"""Which tilt is chosen for a pass by hand-made paths over the zenith: its sign, its limits, its steps, its drive."""

import numpy as np
import pytest

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.tilt import Tilt, TiltAxis, choose_tilt

ELEVATION = AxisLimits(0.0, 90.0, 5.0, 5.0)
SLOW = AxisLimits(-270.0, 270.0, 2.0, 50.0)


def over_the_zenith(beside_deg: float, step_s: float = 0.5, course_deg: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A great circle at 0.7 deg/s, so far beside the zenith to the right of its course."""
    t, miss = np.arange(-100.0, 100.0 + step_s / 2, step_s), np.radians(beside_deg)
    along = np.radians(0.7 * t)
    ahead, right, up = np.sin(along), np.cos(along) * np.sin(miss), np.cos(along) * np.cos(miss)
    return (course_deg + np.degrees(np.arctan2(right, ahead))) % 360.0, np.degrees(np.arcsin(up))


def chosen(beside_deg: float, limits: tuple[float, float], towards_deg: float = 90.0, **more: float) -> float:
    axis = TiltAxis(AxisLimits(*limits, 1.0, 0.5), towards_deg)
    return choose_tilt(axis, *over_the_zenith(beside_deg, **more), more.get("step_s", 0.5), SLOW, ELEVATION)


def least_that_follows(beside_deg: float) -> float:
    """The distance from the pedestal's zenith at which the path asks 0.9 of the drive, less what there is."""
    return np.degrees(np.arcsin(0.7 / (0.9 * SLOW.max_rate_deg_s))) - beside_deg


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("course_deg", "towards_deg"), [(0.0, 90.0), (70.0, 160.0), (180.0, 270.0), (0.0, 270.0)])
def test_the_axis_leans_away_from_the_pass_by_the_least_of_its_steps(
    side: float, course_deg: float, towards_deg: float
) -> None:
    angle_deg = chosen(side * 0.7, (-40.0, 40.0), towards_deg, course_deg=course_deg)
    sign = -side if (towards_deg - course_deg) % 360.0 == 90.0 else side
    least_deg = float(least_that_follows(0.7))
    assert angle_deg == sign * 0.5 * np.ceil(least_deg / 0.5)


@pytest.mark.parametrize(
    ("limits", "of_right_deg", "of_left_deg"),
    [
        ((-5.0, 5.0), -4.5, 4.5),
        ((-4.5, 4.5), -4.5, 4.5),
        ((-4.75, 4.49), -4.5, 0.0),
        ((-4.49, 4.75), 0.0, 4.5),
        ((-5.0, 0.0), -4.5, -5.0),
        ((0.0, 5.0), 5.0, 4.5),
        ((-0.4, 0.4), 0.0, 0.0),
        ((0.0, 0.0), 0.0, 0.0),
    ],
)
def test_only_whole_steps_within_the_limits_are_tried_both_ends_among_them(
    limits: tuple[float, float], of_right_deg: float, of_left_deg: float
) -> None:
    """A drive that follows from 4.6 deg beside its zenith on; what is nearer and not over it is missed for longer."""
    drive = AxisLimits(-270.0, 270.0, 0.7 / np.sin(np.radians(4.6)) / 0.9, 50.0)
    axis = TiltAxis(AxisLimits(*limits, 1.0, 0.5), 90.0)
    for beside_deg, expected_deg in ((0.2, of_right_deg), (-0.2, of_left_deg)):
        assert choose_tilt(axis, *over_the_zenith(beside_deg), 0.5, drive, ELEVATION) == expected_deg


@pytest.mark.parametrize("step_s", [0.25, 0.5, 1.0])
def test_the_choice_does_not_depend_on_how_fine_the_pass_is_sampled(step_s: float) -> None:
    assert chosen(0.7, (-40.0, 40.0), step_s=step_s) == pytest.approx(chosen(0.7, (-40.0, 40.0)), abs=0.5)


def test_a_drive_that_is_slow_to_turn_is_leant_for_as_one_that_turns_slowly() -> None:
    axis, path = TiltAxis(AxisLimits(-40.0, 40.0, 1.0, 0.5), 90.0), over_the_zenith(5.0)
    assert choose_tilt(axis, *path, 0.5, AxisLimits(-270.0, 270.0, 20.0, 50.0), ELEVATION) == 0.0
    assert abs(choose_tilt(axis, *path, 0.5, AxisLimits(-270.0, 270.0, 20.0, 0.5), ELEVATION)) > 1.0


@pytest.mark.parametrize(
    ("end", "limits"), [("low", AxisLimits(10.0, 90.0, 5.0, 5.0)), ("high", AxisLimits(0.0, 85.0, 5.0, 5.0))]
)
def test_what_lies_beyond_the_elevations_limits_counts_as_missed_and_the_limit_itself_does_not(
    end: str, limits: AxisLimits
) -> None:
    """A path that stands: only whether it is reached decides."""
    axis, fast = TiltAxis(AxisLimits(-10.0, 10.0, 1.0, 0.5), 90.0), AxisLimits(-270.0, 270.0, 20.0, 50.0)
    at_deg, inward = (10.0, 1.0) if end == "low" else (85.0, -1.0)
    for beyond_deg, expected_deg in ((0.001, 0.0), (-0.75, 1.0), (-2.0, 2.0)):
        az, el = np.full(50, 90.0), np.full(50, at_deg + inward * beyond_deg)
        angle_deg = choose_tilt(axis, az, el, 0.5, fast, limits)
        _, el_there = Tilt(angle_deg, 90.0).to_pedestal(az, el)
        assert limits.min_deg - 1e-9 <= float(el_there[0]) <= limits.max_deg + 1e-9
        assert abs(angle_deg) == expected_deg


@pytest.mark.parametrize("angle_deg", [-30.0, -5.0, 5.0, 30.0])
@pytest.mark.parametrize("towards_deg", [0.0, 90.0, 200.0])
def test_rates_about_leaning_axes_are_the_differences_of_the_angles_in_every_quadrant(
    angle_deg: float, towards_deg: float
) -> None:
    tilt, step_s = Tilt(angle_deg, towards_deg), 1e-4
    az = np.repeat(np.arange(15.0, 375.0, 40.0), 4)
    el = np.tile([-5.0, 20.0, 45.0, 58.0], 9)
    for rates in ((1.0, 0.0), (0.0, 1.0), (-0.7, 0.4)):
        found = tilt.rates_to_pedestal(az, el, *rates)
        before, after = (tilt.to_pedestal(az + s * rates[0], el + s * rates[1]) for s in (-step_s, step_s))
        for rate, one, other in zip(found, before, after, strict=True):
            assert np.allclose(rate, (other - one) / (2.0 * step_s), rtol=1e-5, atol=1e-6)
