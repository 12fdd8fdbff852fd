"""pointing.keyhole: the way past the zenith that a drive can follow, against what no drive can beat."""

import numpy as np
import pytest
import real_passes
import zenith_bound
from conftest import needs_data
from real_passes import sky_angles_deg

from acu_daemon.model import AxisLimits, ZenithCrossing
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.pointing.keyhole import Begun, KeyholeRules, SkyPath, follow_path, longest_window_s, turned_past_zenith

DRIVE = AxisLimits(-270.0, 270.0, 20.0, 10.0)
LARGEST_ERROR, SECONDS = KeyholeRules(DRIVE), KeyholeRules(DRIVE, objective="seconds")
STEP_S = 0.1
HALF_BEAM_DEG = 0.5
NAMES = ("az_deg", "el_deg", "az_rate_deg_s", "el_rate_deg_s")


def path_of(rows: np.ndarray, sign: float = 1.0) -> SkyPath:
    return SkyPath(sign * rows[1], rows[2], sign * rows[3], rows[4], STEP_S)


def _zenith(top_deg: float, speed_deg_s: float = 0.5, shift_s: float = 0.0, sign: float = 1.0) -> SkyPath:
    """A straight line past the zenith, 900 samples, fastest at 45 s + shift."""
    t = STEP_S * np.arange(900) - 45.0 - shift_s
    miss, w = np.radians(90.0 - top_deg), np.radians(speed_deg_s)
    off = np.hypot(miss, w * t)
    az, rate = 90.0 + np.degrees(np.arctan2(w * t, miss)), np.degrees(w * miss / off**2)
    return SkyPath(sign * az, 90.0 - np.degrees(off), sign * rate, -np.degrees(w * w * t / off), STEP_S)


def _within_the_drive(way: SkyPath) -> bool:
    return bool(
        np.all(np.abs(way.az_rate_deg_s) <= DRIVE.max_rate_deg_s)
        and np.all(np.abs(np.diff(way.az_deg)) <= DRIVE.max_rate_deg_s * STEP_S)
        and np.all(np.abs(np.diff(way.az_rate_deg_s)) <= DRIVE.max_acceleration_deg_s2 * STEP_S + 1e-9)
    )


def errors_deg(way: SkyPath, true: np.ndarray) -> np.ndarray:
    """Angles on the sky between a way and rows of a pass at its times."""
    return sky_angles_deg(way.az_deg, way.el_deg, true[1], true[2])


@pytest.mark.parametrize("top_deg", [60.0, 85.0, 88.0])
def test_a_path_within_the_drive_is_left_as_it_is(top_deg):
    path = _zenith(top_deg)
    assert follow_path(path, LARGEST_ERROR) == (path, None)


@pytest.mark.parametrize("rules", [LARGEST_ERROR, SECONDS])
@pytest.mark.parametrize("top_deg", [88.6, 89.0, 89.5, 89.9, 89.99])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_through_the_zenith_the_path_stays_within_the_drive_and_joins_the_true_one(top_deg, sign, rules):
    path = _zenith(top_deg, sign=sign)
    way, crossing = follow_path(path, rules)
    assert _within_the_drive(way)
    is_window = way.az_deg != path.az_deg
    is_window[slice(*np.flatnonzero(is_window)[[0, -1]])] = True  # the two meet at culmination
    assert 0 < is_window.sum() * STEP_S <= longest_window_s(DRIVE)
    assert np.all(way.az_rate_deg_s[~is_window] == path.az_rate_deg_s[~is_window])
    assert np.all(way.el_deg[~is_window] == path.el_deg[~is_window])
    assert np.all(way.el_deg <= 90.0)
    first, last = np.flatnonzero(is_window)[[0, -1]]
    assert crossing.departure_tai_s == pytest.approx(first * STEP_S, abs=2 * STEP_S)
    assert crossing.return_tai_s == pytest.approx((last + 1) * STEP_S, abs=2 * STEP_S)
    # position is the integral of the rate: trapezoids, exact but at the corners of the profile
    assert np.allclose(np.diff(way.az_deg), STEP_S * (way.az_rate_deg_s[1:] + way.az_rate_deg_s[:-1]) / 2, atol=0.03)


