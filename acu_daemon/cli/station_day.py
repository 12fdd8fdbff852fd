"""`acu-daemon run` without a satellite: the station, pass after pass, by its schedule (docs/schedule.md).

+--> rest: one poll a second; plan, look at files, weather and wind; check at T-5 min and T-60 s
|      |  a granted pass is due                      |  [schedule] after
|      v                                             v
+--- pass: the daemon of one pass                  move: to the park position, or to the next rise; or the stow
"""

import asyncio
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.check import findings
from acu_daemon.cli.check_finding import NO_GO
from acu_daemon.cli.check_hooks import HOOKS
from acu_daemon.cli.configuration_watch import ConfigurationWatch
from acu_daemon.cli.elements_watch import keep_confirmed
from acu_daemon.cli.next_rise import NextRise
from acu_daemon.cli.options import Target, coming_pass, load_target, longest_lead
from acu_daemon.cli.pass_checks import Check, PassChecks
from acu_daemon.cli.pass_course import PassCourse
from acu_daemon.cli.phantom_check import PhantomCheck
from acu_daemon.cli.schedule_keeper import ScheduleKeeper
from acu_daemon.cli.station_wind import Beside, StationWind
from acu_daemon.config.station_day_tables import HooksSection
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.tick_input import StowBy, StowWish
from acu_daemon.control.tracking.approach import longest_lead_s
from acu_daemon.daemon.snapshot import Snapshot, StationFacts
from acu_daemon.daemon.tally import Tally
from acu_daemon.edge.apart import apart
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.elements_fetching import ElementsFetching
from acu_daemon.edge.hook_rights import chosen_user
from acu_daemon.edge.hooks import Hook, Hooks
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.model import Pass
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import Entry, PassState

