"""Tables of positions: rows and their gaps, velocities made from positions, interpolation, what can be no orbit."""

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from acu_daemon.errors import ElementsError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.celestial import teme_from_eme2000, teme_from_gcrf, teme_from_tod
from acu_daemon.orbit.ephemeris_rows import PositionRows, at, segments_of, velocities_of
from acu_daemon.orbit.ephemeris_segment import (
    LEAST_POSITIONS,
    EphemerisSegment,
    better_velocities_m_s,
    velocities_m_s,
)
from acu_daemon.orbit.ephemeris_states import check_neighbours, mean_motions_rad_s, states_teme
from acu_daemon.orbit.frames import teme_from_itrs_states
from acu_daemon.orbit.hermite import HermiteTable
from acu_daemon.orbit.oem_text import BadSegmentError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

START = 8.5e8
A_M = 6.8e6
RATE_RAD_S = float(np.sqrt(MU_M3_S2 / A_M**3))
ROUNDING = 1e-6

# Rows


def rows(times_s: list[float], velocity_count: int = 0) -> PositionRows:
    """Rows at seconds after START; so many of them, the first ones, have velocities."""
    made = PositionRows()
    for k, one in enumerate(times_s):
        made.add(10 + k, START + one, (A_M + one, 2.0 * one, -one))
    made.v_m_s[:velocity_count] = [(1.0, 2.0, -1.0)] * velocity_count
    return made


def test_a_row_is_kept_with_its_line_and_has_no_velocity_yet() -> None:
    made = rows([0.0, 5.0])
    assert (made.lines, made.tai_s, made.v_m_s) == ([10, 11], [START, START + 5.0], [None, None])
    assert made.r_m == [(A_M, 0.0, 0.0), (A_M + 5.0, 10.0, -5.0)]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("off_m", "is_same"), [(0.0, True), (1.0, True), (-1.0, True), (1.01, False), (-1.01, False)])
def test_a_position_that_stands_twice_is_left_out_and_another_at_its_time_refused(
    axis: int, off_m: float, is_same: bool
) -> None:
    made = rows([0.0])
    place = [A_M, 0.0, 0.0]
    place[axis] += off_m
    again = (place[0], place[1], place[2])
    if is_same:
        made.add(11, START, again)
        assert made.lines == [10]
        return
    with pytest.raises(BadSegmentError, match="two positions at one time, and they differ") as told:
        made.add(11, START, again)
    assert told.value.line == 11


def test_times_that_fall_are_refused() -> None:
    with pytest.raises(BadSegmentError) as told:
        rows([0.0]).add(11, START - 1e-3, (A_M, 0.0, 0.0))
    assert str(told.value) == "the times must rise, this one does not"


def made_of(given: PositionRows) -> tuple[list[tuple[int, Array, Array, Array]], list[str]]:
    make: Any = lambda *parts: parts  # noqa: E731
    found: Any
    found, problems = segments_of(given, "x.cpf", make)
    return found, [str(one) for one in problems]


@pytest.mark.parametrize(("step", "is_gap"), [(2.5, False), (2.51, True), (2.0, False)])
def test_two_and_a_half_usual_steps_are_the_widest_that_is_no_gap(step: float, is_gap: bool) -> None:
    times_s = [60.0 * k for k in range(8)]
    times_s += [times_s[-1] + 60.0 * (step + k) for k in range(9)]
    found, problems = made_of(rows(times_s))
    assert [(line, part.size) for line, part, *_ in found] == ([(10, 8), (18, 9)] if is_gap else [(10, 17)])
    assert problems == []
    assert np.concatenate([part for _, part, *_ in found]).tolist() == [START + one for one in times_s]


@pytest.mark.parametrize(
    ("count", "velocity_count", "said"),
    [
        (1, 1, "1 states in a row, at least 2 are needed"),
        (2, 2, ""),
        (2, 1, "2 positions without velocities in a row, at least 8 are needed"),
        (7, 0, "7 positions without velocities in a row, at least 8 are needed"),
        (8, 0, ""),
        (8, 7, ""),
    ],
)
def test_a_part_that_is_too_short_is_told_with_its_line(count: int, velocity_count: int, said: str) -> None:
    found, problems = made_of(rows([60.0 * k for k in range(count)], velocity_count))
    assert problems == ([f"x.cpf, line 10: {said}"] if said else [])
    assert len(found) == (0 if said else 1)
    if found:
        _, _, places_m, speeds_m_s = found[0]
        assert places_m[-1].tolist() == [A_M + 60.0 * (count - 1), 120.0 * (count - 1), -60.0 * (count - 1)]
        assert speeds_m_s == pytest.approx(np.tile([1.0, 2.0, -1.0], (count, 1)), abs=ROUNDING)