# Least largest error and least seconds, by zenith_bound; scripts/zenith_figures.py makes them again
BOUNDS = {
    (500, 88.0): (0.154, 0.0),
    (500, 88.5): (0.404, 0.0),
    (500, 89.0): (0.708, 2.7),
    (500, 89.5): (1.049, 4.4),
    (500, 89.8): (1.267, 5.2),
    (500, 89.99): (1.409, 5.8),
    (705, 88.5): (0.067, 0.0),
    (705, 89.0): (0.311, 0.0),
    (705, 89.3): (0.495, 0.0),
    (705, 89.5): (0.629, 2.4),
    (705, 89.8): (0.842, 3.9),
    (705, 89.99): (0.983, 4.7),
    (800, 89.0): (0.203, 0.0),
    (800, 89.3): (0.378, 0.0),
    (800, 89.5): (0.509, 0.6),
    (800, 89.8): (0.720, 3.2),
    (800, 89.99): (0.860, 4.2),
}
NONE_LOST_BELOW_DEG = {500: 88.6, 705: 89.2, 800: 89.4}


@pytest.mark.long
@pytest.mark.parametrize(("height_km", "top_deg"), [(500, 89.0), (705, 89.3), (800, 89.99)])
def test_the_stored_bounds_are_those_of_dynamic_programming(height_km, top_deg):
    rows = zenith_bound.overhead_pass(height_km, top_deg, span_s=15.0)
    error_deg, lost_s = BOUNDS[height_km, top_deg]
    assert zenith_bound.least_error_deg(rows, 20.0, 10.0) == pytest.approx(error_deg, abs=0.002)
    assert zenith_bound.least_lost_s(rows, 20.0, 10.0, HALF_BEAM_DEG) == pytest.approx(lost_s, abs=0.15)


@pytest.mark.parametrize(("height_km", "top_deg"), BOUNDS)
def test_the_largest_error_is_near_the_least_that_a_drive_can_do(height_km, top_deg):
    rows = zenith_bound.overhead_pass(height_km, top_deg, span_s=20.0)
    way, crossing = follow_path(path_of(rows), LARGEST_ERROR)
    errors = errors_deg(way, rows)
    assert errors.max() <= 1.06 * BOUNDS[height_km, top_deg][0] + 0.02
    assert crossing.largest_error_deg == pytest.approx(errors.max(), abs=1e-6)
    assert crossing.lost_s == pytest.approx(STEP_S * (errors > HALF_BEAM_DEG).sum(), abs=1e-6)
    assert crossing.lost_s == 0.0 or top_deg > NONE_LOST_BELOW_DEG[height_km]


@pytest.mark.parametrize(("height_km", "top_deg"), BOUNDS)
def test_where_seconds_decide_they_are_near_the_least_that_a_drive_can_do(height_km, top_deg):
    rows = zenith_bound.overhead_pass(height_km, top_deg, span_s=20.0)
    way, _ = follow_path(path_of(rows), SECONDS)
    lost_s = STEP_S * (errors_deg(way, rows) > HALF_BEAM_DEG).sum()
    assert lost_s <= 1.1 * BOUNDS[height_km, top_deg][1] + 1.0
    assert _within_the_drive(way)


