"""The background: fits the orbit to locked readings and keeps the buffer filled (Aguirre and Medeiros 1988, 2.5)."""

import asyncio
from collections.abc import Callable
from math import inf
from typing import Any

import structlog

from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION
from acu_daemon.assist.session.refit import GateVerdict, RefitReply, RefitSetup
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.pass_plan import PlanAnswer, PlanRequest, planned_pass
from acu_daemon.control.tracking.state_table import AUTOTRACKING, HOLDING, TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.buffer_keeper import REFIT_PERIOD_S, BufferKeeper
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.fit import FitDiedError, FitFailedError, FitRunner
from acu_daemon.edge.tape import Note, no_note
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Model

RETRY_S = 0.5
PLAN_WAIT_S = 1.0  # for the fit process, which may have to start, where the pass is near
NEAR_S = 60.0  # before the antenna would set out at the latest
LONGEST_ANSWER_S = 5.0  # of the fit process
ANSWER_SHARE = 0.5  # of the low water is for its answer, the rest is left when the daemon predicts without it
LONGEST_PAUSE_S = 30.0  # a fit process that dies again and again is started this often at last
FIRST_FIT_COUNT = 5  # a fit to fewer readings is no better than the offset that carries the path until then


def fit_deadline_s(low_water_s: float) -> float:
    """How long an answer of the fit process may take, so that one that hangs is ended before the buffer is dry."""
    return min(LONGEST_ANSWER_S, ANSWER_SHARE * low_water_s)


