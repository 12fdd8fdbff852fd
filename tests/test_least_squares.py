"""assist.estimators.full.least_squares: one linear step, how sweeps go on and end, and which start is believed."""

from dataclasses import replace
from math import exp
from typing import Any

import numpy as np
import pytest
from made_orbits import EPOCH_TAI_S, circular, site

from acu_daemon.assist.estimators.full import least_squares
from acu_daemon.assist.estimators.full.estimated_states import STATE_COUNT, Prior, make_prior
from acu_daemon.assist.estimators.full.least_squares import Batch, Solution, solve
from acu_daemon.assist.estimators.full.noise_correlation import WHITE, NoiseCorrelation
from acu_daemon.assist.estimators.full.normal_points import Points, Residuals, Sights, sights
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings
from acu_daemon.orbit.look import look_at
from acu_daemon.units import Array

SETTINGS = EstimatorSettings(0.03, 0.03)
SOURCE, WHERE = circular(66.0, 0.01), site(5.0, 20.0)
PRIOR = make_prior(SOURCE, SETTINGS, EPOCH_TAI_S)
BATCH = Batch(SOURCE, WHERE, SETTINGS, PRIOR)
CORRELATED = NoiseCorrelation(0.5, 1.0)  # three times the variances


def seen(count: int, step_s: float = 1.0) -> Sights:
    tai_s = EPOCH_TAI_S + 200.0 + step_s * np.arange(count)
    found = look_at(SOURCE, tai_s, WHERE)
    return sights(Readings(tai_s, found.az_deg, found.el_deg))


# The readings that come first


@pytest.mark.parametrize(("step_s", "count"), [(1.0, 60), (0.5, 120), (0.9375, 64), (7.0, 9)])
def test_the_first_minute_is_all_before_it_is_over(step_s: float, count: int) -> None:
    every = seen(150, step_s)
    first = least_squares._first_of(every)
    for name in ("tai_s", "sin_az", "cos_az", "sin_el", "cos_el", "sense"):
        assert np.array_equal(getattr(first, name), getattr(every, name)[:count])


# One step


@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_a_step_solves_the_normal_equations_with_the_prior_as_a_reading(factor: float) -> None:
    rng = np.random.default_rng(3)
    root = rng.normal(size=(STATE_COUNT, STATE_COUNT))
    prior = Prior(rng.normal(size=STATE_COUNT), root @ root.T + np.eye(STATE_COUNT))
    x, h = rng.normal(size=STATE_COUNT), rng.normal(size=(STATE_COUNT, 2, 9))
    points = Points(np.arange(9.0), rng.normal(size=(2, 9)), rng.uniform(0.5, 2.0, (2, 9)))
    new, covariance, fitted_count = least_squares._step(prior, x, h, points, factor)
    rows, weight = h.reshape(STATE_COUNT, -1), (points.per_sigma**2 / factor).reshape(-1)
    before = np.linalg.inv(prior.covariance)
    after = np.linalg.inv(before + (rows * weight) @ rows.T)
    right = (rows * weight) @ (points.off.reshape(-1) + x @ rows) + before @ prior.mean
    assert new == pytest.approx(after @ right)
    assert covariance == pytest.approx(after, abs=1e-9)
    assert fitted_count == pytest.approx(float(np.trace((before + (rows * weight) @ rows.T - before) @ after)))


def test_what_has_no_variance_stays_where_the_prior_has_it_and_is_not_fitted() -> None:
    sigma = np.where(np.arange(STATE_COUNT) % 2, 0.0, 1.0)
    prior = Prior(np.full(STATE_COUNT, 0.5), np.diag(sigma**2))
    h = np.ones((STATE_COUNT, 2, 4))
    points = Points(np.arange(4.0), np.full((2, 4), 50.0), np.full((2, 4), 1e3))
    new, covariance, fitted_count = least_squares._step(prior, prior.mean, h, points, 1.0)
    assert (new[1::2] == 0.5).all()
    assert (covariance[1::2] == 0.0).all()
    assert new[::2].sum() == pytest.approx(0.5 * 9 + 50.0, rel=1e-5)
    assert fitted_count == pytest.approx(1.0, abs=1e-5)


# Sweeps


