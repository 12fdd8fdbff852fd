"""The checks of a profile, and those of what a tracking-parameter file says of itself, at their limits."""

from dataclasses import replace

import numpy as np
import pytest
from onboard_tasks import FREE, drawn_task

from acu_daemon.errors import UsageError
from acu_daemon.model import AxisLimits
from acu_daemon.onboard.bound import Bound
from acu_daemon.onboard.branches import least_bound
from acu_daemon.onboard.checks import Backlash, Check, check_axis, check_communication, check_profile
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.gimbal_frames import Gimbal
from acu_daemon.onboard.parameter_file import ParameterFile
from acu_daemon.onboard.profile import Profile, Task, off_pointing
from acu_daemon.onboard.quintic import Path
from acu_daemon.onboard.recheck import UNLIMITED, check_certificate, check_peaks, grid_s
from acu_daemon.units import Array

TIMES = 0.05 * np.arange(201)
COUNT = TIMES.size


def line(*coefficients: float, length_s: float = 10.0) -> Path:
    return Path(np.zeros(1), np.array([length_s]), np.array([[*coefficients, *[0.0] * (6 - len(coefficients))]]))


def task(margin_deg: float = 1.0, azimuth: AxisLimits = FREE) -> Task:
    """The station goes from azimuth 20 to 50 at 90 deg from the axis, in 10 s."""
    return drawn_task(20.0 + 3.0 * TIMES, np.full(COUNT, 90.0), Cone(margin_deg), azimuth)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_beams_worst_angle_is_told_with_its_time_and_for_how_long_the_contact_is_lost(sign: float) -> None:
    off = np.zeros(COUNT)
    off[40:43], off[100] = sign * 1.2, sign * 1.5
    found = check_communication(task(), Gimbal(20.0 + 3.0 * TIMES + off, np.full(COUNT, 90.0)))
    assert (found.name, found.limit, found.unit, found.is_met) == ("off-pointing", 1.0, "deg", False)
    assert found.value == pytest.approx(1.5)
    assert found.detail == " at 5.0 s, contact lost for 0.20 s"
    held = check_communication(task(1.6), Gimbal(20.0 + 3.0 * TIMES + off, np.full(COUNT, 90.0)))
    assert (held.is_met, held.detail, held.limit) == (True, " at 5.0 s", 1.6)


def test_at_the_very_margin_the_contact_is_kept() -> None:
    antenna = Gimbal(20.0 + 3.0 * TIMES, 90.0 + 0.1 * TIMES)
    off = off_pointing(task(), antenna, task().view)
    assert check_communication(task(float(off.max())), antenna).is_met
    assert not check_communication(task(float(off.max()) - 1e-9), antenna).is_met
    assert check_communication(task(float(off.max()) - 1e-9), antenna).detail.endswith("lost for 0.05 s")


def axis(path: Path, limits: AxisLimits, times: Array = TIMES) -> dict[str, Check]:
    found = check_axis("azimuth", path, limits, times)
    assert [one.name for one in found] == [f"azimuth {k}" for k in ("range", "rate", "acceleration", "joints")]
    assert [one.unit for one in found] == ["deg", "deg/s", "deg/s2", "deg"]
    return {one.name.removeprefix("azimuth "): one for one in found}


