"""The background: fits the orbit to locked readings and keeps the buffer filled (Aguirre and Medeiros 1988, 2.5)."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import structlog

from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION
from acu_daemon.assist.session.refit import GateVerdict, RefitReply, RefitRequest, RefitSetup, before_fit, predict_from
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.finite import is_fit
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.approach import lead_s
from acu_daemon.control.tracking.path_offset import resume_pass
from acu_daemon.control.tracking.state_table import ACTIVE, AUTOTRACKING, HOLDING, TrackState
from acu_daemon.control.tracking.track_frame import extents
from acu_daemon.daemon.area import CommonArea
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.fit import FitDiedError, FitFailedError, FitRunner
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Model, Readings, ZenithCrossing
from acu_daemon.orbit.propagator import spans_tai_s
from acu_daemon.pointing.keyhole import longest_window_s

REFIT_PERIOD_S = 1.0  # an accepted fit replaces the buffer at least once a second while locked
PAST_S = 1.0  # the buffer starts this long before now: readings are compared at the time of their sample
LEAST_HORIZON_S = 10.0  # of a buffer, also where the satellite is about to decay
RETRY_S = 0.5
REACH_SLACK_S = 1.0
FROZEN_S = 5.0  # before its departure a crossing of the zenith is planned anew only for a sure gain
BESIDE = frozenset({TrackState.ACQUIRE_TLE, TrackState.AUTOTRACK_TLE, TrackState.HOLD_TLE, TrackState.SEARCH})
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
    ) -> None:
        self._area = area
        self._runner = runner
        self._clock = clock
        self._setup = setup
        self._horizon_s = horizon_s
        self._low_water_s = low_water_s
        self._control = control
        self._on_fit = on_fit
        self._on_estimate = on_estimate
        self._spans_tai_s = spans_tai_s(setup.propagator)
        self._due = asyncio.Event()
        self._last_tai_s = -1e18
        self._has_asked = False
        self._is_waiting = False  # for the fit process
        self._kept_tai_s = -1e18
        self._died_count = 0  # in a row
        self._pause_until_tai_s = -1e18
        self._seen: TrackState | None = None
        self._verdict = GateVerdict()
        self._log: Any = structlog.get_logger("fit")
        if setup.is_resumed:
            area.sky = replace(area.sky, fit=before_fit(setup, clock.tai_s()))
            area.state = resume_pass(area.state)

    def wake(self) -> None:
        """Look whether a refit is due.  Called by the foreground after every tick; never blocks.

        While the fit process has not answered, the daemon itself keeps the buffer from running dry.
        """
        now_tai_s = self._clock.tai_s()
        if self._is_waiting and now_tai_s - self._kept_tai_s >= RETRY_S:
            self._kept_tai_s = now_tai_s
            self._predict_here(now_tai_s, ANSWER_SHARE * self._low_water_s)
        if self._is_due():
            self._due.set()

    async def run(self) -> None:
        while True:
            await self._due.wait()
            self._due.clear()
            await self._refit()

    def _is_due(self) -> bool:
        """At once when the pass is near and on a loss; each second while locked; at low water."""
        area, now_tai_s = self._area, self._clock.tai_s()
        before, self._seen = self._seen, area.state.tracking.track
        if area.state.intake.status is None or not self._is_near(now_tai_s):
            return False
        if not self._has_asked:
            return True
        is_loss = before in AUTOTRACKING and area.state.tracking.track in HOLDING
        if is_loss:
            return True
        since_last_s = now_tai_s - self._last_tai_s
        if not self._is_filled(now_tai_s, self._low_water_s):
            return since_last_s >= RETRY_S
        fewest = 1 if area.sky.fit else FIRST_FIT_COUNT
        return len(area.to_fit) >= fewest and since_last_s >= REFIT_PERIOD_S

    def _is_near(self, now_tai_s: float) -> bool:
        plan = self._area.sky.plan
        if plan is None or self._area.state.tracking.track in ACTIVE:
            return plan is not None
        return now_tai_s >= plan.rise_tai_s - lead_s(plan, self._area.state, self._control) - REFIT_PERIOD_S

    async def _refit(self) -> None:
        area = self._area
        self._last_tai_s = now_tai_s = self._clock.tai_s()
        if now_tai_s < self._pause_until_tai_s:
            self._predict_here(now_tai_s)
            return
        self._has_asked = True
        request = self._request(now_tai_s, area.take_readings())
        self._is_waiting = True
        try:
            reply = await self._runner.refit(request)
        except (FitFailedError, OrbitError) as error:
            area.refit_failed_count += 1
            pause_s = self._pause_s(has_died=isinstance(error, FitDiedError))
            self._pause_until_tai_s = self._clock.tai_s() + pause_s
            self._log.warning("fit.failed", reason=str(error), pause_s=pause_s)
            self._predict_here(self._clock.tai_s())
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

    def _predict_here(self, now_tai_s: float, low_water_s: float | None = None) -> None:
        """Without the fit process: keep the buffer filled from the last fit, else the elements; 2 ms in the loop."""
        sky = self._area.sky
        if self._is_filled(now_tai_s, self._low_water_s if low_water_s is None else low_water_s):
            return
        request = self._request(now_tai_s, Readings.of([]))
        try:
            fit, model = self._in_force(now_tai_s)
            prediction = predict_from(self._setup, fit, request, model)
        except OrbitError as error:
            self._log.warning("prediction.failed", reason=str(error))
            return
        if not prediction.is_finite:
            self._log.warning("prediction.failed", reason="not finite: the last good one stays")
            return
        self._area.sky = replace(sky, prediction=prediction)

    def _in_force(self, now_tai_s: float) -> tuple[FitResult | None, Model]:
        """What the last buffer was made from, so that the next one goes on from it."""
        fit, model = self._area.sky.fit, self._area.model
        if fit is not None:
            return fit, Model.NEW_FIT
        carried = None if model is Model.ELEMENTS else before_fit(self._setup, now_tai_s)
        return carried, Model.ELEMENTS if carried is None else Model.LAST_PASS

    def _request(self, now_tai_s: float, readings: Readings) -> RefitRequest:
        past_s, ahead_s = self._reach_s(now_tai_s)
        start_tai_s = now_tai_s - PAST_S - past_s
        known_s = self._spans_tai_s[-1][1] - start_tai_s
        return RefitRequest(
            readings=readings,
            start_tai_s=start_tai_s,
            horizon_s=max(min(self._horizon_s + PAST_S + past_s + ahead_s, known_s), LEAST_HORIZON_S),
            now_tai_s=now_tai_s,
            near_az_deg=self._near_az_deg(now_tai_s),
            zenith_turn=self._area.sky.plan.zenith_turn if self._area.sky.plan else 0,
            in_hand=self._in_hand(now_tai_s),
        )

    def _in_hand(self, now_tai_s: float) -> ZenithCrossing | None:
        """The crossing of the zenith that is gone on with, though the fit moves its path."""
        crossing = self._area.sky.prediction.crossing if self._area.sky.prediction else None
        return crossing if crossing is not None and now_tai_s >= crossing.departure_tai_s - FROZEN_S else None

    def _is_filled(self, now_tai_s: float, low_water_s: float) -> bool:
        """Whether the buffer holds so much ahead of now, and before it what a satellite that is late asks for."""
        prediction = self._area.sky.prediction
        past_s, ahead_s = self._reach_s(now_tai_s)
        if prediction is None or prediction.end_tai_s - now_tai_s < low_water_s + ahead_s:
            return False
        return prediction.start_tai_s - REACH_SLACK_S <= now_tai_s - past_s

    def _reach_s(self, now_tai_s: float) -> tuple[float, float]:
        """How far before and beyond its time a path is looked up for a satellite that is late or early.

        Less where an ephemeris has not so much.
        """
        if self._area.state.tracking.track not in BESIDE:
            return 0.0, 0.0
        reach_s = math.ceil(extents(self._area.sky.prediction, self._control)[0])
        lead_in_s = PAST_S + longest_window_s(self._setup.azimuth)
        start, end = next(((a, b) for a, b in self._spans_tai_s if a <= now_tai_s <= b), (now_tai_s, now_tai_s))
        return min(reach_s, max(now_tai_s - lead_in_s - start, 0.0)), min(
            reach_s, max(end - now_tai_s - self._horizon_s, 0.0)
        )

    def _near_az_deg(self, tai_s: float) -> float:
        """The turn on which the path continues: the last buffer's, but the antenna's while it tracks by itself."""
        state, sky = self._area.state, self._area.sky
        if sky.plan is not None and (sky.prediction is None or tai_s < sky.plan.start_tai_s):
            return sky.plan.start_az_deg
        point = sky.prediction.at(tai_s, follow=False) if sky.prediction else None
        if point is not None and abs(point.az_deg - state.intake.az_deg) < 180.0:
            return point.az_deg
        if state.tracking.track in AUTOTRACKING:
            return state.intake.az_deg
        if point is not None:
            return point.az_deg
        return state.intake.az_deg

    def _report(self, reply: RefitReply) -> None:
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
        if reply.model is not self._area.model:
            before_it = str(self._area.model or "none")
            self._log.info("model.changed", model=str(reply.model), before=before_it)

    def _take(self, reply: RefitReply, *, has_readings: bool) -> None:
        area = self._area
        if not reply.prediction.is_finite or (reply.fit is not None and not is_fit(reply.fit)):
            area.refit_failed_count += 1
            self._log.warning("fit.refused", reason="not finite: the last good one stays")
            self._predict_here(self._clock.tai_s())
            return
        if reply.fit is not None and area.sky.fit is None:
            self._log.info(
                "fit.first",
                estimator=reply.fit.estimator,
                readings=reply.fit.reading_count,
                along_s=round(reply.fit.along_s, 3),
                across_deg=round(reply.fit.across_deg, 4),
            )
        if has_readings:
            self._report(reply)
        for note in reply.notes:
            self._log.warning("fit.note", note=note)
        if reply.fit is not None and self._on_fit is not None:
            self._on_fit(reply.fit)
        if reply.estimate is not None and self._on_estimate is not None:
            self._on_estimate(reply.estimate)
        area.refit_count += 1
        area.gate = reply.gate
        area.sky = replace(area.sky, prediction=reply.prediction, fit=reply.fit)

    def set_plan(self, plan: PassPlan) -> None:
        """Take the plan of the pass; the buffer is made for it from then on, the first one at once.

        The fit process starts meanwhile.
        """
        self._area.sky = replace(self._area.sky, plan=plan)
        self._has_asked = False
        now_tai_s = self._clock.tai_s()
        if self._is_near(now_tai_s):
            self._predict_here(now_tai_s)
        self.wake()
