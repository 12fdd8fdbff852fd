"""Tube, bound and free path of the satellite's antenna: against a linear program, and their own promises."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onboard_tasks import made_task
from scipy.optimize import linprog
from scipy.sparse import csr_array, diags_array, hstack, vstack

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.bound import is_feasible, least_rate
from acu_daemon.onboard.branches import find_branches
from acu_daemon.onboard.cone import Cone, Tube, azimuth_tube, elevation_interval
from acu_daemon.onboard.free import free_profile
from acu_daemon.onboard.gimbal_frames import Gimbal, angles_between_deg, beam_direction
from acu_daemon.onboard.least_path import Band, least_path
from acu_daemon.onboard.methods import make_profile
from acu_daemon.onboard.pointed import fit, samples_for
from acu_daemon.onboard.profile import METHODS, Task, off_pointing, peak_rate_deg_s
from acu_daemon.onboard.quintic import Knots
from acu_daemon.onboard.scenarios import DAEJEON

BOUND_SHARE = 1e-6
PATH_SHARE = 2.5e-3  # the smoothing has 0.2 % of room
EXACT_DEG = 1e-9
FIT_DEG = 0.006


def tube_of(task: Task) -> Tube:
    view = task.view.plan
    station = task.station_gimbal(view)
    return azimuth_tube(task.cone, view.time_s, station.az_deg, station.el_deg)


def rate_by_a_linear_program(tube: Tube) -> float:
    """The least R with |az[k + 1] - az[k]| <= R dt and azimuth in the tube, by HiGHS."""
    n, dt = tube.time_s.size, float(tube.time_s[1])
    steps = diags_array([-np.ones(n - 1), np.ones(n - 1)], offsets=[0, 1], shape=(n - 1, n))
    column = np.full((n - 1, 1), -dt)
    rows = vstack([hstack([steps, column]), hstack([-steps, column])])
    aim = np.append(np.zeros(n), 1.0)
    ranges = [*zip(tube.lower_deg, tube.upper_deg, strict=True), (0.0, None)]
    return float(linprog(aim, A_ub=rows.tocsr(), b_ub=np.zeros(2 * n - 2), bounds=ranges, method="highs").fun)


@pytest.mark.parametrize("seed", range(8))
def test_the_closed_form_bound_is_that_of_a_linear_program(seed: int) -> None:
    task = made_task(seed, 1.0 + seed % 3)
    tube = tube_of(task)
    tube = Tube(tube.time_s[::2], tube.lower_deg[::2], tube.upper_deg[::2])
    assert least_rate(tube).rate_deg_s == pytest.approx(rate_by_a_linear_program(tube), rel=BOUND_SHARE)


def test_the_certificate_proves_the_bound_and_a_rate_below_it_is_infeasible() -> None:
    tube = tube_of(made_task(2, 2.0))
    bound = least_rate(tube)
    apart_s = abs(bound.low_time_s - bound.high_time_s)
    assert (bound.low_deg - bound.high_deg) / apart_s == pytest.approx(bound.rate_deg_s, rel=1e-12)
    assert is_feasible(tube, bound.rate_deg_s * (1.0 + 1e-9))
    assert not is_feasible(tube, bound.rate_deg_s * (1.0 - 1e-6))


@settings(max_examples=40)
@given(
    az=st.floats(-170.0, 170.0), el=st.floats(4.0, 100.0), share=st.floats(-1.3, 1.3), margin=st.floats(0.5, 3.5),
    cross=st.floats(-0.3, 0.3), up=st.floats(-0.3, 0.3),
)  # fmt: skip
def test_an_azimuth_is_in_the_tube_just_where_some_elevation_keeps_the_beam_in_the_margin(
    az: float, el: float, share: float, margin: float, cross: float, up: float
) -> None:
    cone = Cone(margin, up, cross, -20.0, 130.0)
    p = beam_direction(Gimbal(np.array([az]), np.array([el])), np.array([0.0, 0.0, 1.0]))
    tube = azimuth_tube(cone, np.zeros(1), np.array([az]), np.array([el]))
    if not np.isfinite(tube.upper_deg[0]):
        return
    middle, half = (tube.upper_deg + tube.lower_deg) / 2.0, (tube.upper_deg - tube.lower_deg) / 2.0
    at = float((middle + share * half)[0])
    tried = np.linspace(-20.0, 130.0, 150_001)
    beams = beam_direction(Gimbal(np.full(tried.size, at), tried), cone.boresight)
    best = angles_between_deg(beams, np.broadcast_to(p, beams.shape)).min()
    if abs(share) < 0.999:
        assert best <= margin + 1e-5
    elif abs(share) > 1.001 and half[0] < 60.0:
        assert best > margin - 1e-5
    low, high = elevation_interval(cone, p, np.array([at]))
    if low[0] < high[0]:
        for edge in (low, high):
            off = angles_between_deg(beam_direction(Gimbal(np.array([at]), edge), cone.boresight), p)[0]
            assert off == pytest.approx(margin, abs=1e-6)


def test_pieces_join_in_value_rate_and_acceleration() -> None:
    rng = np.random.default_rng(1)
    knots = Knots(np.array([0.0, 20.0, 25.0, 25.5, 60.0]))
    path = knots.path(rng.normal(size=knots.count))
    for derivative in range(3):
        assert np.abs(path.joints_deg(derivative)).max() < EXACT_DEG * 10.0 ** (2 * derivative)
    times = np.linspace(0.0, 59.0, 50)
    slope = (path.value(times + 1e-4) - path.value(times - 1e-4)) / 2e-4
    assert slope == pytest.approx(path.value(times, 1), rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(("seed", "margin_deg"), [(1, 1.0), (8, 2.0), (3, 3.0)])
def test_the_free_path_beats_the_search_which_beats_three_stations_within_the_margin(
    seed: int, margin_deg: float
) -> None:
    task = made_task(seed, margin_deg)
    profiles = [make_profile(task, DAEJEON, method) for method in METHODS]
    assert all(profile is not None for profile in profiles)
    peaks = [peak_rate_deg_s(profile.azimuth, task.view) for profile in profiles]
    assert peaks[2] <= peaks[1]
    assert peaks[3] <= 1.005 * peaks[2]
    for profile in profiles:
        assert off_pointing(task, profile.gimbal(task.view.time_s), task.view).max() <= margin_deg
    free = profiles[3]
    assert free.bound.rate_deg_s <= peaks[3] <= 1.035 * free.bound.rate_deg_s
    assert np.abs(free.azimuth.joints_deg(2)).max() < 1e-6


def test_a_pass_over_the_axis_takes_the_better_side() -> None:
    task = made_task(4, 2.0, "domestic")
    free = free_profile(task)
    assert free is not None
    station = task.station_gimbal(task.view)
    assert station.el_deg.min() < 1.0
    single = peak_rate_deg_s(fit(task.view.time_s, station)[0], task.view)
    assert peak_rate_deg_s(free.azimuth, task.view) < 0.2 * single
    assert off_pointing(task, free.gimbal(task.view.time_s), task.view).max() <= 2.0


def test_offsets_of_the_boresight_are_planned_in_not_added_afterwards() -> None:
    task = made_task(8, 1.0)
    task = replace(task, cone=Cone(1.0, boresight_elevation_deg=0.4, boresight_cross_deg=-0.3))
    free = free_profile(task)
    assert free is not None
    assert off_pointing(task, free.gimbal(task.view.time_s), task.view).max() <= 1.0
    assert peak_rate_deg_s(free.azimuth, task.view) <= 1.035 * free.bound.rate_deg_s


def test_limits_of_the_drive_hold_on_the_polynomials() -> None:
    limits = AxisLimits(-270.0, 270.0, 1.7, 0.05)
    task = made_task(8, 2.0, azimuth=limits)
    free = free_profile(task)
    assert free is not None
    assert peak_rate_deg_s(free.azimuth, task.view) <= limits.max_rate_deg_s
    assert np.abs(free.azimuth.value(task.view.time_s, 2)).max() <= limits.max_acceleration_deg_s2
    assert free_profile(replace(task, azimuth=AxisLimits(-270.0, 270.0, 0.5, 0.05))) is None


@pytest.mark.parametrize(("seed", "margin_deg"), [(3, 1.0), (16, 2.0)])
def test_the_interior_point_finds_the_rate_that_highs_finds_for_the_same_polynomials(
    seed: int, margin_deg: float
) -> None:
    task = made_task(seed, margin_deg)
    knots = fit(task.view.time_s, task.station_gimbal(task.view), 20.0, 0.1 * margin_deg)[0].knots
    branch = find_branches(task)[0]
    at = samples_for(task.view.time_s, knots)
    time_s, lower, upper = task.view.time_s[at], branch.tube.lower_deg[at], branch.tube.upper_deg[at]
    ours = least_path(Band(time_s, lower, upper, np.ones(at.size, bool)), knots, branch.guess_deg[at])
    assert ours is not None
    values, rates = (np.zeros((at.size, knots.count + 1)) for _ in range(2))
    columns = 3 * knots.piece_of(time_s)[:, None] + np.arange(6)
    for matrix, derivative in ((values, 0), (rates, 1)):
        np.put_along_axis(matrix, columns, knots.basis(time_s, derivative), axis=1)
    above, below = rates.copy(), -rates
    above[:, -1] = below[:, -1] = -1.0
    low, high = np.isfinite(lower), np.isfinite(upper)
    rows = csr_array(np.vstack([values[high], -values[low], above, below]))
    bounds = np.concatenate([upper[high], -lower[low], np.zeros(2 * at.size)])
    aim = np.zeros(knots.count + 1)
    aim[-1] = 1.0
    least = linprog(aim, A_ub=rows, b_ub=bounds, bounds=(None, None), method="highs").fun
    assert np.abs(ours.value(time_s, 1)).max() == pytest.approx(least, rel=PATH_SHARE)


def test_fitted_polynomials_follow_the_station() -> None:
    task = made_task(9, 1.0)
    profile = make_profile(task, DAEJEON, "single")
    assert off_pointing(task, profile.gimbal(task.view.time_s), task.view).max() < FIT_DEG
