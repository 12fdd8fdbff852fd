"""The loop of Galski and Orlando 2011: averages, navigators, controllers, and weeks of the whole."""

from dataclasses import replace

import numpy as np
import pytest
from groundtrack_world import CRAFT, NODE_RAD, world
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.errors import UsageError
from acu_daemon.groundtrack.control_loop import BLOCK_STEPS, fly
from acu_daemon.groundtrack.environment import STEP_S, even_steps, free_motion
from acu_daemon.groundtrack.gps import FIX_S, FIXES, NO_STEERING, GpsReceiver, Ripple, TrueOrbit
from acu_daemon.groundtrack.navigator import Navigator, NavigatorSetup, drift_of
from acu_daemon.groundtrack.our_controller import (
    DECIDING_SIGMAS,
    NOISE_M,
    OBSERVATIONS,
    DriftFilter,
    Forecast,
    OurController,
    OurSettings,
)
from acu_daemon.groundtrack.paper_controller import PaperController, PaperSettings
from acu_daemon.groundtrack.paper_navigator import PaperNavigator
from acu_daemon.groundtrack.simulate import Case, bound_count, drag_less_lunisolar_m, simulate
from acu_daemon.groundtrack.smoothing import WINDOW, DriftSmoother, RecursiveAverage, WindowAverage
from acu_daemon.groundtrack.storms import with_storms
from acu_daemon.units import DAY_S

RAW_RMS_M = 202.0  # of the fixes in three dimensions, Galski and Orlando 2011 as read in docs/groundtrack.md
NAVIGATOR_D_M = 10.0
NO_RIPPLE = Ripple(90.0, np.zeros((4, 3)))
PERFECT = Case("moderate", 3900.0, navigator="perfect", days=60.0)


@given(st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=60), st.integers(1, 20))
def test_the_window_is_the_mean_of_its_last_values(values: list[float], count: int) -> None:
    average = WindowAverage(count)
    means = [average.add(value) for value in values]
    expected = [np.mean(values[max(0, k + 1 - count) : k + 1]) for k in range(len(values))]
    assert means == pytest.approx(expected, abs=1e-8)


def test_the_stored_sums_make_an_exponential_with_the_delay_of_the_whole_window() -> None:
    count = 50
    ramp = np.arange(2000.0)
    recursive, window = RecursiveAverage(count), WindowAverage(count)
    late = [ramp[-1] - [one.add(value) for value in ramp][-1] for one in (recursive, window)]
    assert late[0] == pytest.approx(count - 1.0, abs=1e-6)
    assert late[1] == pytest.approx((count - 1.0) / 2.0)


def test_a_straight_drift_is_seen_with_its_slope() -> None:
    smoother = DriftSmoother(STEP_S, 10.0 * STEP_S, 20.0 * STEP_S, WINDOW)
    rate = [smoother.add(0.01 * STEP_S * k)[1] for k in range(200)][-1]
    assert rate == pytest.approx(0.01)
    smoother.restart()
    assert smoother.add(5.0) == (5.0, 0.0)


def test_fixes_have_the_errors_of_the_paper() -> None:
    times_s = even_steps(0.0, FIX_S, 40_000)
    receiver = GpsReceiver(5.0, np.random.default_rng(2))
    errors = receiver.errors_m(times_s)
    assert np.sqrt(np.mean(np.sum(errors**2, axis=1))) == pytest.approx(RAW_RMS_M, rel=0.05)
    assert np.std(receiver.velocity_errors_m_s(times_s)) == pytest.approx(1.0, rel=0.02)
    slow = errors[: 40_000 - 40_000 % 6].reshape(-1, 6, 3).mean(axis=1)  # a minute: what is left is systematic
    assert np.std(slow) == pytest.approx(np.hypot(60.0, 100.0 / np.sqrt(6.0)), rel=0.1)