@pytest.mark.parametrize(
    ("low", "high", "value", "edge", "is_met"),
    [
        (-100.0, 100.0, 20.0, 100.0, True),  # 80 and 90 of room
        (-12.0, 100.0, -10.0, -12.0, True),
        (-100.0, 21.0, 20.0, 21.0, True),
        (-9.0, 100.0, -10.0, -9.0, False),
        (-100.0, 19.0, 20.0, 19.0, False),
        (-10.0, 20.0, 20.0, 20.0, True),
        (-9.0, 18.0, 20.0, 18.0, False),
        (-8.0, 19.0, -10.0, -8.0, False),
        (-10.0 + 0.5e-6, 100.0, -10.0, -10.0 + 0.5e-6, True),
        (-10.0 + 2e-6, 100.0, -10.0, -10.0 + 2e-6, False),
        (-100.0, 20.0 - 0.5e-6, 20.0, 20.0 - 0.5e-6, True),
        (-100.0, 20.0 - 2e-6, 20.0, 20.0 - 2e-6, False),
    ],
)
def test_the_range_is_told_by_the_end_that_is_nearest(
    low: float, high: float, value: float, edge: float, is_met: bool
) -> None:
    for path in (line(-10.0, 3.0), line(20.0, -3.0)):
        found = axis(path, AxisLimits(low, high, 9.0, 9.0))["range"]
        assert (found.value, found.limit, found.is_met) == (pytest.approx(value), edge, is_met)
        assert found.detail == " (-10.00 to 20.00)"


@pytest.mark.parametrize(("at", "edge", "is_met"), [(81.0, 80.0, True), (99.0, 100.0, True), (101.0, 100.0, False)])
def test_an_axis_at_rest_is_told_the_limit_that_is_nearest(at: float, edge: float, is_met: bool) -> None:
    found = axis(line(at, 0.0), AxisLimits(80.0, 100.0, 9.0, 9.0))["range"]
    assert (found.value, found.limit, found.is_met) == (at, edge, is_met)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_rate_and_acceleration_have_limits_of_their_own_that_may_be_reached(sign: float) -> None:
    path = line(0.0, 0.0, sign * 0.25)  # to 5 deg/s, always 0.5 deg/s2
    found = axis(path, AxisLimits(-90.0, 90.0, 5.0, 0.5))
    assert (found["rate"].value, found["rate"].limit, found["rate"].is_met) == (5.0, 5.0, True)
    assert (found["acceleration"].value, found["acceleration"].limit) == (0.5, 0.5)
    assert found["acceleration"].is_met
    slow = axis(path, AxisLimits(-90.0, 90.0, 4.999, 0.5))
    assert (slow["rate"].is_met, slow["acceleration"].is_met) == (False, True)
    weak = axis(path, AxisLimits(-90.0, 90.0, 5.0, 0.499))
    assert (weak["rate"].is_met, weak["acceleration"].is_met) == (True, False)


@pytest.mark.parametrize(("jump_deg", "is_met"), [(0.0, True), (0.9e-6, True), (1.1e-6, False), (-1.1e-6, False)])
def test_a_joint_may_jump_by_what_the_rounding_makes(jump_deg: float, is_met: bool) -> None:
    coefficients = np.array([[0.0, 1.0, 0, 0, 0, 0], [5.0 + jump_deg, 1.0, 0, 0, 0, 0]])
    found = axis(Path(np.array([0.0, 5.0]), np.full(2, 5.0), coefficients), FREE)["joints"]
    assert (found.value, found.limit, found.is_met) == (pytest.approx(abs(jump_deg), abs=1e-12), 1e-6, is_met)
    assert axis(line(1.0), FREE)["joints"].value == 0.0


def test_each_axis_is_checked_against_its_own_limits_communication_first() -> None:
    asked = replace(task(), azimuth=AxisLimits(0.0, 60.0, 3.5, 1.0), elevation=AxisLimits(80.0, 100.0, 0.5, 0.1))
    found = check_profile(asked, Profile("single", line(20.0, 3.0), line(90.0, 0.01)))
    assert [one.name for one in found] == [
        "off-pointing",
        *(f"{name} {k}" for name in ("azimuth", "elevation") for k in ("range", "rate", "acceleration", "joints")),
    ]
    assert all(one.is_met for one in found)
    assert [one.limit for one in found] == [1.0, 60.0, 3.5, 1.0, 1e-6, 100.0, 0.5, 0.1, 1e-6]