class Steps:
    """Steps that move the path on the sky by so much, one after the other; the last again and again."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, moves_rad: list[float]) -> None:
        self.moves_rad, self.count, self.factors = moves_rad, 0, []
        self.shifts: list[bool] = []
        self.partials: list[Array] = []  # the states about which they were made
        made, sky = least_squares.OrbitPartials, least_squares.sky_partials
        monkeypatch.setattr(least_squares, "_step", self.step)
        monkeypatch.setattr(least_squares, "OrbitPartials", lambda b, x, n: self.partials.append(x) or made(b, x, n))

        def partials_of(path: Any, curve: Any, here: Any, has_shift: bool, sense: Array) -> Array:
            self.shifts.append(has_shift)
            found = sky(path, curve, here, has_shift, sense)
            h = np.zeros_like(found)
            h[6, 0, 1] = -1.0  # one point alone sees an azimuth's bias
            return h

        monkeypatch.setattr(least_squares, "sky_partials", partials_of)

    def step(self, prior: Prior, x: Array, h: Array, points: Points, factor: float) -> tuple[Array, Array, float]:
        move = self.moves_rad[min(self.count, len(self.moves_rad) - 1)]
        self.count += 1
        self.factors.append(factor)
        new = x.copy()
        new[6] += move
        return new, np.full((STATE_COUNT, STATE_COUNT), float(self.count)), 3.0 * self.count


def sweeps(x: Array | None = None, partials: Any = None, batch: Batch = BATCH, count: int = 30) -> Any:
    x = np.zeros(STATE_COUNT) if x is None else x
    return least_squares._sweeps(batch, seen(count), x, partials, 2.0)


@pytest.mark.parametrize(
    ("moves_rad", "count"),
    [
        ([0.9e-7], 1),
        ([-0.9e-7], 1),
        ([1e-4, 0.9e-7], 2),
        ([1e-4, -1e-4, 1.1e-7, 0.9e-7], 4),
        ([1.1e-7], 15),
    ],
)
def test_sweeps_end_when_no_point_moves_or_there_were_fifteen(moves_rad, count, monkeypatch) -> None:
    steps = Steps(monkeypatch, moves_rad)
    solution, points, fitted_count = sweeps()
    assert (steps.count, fitted_count, solution.covariance[0, 0]) == (count, 3.0 * count, count)
    assert set(steps.factors) == {2.0}
    taken = [moves_rad[min(k, len(moves_rad) - 1)] for k in range(count)]
    assert solution.x[6] == pytest.approx(sum(taken), abs=1e-12)
    assert (points.tai_s.size, solution.left.weights.size, solution.noise) == (30, 30, WHITE)
    assert len(steps.partials) == 1


@pytest.mark.parametrize(
    ("moves_rad", "made_after"),
    [
        ([2.9e-4, 0.0], []),
        ([3.1e-4, 0.0], [1]),
        ([-3.1e-4, 0.0], [1]),
        ([1.6e-4, -1.6e-4, 0.0], [2]),
        ([1.6e-4, 1.6e-4, 1.6e-4, 1.6e-4, 0.0], [2, 4]),
    ],
)
def test_partials_are_made_anew_where_the_path_has_moved_away_from_them(moves_rad, made_after, monkeypatch) -> None:
    steps = Steps(monkeypatch, moves_rad)
    solution, _, _ = sweeps()
    places = [float(sum(moves_rad[:k])) for k in (0, *made_after)]
    assert [float(x[6]) for x in steps.partials] == pytest.approx(places, abs=1e-12)
    since = sum(abs(one) for one in moves_rad[(made_after or [0])[-1] :])
    assert solution.partials.moved_rad == pytest.approx(since, abs=1e-12)


def test_partials_of_the_same_nodes_are_used_again_with_how_far_the_path_has_moved(monkeypatch) -> None:
    steps = Steps(monkeypatch, [2e-4, 0.0])
    first, _, _ = sweeps()
    assert len(steps.partials) == 1
    steps.count = 0
    again, _, _ = sweeps(first.x, first.partials)
    assert len(steps.partials) == 2  # 4e-4 in all
    assert float(steps.partials[1][6]) == pytest.approx(4e-4)
    steps.count = 1
    third, _, _ = sweeps(again.x, again.partials)
    assert (third.partials is again.partials, len(steps.partials)) == (True, 2)
    sweeps(again.x, again.partials, count=200)
    assert len(steps.partials) == 3


@pytest.mark.parametrize("sigma_m", [0.0, 100.0])
def test_the_stations_shift_has_partials_where_it_is_in_question(sigma_m: float, monkeypatch) -> None:
    steps = Steps(monkeypatch, [0.0])
    settings = replace(SETTINGS, station_sigma_m=sigma_m)
    sweeps(batch=replace(BATCH, prior=make_prior(SOURCE, settings, EPOCH_TAI_S)))
    assert steps.shifts == [sigma_m > 0.0]


def test_readings_are_compared_from_where_the_states_put_the_station(monkeypatch) -> None:
    Steps(monkeypatch, [0.0])
    x = np.zeros(STATE_COUNT)
    x[10:13] = 5000.0, -3000.0, 100.0
    given, moved = sweeps()[0].left.off_rad, sweeps(x)[0].left.off_rad
    assert np.abs(given).max() < 1e-5
    assert np.abs(moved).min(axis=1).max() > 1e-4


# Noise that goes on


class Swept:
    """Sweeps and what their residuals show of the noise, as they are told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, found: NoiseCorrelation) -> None:
        self.calls: list[tuple[Any, Any, float]] = []
        self.asked: list[Any] = []
        self.found = found
        monkeypatch.setattr(least_squares, "_sweeps", self.sweeps)
        monkeypatch.setattr(least_squares, "noise_correlation", self.noise)

    def sweeps(self, batch: Batch, given: Sights, x: Any, partials: Any, factor: float) -> Any:
        self.calls.append((x, partials, factor))
        return solution(len(self.calls)), "points", 5.0

    def noise(self, *asked: Any) -> NoiseCorrelation:
        self.asked.append(asked)
        return self.found


