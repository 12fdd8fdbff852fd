"""What the schedule says of single passes: words of people, windows, lost ones, and what a new plan changes."""

from dataclasses import replace

import numpy as np
import pytest
from test_schedule import DAY, RULES, track

from acu_daemon.model import AxisLimits
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import Entry, PassState, merged, paused
from acu_daemon.schedule.decisions import Decision, decide
from acu_daemon.schedule.exact_plan import AntennaPlace, Slot, best_slots
from acu_daemon.schedule.pass_track import PassTrack
from acu_daemon.schedule.rules import PassRequest, SatelliteRules, StationRules, Window, Wish

AZIMUTH = RULES.azimuth
GONE = "no longer in the plan: its satellite or elements went"


def clock(after_s: float) -> str:
    return utc_text(DAY + after_s, 0)[11:19]


def reasons(tracks: list[PassTrack], rules: StationRules = RULES, **more: object) -> dict[str, str]:
    return {one.track.satellite: one.reason for one in decide(tracks, rules, **more)}  # type: ignore[arg-type]


def word(satellite: str, after_s: float, wish: Wish) -> StationRules:
    return replace(RULES, requests=(PassRequest(satellite, DAY + after_s, wish),))


# Words of people


@pytest.mark.parametrize(
    ("at_s", "is_of"),
    [
        (0.0, True), (2000.0, True), (-1.0, False), (2001.0, False),  # up from 0 to 2000, highest at 1000
    ],
)  # fmt: skip
def test_a_word_is_about_the_pass_that_is_up_at_its_time_both_ends_included(at_s: float, is_of: bool) -> None:
    assert PassRequest("A", at_s, Wish.FORCE).is_of("A", 0.0, 1000.0, 2000.0) == is_of
    assert not PassRequest("B", at_s, Wish.FORCE).is_of("A", 0.0, 1000.0, 2000.0)


@pytest.mark.parametrize(("at_s", "is_of"), [(401.0, True), (400.0, False), (1599.0, True), (1600.0, False)])
def test_or_about_the_one_that_culminates_within_ten_minutes(at_s: float, is_of: bool) -> None:
    assert PassRequest("A", at_s, Wish.FORCE).is_of("A", 990.0, 1000.0, 1010.0) == is_of
    assert not PassRequest("B", at_s, Wish.FORCE).is_of("A", 990.0, 1000.0, 1010.0)


@pytest.mark.parametrize(
    ("wish", "reason"),
    [
        (None, "culminates at 19.9 deg, min_culmination_deg is 20"),
        (Wish.NONE, "culminates at 19.9 deg, min_culmination_deg is 20"),
        (Wish.EXCLUDE, "excluded by a person"),
        (Wish.FORCE, "forced by a person"),
        (Wish.GO_ON, "gone on with after a restart"),
    ],
)
def test_a_pass_too_low_is_tracked_where_it_must_be(wish: Wish | None, reason: str) -> None:
    low = track("A", 0.0, top_deg=19.9, min_culmination_deg=20.0)
    [found] = decide([low], RULES if wish is None else word("A", 300.0, wish))
    assert found.reason == reason
    assert (found.slot is not None) == (wish in (Wish.FORCE, Wish.GO_ON))


def test_a_pass_as_high_as_the_least_is_tracked() -> None:
    assert reasons([track("A", 0.0, top_deg=20.0, min_culmination_deg=20.0)]) == {"A": ""}


def test_a_frozen_pass_stays_whatever_is_said_of_it() -> None:
    mine = track("A", 0.0, min_culmination_deg=80.0)
    [slot] = best_slots([mine], RULES)
    [found] = decide([mine], word("A", 300.0, Wish.EXCLUDE), frozen=[slot])
    assert found.slot == slot


def test_a_forced_pass_that_is_cut_says_both() -> None:
    mine = track("A", 0.0, may_be_cut=True)
    rules = replace(word("A", 300.0, Wish.FORCE), windows=(Window(DAY + 500.0, DAY + 900.0, "greasing"),))
    assert reasons([mine], rules) == {"A": f"forced by a person, cut to {clock(0.0)} to {clock(490.0)}"}


# Windows and what is worth having


@pytest.mark.parametrize(("from_s", "to_s"), [(609.0, 900.0), (-300.0, -59.0), (200.0, 300.0), (-10.0, 700.0)])
def test_a_window_that_touches_a_pass_or_what_comes_before_and_after_it_is_the_reason_with_its_times(
    from_s: float, to_s: float
) -> None:
    rules = replace(
        RULES,
        windows=(Window(DAY - 900.0, DAY - 700.0, "early"), Window(DAY + from_s, DAY + to_s, "greasing")),
    )
    assert reasons([track("A", 0.0)], rules) == {"A": f"greasing {clock(from_s)} to {clock(to_s)}"}


