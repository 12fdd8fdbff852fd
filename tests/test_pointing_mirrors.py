"""Turns of the wrap, the keyhole, reach, ways and the rows of a search: the same to the left and to the right."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from memories import remembering
from mirrors import MIRRORS, Mirror
from test_search import straight_path

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.turn import TurnWatch, is_pulled_round, watch_goal
from acu_daemon.control.state import Scan, StartStage
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.aim import AHEAD_DEG_S, aim
from acu_daemon.control.tracking.approach import way_s
from acu_daemon.control.tracking.scan import go_on, pace_s_s, pointing
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import AxisLimits, Model, Reading
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keyhole import KeyholeRules, SkyPath, follow_path
from acu_daemon.pointing.plunge import RATE_SHARE, Branches, way_over
from acu_daemon.pointing.reach import out_of_reach
from acu_daemon.pointing.wrap import (
    choose_turn,
    encoder_continuous,
    nearest_end_deg,
    nearest_turn,
    sector_for,
    turns_of,
)
from acu_daemon.units import wrap_180

LEFT_RIGHT, UP_DOWN = MIRRORS["left and right"], MIRRORS["up and down"]
STEP_S = 0.1
ELEVATION = AxisLimits(10.0, 70.0, 5.0, 5.0)
bearings = st.floats(0.01, 359.99)
ranges = st.tuples(st.floats(-350.0, -60.0), st.floats(130.0, 560.0)).map(
    lambda one: AxisLimits(one[0], one[0] + one[1], 20.0, 10.0)
)
drives = st.tuples(st.floats(0.5, 20.0), st.floats(0.2, 10.0)).map(lambda one: AxisLimits(-270.0, 270.0, *one))


def mirrored(limits: AxisLimits) -> AxisLimits:
    return LEFT_RIGHT.limits(limits, -1)


def zenith_path(top_deg: float, speed_deg_s: float, shift_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A straight line past the zenith: azimuth, its rate, elevation."""
    t = STEP_S * np.arange(600) - 30.0 - shift_s
    miss, w = np.radians(90.0 - top_deg), np.radians(speed_deg_s)
    az = 90.0 + np.degrees(np.arctan2(w * t, miss))
    return az, np.degrees(w * miss / (miss**2 + (w * t) ** 2)), 90.0 - np.degrees(np.hypot(miss, w * t))


@given(st.floats(70.0, 89.95), st.floats(0.2, 1.5), st.floats(-28.0, 28.0), drives)
def test_the_way_through_the_keyhole_is_mirrored_with_its_path(top_deg, speed_deg_s, shift_s, drive):
    az, rate, el = zenith_path(top_deg, speed_deg_s, shift_s)
    path, mirror = (SkyPath(sign * az, el, sign * rate, np.gradient(el, STEP_S), STEP_S) for sign in (1.0, -1.0))
    followed, crossing = follow_path(path, KeyholeRules(drive))
    other, other_crossing = follow_path(mirror, KeyholeRules(mirrored(drive)))
    assert np.allclose(other.az_deg, -followed.az_deg, atol=1e-9)
    assert np.allclose(other.az_rate_deg_s, -followed.az_rate_deg_s, atol=1e-9)
    assert np.allclose(other.el_deg, followed.el_deg, atol=1e-9)
    assert (crossing is None) == (other_crossing is None)


@pytest.mark.parametrize("drive", [(0.2, 10.0), (0.5, 0.2), (1.0, 10.0), (4.0, 1.0), (20.0, 10.0)])
@pytest.mark.parametrize("top_deg", [86.0, 88.0, 89.0, 89.8])
def test_the_way_over_the_top_is_mirrored_with_its_path_and_asks_its_share_of_the_drive(
    top_deg: float, drive: tuple[float, float]
) -> None:
    limits, ways = AxisLimits(-270.0, 270.0, *drive), []
    for speed_deg_s in (0.3, 0.8):
        az, rate, el = zenith_path(top_deg, speed_deg_s, 0.0)
        for sign in (1.0, -1.0):
            to_zenith = (sign * az, el, sign * rate, np.gradient(el, STEP_S))
            ways.append(way_over(Branches(*to_zenith, sign * (az - 180.0), 180.0 - el, STEP_S), limits, 0.5))
    for plain, other in zip(ways[::2], ways[1::2], strict=True):
        assert (plain is None) == (other is None)
        if plain is None or other is None:
            continue
        assert np.allclose(other.az_deg, -plain.az_deg, atol=1e-9)
        assert np.allclose(other.el_deg, plain.el_deg, atol=1e-9)
        assert other.crossing.departure_tai_s == plain.crossing.departure_tai_s
        t = STEP_S * np.arange(plain.az_deg.size)
        is_way = (t > plain.crossing.departure_tai_s) & (t < plain.crossing.return_tai_s)
        assert np.abs(plain.az_rate_deg_s[is_way]).max() <= RATE_SHARE * limits.max_rate_deg_s + 1e-6