@pytest.mark.parametrize(
    ("play", "rates", "off_deg"),
    [
        (Backlash(0.4, 0.0), (3.0, 0.0), 0.2),
        (Backlash(0.0, 0.4), (3.0, 0.0), 0.0),  # elevation is at rest
        (Backlash(0.4, 0.0), (0.0, 0.1), 0.0),
        (Backlash(0.0, 0.4), (0.0, 0.1), 0.2),
        (Backlash(), (3.0, 0.1), 0.0),
    ],
)
def test_the_play_of_each_gear_leaves_its_own_axis_behind(
    play: Backlash, rates: tuple[float, float], off_deg: float
) -> None:
    az_rate, el_rate = rates
    asked = drawn_task(20.0 + az_rate * TIMES, 90.0 + el_rate * TIMES, Cone(1.0))
    found = check_profile(asked, Profile("single", line(20.0, az_rate), line(90.0, el_rate)), play)
    assert found[0].value == pytest.approx(off_deg, abs=1e-6)


def test_a_check_is_written_with_its_mark_figures_and_detail() -> None:
    assert str(Check("azimuth rate", 1.23456, 2.0, "deg/s", is_met=True)) == "ok   azimuth rate: 1.235 of 2 deg/s"
    failed = Check("azimuth rate", 2.5, 2.0, "deg/s", is_met=False, detail=" at 3 s")
    assert str(failed) == "FAIL azimuth rate: 2.5 of 2 deg/s at 3 s"


# What a file says of itself


def file(azimuth: Path, elevation: Path, bound: Bound | None = None, **header: str) -> ParameterFile:
    return ParameterFile(0.0, Profile("free", azimuth, elevation, bound), header)


def test_the_grid_has_twenty_times_a_second_from_start_to_end() -> None:
    found = grid_s(file(line(0.0, length_s=2.5), line(0.0)))
    assert (found.size, found[0], found[1]) == (51, 0.0, 0.05)
    assert found[-1] == pytest.approx(2.5)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_stated_peaks_are_those_of_the_polynomials_of_either_axis(sign: float) -> None:
    azimuth, elevation = line(0.0, 0.0, sign * 0.1), line(0.0, sign * 0.7)
    both = file(azimuth, elevation, PEAK_AZIMUTH_RATE_DEG_S="2.0", PEAK_ELEVATION_RATE_DEG_S="0.7")
    first, second = check_peaks(both)
    assert (first.name, first.value, first.limit) == ("PEAK_AZIMUTH_RATE_DEG_S", pytest.approx(2.0), 2.0)
    assert (second.name, second.value, second.limit) == ("PEAK_ELEVATION_RATE_DEG_S", pytest.approx(0.7), 0.7)
    assert (first.unit, first.is_met, second.is_met) == ("deg/s", True, True)


@pytest.mark.parametrize(
    ("stated", "is_met"),
    [("2.0000015", True), ("1.9999985", True), ("2.000003", False), ("1.999997", False), ("-2.0", False)],
)
def test_a_stated_peak_may_differ_by_its_last_digits(stated: str, is_met: bool) -> None:
    [found] = check_peaks(file(line(0.0, 0.0, 0.1), line(0.0), PEAK_AZIMUTH_RATE_DEG_S=stated))
    assert found.is_met == is_met


def test_an_axis_at_rest_may_state_nothing_or_nearly_nothing() -> None:
    assert check_peaks(file(line(0.0), line(0.0))) == []
    for stated, is_met in (("0.0", True), ("0.9e-8", True), ("1.2e-8", False)):
        [found] = check_peaks(file(line(0.0), line(0.0), PEAK_ELEVATION_RATE_DEG_S=stated))
        assert (found.name, found.is_met) == ("PEAK_ELEVATION_RATE_DEG_S", is_met)
    with pytest.raises(UsageError, match="PEAK_ELEVATION_RATE_DEG_S: 'fast' is not a number"):
        check_peaks(file(line(0.0), line(0.0), PEAK_ELEVATION_RATE_DEG_S="fast"))


