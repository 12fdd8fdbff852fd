"""schedule.wind: stow above the limits, hysteresis, stale wind."""

from dataclasses import replace
from itertools import product
from math import inf
from pathlib import Path

import pytest

from acu_daemon.cli.station_wind import StationWind
from acu_daemon.config.station_day_tables import WindSection
from acu_daemon.control.tick_input import StowBy
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


NOW = 10_000.0
HEARD = {  # mean and gust of a sample of now; None: the newest is that of an hour ago
    "strong": (RULES.mean_limit_m_s + 1.0, 1.0),
    "between": (RULES.mean_limit_m_s - 0.1, 1.0),
    "calm": (1.0, 1.0),
    "nothing": None,
}


@pytest.mark.parametrize("when_stale", ["go_on", "stow"])
@pytest.mark.parametrize("heard", HEARD)
def test_from_every_state_the_watch_goes_where_its_drawing_says_and_keeps_nothing_of_before(
    heard: str, when_stale: str
) -> None:
    sample = None if HEARD[heard] is None else WindSample(*HEARD[heard], NOW)
    old, rules = WindSample(1.0, 1.0, NOW - 3600.0), replace(RULES, when_stale=when_stale)
    for wind, wants_stow, calm_s, is_let_go in product(Wind, (False, True), (inf, 599.0, 600.0), (False, True)):
        since_s = NOW - calm_s if calm_s < inf else inf
        after = watch(WindWatch(wind, wants_stow, since_s, old, is_let_go), sample, rules, NOW)
        is_over = calm_s == 600.0 or not wants_stow
        expected = {
            "strong": (Wind.STRONG, True, inf),
            "between": (Wind.STRONG if wants_stow else Wind.CALM, wants_stow, inf),
            "calm": (Wind.CALM, False, inf) if is_over else (Wind.STRONG, True, min(since_s, NOW)),
            "nothing": (Wind.STALE, not is_let_go and (wants_stow or when_stale == "stow"), inf),
        }[heard]
        assert (after.wind, after.wants_stow, after.calm_since_tai_s) == expected
        assert after.is_let_go is (is_let_go and heard == "nothing")
        assert after.newest == (sample or old)
        assert ("calm since" in after.words, ", stow" in after.words) == (expected[2] < inf, expected[1])


@pytest.mark.parametrize(("later_s", "mean_m_s"), [(-1e-3, 1.0), (0.0, 2.0), (1e-3, 2.0)])
def test_of_two_winds_the_one_that_is_not_older_counts(later_s: float, mean_m_s: float) -> None:
    after = watch(WindWatch(newest=WindSample(1.0, 1.0, NOW)), WindSample(2.0, 2.0, NOW + later_s), RULES, NOW)
    assert after.newest is not None
    assert after.newest.mean_m_s == mean_m_s


def test_a_wind_that_is_not_watched_says_nothing() -> None:
    assert WindWatch(newest=WindSample(1.0, 2.0, NOW)).words == ""
    assert WindWatch(Wind.STALE).words == "wind stale"
    assert WindWatch(Wind.CALM, newest=WindSample(8.26, 12.94, NOW)).words == "wind calm, mean 8.3 m/s, gusts 12.9 m/s"


@pytest.mark.parametrize("wind", sorted(Wind))
@pytest.mark.parametrize("stow_by", sorted(StowBy))
@pytest.mark.parametrize("wants_stow", [False, True])
async def test_a_person_may_end_every_stow_but_that_of_a_wind_that_is_known_to_be_strong(
    tmp_path: Path, wind: Wind, stow_by: StowBy, wants_stow: bool
) -> None:
    async def beside(*_: object) -> object:
        raise AssertionError("nothing is read here")

    watched = StationWind(WindSection(), tmp_path, beside)
    watched.seen = WindWatch(wind, wants_stow=wants_stow)
    is_refused = wind is Wind.STRONG and stow_by is StowBy.WIND and wants_stow
    assert bool(watched.why_not_unstow(stow_by)) == is_refused
