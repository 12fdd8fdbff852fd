"""schedule.wind: stow above the limits, hysteresis, stale wind."""

import pytest

from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.wind import Wind, WindRules, WindSample, WindWatch, watch

RULES = WindRules()


def blow(minutes: list[tuple[float, float] | None], rules: WindRules = RULES) -> list[WindWatch]:
    """A sample each minute, (mean, gust), or none; the state after each."""
    states = [WindWatch()]
    for at, speeds in enumerate(minutes, 1):
        sample = None if speeds is None else WindSample(*speeds, 60.0 * at)
        states.append(watch(states[-1], sample, rules, 60.0 * at))
    return states[1:]


@pytest.mark.parametrize(("speeds", "wants_stow"), [((11.1, 16.9), False), ((11.2, 5.0), True), ((3.0, 17.0), True)])
def test_above_either_limit_the_antenna_is_to_be_stowed(speeds, wants_stow):
    [state] = blow([speeds])
    assert state.wants_stow is wants_stow
    assert state.wind is (Wind.STRONG if wants_stow else Wind.CALM)


@pytest.mark.parametrize("when_stale", ["go_on", "stow"])
@pytest.mark.parametrize("is_strong", [False, True])
def test_a_stale_wind_that_is_let_go_stays_so_until_it_is_heard_again(when_stale, is_strong):
    rules, speeds = WindRules(when_stale=when_stale), (20.0, 25.0) if is_strong else (2.0, 3.0)
    stale = blow([speeds, None, None], rules)[-1]
    assert stale.wants_stow is (is_strong or when_stale == "stow")
    state = WindWatch(wind=stale.wind, newest=stale.newest, is_let_go=True)
    for minute in range(4, 9):
        state = watch(state, None, rules, 60.0 * minute)
        assert (state.wind, state.wants_stow) == (Wind.STALE, False)
    for minute, heard in ((9, WindSample(20.0, 25.0, 540.0)), (12, None)):
        state = watch(state, heard, rules, 60.0 * minute)
        assert state.wants_stow


def test_it_may_move_again_after_ten_minutes_well_below_both_limits_and_not_before():
    states = blow([(12.0, 12.0), *[(8.8, 13.5)] * 11])
    assert [one.wants_stow for one in states] == [True] * 11 + [False]
    assert states[-1].wind is Wind.CALM
    assert states[5].words == f"wind strong, mean 8.8 m/s, gusts 13.5 m/s, stow, calm since {utc_text(120.0, 0)[11:19]}"


@pytest.mark.parametrize("between", [(9.0, 10.0), (5.0, 14.0), (12.0, 1.0), None])
def test_wind_between_the_limits_or_unheard_begins_the_ten_minutes_anew(between):
    quiet = (5.0, 8.0)
    states = blow([(12.0, 12.0), *[quiet] * 9, between, between, *[quiet] * 11])
    assert [one.wants_stow for one in states] == [True] * 22 + [False]


def test_wind_that_was_never_watched_strong_stays_calm_between_the_limits():
    assert not any(one.wants_stow for one in blow([(9.0, 14.0)] * 30))


def test_stale_wind_is_a_state_of_its_own_and_a_strong_one_stays_strong():
    calm, strong = blow([(5.0, 5.0), None, None]), blow([(15.0, 15.0), None, None, None])
    assert [one.wind for one in calm] == [Wind.CALM, Wind.CALM, Wind.STALE]
    assert not calm[-1].wants_stow
    assert (strong[-1].wind, strong[-1].wants_stow) == (Wind.STALE, True)
    [never] = blow([None], WindRules(when_stale="stow"))
    assert (never.wind, never.wants_stow) == (Wind.STALE, True)


@pytest.mark.parametrize("speeds", [(float("nan"), 5.0), (5.0, float("inf")), (-1.0, 5.0), (5.0, 500.0)])
def test_what_is_no_wind_is_not_heard(speeds):
    states = blow([(5.0, 5.0), speeds, speeds])
    assert states[1].newest == states[0].newest
    assert states[-1].wind is Wind.STALE


def test_an_older_sample_does_not_replace_a_newer_one():
    state = watch(WindWatch(), WindSample(12.0, 12.0, 100.0), RULES, 100.0)
    assert watch(state, WindSample(1.0, 1.0, 40.0), RULES, 101.0).newest == state.newest