def test_a_part_that_is_too_short_loses_none_of_the_others() -> None:
    times_s = [60.0 * k for k in range(8)] + [5000.0, 5060.0] + [9000.0 + 60.0 * k for k in range(8)]
    found, problems = made_of(rows(times_s))
    assert [line for line, *_ in found] == [10, 20]
    assert problems == ["x.cpf, line 18: 2 positions without velocities in a row, at least 8 are needed"]
    assert made_of(PositionRows()) == ([], [])


def test_a_note_has_its_place() -> None:
    assert at("x.cpf", 7, "cut") == "x.cpf, line 7: cut"


# Velocities


def polynomial(degree: int, tai_s: Array) -> tuple[Array, Array]:
    """A curve in space of some degree, and its slope."""
    x = (tai_s - START) / 300.0
    shares = np.array([1.0, -2.0, 0.5])
    return np.outer(x**degree, shares), np.outer(degree * x ** (degree - 1) / 300.0, shares)


UNEVEN = START + np.cumsum([60.0, 60.0, 50.0, 70.0, 60.0, 90.0, 60.0, 60.0, 55.0, 60.0, 60.0, 60.0, 80.0])


@pytest.mark.parametrize("degree", [1, 4, 9])
def test_velocities_are_the_slopes_of_the_curve_through_ten_positions(degree: int) -> None:
    r_m, v_m_s = polynomial(degree, UNEVEN)
    scale = float(np.abs(v_m_s).max())
    assert velocities_m_s(UNEVEN, r_m) == pytest.approx(v_m_s, abs=ROUNDING * scale)
    assert velocities_of(UNEVEN, r_m, None) == pytest.approx(v_m_s, abs=ROUNDING * scale)


def test_with_fewer_positions_or_a_narrower_width_the_degree_is_less() -> None:
    for count, width, degree in ((8, 10, 7), (13, 8, 7), (13, 3, 2)):
        r_m, v_m_s = polynomial(degree, UNEVEN[:count])
        assert velocities_m_s(UNEVEN[:count], r_m, width) == pytest.approx(v_m_s, abs=1e-8 * np.abs(v_m_s).max())
        r_m, v_m_s = polynomial(degree + 1, UNEVEN[:count])
        assert np.abs(velocities_m_s(UNEVEN[:count], r_m, width) - v_m_s).max() > 1e-5 * np.abs(v_m_s).max()


def test_the_positions_around_each_are_used_five_before_and_four_after() -> None:
    tai_s = START + 60.0 * np.arange(25)
    r_m = np.zeros((25, 3))
    r_m[12, 0] = 1.0
    moved = np.flatnonzero(np.abs(velocities_m_s(tai_s, r_m)[:, 0]) > 1e-12)
    assert set(moved.tolist()) | {12} == set(range(8, 18))


@pytest.mark.parametrize(("off_m_s", "is_mended"), [(0.1, True), (0.0, False)])
def test_given_velocities_that_the_positions_belie_are_mended_each_by_itself(off_m_s: float, is_mended: bool) -> None:
    angle = RATE_RAD_S * (UNEVEN - START)
    r_m = A_M * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    v_m_s = A_M * RATE_RAD_S * np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    given = v_m_s.copy()
    given[6, 1] += off_m_s
    better = better_velocities_m_s(UNEVEN, r_m, given)
    assert np.abs(better - v_m_s).max() < 2e-3
    assert velocities_of(UNEVEN, r_m, given).tolist() == better.tolist()
    is_as_given = (better == given).all(axis=1)
    assert is_as_given[6] == (not is_mended)
    few = better_velocities_m_s(UNEVEN[: LEAST_POSITIONS - 1], r_m[:7], given[:7])
    assert few.tolist() == given[:7].tolist()
    enough = better_velocities_m_s(UNEVEN[:LEAST_POSITIONS], r_m[:8], v_m_s[:8] + 50.0)
    assert np.abs(enough - v_m_s[:8]).max() < 1.0


# Interpolation


@pytest.mark.parametrize(("count", "degree"), [(2, 3), (3, 5), (4, 7), (13, 7)])
def test_a_curve_is_met_in_place_and_velocity_up_to_the_degree_of_its_states(count: int, degree: int) -> None:
    tai_s = UNEVEN[:count]
    table = HermiteTable(tai_s, *polynomial(degree, tai_s))
    fine = np.concatenate([np.linspace(tai_s[0], tai_s[-1], 57), tai_s])
    for found, expected in zip(table.states(fine), polynomial(degree, fine), strict=True):
        assert found == pytest.approx(expected, abs=1e-9 * float(np.abs(expected).max()))
    again = pickle.loads(pickle.dumps(table))
    assert again.states(fine)[0].tolist() == table.states(fine)[0].tolist()
    beyond = HermiteTable(tai_s, *polynomial(degree + 1, tai_s)).states(fine)[0]
    assert np.abs(beyond - polynomial(degree + 1, fine)[0]).max() > 0.0


