"""The schedule while the station runs: when it is planned anew, with what, what of a plan is frozen, what is next."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from config_files import STATION, write
from structlog.testing import capture_logs
from test_schedule import track

from acu_daemon.cli import schedule_keeper
from acu_daemon.cli.run_setup import next_text
from acu_daemon.cli.schedule_keeper import PLAN_S, WORD, WORDS_S, ScheduleKeeper
from acu_daemon.cli.schedule_plan import StationPlan
from acu_daemon.config.load import load_station
from acu_daemon.daemon.tally import Tally
from acu_daemon.edge.schedule_file import NO_PAUSE, ScheduleFile, Words
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import Entry, PassState
from acu_daemon.schedule.decisions import RESUMED, Decision
from acu_daemon.schedule.exact_plan import Slot
from acu_daemon.schedule.pass_track import PassTrack
from acu_daemon.schedule.rules import PassRequest, Wish
from acu_daemon.units import DAY_S

NOW = 8.5e8  # the day of test_schedule's tracks
STEP_S = 0.01
FREEZE_S = 250.0
PLANNED = Entry(
    "A", NOW + 900.0, NOW + 1200.0, NOW + 1500.0, 40.0, 5, PassState.PLANNED, "", 600.0, NOW + 890.0, NOW + 1510.0
)
NO_PLAN = StationPlan((), NOW + DAY_S, {})


class Desk:
    """A keeper with a clock that stands, and plans that are at hand."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, book: tuple[Entry, ...] = ()) -> None:
        self.now_tai_s = NOW
        self.config, state = (
            write(folder / "config", STATION + f"[schedule]\nfreeze_s = {FREEZE_S}\n"),
            folder / "state",
        )
        state.mkdir()
        self.file = ScheduleFile(state)
        self.file.save(book, NOW)
        self.plan: Callable[[], StationPlan] = lambda: NO_PLAN
        self.asked: list[tuple[Path, float, list[PassRequest], list[Slot]]] = []
        self.tally = Tally()
        monkeypatch.setattr(schedule_keeper, "station_plan", self._planned)
        self.keeper = ScheduleKeeper(self.config, self, self.file, load_station(self.config), self._beside, self.tally)

    def tai_s(self) -> float:
        return self.now_tai_s

    @staticmethod
    async def _beside(work: Callable[..., Any], *given: Any) -> Any:
        return work(*given)

    def _planned(self, config: Path, now_tai_s: float, *, requests: list[Any], frozen: Any) -> StationPlan:
        self.asked.append((config, now_tai_s, list(requests), list(frozen)))
        return self.plan()

    def saved(self, number: int = 1) -> Entry:
        [entry] = [one for one in self.file.book(0.0) if one.number == number]
        return entry

    async def look(self, now_tai_s: float, *, is_in_pass: bool = False) -> bool:
        """Look, and again once it is done; whether it was planned."""
        before_count, self.now_tai_s = len(self.asked), now_tai_s
        look = self.keeper.look_in_pass if is_in_pass else self.keeper.look
        for _ in range(3):
            look(now_tai_s)
            await asyncio.sleep(0.0)
            await asyncio.sleep(0.0)
        return len(self.asked) > before_count


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    return Desk(tmp_path, monkeypatch)


def numbered(*entries: Entry) -> tuple[Entry, ...]:
    return tuple(replace(one, number=at) for at, one in enumerate(entries, 1))


def slot_of(of: PassTrack, start_tai_s: float) -> Slot:
    return Slot(of, start_tai_s, of.end_tai_s, (10.0, 5.0), (170.0, 5.0), 300.0)


# The start


@pytest.mark.parametrize(("end_s", "is_on"), [(-STEP_S, False), (0.0, False), (STEP_S, True), (None, False)])
@pytest.mark.parametrize("state", [PassState.PREPASS, PassState.PASS, PassState.POSTPASS])
def test_a_pass_that_was_on_and_is_not_over_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: PassState, end_s: float | None, is_on: bool
) -> None:
    end_tai_s = None if end_s is None else NOW + end_s
    book = numbered(replace(PLANNED, state=state, reason="by itself", end_tai_s=end_tai_s))
    [entry] = Desk(tmp_path, monkeypatch, book).keeper.book
    assert (entry.state, entry.reason) == ((PassState.PLANNED, RESUMED) if is_on else (state, "by itself"))


