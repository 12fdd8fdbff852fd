"""Moving averages of D, mean elements of any plane, and storms put into a profile of flux."""

import numpy as np
import pytest

from acu_daemon.groundtrack.environment import Flux
from acu_daemon.groundtrack.mean_elements import MeanElements, mean_of, osculating_of, states_of
from acu_daemon.groundtrack.smoothing import RECURSION, WINDOW, DriftSmoother, RecursiveAverage, WindowAverage
from acu_daemon.groundtrack.storms import HIGHEST_KP, LOWEST_KP, with_storms
from acu_daemon.orbit.kepler import OsculatingElements, state_from_elements

SAME = 1e-9


def test_the_recursion_is_the_mean_until_its_count_and_forgets_a_share_at_each_step_after_it() -> None:
    average = RecursiveAverage(3)
    assert [average.add(one) for one in (3.0, 6.0, 9.0)] == [3.0, 4.5, 6.0]
    assert average.add(12.0) == pytest.approx((2.0 / 3.0 * 18.0 + 12.0) / (2.0 / 3.0 * 3.0 + 1.0))
    total, weight = 24.0, 3.0
    for value in (0.0, 5.0, -4.0):
        total, weight = 2.0 / 3.0 * total + value, 2.0 / 3.0 * weight + 1.0
        assert average.add(value) == pytest.approx(total / weight)


def test_the_window_has_its_last_values_and_no_other() -> None:
    average, values = WindowAverage(3), [3.0, 6.0, 9.0, -12.0, 0.0, 5.0, 7.0]
    assert [average.add(one) for one in values] == pytest.approx(
        [np.mean(values[max(0, k - 2) : k + 1]) for k in range(7)]
    )
    assert [WindowAverage(1).add(one) for one in (2.0, 8.0)] == [2.0, 8.0]


@pytest.mark.parametrize("kind", [RECURSION, WINDOW])
@pytest.mark.parametrize("slope_m_s", [0.5, -0.5])
def test_of_an_even_drift_the_rate_is_told_and_d_with_the_averages_delay(kind: str, slope_m_s: float) -> None:
    smoother = DriftSmoother(10.0, 40.0, 80.0, kind)
    assert smoother.add(100.0) == (100.0, 0.0)
    second = smoother.add(100.0 + slope_m_s * 10.0)
    assert second == (pytest.approx(100.0 + slope_m_s * 5.0), pytest.approx(slope_m_s / 2.0))
    for k in range(2, 400):
        d_m, rate_m_s = smoother.add(100.0 + slope_m_s * 10.0 * k)
    steps_behind = 3.0 if kind == RECURSION else 1.5
    assert d_m == pytest.approx(100.0 + slope_m_s * 10.0 * (399 - steps_behind), abs=0.01)
    assert rate_m_s == pytest.approx(slope_m_s, abs=1e-6)


def test_the_two_windows_are_of_their_own_lengths_and_recursion_is_the_usual_kind() -> None:
    windowed = DriftSmoother(10.0, 24.0, 36.0, WINDOW)  # 2 and 4 of them
    values = [0.0, 10.0, 10.0, 40.0, 10.0, 90.0, 10.0]
    smooth = [values[0], *((a + b) / 2.0 for a, b in zip(values, values[1:], strict=False))]
    rates = np.diff(smooth) / 10.0
    got = [windowed.add(one) for one in values]
    assert [d for d, _ in got] == pytest.approx(smooth)
    assert [rate for _, rate in got] == pytest.approx(
        [0.0, *(np.mean(rates[max(0, k - 3) : k + 1]) for k in range(6))], abs=SAME
    )
    usual, named = DriftSmoother(10.0, 20.0, 40.0), DriftSmoother(10.0, 20.0, 40.0, RECURSION)
    assert [usual.add(one) for one in values] == [named.add(one) for one in values]
    assert usual.add(0.0) != windowed.add(0.0)


@pytest.mark.parametrize("kind", [RECURSION, WINDOW])
def test_a_restart_forgets_everything(kind: str) -> None:
    used, fresh = DriftSmoother(10.0, 40.0, 80.0, kind), DriftSmoother(10.0, 40.0, 80.0, kind)
    for k in range(20):
        used.add(7.0 * k)
    used.restart()
    for value in (500.0, 490.0, 485.0, 470.0, 465.0, 460.0, 400.0):
        assert used.add(value) == fresh.add(value)


# Mean elements


def mean(a_m: float = 7.15e6, e: float = 1.1e-3, argp: float = 1.5, i: float = 1.7, raan: float = 0.3) -> MeanElements:
    alpha = np.linspace(-3.0, 9.0, 40)
    one = np.ones(40)
    return MeanElements(a_m * one, e * np.cos(argp) * one, e * np.sin(argp) * one, i * one, raan * one, alpha)