@pytest.mark.parametrize(("from_s", "to_s"), [(610.0, 900.0), (-300.0, -60.0)])
def test_a_window_beyond_what_comes_before_and_after_a_pass_leaves_it(from_s: float, to_s: float) -> None:
    rules = replace(RULES, windows=(Window(DAY + from_s, DAY + to_s, "greasing"),))
    assert reasons([track("A", 0.0)], rules) == {"A": ""}


def test_what_is_useful_on_the_best_turn_counts_against_the_least() -> None:
    assert reasons([track("A", 0.0, min_useful_s=600.0)]) == {"A": ""}
    assert reasons([track("A", 0.0, min_useful_s=602.0)]) == {"A": "useful for 600 s only, min_useful_s is 602"}
    far = track("A", 0.0, az_deg=(190.0, 350.0), min_useful_s=602.0)  # on another turn it is in range
    assert reasons([far]) == {"A": "useful for 600 s only, min_useful_s is 602"}


# Who is lost to whom


@pytest.mark.parametrize("is_before", [True, False])
def test_a_pass_too_near_is_lost_to_its_neighbour_with_the_slew_between_their_ends(is_before: bool) -> None:
    slow = replace(RULES, azimuth=AxisLimits(-270.0, 270.0, 1.0, 1.0))
    winner = track("WINS", 0.0, az_deg=(10.0, 100.0), priority=9)
    loser = track("LOSES", 650.0 if is_before else -650.0, az_deg=(60.0, -20.0))
    way_deg = 100.0 - 60.0 if is_before else 10.0 - -20.0
    need_s = 70.0 + slow.slew_s(way_deg, 0.0)
    told = reasons([loser, winner], slow)["LOSES"]
    assert (
        told == f"lost to WINS of {clock(0.0)} (priority 9): slew and preparation need {need_s:.0f} s, the gap is 50 s"
    )


@pytest.mark.parametrize(("rise_s", "gap"), [(601.0, "1"), (-601.0, "1"), (600.0, "0"), (-600.0, "0")])
def test_passes_that_nearly_touch_have_hardly_a_gap(rise_s: float, gap: str) -> None:
    told = reasons([track("A", rise_s), track("B", 0.0, priority=9)])["A"]
    need_s = 70.0 + RULES.slew_s(160.0, 0.0)
    assert told.endswith(f"need {need_s:.0f} s, the gap is {gap} s")


@pytest.mark.parametrize(
    ("free_s", "reason"),
    [(0.0, "the antenna cannot be there in time"), (590.0, "it is too late to be there for its rise")],
)
def test_without_a_rival_the_antenna_is_too_far_away_or_too_late(free_s: float, reason: str) -> None:
    slow = replace(RULES, azimuth=AxisLimits(-270.0, 270.0, 0.3, 0.3))
    rise_s = 10.0 if free_s == 0.0 else 0.0
    found = reasons([track("A", rise_s, min_useful_s=590.0)], slow, place=AntennaPlace(DAY + free_s, 200.0, 5.0))
    assert found == {"A": reason}


def test_decisions_are_in_the_order_of_the_rise_and_of_the_name() -> None:
    tracks = [track("B", 5000.0), track("C", 0.0, margin_s=10.0), track("A", 5000.0), track("D", -5.0)]
    assert [one.track.satellite for one in decide(tracks, RULES)] == ["C", "D", "A", "B"]


# Rules and tracks


def test_the_longest_gap_is_for_the_whole_range_of_the_slower_axis() -> None:
    quick, slow = AxisLimits(-270.0, 270.0, 50.0, 50.0), AxisLimits(10.0, 90.0, 0.5, 0.5)
    rules = StationRules(quick, slow, pre_s=40.0, post_s=7.0)
    assert rules.longest_gap_s == pytest.approx(47.0 + rules.slew_s(0.0, 80.0))
    assert rules.slew_s(540.0, 80.0) == rules.slew_s(0.0, 80.0) > rules.slew_s(540.0, 0.0)
    assert rules.slew_s(-540.0, 1.0) == rules.slew_s(540.0, -1.0)
    swapped = StationRules(slow, quick, pre_s=40.0, post_s=7.0)
    assert swapped.longest_gap_s == pytest.approx(47.0 + swapped.slew_s(80.0, 0.0))
    assert (StationRules(quick, slow).pre_s, StationRules(quick, slow).post_s) == (60.0, 10.0)


def test_a_satellite_of_which_nothing_is_said_has_the_middle_priority() -> None:
    assert SatelliteRules() == SatelliteRules(5, 0.0, 60.0, 0.0, may_be_cut=False, may_interrupt=False)