@pytest.mark.parametrize(
    ("bound", "rate", "is_met"),
    [
        (Bound(2.0, 8.0, 30.0, 3.0, 20.0), 2.0, True),
        (Bound(2.0, 3.0, 30.0, 8.0, 20.0), 2.0, True),
        (Bound(2.0, 8.0, 20.0, 3.0, 30.0), -2.0, False),
        (Bound(2.00015, 8.0, 30.0, 3.0, 20.0), 2.0, True),
        (Bound(2.0003, 8.0, 30.0, 3.0, 20.0), 2.0, False),
        (Bound(1.9997, 8.0, 30.0, 3.0, 20.0), 2.0, False),
        (Bound(0.0, 0.0, 20.0, 0.0, 30.0), 0.0, True),
        (Bound(0.1, 0.0, 30.0, 0.0, 20.0), 0.0, False),
    ],
)
def test_a_certificate_is_its_own_arithmetic(bound: Bound, rate: float, is_met: bool) -> None:
    [found] = check_certificate(file(line(0.0), line(0.0), bound), None)
    assert (found.name, found.value, found.limit, found.unit) == ("certificate", rate, bound.rate_deg_s, "deg/s")
    assert found.is_met == is_met
    if bound.low_time_s == bound.high_time_s:
        assert len(check_certificate(file(line(0.0), line(0.0), bound), task())) == 1


def test_without_a_certificate_nothing_is_checked() -> None:
    assert check_certificate(file(line(0.0), line(0.0)), task()) == []


def bounds_check(bound: Bound, asked: Task) -> Check:
    arithmetic, found = check_certificate(file(line(0.0), line(0.0), bound), asked)
    assert arithmetic.name == "certificate"
    assert (found.name, found.limit, found.unit) == ("certificate's bounds", 1e-3, "deg")
    assert found.is_met == (found.value <= 1e-3)
    return found


@pytest.mark.parametrize("low_deg", [-730.0, -380.0, -20.0, 350.0, 700.0])
def test_the_pass_binds_azimuth_as_the_certificate_says_on_every_turn_of_the_cable(low_deg: float) -> None:
    asked = task(azimuth=AxisLimits(low_deg, low_deg + 110.0, 9.0, 9.0))
    bound = least_bound(asked)
    assert bound is not None
    assert bounds_check(bound, asked).value == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_either_bound_that_is_off_by_more_than_a_thousandth_is_seen(sign: float) -> None:
    asked = task()
    bound = least_bound(asked)
    assert bound is not None
    for key in ("low_deg", "high_deg"):
        for off_deg in (0.0005, 0.002, 3.0):
            moved = replace(bound, **{key: getattr(bound, key) + sign * off_deg})
            assert bounds_check(moved, asked).value == pytest.approx(off_deg, abs=1e-6)
    for key in ("low_time_s", "high_time_s"):
        early = replace(bound, **{key: 5.0})
        assert bounds_check(early, asked).value == pytest.approx(15.0, abs=1e-3)


def test_the_ranges_ends_bind_azimuth_too() -> None:
    asked = task(azimuth=AxisLimits(20.5, 200.0, 9.0, 9.0))
    assert bounds_check(Bound(3.0, 0.0, 20.5, 10.0, 51.0), asked).value == pytest.approx(0.0, abs=1e-6)
    asked = task(azimuth=AxisLimits(-200.0, 50.5, 9.0, 9.0))
    assert bounds_check(Bound(3.0, 0.0, 19.0, 10.0, 50.5), asked).value == pytest.approx(0.0, abs=1e-6)


def test_where_the_elevations_range_cuts_the_cone_the_certificate_is_of_the_outer_tube() -> None:
    asked = drawn_task(20.0 + 3.0 * TIMES, np.full(COUNT, 91.0), Cone(2.0, el_max_deg=90.0))
    bound = least_bound(asked)
    assert bound is not None
    assert bounds_check(bound, asked).value == pytest.approx(0.0, abs=1e-6)


def test_an_unlimited_axis_has_no_limit_that_a_pass_could_meet() -> None:
    found = axis(line(-5000.0, 1000.0), UNLIMITED)
    assert all(one.is_met for one in found.values())
