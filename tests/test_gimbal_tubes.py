"""The least rate in a tube, and the tubes of a pass: windings, turns of the cable, guards, and which one is best."""

import numpy as np
import pytest
from onboard_tasks import drawn_task

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.bound import Bound, is_feasible, least_rate
from acu_daemon.onboard.branches import (
    AZIMUTH_GUARD,
    RANGE_GUARD_DEG,
    Branch,
    _bridged,
    _rank,
    find_branches,
    least_bound,
)
from acu_daemon.onboard.cone import Cone, Tube
from acu_daemon.onboard.profile import Task
from acu_daemon.units import Array

INF = np.inf


def tube(lower: list[float], upper: list[float], step_s: float = 1.0) -> Tube:
    return Tube(step_s * np.arange(len(lower)), np.array(lower), np.array(upper))


@pytest.mark.parametrize(
    ("lower", "upper", "bound"),
    [
        ([0.0, -9.0, -9.0, 8.0], [2.0, 9.0, 9.0, 10.0], Bound(2.0, 3.0, 8.0, 0.0, 2.0)),  # rising
        ([8.0, -9.0, -9.0, 0.0], [10.0, 9.0, 9.0, 2.0], Bound(2.0, 0.0, 8.0, 3.0, 2.0)),  # falling
        ([-10.0, -9.0, -9.0, -2.0], [-8.0, 9.0, 9.0, 0.0], Bound(2.0, 3.0, -2.0, 0.0, -8.0)),
        ([0.0, 3.0, 2.0, -9.0], [1.0, 9.0, 9.0, 9.0], Bound(2.0, 1.0, 3.0, 0.0, 1.0)),  # steep and short
        ([0.0, 3.0, -9.0, 11.5], [1.0, 9.0, 9.0, 20.0], Bound(3.5, 3.0, 11.5, 0.0, 1.0)),  # long and steeper
        ([5.0, -9.0, 5.0], [9.0, 1.0, 9.0], Bound(4.0, 0.0, 5.0, 1.0, 1.0)),  # into a valley and out of it
        ([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], Bound(0.0, 0.0, -1.0, 0.0, 1.0)),
        ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0], Bound(0.0, 0.0, 1.0, 0.0, 1.0)),
        ([0.0, -INF, 6.0], [0.5, INF, 7.0], Bound(2.75, 2.0, 6.0, 0.0, 0.5)),
        ([-INF, -INF], [INF, INF], Bound(0.0, 0.0, -INF, 0.0, INF)),
    ],
)
def test_the_least_rate_and_its_two_instants(lower: list[float], upper: list[float], bound: Bound) -> None:
    found = least_rate(tube(lower, upper))
    assert found.rate_deg_s == pytest.approx(bound.rate_deg_s, abs=1e-12)
    if bound.rate_deg_s != 4.0:
        assert found == bound
    assert least_rate(tube(lower, upper, 2.0)).rate_deg_s == pytest.approx(bound.rate_deg_s / 2.0, abs=1e-12)
    assert is_feasible(tube(lower, upper), bound.rate_deg_s + 1e-9)
    assert is_feasible(tube(lower, upper), bound.rate_deg_s - 1e-6) == (bound.rate_deg_s == 0.0 and lower != upper)


def test_at_the_very_rate_a_path_is_feasible() -> None:
    assert is_feasible(tube([0.0, 2.0], [0.0, 9.0]), 2.0)
    assert not is_feasible(tube([0.0, 2.0], [0.0, 9.0]), 1.999)


def test_where_no_angle_is_allowed_at_an_instant_no_rate_is_told_nor_feasible() -> None:
    closed = tube([0.0, 3.0, 0.0], [1.0, 2.0, 1.0])
    assert not is_feasible(closed, 1000.0)


@pytest.mark.parametrize("is_rising", [True, False])
def test_a_step_of_less_weight_needs_the_more_rate(is_rising: bool) -> None:
    lower, upper = [0.0, -9.0, 8.0], [2.0, 9.0, 10.0]
    weight = np.array([1.0, 0.5])
    order = slice(None) if is_rising else slice(None, None, -1)
    found = least_rate(tube(lower[order], upper[order]), weight[order])
    assert found.rate_deg_s == pytest.approx(6.0 / 1.5)
    assert (found.low_time_s, found.high_time_s) == ((2.0, 0.0) if is_rising else (0.0, 2.0))
    assert least_rate(tube(lower, upper, 3.0), weight).rate_deg_s == pytest.approx(6.0 / 4.5)
    still = least_rate(tube(lower, upper), np.zeros(2))
    assert still.rate_deg_s == 0.0


# The tubes of a pass


def ramp(start_deg: float, end_deg: float, el_deg: float = 90.0, azimuth: AxisLimits | None = None) -> Task:
    az_deg = np.linspace(start_deg, end_deg, 201)
    more = {} if azimuth is None else {"azimuth": azimuth}
    return drawn_task(az_deg, np.full(201, el_deg), Cone(2.0), **more)