def test_a_reservation_is_wider_than_the_pass_by_its_margin_on_either_side() -> None:
    mine = track("A", 100.0, margin_s=30.0)
    assert (mine.start_tai_s, mine.end_tai_s) == (DAY + 70.0, DAY + 730.0)
    assert mine.at(DAY + 70.0) == (10.0, 5.0)
    assert mine.at(DAY + 730.0) == (170.0, 5.0)
    assert mine.at(DAY + 400.0) == pytest.approx((90.0, 40.0))


@pytest.mark.parametrize(
    ("from_s", "to_s", "offset_deg", "useful_s"),
    [
        (0.0, 600.0, 0.0, 600.0),
        (-50.0, 100.0, 0.0, 100.0),
        (500.0, 900.0, 0.0, 100.0),
        (101.0, 201.0, 0.0, 100.0),
        (0.0, 600.0, 260.0, 0.0),
        (0.0, 600.0, 180.0, 300.0),  # 190 to 350: up to 270
        (0.0, 600.0, -360.0, 300.0),  # -350 to -190: from -270 on
        (300.0, 600.0, 180.0, 0.0),
    ],
)
def test_useful_seconds_are_those_in_range_on_the_turn(
    from_s: float, to_s: float, offset_deg: float, useful_s: float
) -> None:
    mine = track("A", 0.0)
    assert mine.useful_s(DAY + from_s, DAY + to_s, offset_deg, AZIMUTH) == pytest.approx(useful_s)


def test_what_is_hidden_is_of_no_use_nor_the_step_before_and_after_it() -> None:
    mine = track("A", 0.0)
    useful = np.ones(mine.tai_s.size, dtype=np.bool_)
    useful[100:111] = False  # 200 to 220 s
    hidden = replace(mine, is_useful=useful)
    assert hidden.useful_s(DAY, DAY + 600.0, 0.0, AZIMUTH) == pytest.approx(576.0)
    assert hidden.useful_s(DAY + 210.0, DAY + 600.0, 0.0, AZIMUTH) == pytest.approx(378.0)


def test_the_part_of_a_pass_may_have_other_turns_than_the_whole() -> None:
    mine = track("A", 0.0, az_deg=(0.0, 300.0))
    assert mine.turns_deg(DAY, DAY + 600.0, AZIMUTH) == (0.0,) or 0.0 in mine.turns_deg(DAY, DAY + 600.0, AZIMUTH)
    assert -360.0 in mine.turns_deg(DAY + 560.0, DAY + 600.0, AZIMUTH)
    assert 0.0 not in mine.turns_deg(DAY + 560.0, DAY + 600.0, AZIMUTH)
    assert 0.0 in mine.turns_deg(DAY, DAY + 40.0, AZIMUTH)


# What a new plan changes


def entry(**changed: object) -> Entry:
    [found] = merged((), decide([track("A", 1000.0)], RULES), DAY, DAY + 86400.0).book
    return replace(found, **changed)  # type: ignore[arg-type]


def planned(rise_s: float, name: str = "A", **rules: float) -> list[Decision]:
    return decide([track(name, rise_s, **rules)], RULES)


def test_an_entry_is_what_was_decided_of_its_pass() -> None:
    found = entry()
    assert (found.satellite, found.priority, found.state, found.reason) == ("A", 5, PassState.PLANNED, "")
    assert (found.rise_tai_s, found.culmination_tai_s, found.set_tai_s) == (DAY + 1000.0, DAY + 1300.0, DAY + 1600.0)
    assert (found.start_tai_s, found.end_tai_s, found.start_az_deg) == (DAY + 1000.0, DAY + 1600.0, 10.0)
    assert (found.culmination_el_deg, found.useful_s, found.part, found.number) == (40.0, pytest.approx(600.0), 0, 1)
    assert found.name == f"A of {utc_text(DAY + 1000.0, 0)[:19]}Z"


@pytest.mark.parametrize(("moved_s", "is_same"), [(599.0, True), (-599.0, True), (600.0, False), (-600.0, False)])
def test_a_pass_that_culminates_within_ten_minutes_is_the_same_one(moved_s: float, is_same: bool) -> None:
    after = merged([entry()], planned(1000.0 + moved_s), DAY, DAY + 86400.0, first_number=7)
    assert [one.number for one in after.book if one.state is PassState.PLANNED] == [1 if is_same else 7]
    other = merged([entry()], planned(1000.0, "B"), DAY, DAY + 86400.0, first_number=7)
    assert sorted(one.number for one in other.book) == [1, 7]


def test_new_entries_are_numbered_on_and_a_new_one_beside_old_ones_is_told() -> None:
    after = merged(
        [entry()], decide([track("A", 1000.0), track("B", 9000.0), track("C", 5000.0)], RULES), DAY, DAY + 9e4, 7
    )
    assert [(one.satellite, one.number) for one in after.book] == [("A", 1), ("C", 7), ("B", 8)]
    assert after.said == tuple(f"{one.name}: planned" for one in after.book[1:])
    assert after.changed == after.book[1:]


