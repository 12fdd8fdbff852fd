"""One pass from start to safe stop: the tasks, their order, and when it ends."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import structlog

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.acu.replies import beyond_own_limits
from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.session.refit import RefitSetup
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.safety.arming import begin_run
from acu_daemon.control.safety.foreign_stop import release
from acu_daemon.control.state import ControlState, remembered
from acu_daemon.control.tick_input import Asking, PassPlan
from acu_daemon.control.tracking.approach import lead_s
from acu_daemon.control.tracking.pass_plan import PlanAnswer, PlanRequest, is_due, is_tracked, why_over
from acu_daemon.control.tracking.state_table import ACTIVE
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.background import Background
from acu_daemon.daemon.drawing import DrawingBoard
from acu_daemon.daemon.foreground import Foreground
from acu_daemon.daemon.operator_requests import Hands
from acu_daemon.daemon.port import AcuPort
from acu_daemon.daemon.snapshot import Snapshot, StationFacts, Subject
from acu_daemon.daemon.taking import take_snapshot
from acu_daemon.daemon.tally import RunFigures, Tally
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.fit import FitRunner
from acu_daemon.edge.link import Link
from acu_daemon.edge.signal_reader import SignalReader
from acu_daemon.edge.tape import Note, no_note
from acu_daemon.errors import NoAcuError, UsageError
from acu_daemon.model import FitResult, Pass, Reading
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.reach import zenith_text
from acu_daemon.units import Array

FIRST_POLL_S = 10.0  # no good poll within this of the start ends the run
LOOK_TICKS = 10


class SignalSource(Protocol):
    """What tells of the signal beside the ACU."""

    async def open(self) -> None: ...

    def now(self, now_tai_s: float, /) -> SignalSample | None: ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class PassJob:
    """What one run is to do."""

    refit: RefitSetup
    control: ControlConfig
    coming: Pass | None  # None: none is known, the daemon rests
    horizon_s: float
    low_water_s: float
    driver: AcuDriver
    device_delay_s: float
    is_rehearsal: bool = False
    end_tai_s: float = math.inf  # of --duration
    state: ControlState = ControlState()  # what the decision begins with: what the last run left
    satellite: str = ""  # names for people
    station: str = ""
    elements: str = ""  # kind and epoch, for people
    elements_epoch_tai_s: float | None = None
    next_passes: tuple[str, ...] = ()  # after this one, for people
    move: PassPlan | None = None  # only go there, before a pass or after it
    is_led: bool = False  # only let another program lead the antenna
    is_anew: bool = False  # not the first run of this daemon: the ACU was there
    signal_udp: str | None = None  # ADDRESS:PORT at which a receiver beside the ACU tells of the signal


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a run ended, with its counts."""

    reason: str
    has_acquired: bool
    has_begun: bool
    is_stopped: bool
    tick_count: int
    write_count: int
    skipped_tick_count: int
    refit_count: int
    refit_failed_count: int
    refusal_count: int
    clamped_count: int
    limited_count: int
    connect_count: int
    lag_az_s: float
    lag_el_s: float
    lateness_p50_ms: float
    lateness_p99_ms: float
    lateness_max_ms: float