@pytest.mark.parametrize("state", range(8))
def test_between_two_states_these_and_the_next_on_either_side_are_used(state: int) -> None:
    tai_s = START + 60.0 * np.arange(8)
    r_m, nothing = np.zeros((8, 3)), np.zeros((8, 3))
    r_m[state, 2] = 1.0
    middles = tai_s[:-1] + 30.0
    moved = np.flatnonzero(np.abs(HermiteTable(tai_s, r_m, nothing).states(middles)[0][:, 2]) > 1e-12)
    first = np.clip(np.arange(7) - 1, 0, 4)
    assert moved.tolist() == [k for k in range(7) if first[k] <= state < first[k] + 4]


# States that are an orbit


def segment(tai_s: Array, r_m: Array, v_m_s: Array, frame: Any = "TEME") -> EphemerisSegment:
    return EphemerisSegment(
        "oem", "2.0", "ISS", "1998-067-A", frame, tai_s[0], tai_s[-1], None, tai_s, r_m, v_m_s, "x.oem", 7
    )


def circle(count: int = 6, step_s: float = 10.0) -> tuple[Array, Array, Array]:
    tai_s = START + step_s * np.arange(count)
    angle = RATE_RAD_S * (tai_s - START)
    up = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    along = np.stack([-np.sin(angle), np.cos(angle), 0.0 * angle], axis=1)
    return tai_s, A_M * up, A_M * RATE_RAD_S * along


def test_a_segment_says_whose_it_is_and_where() -> None:
    one = segment(*circle())
    assert (one.label, one.where) == ("ISS (1998-067-A)", "x.oem, line 7")
    assert replace(one, object_id="").label == "ISS"


@pytest.mark.parametrize(
    ("frame", "turn"), [("EME2000", teme_from_eme2000), ("GCRF", teme_from_gcrf), ("TOD", teme_from_tod)]
)
def test_each_frame_is_turned_by_its_own_rotation(frame: str, turn: Any) -> None:
    tai_s, r_m, v_m_s = circle()
    found_m, found_m_s = states_teme(segment(tai_s, r_m, v_m_s, frame), EarthOrientation())
    matrices = turn(tai_s)
    for k in range(tai_s.size):
        assert found_m[k] == pytest.approx(matrices[k] @ r_m[k], abs=ROUNDING)
        assert found_m_s[k] == pytest.approx(matrices[k] @ v_m_s[k], abs=ROUNDING)


def test_what_turns_with_the_earth_is_turned_back_by_its_orientation_and_teme_stays() -> None:
    tai_s, r_m, v_m_s = circle()
    orientation = EarthOrientation(0.3, 0.1, 0.2)
    same_m, same_m_s = states_teme(segment(tai_s, r_m, v_m_s), orientation)
    assert (same_m is r_m, same_m_s is v_m_s) == (True, True)
    found = states_teme(segment(tai_s, r_m, v_m_s, "ITRF"), orientation)
    expected = teme_from_itrs_states(r_m, v_m_s, tai_s, orientation)
    assert [one.tolist() for one in found] == [one.tolist() for one in expected]


@pytest.mark.parametrize("e", [0.0, 0.1, 0.7])
def test_the_mean_motion_is_that_of_the_osculating_ellipse(e: float) -> None:
    tai_s, r_m, v_m_s = circle()
    a_m = 4.0 * A_M
    low_m = r_m * a_m * (1.0 - e) / A_M
    fast_m_s = v_m_s / (A_M * RATE_RAD_S) * np.sqrt(MU_M3_S2 * (1.0 + e) / (a_m * (1.0 - e)))
    found = mean_motions_rad_s(segment(tai_s, low_m, fast_m_s), low_m, fast_m_s)
    assert found == pytest.approx(np.full(6, np.sqrt(MU_M3_S2 / a_m**3)), rel=1e-9)