def _errors(navigator: Navigator | PaperNavigator, days: float) -> tuple[float, float]:
    """Rms error of D after half a day, m, and the largest."""
    free = free_motion(CRAFT, days, world().flux)
    orbit, receiver = TrueOrbit(free, NODE_RAD), GpsReceiver(days, np.random.default_rng(5))
    times_s = even_steps(FIX_S, FIX_S, int(days * DAY_S / FIX_S))
    r_m, _ = orbit.states(times_s, NO_STEERING)
    fixes_m = r_m + receiver.errors_m(times_s)
    block = BLOCK_STEPS * FIXES
    starts = range(0, len(fixes_m), block)
    estimates = [navigator.observe(float(times_s[k]) - FIX_S, fixes_m[k : k + block]) for k in starts]
    seen = drift_of(CRAFT.reference, np.vstack(estimates))
    left = (seen - orbit.drift_m(times_s[19::20], NO_STEERING))[seen.size // 2 :]
    return float(np.sqrt(np.mean(left**2))), float(np.max(np.abs(left)))


def test_our_navigator_sees_d_to_metres_where_its_model_is_right() -> None:
    rms, _ = _errors(Navigator(NavigatorSetup(CRAFT.reference, NODE_RAD, NO_RIPPLE)), 8.0)
    assert rms < NAVIGATOR_D_M


def test_the_papers_navigator_is_better_than_raw_fixes_by_far() -> None:
    raw_d_m = 600.0  # of D from positions and velocities as they come, velocity noise 1 m/s
    rms, _ = _errors(PaperNavigator(NavigatorSetup(CRAFT.reference, NODE_RAD)), 0.6)
    assert rms < raw_d_m / 4.0


def test_a_navigator_taken_back_within_a_block_goes_on_as_if_it_had_ended_there() -> None:
    free = free_motion(CRAFT, 1.0, world().flux)
    times_s = even_steps(FIX_S, FIX_S, 20 * 60)
    r_m, _ = TrueOrbit(free, NODE_RAD).states(times_s, NO_STEERING)
    for kind in (Navigator, PaperNavigator):
        whole, part = (kind(NavigatorSetup(CRAFT.reference, NODE_RAD)) for _ in range(2))
        whole.observe(0.0, r_m[: 20 * 30])
        whole.rewind(10)
        part.observe(0.0, r_m[: 20 * 10])
        again = [one.observe(10 * STEP_S, r_m[20 * 10 : 20 * 20]) for one in (whole, part)]
        assert np.allclose(*again, rtol=0.0, atol=1e-9)


def test_the_filter_learns_the_drag_and_keeps_it_through_a_manoeuvre() -> None:
    step_s, true_share = 3600.0, 0.2
    count = 24 * 40
    drag, sky = np.full(count, 50.0 / DAY_S**2), np.full(count, -1.0 / DAY_S**2)
    forecast = Forecast(step_s, drag, sky)
    seen = DriftFilter(forecast)
    times_s = even_steps(0.0, step_s, count)
    d_m = 0.5 * ((1.0 + true_share) * drag[0] + sky[0]) * times_s**2
    half, push_m_s = count // 2, -0.01
    d_m[half:] += push_m_s * (times_s[half:] - times_s[half])
    for k in range(1, count - 1):
        seen.advance(k - 1, k)
        seen.update(float(d_m[k]), 15.0)
        if k == half:
            seen.push(push_m_s, 1e-5)
    assert seen.state[2] == pytest.approx(true_share, abs=0.05)
    assert seen.state[0] == pytest.approx(d_m[-2], abs=15.0)


def test_a_manoeuvre_moves_the_drift_and_makes_it_as_unsure_as_the_manoeuvre_is() -> None:
    seen = DriftFilter(Forecast(3600.0, np.zeros(9), np.zeros(9)))
    before = seen.covariance.copy()
    seen.push(-0.25, 0.002)
    assert seen.state.tolist() == [0.0, -0.25, 0.0]
    before[1, 1] += 0.002**2
    assert seen.covariance == pytest.approx(before, rel=1e-12)


def test_the_papers_controller_waits_for_its_windows_and_aims_at_the_lower_limit() -> None:
    acceleration = 40.0 / DAY_S**2
    settings = PaperSettings(100.0, -100.0, 8.0 * 3600.0, 20.0 * 3600.0)
    assert settings.guard_s == 28.0 * 3600.0
    controller = PaperController(settings, CRAFT.reference, STEP_S, np.full(5000, acceleration))
    sizes = [(k, controller.observe(k, 150.0)) for k in range(1, 1000)]
    first = next(k for k, size in sizes if size > 0.0)
    assert first * STEP_S == pytest.approx(settings.guard_s, abs=STEP_S)
    size_m = dict(sizes)[first]
    change_m_s = -CRAFT.reference.by_a.drift * size_m
    lowest_m = 150.0 - change_m_s**2 / (2.0 * acceleration)
    assert lowest_m == pytest.approx(-100.0, abs=5.0)  # eq 13 is 0.5 % too large
    assert sum(size > 0.0 for _, size in sizes[first : first + 500]) == 0


@pytest.mark.parametrize("drift_m_hour", [5.0, 20.0, 60.0])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_manoeuvre_is_made_before_the_upper_limit_and_not_hours_before(drift_m_hour: float, share: float) -> None:
    """However fast D drifts, and wherever between two decisions it comes to the limit."""
    per_step_m, count = drift_m_hour / OBSERVATIONS, 4000
    drag = np.full(count, 40.0 / DAY_S**2)
    controller = OurController(OurSettings(300.0, -300.0), CRAFT.reference, Forecast(STEP_S, drag, np.zeros(count)))
    first_m = 300.0 - (60.0 + share) * drift_m_hour
    pushed_at_m = None
    for k in range(1, 80 * OBSERVATIONS):
        d_m = first_m + per_step_m * k + 0.5 * drag[0] * (k * STEP_S) ** 2
        if controller.observe(k, d_m) > 0.0:
            pushed_at_m = d_m
            break
    assert pushed_at_m is not None
    hour_m = drift_m_hour + drag[0] * k * STEP_S * OBSERVATIONS * STEP_S
    sigma_m = DECIDING_SIGMAS * NOISE_M
    assert 300.0 - sigma_m - 2.0 * hour_m < pushed_at_m < 300.0


def test_a_steered_orbit_follows_the_parabola_of_the_bound() -> None:
    free = free_motion(CRAFT, 200.0, None)
    steady = replace(free, drag_m_s2=np.full(free.a_m.size, 50.0 / DAY_S**2), lunisolar_m_s2=np.zeros(free.a_m.size))
    period_days = np.sqrt(16.0 * 3900.0 / 50.0)
    assert bound_count(steady, 3900.0) == pytest.approx(200.0 / period_days, rel=1e-3)


def test_two_months_stay_in_the_band_with_few_manoeuvres_and_repeat_bit_for_bit() -> None:
    outcome = simulate(world(), PERFECT)
    again = simulate(world(), PERFECT)
    assert np.array_equal(outcome.flown.d_m, again.flown.d_m)
    assert outcome.flown.manoeuvres == again.flown.manoeuvres
    assert outcome.flown.d_m.min() > -3900.0
    assert outcome.flown.d_m.max() < 4000.0
    assert 1 <= len(outcome.flown.manoeuvres) <= 3
    assert simulate(world(), replace(PERFECT, seed=1)).flown.manoeuvres != outcome.flown.manoeuvres


def test_the_sum_of_the_manoeuvres_is_what_drag_took_less_what_sun_and_moon_saved() -> None:
    outcome = simulate(world(), replace(PERFECT, band_m=100.0, days=120.0))
    sizes = outcome.flown.sizes_m
    assert sizes.sum() == pytest.approx(drag_less_lunisolar_m(outcome.free), abs=sizes.max())
    assert outcome.flown.d_m.min() > -130.0
    assert outcome.flown.d_m.max() < 130.0


@pytest.mark.long
def test_the_whole_loop_holds_a_tight_band_for_weeks() -> None:
    case = Case("moderate", 100.0, days=24.0, seed=3)
    outcome = simulate(world(), case)
    late = outcome.flown.times_s > 10.0 * DAY_S
    assert np.max(np.abs(outcome.flown.d_m[late])) < 130.0
    assert np.std((outcome.flown.seen_m - outcome.flown.d_m)[late]) < 3.0 * NAVIGATOR_D_M
    assert 3 <= len(outcome.flown.manoeuvres) <= 8


@pytest.mark.long
def test_the_papers_controller_leaves_the_band_where_ours_holds_it() -> None:
    case = Case("critical", 100.0, navigator="perfect", days=200.0, execution_sigma=0.0)
    ours, paper = (simulate(world("critical"), replace(case, controller=one)).flown for one in ("ours", "paper"))
    assert np.max(np.abs(ours.d_m)) < 130.0
    assert np.max(np.abs(paper.d_m)) > 180.0
    assert len(ours.manoeuvres) < len(paper.manoeuvres)


def test_air_that_departs_from_its_model_and_storms_are_held_too() -> None:
    stormy = replace(world(), flux=with_storms(world().flux, 20, 4))
    assert np.count_nonzero(stormy.flux.kp > 5.9) >= 15
    outcome = simulate(stormy, replace(PERFECT, days=120.0, density_sigma=0.1))
    assert outcome.flown.d_m.min() > -4000.0
    assert outcome.flown.d_m.max() < 4000.0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"controller": "theirs"}, "--controller theirs: expected one of ours, paper"),
        ({"navigator": "stars"}, "--navigator stars"),
        ({"band_m": 1.0}, "--band-m 1: expected half the band's width"),
        ({"days": 4000.0}, "--days 4000: expected 1 to"),
        ({"smoothing": "none"}, "--smoothing none"),
    ],
)
def test_a_case_that_cannot_be_run_is_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        simulate(world(), replace(PERFECT, **change))  # type: ignore[arg-type]


def test_the_loop_runs_without_a_manoeuvre() -> None:
    class Idle:
        def observe(self, step: int, d_m: float) -> float:
            return 0.0

    free = free_motion(CRAFT, 2.0, None)
    flown = fly(TrueOrbit(free, NODE_RAD), None, Idle(), 2.0, np.random.default_rng(0))
    assert flown.manoeuvres == ()
    assert np.array_equal(flown.seen_m[1:], flown.d_m[1:])
