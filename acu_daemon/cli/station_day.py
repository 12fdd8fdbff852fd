"""`acu-daemon run` without a satellite: the station, pass after pass, by its schedule (docs/schedule.md).

+--> rest: one poll a second; plan, look at files, weather and wind; check at T-5 min and T-60 s
|      |  a granted pass is due                      |  the wind is strong, or [schedule] after
|      v                                             v
+--- pass: the daemon of one pass                  move: to the park position, or to the next rise
"""

import asyncio
import contextlib
import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.cli.check import findings
from acu_daemon.cli.check_finding import NO_GO
from acu_daemon.cli.elements_watch import keep_confirmed
from acu_daemon.cli.options import Target, coming_pass, load_target, longest_lead
from acu_daemon.cli.run_setup import SHOWN_COUNT, next_text
from acu_daemon.cli.schedule_plan import StationPlan, station_plan
from acu_daemon.cli.station_wind import Beside, StationWind
from acu_daemon.config.load import load_station
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.tick_input import PassPlan, StowBy
from acu_daemon.daemon.service import Outcome
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.elements_choice import ElementsSources
from acu_daemon.edge.elements_fetching import ElementsFetching
from acu_daemon.edge.hooks import Hook, Hooks
from acu_daemon.edge.schedule_file import ScheduleFile, Words
from acu_daemon.errors import AcuDaemonError
from acu_daemon.model import Pass
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import UNDER_WAY, Entry, PassState, merged
from acu_daemon.schedule.exact_plan import Slot
from acu_daemon.schedule.rules import PassRequest, Wish
from acu_daemon.units import DAY_S

PLAN_S = 600.0  # from plan to plan where nothing has changed
FILES_S = 5.0  # from look to look at the files
CHECKS_S = (300.0, 60.0)  # before the rise
AGAIN_S = 15.0  # a no-go is tried again
DEGRADED_SHARE = 0.5  # of the useful seconds with the signal
SPARE_S = 5.0  # for the start of a pass' run
MOVE_S = 60.0  # so much longer than reckoned a move may take
RESUMED = "gone on with after a restart"
WORD = "a person's word"
FAR_S = 3600.0  # when the pass of a move "rises"


@dataclass(slots=True)
class Tracked:
    """What was seen of the pass that is on."""

    locked_s: float = 0.0
    on_path_s: float = 0.0
    is_told_of_signal: bool = True
    was_acquired: bool = False
    last_tai_s: float = math.nan
    words: str = ""