@given(st.floats(20.0, 89.9), st.floats(0.2, 1.0), st.floats(-25.0, 25.0), bearings, ranges, st.floats(-300.0, 300.0))
def test_the_turn_that_is_chosen_is_mirrored_with_the_path_the_range_and_the_antenna(
    top_deg, speed_deg_s, shift_s, bearing_deg, limits, present_deg
):
    az, _, el = zenith_path(top_deg, speed_deg_s, shift_s)
    az = az + bearing_deg
    turn = choose_turn(az, el, limits, present_deg)
    other = choose_turn(-az, el, mirrored(limits), -present_deg)
    if abs(abs(az[0] + turn.offset_deg - present_deg) % 180.0 - 180.0) > 1e-6:  # as near on two turns: either
        assert replace(other, offset_deg=-other.offset_deg) == turn
    turned = choose_turn(az + 360.0, el, limits, present_deg)
    assert turned.offset_deg == pytest.approx(turn.offset_deg - 360.0)


@given(st.floats(20.0, 89.9), st.floats(0.2, 1.0), st.floats(-25.0, 25.0), bearings, ranges, drives)
def test_what_is_out_of_reach_is_so_in_both_mirrors(top_deg, speed_deg_s, shift_s, bearing_deg, limits, drive):
    az, _, el = zenith_path(top_deg, speed_deg_s, shift_s)
    az, limits = az + bearing_deg - 180.0, replace(limits, max_rate_deg_s=drive.max_rate_deg_s)
    tai_s = 1e8 + STEP_S * np.arange(az.size)

    def facts(az, el, azimuth, elevation):
        found = out_of_reach(tai_s, az, el, azimuth, elevation)
        words = [one.why.split(" deg")[0].split(" ")[1] for one in found]
        return [(one.axis, one.from_tai_s, pytest.approx(one.to_tai_s)) for one in found], words

    plain, words = facts(az, el, limits, ELEVATION)
    assert facts(-az, el, mirrored(limits), ELEVATION) == (plain, words)
    upside_down, of_them = facts(az, -el, limits, UP_DOWN.limits(ELEVATION, -1))
    assert sorted(upside_down, key=str) == sorted(plain, key=str)
    swapped = {"above": "below", "below": "above"}
    assert sorted(of_them) == sorted(swapped.get(word, word) for word in words)


@given(bearings, st.floats(-300.0, 300.0), ranges, st.booleans(), st.sampled_from([-1, 0, 1]))
def test_bearings_are_taken_to_the_same_place_from_both_sides(bearing_deg, near_deg, limits, is_high, end):
    other, around = mirrored(limits), (-bearing_deg) % 360.0
    assert turns_of(around, other) == pytest.approx([-one for one in reversed(turns_of(bearing_deg, limits))])
    nearest, of_mirror = nearest_turn(bearing_deg, near_deg, limits), nearest_turn(around, -near_deg, other)
    assert (nearest is None) == (of_mirror is None)
    if nearest is not None and abs(abs(wrap_180(bearing_deg - near_deg)) - 180.0) > 1e-6:
        assert of_mirror == pytest.approx(-nearest)
    for near in (None, near_deg):
        place = encoder_continuous(bearing_deg, is_high, limits, near_deg=near, end=end)
        of_mirror = encoder_continuous(around, not is_high, other, near_deg=None if near is None else -near, end=-end)
        middle_deg = (limits.min_deg + limits.max_deg) / 2
        is_tie = abs(abs(wrap_180(bearing_deg - (middle_deg if near is None else near))) - 180.0) < 1e-6
        assert is_tie or of_mirror == pytest.approx(-place)
    if abs(abs(wrap_180(bearing_deg - limits.min_deg)) - abs(wrap_180(bearing_deg - limits.max_deg))) > 1e-6:
        assert nearest_end_deg(around, -near_deg, other) == pytest.approx(
            -nearest_end_deg(bearing_deg, near_deg, limits)
        )
    if abs(near_deg - (limits.min_deg + limits.max_deg) / 2) > 1e-6:
        assert sector_for(-near_deg, other) == 3 - sector_for(near_deg, limits)