class Service:
    """Everything of one run.  `stop` ends it early and safely."""

    def __init__(
        self,
        job: PassJob,
        link: Link,
        clock: Clock,
        runner: FitRunner,
        *,
        on_snapshot: Callable[[Snapshot], None] | None = None,
        snapshot_ticks: int = 1,
        on_reading: Callable[[Reading], None] | None = None,
        on_fit: Callable[[FitResult], None] | None = None,
        on_estimate: Callable[[PassEstimate], None] | None = None,
        on_state: Callable[[ControlState], None] | None = None,
        files_alarm: Callable[[], str] = str,
        elements_problem: Callable[[], str] = str,
        facts: Callable[[], StationFacts] = StationFacts,
        on_end: Callable[[], None] | None = None,
        why_anew: Callable[[bool, float], str] | None = None,
        signal: SignalSource | None = None,
        note: Note = no_note,
        tally: Tally | None = None,
    ) -> None:
        """on_end: called when the run is over, before the safe stop, which may take stopping.DEADLINE_S.

        why_anew: asked once a second, until the pass is acquired, whether the run is to begin anew, and why; is told
        whether the antenna waits, and by how many seconds the system clock has stepped.

        signal: what tells of the signal beside the ACU, in the place of a reader of job.signal_udp.
        tally: what counts through all runs of the process.
        """
        self._job = job
        self._clock = clock
        self._runner = runner
        self._acu = link.description
        self._on_snapshot = on_snapshot
        self._snapshot_ticks = snapshot_ticks
        self._on_state = on_state
        self._on_end = on_end
        self._files_alarm = files_alarm
        self._elements_problem = elements_problem
        self._facts = facts
        self._why_anew = why_anew
        self._signal: SignalSource | None = signal
        if signal is None and job.signal_udp is not None:
            self._signal = SignalReader(job.signal_udp, has_own_time=not job.is_rehearsal)
        self._tally = Tally() if tally is None else tally
        self._permit_refused_before = self._tally.counts["refused", "permit"]
        self.anew_reason = ""  # why the run has ended: another is to follow at once
        self._is_over = asyncio.Event()
        self._stop_reason = ""
        self._started_tai_s = math.inf
        self._log: Any = structlog.get_logger("pass")
        self._area = CommonArea(state=begin_run(job.state, job.control))
        self._note = note
        self._port = AcuPort(link, clock, job.driver, job.control.period_s, job.device_delay_s, note)
        self._background = Background(
            self._area,
            runner,
            clock,
            job.refit,
            horizon_s=job.horizon_s,
            low_water_s=job.low_water_s,
            control=job.control,
            on_fit=on_fit,
            on_estimate=on_estimate,
            on_plan=self._tell_plan,
            note=note,
        )
        self._foreground = Foreground(
            self._area,
            self._port,
            clock,
            job.control,
            after_tick=self._after_tick,
            on_reading=on_reading,
            signal=None if self._signal is None else self._signal.now,
            note=note,
            tally=self._tally,
        )
        self.drawing = DrawingBoard(self._area, job.control, job.refit, job.coming, clock)
        self._hands = Hands(self._area, job.control, self._foreground.ask, self.snapshot, clock.tai_s)

    def stop(self, reason: str) -> None:
        """End the run after the present tick, or the next one: no exchange is cut off.  Safe stop included."""
        self._stop_reason = self._stop_reason or reason

    def hand_over(self, reason: str) -> None:
        """End the run after the present tick for another, which takes the antenna as it is: no STOP between them."""
        self.anew_reason = self.anew_reason or reason

    async def run(self) -> Outcome:
        """Run the pass.

        Raises: NoAcuError: no good poll at the start.  UsageError: a rehearsal on a real ACU.
        """
        reason, is_stopped = "error", False
        self._tally.begin_run()
        if self._signal is not None:
            await self._signal.open()
        try:
            async with asyncio.TaskGroup() as outer:
                link = outer.create_task(self._port.keep(), name="link")
                try:
                    reason = await self._track()
                finally:
                    is_stopped = await self._end()
                    link.cancel()
                    await self._runner.close()
        except ExceptionGroup as group:
            raise _innermost(group) from None
        finally:
            if self._signal is not None:
                self._signal.close()
                await asyncio.sleep(0)  # until then the address is taken, and another run may want it
        return self._outcome(reason, is_stopped)

    async def _end(self) -> bool:
        if self.anew_reason and not self._stop_reason:  # the next run takes the antenna as it is
            return True
        if self._on_end is not None:
            self._on_end()
        self._note(("E", {}))
        is_stopped = await self._safe_stop()
        self._leave(is_stopped=is_stopped)
        return is_stopped

    async def stop_after_all(self) -> None:
        """Stop the antenna where this run was to be followed by another, and is not."""
        keeper = asyncio.create_task(self._port.keep(), name="link")
        try:
            self._leave(is_stopped=await self._safe_stop())
        finally:
            keeper.cancel()
            await asyncio.gather(keeper, return_exceptions=True)

    async def _track(self) -> str:
        self._started_tai_s = self._clock.tai_s()
        async with asyncio.TaskGroup() as inner:
            tasks = [inner.create_task(self._foreground.run(), name="foreground")]
            if not (self._job.control.is_resting or self._job.move is not None or self._job.is_led):
                tasks.append(inner.create_task(self._background.run(), name="background"))
            await self._is_over.wait()
            for task in tasks:
                task.cancel()
        return self._stop_reason or self.anew_reason

    def _supervise(self, now_tai_s: float) -> None:
        """Look after a tick whether the run is over, and plan the pass as soon as it can be planned."""
        sky = self._area.sky
        if why := why_over(sky, now_tai_s, self._job.end_tai_s):
            self.stop(why)
        if self._stop_reason or self.anew_reason:
            self._is_over.set()
            return
        self._check_acu(now_tai_s - self._started_tai_s)
        is_resting = self._job.control.is_resting
        if not is_resting and is_due(sky.plan, self._area.state):
            self._plan(now_tai_s)
        if self._why_anew is not None and (is_resting or self._foreground.tick_count % LOOK_TICKS == 0):
            self._look_anew(self._why_anew, now_tai_s)

    def _look_anew(self, why_anew: Callable[[bool, float], str], now_tai_s: float) -> None:
        state, sky = self._area.state, self._area.sky
        if not is_tracked(state, sky, now_tai_s):
            self.anew_reason = why_anew(state.tracking.track not in ACTIVE, self._foreground.clock_watch.step_s)
            if self.anew_reason:
                self._is_over.set()

    @property
    def unheard(self) -> tuple[Asking, ...]:
        """What people have asked since the last tick of a run that is over: for the next run."""
        return self._foreground.unheard

    @property
    def is_over(self) -> bool:
        """Whether no tick is to come."""
        return self._is_over.is_set()

    @property
    def memory(self) -> ControlState:
        """What of this run's memory another one begins with: what people and the antenna have told."""
        state = self._area.state
        return remembered(
            by_people=state.arming.by_people,
            disarmed_by=state.arming.disarmed_by,
            is_stop_due=state.arming.is_stop_due,
            latch=state.latch.problem,
            held=state.foreign_stop.held,
            stow_by=state.stow.stow_by,
        )

    def _check_acu(self, elapsed_s: float) -> None:
        if self._area.state.intake.status is None and elapsed_s > FIRST_POLL_S and not self._job.is_anew:
            why = self._port.problem or "no answer"
            raise NoAcuError(f"no good poll within {FIRST_POLL_S:g} s: {why}")
        axes = self._job.control
        status = self._area.state.intake.status
        if axes.tilt_deg is not None and status is not None and status.tilt_deg is None:
            raise UsageError("[acu.tilt] is given, and the ACU says that it has no tilt: leave it out")
        identity, is_sure = self._area.state.startup.identity, self._area.state.startup.is_identity_sure
        if identity is not None and is_sure and (why := beyond_own_limits(identity, axes.azimuth, axes.elevation)):
            raise UsageError(f"{identity}: {why}")
        if self._job.is_rehearsal and identity is not None and is_sure and not identity.is_simulated:
            raise UsageError(
                f"the ACU is a real one ({identity}): a rehearsal (--at) runs only on a simulated ACU; leave out --at"
            )

    def _plan(self, now_tai_s: float) -> None:
        job, state = self._job, self._area.state
        if job.move is not None:
            self._background.set_plan(job.move)
        if job.move is not None or job.coming is None:
            return
        if self._background.is_planning:
            return
        self._note(("P", now_tai_s))
        self._background.ask_plan(plan_request(job.refit, job.control, job.coming, state, now_tai_s))

    def _tell_plan(self, planned: PlanAnswer) -> None:
        job, state, plan, now_tai_s = self._job, self._area.state, planned.plan, self._clock.tai_s()
        if job.coming is None:
            return
        self._log.info(
            "pass.planned",
            rise_in_s=round(plan.rise_tai_s - now_tai_s, 1),
            duration_s=round(job.coming.duration_s, 1),
            culmination_deg=round(job.coming.culmination_el_deg, 2),
            start_az_deg=round(plan.start_az_deg, 2),
            lead_s=round(lead_s(plan, state, job.control), 1),
        )
        if plan.note:
            self._log.warning("pass.wrap", note=plan.note)
        for change in plan.unwindings:
            in_s, by_deg = round(change.tai_s - now_tai_s, 1), round(change.by_deg)
            self._log.warning("pass.unwinds", in_s=in_s, by_deg=by_deg, for_s=round(change.for_s, 1))
        if plan.crossing is not None:
            self._log.info("pass.zenith", what=zenith_text(plan.crossing))
        for one in plan.beyond:
            self._log.warning("pass.beyond_limits", axis=one.axis, for_s=round(one.duration_s, 1), what=str(one))
        envelope = job.control.envelope
        for outage in planned.sun:
            policy = envelope.sun.policy if envelope.sun else ""
            self._log.warning("pass.sun", least_deg=round(outage.least_deg, 2), policy=policy, what=str(outage))
        for kept in planned.keep_outs:
            self._log.warning("pass.keep_out", zone=kept.name, for_s=round(kept.duration_s, 1), what=str(kept))
        for begin, end in job.coming.hidden_tai_s:
            self._log.info("pass.hidden", from_utc=utc_text(begin, 0), for_s=round(end - begin, 1))

    async def _safe_stop(self) -> bool:
        self._port.abandon()
        if not self._foreground.owes_stop:
            return True
        return await self._foreground.safe_stop()

    def _leave(self, *, is_stopped: bool) -> None:
        """Whoever starts next must not take our stop for another hand's."""
        if is_stopped and self._on_state is not None and not self._job.control.is_shadow:
            self._on_state(release(self._area.state))

    def _after_tick(self) -> None:
        self._supervise(self._clock.tai_s())
        self._background.wake()
        if self._on_state is not None:
            self._on_state(self._area.state)
        if self._on_snapshot is not None and self._foreground.tick_count % self._snapshot_ticks == 0:
            seen = self.snapshot()
            self._tally.see(seen, self._figures())
            self._on_snapshot(seen)

    def snapshot(self) -> Snapshot:
        """Everything people look at, now."""
        return take_snapshot(
            self._area,
            self._foreground,
            self._port,
            self._job.control,
            self._clock.tai_s(),
            Subject(
                self._job.satellite,
                self._job.station,
                self._acu,
                self._job.coming,
                self._job.elements,
                self._elements_problem(),
                self._job.next_passes,
                self._facts(),
            ),
            is_rehearsal=self._job.is_rehearsal,
            files_alarm=self._files_alarm(),
        )

    def lateness_ms(self, most: int) -> Array:
        """How late the newest ticks came, at most so many, milliseconds."""
        return self._foreground.lateness.newest_ms(most)

    def _figures(self) -> RunFigures:
        """What other programs are told beside the snapshot."""
        job, port, area, watch = self._job, self._port, self._area, self._foreground.clock_watch
        permit_count = self._tally.counts["refused", "permit"] - self._permit_refused_before
        return RunFigures(
            connect_count=port.connect_count,
            fit_count=area.refit_count,
            fit_failed_count=area.refit_failed_count,
            permit_refusal_count=permit_count,
            link_errors={
                "no_reply": port.failed_exchange_count,
                "garbled": port.garbled_count,
                "discarded": port.discarded_count,
                "late": port.late_count,
                "doubted": area.state.plausibility.doubted_count,
            },
            elements_epoch_tai_s=job.elements_epoch_tai_s,
            next_rise_tai_s=job.coming.rise_tai_s if job.coming is not None else None,
            beamwidth_deg=job.control.beamwidth_deg,
            clock_error_s=watch.difference_s,
            sky_rate_deg_s=watch.sky_rate_deg_s,
            is_clock_synchronised=self._clock.is_synchronised,
        )

    def answer(self, line: str, who: str = "") -> str:
        """Answer a person's line (daemon.operator_verbs).  who: says it, and from where."""
        return self._hands.answer(line, who)

    def ask(self, asking: Asking) -> None:
        """Have the next tick do what the station wants, or a person."""
        self._foreground.ask(asking)

    def _outcome(self, reason: str, is_stopped: bool) -> Outcome:
        state, foreground = self._area.state, self._foreground
        lateness = foreground.lateness.figures()
        lag_az_s, lag_el_s = state.lag_s(self._job.control)
        return Outcome(
            reason=reason,
            has_acquired=state.signal.has_acquired,
            has_begun=self._job.coming is not None and self._clock.tai_s() > self._job.coming.rise_tai_s,
            is_stopped=is_stopped,
            tick_count=foreground.tick_count,
            write_count=foreground.write_count,
            skipped_tick_count=foreground.skipped_tick_count,
            refit_count=self._area.refit_count,
            refit_failed_count=self._area.refit_failed_count,
            refusal_count=state.refusals.refusal_count,
            clamped_count=state.refusals.clamped_count,
            limited_count=state.refusals.limited_count,
            connect_count=self._port.connect_count,
            lag_az_s=lag_az_s,
            lag_el_s=lag_el_s,
            lateness_p50_ms=lateness.p50_ms,
            lateness_p99_ms=lateness.p99_ms,
            lateness_max_ms=lateness.max_ms,
        )


def plan_request(
    setup: RefitSetup, control: ControlConfig, coming: Pass, state: ControlState, now_tai_s: float
) -> PlanRequest:
    """Ask for the plan of a pass from where the antenna is now."""
    place = state.intake.az_deg, state.intake.el_deg
    return PlanRequest(coming, *place, control.envelope, now_tai_s, state.turn.learned_count, setup.keyhole)


def _innermost(error: Exception) -> Exception:
    """The one error that task groups have wrapped, so that it keeps its exit status; several stay a group."""
    while isinstance(error, ExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error
