"""One pass from start to safe stop: the tasks, their order, and when it ends."""

import asyncio
import json
import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import structlog

from acu_daemon.control.causes import pass_end_tai_s
from acu_daemon.control.plan import plan_pass
from acu_daemon.control.refit import RefitSetup
from acu_daemon.control.state import ControlConfig, ControlState, Request
from acu_daemon.control.states import AUTOTRACKING
from acu_daemon.daemon.area import CommonArea, Snapshot
from acu_daemon.daemon.background import Background
from acu_daemon.daemon.foreground import Foreground
from acu_daemon.daemon.port import AcuPort
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.fit import FitRunner
from acu_daemon.edge.link import Link
from acu_daemon.errors import NoAcuError, UsageError
from acu_daemon.model import FitResult, Pass, Prediction, Reading, sky_angle_deg

FIRST_POLL_S = 10.0  # no good poll within this of the start ends the run
STOP_DEADLINE_S = 5.0  # a link that is down may come back; the service's TimeoutStopSec is longer
LATENESS_TICKS = 100  # of the snapshot: the newest ten seconds


@dataclass(frozen=True, slots=True)
class PassJob:
    """What one run is to do."""

    refit: RefitSetup
    control: ControlConfig
    coming: Pass
    horizon_s: float
    low_water_s: float
    address: int
    device_delay_s: float
    is_rehearsal: bool = False
    end_tai_s: float = math.inf  # of --duration
    arming: bool | None = None  # as the last run was left, when it was cut off; None: as configured
    latch: str = ""


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
        on_state: Callable[[ControlState], None] | None = None,
    ) -> None:
        self._job = job
        self._clock = clock
        self._runner = runner
        self._on_snapshot = on_snapshot
        self._snapshot_ticks = snapshot_ticks
        self._on_state = on_state
        self._ticked = asyncio.Event()
        self._stop_reason = ""
        self._log: Any = structlog.get_logger("pass")
        self._area = CommonArea(
            state=ControlState(
                arming=job.arming, latch=job.latch, is_stop_due=bool(job.latch) and job.arming is not False
            )
        )
        self._port = AcuPort(link, clock, job.address, job.control.period_s, job.device_delay_s)
        self._background = Background(
            self._area,
            runner,
            clock,
            job.refit,
            horizon_s=job.horizon_s,
            low_water_s=job.low_water_s,
            preposition_s=job.control.preposition_s,
            on_fit=on_fit,
        )
        self._foreground = Foreground(
            self._area, self._port, clock, job.control, after_tick=self._after_tick, on_reading=on_reading
        )

    def stop(self, reason: str) -> None:
        """End the run at the next tick, safe stop included."""
        self._stop_reason = self._stop_reason or reason
        self._ticked.set()

    async def run(self) -> Outcome:
        """Run the pass.

        Raises: NoAcuError: no good poll at the start.  UsageError: a rehearsal on a real ACU.
        """
        reason, is_stopped = "error", False
        try:
            async with asyncio.TaskGroup() as outer:
                link = outer.create_task(self._port.keep(), name="link")
                try:
                    reason = await self._track()
                finally:
                    is_stopped = await self._safe_stop()
                    link.cancel()
                    await self._runner.close()
        except ExceptionGroup as group:
            raise _innermost(group) from None
        return self._outcome(reason, is_stopped)

    async def _track(self) -> str:
        async with asyncio.TaskGroup() as inner:
            tasks = [
                inner.create_task(self._foreground.run(), name="foreground"),
                inner.create_task(self._background.run(), name="background"),
            ]
            reason = await self._supervise()
            for task in tasks:
                task.cancel()
        return reason

    async def _supervise(self) -> str:
        """Watch tick after tick until the run is over; say why it is."""
        started_tai_s = self._clock.tai_s()
        while True:
            await self._ticked.wait()
            self._ticked.clear()
            if self._stop_reason:
                return self._stop_reason
            now_tai_s = self._clock.tai_s()
            if now_tai_s >= self._job.end_tai_s:
                return "duration over"
            self._check_acu(now_tai_s - started_tai_s)
            sky = self._area.sky
            if sky.plan is None:
                self._plan(now_tai_s)
            elif now_tai_s > pass_end_tai_s(sky.plan, sky):
                return "pass over"

    def _check_acu(self, elapsed_s: float) -> None:
        if self._area.state.status is None and elapsed_s > FIRST_POLL_S:
            why = self._port.problem or "no answer"
            raise NoAcuError(f"no good poll within {FIRST_POLL_S:g} s: {why}")
        identity = self._foreground.identity
        if self._job.is_rehearsal and identity is not None and not identity.is_simulated:
            raise UsageError(
                f"the ACU is a real one ({identity}): a rehearsal (--at) runs only on a simulated ACU; leave out --at"
            )

    def _plan(self, now_tai_s: float) -> None:
        job, state = self._job, self._area.state
        if state.status is None:
            return
        plan = plan_pass(job.refit.propagator, job.refit.site, job.coming, state.az_deg, job.control.azimuth, now_tai_s)
        self._log.info(
            "pass.planned",
            rise_in_s=round(plan.rise_tai_s - now_tai_s, 1),
            duration_s=round(job.coming.duration_s, 1),
            culmination_deg=round(job.coming.culmination_el_deg, 2),
            start_az_deg=round(plan.start_az_deg, 2),
        )
        if plan.note:
            self._log.warning("pass.wrap", note=plan.note)
        self._background.set_plan(plan)

    async def _safe_stop(self) -> bool:
        self._port.abandon()
        if self._foreground.write_count == 0:
            return True
        try:
            async with asyncio.timeout(STOP_DEADLINE_S):
                await self._port.wait_until_up()
                return await self._foreground.safe_stop()
        except TimeoutError:
            self._log.error("stop.timeout", advice="the antenna may still follow its registers: look at the ACU")
            return False

    def _after_tick(self) -> None:
        self._background.wake()
        self._ticked.set()
        if self._on_state is not None:
            self._on_state(self._area.state)
        if self._on_snapshot is not None and self._foreground.tick_count % self._snapshot_ticks == 0:
            self._on_snapshot(self.snapshot())

    def snapshot(self) -> Snapshot:
        """Everything people look at, now."""
        state, sky, now_tai_s = self._area.state, self._area.sky, self._clock.tai_s()
        status, reading, prediction = state.status, state.reading, sky.prediction
        miss_deg = None
        if reading is not None and reading.is_locked and prediction is not None:
            point = prediction.at(reading.tai_s)
            if point is not None:
                miss_deg = sky_angle_deg(reading.az_deg, reading.el_deg, point.az_deg, point.el_deg)
        lag_az_s, lag_el_s = state.lag_s(self._job.control)
        identity, lateness = self._foreground.identity, self._foreground.lateness.figures(LATENESS_TICKS)
        return Snapshot(
            tai_s=now_tai_s,
            state=str(state.track),
            az_deg=status.az_deg if status else None,
            el_deg=status.el_deg if status else None,
            reading_age_s=now_tai_s - reading.tai_s if reading else None,
            command_az_deg=state.axis_az.position_deg if state.axis_az else None,
            command_el_deg=state.axis_el.position_deg if state.axis_el else None,
            agc_db=status.agc_db if status else None,
            is_acquired=reading is not None and reading.is_locked,
            miss_deg=miss_deg,
            along_s=sky.fit.along_s if sky.fit else None,
            across_deg=sky.fit.across_deg if sky.fit else None,
            fit_age_s=now_tai_s - sky.fit.at_tai_s if sky.fit else None,
            sigma_deg=_sigma_deg(prediction, now_tai_s),
            inside_s=prediction.seconds_inside(now_tai_s, self._job.control.beamwidth_deg / 2) if prediction else None,
            buffer_s=max(0.0, prediction.end_tai_s - now_tai_s) if prediction else 0.0,
            buffer_kind=prediction.kind if prediction else "",
            lag_az_s=lag_az_s,
            lag_el_s=lag_el_s,
            tick_count=self._foreground.tick_count,
            skipped_tick_count=self._foreground.skipped_tick_count,
            lateness_p50_ms=lateness.p50_ms,
            lateness_p99_ms=lateness.p99_ms,
            lateness_max_ms=lateness.max_ms,
            write_count=self._foreground.write_count,
            answered_count=self._foreground.answered_count,
            attempt_count=self._port.attempt_count,
            refusal_count=state.gate_refusal_count,
            clamped_count=state.gate_clamped_count,
            arming=self._arming(),
            disarmed_by=state.disarmed_by,
            latch=state.latch,
            clock_alarm=self._foreground.clock_watch.alarm,
            line_alarm=self._foreground.line_watch.alarm,
            encoder_problem=state.encoders.problem,
            is_link_up=self._port.is_up,
            link_problem=self._port.problem,
            is_rehearsal=self._job.is_rehearsal,
            is_simulation=identity is not None and identity.is_simulated,
            model=str(self._area.model),
            rejecting=self._area.gate.rejecting if state.track in AUTOTRACKING else "",
            rejected_counts=self._area.rejected_counts,
        )

    def _arming(self) -> str:
        if self._job.control.is_shadow:
            return "shadow"
        return "armed" if self._area.state.is_armed(self._job.control) else "disarmed"

    def answer(self, line: str) -> str:
        """Answer a line of the control socket: `ok ...` or `error ...`; the next tick does what it asks."""
        if line == "status":
            return f"ok {json.dumps(asdict(self.snapshot()))}"
        if line not in set(Request):
            return f"error {line!r} is unknown, expected status, {', '.join(Request)}"
        return self._request(Request(line))

    def _request(self, request: Request) -> str:
        state = self._area.state
        if self._job.control.is_shadow:
            return f"error this daemon runs with --shadow: it commands nothing, so there is nothing to {request}"
        if request is Request.CLEAR and not state.latch:
            return "ok nothing is latched"
        self._foreground.ask(request)
        if request is Request.ARM and state.latch:
            return f"ok armed, but latched: {state.latch}; look at the antenna, then `acu-daemon clear`"
        return {
            Request.ARM: "ok armed",
            Request.DISARM: "ok disarmed: STOP is sent if the daemon moves the antenna, then nothing",
            Request.CLEAR: f"ok cleared: {state.latch}",
        }[request]

    def _outcome(self, reason: str, is_stopped: bool) -> Outcome:
        state, foreground = self._area.state, self._foreground
        lateness = foreground.lateness.figures()
        lag_az_s, lag_el_s = state.lag_s(self._job.control)
        return Outcome(
            reason=reason,
            has_acquired=state.has_acquired,
            has_begun=self._clock.tai_s() > self._job.coming.rise_tai_s,
            is_stopped=is_stopped,
            tick_count=foreground.tick_count,
            write_count=foreground.write_count,
            skipped_tick_count=foreground.skipped_tick_count,
            refit_count=self._area.refit_count,
            refit_failed_count=self._area.refit_failed_count,
            refusal_count=state.gate_refusal_count,
            clamped_count=state.gate_clamped_count,
            connect_count=self._port.connect_count,
            lag_az_s=lag_az_s,
            lag_el_s=lag_el_s,
            lateness_p50_ms=lateness.p50_ms,
            lateness_p99_ms=lateness.p99_ms,
            lateness_max_ms=lateness.max_ms,
        )


def _innermost(error: Exception) -> Exception:
    """The one error that task groups have wrapped, so that it keeps its exit status; several stay a group."""
    while isinstance(error, ExceptionGroup) and len(error.exceptions) == 1:
        error = error.exceptions[0]
    return error


def _sigma_deg(prediction: Prediction | None, tai_s: float) -> float | None:
    if prediction is None or prediction.sigma_deg is None:
        return None
    i = round((tai_s - prediction.start_tai_s) / prediction.step_s)
    return float(prediction.sigma_deg[min(max(i, 0), prediction.sigma_deg.size - 1)])