class Background:
    """Owns the requests to the fit runner; the foreground only wakes it.

    Started again in a pass that had a fit, it begins with that.
    """

    def __init__(
        self,
        area: CommonArea,
        runner: FitRunner,
        clock: Clock,
        setup: RefitSetup,
        *,
        horizon_s: float,
        low_water_s: float,
        control: ControlConfig,
        on_fit: Callable[[FitResult], None] | None = None,
        on_estimate: Callable[[PassEstimate], None] | None = None,
        on_plan: Callable[[PlanAnswer], None] | None = None,
        note: Note = no_note,
    ) -> None:
        self._area = area
        self._runner = runner
        self._clock = clock
        self._low_water_s = low_water_s
        self._note = note
        self._buffer = BufferKeeper(area, setup, control, horizon_s=horizon_s, low_water_s=low_water_s, note=note)
        self._on_fit = on_fit
        self._on_estimate = on_estimate
        self._on_plan = on_plan
        self._setup, self._control = setup, control
        self._due = asyncio.Event()
        self._last_tai_s = -1e18
        self._has_asked = False
        self._is_waiting = False  # for the fit process
        self._is_refit_due = False
        self._plan_request: PlanRequest | None = None  # that has no plan yet
        self._kept_tai_s = -1e18
        self._died_count = 0  # in a row
        self._pause_until_tai_s = -1e18
        self._seen: TrackState | None = None
        self._verdict = GateVerdict()
        self._log: Any = structlog.get_logger("fit")
        if setup.is_resumed:
            self._buffer.resume(clock.tai_s())

    def wake(self) -> None:
        """Look whether a refit is due.  Called by the foreground after every tick; never blocks.

        While the fit process has not answered, the daemon itself keeps the buffer from running dry.
        """
        now_tai_s = self._clock.tai_s()
        if self._is_waiting and now_tai_s - self._kept_tai_s >= RETRY_S:
            self._kept_tai_s = now_tai_s
            self._buffer.fill(now_tai_s, ANSWER_SHARE * self._low_water_s)
        asked = self._plan_request
        if asked is not None and now_tai_s - asked.now_tai_s >= self._plan_wait_s(asked, now_tai_s):
            self._plan_here(asked)
        if self._is_due():
            self._is_refit_due = True
            self._due.set()

    async def run(self) -> None:
        while True:
            await self._due.wait()
            self._due.clear()
            if self._plan_request is not None:
                await self._plan(self._plan_request)
            if self._is_refit_due:
                self._is_refit_due = False
                await self._refit()

    @property
    def is_planning(self) -> bool:
        """Whether a plan is asked for that is not there yet."""
        return self._plan_request is not None

    def ask_plan(self, asked: PlanRequest) -> None:
        """Have the pass planned off the loop.  Called by the foreground; never blocks."""
        self._plan_request = asked
        self._due.set()

    async def _plan(self, asked: PlanRequest) -> None:
        try:
            planned = await self._runner.plan(asked)
        except FitFailedError as error:
            self._log.warning("plan.failed", reason=str(error))
            if self._plan_request is asked:
                self._plan_here(asked)
            return
        if self._plan_request is asked:
            self._take_plan(planned)

    def _plan_wait_s(self, asked: PlanRequest, now_tai_s: float) -> float:
        """How long the fit process may take: as long as it likes while the pass is far, no time once it is on."""
        before_s = asked.coming.rise_tai_s - now_tai_s
        if before_s > self._control.preposition_s + NEAR_S:
            return inf
        return PLAN_WAIT_S if before_s > 0.0 else 0.0

    def _plan_here(self, asked: PlanRequest) -> None:
        """Without the fit process: 15 to 50 ms in the loop, where a pass would begin without a plan."""
        self._take_plan(planned_pass(self._setup.propagator, self._setup.site, asked))

    def _take_plan(self, planned: PlanAnswer) -> None:
        self._plan_request = None
        if self._on_plan is not None:
            self._on_plan(planned)
        self.set_plan(planned.plan)

    def _is_due(self) -> bool:
        """At once when the pass is near and on a loss; each second while locked; at low water."""
        area, now_tai_s = self._area, self._clock.tai_s()
        before, self._seen = self._seen, area.state.tracking.track
        if area.state.intake.status is None or not self._buffer.is_near(now_tai_s):
            return False
        if not self._has_asked:
            return True
        is_loss = before in AUTOTRACKING and area.state.tracking.track in HOLDING
        if is_loss:
            return True
        since_last_s = now_tai_s - self._last_tai_s
        if not self._buffer.is_filled(now_tai_s, self._low_water_s):
            return since_last_s >= RETRY_S
        fewest = 1 if area.sky.fit else FIRST_FIT_COUNT
        return len(area.to_fit) >= fewest and since_last_s >= REFIT_PERIOD_S

    async def _refit(self) -> None:
        area = self._area
        self._last_tai_s = now_tai_s = self._clock.tai_s()
        if now_tai_s < self._pause_until_tai_s:
            self._buffer.fill(now_tai_s)
            return
        self._has_asked = True
        request = self._buffer.request(now_tai_s)
        self._is_waiting = True
        try:
            reply = await self._runner.refit(request)
        except (FitFailedError, OrbitError) as error:
            area.refit_failed_count += 1
            has_died = isinstance(error, FitDiedError)
            self._note(("Z", self._clock.tai_s(), has_died, str(error)))
            pause_s = self._pause_s(has_died=has_died)
            self._pause_until_tai_s = self._clock.tai_s() + pause_s
            self._log.warning("fit.failed", reason=str(error), pause_s=pause_s)
            self._buffer.fill(self._clock.tai_s())
            return
        finally:
            self._is_waiting = False
        self._died_count = 0
        took_ms = 1e3 * (self._clock.tai_s() - now_tai_s)
        self._log.debug("fit.done", readings=len(request.readings), took_ms=took_ms, fit=reply.fit)
        self._take(reply, has_readings=len(request.readings) > 0)

    def _pause_s(self, *, has_died: bool) -> float:
        """How long the fit process rests: not after its first death, then ever longer."""
        self._died_count = self._died_count + 1 if has_died else 0
        return min(2.0 ** (self._died_count - 2), LONGEST_PAUSE_S) if self._died_count > 1 else 0.0

    def _report(self, reply: RefitReply, before_model: Model | None) -> None:
        """Log what the gate and the choice of the model have changed."""
        before = self._verdict
        self._verdict = reply.gate
        if reply.gate.rejecting and reply.gate.rejecting != before.rejecting:
            log = self._log.info if reply.gate.rejecting == ABOVE_MAX_ELEVATION else self._log.warning
            log("fit.rejecting", reason=reply.gate.rejecting)
        elif before.rejecting and not reply.gate.rejecting:
            self._log.info("fit.accepting", rejected=reply.gate.counts)
        if reply.gate.reset_count > before.reset_count:
            self._log.warning("fit.reset", reason="newer readings belie what was fitted before")
        if reply.model is not before_model:
            before_it = str(before_model or "none")
            self._log.info("model.changed", model=str(reply.model), before=before_it)

    def _take(self, reply: RefitReply, *, has_readings: bool) -> None:
        area, before_model, had_fit = self._area, self._area.model, self._area.sky.fit is not None
        if not self._buffer.take(reply):
            area.refit_failed_count += 1
            self._log.warning("fit.refused", reason="not finite: the last good one stays")
            self._buffer.fill(self._clock.tai_s())
            return
        if reply.fit is not None and not had_fit:
            self._log.info(
                "fit.first",
                estimator=reply.fit.estimator,
                readings=reply.fit.reading_count,
                along_s=round(reply.fit.along_s, 3),
                across_deg=round(reply.fit.across_deg, 4),
            )
        if has_readings:
            self._report(reply, before_model)
        for note in reply.notes:
            self._log.warning("fit.note", note=note)
        if reply.fit is not None and self._on_fit is not None:
            self._on_fit(reply.fit)
        if reply.estimate is not None and self._on_estimate is not None:
            self._on_estimate(reply.estimate)
        area.refit_count += 1

    def set_plan(self, plan: PassPlan) -> None:
        """Take the plan of the pass; the buffer is made for it from then on, the first one at once.

        The fit process starts meanwhile.
        """
        self._has_asked = False
        self._buffer.set_plan(plan, self._clock.tai_s())
        self.wake()
