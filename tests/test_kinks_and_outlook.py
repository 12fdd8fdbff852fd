"""Manoeuvres as kinks in D, and when D reaches its limit: sizes, signs and times of made histories."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from acu_daemon.groundtrack.history import History
from acu_daemon.groundtrack.kinks import WINDOW_DAYS, FoundManoeuvre, _kink_at, _noise_m, find_manoeuvres
from acu_daemon.groundtrack.outlook import STEP_S, Outlook, _looked_ahead, _usual_limit_m
from acu_daemon.units import DAY_S, Array

START = 8.0e8
PER_M = -20.0  # m of D in a day for each metre of the axis
NOISE = np.random.default_rng(3).normal(0.0, 1.0, 200)


def history(days: Array, d_m: Array, sky_m: Array | None = None, per_m: float = PER_M) -> History:
    reference: Any = SimpleNamespace(drift_m_day_per_m=per_m)
    return History(reference, START + days * DAY_S, d_m, np.zeros(days.size) if sky_m is None else sky_m)


def kinked(days: Array, *kinks: tuple[float, float]) -> Array:
    """D with changes of its slope, m in a day, at days; drag bends it steadily."""
    bent = 3.0 * days + 0.4 * days**2
    return bent + sum((change * np.maximum(days - day, 0.0) for day, change in kinks), np.zeros(days.size))


DAYS = np.arange(0.0, 40.0, 1.0)


@pytest.mark.parametrize("per_m", [PER_M, -PER_M])
@pytest.mark.parametrize("delta_a_m", [-12.0, 12.0])
@pytest.mark.parametrize("day", [19.5, 20.05, 20.9])
def test_a_manoeuvre_is_found_with_its_size_and_its_place_in_the_gap(
    day: float, delta_a_m: float, per_m: float
) -> None:
    d_m = kinked(DAYS, (day, per_m * delta_a_m))
    [found] = find_manoeuvres(history(DAYS, d_m, per_m=per_m))
    assert (found.tai_s - START) / DAY_S == pytest.approx(day, abs=0.03)
    assert found.delta_a_m == pytest.approx(delta_a_m, abs=0.2)
    assert 0.0 < found.sigma_m < 1.0


def test_several_are_found_the_oldest_first_and_what_sun_and_moon_make_is_none() -> None:
    sky_m = 500.0 * np.abs(DAYS - 30.0)
    d_m = kinked(DAYS, (12.5, 300.0), (24.5, -200.0)) + sky_m
    found = find_manoeuvres(history(DAYS, d_m, sky_m))
    assert [round((one.tai_s - START) / DAY_S, 1) for one in found] == [12.5, 24.5]
    assert [one.delta_a_m for one in found] == [pytest.approx(-15.0, abs=0.3), pytest.approx(10.0, abs=0.3)]
    assert find_manoeuvres(history(DAYS, kinked(DAYS))) == []
    assert find_manoeuvres(history(DAYS, kinked(DAYS) + 3.0 * NOISE[:40])) == []


@pytest.mark.parametrize(("delta_a_m", "is_found"), [(0.45, False), (0.55, True)])
def test_half_a_metre_is_the_least(delta_a_m: float, is_found: bool) -> None:
    flat = 200.0 * delta_a_m * np.maximum(DAYS - 20.5, 0.0)
    assert (find_manoeuvres(history(DAYS, flat, per_m=200.0)) != []) == is_found


def test_in_a_history_of_a_few_points_nothing_is_found() -> None:
    for count in range(3, 7):
        days = DAYS[:count]
        found = find_manoeuvres(history(days, kinked(days, (count / 2.0, 500.0))))
        assert all(isinstance(one, FoundManoeuvre) for one in found)
    assert find_manoeuvres(history(DAYS[:5], kinked(DAYS[:5], (2.5, 500.0)))) == []


@pytest.mark.parametrize(("k", "is_one"), [(1, False), (2, True), (36, True), (37, False)])
def test_a_kink_has_three_points_on_either_side(k: int, is_one: bool) -> None:
    assert (_kink_at(DAYS, kinked(DAYS, (k + 0.5, 100.0)), k, [], 1.0) is not None) == is_one


@pytest.mark.parametrize(("others", "is_one"), [([17], False), ([16], True), ([22], True), ([21], False), ([], True)])
def test_the_window_ends_at_the_kinks_found_already(others: list[int], is_one: bool) -> None:
    d_m = kinked(DAYS, (19.5, 100.0), *((one + 0.5, 400.0) for one in others))
    kink = _kink_at(DAYS, d_m, 19, others, 1.0)
    assert (kink is not None) == is_one
    if kink is not None:
        assert kink.change_m_day == pytest.approx(100.0, abs=1e-6)
        assert kink.left_m2 == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("far_days", "counts"), [(WINDOW_DAYS - 0.5, True), (WINDOW_DAYS + 0.51, False)])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_points_within_eight_days_on_either_side_count(side: int, far_days: float, counts: bool) -> None:
    assert WINDOW_DAYS == 8.0
    d_m = kinked(DAYS, (19.5, 100.0))
    d_m[round(19.5 + side * far_days)] += 50.0
    kink = _kink_at(DAYS, d_m, 19, [], 1.0)
    assert kink is not None
    assert (kink.left_m2 > 1.0) == counts


def test_drag_that_changes_looks_like_a_kink_and_counts_in_its_sigma() -> None:
    steady, bent = (_kink_at(DAYS, one * DAYS**2, 19, [], 1.0) for one in (0.0, 100.0))
    assert steady is not None
    assert bent is not None
    assert bent.sigma_m_day == pytest.approx(np.hypot(steady.sigma_m_day, 0.1 * 2.0 * 100.0 * 3.0), rel=1e-6)
    doubled = _kink_at(DAYS, 0.0 * DAYS, 19, [], 2.0)
    assert doubled is not None
    assert doubled.sigma_m_day == pytest.approx(2.0 * steady.sigma_m_day)


def test_the_noise_is_that_of_the_points_whatever_a_few_of_them_do() -> None:
    days = np.arange(0.0, 200.0)
    assert _noise_m(days, 20.0 * NOISE + 3.0 * days) == pytest.approx(20.0, rel=0.2)
    wild = 20.0 * NOISE
    wild[::20] += 4000.0
    assert _noise_m(days, wild) < 35.0
    assert _noise_m(days, 5.0 * days) == 1.0
    uneven = np.cumsum(np.where(np.arange(200) % 2, 0.2, 1.8))
    assert _noise_m(uneven, 700.0 * uneven) == 1.0


# The outlook


def pushed(*sizes_m: float) -> list[FoundManoeuvre]:
    return [FoundManoeuvre(START + (5.0 + 5.0 * k) * DAY_S, one, 1.0) for k, one in enumerate(sizes_m)]


@pytest.mark.parametrize(
    ("sizes_m", "at_days"),
    [((), None), ((-1.0,), None), ((1.0,), 5.0), ((1.0, -1.0, 2.0), 10.0), ((9.0, 1.0, 1.0, -2.0, 1.0), 50.0 / 3.0)],
)
def test_the_usual_limit_is_that_of_the_last_three_manoeuvres_up(
    sizes_m: tuple[float, ...], at_days: float | None
) -> None:
    found = _usual_limit_m(history(DAYS, 7.0 * DAYS), pushed(*sizes_m))
    assert found == (None if at_days is None else pytest.approx(7.0 * at_days))


class Drift:
    """What a filter knows at a step, and what it expects: D falls or rises evenly from 100 m on."""

    state = np.array([100.0, 0.002, 0.25])
    covariance = np.diag([4.0, 1e-8, 0.09])

    def __init__(self, slope_m_s: float = 0.01, count: int = 5) -> None:
        self.slope_m_s, self.count = slope_m_s, count
        self.asked: list[tuple[int, float]] = []

    def coming(self, _start: int) -> tuple[Array, Array]:
        elapsed_s = 1000.0 * np.arange(1.0, self.count + 1.0)
        return elapsed_s, 100.0 + self.slope_m_s * elapsed_s

    def sigma_m(self, start: int, tau_s: float) -> float:
        self.asked.append((start, tau_s))
        return 3.0


def ahead(limit_m: float | None, **more: Any) -> tuple[Outlook, Drift]:
    drift: Any = Drift(**more)
    return _looked_ahead(drift, 7, START, limit_m), drift


NOW = START + 7 * STEP_S


def test_what_is_known_now_is_told_by_the_day() -> None:
    found, _ = ahead(None)
    assert (found.tai_s, found.d_m, found.d_sigma_m) == (NOW, 100.0, 2.0)
    assert (found.rate_m_day, found.rate_sigma_m_day) == (pytest.approx(172.8), pytest.approx(8.64))
    assert (found.drag_factor, found.drag_factor_sigma) == (1.25, pytest.approx(0.3))
    assert (found.limit_m, found.next_tai_s, found.next_sigma_days) == (None, None, 0.0)
    assert found.ahead_tai_s.tolist() == [NOW + 1000.0 * k for k in range(1, 6)]
    assert found.ahead_m.tolist() == pytest.approx([110.0, 120.0, 130.0, 140.0, 150.0])


@pytest.mark.parametrize(
    ("limit_m", "in_s"),
    [(99.0, 0.0), (100.0, 0.0), (104.0, 400.0), (110.0, 1000.0), (125.0, 2500.0), (150.0, 5000.0), (150.1, None)],
)
def test_the_next_manoeuvre_is_when_d_reaches_its_limit(limit_m: float, in_s: float | None) -> None:
    found, drift = ahead(limit_m)
    assert found.limit_m == limit_m
    assert found.next_tai_s == (None if in_s is None else pytest.approx(NOW + in_s, abs=1e-3))
    if in_s:
        assert drift.asked == [(7, pytest.approx(in_s))]
        assert found.next_sigma_days == pytest.approx(3.0 / 0.01 / DAY_S)
    else:
        assert (drift.asked, found.next_sigma_days) == ([], 0.0)


def test_where_d_falls_or_nothing_is_expected_there_is_no_date() -> None:
    assert ahead(110.0, slope_m_s=-0.01)[0].next_tai_s is None
    assert ahead(90.0, count=0)[0].next_tai_s is None