@pytest.mark.parametrize(("height_km", "top_deg"), BOUNDS)
@pytest.mark.parametrize(("across_deg", "late_s"), [(0.05, 0.0), (-0.05, 0.0), (0.0, 0.1), (0.0, -0.1)])
def test_on_a_path_that_is_a_little_wrong_the_error_grows_by_no_more_than_that(height_km, top_deg, across_deg, late_s):
    true = zenith_bound.overhead_pass(height_km, top_deg, span_s=20.0)
    wrong = zenith_bound.overhead_pass(height_km, min(top_deg + across_deg, 89.995), span_s=20.0)
    way, _ = follow_path(path_of(wrong), LARGEST_ERROR)
    shifted = [np.interp(true[0], true[0] + late_s, one) for one in (way.az_deg, way.el_deg)]
    middle = slice(20, -20)
    off_deg = sky_angles_deg(shifted[0][middle], shifted[1][middle], true[1][middle], true[2][middle]).max()
    beside_deg = abs(across_deg) + np.hypot(true[3] * np.cos(np.radians(true[2])), true[4]).max() * abs(late_s)
    assert off_deg <= 1.1 * BOUNDS[height_km, top_deg][0] + 0.02 + beside_deg


def test_a_rotator_of_3_degrees_a_second_keeps_the_zenith_within_a_beam_of_20_degrees():
    for height_km in (500, 705, 800):
        rows = zenith_bound.overhead_pass(height_km, 89.99, span_s=90.0)
        rules = KeyholeRules(AxisLimits(0.0, 450.0, 3.0, 3.0), half_beam_deg=10.0)
        way, crossing = follow_path(path_of(rows), rules)
        assert errors_deg(way, rows).max() < 10.0
        assert crossing.lost_s == 0.0


@pytest.mark.parametrize("sign", [1, -1])
def test_past_the_zenith_an_antenna_may_turn_the_other_way_round(sign):
    """It costs little more near the zenith; a path that does not come near has no other way."""
    rows = zenith_bound.overhead_pass(705, 89.9)
    rows[1], rows[3] = sign * rows[1], sign * rows[3]
    turns = 1 if rows[1][-1] > rows[1][0] else -1
    assert np.array_equal(turned_past_zenith(rows[1], rows[3], turns), rows[1])
    turned = turned_past_zenith(rows[1], rows[3], -turns)
    assert np.allclose((turned - rows[1]) % 360.0, 0.0)
    way, crossing = follow_path(SkyPath(turned, rows[2], rows[3], rows[4], STEP_S), LARGEST_ERROR)
    assert _within_the_drive(way)
    assert np.sign(way.az_deg[-1] - way.az_deg[0]) == -turns
    assert errors_deg(way, rows).max() == pytest.approx(crossing.largest_error_deg, abs=1e-6)
    assert BOUNDS[705, 89.99][0] < crossing.largest_error_deg < 1.2
    low = zenith_bound.overhead_pass(705, 80.0)
    assert np.array_equal(turned_past_zenith(low[1], low[3], 1), low[1])
    assert np.array_equal(turned_past_zenith(low[1], low[3], -1), low[1])


@pytest.mark.parametrize("shift_s", [-46.0, -45.0, -42.0, 42.0, 44.9])
def test_a_window_cut_by_the_paths_end_still_stays_within_the_drive(shift_s):
    path = _zenith(89.8, shift_s=shift_s)
    way, _ = follow_path(path, LARGEST_ERROR)
    assert _within_the_drive(way)
    assert way.az_deg[0] == path.az_deg[0]


def test_a_drive_too_slow_for_the_whole_path_chases_it():
    slow = AxisLimits(-270.0, 270.0, 1.0, 1.0)
    way, crossing = follow_path(_zenith(89.8), KeyholeRules(slow))
    assert np.all(np.abs(way.az_rate_deg_s) <= slow.max_rate_deg_s)
    assert np.all(np.abs(np.diff(way.az_deg)) <= slow.max_rate_deg_s * STEP_S + 1e-9)
    assert crossing.lost_s > 10.0


# Planned anew


def begun_at(crossing: ZenithCrossing, now_s: float) -> Begun:
    return Begun(crossing.departure_tai_s, crossing.departure_az_deg, crossing.departure_rate_deg_s, now_s)