@pytest.mark.parametrize(("moved_s", "is_told"), [(0.0, False), (4.9, False), (5.0, True), (-5.0, True)])
def test_what_moves_by_five_seconds_is_told(moved_s: float, is_told: bool) -> None:
    after = merged([entry()], planned(1000.0 + moved_s), DAY, DAY + 86400.0)
    assert bool(after.said) == is_told
    assert bool(after.changed) == (moved_s != 0.0)


@pytest.mark.parametrize("state", [one for one in PassState if one not in (PassState.PLANNED, PassState.REFUSED)])
def test_what_has_begun_stays_as_it_is(state: PassState) -> None:
    old = entry(state=state, reason="so")
    after = merged([old], planned(1100.0), DAY, DAY + 86400.0)
    assert (after.book, after.changed, after.said) == ((old,), (), ())


@pytest.mark.parametrize(
    ("state", "now_s", "until_s", "becomes", "reason"),
    [
        (
            PassState.PLANNED,
            1600.0,
            1001.0,
            PassState.CANCELLED,
            "no longer in the plan: its satellite or elements went",
        ),
        (PassState.PLANNED, 1601.0, 1001.0, PassState.MISSED, "the daemon did not run, or was not ready"),
        (PassState.PLANNED, 0.0, 1000.0, PassState.PLANNED, ""),  # beyond what was planned
        (PassState.PREPASS, 1600.0, 9000.0, PassState.PREPASS, ""),
        (PassState.PREPASS, 1601.0, 9000.0, PassState.FAILED, "the daemon ended in mid-pass"),
        (PassState.POSTPASS, 1601.0, 9000.0, PassState.FAILED, "the daemon ended in mid-pass"),
        (PassState.REFUSED, 1601.0, 9000.0, PassState.REFUSED, ""),
    ],
)
def test_what_a_plan_does_not_have_goes_by_its_time(
    state: PassState, now_s: float, until_s: float, becomes: PassState, reason: str
) -> None:
    after = merged([entry(state=state)], [], DAY + now_s, DAY + until_s)
    [found] = after.book
    assert (found.state, found.reason) == (becomes, reason)
    assert after.said == ((f"{found.name}: {becomes} ({reason})",) if becomes is not state else ())


def test_what_was_missed_for_a_known_reason_keeps_it() -> None:
    [found] = merged([entry(reason="cut to 1 to 2")], [], DAY + 5000.0, DAY + 9000.0).book
    assert (found.state, found.reason) == (PassState.MISSED, "cut to 1 to 2")


@pytest.mark.parametrize(
    ("changed", "until_s", "is_cancelled"),
    [
        ({}, 1001.0, True), ({}, 1000.0, False), ({"start_tai_s": None}, 1001.0, False),
        ({"state": PassState.PASS}, 1001.0, False), ({"state": PassState.REFUSED}, 1001.0, False),
    ],
)  # fmt: skip
def test_a_pause_cancels_what_is_planned_to_begin_before_it_ends(
    changed: dict[str, object], until_s: float, is_cancelled: bool
) -> None:
    old = entry(**changed)
    found = paused(old, DAY + until_s)
    assert (found.state is PassState.CANCELLED) == is_cancelled
    if is_cancelled:
        assert found == replace(
            old, state=PassState.CANCELLED, reason=f"paused by a person until {utc_text(DAY + until_s, 0)}"
        )
    else:
        assert found == old


def test_two_parts_of_a_pass_are_two_entries_that_keep_their_numbers() -> None:
    mine = track("A", 0.0, may_be_cut=True)
    rules = replace(RULES, windows=(Window(DAY + 250.0, DAY + 350.0, "greasing"),))
    first = merged((), decide([mine], rules), DAY, DAY + 9000.0)
    assert [(one.part, one.number) for one in first.book] == [(0, 1), (1, 2)]
    again = merged(first.book, decide([mine], rules), DAY, DAY + 9000.0, 3)
    assert again.book == first.book
    slots: list[Slot | None] = [one.slot for one in decide([mine], rules)]
    assert all(one is not None and one.is_cut for one in slots)


def test_of_passes_that_only_touch_it_is_the_gap_that_is_too_short() -> None:
    told = reasons([track("A", 600.0), track("B", 0.0, priority=9)])["A"]
    assert "slew and preparation need" in told
    assert "both are up" not in told


def test_a_forced_pass_beats_a_better_one_and_says_so() -> None:
    tracks = [track("A", 0.0, priority=1), track("B", 300.0, priority=9)]
    assert reasons(tracks, word("A", 0.0, Wish.FORCE))["A"] == "forced by a person"
    assert reasons(tracks, word("A", 0.0, Wish.FORCE))["B"].startswith("lost to A of ")
