"""schedule: the exact plan against brute force, and the words for what is not granted."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from acu_daemon.model import AxisLimits, Pass
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.decisions import decide
from acu_daemon.schedule.exact_plan import AntennaPlace, Slot, best_slots, slots_of
from acu_daemon.schedule.pass_track import PassTrack
from acu_daemon.schedule.rules import PassRequest, SatelliteRules, StationRules, Window, Wish

AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 6.0, 3.0), AxisLimits(0.0, 90.0, 3.0, 2.0)
RULES = StationRules(AZIMUTH, ELEVATION)
DAY = 8.5e8


def track(
    name: str,
    rise_s: float,
    duration_s: float = 600.0,
    az_deg: tuple[float, float] = (10.0, 170.0),
    top_deg: float = 40.0,
    **rules: float,
) -> PassTrack:
    """A pass from rise_s after DAY on, its azimuth turning evenly."""
    tai_s = DAY + rise_s + np.linspace(0.0, duration_s, round(duration_s / 2) + 1)
    x = np.linspace(-1.0, 1.0, tai_s.size)
    el_deg = 5.0 + (top_deg - 5.0) * (1.0 - x * x)
    middle = float(tai_s[tai_s.size // 2])
    coming = Pass(float(tai_s[0]), middle, float(tai_s[-1]), az_deg[0], top_deg, sum(az_deg) / 2, az_deg[1])
    path_deg = np.linspace(*az_deg, tai_s.size)
    said = SatelliteRules(**rules)  # type: ignore[arg-type]
    return PassTrack(name, coming, said, tai_s, path_deg, el_deg, np.ones(tai_s.size, dtype=np.bool_))


def random_tracks(random: np.random.Generator, count: int) -> list[PassTrack]:
    return [
        track(
            f"S{at}",
            float(random.uniform(0.0, 2500.0)),
            float(random.uniform(200.0, 800.0)),
            (float(random.uniform(-180.0, 180.0)), float(random.uniform(-180.0, 180.0))),
            priority=int(random.integers(0, 10)),
            may_be_cut=bool(random.integers(2)),
            min_useful_s=float(random.choice([60.0, 150.0])),
        )
        for at in range(count)
    ]


def is_chain(slots: list[Slot]) -> bool:
    """Whether the antenna gets from each slot to the next one in time."""
    for one, other in zip(slots, slots[1:], strict=False):
        slew_s = RULES.slew_s(other.start_deg[0] - one.end_deg[0], other.start_deg[1] - one.end_deg[1])
        if one.end_tai_s + RULES.post_s + slew_s + RULES.pre_s > other.start_tai_s:
            return False
    return True


def brute_force(tracks: list[PassTrack]) -> float:
    """The largest value over all sets of slots."""
    slots = sorted((one for of in tracks for one in slots_of(of, tracks, RULES)), key=lambda one: one.end_tai_s)
    best, layer = 0.0, [[one] for one in slots]
    while layer:
        best = max(best, *(sum(one.value for one in chain) for chain in layer))
        layer = [
            [*chain, one]
            for chain in layer
            for one in slots
            if one.end_tai_s > chain[-1].end_tai_s and is_chain([chain[-1], one])
        ]
    return best


@pytest.mark.parametrize("seed", range(8))
def test_no_set_of_slots_is_worth_more_than_the_plan(seed):
    tracks = random_tracks(np.random.default_rng(seed), 4)
    plan = best_slots(tracks, RULES)
    assert is_chain(plan)
    assert sum(one.value for one in plan) == pytest.approx(brute_force(tracks), abs=1e-3)


def test_of_whole_passes_no_subset_is_worth_more():
    for seed in range(20):
        tracks = [
            replace(one, rules=replace(one.rules, may_be_cut=False))
            for one in random_tracks(np.random.default_rng(100 + seed), 7)
        ]
        plan = best_slots(tracks, RULES)
        slots = [one for of in tracks for one in slots_of(of, (), RULES)]
        best = max(
            sum(one.value for one in chosen)
            for count in range(1, 5)
            for chosen in map(list, combinations(sorted(slots, key=lambda one: one.end_tai_s), count))
            if is_chain(chosen)
        )
        assert is_chain(plan)
        assert sum(one.value for one in plan) == pytest.approx(best, abs=1e-3)


def test_two_passes_of_less_priority_may_be_worth_more_than_one():
    tracks = [track("LONG", 500.0, 700.0, priority=5), track("A", 0.0, priority=4), track("B", 1000.0, priority=4)]
    assert [one.track.satellite for one in best_slots(tracks, RULES)] == ["A", "B"]


def test_a_slow_drive_needs_a_longer_gap_and_a_lost_pass_says_how_long():
    slow = replace(RULES, azimuth=AxisLimits(-270.0, 270.0, 1.0, 1.0))
    tracks = [track("A", 0.0, priority=6), track("B", 720.0, az_deg=(10.0, 170.0))]
    assert len(best_slots(tracks, RULES)) == 2
    [granted, refused] = decide(tracks, slow)
    assert granted.slot is not None
    assert refused.slot is None
    way_s = 160.0 / 0.98 + 1.0  # at the slow drive's rate and acceleration, about
    assert "lost to A of" in refused.reason
    assert "the gap is 120 s" in refused.reason
    need_s = float(refused.reason.split("need ")[1].split(" s")[0])
    assert need_s == pytest.approx(70.0 + way_s, rel=0.1)


def test_the_cable_is_unwound_in_the_gap_or_the_pass_is_not_granted():
    """The first pass ends at 260 deg of +-270; the next one goes on clockwise, so it needs the other turn."""
    tracks = [track("A", 0.0, az_deg=(-80.0, 260.0), priority=6), track("B", 720.0, az_deg=(265.0, 400.0))]
    assert [one.track.satellite for one in best_slots(tracks, RULES)] == ["A"]
    later = [tracks[0], track("B", 800.0, az_deg=(265.0, 400.0))]
    plan = best_slots(later, RULES)
    assert [one.track.satellite for one in plan] == ["A", "B"]
    assert plan[1].start_deg[0] == pytest.approx(-95.0)


def test_a_pass_that_may_be_cut_has_what_its_neighbour_leaves():
    tracks = [track("A", 0.0, priority=9), track("B", 400.0, 700.0, may_be_cut=True)]
    [first, second] = best_slots(tracks, RULES)
    assert not first.is_cut
    assert second.is_cut
    assert second.start_tai_s >= first.end_tai_s + RULES.pre_s + RULES.post_s
    assert second.end_tai_s == tracks[1].end_tai_s


def test_a_forced_pass_is_granted_before_a_better_one_and_a_frozen_one_before_that():
    tracks = [track("A", 0.0, priority=9), track("B", 300.0, priority=1), track("C", 900.0, priority=1)]
    rules = replace(RULES, requests=(PassRequest("B", DAY + 600.0, Wish.FORCE),))
    assert [one.track.satellite for one in decide(tracks, rules) if one.slot] == ["B", "C"] or [
        one.track.satellite for one in decide(tracks, rules) if one.slot
    ] == ["B"]
    frozen = best_slots([tracks[0]], rules)
    granted = [one.track.satellite for one in decide(tracks, rules, frozen=frozen) if one.slot]
    assert granted == ["A", "C"]


@pytest.mark.parametrize("wish", [Wish.FORCE, Wish.GO_ON])
def test_a_forced_pass_that_may_be_cut_stays_whole_though_each_of_its_parts_is_forced(wish: Wish):
    tracks = [track("A", 0.0, may_be_cut=True, min_useful_s=60.0), track("B", 2000.0, priority=9)]
    [granted, _] = decide(tracks, replace(RULES, requests=(PassRequest("A", DAY + 300.0, wish),)))
    assert granted.slot is not None
    assert (granted.track.satellite, granted.slot.is_cut) == ("A", False)


def test_each_pass_that_is_not_granted_says_why():
    window = Window(DAY + 5000.0, DAY + 5600.0, "greasing")
    rules = replace(RULES, windows=(window,), requests=(PassRequest("OUT", DAY + 9000.0, Wish.EXCLUDE),))
    tracks = [
        track("LOW", 0.0, top_deg=12.0, min_culmination_deg=20.0),
        track("SHORT", 3000.0, 100.0, min_useful_s=120.0),
        track("SERVICE", 5200.0),
        track("OUT", 8800.0),
        track("WINS", 11000.0, priority=7),
        track("LOSES", 11100.0),
    ]
    said = {one.track.satellite: one.reason for one in decide(tracks, rules)}
    assert said["LOW"] == "culminates at 12.0 deg, min_culmination_deg is 20"
    assert said["SHORT"] == "useful for 100 s only, min_useful_s is 120"
    assert said["SERVICE"].startswith("greasing ")
    assert said["OUT"] == "excluded by a person"
    assert said["WINS"] == ""
    assert said["LOSES"].startswith("lost to WINS of ")
    assert said["LOSES"].endswith("(priority 7): both are up for 500 s")


def test_a_window_leaves_the_rest_of_a_pass_that_may_be_cut():
    rules = replace(RULES, windows=(Window(DAY + 300.0, DAY + 400.0, "greasing"),))
    before, after = best_slots([track("A", 0.0, may_be_cut=True)], rules)
    assert before.end_tai_s == DAY + 290.0
    assert after.start_tai_s == DAY + 460.0
    assert best_slots([track("A", 0.0)], rules) == []


def test_a_pass_that_has_begun_is_joined_as_soon_as_the_antenna_is_there_or_not_at_all():
    begun = track("A", 30.0, az_deg=(-200.0, -60.0))
    [decision] = decide([begun], RULES, place=AntennaPlace(DAY + 100.0, 200.0, 5.0))
    assert decision.slot is not None
    assert decision.slot.start_tai_s == pytest.approx(DAY + 100.0 + RULES.slew_s(40.0, 0.0))  # on the turn at 160 deg
    [decision] = decide([begun], RULES, place=AntennaPlace(DAY + 560.0, 200.0, 5.0))
    assert decision.slot is None
    assert decision.reason == "it is too late to be there for its rise"


def test_priority_nought_fills_a_gap_and_takes_nothing_from_others():
    tracks = [
        track("FILLER", 0.0, priority=0),
        track("SMALL", 500.0, 200.0, priority=1),
        track("LATE", 2000.0, priority=0),
    ]
    assert [one.track.satellite for one in best_slots(tracks, RULES)] == ["SMALL", "LATE"]


@pytest.mark.parametrize("first", list(Wish))
@pytest.mark.parametrize("last", list(Wish))
def test_of_two_words_about_a_pass_the_newer_one_counts(first: Wish, last: Wish) -> None:
    tracks = [track("A", 0.0, priority=9), track("B", 300.0, priority=1), track("C", 5000.0)]
    for name, at_s in (("A", 300.0), ("B", 600.0), ("C", 5300.0)):
        words = [PassRequest(name, DAY + at_s, wish) for wish in (first, last)]
        both, alone = (decide(tracks, replace(RULES, requests=tuple(said))) for said in (words, words[1:]))
        assert [(one.track.satellite, one.slot, one.reason) for one in both] == [
            (one.track.satellite, one.slot, one.reason) for one in alone
        ]


def test_a_pass_is_lost_to_the_one_that_has_most_of_its_time_and_the_words_say_how_much():
    others = [track("B", 500.0, 700.0, priority=9), track("C", 1400.0, 500.0, priority=9)]
    found = decide([*others, track("A", 1000.0, 600.0, priority=1)], RULES)
    (lost,) = [one for one in found if one.track.satellite == "A"]
    assert lost.slot is None
    assert lost.reason.startswith("lost to ")
    assert "(priority 9): both are up for 200 s" in lost.reason
    uneven = [track("B", 500.0, 600.0, priority=9), track("C", 1300.0, 500.0, priority=9)]
    (lost,) = [one for one in decide([*uneven, track("A", 1000.0, 600.0)], RULES) if one.track.satellite == "A"]
    assert lost.reason.startswith("lost to C of ")
    assert lost.reason.endswith("both are up for 300 s")


def test_a_pass_that_is_cut_says_from_when_to_when():
    tracks = [track("A", 1000.0, 800.0, priority=1, may_be_cut=True), track("B", 1600.0, 600.0, priority=9)]
    (found,) = [one for one in decide(tracks, RULES) if one.track.satellite == "A"]
    assert found.slot is not None
    times = [utc_text(one, 0)[11:19] for one in (found.slot.start_tai_s, found.slot.end_tai_s)]
    assert found.reason == f"cut to {times[0]} to {times[1]}"
    assert found.slot.start_tai_s == DAY + 1000.0
    assert found.slot.end_tai_s < DAY + 1600.0 - RULES.pre_s - RULES.post_s
