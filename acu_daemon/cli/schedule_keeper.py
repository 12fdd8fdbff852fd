"""The station's schedule while it runs: planned anew beside the loop, with the book of passes and people's words."""

import asyncio
import math
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.cli.run_setup import SHOWN_COUNT, next_text
from acu_daemon.cli.schedule_plan import StationPlan, station_plan
from acu_daemon.cli.station_wind import Beside
from acu_daemon.config.load import load_station
from acu_daemon.config.station_tables import StationFile
from acu_daemon.daemon.tally import Tally
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.schedule_file import ScheduleFile, Words
from acu_daemon.errors import AcuDaemonError, UsageError, failure_text
from acu_daemon.schedule.book import OVER, UNDER_WAY, Entry, PassState, merged, paused
from acu_daemon.schedule.decisions import RESUMED
from acu_daemon.schedule.exact_plan import Slot
from acu_daemon.schedule.rules import PassRequest, Wish
from acu_daemon.units import DAY_S

PLAN_S = 600.0  # from plan to plan where nothing has changed
WORDS_S = 5.0  # from look to look at people's words while a pass is on
WORD = "a person's word"


class ScheduleKeeper:
    """Owned by the loop; planning goes on beside it.  anew_reason: why it is to plan at once, empty: it need not."""

    def __init__(
        self, config: Path, clock: Clock, file: ScheduleFile, station: StationFile, beside: Beside, tally: Tally
    ) -> None:
        self.station = station
        self._tally = tally
        self.anew_reason = "the start"
        self.words = Words()
        self._config, self._clock, self._file, self._beside = config, clock, file, beside
        now_tai_s = clock.tai_s()
        self.book = tuple(_resumed(one, now_tai_s) for one in file.book(now_tai_s - DAY_S))
        self._next_number = file.next_number()
        self._frozen: dict[int, Slot] = {}
        self._omitted: dict[str, str] = {}
        self._planned_tai_s = -math.inf
        self._planning: asyncio.Task[StationPlan] | None = None
        self._hearing: asyncio.Task[Words] | None = None
        self._heard_tai_s = -math.inf
        self._unread = ""  # why people's words cannot be read
        self._interrupters: frozenset[str] = frozenset()  # satellites that may interrupt
        self._log: Any = structlog.get_logger("station")

    @property
    def problem(self) -> str:
        """What of the schedule cannot be written, or read."""
        return self._file.problem or self._unread

    def close(self) -> None:
        """End what runs beside the loop."""
        for task in (self._planning, self._hearing):
            if task is not None:
                task.cancel()
        self._file.close()

    # Plan

    async def first_plan(self) -> None:
        """Plan before anything else.  Raises: ConfigError: of station.toml."""
        self.words = self._file.words()
        plan = await self._beside(self._plan, self._clock.tai_s())
        self._take(plan)

    def look(self, now_tai_s: float) -> None:
        """Look at people's words, and plan anew where it is time; the new plan is taken at a later look."""
        words = self._read_words()
        if words != self.words:
            self.words = words
            self.anew_reason = WORD
        self._cancel_paused(now_tai_s)
        if self._planning is not None:
            self._take_done(now_tai_s)
            return
        if not self.anew_reason and now_tai_s - self._planned_tai_s < PLAN_S:
            return
        if self.anew_reason:
            try:
                self.station = load_station(self._config)
            except AcuDaemonError as error:
                self._log.error("config.kept", reason=str(error), in_force="what was read before")
                self._put_off(now_tai_s)
                return
        self._planning = asyncio.create_task(self._beside(self._plan, now_tai_s), name="plan")

    def _read_words(self) -> Words:
        """What people said; where it cannot be read, what they had said before."""
        before, self._unread = self._unread, ""
        try:
            return self._file.words()
        except UsageError as error:
            self._unread = str(error)
            if self._unread != before:
                self._log.error("schedule.not_read", reason=self._unread)
            return self.words

    def look_in_pass(self, now_tai_s: float) -> None:
        """Look at people's words, beside the loop; by them alone it is planned anew while a pass is on."""
        if self._planning is not None:
            self._take_done(now_tai_s)
            return
        if self._hearing is None:
            if now_tai_s - self._heard_tai_s >= WORDS_S:
                self._heard_tai_s = now_tai_s
                self._hearing = asyncio.create_task(self._beside(self._file.words_beside), name="words")
            return
        if not self._hearing.done():
            return
        done, self._hearing = self._hearing, None
        if done.exception() is None and (words := done.result()) != self.words:
            self.words = words
            self.anew_reason = WORD
            self._planning = asyncio.create_task(self._beside(self._plan, now_tai_s), name="plan")

    def _take_done(self, now_tai_s: float) -> None:
        if self._planning is None or not self._planning.done():
            return
        done, self._planning = self._planning, None
        try:
            self._take(done.result())
        except Exception as error:  # noqa: BLE001  whatever spoils a plan, the one before it holds
            self._log.error("schedule.kept", reason=failure_text(error))
            self._put_off(now_tai_s)

    def interrupter(self, running: Entry, now_tai_s: float, lead_s: float) -> Entry | None:
        """The pass for which that in progress is given up now: granted, of a higher priority, and its file says so."""
        entry = self.coming()
        if entry is None or entry.start_tai_s is None or entry.satellite not in self._interrupters:
            return None
        is_due = entry.start_tai_s - lead_s <= now_tai_s and entry.start_tai_s < running.set_tai_s
        return entry if is_due and entry.priority > running.priority else None

    def _cancel_paused(self, now_tai_s: float) -> None:
        """Of a pass that a pause is over, and of which half is gone, nothing is tracked any more."""
        gone = [one for one in self.book if (one.rise_tai_s + one.set_tai_s) / 2.0 < now_tai_s]
        for one in gone:
            if (after := paused(one, self.words.pause_until_tai_s)) is not one:
                self.change(one, after.state, after.reason)

    def _put_off(self, now_tai_s: float) -> None:
        self.anew_reason, self._planned_tai_s = "", now_tai_s

    def _plan(self, now_tai_s: float) -> StationPlan:
        resumed = [PassRequest(one.satellite, one.culmination_tai_s, Wish.GO_ON) for one in self.book if one.is_resumed]
        frozen = () if self.anew_reason == WORD else tuple(self._frozen.values())  # a word moves what is frozen too
        return station_plan(self._config, now_tai_s, requests=[*resumed, *self.words.requests], frozen=frozen)

    def _take(self, plan: StationPlan) -> None:
        now_tai_s = self._clock.tai_s()
        self._planned_tai_s = now_tai_s
        for name, reason in plan.omitted.items():
            if self._omitted.get(name) != reason:
                self._log.warning("satellite.omitted", satellite=name, reason=reason)
        self._omitted = plan.omitted
        tracks = (decision.track for decision in plan.decisions)
        self._interrupters = frozenset(one.satellite for one in tracks if one.rules.may_interrupt)
        result = merged(self.book, plan.decisions, now_tai_s, plan.until_tai_s, self._next_number)
        self.book = result.book
        self._next_number = max([self._next_number, *(one.number + 1 for one in result.book)])
        self._save(result.changed)
        for said in result.said:
            self._log.info("schedule.changed", what=said)
        freeze_tai_s = now_tai_s + self.station.schedule.freeze_s
        slots = [decision.slot for decision in plan.decisions if decision.slot is not None]
        self._frozen = {id(one.track): one for one in slots if now_tai_s < one.start_tai_s < freeze_tai_s}
        granted = sum(one.state is PassState.PLANNED for one in self.book)
        self._log.info("schedule.planned", granted=granted, reason=self.anew_reason or "as always")
        self.anew_reason = ""

    # Book

    def coming(self) -> Entry | None:
        """The next granted pass that no pause is over."""
        now_tai_s = self._clock.tai_s()
        for one in self.book:
            is_open = one.state is PassState.PLANNED and one.end_tai_s is not None and one.end_tai_s > now_tai_s
            if is_open and (one.start_tai_s or 0.0) >= self.words.pause_until_tai_s:
                return one
        return None

    def next_passes(self, after_tai_s: float) -> tuple[str, ...]:
        """The granted passes that begin after a time, in words."""
        later = [one for one in self.book if one.state is PassState.PLANNED and one.rise_tai_s > after_tai_s]
        return tuple(next_text(one.satellite, one.rise_tai_s, one.culmination_el_deg) for one in later[:SHOWN_COUNT])

    def say(self, request: PassRequest, who: str) -> None:
        """Take a person's word about a pass; it is planned anew by it."""
        self._file.say(request, self._clock.tai_s(), who)

    def pause(self, until_tai_s: float, who: str) -> None:
        """Begin no pass until a time; NO_PAUSE ends a pause."""
        self._file.pause(until_tai_s, self._clock.tai_s(), who)

    def change(self, entry: Entry, state: PassState, reason: str) -> Entry:
        """Put a pass into another state, and save it."""
        changed = replace(entry, state=state, reason=reason)
        self.book = tuple(changed if one.number == entry.number else one for one in self.book)
        self._save([changed])
        return changed

    def _save(self, entries: Collection[Entry]) -> None:
        for one in entries:
            if one.state in OVER:
                self._tally.count("passes", str(one.state))
        before = self._file.problem
        self._file.save(entries, self._clock.tai_s())
        if self._file.problem and self._file.problem != before:
            self._log.error("schedule.not_saved", reason=self._file.problem)


def _resumed(entry: Entry, now_tai_s: float) -> Entry:
    """A pass that was on when the daemon was killed is gone on with."""
    is_on = entry.state in UNDER_WAY and entry.end_tai_s is not None and entry.end_tai_s > now_tai_s
    return replace(entry, state=PassState.PLANNED, reason=RESUMED) if is_on else entry