def over_the_axis(offset_deg: float = 0.0, azimuth: AxisLimits | None = None) -> Task:
    """A pass that comes along azimuth -30 and, past the axis within the margin, leaves along 150 or so."""
    along = np.linspace(-20.0, 20.0, 201)
    x, y = along, np.full(201, offset_deg)
    az_deg = -30.0 + np.degrees(np.unwrap(np.arctan2(y, -x)))
    more = {} if azimuth is None else {"azimuth": azimuth}
    return drawn_task(az_deg, np.hypot(x, y), Cone(2.0), **more)


def limits(low: float, high: float) -> AxisLimits:
    return AxisLimits(low, high, 100.0, 100.0)


@pytest.mark.parametrize(("start", "end"), [(-10.0, 10.0), (10.0, -10.0)])
@pytest.mark.parametrize("el_deg", [90.0, 30.0, 150.0])
def test_a_branch_is_the_station_less_the_guarded_margin_over_the_sine(start: float, end: float, el_deg: float) -> None:
    task = ramp(start, end, el_deg)
    task = drawn_task(np.linspace(start, end, 201), np.full(201, el_deg), Cone(2.0, el_max_deg=170.0))
    [branch] = find_branches(task)
    half = np.degrees(np.arcsin(np.sin(np.radians(AZIMUTH_GUARD * 2.0)) / np.sin(np.radians(el_deg))))
    az_deg = np.linspace(start, end, 201)
    assert branch.tube.lower_deg == pytest.approx(az_deg - half, abs=1e-6)
    assert branch.tube.upper_deg == pytest.approx(az_deg + half, abs=1e-6)
    assert branch.guess_deg == pytest.approx(az_deg, abs=1e-6)
    assert branch.rate_deg_s == pytest.approx((20.0 - 2.0 * half) / 10.0, abs=1e-6)
    bound = least_bound(task)
    assert bound is not None
    whole = np.degrees(np.arcsin(np.sin(np.radians(2.0)) / np.sin(np.radians(el_deg))))
    assert bound.rate_deg_s == pytest.approx((20.0 - 2.0 * whole) / 10.0, abs=1e-6)
    assert (bound.low_time_s, bound.high_time_s) == pytest.approx((10.0, 0.0) if end > start else (0.0, 10.0))


@pytest.mark.parametrize(("el_deg", "low", "high"), [(91.0, 0.0, 90.0), (89.0, 90.0, 170.0)])
def test_where_the_elevations_range_cuts_the_cone_plans_stay_inside_and_the_bound_outside(
    el_deg: float, low: float, high: float
) -> None:
    task = drawn_task(np.linspace(-10.0, 10.0, 201), np.full(201, el_deg), Cone(2.0, el_min_deg=low, el_max_deg=high))
    exact = np.degrees(np.arccos(np.cos(np.radians(2.0)) / np.cos(np.radians(1.0))))  # 1 deg out of range
    step = 4.0 / 120.0
    bound = least_bound(task)
    assert bound is not None
    assert exact < 10.0 - bound.low_deg < exact + step
    assert exact < bound.high_deg + 10.0 < exact + step
    [branch] = find_branches(task)
    guarded = np.degrees(np.arccos(np.cos(np.radians(2.0 * AZIMUTH_GUARD)) / np.cos(np.radians(1.0))))
    assert guarded - step < branch.tube.upper_deg[-1] - 10.0 <= guarded
    assert guarded - step < 10.0 - branch.tube.lower_deg[-1] <= guarded


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_range_cuts_the_tube_a_guard_within_it_in_plans_and_at_its_end_in_bounds(sign: float) -> None:
    range_deg = sorted((-sign * 9.0, sign * 200.0))
    task = ramp(-10.0, 10.0, azimuth=limits(*range_deg))
    [branch] = find_branches(task)
    cut = branch.tube.lower_deg.min() if sign > 0 else branch.tube.upper_deg.max()
    assert cut == pytest.approx(-sign * (9.0 - RANGE_GUARD_DEG))
    assert branch.guess_deg.min() >= branch.tube.lower_deg.min()
    assert branch.guess_deg.max() <= branch.tube.upper_deg.max()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_range_that_keeps_no_azimuth_at_an_instant_has_neither_branch_nor_bound(sign: float) -> None:
    def ranged(end_deg: float) -> Task:
        return ramp(-10.0, 10.0, azimuth=limits(*sorted((-sign * 200.0, sign * end_deg))))

    assert len(find_branches(ranged(8.04))) == 1
    assert find_branches(ranged(8.02)) == []
    assert least_bound(ranged(8.005)) is not None
    assert least_bound(ranged(7.995)) is None