moves = st.lists(
    st.tuples(st.sampled_from([0.0, 0.5, 3.0, 20.0, -3.0]), st.sampled_from([None, -200.3, -60.7, 5.1, 93.9, 241.3])),
    min_size=3,
    max_size=12,
)


@given(st.floats(-250.0, 250.0), moves)
def test_an_azimuth_on_its_way_is_judged_alike_to_both_sides(start_deg, moves):
    """Standing, late, turned to another goal; pulled round."""
    az_deg, tai_s, limits = start_deg, 8.4e8, AxisLimits(-270.0, 270.0, 5.0, 2.0)
    watch, other = TurnWatch(), TurnWatch()
    for rate_deg_s, goal_deg in moves:
        for _ in range(12):
            tai_s, az_deg = tai_s + 1.3, min(max(az_deg + 1.3 * rate_deg_s, -269.2), 269.4)
            watch, is_standing = watch_goal(watch, tai_s, az_deg, goal_deg, limits, scale=1.0)
            mirrored_goal_deg = None if goal_deg is None else -goal_deg
            other, of_mirror = watch_goal(other, tai_s, -az_deg, mirrored_goal_deg, limits, scale=1.0)
            assert (is_standing, watch.problem == "") == (of_mirror, other.problem == "")
            assert (watch.way_deg, watch.begun_tai_s) == pytest.approx((other.way_deg, other.begun_tai_s))
            assert (watch.side, watch.mark_tai_s) == (-other.side, other.mark_tai_s)
            assert watch.mark_deg == pytest.approx(-other.mark_deg)
            if goal_deg is not None:
                pulls = is_pulled_round(az_deg, rate_deg_s, goal_deg, limits)
                assert is_pulled_round(-az_deg, -rate_deg_s, -goal_deg, limits) == pulls


def test_an_azimuth_that_stands_is_told_on_both_sides_of_its_goal() -> None:
    limits = AxisLimits(-270.0, 270.0, 20.0, 10.0)
    for goal_deg in (-40.0, -3.0, 3.0, 40.0):
        watch = TurnWatch()
        standing = []
        for k in range(200):
            watch, is_standing = watch_goal(watch, 8.4e8 + 0.1 * k, 0.0, goal_deg, limits, scale=1.0)
            standing.append(is_standing)
        assert standing[-1]
        assert not standing[40]
        assert watch.problem


rates = st.floats(-25.0, 25.0)


@given(st.floats(-50.0, 50.0), rates, st.floats(-50.0, 50.0), rates, drives)
def test_an_axis_follows_to_both_sides_alike(place_deg, rate_deg_s, target_deg, target_rate_deg_s, drive):
    after = step(AxisState(place_deg, rate_deg_s), target_deg, target_rate_deg_s, STEP_S, drive)
    other = step(AxisState(-place_deg, -rate_deg_s), -target_deg, -target_rate_deg_s, STEP_S, drive)
    assert (other.position_deg, other.rate_deg_s) == (-after.position_deg, -after.rate_deg_s)
    assert way_s(target_deg, drive) == way_s(-target_deg, drive) >= 0.0