class StationDay:
    """Decides what the station does next.  Owned by the loop; planning and checking go on beside it, in threads."""

    def __init__(
        self,
        config: Path,
        clock: Clock,
        file: ScheduleFile,
        station: StationFile,
        *,
        beside: Beside = asyncio.to_thread,
        check: Callable[[str, float], list[str]] | None = None,
        is_rehearsal: bool = False,
    ) -> None:
        """beside: does what takes long, beside the loop.  check: what of a pass is a no-go; None: files and ACU."""
        self.station = station
        self._findings = check or self._no_gos
        self._beside, self._is_rehearsal = beside, is_rehearsal
        self._config, self._clock, self._file = config, clock, file
        now_tai_s = clock.tai_s()
        self._book = tuple(_resumed(one, now_tai_s) for one in file.book(now_tai_s - DAY_S))
        self._next_number = file.next_number()
        self._frozen: dict[int, Slot] = {}
        self._words = Words()
        self._stamp: dict[str, tuple[int, ...]] = {}
        self._omitted: dict[str, str] = {}
        self._stamp_tai_s = self._planned_tai_s = -math.inf
        self._planning: asyncio.Task[StationPlan] | None = None
        self._checking: asyncio.Task[list[str]] | None = None
        self._checked: tuple[int, float] = (0, math.inf)  # number of the entry, seconds before its rise
        self._no_go = ""
        self._again_tai_s = -math.inf
        self._good: dict[str, Target] = {}
        self._tracked = Tracked()
        self._alarms: frozenset[str] = frozenset()
        self._log: Any = structlog.get_logger("station")
        self.hooks = Hooks(station.hooks.commands, station.hooks.time_limit_s)
        self.wind = StationWind(station.wind, config, beside)
        self.stow_by = StowBy.NOBODY
        self.fetching = ElementsFetching(config, station.elements, clock, is_rehearsal=is_rehearsal)
        self.entry: Entry | None = None  # the pass that is on
        self.reload_reason = "the start"

    # Plan

    def why_not_unstow(self) -> str:
        """Why a person may not end the stow now; empty: it is ended."""
        if why := self.wind.why_not_unstow(self.stow_by):
            return why
        self.wind.let_go()
        return ""

    def ask_reload(self) -> str:
        """Have files and elements read again, between passes."""
        self.reload_reason = "a person asked"
        return "ok reload: " + ("after this pass" if self.entry else "now")

    async def first_plan(self) -> None:
        """Plan before anything else.  Raises: ConfigError: of station.toml."""
        self._words = self._file.words()
        plan = await self._beside(self._plan, self._clock.tai_s())
        self._take(plan)

    def _plan(self, now_tai_s: float) -> StationPlan:
        resumed = [
            PassRequest(one.satellite, one.culmination_tai_s, Wish.FORCE) for one in self._book if one.reason == RESUMED
        ]
        frozen = () if self.reload_reason == WORD else tuple(self._frozen.values())  # a word moves what is frozen too
        return station_plan(self._config, now_tai_s, requests=[*resumed, *self._words.requests], frozen=frozen)

    def _take(self, plan: StationPlan) -> None:
        now_tai_s = self._clock.tai_s()
        self._planned_tai_s = now_tai_s
        for name, reason in plan.omitted.items():
            if self._omitted.get(name) != reason:
                self._log.warning("satellite.omitted", satellite=name, reason=reason)
        self._omitted = plan.omitted
        result = merged(self._book, plan.decisions, now_tai_s, plan.until_tai_s, self._next_number)
        self._book = result.book
        self._next_number = max([self._next_number, *(one.number + 1 for one in result.book)])
        self._save(result.changed)
        for said in result.said:
            self._log.info("schedule.changed", what=said)
        freeze_tai_s = now_tai_s + self.station.schedule.freeze_s
        slots = [decision.slot for decision in plan.decisions if decision.slot is not None]
        self._frozen = {id(one.track): one for one in slots if now_tai_s < one.start_tai_s < freeze_tai_s}
        granted = sum(one.state is PassState.PLANNED for one in self._book)
        self._log.info("schedule.planned", granted=granted, reason=self.reload_reason or "as always")
        self.reload_reason = ""

    def _save(self, entries: tuple[Entry, ...] | list[Entry]) -> None:
        before = self._file.problem
        self._file.save(entries, self._clock.tai_s())
        if self._file.problem and self._file.problem != before:
            self._log.error("schedule.not_saved", reason=self._file.problem)

    @property
    def problem(self) -> str:
        """What of the schedule cannot be written."""
        return self._file.problem

    # Rest

    def look(self) -> str:
        """Look, once a second between passes, at all that may change; why the rest ends, empty: it does not."""
        now_tai_s = self._clock.tai_s()
        self.fetching.look()
        self._look_at_words()
        self._look_at_files(now_tai_s)
        self._go_on_planning(now_tai_s)
        return self._due(now_tai_s)

    def _look_at_words(self) -> None:
        words = self._file.words()
        if words != self._words:
            self._words = words
            self.reload_reason = WORD

    def _look_at_files(self, now_tai_s: float) -> None:
        if now_tai_s - self._stamp_tai_s < FILES_S:
            return
        self._stamp_tai_s = now_tai_s
        stamp = _stamp(self._config, self._good.values())
        if changed := [path for path, one in stamp.items() if self._stamp.get(path, one) != one]:
            self.reload_reason = self.reload_reason or f"changed: {', '.join(changed)}"
        elif self._stamp and len(stamp) < len(self._stamp):
            self.reload_reason = self.reload_reason or "a file has gone"
        self._stamp = stamp

    def _go_on_planning(self, now_tai_s: float) -> None:
        if self._planning is not None:
            if self._planning.done():
                done, self._planning = self._planning, None
                try:
                    self._take(done.result())
                except AcuDaemonError as error:
                    self._log.error("schedule.kept", reason=str(error))
                    self.reload_reason, self._planned_tai_s = "", now_tai_s
            return
        if not self.reload_reason and now_tai_s - self._planned_tai_s < PLAN_S:
            return
        if self.reload_reason:
            try:
                self.station = load_station(self._config)
                self.wind.section = self.station.wind
            except AcuDaemonError as error:
                self._log.error("config.kept", reason=str(error), in_force="what was read before")
                self.reload_reason, self._planned_tai_s = "", now_tai_s
                return
        self._planning = asyncio.create_task(self._beside(self._plan, now_tai_s), name="plan")

    def coming(self) -> Entry | None:
        """The next granted pass that no pause is over."""
        now_tai_s = self._clock.tai_s()
        for one in self._book:
            is_open = one.state is PassState.PLANNED and one.end_tai_s is not None and one.end_tai_s > now_tai_s
            if is_open and (one.start_tai_s or 0.0) >= self._words.pause_until_tai_s:
                return one
        return None

    def next_passes(self, after_tai_s: float) -> tuple[str, ...]:
        """The granted passes that begin after a time, in words."""
        later = [one for one in self._book if one.state is PassState.PLANNED and one.rise_tai_s > after_tai_s]
        return tuple(next_text(one.satellite, one.rise_tai_s, one.culmination_el_deg) for one in later[:SHOWN_COUNT])

    def _due(self, now_tai_s: float) -> str:
        entry = self.coming()
        if entry is None or entry.start_tai_s is None or entry.end_tai_s is None:
            return ""
        before_s = entry.start_tai_s - now_tai_s
        self._check(entry, before_s, now_tai_s)
        if before_s > self._lead_s(entry) or self._checking is not None or now_tai_s < self._again_tai_s:
            return ""
        if self.wind.seen.wants_stow:
            return self._refuse(entry, now_tai_s, self.wind.seen.words)
        if self.stow_by not in (StowBy.NOBODY, StowBy.SCHEDULE):
            return self._refuse(entry, now_tai_s, f"stowed by the {self.stow_by}")
        if self._no_go:
            return self._refuse(entry, now_tai_s, self._no_go)
        return f"{entry.name} begins"

    def _lead_s(self, entry: Entry) -> float:
        target = self._good.get(entry.satellite)
        lead_s = self.station.tracking.preposition_s if target is None else longest_lead(target)
        return max(lead_s, self.station.schedule.pre_s) + SPARE_S + self.station.hooks.before_move_s

    def _check(self, entry: Entry, before_s: float, now_tai_s: float) -> None:
        """Have the pass checked at its times, and again where it was a no-go."""
        if self._checking is not None:
            if self._checking.done():
                done, self._checking = self._checking, None
                self._no_go = "; ".join(done.result())
                if self._no_go:
                    self._log.warning("check.no_go", entry=entry.name, reason=self._no_go)
                    self.hooks.call(Hook.ON_NO_GO, self.about(entry) | {"reason": self._no_go})
            return
        number, checked_s = self._checked
        if number != entry.number:
            checked_s = math.inf
            self._no_go = ""
        is_time = any(before_s <= at_s < checked_s for at_s in CHECKS_S)
        is_again = bool(self._no_go) and now_tai_s >= self._again_tai_s
        if is_time or is_again:
            self._checked = (entry.number, before_s)
            self._checking = asyncio.create_task(self._beside(self._findings, entry.satellite, now_tai_s), name="check")

    def _no_gos(self, satellite: str, now_tai_s: float) -> list[str]:
        return [
            f"{one.what}: {one.detail}"
            for one in findings(self._config, satellite, now_tai_s, self._file.path.parent)
            if one.verdict == NO_GO
        ]

    def _refuse(self, entry: Entry, now_tai_s: float, reason: str) -> str:
        """Try again until half of the pass is gone; then it has failed."""
        self._again_tai_s = now_tai_s + AGAIN_S
        half_tai_s = (entry.rise_tai_s + entry.set_tai_s) / 2.0
        if now_tai_s > half_tai_s:
            self._change(entry, PassState.FAILED, f"not begun: {reason}")
            self.hooks.call(Hook.AFTER_PASS, self.about(entry) | {"state": "failed", "reason": reason})
        return ""

    # Pass

    def begin(self, entry: Entry) -> tuple[Target, Pass]:
        """What the run of a pass needs.  Raises: AcuDaemonError: it cannot begin, now at least."""
        now_tai_s = self._clock.tai_s()
        at_tai_s = max(entry.rise_tai_s, now_tai_s)
        try:
            target = load_target(
                self._config, entry.satellite, now_tai_s, at_tai_s=at_tai_s, folders=(self._file.path.parent,)
            )
            self._good[entry.satellite] = target
            keep_confirmed(self._config, target)
        except AcuDaemonError as error:
            if entry.satellite not in self._good:
                raise
            target = self._good[entry.satellite]
            self._log.error("config.kept", satellite=entry.satellite, reason=str(error))
        return target, coming_pass(target, max(now_tai_s, entry.rise_tai_s - 60.0))

    def cannot_begin(self, entry: Entry, reason: str) -> None:
        """The files of a pass are refused."""
        self._no_go = reason
        self._log.warning("check.no_go", entry=entry.name, reason=reason)
        self.hooks.call(Hook.ON_NO_GO, self.about(entry) | {"reason": reason})
        self._refuse(entry, self._clock.tai_s(), reason)

    def begun(self, entry: Entry) -> None:
        """The run of a pass begins."""
        self._tracked = Tracked()
        self._again_tai_s = -math.inf
        self.entry = self._change(entry, PassState.PREPASS, "")
        self.hooks.call(Hook.BEFORE_PASS, self.about(entry))
        self.hooks.call(Hook.DURING_PASS, self.about(entry))

    def see(self, seen: Snapshot) -> None:
        """Take the newest snapshot, of a pass or between passes."""
        self.stow_by = StowBy(seen.stow_by)
        if self.entry is not None and seen.stow_by:
            self._tracked.words = f"stowed by the {seen.stow_by}"
        new_alarms = frozenset(alarms(seen)) - self._alarms
        self._alarms = frozenset(alarms(seen))
        if new_alarms:
            about = {"alarms": sorted(new_alarms)} | (self.about(self.entry) if self.entry else {})
            self.hooks.call(Hook.ON_ALARM, about)
        for result in self.hooks.take_results():
            if self.entry is not None and not result.is_good:
                self._tracked.words = f"hook {result.hook}: {result.problem}"
        entry, tracked = self.entry, self._tracked
        if entry is None:
            return
        if entry.state is PassState.PREPASS and seen.rise_in_s is not None and seen.rise_in_s <= 0.0:
            self.entry = entry = self._change(entry, PassState.PASS, "")
        tracked.is_told_of_signal = seen.is_told_of_signal
        if not math.isnan(tracked.last_tai_s):
            tracked.locked_s += (seen.tai_s - tracked.last_tai_s) * seen.is_acquired
            is_on_path = entry.state is PassState.PASS and seen.is_on_path is True
            tracked.on_path_s += (seen.tai_s - tracked.last_tai_s) * is_on_path
        tracked.last_tai_s = seen.tai_s
        if seen.is_acquired != tracked.was_acquired:
            tracked.was_acquired = seen.is_acquired
            self.hooks.call(Hook.AT_LOCK if seen.is_acquired else Hook.AT_LOSS, self.about(entry))

    def ended(self, outcome: Outcome | None, reason: str = "") -> None:
        """The run of a pass is over; outcome None: it ended by an error, the reason."""
        entry = self.entry
        if entry is None:
            return
        self._change(entry, PassState.POSTPASS, "")
        state, why = self._judged(entry, outcome, reason)
        changed = self._change(entry, state, why)
        self.hooks.end_during()
        about = self.about(changed) | {"state": str(state), "reason": why, "locked_s": round(self._tracked.locked_s, 1)}
        self.hooks.call(Hook.AFTER_PASS, about)
        self._log.info("pass.done", entry=changed.name, state=str(state), reason=why)
        self.entry = None

    def _judged(self, entry: Entry, outcome: Outcome | None, reason: str) -> tuple[PassState, str]:
        if outcome is None:
            return PassState.FAILED, reason
        if not self._tracked.is_told_of_signal:
            return self._judged_by_path(entry)
        locked_s, share = self._tracked.locked_s, 0.0
        if entry.useful_s > 0.0:
            share = locked_s / entry.useful_s
        if not outcome.has_acquired and locked_s == 0.0:
            cause = "; ".join(sorted(self._alarms)) or "no signal: the satellite was silent, or not where it should be"
            return PassState.FAILED, f"never acquired: {self._tracked.words or cause}"
        said = f"signal for {locked_s:.0f} of {entry.useful_s:.0f} useful seconds"
        state = PassState.DEGRADED if share < DEGRADED_SHARE else PassState.DONE
        return state, "; ".join(text for text in (said, self._tracked.words) if text)

    def _judged_by_path(self, entry: Entry) -> tuple[PassState, str]:
        """Of a station that is told of no signal: whether the antenna was where the satellite should be."""
        on_path_s = self._tracked.on_path_s
        said = f"by program track, on the path for {on_path_s:.0f} of {entry.useful_s:.0f} useful seconds"
        if on_path_s == 0.0:
            return PassState.FAILED, "; ".join(sorted(self._alarms)) or "the antenna never came to the path"
        is_degraded = on_path_s < DEGRADED_SHARE * entry.useful_s
        return PassState.DEGRADED if is_degraded else PassState.DONE, said

    def _change(self, entry: Entry, state: PassState, reason: str) -> Entry:
        changed = replace(entry, state=state, reason=reason)
        self._book = tuple(changed if one.number == entry.number else one for one in self._book)
        self._save([changed])
        return changed

    def about(self, entry: Entry) -> dict[str, Any]:
        """What hooks are told."""
        return {
            "station": self.station.station.name,
            "satellite": entry.satellite,
            "rise_utc": utc_text(entry.rise_tai_s),
            "set_utc": utc_text(entry.set_tai_s),
            "culmination_el_deg": round(entry.culmination_el_deg, 2),
            "priority": entry.priority,
            "is_rehearsal": self._is_rehearsal,
        }

    # Between passes

    def place_after(self) -> tuple[float, float] | None:
        """Where the antenna waits after a pass, azimuth and elevation; None: where it is."""
        rules, entry = self.station.schedule, self.coming()
        near_s = math.inf if entry is None or entry.start_tai_s is None else entry.start_tai_s - self._clock.tai_s()
        if rules.after == "park" and near_s > rules.next_within_s:
            return rules.park_az_deg, rules.park_el_deg
        return None

    async def close(self) -> None:
        """End what runs beside the loop."""
        self.hooks.end_during()
        await self.hooks.close()
        await self.fetching.close()
        self.wind.close()
        for task in (self._planning, self._checking):
            if task is not None:
                task.cancel()
        self._file.close()