@pytest.mark.parametrize(
    ("start", "azimuth", "middle"),
    [
        (-20.0, (-270.0, 270.0), 0.0),
        (180.0, (-270.0, 270.0), -160.0),  # 180 to 220 becomes -180 to -140
        (-220.0, (-270.0, 270.0), 160.0),
        (150.0, (-400.0, 400.0), 170.0),  # 170 and -190 fit: the more central one
        (-190.0, (-400.0, 400.0), -170.0),
        (-20.0, (300.0, 400.0), 360.0),
        (-20.0, (680.0, 800.0), 720.0),
        (-20.0, (-800.0, -680.0), -720.0),
        (-20.0, (-400.0, -300.0), -360.0),
    ],
)
def test_the_turn_of_the_cable_is_the_one_in_range_the_most_central_of_several(
    start: float, azimuth: tuple[float, float], middle: float
) -> None:
    task = ramp(start, start + 40.0, azimuth=limits(*azimuth))
    [branch] = find_branches(task)
    assert (branch.guess_deg.min() + branch.guess_deg.max()) / 2.0 == pytest.approx(middle, abs=0.05)
    bound = least_bound(task)
    assert bound is not None
    assert (bound.low_deg + bound.high_deg) / 2.0 == pytest.approx(middle, abs=0.05)


@pytest.mark.parametrize("azimuth", [(680.0, 1060.0), (-1060.0, -680.0)])
def test_no_more_than_two_turns_are_tried(azimuth: tuple[float, float]) -> None:
    assert len(find_branches(ramp(-20.0, 20.0, azimuth=limits(*azimuth)))) == 1
    far = (azimuth[0] + np.sign(azimuth[0]) * 360.0, azimuth[1] + np.sign(azimuth[0]) * 360.0)
    assert find_branches(ramp(-20.0, 20.0, azimuth=limits(*far))) == []


@pytest.mark.parametrize("offset_deg", [-0.8, 0.8])
def test_past_the_axis_the_slower_side_comes_first_and_the_bound_is_its(offset_deg: float) -> None:
    task = over_the_axis(offset_deg)
    branches = find_branches(task)
    assert len(branches) == 2
    assert branches[0].rate_deg_s < branches[1].rate_deg_s
    turned = [float(one.guess_deg[-1] - one.guess_deg[0]) for one in branches]
    assert turned[0] == pytest.approx(-np.sign(turned[1]) * (360.0 - abs(turned[1])), abs=1e-6)
    assert abs(turned[0]) < abs(turned[1])
    bound = least_bound(task)
    assert bound is not None
    assert bound.rate_deg_s <= branches[0].rate_deg_s
    assert bound.rate_deg_s == pytest.approx(branches[0].rate_deg_s, rel=0.1)
    for one in branches:
        every = slice(None, None, 5)
        plan = Tube(*(part[every] for part in (one.tube.time_s, one.tube.lower_deg, one.tube.upper_deg)))
        assert one.rate_deg_s == pytest.approx(least_rate(plan).rate_deg_s)


def test_where_the_range_has_but_one_side_that_one_is_left() -> None:
    both = find_branches(over_the_axis(0.8))
    low = min(float(one.guess_deg.min()) for one in both)
    high = max(float(one.guess_deg.max()) for one in both)
    ends = [(float(one.guess_deg.min()) - 20.0, float(one.guess_deg.max()) + 20.0) for one in both]
    assert (low, high) != ends[0]
    for k, azimuth in enumerate(ends):
        left = find_branches(over_the_axis(0.8, limits(*azimuth)))
        assert any(one.rate_deg_s == pytest.approx(both[k].rate_deg_s, rel=1e-3) for one in left)


def branch(rate: float, low: float, high: float) -> Branch:
    guess = np.array([low, high])
    return Branch(tube([low - 1.0, high - 1.0], [low + 1.0, high + 1.0]), guess, rate)


def test_the_slower_branch_is_better_and_of_equally_slow_ones_the_more_central() -> None:
    assert _rank(branch(1.0, -100.0, 300.0)) < _rank(branch(1.1, -10.0, 10.0))
    assert _rank(branch(1.0 + 1e-11, -10.0, 20.0)) < _rank(branch(1.0, -300.0, 100.0))
    assert _rank(branch(1.0, -10.0, 20.0)) < _rank(branch(1.0, 10.0, 20.0))
    assert _rank(branch(1.0 + 1e-8, -10.0, 20.0)) > _rank(branch(1.0, -300.0, 100.0))


@pytest.mark.parametrize(
    ("lower", "upper", "guess"),
    [
        ([0.0, 2.0], [4.0, 8.0], [2.0, 5.0]),
        ([0.0, -INF, -INF, 6.0], [2.0, INF, INF, 8.0], [1.0, 3.0, 5.0, 7.0]),
        ([-INF, 2.0, -INF], [INF, 4.0, INF], [3.0, 3.0, 3.0]),
        ([-INF, -INF], [INF, INF], [0.0, 0.0]),
    ],
)
def test_the_middle_goes_straight_where_every_azimuth_is_allowed(
    lower: list[float], upper: list[float], guess: list[float]
) -> None:
    bridged: Array = _bridged(tube(lower, upper))
    assert bridged == pytest.approx(guess)