@pytest.mark.parametrize("state", sorted(set(PassState) - {PassState.PREPASS, PassState.PASS, PassState.POSTPASS}))
def test_one_that_was_not_on_is_left_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: PassState
) -> None:
    book = numbered(replace(PLANNED, state=state, reason="by itself"))
    assert Desk(tmp_path, monkeypatch, book).keeper.book == book


def test_the_book_begins_a_day_ago_and_new_passes_have_numbers_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long_ago = replace(PLANNED, rise_tai_s=NOW - DAY_S - 700.0, state=PassState.DONE)
    book = numbered(
        replace(long_ago, set_tai_s=NOW - DAY_S - STEP_S), replace(long_ago, set_tai_s=NOW - DAY_S + STEP_S)
    )
    desk = Desk(tmp_path, monkeypatch, (*book, replace(long_ago, set_tai_s=NOW - 2.0 * DAY_S, number=9)))
    assert desk.keeper.book == book[1:]
    first, second = track("B", 5000.0), track("C", 9000.0)
    desk.keeper._take(StationPlan((Decision(first, None), Decision(second, None)), NOW + DAY_S, {}))
    assert [one.number for one in desk.keeper.book] == [2, 10, 11]
    desk.keeper._take(
        StationPlan((Decision(first, None), Decision(second, None), Decision(track("D", 1.0), None)), NOW, {})
    )
    assert sorted(one.number for one in desk.keeper.book) == [2, 10, 11, 12]


async def test_the_first_plan_is_made_of_what_people_have_said(desk: Desk) -> None:
    said = PassRequest("A", NOW + 50.0, Wish.FORCE)
    desk.keeper.say(said, "a person")
    desk.keeper.pause(NOW + 77.0, "a person")
    assert desk.keeper.anew_reason == "the start"
    with capture_logs() as logs:
        await desk.keeper.first_plan()
    assert desk.asked == [(desk.config, NOW, [said], [])]
    assert desk.keeper.words == Words((said,), NOW + 77.0)
    assert logs == [{"event": "schedule.planned", "granted": 0, "reason": "the start", "log_level": "info"}]
    assert desk.keeper.anew_reason == ""


# When it is planned


@pytest.mark.parametrize("side", [-1, 0, 1])
async def test_it_is_planned_every_ten_minutes_from_when_the_last_plan_was_taken(desk: Desk, side: int) -> None:
    assert PLAN_S == 600.0
    desk.keeper.anew_reason = ""
    assert await desk.look(NOW)  # there is none yet
    assert not await desk.look(NOW + 1.0)
    with capture_logs() as logs:
        assert await desk.look(NOW + PLAN_S + side * STEP_S) == (side >= 0)
    assert [one["reason"] for one in logs] == ["as always"] * (side >= 0)
    assert [at for _, at, *_ in desk.asked][1:] == [NOW + PLAN_S + side * STEP_S] * (side >= 0)


async def test_a_reason_makes_it_plan_at_once_with_the_files_read_again(desk: Desk) -> None:
    await desk.keeper.first_plan()
    text = (desk.config / "station.toml").read_text()
    (desk.config / "station.toml").write_text(text.replace("height_m = 277.0", "height_m = 300.0"))
    desk.keeper.anew_reason = ""
    assert await desk.look(NOW + PLAN_S)
    assert desk.keeper.station.station.height_m == 277.0  # nothing is known to have changed
    desk.keeper.anew_reason = "a person asked"
    assert await desk.look(NOW + PLAN_S + 1.0)
    assert desk.keeper.station.station.height_m == 300.0
    assert desk.keeper.anew_reason == ""


async def test_a_bad_file_leaves_what_was_read_and_is_tried_again_with_the_next_plan(desk: Desk) -> None:
    await desk.keeper.first_plan()
    before = desk.keeper.station
    (desk.config / "station.toml").write_text("[station]\nlatitude_deg = north\n")
    desk.keeper.anew_reason = "changed: station.toml"
    with capture_logs() as logs:
        assert not await desk.look(NOW + PLAN_S)
    assert [(one["event"], one["in_force"]) for one in logs] == [("config.kept", "what was read before")]
    assert "station.toml" in logs[0]["reason"]
    assert (desk.keeper.station, desk.keeper.anew_reason) == (before, "")
    assert not await desk.look(NOW + 2.0 * PLAN_S - STEP_S)
    assert await desk.look(NOW + 2.0 * PLAN_S)