STOW_SEEN_S = 3.0  # after STOW the status shows it, or it is not sent
SPARE_S = 5.0  # for the start of a pass' run
BEGINS = " begins"  # behind a pass' name: why a run ends


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
        fly_beside: Beside = apart,
        acu: str | None = None,
        check: Check | None = None,
        has_phantom: bool = True,
        is_rehearsal: bool = False,
        tally: Tally | None = None,
        on_asked: Callable[[str, str], None] = lambda _source, _problem: None,
    ) -> None:
        """beside: does what takes long, beside the loop.  check: what of a pass is a no-go; None: files and ACU.

        fly_beside: does what takes seconds, where a thread would make ticks late.  acu: URL of --acu.
        has_phantom: each pass is flown before it.
        """
        self._is_rehearsal, self._acu = is_rehearsal, acu
        self.config, self._clock, self._directory = config, clock, file.path.parent
        self._tally = Tally() if tally is None else tally
        self._files = ConfigurationWatch(config)
        self._good: dict[str, Target] = {}  # satellites as they could be used last
        self._log: Any = structlog.get_logger("station")
        self._hooks_section = station.hooks
        self.hooks = Hooks(station.hooks.commands, station.hooks.time_limit_s, chosen_user(station.hooks.user))
        self.keeper = ScheduleKeeper(config, clock, file, station, beside, self._tally)
        self.course = PassCourse(self.keeper, self.hooks, self.about)
        self.checks = PassChecks(check or self._no_gos, beside, self._tell_no_go)
        self.phantom = PhantomCheck(config, self._directory, beside, fly_beside) if has_phantom else None
        self._place: tuple[float, float] | None = None  # of the newest reading
        self._next_rise = NextRise(config, self._directory, beside)
        self.wind = StationWind(station.wind, config, beside)
        self.stow_by = StowBy.NOBODY
        self._is_stowing, self._stow_asked_tai_s = False, -math.inf
        self.fetching = ElementsFetching(config, station.elements, clock, is_rehearsal=is_rehearsal, on_asked=on_asked)

    @property
    def station(self) -> StationFile:
        """station.toml as it was read last."""
        return self.keeper.station

    # People

    def why_not_unstow(self) -> str:
        """Why a person may not end the stow now; empty: it is ended."""
        if why := self.wind.why_not_unstow(self.stow_by):
            return why
        self.wind.let_go()
        return ""

    def ask_reload(self) -> str:
        """Have files and elements read again, between passes."""
        self.keeper.anew_reason = "a person asked"
        return "ok reload: " + ("after this pass" if self.course.entry else "now")

    # Rest

    def look(self) -> str:
        """Look, once a second between passes, at all that may change; why the rest ends, empty: it does not."""
        now_tai_s = self._clock.tai_s()
        self.fetching.look()
        changed = self._files.look(now_tai_s, self._good.values())
        self.keeper.anew_reason = self.keeper.anew_reason or changed
        self.keeper.look(now_tai_s)
        self.wind.section = self.station.wind
        if self._hooks_section != self.station.hooks:
            self._take_hooks(self.station.hooks)
        return self._due(now_tai_s)

    def _take_hooks(self, section: HooksSection) -> None:
        """Other programs, after a reload; as a user who is not there they are not started, and those before stay."""
        self._hooks_section = section
        try:
            self.hooks.take(section.commands, section.time_limit_s, chosen_user(section.user))
        except UsageError as error:
            self._log.error("hooks.kept", reason=str(error))

    def _due(self, now_tai_s: float) -> str:
        entry = self.keeper.coming()
        if entry is None or entry.start_tai_s is None or entry.end_tai_s is None:
            return ""
        if not entry.is_resumed or self.checks.no_go:
            self.checks.look(entry, now_tai_s)
            if self.phantom is not None:
                self.phantom.look(entry, now_tai_s, self._place)
        if entry.start_tai_s - now_tai_s > self._lead_s(entry) or not self.checks.may_begin(now_tai_s):
            return ""
        if self.is_going_to_stow:
            return ""
        if why := self._why_not_now(entry):
            self._refuse(entry, now_tai_s, why)
            return ""
        return f"{entry.name}{BEGINS}"

    @property
    def is_going_to_stow(self) -> bool:
        """Whether the antenna is on its way to the schedule's stow: a run that began now would think it another's."""
        is_just_asked = 0.0 <= self._clock.tai_s() - self._stow_asked_tai_s < STOW_SEEN_S
        return is_just_asked or (self._is_stowing and self.stow_by is StowBy.SCHEDULE)

    def stow_is_asked(self) -> None:
        """The antenna is sent to the stow, and no status shows it yet."""
        self._stow_asked_tai_s = self._clock.tai_s()

    def _why_not_now(self, entry: Entry) -> str:
        if self.wind.seen.wants_stow:
            return self.wind.seen.words
        if self.stow_by not in (StowBy.NOBODY, StowBy.SCHEDULE):
            return f"stowed by the {self.stow_by}"
        return self.checks.no_go or (self.phantom.no_go(entry) if self.phantom is not None else "")

    def _lead_s(self, entry: Entry) -> float:
        target = self._good.get(entry.satellite)
        lead_s = self.station.tracking.preposition_s if target is None else longest_lead(target)
        return max(lead_s, self.station.schedule.pre_s) + SPARE_S + self.station.hooks.before_move_s

    def _no_gos(self, satellite: str, now_tai_s: float) -> list[str]:
        found = list(findings(self.config, satellite, now_tai_s, self._directory, self._acu))
        self._tally.checks = {one.what: one.verdict != NO_GO for one in found}
        return [f"{one.what}: {one.detail}" for one in found if one.verdict == NO_GO and one.what != HOOKS]

    def _tell_no_go(self, entry: Entry, reason: str) -> None:
        self.hooks.call(Hook.ON_NO_GO, self.about(entry) | {"reason": reason})

    def _refuse(self, entry: Entry, now_tai_s: float, reason: str) -> None:
        """Try again until half of the pass is gone; then it has failed."""
        if self.checks.refuse(entry, now_tai_s):
            self.keeper.change(entry, PassState.FAILED, f"not begun: {reason}")
            self.hooks.call(Hook.AFTER_PASS, self.about(entry) | {"state": "failed", "reason": reason})

    # Pass

    def begin(self, entry: Entry) -> tuple[Target, Pass]:
        """What the run of a pass needs.  Raises: AcuDaemonError: it cannot begin, now at least."""
        now_tai_s = self._clock.tai_s()
        at_tai_s = max(entry.rise_tai_s, now_tai_s)
        try:
            target = load_target(self.config, entry.satellite, now_tai_s, at_tai_s=at_tai_s, folders=(self._directory,))
            self._good[entry.satellite] = target
            keep_confirmed(self.config, target)
        except AcuDaemonError as error:
            if entry.satellite not in self._good:
                raise
            target = self._good[entry.satellite]
            self._log.error("config.kept", satellite=entry.satellite, reason=str(error))
        return target, coming_pass(target, max(now_tai_s, entry.rise_tai_s - 60.0))

    def cannot_begin(self, entry: Entry, reason: str) -> None:
        """The files of a pass are refused."""
        self.checks.cannot_begin(entry, reason)
        self._refuse(entry, self._clock.tai_s(), reason)

    def begun(self, entry: Entry) -> None:
        """The run of a pass begins."""
        self.checks.forget()
        self.course.begun(entry, self.phantom.of(entry) if self.phantom is not None else None)

    def see(self, seen: Snapshot) -> None:
        """Take the newest snapshot, of a pass or between passes."""
        self.stow_by = StowBy(seen.stow_by)
        self._is_stowing = seen.acu_mode == AcuMode.STOWING.name
        if seen.az_deg is not None and seen.el_deg is not None:
            self._place = seen.az_deg, seen.el_deg
        self.course.see(seen)

    def interrupter(self, now_tai_s: float) -> Entry | None:
        """The pass for which the one that is on is given up now; None: none is worth it."""
        running, acu = self.course.entry, self.station.acu
        if running is None:
            return None
        self.keeper.look_in_pass(now_tai_s)
        tilt = None if acu.tilt is None else acu.tilt.limits()
        way_s = longest_lead_s(acu.azimuth.limits(), acu.elevation.limits(), 0.0, tilt)
        entry = self.keeper.interrupter(running, now_tai_s, way_s)
        if entry is None or self.stow_by is not StowBy.NOBODY or self.wind.seen.wants_stow:
            return None
        self.course.note(f"given up for {entry.name}")
        return entry

    def facts(self) -> StationFacts:
        """What is shown of the station beside the run."""
        until_tai_s = self.keeper.words.pause_until_tai_s
        return StationFacts(
            wind=self.wind.seen.words,
            phantom=self.phantom.words if self.phantom is not None else "",
            paused_until_utc=utc_text(until_tai_s, 0) if until_tai_s > self._clock.tai_s() else "",
        )

    def about(self, entry: Entry) -> dict[str, Any]:
        """What hooks are told."""
        return {
            "station": self.station.station.name,
            "number": entry.number,
            "satellite": entry.satellite,
            "rise_utc": utc_text(entry.rise_tai_s),
            "set_utc": utc_text(entry.set_tai_s),
            "culmination_el_deg": round(entry.culmination_el_deg, 2),
            "priority": entry.priority,
            "is_rehearsal": self._is_rehearsal,
        }

    # Between passes

    def after(self) -> tuple[float, float] | StowWish | None:
        """Where the antenna waits after a pass: azimuth and elevation, or stowed; None: where it is, for now at least.

        The next rise is found beside the loop.
        """
        rules, entry, now_tai_s = self.station.schedule, self.keeper.coming(), self._clock.tai_s()
        if self.stow_by is not StowBy.NOBODY or self.wind.seen.wants_stow:
            return None
        near_s = math.inf if entry is None or entry.start_tai_s is None else entry.start_tai_s - now_tai_s
        if rules.after == "next":
            return self._next_rise.at(entry, now_tai_s) if entry is not None else None
        if near_s <= rules.next_within_s:
            return None
        if rules.after == "park":
            return rules.park_az_deg, rules.park_el_deg
        return StowWish(StowBy.SCHEDULE) if rules.after == "stow" else None

    async def close(self) -> None:
        """End what runs beside the loop."""
        self.hooks.end_during()
        await self.hooks.close()
        await self.fetching.close()
        self.wind.close()
        self.checks.close()
        self._next_rise.close()
        if self.phantom is not None:
            self.phantom.close()
        self.keeper.close()