@pytest.mark.parametrize("mirror", [LEFT_RIGHT, UP_DOWN], ids=["left and right", "up and down"])
@pytest.mark.parametrize("row", [-2, -1, 0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("rates_deg_s", [(0.5, 0.2), (-0.5, 0.2), (0.3, -0.4), (0.0, 0.5), (4.0, 0.1)])
def test_a_row_of_the_search_is_mirrored_with_its_path(
    mirror: Mirror, row: int, side: int, rates_deg_s: tuple[float, float]
) -> None:
    """Right of a motion is left of the mirrored one."""
    config = ControlConfig(
        Envelope(AxisLimits(-270.0, 270.0, 5.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)), min_elevation_deg=-90.0
    )
    path = straight_path(40.0, el_rate_deg_s=rates_deg_s[1], az_rate_deg_s=rates_deg_s[0])
    other_path, other_config = mirror.prediction(path), mirror.config(config)
    scan = Scan(model=Model.ELEMENTS, row=row, side=side, along_s=1.0, is_aimed=True)
    other = replace(scan, row=-row)
    for k in range(60):
        t = STEP_S * k
        assert pace_s_s(other, other_path, t, other_config) == pytest.approx(pace_s_s(scan, path, t, config))
        point, of_mirror = pointing(scan, path, t, config), pointing(other, other_path, t, other_config)
        assert mirror.az_deg(point.az_deg) == pytest.approx(of_mirror.az_deg, abs=1e-6)
        assert mirror.el * point.el_deg == pytest.approx(of_mirror.el_deg, abs=1e-6)
        assert mirror.az * point.az_rate_deg_s == pytest.approx(of_mirror.az_rate_deg_s, abs=1e-6)
        away_deg = 0.0 if k % 3 else 0.12 * (-1) ** k  # some are beside the place
        reading = Reading(t, (point.az_deg + away_deg) % 360.0, point.el_deg + away_deg, False)
        scan = go_on(scan, path, reading, t, STEP_S, config)
        other = go_on(other, other_path, mirror.reading(reading), t, STEP_S, other_config)
        assert (other.side, other.row, other.is_moving) == (scan.side, -scan.row, scan.is_moving)
        assert other.along_s == pytest.approx(scan.along_s, abs=1e-6)


@pytest.mark.parametrize("az_rate_deg_s", [-3.0, -0.02, -0.001, 0.0, 0.001, 0.02, 3.0])
@pytest.mark.parametrize("el_rate_deg_s", [-1.0, -0.02, -0.001, 0.0, 0.001, 0.02, 1.0])
def test_a_rotator_is_told_half_its_dead_band_more_whichever_way_each_axis_goes(
    az_rate_deg_s: float, el_rate_deg_s: float
) -> None:
    config = ControlConfig(Envelope(AxisLimits(-270.0, 270.0, 5.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)))
    waits = replace(config, acu=replace(config.acu, dead_band_deg=0.6))
    path = replace(straight_path(40.0, el_rate_deg_s, az_rate_deg_s), kind="FITTED")
    seen = AcuStatus(260.0, 40.0, AcuMode.REMOTE_BACKUP, backup_selected=Backup.REMOTE)
    state = remembering(track=TrackState.HOLD_FITTED, stage=StartStage.READY, status=seen, az_deg=-100.0)
    plain, aimed = (aim(state, Sky(path, None, None), 0.0, one) for one in (config, waits))
    for rate_deg_s, more_deg in (
        (plain.az_rate_deg_s, aimed.az_deg - plain.az_deg),
        (plain.el_rate_deg_s, aimed.el_deg - plain.el_deg),
    ):
        assert more_deg == pytest.approx(0.3 * np.sign(rate_deg_s) * (abs(rate_deg_s) >= AHEAD_DEG_S))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_axis_at_its_rate_does_not_catch_what_is_a_little_ahead_to_either_side(side: float) -> None:
    drive = AxisLimits(-270.0, 270.0, 20.0, 10.0)
    after = step(AxisState(0.0, side * 20.0), side * 2.01, side * 20.0, STEP_S, drive)
    assert side * after.position_deg == pytest.approx(2.0)


@pytest.mark.parametrize("limits_deg", [(-270.0, 270.0), (-181.0, 340.0), (-100.0, 300.0)])
def test_over_the_zenith_the_turn_that_holds_both_ways_is_mirrored_with_the_path(
    limits_deg: tuple[float, float],
) -> None:
    limits = AxisLimits(*limits_deg, 20.0, 10.0)
    az, _, el = zenith_path(88.0, 0.8, 0.0)
    for bearing_deg in range(3, 363, 15):
        for present_deg in (-151.0, 17.0, 160.0):
            turn = choose_turn(az + bearing_deg, el, limits, present_deg)
            other = choose_turn(-az - bearing_deg, el, mirrored(limits), -present_deg)
            assert replace(other, offset_deg=-other.offset_deg) == turn
