"""P6: an axis that stands still, runs away or turns the wrong way is found; one that does what it can is left alone."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.safety.axis_watch import (
    AWAY_S,
    AxisSeen,
    AxisWatch,
    Bounds,
    Duty,
    duty_of,
    sky_scale,
    watch_axis,
)
from acu_daemon.control.safety.encoder_watch import FROZEN_DEG, EncoderWatch, watch_encoders
from acu_daemon.model import AxisLimits, Pointing
from acu_daemon.pointing.axis import AxisState, step

LIMITS = AxisLimits(-270.0, 270.0, 20.0, 10.0)
BOUNDS = Bounds(1.0, 2.0)
TICK_S = 0.1


@dataclass
class Found:
    text: str
    after_s: float
    angle_deg: float


def judge(angles_deg, gaps_deg, duty=Duty.FOLLOW, scale=1.0, bounds=BOUNDS) -> Found | None:
    """The first complaint about an axis that shows these angles ten times a second."""
    watch, before_deg = AxisWatch(), angles_deg[0]
    for k, (angle_deg, gap_deg) in enumerate(zip(angles_deg, gaps_deg, strict=True)):
        rate_deg_s = (angle_deg - before_deg) / TICK_S
        before_deg = angle_deg
        seen = AxisSeen(TICK_S * k, angle_deg, rate_deg_s, duty, gap_deg, scale)
        watch, text = watch_axis(watch, seen, LIMITS, bounds)
        if text:
            return Found(text, TICK_S * k, angle_deg)
    return None


def follow(commands_deg, angles_deg, **changes) -> Found | None:
    return judge(angles_deg, [c - a for c, a in zip(commands_deg, angles_deg, strict=True)], **changes)


def ticks(seconds: float) -> list[float]:
    return [TICK_S * k for k in range(round(seconds / TICK_S))]


def test_p6_beyond_the_zenith_a_degree_of_azimuth_is_as_much_on_the_sky_as_before_it() -> None:
    assert sky_scale(140.0) == pytest.approx(sky_scale(40.0))


@pytest.mark.parametrize("rate_deg_s", [0.3, 2.0, 20.0, -5.0])
def test_p6_an_axis_that_stands_still_is_found_two_seconds_after_its_command_left_it_by_a_degree(rate_deg_s) -> None:
    found = follow([min(rate_deg_s * t, 10.0) for t in ticks(10.0)], [0.0 for _ in ticks(10.0)])
    assert found is not None
    assert found.text == "stands still away from its command"
    assert found.after_s == pytest.approx(1.0 / abs(rate_deg_s) + 2.0, abs=0.25)


@pytest.mark.parametrize("bounds", [Bounds(0.4, 0.6), Bounds(3.0, 5.0)], ids=str)
def test_p6_angle_and_time_are_those_of_the_configuration(bounds: Bounds) -> None:
    stands = follow([1.0 * t for t in ticks(20.0)], [0.0 for _ in ticks(20.0)], bounds=bounds)
    assert stands is not None
    assert stands.after_s == pytest.approx(bounds.error_deg / 1.0 + bounds.error_s, abs=0.25)
    away = follow([0.0 for _ in ticks(20.0)], [-2.0 * t for t in ticks(20.0)], bounds=bounds)
    assert away is not None
    braking_deg, seen_deg = 2.0**2 / LIMITS.max_acceleration_deg_s2, 2.0 * AWAY_S
    assert away.angle_deg == pytest.approx(-2.0 * bounds.error_deg - braking_deg - seen_deg, abs=0.7)
    runs = judge([2.0 * t for t in ticks(20.0)], [None for _ in ticks(20.0)], duty=Duty.STAND, bounds=bounds)
    assert runs is not None
    assert runs.after_s == pytest.approx(bounds.error_deg / 2.0 + bounds.error_s, abs=0.25)


def in_turn(wrong_s: float, good_s: float, wrong: float, good: float) -> list[float]:
    """The one for so long, then the other, five times over."""
    return ([wrong] * round(wrong_s / TICK_S) + [good] * round(good_s / TICK_S)) * 5


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("wrong_s", "is_found"), [(1.9, False), (2.3, True)])
def test_p6_each_stray_from_where_it_stands_has_its_time_anew(side: int, wrong_s: float, is_found: bool) -> None:
    strays = [0.0] * 5 + in_turn(wrong_s, 0.2, 1.3 * side, 0.0)
    assert (judge(strays, [None] * len(strays), Duty.STAND) is not None) == is_found


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("wrong_s", "is_found"), [(0.4, False), (0.7, True)])
def test_p6_each_motion_away_from_a_command_has_its_time_anew(side: int, wrong_s: float, is_found: bool) -> None:
    """Beyond a degree and back to half of one, where it makes no progress either."""
    patient = Bounds(1.0, 30.0)
    away = [0.0] * 3 + in_turn(wrong_s, 0.2, -1.3 * side, -0.5 * side)
    found = judge(away, [3.0 * side - one for one in away], bounds=patient)
    assert (found is not None) == is_found
    assert found is None or found.text == "moves away from its command"


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(("fast_s", "is_found"), [(0.9, False), (1.3, True)])
def test_p6_each_race_has_its_time_anew(side: int, fast_s: float, is_found: bool) -> None:
    rates, angle_deg, angles = [0.0] * 3 + in_turn(fast_s, 0.1, 42.5 * side, 10.0 * side), 0.0, []
    for rate in rates:
        angle_deg += rate * TICK_S
        angles.append(angle_deg)
    assert (judge(angles, [None] * len(angles), Duty.FREE) is not None) == is_found


STRETCHES = st.lists(
    st.tuples(
        st.sampled_from(list(Duty)),
        st.sampled_from([0.0, 0.3, -0.3, 4.0, -4.0, 15.0, -15.0, 43.0, -43.0, 70.0]),  # deg/s
        st.sampled_from([None, 0.2, 1.5, -1.5, 8.0, -8.0]),  # from the axis to its command
        st.booleans(),  # or the command stands where it began
    ),
    min_size=2,
    max_size=6,
)


@given(STRETCHES)
def test_p6_an_axis_is_judged_alike_in_both_directions(stretches) -> None:
    watches, angle_deg, k = [AxisWatch(), AxisWatch()], 10.0, 0
    for duty, rate_deg_s, gap_deg, stands in stretches:
        command_deg = None if gap_deg is None else angle_deg + gap_deg
        for _ in range(25):
            k, angle_deg = k + 1, angle_deg + 0.1 * rate_deg_s
            left_deg = command_deg - angle_deg if stands and command_deg is not None else gap_deg
            problems = []
            for which, side in enumerate((1, -1)):
                left = None if left_deg is None else side * left_deg
                one = AxisSeen(1000.0 + 0.1 * k, side * angle_deg, side * rate_deg_s, duty, left)
                watches[which], problem = watch_axis(watches[which], one, LIMITS, BOUNDS)
                problems.append(problem)
            assert problems[0] == problems[1]


def test_p6_an_axis_that_turns_the_wrong_way_is_found_within_a_few_degrees() -> None:
    found = follow([0.5 * t for t in ticks(20.0)], [-0.5 * 5.0 * max(t - 3.0, 0.0) ** 2 for t in ticks(20.0)])
    assert found is not None
    assert found.text == "moves away from its command"
    assert abs(found.angle_deg) < 15.0


def test_p6_an_axis_that_runs_away_from_a_command_that_stands_is_found() -> None:
    found = follow([0.0 for _ in ticks(20.0)], [3.0 * t for t in ticks(20.0)])
    assert found is not None
    assert found.text == "moves away from its command"
    assert found.angle_deg < 10.0


@pytest.mark.parametrize("rate_deg_s", [0.8, 5.0, -20.0])
def test_p6_an_axis_that_moves_in_a_mode_that_moves_nothing_is_found(rate_deg_s) -> None:
    found = judge([0.0] * 30 + [rate_deg_s * t for t in ticks(20.0)], [None] * 230, Duty.STAND)
    assert found is not None
    assert found.text == "moves without a command"
    assert found.after_s < 3.0 + 6.0


@pytest.mark.parametrize("side", [-1, 1])
def test_p6_an_axis_faster_than_any_drive_is_found_in_autotrack_too(side: int) -> None:
    found = judge([side * 60.0 * t for t in ticks(5.0)], [None] * 50, Duty.FREE)
    assert found is None  # each step is an encoder's jump
    found = judge([side * 42.5 * t for t in ticks(5.0)], [None] * 50, Duty.FREE)
    assert found is not None
    assert found.text == "moves faster than its drive can"


def obeying(commands_deg: list[float], limits: AxisLimits) -> list[float]:
    """Angles of an axis that does what such a drive can."""
    state, angles_deg = AxisState(commands_deg[0]), []
    for command_deg in commands_deg:
        state = step(state, command_deg, 0.0, TICK_S, limits)
        angles_deg.append(state.position_deg)
    return angles_deg


@pytest.mark.parametrize("share", [1.0, 0.2])
@pytest.mark.parametrize(
    "commands_deg",
    [
        [0.0] * 10 + [180.0] * 600,
        [10.0 * t for t in ticks(18.0)] + [180.0] * 600,
        [0.15 * t for t in ticks(60.0)],
        [60.0 if (k // 40) % 2 else 0.0 for k in range(400)],
    ],
    ids=["half a turn", "keyhole", "slow path", "to and fro"],
)
def test_p6_a_drive_that_does_what_it_can_is_left_alone(commands_deg, share) -> None:
    drive = AxisLimits(-270.0, 270.0, 20.0 * share, 10.0 * max(share, 0.5))
    assert follow(commands_deg, obeying(commands_deg, drive)) is None


def test_a_stop_from_full_speed_may_take_its_way() -> None:
    angles_deg, rate_deg_s = [0.0], 20.0
    while rate_deg_s > 0.0:
        rate_deg_s -= 0.7  # weaker brakes than the limit of 10 deg/s^2
        angles_deg.append(angles_deg[-1] + max(rate_deg_s, 0.0) * TICK_S)
    watch = AxisWatch()
    watch, _ = watch_axis(watch, AxisSeen(-0.1, -2.0, 20.0, Duty.FREE), LIMITS, BOUNDS)
    for k, angle_deg in enumerate([*angles_deg, *[angles_deg[-1]] * 100]):
        rate = 20.0 if k == 0 else 0.0
        watch, text = watch_axis(watch, AxisSeen(TICK_S * k, angle_deg, rate, Duty.STAND), LIMITS, BOUNDS)
        assert text == ""


@given(st.integers(5, 90), st.floats(-360.0, 360.0))
def test_p6_one_wild_or_frozen_reading_moves_no_axis(at, jump_deg) -> None:
    path = [0.8 * t for t in ticks(10.0)]
    wild = [angle + (jump_deg if k == at else 0.0) for k, angle in enumerate(path)]
    frozen = [path[k - 1] if k == at else angle for k, angle in enumerate(path)]
    assert follow(path, wild) is None
    assert follow(path, frozen) is None


@given(st.integers(5, 90), st.floats(-30.0, 30.0))
def test_an_encoder_that_jumps_for_good_is_no_runaway(at, jump_deg) -> None:
    angles_deg = [0.0 if k < at else jump_deg for k in range(100)]
    assert judge(angles_deg, [None] * 100, Duty.FREE) is None
    if abs(jump_deg) > 5.0:
        assert judge(angles_deg, [None] * 100, Duty.STAND) is None


def test_noise_of_the_azimuth_next_to_the_zenith_is_no_motion() -> None:
    scale = sky_scale(89.8)
    angles_deg = [(-1.0) ** k * 0.06 / scale for k in range(200)]
    assert follow([0.0] * 200, angles_deg, scale=scale) is None
    assert judge(angles_deg, [None] * 200, Duty.STAND, scale) is None


def test_a_pause_in_the_readings_begins_everything_anew() -> None:
    watch = AxisWatch()
    for k in range(15):
        watch, text = watch_axis(watch, AxisSeen(TICK_S * k, 0.0, 0.0, Duty.FOLLOW, 5.0), LIMITS, BOUNDS)
        assert text == ""
    for k in range(15):
        watch, text = watch_axis(watch, AxisSeen(60.0 + TICK_S * k, 0.0, 0.0, Duty.FOLLOW, 5.0), LIMITS, BOUNDS)
        assert text == ""


@pytest.mark.parametrize(
    ("mode", "backup", "duty"),
    [
        (AcuMode.REMOTE, Backup.RATE, Duty.FOLLOW),
        (AcuMode.REMOTE_BACKUP, Backup.REMOTE, Duty.FOLLOW),
        (AcuMode.ACQUIRE, Backup.REMOTE, Duty.FOLLOW),
        (AcuMode.ACQUIRE, Backup.RATE, Duty.STAND),
        (AcuMode.STANDBY, Backup.REMOTE, Duty.STAND),
        (AcuMode.AUTOTRACK, Backup.REMOTE, Duty.FREE),
        (AcuMode.RATE_MEMORY, Backup.RATE, Duty.FREE),
        (AcuMode.STOWING, Backup.REMOTE, Duty.UNWATCHED),
        (AcuMode.MANUAL, Backup.REMOTE, Duty.UNWATCHED),
        (AcuMode.FAULT, Backup.REMOTE, Duty.UNWATCHED),
    ],
)
def test_what_a_mode_asks_of_the_axes(mode, backup, duty) -> None:
    assert duty_of(AcuStatus(10.0, 20.0, mode, backup_selected=backup)) is duty


# Encoders in autotrack


def encoders(readings, rate_deg_s: float) -> EncoderWatch:
    watch = EncoderWatch()
    for k, el_deg in enumerate(readings):
        status = AcuStatus(100.0 + 0.01 * k, el_deg, AcuMode.AUTOTRACK)
        watch = watch_encoders(watch, TICK_S * k, status, Pointing(100.0, 40.0, 0.1, rate_deg_s))
    return watch


@pytest.mark.parametrize("rate_deg_s", [0.05, 0.3, -0.3])
def test_an_encoder_that_shows_one_code_while_the_satellite_moves_is_frozen(rate_deg_s) -> None:
    tick_count = round(FROZEN_DEG / abs(rate_deg_s) / TICK_S)
    assert encoders([40.0] * tick_count, rate_deg_s).problem == ""
    assert encoders([40.0] * (tick_count + 2), rate_deg_s).problem == "elevation encoder frozen"


def test_an_encoder_at_the_culmination_or_that_moves_again_is_not_frozen() -> None:
    assert encoders([40.0] * 100, 0.001).problem == ""
    assert encoders([40.0] * 100 + [40.1], 0.3).problem == ""
