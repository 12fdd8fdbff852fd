"""What the background puts into the common area: the buffer, the fit, the plan.

The background has it beside the fit process, a replay beside a recording: one code fills both.  No IO, no clock.
"""

import math
from dataclasses import replace
from typing import Any

import structlog

from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, before_fit, predict_from
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.finite import is_fit
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.approach import lead_s
from acu_daemon.control.tracking.causes import may_lead_past_zenith
from acu_daemon.control.tracking.path_offset import resume_pass
from acu_daemon.control.tracking.state_table import ACTIVE, AUTOTRACKING, TRACKING, TrackState
from acu_daemon.control.tracking.track_frame import extents
from acu_daemon.daemon.area import CommonArea
from acu_daemon.edge.tape import Note, no_note
from acu_daemon.errors import OrbitError
from acu_daemon.model import FitResult, Model, Readings, ZenithCrossing
from acu_daemon.orbit.propagator import spans_tai_s
from acu_daemon.pointing.keyhole import longest_window_s
from acu_daemon.pointing.plunge import PLUNGED_DEG

REFIT_PERIOD_S = 1.0  # an accepted fit replaces the buffer at least once a second while locked
PAST_S = 1.0  # the buffer starts this long before now: readings are compared at the time of their sample
LEAST_HORIZON_S = 10.0  # of a buffer, also where the satellite is about to decay
REACH_SLACK_S = 1.0
FROZEN_S = 5.0  # before its departure a crossing of the zenith is planned anew only for a sure gain
BESIDE = frozenset({TrackState.ACQUIRE_TLE, TrackState.AUTOTRACK_TLE, TrackState.HOLD_TLE, TrackState.SEARCH})


class BufferKeeper:
    """Owner of the area's `sky`.  Begun again in a pass that had a fit, it goes on from that."""

    def __init__(
        self,
        area: CommonArea,
        setup: RefitSetup,
        control: ControlConfig,
        *,
        horizon_s: float,
        low_water_s: float,
        note: Note = no_note,
    ) -> None:
        self._area, self._setup, self._control, self._note = area, setup, control, note
        self._horizon_s, self.low_water_s = horizon_s, low_water_s
        self._spans_tai_s = spans_tai_s(setup.propagator)
        self._log: Any = structlog.get_logger("fit")

    def resume(self, now_tai_s: float) -> None:
        """Begin with the fit that this pass had before the daemon was started again, where it had one."""
        if self._setup.is_resumed:
            self._note(("U", now_tai_s))
            self._area.sky = replace(self._area.sky, fit=before_fit(self._setup, now_tai_s))
            self._area.state = resume_pass(self._area.state)

    def set_plan(self, plan: PassPlan, now_tai_s: float) -> None:
        """The plan of the pass, and the first buffer for it where the pass is near."""
        self._note(("S", now_tai_s))
        self._area.sky = replace(self._area.sky, plan=plan)
        if self.is_near(now_tai_s):
            self.fill(now_tai_s)

    def is_near(self, now_tai_s: float) -> bool:
        """Whether the antenna is about to set out for the pass, or on it."""
        plan = self._area.sky.plan
        if plan is None or self._area.state.tracking.track in ACTIVE:
            return plan is not None
        return now_tai_s >= plan.rise_tai_s - lead_s(plan, self._area.state, self._control) - REFIT_PERIOD_S

    def fill(self, now_tai_s: float, low_water_s: float | None = None) -> None:
        """Without the fit process: keep the buffer filled from the last fit, else the elements; 2 ms in the loop."""
        if self.is_filled(now_tai_s, self.low_water_s if low_water_s is None else low_water_s):
            return
        self._note(("B", now_tai_s, low_water_s))
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
        self._area.sky = replace(self._area.sky, prediction=prediction)

    def _in_force(self, now_tai_s: float) -> tuple[FitResult | None, Model]:
        """What the last buffer was made from, so that the next one goes on from it."""
        fit, model = self._area.sky.fit, self._area.model
        if fit is not None:
            return fit, Model.NEW_FIT
        carried = None if model is Model.ELEMENTS else before_fit(self._setup, now_tai_s)
        return carried, Model.ELEMENTS if carried is None else Model.LAST_PASS

    def request(self, now_tai_s: float) -> RefitRequest:
        """What the fit is asked, with the readings that wait for it."""
        self._note(("A", now_tai_s))
        return self._request(now_tai_s, self._area.take_readings())

    def _request(self, now_tai_s: float, readings: Readings) -> RefitRequest:
        state, sky = self._area.state, self._area.sky
        past_s, ahead_s = self._reach_s(now_tai_s)
        start_tai_s = now_tai_s - PAST_S - past_s
        known_s = self._spans_tai_s[-1][1] - start_tai_s
        return RefitRequest(
            readings=readings,
            start_tai_s=start_tai_s,
            horizon_s=max(min(self._horizon_s + PAST_S + past_s + ahead_s, known_s), LEAST_HORIZON_S),
            now_tai_s=now_tai_s,
            near_az_deg=self._near_az_deg(now_tai_s),
            zenith_turn=sky.plan.zenith_turn if sky.plan else 0,
            in_hand=self._in_hand(now_tai_s),
            may_plunge=state.tracking.track not in AUTOTRACKING or may_lead_past_zenith(sky, self._control),
            is_plunged=self._is_plunged(now_tai_s),
        )

    def _is_plunged(self, now_tai_s: float) -> bool:
        """Whether the antenna tracks the pass beyond the zenith, and is on no way over it; not one that was left so."""
        state, sky = self._area.state, self._area.sky
        crossing = sky.prediction.crossing if sky.prediction else None
        is_here = state.tracking.track in TRACKING or (sky.plan is not None and sky.plan.is_plunged)
        is_past = crossing is None or now_tai_s > crossing.return_tai_s
        return state.intake.el_deg > PLUNGED_DEG and is_here and is_past

    def _in_hand(self, now_tai_s: float) -> ZenithCrossing | None:
        """The crossing of the zenith that is gone on with, though the fit moves its path."""
        crossing = self._area.sky.prediction.crossing if self._area.sky.prediction else None
        if crossing is None or now_tai_s < crossing.departure_tai_s - FROZEN_S:
            return None
        is_missed = crossing.is_plunge and self._area.state.tracking.track in AUTOTRACKING
        return None if is_missed and now_tai_s > crossing.return_tai_s else crossing

    def is_filled(self, now_tai_s: float, low_water_s: float) -> bool:
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

    def take(self, reply: RefitReply) -> bool:
        """Take the fit's answer.  False: it is not finite, and the last good one stays."""
        self._note(("F", reply))
        if not reply.prediction.is_finite or (reply.fit is not None and not is_fit(reply.fit)):
            return False
        self._area.gate = reply.gate
        self._area.sky = replace(self._area.sky, prediction=reply.prediction, fit=reply.fit)
        return True
