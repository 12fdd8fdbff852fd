"""control.safety.turn: which turn the azimuth is on, counted reading by reading, and when that cannot be true."""

from dataclasses import replace
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.safety.turn import (
    AGAINST_COUNT,
    BIT_SCORE,
    PATIENCE_S,
    PULL_DEG_S,
    PULL_S,
    STEP_DEG,
    SURE_COUNT,
    TurnWatch,
    drive_s,
    is_pulled_round,
    locate,
    other_turn,
    watch_goal,
    watch_pull,
)
from acu_daemon.model import AxisLimits

WRAP = AxisLimits(-270.0, 270.0, 20.0, 10.0)
ONE_TURN = AxisLimits(0.0, 360.0, 20.0, 10.0)
TICK_S = 0.1


def seen(az_deg: float, bit: bool, **changes: bool) -> AcuStatus:
    return replace(AcuStatus(az_deg % 360.0, 40.0, AcuMode.REMOTE, is_sector_high=bit), **changes)


def follow(places_deg: list[float], bits: list[bool], limits: AxisLimits = WRAP) -> tuple[TurnWatch, list[float]]:
    watch, az_deg, found = TurnWatch(), None, []
    for place_deg, bit in zip(places_deg, bits, strict=True):
        watch, az_deg = locate(watch, seen(place_deg, bit), limits, az_deg)
        found.append(az_deg)
    return watch, found


@given(start=st.floats(-250.0, 250.0), step=st.floats(-10.0, 10.0), seed=st.integers(0, 9))
def test_whatever_the_bit_says_later_the_motion_counts(start, step, seed):
    places = [min(max(start + k * step, -270.0), 270.0) for k in range(60)]
    random = Random(seed)
    bits = [places[0] >= 0.0] + [random.random() < 0.5 for _ in places[1:]]
    assert follow(places, bits)[1] == pytest.approx(places, abs=1e-6)


def test_a_bit_that_follows_the_motion_is_right_one_that_is_stuck_is_wrong_after_ten_readings() -> None:
    places = [-100.0 + 2.0 * k for k in range(100)]
    assert follow(places, [place >= 0.0 for place in places])[0].alarm == ""
    stuck, _ = follow(places, [False] * 100)
    assert "sector bit is wrong" in stuck.alarm
    first_high = next(k for k, place in enumerate(places) if place >= 3.0)
    needed = first_high + BIT_SCORE // 2
    assert follow(places[:needed], [False] * needed)[0].alarm != ""
    assert follow(places[: needed - 1], [False] * (needed - 1))[0].alarm == ""


def test_one_in_four_garbled_bits_is_no_alarm_and_a_random_bit_is() -> None:
    places = [100.0] * 300
    assert follow(places, [k % 4 != 1 for k in range(300)])[0].alarm == ""
    random = Random(1)
    assert follow(places, [True, *(random.random() < 0.5 for _ in places[1:])])[0].alarm != ""


def test_with_a_range_of_one_turn_no_bit_is_judged() -> None:
    watch, found = follow([300.0] * 50, [k % 2 == 0 for k in range(50)], ONE_TURN)
    assert watch == TurnWatch()
    assert found == [300.0] * 50


def test_a_bearing_that_the_counted_turn_does_not_reach_corrects_it_after_some_readings_and_one_wild_one_does_not() -> (
    None
):
    truth = [95.0 - 2.0 * k for k in range(20)]  # believed at -265, it goes below -270 there
    watch, az_deg, found = TurnWatch(), -265.0, []
    for place_deg in truth:
        watch, az_deg = locate(watch, seen(place_deg, False), WRAP, az_deg)
        found.append(az_deg)
    assert found[3] == pytest.approx(truth[3] - 360.0)
    assert found[-1] == pytest.approx(truth[-1])
    against_count = sum(one < -271.0 for one in found)
    assert against_count == AGAINST_COUNT - 1
    watch, az_deg = TurnWatch(), -268.0
    for place_deg in (-268.0, -273.0, -268.0, -274.0, -269.0):
        watch, az_deg = locate(watch, seen(place_deg, False), WRAP, az_deg)
    assert az_deg == pytest.approx(-269.0)


