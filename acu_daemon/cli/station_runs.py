"""The runs of a station, one after another: rests, passes, moves; each with the memory of the one before."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from math import ceil
from typing import Any

import structlog

from acu_daemon.cli.kept import Kept, open_kept
from acu_daemon.cli.options import Target
from acu_daemon.cli.outlets_beside import Outlets
from acu_daemon.cli.page import RunningPage, WatchedRuns, passes_shown
from acu_daemon.cli.pass_reports import PassReports
from acu_daemon.cli.pass_tape import begin_tape, note_hooks
from acu_daemon.cli.run_setup import make_job
from acu_daemon.cli.station_day import BEGINS, StationDay
from acu_daemon.cli.station_hand import StationHand
from acu_daemon.cli.station_move import IN_PLACE, Horn, move_job, why_move_ends
from acu_daemon.cli.station_setup import NoFits, StationSetup
from acu_daemon.cli.weather_watch import WeatherWatch
from acu_daemon.control.safety.stow import end_between_passes
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Asking, NudgeWish, StowWish
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.health import Health
from acu_daemon.daemon.live import LiveLine
from acu_daemon.daemon.operator_requests import ENDS, STATUS
from acu_daemon.daemon.service import Outcome, PassJob, Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.stopping import DEADLINE_S
from acu_daemon.edge.clock import STEP_S
from acu_daemon.edge.fit import FitRunner
from acu_daemon.edge.schedule_file import ScheduleFile
from acu_daemon.edge.state_directory import SnapshotFile
from acu_daemon.edge.systemd import Notifier
from acu_daemon.edge.tape import no_note
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.errors import AcuDaemonError
from acu_daemon.model import Pass
from acu_daemon.schedule.book import Entry

LED, MOVES = "a program leads the antenna", "the antenna is moved"  # why a rest ends
LED_BEGINS_S = 30.0  # for the start of its run, modes included


class StationRuns:
    """One run after another, each with the memory of the one before.  Owned by the loop."""

    def __init__(self, setup: StationSetup, first: Target, live: LiveLine | None) -> None:
        self._setup, self._first, self._live = setup, first, live
        self.outlets = Outlets(
            first.station,
            setup.directory,
            setup.clock,
            setup.page,
            lambda: self._service,
            lambda: self.day.wind.seen,
            self._passes,
            setup.config,
        )
        self.day = StationDay(
            setup.config,
            setup.clock,
            ScheduleFile(setup.directory, put=setup.put),
            first.station,
            beside=setup.beside,
            fly_beside=setup.fly_beside,
            acu=setup.acu,
            check=setup.check,
            has_phantom=setup.has_phantom,
            is_rehearsal=setup.clock.is_rehearsal,
            tally=self.outlets.tally,
            on_asked=self.outlets.asked_for_elements,
        )
        watched = WatchedRuns(lambda: self._service, self.outlets.counted(self.answer), self._passes)
        self.page = RunningPage(setup.page, watched, setup.clock)
        self._notifier = Notifier()
        self._health = Health(self._notifier)
        self._snapshots = SnapshotFile(setup.directory, setup.files, 1)
        self._weather = WeatherWatch(setup.config, first, setup.clock.tai_s())
        self._service: Service | None = None
        self._kept: Kept | None = None
        self._tape: TapeFile | None = None  # of the pass in progress
        self._reports = PassReports(setup, self.day)
        self._memory: ControlState | None = None
        self._stop_reason = ""
        self._is_resting = False
        self._first_ask: Asking | None = None  # what the first tick of the next run is asked for
        self._led_until_tai_s = math.inf
        self._is_placed = True  # where it waits after a pass
        self._move_until_tai_s = math.inf
        self._hand = StationHand(self.day, setup.clock.tai_s)
        self._horn = Horn(self.day.hooks, setup.clock)
        self._log: Any = structlog.get_logger("station")

    def _passes(self) -> list[dict[str, Any]]:
        return passes_shown(self.day.keeper.book, self.day.checks.said_of, self._setup.clock.tai_s())

    def stop(self, reason: str) -> None:
        """End early and safely."""
        self._stop_reason = self._stop_reason or reason
        if self._service is not None:
            self._service.stop(reason)

    @property
    def service(self) -> Service | None:
        """The run that goes on; None: none has begun."""
        return self._service

    def answer(self, line: str, who: str = "") -> str:
        """Answer a person's line (daemon.operator_verbs).  who: says it, and from where."""
        if self._stop_reason and line != STATUS and (self._service is None or self._service.is_over):
            return ENDS
        return self._hand.answer(line, who, self._service)

    async def run(self) -> Outcome:
        """Run until it is stopped.  Raises: NoAcuError: no good poll at the start."""
        await self._weather.open()
        try:
            return await self._runs()
        finally:
            self._weather.close()

    async def _runs(self) -> Outcome:
        outcome = await self._pass() if self.day.look() and self._may_begin() else None
        outcome = outcome or await self._rest()
        while not self._stop_reason and outcome.reason != "duration over":
            if outcome.reason == LED:
                outcome = await self._led()
            elif outcome.reason.endswith(BEGINS):
                outcome = await self._promised(outcome)
            elif outcome.reason == MOVES and isinstance(after := self.day.after(), tuple):
                self._is_placed = True
                outcome = await self._move(*after)
            is_handed_over = outcome.reason.endswith(BEGINS)  # by a pass to another one: nothing rests between them
            if not self._stop_reason and outcome.reason != "duration over" and not is_handed_over:
                outcome = await self._rest()
        return outcome

    async def _promised(self, outcome: Outcome) -> Outcome:
        """Begin the pass for which a run has ended; where it cannot begin, the antenna is stopped."""
        entry = self.day.keeper.coming()
        is_still_due = entry is not None and outcome.reason == f"{entry.name}{BEGINS}"
        if is_still_due and (ended := await self._pass()) is not None:
            return ended
        if self._service is not None:
            await self._service.stop_after_all()
            self._memory = self._service.memory
        return replace(outcome, reason="it cannot begin")

    # The three kinds of runs

    async def _rest(self) -> Outcome:
        coming = self.day.keeper.coming()
        target = self._first
        job = self._job(target, _as_pass(coming), is_resting=True)
        job = replace(job, satellite="" if coming is None else coming.satellite)

        def why_anew(_is_waiting: bool, step_s: float) -> str:
            if step_s and abs(self._setup.clock.follow()) > STEP_S:
                self._setup.clock.obey()
                self.day.keeper.anew_reason = f"the system clock was set by {step_s:+.1f} s"
                return self.day.keeper.anew_reason
            why = self.day.look()
            if self.outlets.wish is not None and not self.day.is_going_to_stow:
                return LED
            if why:
                return why if self._may_begin() else ""
            if not self._is_placed and (why := self._after()):
                return why
            return "another pass is next" if self.day.keeper.coming() != coming else ""

        return await self._serve(job, NoFits(), why_anew)

    def _after(self) -> str:
        """See to where the antenna waits after a pass; why the rest ends, empty: it does not."""
        after = self.day.after()
        if isinstance(after, StowWish) and self._service is not None:
            if self._is_warned({"reason": "stow between passes"}):
                self._horn.forget()
                self._is_placed = True
                self._service.ask(after)
                self.day.stow_is_asked()
            return ""
        if isinstance(after, tuple) and self._is_warned({"az_deg": after[0], "el_deg": after[1]}):
            return MOVES
        return ""

    def _may_begin(self) -> bool:
        """Whether the pass that is due may begin: the horn was heard, or the antenna moved a moment ago."""
        entry = self.day.keeper.coming()
        return entry is None or entry.is_resumed or self._is_warned(self.day.about(entry))

    def _is_warned(self, about: dict[str, Any]) -> bool:
        hooks = self.day.station.hooks
        return self._horn.is_heard(about, hooks.before_move_s, is_wanted=bool(hooks.before_move))

    async def _pass(self) -> Outcome | None:
        """Track the pass that is due; None: its files are refused."""
        entry = self.day.keeper.coming()
        if entry is None or entry.end_tai_s is None:
            return None
        try:
            target, coming = self.day.begin(entry)
            target = self._weather.on(target, self._setup.clock.tai_s())
            if self._kept is not None:
                self._kept.flush()
            self._kept = open_kept(
                self._setup.directory, target, coming, self._setup.clock, self._setup.files, self._setup.older
            )
            job = self._job(target, coming)
        except AcuDaemonError as error:
            self.day.cannot_begin(entry, str(error))
            return None
        is_cut = entry.end_tai_s < coming.set_tai_s - 1.0
        job = replace(job, end_tai_s=min(job.end_tai_s, entry.end_tai_s)) if is_cut else job
        if self._memory is None:  # the first of this process: as one of a single pass is resumed
            job = replace(job, state=end_between_passes(self._kept.state), is_anew=False)
        if (kept := self.day.course.nudge_for(entry.satellite, job.elements)) is not None:
            self._first_ask = NudgeWish(kept.along_s, kept.across_deg)
        self._horn.forget()
        self.day.begun(entry)
        self._is_placed = False
        setup = self._setup
        if setup.is_recording:
            self._tape = begin_tape(setup.directory, target, job, setup.link, setup.clock.tai_s(), setup.files)
        if self._tape is not None:
            self._tape.note(("I", "schedule", self.day.about(entry) | {"reason": entry.reason, "is_cut": is_cut}))
        try:
            outcome = await self._serve(job, setup.make_runner(job), None)
        except AcuDaemonError as error:
            self.day.course.ended(None, str(error))
            raise
        else:
            self.day.course.ended(outcome)
        finally:
            self._end_tape(target)
        return replace(outcome, reason="cut as planned") if is_cut and outcome.reason == "duration over" else outcome

    def _end_tape(self, target: Target) -> None:
        """Close the recording, and have the report made beside what comes next."""
        tape = self._tape
        if tape is None:
            return
        note_hooks(tape, self.day.course.hook_results)
        tape.close()
        self._reports.make(tape, has_report=target.station.recording.report and not tape.problem)

    async def _move(self, az_deg: float, el_deg: float) -> Outcome:
        now_tai_s = self._setup.clock.tai_s()
        job = self._job(self._first, None)
        job, self._move_until_tai_s = move_job(job, az_deg, el_deg, now_tai_s)
        self._log.info("station.moves", az_deg=az_deg, el_deg=el_deg)
        self._horn.forget()
        outcome = await self._serve(job, NoFits(), None)
        self._move_until_tai_s = math.inf
        return outcome

    async def _led(self) -> Outcome:
        """Let a program that has the write lease lead the antenna; the schedule waits for it, and it is shown."""
        self._log.warning("station.led", by=self.outlets.wish.by if self.outlets.wish else "")
        self._first_ask, self._led_until_tai_s = self.outlets.wish, self._setup.clock.tai_s() + LED_BEGINS_S
        outcome = await self._serve(replace(self._job(self._first, None), is_led=True, satellite=""), NoFits(), None)
        self._led_until_tai_s = math.inf
        self._is_placed = False
        return outcome

    def _look_at_led(self, seen: Snapshot) -> None:
        """End the run once the program leads the antenna no more, or does not come to."""
        if math.isinf(self._led_until_tai_s) or self._service is None:
            return
        self.day.look()
        if self.outlets.wish is None or (seen.state != TrackState.SLAVED and seen.tai_s > self._led_until_tai_s):
            self._service.stop("led no more")

    def _job(self, target: Target, coming: Pass | None, *, is_resting: bool = False) -> PassJob:
        setup = self._setup
        end_tai_s = setup.clock.tai_s() + setup.end_s - setup.clock.monotonic_s()
        kept = self._kept if coming is not None and not is_resting else None
        job = make_job(
            target,
            coming,
            setup.link,
            is_rehearsal=setup.clock.is_rehearsal,
            end_tai_s=end_tai_s,
            carried=kept.carried if kept else None,
            memory=kept.memory if kept else None,
        )
        control = replace(job.control, is_shadow=setup.is_shadow, is_resting=is_resting)
        state = job.state if self._memory is None else self._memory
        after_tai_s = setup.clock.tai_s() if coming is None else coming.rise_tai_s + 60.0
        shown = self.day.keeper.next_passes(after_tai_s)
        state = state if is_resting else end_between_passes(state)
        return replace(job, control=control, state=state, is_anew=self._memory is not None, next_passes=shown)

    async def _serve(self, job: PassJob, runner: FitRunner, why_anew: Callable[[bool, float], str] | None) -> Outcome:
        if self._kept is None:  # what people and the antenna have told before this process
            setup = self._setup
            self._kept = open_kept(setup.directory, self._first, None, setup.clock, setup.files, setup.older)
            job = replace(job, state=self._kept.state)
        kept = self._kept
        is_pass = job.coming is not None and not job.control.is_resting
        service = Service(
            job,
            self._setup.link,
            self._setup.clock,
            runner,
            on_snapshot=self._show,
            on_fit=kept.offer if is_pass else None,
            on_estimate=kept.mount.offer if is_pass else None,
            on_state=kept.see,
            on_end=self._on_end,
            files_alarm=self._files_alarm,
            elements_problem=lambda: self.day.fetching.problem,
            facts=self.day.facts,
            why_anew=why_anew,
            note=self._tape.note if is_pass and self._tape is not None else no_note,
            tally=self.outlets.tally,
        )
        first = () if self._first_ask is None else (self._first_ask,)
        for asking in (*(self._service.unheard if self._service is not None else ()), *first):
            service.ask(asking)
        self._service, self._is_resting, self._first_ask = service, job.control.is_resting, None
        if self._stop_reason:
            service.stop(self._stop_reason)
        outcome = await service.run()
        self._memory = service.memory
        return outcome

    def _on_end(self) -> None:
        """No tick feeds the supervisor's watchdog while the antenna is stopped."""
        if self._stop_reason:
            self._notifier("STOPPING=1")
            return
        loop = asyncio.get_running_loop()
        for second in range(ceil(DEADLINE_S) + 1):
            loop.call_later(second, self._notifier, "WATCHDOG=1")

    def _files_alarm(self) -> str:
        kept = (one.problem for one in (self._setup.files, self.day.keeper, self._kept, self._tape) if one is not None)
        return "; ".join(text for text in kept if text)

    def _show(self, seen: Snapshot) -> None:
        self._health.see(seen)
        self._snapshots.write(seen)
        self.page.see(seen)
        self.outlets.see(seen)
        self._look_at_led(seen)
        self.day.see(seen)
        self._obey_wind(seen)
        if (entry := self.day.interrupter(seen.tai_s)) is not None and self._service is not None:
            self._service.hand_over(f"{entry.name}{BEGINS}")
        if self._live is not None:
            self._live.show(seen)
        if math.isfinite(self._move_until_tai_s) and self._service is not None:
            self._end_move(seen, self._service)

    def _end_move(self, seen: Snapshot, service: Service) -> None:
        why = why_move_ends(seen, self._move_until_tai_s)
        if why and why != IN_PLACE:
            self._log.warning("station.not_in_place", reason=why, state=seen.state, arming=seen.arming)
        if why:
            service.stop(why)

    def _obey_wind(self, seen: Snapshot) -> None:
        """The antenna is stowed for the wind; one that stands is not moved before the horn was heard."""
        wish = self.day.wind.look(seen.tai_s, self.day.stow_by)
        if wish is None or self._service is None:
            return
        if wish.is_wanted and self._is_resting and not self._is_warned({"reason": self.day.wind.seen.words}):
            return
        self._horn.forget()
        self._service.ask(wish)

    async def close(self) -> None:
        """End what runs beside the runs."""
        await self.day.close()
        await self._reports.close()
        if self._kept is not None:
            self._kept.flush()
        self._notifier.close()


def _as_pass(entry: Entry | None) -> Pass | None:
    if entry is None:
        return None
    return Pass(entry.rise_tai_s, entry.culmination_tai_s, entry.set_tai_s, 0.0, entry.culmination_el_deg, 0.0, 0.0)
