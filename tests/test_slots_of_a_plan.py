"""Slots of the exact plan one by one: turns of the cable, the antenna's place, gaps to the second, parts, windows."""

from dataclasses import replace

import numpy as np
import pytest
from test_schedule import DAY, RULES, track

from acu_daemon.schedule.exact_plan import FILLER, AntennaPlace, Slot, best_slots, slots_of
from acu_daemon.schedule.pass_track import PassTrack
from acu_daemon.schedule.rules import StationRules, Window


def names(slots: list[Slot]) -> list[str]:
    return [one.track.satellite for one in slots]


@pytest.mark.parametrize(("ends_deg", "begins_deg"), [(170.0, 200.0), (-170.0, -160.0)])
def test_of_two_turns_that_are_worth_as_much_the_one_with_the_shorter_way_is_taken(
    ends_deg: float, begins_deg: float
) -> None:
    first = track("A", 0.0, az_deg=(ends_deg / 2.0, ends_deg))
    second = track("B", 1500.0, az_deg=(200.0, 250.0))
    assert {one.start_deg[0] for one in slots_of(second, (), RULES)} == {200.0, -160.0}
    plan = best_slots([first, second], replace(RULES, pre_s=800.0))  # near enough for the way to count
    assert names(plan) == ["A", "B"]
    assert plan[1].start_deg[0] == begins_deg
    assert plan[1].end_deg == (begins_deg + 50.0, 5.0)


@pytest.mark.parametrize(("by_s", "count"), [(0.0, 2), (-1.0, 1), (1.0, 2)])
@pytest.mark.parametrize("az_deg", [(170.0, 10.0), (50.0, 60.0), (-60.0, -10.0)])
def test_the_gap_is_what_comes_after_before_and_the_slew_between_to_the_second(
    az_deg: tuple[float, float], by_s: float, count: int
) -> None:
    rules = replace(RULES, pre_s=20.0, post_s=7.0)
    need_s = float(np.ceil(27.0 + rules.slew_s(az_deg[0] - 170.0, 0.0)))
    tracks = [track("A", 0.0), track("B", 600.0 + need_s + by_s, az_deg=az_deg)]
    turns = {one.start_deg[0] for one in slots_of(tracks[1], (), rules)}
    need_s = min(float(np.ceil(27.0 + rules.slew_s(one - 170.0, 0.0))) for one in turns)
    tracks[1] = track("B", 600.0 + need_s + by_s, az_deg=az_deg)
    assert len(best_slots(tracks, rules)) == count


def test_what_a_slot_is_worth() -> None:
    [slot] = slots_of(track("A", 0.0, priority=3), (), RULES)
    assert slot.value == pytest.approx((3 + FILLER) * 600.0)
    assert (slot.start_tai_s, slot.end_tai_s, slot.start_deg, slot.end_deg) == (
        DAY, DAY + 600.0, (10.0, 5.0), (170.0, 5.0),
    )  # fmt: skip
    assert not slot.is_cut
    assert replace(slot, start_tai_s=DAY + 0.5).is_cut
    assert replace(slot, end_tai_s=DAY + 599.5).is_cut


def joined(mine: PassTrack, free_s: float, az_deg: float = 10.0, el_deg: float = 5.0) -> list[Slot]:
    return best_slots([mine], RULES, place=AntennaPlace(DAY + free_s, az_deg, el_deg))


def test_an_antenna_that_is_there_in_time_has_the_whole_pass() -> None:
    for mine, free_s in ((track("A", 100.0), 100.0), (track("A", 100.0), -500.0)):
        [slot] = joined(mine, free_s)
        assert (slot.start_tai_s, slot.is_cut) == (DAY + 100.0, False)


@pytest.mark.parametrize(("az_deg", "el_deg"), [(60.0, 5.0), (10.0, 55.0), (-40.0, 5.0), (200.0, 5.0)])
def test_one_that_is_late_has_what_is_left_from_where_the_satellite_is_then(az_deg: float, el_deg: float) -> None:
    mine = track("A", 0.0)
    [slot] = joined(mine, 50.0, az_deg, el_deg)
    late_s = 50.0 + RULES.slew_s(az_deg - 10.0, el_deg - 5.0)
    assert slot.start_tai_s - DAY == pytest.approx(late_s, abs=1e-3)
    assert slot.start_deg == pytest.approx(mine.at(DAY + late_s))
    assert slot.useful_s == pytest.approx(600.0 - late_s)
    assert (slot.end_tai_s, slot.end_deg) == (DAY + 600.0, (170.0, 5.0))