@pytest.mark.parametrize(
    ("az_deg", "changes", "is_sure"),
    [
        (10.0, {}, True),
        (88.0, {}, True),
        (89.5, {}, False),  # noise at an end
        (200.0, {}, False),
        (269.9, {"is_at_cw_limit": True}, True),
        (200.0, {"is_at_cw_limit": True}, False),  # a switch that tripped elsewhere
        (-269.9, {"is_at_ccw_limit": True}, True),
    ],
)
def test_a_place_is_sure_where_one_turn_reaches_it_and_at_a_limit_switch_for_some_readings(az_deg, changes, is_sure):
    watch, found = TurnWatch(), None
    for k in range(SURE_COUNT):
        assert not watch.is_sure, k
        watch, found = locate(watch, seen(az_deg, az_deg >= 0.0, **changes), WRAP, found)
    assert watch.is_sure is is_sure


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_antenna_that_the_acu_drives_the_long_way_round_is_told_from_a_reversed_axis(side: float) -> None:
    """Really at 269, believed at -91: a command on at -80 makes it go down; mirrored too."""
    assert is_pulled_round(side * -91.0, side * -5.0, side * -80.0, WRAP)
    assert not is_pulled_round(side * -91.0, side * 5.0, side * -80.0, WRAP)  # it follows
    assert not is_pulled_round(side * -150.0, side * -5.0, side * -140.0, WRAP)  # reversed: both turns lead up
    assert not is_pulled_round(side * 10.0, side * -5.0, side * 20.0, WRAP)  # one turn alone
    assert is_pulled_round(side * -160.0, side * -20.0, side * -50.0, WRAP)  # far on its way round


def pulled(rates_deg_s: list[float], limits: AxisLimits, is_pulled: list[bool]) -> list[bool]:
    watch, az_deg, verdicts = TurnWatch(), 0.0, []
    for k, rate_deg_s in enumerate(rates_deg_s):
        az_deg += rate_deg_s * TICK_S
        watch, verdict = watch_pull(watch, TICK_S * k, az_deg, rate_deg_s, limits, scale=1.0, is_pulled=is_pulled[k])
        verdicts.append(verdict)
    return verdicts


def test_a_pull_from_rest_counts_after_half_a_second_without_a_break() -> None:
    verdicts = pulled([1.0 + k for k in range(20)], WRAP, [k != 3 for k in range(20)])
    assert verdicts.index(True) == 4 + round(PULL_S / TICK_S)


@given(rate_deg_s=st.floats(1.0, 20.0), acceleration_deg_s2=st.floats(0.5, 10.0), share=st.floats(0.6, 1.0))
def test_an_azimuth_that_brakes_after_its_command_has_turned_round_is_not_pulled(
    rate_deg_s: float, acceleration_deg_s2: float, share: float
) -> None:
    limits = AxisLimits(-270.0, 270.0, rate_deg_s, acceleration_deg_s2)
    rates = [-rate_deg_s + share * acceleration_deg_s2 * TICK_S * k for k in range(600)]
    assert not any(pulled(rates, limits, [rate < -PULL_DEG_S for rate in rates]))


def test_other_turns() -> None:
    assert other_turn(200.0, WRAP) == pytest.approx(-160.0)
    assert other_turn(-160.0, WRAP) == pytest.approx(200.0)
    assert other_turn(45.0, WRAP) is None
    assert other_turn(300.0, ONE_TURN) is None


def to_goal(
    watch: TurnWatch,
    k: int,
    az_deg: float,
    goal_deg: float,
    limits: AxisLimits,
    *,
    scale: float = 1.0,
) -> tuple[TurnWatch, bool]:
    return watch_goal(watch, TICK_S * k, az_deg, goal_deg, limits, scale=scale)