def move_to(az_deg: float, el_deg: float, now_tai_s: float) -> PassPlan:
    """A plan that only leads to a place."""
    return PassPlan(now_tai_s + FAR_S, now_tai_s + 2.0 * FAR_S, now_tai_s + FAR_S, az_deg, el_deg)


def _resumed(entry: Entry, now_tai_s: float) -> Entry:
    """A pass that was on when the daemon was killed is gone on with."""
    is_on = entry.state in UNDER_WAY and entry.end_tai_s is not None and entry.end_tai_s > now_tai_s
    return replace(entry, state=PassState.PLANNED, reason=RESUMED) if is_on else entry


def _stamp(config: Path, targets: Collection[Target]) -> dict[str, tuple[int, ...]]:
    """What changes when a file of the configuration does, by file."""
    paths = [config / "station.toml", *sorted((config / "satellites").glob("*.toml"))]
    names = (getattr(target.satellite.elements, "file", "") for target in targets)
    paths += [config / "satellites" / name for name in names if name]
    for target in targets:
        sources, norad_id = ElementsSources.of(config, target.station.elements), target.satellite.satellite.norad_id
        if sources is not None and norad_id is not None:
            paths += sources.files(norad_id)
    found: dict[str, tuple[int, ...]] = {}
    for path in paths:
        with contextlib.suppress(OSError):
            stat = path.stat()
            found[path.name] = (stat.st_mtime_ns, stat.st_size, stat.st_ino)
    return found