@pytest.mark.parametrize(
    "put",
    [
        mean(raan=0.0),
        mean(raan=1e-5),
        mean(raan=2.0 * np.pi - 1e-5),
        mean(raan=-2.0),
        mean(argp=-1.5),
        mean(argp=3.1, e=0.02),
        mean(i=0.4),
        mean(i=2.6, e=0.02),
        mean(e=0.0),
        mean(a_m=4.2e7, i=0.1, e=3e-4),
    ],
)
def test_mean_elements_of_any_plane_come_back_from_their_states(put: MeanElements) -> None:
    got = mean_of(*states_of(put))
    assert got.a_m == pytest.approx(put.a_m, abs=0.05)
    assert got.ex == pytest.approx(put.ex, abs=1e-7)
    assert got.ey == pytest.approx(put.ey, abs=1e-7)
    assert got.i_rad == pytest.approx(put.i_rad, abs=1e-8)
    for angle, of in ((got.raan_rad, put.raan_rad), (got.alpha_rad, put.alpha_rad)):
        assert np.max(np.abs(np.exp(1j * angle) - np.exp(1j * of))) < 1e-7


def test_the_osculating_numbers_are_those_of_the_ellipse() -> None:
    one = np.ones(1)
    ellipse = OsculatingElements(7.2e6 * one, 0.02 * one, 1.2 * one, 5.0 * one, 2.0 * one, 0.7 * one)
    got = osculating_of(*state_from_elements(ellipse))
    numbers = [7.2e6, 0.02 * np.cos(2.0), 0.02 * np.sin(2.0), 1.2, 5.0, 2.7]
    assert [float(part[0]) for part in got] == pytest.approx(numbers, rel=1e-9)


def test_the_oblateness_moves_the_osculating_axis_by_kilometres_about_the_mean_one() -> None:
    put = mean(argp=0.5)
    osculating = osculating_of(*states_of(put))
    assert np.ptp(osculating.a_m) > 10e3
    assert np.ptp(mean_of(*states_of(put)).a_m) < 0.1


# Storms


def flux(days: int = 200, kp: float = 2.0) -> Flux:
    return Flux(5.0e8, np.arange(70.0, 70.0 + days), np.full(days, kp))


def test_a_storm_is_a_day_of_high_kp_and_a_day_half_way_back() -> None:
    calm = flux()
    stormy = with_storms(calm, 5, 3)
    assert (stormy.start_tai_s, stormy.f107.tolist()) == (calm.start_tai_s, calm.f107.tolist())
    assert calm.kp.tolist() == [2.0] * 200
    days = np.flatnonzero(stormy.kp > 5.5)
    assert len(days) == 5
    for day in days.tolist():
        assert LOWEST_KP <= stormy.kp[day] <= HIGHEST_KP
        assert stormy.kp[day + 1] == pytest.approx((stormy.kp[day] + 2.0) / 2.0)
    quiet = np.setdiff1d(np.arange(200), [*days, *(days + 1)])
    assert stormy.kp[quiet].tolist() == [2.0] * quiet.size


def test_peaks_are_spread_between_six_and_nine() -> None:
    peaks = np.concatenate([np.sort(with_storms(flux(900), 20, seed).kp)[-20:] for seed in range(20)])
    assert (LOWEST_KP, HIGHEST_KP) == (6.0, 9.0)
    assert peaks.min() < 6.1
    assert 8.9 < peaks.max() <= 9.0


def test_the_same_seed_gives_the_same_days_another_one_or_another_count_others() -> None:
    days = [
        np.flatnonzero(with_storms(flux(), count, seed).kp > 5.5).tolist()
        for count, seed in ((5, 3), (5, 3), (5, 4), (6, 3))
    ]
    assert days[0] == days[1]
    assert days[0] != days[2]
    assert not set(days[0]) <= set(days[3])


def test_no_storm_leaves_the_profile_and_more_than_there_are_days_take_all_but_the_last() -> None:
    assert with_storms(flux(), 0, 1).kp.tolist() == flux().kp.tolist()
    full = with_storms(flux(10), 50, 1).kp
    assert np.all(full[:-1] >= 6.0)
    assert 4.0 <= full[-1] < 6.0
    assert np.sum(with_storms(flux(10), 9, 1).kp >= 6.0) == 9


def test_a_day_that_was_worse_stays_so() -> None:
    assert with_storms(flux(10, 9.0), 50, 1).kp.tolist() == [9.0] * 10