@given(
    rate_deg_s=st.floats(1.0, 20.0),
    acceleration_deg_s2=st.floats(0.5, 10.0),
    goal_deg_s=st.floats(-200.0, 200.0),
    turns_after=st.integers(5, 100),
    noise_deg=st.floats(0.0, 2.0),
    seed=st.integers(0, 9),
)
def test_a_drive_that_does_its_best_is_never_doubted_however_its_goal_runs_and_turns_round(
    rate_deg_s: float, acceleration_deg_s2: float, goal_deg_s: float, turns_after: int, noise_deg: float, seed: int
) -> None:
    """The drive has physics of its own: full acceleration to full rate towards the goal, whatever the goal does."""
    limits, random = AxisLimits(-270.0, 270.0, rate_deg_s, acceleration_deg_s2), Random(seed)
    watch, az_deg, now_deg_s, goal_deg = TurnWatch(), 0.0, 0.0, 0.0
    most_deg_s = 0.8 * acceleration_deg_s2 * TICK_S
    for k in range(600):
        goal_deg += goal_deg_s * TICK_S * (1 if k < turns_after else -1)
        gap_deg = goal_deg - az_deg
        braking_deg_s = min(rate_deg_s, (acceleration_deg_s2 * abs(gap_deg)) ** 0.5, abs(gap_deg) / TICK_S)
        wanted_deg_s = braking_deg_s if gap_deg > 0.0 else -braking_deg_s
        now_deg_s += min(max(wanted_deg_s - now_deg_s, -most_deg_s), most_deg_s)
        az_deg += now_deg_s * TICK_S
        reading_deg = az_deg + random.gauss(0.0, noise_deg)
        watch, is_standing = to_goal(watch, k, reading_deg, goal_deg, limits, scale=0.02)
        assert not is_standing and not watch.problem


@pytest.mark.parametrize("goal_deg_s", [0.0, 5.0, 60.0])
def test_an_azimuth_that_stands_is_told_also_when_its_goal_moves_and_its_readings_are_noisy(goal_deg_s: float) -> None:
    watch, random, k, is_standing = TurnWatch(), Random(1), 0, False
    while not is_standing and k < 300:
        reading_deg = -200.0 + random.gauss(0.0, 1.0)
        watch, is_standing = to_goal(watch, k, reading_deg, -150.0 + goal_deg_s * TICK_S * k, WRAP, scale=0.02)
        k += 1
    assert TICK_S * k < 2.0 * (PATIENCE_S + drive_s(STEP_DEG, WRAP))


@pytest.mark.parametrize("rate_deg_s", [1.5, 5.0, 20.0])
def test_an_azimuth_that_comes_nearer_as_its_drive_can_is_let_be_and_one_that_stands_is_told_with_both_angles(
    rate_deg_s: float,
) -> None:
    drive = AxisLimits(-270.0, 270.0, rate_deg_s, rate_deg_s / 2.0)
    watch, k = TurnWatch(), 0
    while (az_deg := -200.0 + 0.9 * rate_deg_s * TICK_S * k) < 150.0:
        watch, is_standing = to_goal(watch, k, az_deg, 150.0, drive)
        assert not is_standing and not watch.problem
        k += 1
    watch, k = TurnWatch(), 0
    while not watch.problem:
        watch, is_standing = to_goal(watch, k, -200.0, 150.0, drive)
        k += 1
    assert is_standing
    assert TICK_S * k == pytest.approx(PATIENCE_S + drive_s(STEP_DEG, drive), abs=2 * TICK_S)
    assert (
        watch.problem == "azimuth late: at -200.0 deg, on the low half of the range as believed, its goal at 150.0 deg"
    )
    assert to_goal(watch, k, 149.0, 150.0, drive)[0].problem == ""


def test_a_drive_much_slower_than_its_file_says_is_told_though_it_comes_nearer() -> None:
    watch, verdicts = TurnWatch(), []
    for k in range(600):
        watch, is_standing = to_goal(watch, k, -200.0 + 0.3 * k, 150.0, WRAP)
        verdicts.append(is_standing)
    assert not any(verdicts)
    assert watch.problem.startswith("azimuth late")