def test_on_another_turn_it_is_joined_on_that_turn() -> None:
    [slot] = joined(track("A", 0.0, az_deg=(200.0, 250.0)), 60.0, az_deg=-160.0)
    assert slot.start_deg[0] == pytest.approx(-155.0)
    assert slot.end_deg[0] == pytest.approx(-110.0)


@pytest.mark.parametrize(("free_s", "is_worth"), [(500.0, True), (499.0, True), (500.5, False), (700.0, False)])
def test_what_is_left_must_be_worth_having(free_s: float, is_worth: bool) -> None:
    assert bool(joined(track("A", 0.0, min_useful_s=100.0), free_s)) == is_worth


@pytest.mark.parametrize(("free_s", "is_joined"), [(599.0, True), (600.0, False), (700.0, False)])
def test_after_its_end_a_pass_is_not_joined_though_nothing_is_asked_of_it(free_s: float, is_joined: bool) -> None:
    assert bool(joined(track("A", 0.0, min_useful_s=0.0), free_s, az_deg=10.0)) == is_joined


def test_frozen_slots_stay_though_their_passes_are_gone_or_offered_anew() -> None:
    mine, better = track("A", 0.0, priority=1), track("B", 100.0, priority=9)
    [frozen] = slots_of(mine, (), RULES)
    assert best_slots([better], RULES, frozen=[frozen]) == [frozen]
    assert best_slots([mine, better], RULES, frozen=[frozen]) == [frozen]
    assert best_slots([], RULES, frozen=[frozen]) == [frozen]
    assert best_slots([], RULES) == []


def test_of_forced_passes_that_collide_one_is_granted_and_a_forced_one_beats_any_number_of_others() -> None:
    low = track("LOW", 0.0, 3000.0, priority=0)
    others = [track(f"S{k}", 720.0 * k, priority=9) for k in range(4)]
    assert names(best_slots([low, *others], RULES)) == ["S0", "S1", "S2", "S3"]
    assert names(best_slots([low, *others], RULES, forced=[low])) == ["LOW"]
    assert len(best_slots([low, others[0]], RULES, forced=[low, others[0]])) == 1


@pytest.mark.parametrize(
    ("from_s", "to_s", "is_kept"),
    [(610.0, 700.0, True), (609.0, 700.0, False), (-200.0, -60.0, True), (-200.0, -59.0, False), (100.0, 110.0, False)],
)
def test_windows_are_kept_clear_with_what_comes_before_and_after_a_pass(
    from_s: float, to_s: float, is_kept: bool
) -> None:
    rules: StationRules = replace(RULES, windows=(Window(DAY + from_s, DAY + to_s, "greasing"),))
    assert bool(list(slots_of(track("A", 0.0), (), rules))) == is_kept


def test_parts_begin_after_a_window_and_end_before_it_and_none_is_shorter_than_the_least() -> None:
    rules = replace(RULES, windows=(Window(DAY + 200.0, DAY + 300.0, "greasing"),))
    found = list(slots_of(track("A", 0.0, may_be_cut=True, min_useful_s=100.0), (), rules))
    spans = {(one.start_tai_s - DAY, one.end_tai_s - DAY) for one in found}
    assert {(0.0, 190.0), (360.0, 600.0), (0.0, 102.0), (498.0, 600.0)} <= spans
    assert all(one.useful_s >= 100.0 for one in found)
    assert all(end <= 190.0 or start >= 360.0 for start, end in spans)
    whole = list(slots_of(track("A", 0.0, min_useful_s=100.0), (), rules))
    assert whole == []


@pytest.mark.parametrize("is_before", [True, False])
def test_a_part_is_cut_to_the_second_where_its_neighbour_leaves_it(is_before: bool) -> None:
    winner = track("WINS", 0.0, az_deg=(10.0, 170.0), priority=9)
    mine = track("CUT", 300.0 if is_before else -300.0, az_deg=(100.0, -100.0), may_be_cut=True)
    plan = best_slots([winner, mine], RULES)
    [part] = [one for one in plan if one.track is mine]
    first, second = plan
    gap_s = second.start_tai_s - first.end_tai_s
    need_s = 70.0 + RULES.slew_s(second.start_deg[0] - first.end_deg[0], second.start_deg[1] - first.end_deg[1])
    assert need_s <= gap_s < need_s + 2.0
    assert part.is_cut
    assert (part.end_tai_s == mine.end_tai_s) == is_before