async def test_a_plan_that_fails_leaves_the_one_before_and_is_tried_again_with_the_next(desk: Desk) -> None:
    of = track("B", 900.0)
    desk.plan = lambda: StationPlan((Decision(of, slot_of(of, NOW + 900.0)),), NOW + DAY_S, {})
    await desk.keeper.first_plan()
    before = desk.keeper.book

    def fail() -> StationPlan:
        raise ValueError("no plan")

    desk.plan, desk.keeper.anew_reason = fail, "a person asked"
    with capture_logs() as logs:
        assert await desk.look(NOW + 10.0)
    [kept] = [one for one in logs if one["event"] == "schedule.kept"]
    assert kept["reason"] == "ValueError: no plan"
    assert (desk.keeper.book, desk.keeper.anew_reason) == (before, "")
    assert not await desk.look(NOW + 10.0 + PLAN_S - STEP_S)
    assert await desk.look(NOW + 10.0 + PLAN_S)


async def test_one_plan_is_made_at_a_time(desk: Desk) -> None:
    desk.keeper.look(NOW)
    desk.keeper.anew_reason = "another"
    desk.keeper.look(NOW)
    await asyncio.sleep(0.0)
    await asyncio.sleep(0.0)
    assert len(desk.asked) == 1
    desk.keeper.look_in_pass(NOW)
    assert desk.keeper.anew_reason == ""  # it is taken
    desk.keeper.close()


# What it is planned with


async def test_passes_that_are_gone_on_with_come_first_and_peoples_words_after_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    on = replace(PLANNED, state=PassState.PASS)
    desk = Desk(tmp_path, monkeypatch, numbered(on, replace(on, satellite="B", state=PassState.PLANNED)))
    said = PassRequest("A", NOW + 1200.0, Wish.EXCLUDE)
    desk.keeper.say(said, "a person")
    await desk.keeper.first_plan()
    [(_, _, requests, _)] = desk.asked
    assert requests == [PassRequest("A", PLANNED.culmination_tai_s, Wish.GO_ON), said]


STARTS_S = (-STEP_S, 0.0, STEP_S, FREEZE_S - STEP_S, FREEZE_S, FREEZE_S + STEP_S)


@pytest.mark.parametrize(
    ("reason", "starts_s"), [("", [STEP_S, FREEZE_S - STEP_S]), ("a file", [STEP_S, FREEZE_S - STEP_S]), (WORD, [])]
)
async def test_what_begins_within_the_freeze_stays_but_for_a_persons_word(
    desk: Desk, reason: str, starts_s: list[float]
) -> None:
    tracks = [track(f"S{at}", 100.0 + 5.0 * at) for at in range(len(STARTS_S))]
    slots = [slot_of(of, NOW + start_s) for of, start_s in zip(tracks, STARTS_S, strict=True)]
    refused = Decision(track("R", 100.0), None, "no")
    desk.plan = lambda: StationPlan((refused, *(Decision(one.track, one) for one in slots)), NOW + DAY_S, {})
    await desk.keeper.first_plan()
    desk.keeper.anew_reason = reason
    assert await desk.look(NOW + PLAN_S)
    assert [one.start_tai_s - NOW for one in desk.asked[-1][3]] == pytest.approx(starts_s)


async def test_a_word_is_taken_at_the_next_look_and_once(desk: Desk) -> None:
    await desk.keeper.first_plan()
    assert not await desk.look(NOW + 1.0)
    said = PassRequest("A", NOW + 50.0, Wish.EXCLUDE)
    desk.keeper.say(said, "a person")
    with capture_logs() as logs:
        assert await desk.look(NOW + 2.0)
    assert (desk.keeper.words.requests, desk.asked[-1][2], logs[-1]["reason"]) == ((said,), [said], WORD)
    assert not await desk.look(NOW + 3.0)