@pytest.mark.parametrize(
    ("r_share", "v_share", "is_one"),
    [
        (EARTH_EQUATORIAL_RADIUS_M / A_M * (1.0 + 1e-9), 1.0, True),
        (EARTH_EQUATORIAL_RADIUS_M / A_M * (1.0 - 1e-9), 1.0, False),
        (1.0, np.sqrt(2.0) * (1.0 - 1e-9), True),
        (1.0, np.sqrt(2.0) * (1.0 + 1e-9), False),
        (1.0, float("nan"), False),
    ],
)
def test_within_the_earth_or_too_fast_there_is_no_orbit(r_share: float, v_share: float, is_one: bool) -> None:
    tai_s, r_m, v_m_s = circle()
    r_m[3] *= r_share
    v_m_s[3] *= v_share
    if is_one:
        mean_motions_rad_s(segment(tai_s, r_m, v_m_s), r_m, v_m_s)
        return
    with pytest.raises(ElementsError) as told:
        mean_motions_rad_s(segment(tai_s, r_m, v_m_s), r_m, v_m_s)
    far_km, speed_km_s = A_M * r_share / 1e3, A_M * RATE_RAD_S * v_share / 1e3
    assert str(told.value) == (
        f"x.oem, line 7: ISS (1998-067-A): from {utc_text(START + 30.0)} on the state is not on an orbit around the "
        f"Earth: {far_km:.0f} km from its centre at {speed_km_s:.3f} km/s; are units (km, km/s) and REF_FRAME (TEME) "
        "right?"
    )


@pytest.mark.parametrize(("share", "said"), [(0.999, ""), (1.001, "are too far apart to be interpolated")])
def test_states_may_be_as_far_apart_as_a_radian_at_the_speed_of_escape(share: float, said: str) -> None:
    step_s = share / np.sqrt(2.0 * MU_M3_S2 / A_M**3)
    made = circle(step_s=step_s)
    if not said:
        check_neighbours(segment(*made), *made[1:])
        return
    with pytest.raises(ElementsError, match=f"states {step_s:.0f} s apart {said}"):
        check_neighbours(segment(*made), *made[1:])


TRAPEZOID = 0.02  # of what is allowed: what the rule leaves out, and how the pull of a moved state differs


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, -1, 0)])
@pytest.mark.parametrize("step_s", [10.0, 60.0, 240.0])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_position_may_be_off_its_velocities_by_as_much_as_a_manoeuvre_makes(
    step_s: float, direction: tuple[int, ...], side: int
) -> None:
    angle_rad = step_s * np.sqrt(2.0 * MU_M3_S2 / A_M**3)
    allowed_m = 500.0 + 0.005 * step_s**2 + 0.01 * A_M * angle_rad**5
    tai_s, r_m, v_m_s = circle(step_s=step_s)
    off_m = allowed_m * (1.0 + side * TRAPEZOID)
    r_m[-1] += off_m * np.array(direction)
    if side < 0:
        check_neighbours(segment(tai_s, r_m, v_m_s), r_m, v_m_s)
        return
    with pytest.raises(ElementsError) as told:
        check_neighbours(segment(tai_s, r_m, v_m_s), r_m, v_m_s)
    assert f": from {utc_text(START + 4.0 * step_s)} on position and velocity do not follow" in str(told.value)
    assert f" in {step_s:.0f} s: is REF_FRAME (TEME) right, a manoeuvre inside the segment?" in str(told.value)


@pytest.mark.parametrize(("step_s", "count", "room"), [(5.0, 6, TRAPEZOID), (10.0, 6, TRAPEZOID), (240.0, 3, 0.1)])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("sign", [-1, 1])
def test_velocities_may_change_otherwise_than_the_pull_makes_them_by_a_third_of_a_metre_per_second_squared(
    sign: int, side: int, step_s: float, count: int, room: float
) -> None:
    tai_s, r_m, v_m_s = circle(count, step_s)
    angle_rad = step_s * np.sqrt(2.0 * MU_M3_S2 / A_M**3)
    allowed_m_s2 = 0.3 + 0.15 * A_M * RATE_RAD_S * angle_rad**3 / step_s
    since_s, push_m_s2 = tai_s - tai_s.mean(), sign * allowed_m_s2 * (1.0 + side * room)
    r_m[:, 2] += push_m_s2 / 2.0 * since_s**2
    v_m_s[:, 2] += push_m_s2 * since_s
    if side < 0:
        check_neighbours(segment(tai_s, r_m, v_m_s), r_m, v_m_s)
        return
    with pytest.raises(
        ElementsError, match=r"the velocities do not change as the Earth's pull makes them, by 0\.[36] m"
    ):
        check_neighbours(segment(tai_s, r_m, v_m_s), r_m, v_m_s)


def test_one_velocity_alone_that_is_off_is_none_of_a_frame() -> None:
    tai_s, r_m, v_m_s = circle()
    v_m_s[0, 2] += 40.0  # 4 m/s2 in one step of five
    check_neighbours(segment(tai_s, r_m, v_m_s), r_m, v_m_s)