@pytest.mark.parametrize("into_s", [-3.0, 0.05, 2.0, 5.0, 9.0])
def test_a_path_that_a_fit_moves_makes_no_jump_in_the_way_that_is_in_hand(into_s):
    path, moved = (path_of(zenith_bound.overhead_pass(705, top_deg)) for top_deg in (89.75, 89.8))
    first, crossing = follow_path(path, LARGEST_ERROR)
    now_s = crossing.departure_tai_s + into_s
    then, again = follow_path(moved, LARGEST_ERROR, begun_at(crossing, now_s))
    assert again.departure_tai_s == crossing.departure_tai_s
    gone = round(crossing.departure_tai_s / STEP_S) + 1
    assert _within_the_drive(SkyPath(*(getattr(then, name)[gone:] for name in NAMES), STEP_S))
    near = slice(round(max(now_s, crossing.departure_tai_s + 0.2) / STEP_S), round((now_s + 0.5) / STEP_S))
    apart = np.abs(first.az_deg[near] - then.az_deg[near]) * np.cos(np.radians(path.el_deg[near]))
    assert np.all(apart < 0.06)


def test_before_its_departure_a_way_gives_way_to_one_that_is_better_for_sure_and_to_no_other():
    path = path_of(zenith_bound.overhead_pass(705, 89.8))
    _, best = follow_path(path, LARGEST_ERROR)
    for early_s, is_left in ((0.2, False), (3.0, True)):
        k = round((best.departure_tai_s - early_s) / STEP_S)
        early = Begun(k * STEP_S, path.az_deg[k], path.az_rate_deg_s[k], k * STEP_S - 1.0)
        _, crossing = follow_path(path, LARGEST_ERROR, early)
        assert (crossing.departure_tai_s == best.departure_tai_s) is is_left
    departed = Begun(early.departure_s, early.az_deg, early.az_rate_deg_s, early.departure_s + 0.1)
    assert follow_path(path, LARGEST_ERROR, departed)[1].departure_tai_s == early.departure_s


def test_the_same_path_from_another_start_departs_at_the_same_instant():
    rows = zenith_bound.overhead_pass(705, 89.8)
    _, crossing = follow_path(path_of(rows), LARGEST_ERROR)
    for skipped in (1, 7, 100, 250):
        _, later = follow_path(path_of(rows[:, skipped:]), LARGEST_ERROR)
        assert later.departure_tai_s + skipped * STEP_S == pytest.approx(crossing.departure_tai_s, abs=1e-6)


@needs_data
def test_on_jason_1_over_cuiaba_the_beam_stays_on_the_satellite_where_a_chasing_drive_loses_it():
    real = real_passes.load("jason-1-Cuiaba-20030108T1414")
    t = real.tai_s[0] + np.arange(0.0, real.tai_s.size - 1.0, STEP_S)
    (az, el), (after, _), (before, _) = real.sky(t), real.sky(t + 1e-3), real.sky(t - 1e-3)
    az, rate = np.degrees(np.unwrap(np.radians(az))), ((after - before + 180.0) % 360.0 - 180.0) / 2e-3
    way, _ = follow_path(SkyPath(az, el, rate, np.gradient(el, STEP_S), STEP_S), LARGEST_ERROR)
    chase = [AxisState(float(az[0]), float(rate[0]))]
    for target, target_rate in zip(az[1:], rate[1:], strict=True):
        chase.append(step(chase[-1], float(target), float(target_rate), STEP_S, DRIVE))
    off_deg = sky_angles_deg(way.az_deg, way.el_deg, az, el)
    chase_off_deg = sky_angles_deg(np.array([s.position_deg for s in chase]), el, az, el)
    assert _within_the_drive(way)
    assert off_deg.max() < 0.40
    assert chase_off_deg.max() > 0.9
    assert (off_deg > HALF_BEAM_DEG).sum() == 0
    assert (chase_off_deg > HALF_BEAM_DEG).sum() * STEP_S > 4.0