async def test_in_a_pass_words_are_read_every_five_seconds_and_they_alone_make_a_plan(desk: Desk) -> None:
    assert WORDS_S == 5.0
    await desk.keeper.first_plan()
    desk.keeper.anew_reason = "changed: station.toml"
    assert not await desk.look(NOW + 2.0 * PLAN_S, is_in_pass=True)
    desk.keeper.say(PassRequest("A", NOW + 50.0, Wish.EXCLUDE), "a person")
    assert not await desk.look(NOW + 2.0 * PLAN_S + WORDS_S - STEP_S, is_in_pass=True)
    with capture_logs() as logs:
        assert await desk.look(NOW + 2.0 * PLAN_S + WORDS_S, is_in_pass=True)
    assert (desk.keeper.words.requests, logs[-1]["reason"]) == (tuple(desk.asked[-1][2]), WORD)
    assert desk.asked[-1][1] == NOW + 2.0 * PLAN_S + WORDS_S
    assert not await desk.look(NOW + 2.0 * PLAN_S + 2.0 * WORDS_S, is_in_pass=True)
    desk.keeper.close()


async def test_in_a_pass_words_that_cannot_be_read_are_those_before(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    await desk.keeper.first_plan()

    def fail() -> Words:
        raise UsageError("locked")

    monkeypatch.setattr(desk.file, "words_beside", fail)
    assert not await desk.look(NOW + WORDS_S, is_in_pass=True)
    monkeypatch.undo()
    monkeypatch.setattr(schedule_keeper, "station_plan", desk._planned)
    desk.keeper.say(PassRequest("A", NOW + 50.0, Wish.EXCLUDE), "a person")
    assert await desk.look(NOW + 2.0 * WORDS_S, is_in_pass=True)


async def test_words_that_cannot_be_read_are_told_once_and_are_no_problem_once_they_can(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    await desk.keeper.first_plan()

    def fail() -> Words:
        raise UsageError("locked")

    with monkeypatch.context() as context, capture_logs() as logs:
        context.setattr(desk.file, "words", fail)
        assert not await desk.look(NOW + 1.0)
        assert not await desk.look(NOW + 2.0)
        assert desk.keeper.problem == "locked"
        desk.file.problem = "full"
        assert desk.keeper.problem == "full"
        desk.file.problem = ""
    assert logs == [{"event": "schedule.not_read", "reason": "locked", "log_level": "error"}]
    await desk.look(NOW + 3.0)
    assert desk.keeper.problem == ""


# What a plan leaves


async def test_a_satellite_that_cannot_be_used_is_told_once_for_each_reason(desk: Desk) -> None:
    told = []
    for omitted in ({"A": "x"}, {"A": "x"}, {"A": "y", "B": "x"}, {}, {"A": "y"}):
        with capture_logs() as logs:
            desk.keeper._take(replace(NO_PLAN, omitted=omitted))
        told.append([(one["satellite"], one["reason"]) for one in logs if one["event"] == "satellite.omitted"])
    assert told == [[("A", "x")], [], [("A", "y"), ("B", "x")], [], [("A", "y")]]


async def test_a_plan_is_saved_its_changes_are_told_and_what_is_granted_is_counted(desk: Desk) -> None:
    one, other, third = track("A", 1000.0), track("B", 3000.0, may_interrupt=True), track("C", 6000.0)
    desk.plan = lambda: StationPlan(
        (Decision(one, slot_of(one, NOW + 1000.0)), Decision(other, None, "no"), Decision(third, None, "no")),
        NOW + DAY_S,
        {},
    )
    await desk.keeper.first_plan()
    assert desk.keeper._interrupters == {"B"}
    assert [(entry.satellite, entry.state) for entry in desk.file.book(NOW)] == [
        ("A", PassState.PLANNED),
        ("B", PassState.REFUSED),
        ("C", PassState.REFUSED),
    ]
    with capture_logs() as logs:
        desk.keeper._take(StationPlan((Decision(other, slot_of(other, NOW + 3000.0)),), NOW + DAY_S, {}))
    said = [entry["what"] for entry in logs if entry["event"] == "schedule.changed"]
    assert [text.split(" of ")[0] for text in said] == ["B", "A"]
    assert [entry["granted"] for entry in logs if entry["event"] == "schedule.planned"] == [1]
    assert desk.saved(1).state is PassState.CANCELLED
    assert desk.tally.counts == {("passes", "cancelled"): 1}


@pytest.mark.parametrize("side", [-1, 0, 1])
@pytest.mark.parametrize(("start_s", "is_paused"), [(-STEP_S, True), (0.0, False)])
async def test_a_pass_that_a_pause_is_over_is_cancelled_when_half_of_it_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start_s: float, is_paused: bool, side: int
) -> None:
    desk = Desk(tmp_path, monkeypatch, numbered(PLANNED))
    until_tai_s = NOW + 890.0 - start_s
    desk.keeper.anew_reason, desk.keeper._planned_tai_s = "", NOW + 1100.0
    desk.keeper.words = Words((), until_tai_s)
    desk.keeper.pause(until_tai_s, "a person")
    await desk.look(NOW + 1200.0 + side * STEP_S)
    is_over = is_paused and side > 0
    assert desk.keeper.book[0].state is (PassState.CANCELLED if is_over else PassState.PLANNED)
    assert desk.keeper.book[0].reason == (f"paused by a person until {utc_text(until_tai_s, 0)}" if is_over else "")
    assert desk.saved().state is desk.keeper.book[0].state


# The book


@pytest.mark.parametrize(
    ("changes", "is_it"),
    [
        ({}, True),
        ({"state": PassState.REFUSED}, False),
        ({"state": PassState.PASS}, False),
        ({"end_tai_s": None}, False),
        ({"end_tai_s": NOW}, False),
        ({"end_tai_s": NOW + STEP_S}, True),
        ({"start_tai_s": NOW + 500.0 - STEP_S}, False),
        ({"start_tai_s": NOW + 500.0}, True),
        ({"start_tai_s": None}, False),
    ],
)
def test_the_next_pass_is_the_first_that_is_granted_not_over_and_under_no_pause(
    desk: Desk, changes: dict[str, Any], is_it: bool
) -> None:
    first, last = replace(PLANNED, **changes), replace(PLANNED, satellite="B")
    desk.keeper.words = Words((), NOW + 500.0)
    desk.keeper.book = (first, last)
    assert desk.keeper.coming() == (first if is_it else last)
    desk.keeper.book = (first,)
    assert desk.keeper.coming() == (first if is_it else None)


def test_without_a_pause_one_of_which_no_start_is_known_comes_too(desk: Desk) -> None:
    assert desk.keeper.words.pause_until_tai_s == NO_PAUSE
    desk.keeper.book = (replace(PLANNED, start_tai_s=None),)
    assert desk.keeper.coming() == desk.keeper.book[0]


def test_the_next_three_granted_passes_are_shown_from_their_rise_on(desk: Desk) -> None:
    book = [replace(PLANNED, satellite=f"S{at}", rise_tai_s=NOW + 100.0 * at, number=at) for at in range(1, 6)]
    book.insert(2, replace(book[2], state=PassState.REFUSED, satellite="R"))
    desk.keeper.book = tuple(book)

    def shown(after_tai_s: float) -> tuple[str, ...]:
        return desk.keeper.next_passes(after_tai_s)

    assert shown(NOW) == tuple(next_text(f"S{at}", NOW + 100.0 * at, 40.0) for at in (1, 2, 3))
    assert shown(NOW + 100.0 - STEP_S) == shown(NOW)
    assert shown(NOW + 100.0) == tuple(next_text(f"S{at}", NOW + 100.0 * at, 40.0) for at in (2, 3, 4))
    assert shown(NOW + 500.0) == ()


@pytest.mark.parametrize("state", list(PassState))
def test_a_change_is_of_one_pass_alone_is_saved_and_counted_where_it_is_the_end(desk: Desk, state: PassState) -> None:
    one, other = desk.keeper.book = numbered(PLANNED, replace(PLANNED, satellite="B"))
    changed = desk.keeper.change(one, state, "why")
    assert changed == replace(one, state=state, reason="why")
    assert desk.keeper.book == (changed, other)
    assert desk.saved() == changed
    is_over = state.value in ("done", "degraded", "failed", "missed", "cancelled")
    assert desk.tally.counts == ({("passes", state.value): 1} if is_over else {})


def test_a_disk_that_refuses_is_told_once_for_each_reason(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    problems = iter(["full", "full", "gone", "", "full"])

    def save(*_: object) -> None:
        desk.file.problem = next(problems)

    monkeypatch.setattr(desk.file, "save", save)
    with capture_logs() as logs:
        for _ in range(5):
            desk.keeper.change(PLANNED, PassState.PLANNED, "")
    assert [(one["event"], one["reason"]) for one in logs] == [
        ("schedule.not_saved", why) for why in ("full", "gone", "full")
    ]


async def test_what_runs_beside_the_loop_ends_with_the_keeper_and_the_file_is_closed(desk: Desk) -> None:
    desk.keeper.look_in_pass(NOW)
    desk.keeper.look(NOW)
    hearing, planning = desk.keeper._hearing, desk.keeper._planning
    assert hearing is not None
    assert planning is not None
    desk.keeper.close()
    await asyncio.gather(hearing, planning, return_exceptions=True)
    assert hearing.cancelled()
    assert planning.cancelled()
    with pytest.raises(UsageError, match="closed"):
        desk.file.words()


async def test_words_and_passes_say_when_and_by_whom(desk: Desk) -> None:
    desk.now_tai_s = NOW + 7.0
    desk.keeper.say(PassRequest("A", NOW + 50.0, Wish.FORCE), "ann")
    desk.keeper.pause(NOW + 60.0, "ben")
    rows = [
        *desk.file._db.execute("select * from requests").fetchall(),
        *desk.file._db.execute("select * from pauses").fetchall(),
    ]
    assert rows == [("A", NOW + 50.0, str(Wish.FORCE), NOW + 7.0, "ann"), (NOW + 60.0, NOW + 7.0, "ben")]


# For which pass one in progress is given up

RUNNING = Entry(
    "A", 1000.0, 1300.0, 1600.0, 40.0, 5, PassState.PASS, "", start_tai_s=1000.0, end_tai_s=1600.0, number=1
)
COMING = Entry(
    "B", 1200.0, 1500.0, 1800.0, 40.0, 6, PassState.PLANNED, "", start_tai_s=1210.0, end_tai_s=1800.0, number=2
)
LEAD_S = 30.0


@pytest.fixture
def keeper(desk: Desk) -> ScheduleKeeper:
    """In mid-pass, with one coming that may interrupt."""
    desk.now_tai_s = 1100.0
    desk.keeper.book, desk.keeper._interrupters = (RUNNING, COMING), frozenset({"B"})
    return desk.keeper


@pytest.mark.parametrize(("priority", "interrupts"), [(4, False), (5, False), (6, True)])
def test_one_of_a_higher_priority_alone_interrupts(keeper: ScheduleKeeper, priority: int, interrupts: bool) -> None:
    keeper.book = (RUNNING, coming := replace(COMING, priority=priority))
    assert keeper.interrupter(RUNNING, 1200.0, LEAD_S) == (coming if interrupts else None)


def test_one_whose_file_says_nothing_of_it_does_not(keeper: ScheduleKeeper) -> None:
    keeper._interrupters = frozenset({"A"})
    assert keeper.interrupter(RUNNING, 1200.0, LEAD_S) is None


@pytest.mark.parametrize(("now_tai_s", "is_due"), [(1180.0 - STEP_S, False), (1180.0, True), (1300.0, True)])
def test_it_does_so_from_its_lead_before_its_reservation(
    keeper: ScheduleKeeper, now_tai_s: float, is_due: bool
) -> None:
    assert keeper.interrupter(RUNNING, now_tai_s, LEAD_S) == (COMING if is_due else None)


@pytest.mark.parametrize(("set_tai_s", "is_due"), [(1210.0, False), (1210.0 + STEP_S, True)])
def test_one_that_begins_after_the_set_waits_for_it(keeper: ScheduleKeeper, set_tai_s: float, is_due: bool) -> None:
    assert keeper.interrupter(replace(RUNNING, set_tai_s=set_tai_s), 1205.0, LEAD_S) == (COMING if is_due else None)


def test_one_that_was_not_granted_does_not(keeper: ScheduleKeeper) -> None:
    keeper.book = (RUNNING, replace(COMING, state=PassState.REFUSED, start_tai_s=None))
    assert keeper.interrupter(RUNNING, 1200.0, LEAD_S) is None