def solution(k: int, weights: float = 1.0, scale: float = 1.0) -> Solution:
    left = Residuals(np.zeros((2, 4)), np.ones((2, 4)), np.full(2, scale), np.full(4, weights))
    return Solution(f"x{k}", np.eye(2), left, f"partials{k}")  # type: ignore[arg-type]


def of_factor(factor: float) -> NoiseCorrelation:
    assert NoiseCorrelation(0.0, factor).factor == pytest.approx(max(factor, 1.0))
    return NoiseCorrelation(0.0, factor)


def test_noise_that_nobody_knows_of_is_white_whatever_a_solution_near_by_had(monkeypatch) -> None:
    swept = Swept(monkeypatch, CORRELATED)
    found = least_squares._sweep(BATCH, seen(9), "x", "partials", CORRELATED)  # type: ignore[arg-type]
    assert (swept.calls, swept.asked, found.noise) == ([("x", "partials", 1.0)], [], WHITE)


@pytest.mark.parametrize(
    ("near_by", "known", "factor"),
    [(None, CORRELATED, 3.0), (of_factor(5.0), CORRELATED, 5.0), (None, WHITE, 1.0), (of_factor(5.0), WHITE, 5.0)],
)
def test_noise_begins_as_it_was_near_by_or_in_earlier_passes(near_by, known, factor, monkeypatch) -> None:
    swept = Swept(monkeypatch, of_factor(factor))
    found = least_squares._sweep(replace(BATCH, noise=known), seen(9), "x", "partials", near_by)
    assert swept.calls == [("x", "partials", pytest.approx(factor))]
    assert swept.asked == [("points", 5.0, known)]
    assert (found.x, found.noise) == ("x1", of_factor(factor))


@pytest.mark.parametrize(("share", "is_again"), [(0.19, False), (0.21, True), (-0.19, False), (-0.21, True)])
def test_noise_that_is_seen_to_be_other_is_worth_another_sweep(share: float, is_again: bool, monkeypatch) -> None:
    other = of_factor(3.0 * exp(share))
    swept = Swept(monkeypatch, other)
    found = least_squares._sweep(replace(BATCH, noise=CORRELATED), seen(9), "x", "partials")
    assert swept.calls[1:] == ([("x1", "partials1", pytest.approx(other.factor))] if is_again else [])
    assert (found.x, found.noise) == ("x2" if is_again else "x1", other)


# Which start


class Starts:
    """Solutions as they are told, one after the other."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *solutions: Solution) -> None:
        self.left, self.calls = list(solutions), []
        monkeypatch.setattr(least_squares, "_sweep", self.sweep)

    def sweep(self, batch: Batch, given: Sights, x: Any, partials: Any, noise: Any = None) -> Solution:
        self.calls.append((given.tai_s.size, "the prior's" if x is PRIOR.mean else x, partials, noise))
        return self.left.pop(0)


def test_without_a_solution_the_first_minute_comes_first(monkeypatch) -> None:
    starts = Starts(monkeypatch, solution(1), warm := solution(2))
    assert solve(BATCH, seen(90), None) is warm
    assert starts.calls == [(60, "the prior's", None, None), (90, "x1", "partials1", None)]


def test_a_solution_with_fewer_readings_is_gone_on_from_with_its_noise(monkeypatch) -> None:
    starts = Starts(monkeypatch, warm := solution(2))
    assert solve(BATCH, seen(90), replace(solution(1), noise=CORRELATED)) is warm
    assert starts.calls == [(90, "x1", "partials1", CORRELATED)]


@pytest.mark.parametrize(("weight", "is_doubtful"), [(0.951, False), (0.949, True), (0.95, True)])
@pytest.mark.parametrize(("scales", "best"), [((2.0, 1.0), 1), ((1.0, 2.0), 0), ((1.0, 1.0), 0)])
def test_where_many_readings_look_like_outliers_the_start_with_less_noise_counts(
    weight: float, is_doubtful: bool, scales: tuple[float, float], best: int, monkeypatch
) -> None:
    warm, cold = solution(2, weight, scales[0]), solution(3, 0.1, scales[1])
    starts = Starts(monkeypatch, warm, cold)
    found = solve(BATCH, seen(90), replace(solution(1), noise=CORRELATED))
    assert found is ((warm, cold)[best] if is_doubtful else warm)
    assert starts.calls[1:] == ([(90, "the prior's", None, None)] if is_doubtful else [])
