"""When the background asks the fit process, for what, what it tells, and what it does while nobody answers."""

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_orbits import circular, site, visible
from memories import remembering
from structlog.testing import capture_logs
from test_tick import ready, status

from acu_daemon.assist.estimators.full.carry_over import carry_over_of
from acu_daemon.assist.estimators.full.estimated_states import STATE_COUNT
from acu_daemon.assist.reading_gate import ABOVE_MAX_ELEVATION, OFF_PATH
from acu_daemon.assist.session.refit import GateVerdict, RefitReply, RefitRequest, RefitSetup
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import PassPlan, Sky
from acu_daemon.control.tracking.approach import lead_s
from acu_daemon.control.tracking.pass_plan import PlanAnswer, PlanRequest
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon import background as planner
from acu_daemon.daemon import buffer_keeper as module
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.background import PLAN_WAIT_S, Background
from acu_daemon.daemon.buffer_keeper import BESIDE, PAST_S
from acu_daemon.edge.fit import FitFailedError
from acu_daemon.model import AxisLimits, Correction, FitResult, Model, Pass, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keyhole import longest_window_s

AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
WHERE, SOURCE = site(6.0, 3.0), circular()
SETUP = RefitSetup(SOURCE, WHERE, "full", EstimatorSettings(0.03, 0.03), AZIMUTH)
RISE = float(visible(SOURCE, WHERE, 1.0)[0])
NOW = RISE + 100.0
PLAN = PassPlan(RISE, RISE + 600.0, RISE, 50.0, 5.0)
CONFIG_HERE = ControlConfig(Envelope(AZIMUTH, ELEVATION))
HORIZON_S, LOW_S = 90.0, 30.0
WINDOW_S = longest_window_s(AZIMUTH)
FIT = FitResult("full", Correction(), NOW, 100, 0, 0.01, 0.1, 0.01)


def buffer(start_s: float, end_s: float, az_deg: float = 100.0, model: Model = Model.ELEMENTS) -> Prediction:
    """From start_s to end_s after NOW, standing still."""
    t = np.zeros(round((end_s - start_s) / 0.1) + 1)
    az, el = az_deg + t, 40.0 + t
    return Prediction(NOW + start_s, 0.1, az, el, t, t, az, t, model.kind, NOW, model=model)


FULL = buffer(-20.0, 150.0)


class Room:
    """A background at a clock that the test sets, with a fit process that gives what the test says."""

    def __init__(
        self, track: TrackState = TrackState.AUTOTRACK_FITTED, sky: Sky | None = None, setup: RefitSetup = SETUP
    ) -> None:
        self.now = NOW
        clock: Any = SimpleNamespace(tai_s=lambda: self.now)
        self.area = CommonArea(state=ready(track, status()), sky=sky or Sky(FULL, FIT, PLAN))
        self.asked: list[RefitRequest] = []
        self.reply = RefitReply(FIT, FULL, model=Model.NEW_FIT)
        self.fits: list[FitResult] = []
        runner: Any = SimpleNamespace(refit=self._refit)
        self.background = Background(
            self.area,
            runner,
            clock,
            setup,
            horizon_s=HORIZON_S,
            low_water_s=LOW_S,
            control=CONFIG_HERE,
            on_fit=self.fits.append,
        )

    async def _refit(self, request: RefitRequest) -> RefitReply:
        self.asked.append(request)
        return self.reply

    def give(self, count: int) -> None:
        self.area.to_fit.extend(Reading(self.now, 100.0, 40.0, True) for _ in range(count))

    def track(self, track: TrackState) -> None:
        self.area.state = remembering(self.area.state, track=track)

    async def refit(self, reply: RefitReply | None = None) -> None:
        self.reply = reply or self.reply
        await self.background._refit()

    def is_due(self, after_s: float = 0.0) -> bool:
        self.now += after_s
        self.background._due.clear()
        self.background.wake()
        return self.background._due.is_set()


def test_it_asks_at_once_when_the_pass_is_near_and_the_antenna_is_known_and_else_not() -> None:
    room = Room(TrackState.IDLE, Sky(None, None, PLAN))
    lead = lead_s(PLAN, room.area.state, CONFIG_HERE) + 1.0
    room.now = RISE - lead - 0.1
    assert not room.is_due()
    assert room.is_due(0.2)
    room.area.state = remembering(room.area.state, status=None)
    assert not room.is_due()
    assert not Room(TrackState.AUTOTRACK_TLE, Sky(FULL, None, None)).is_due()
    early = Room(TrackState.PREPOSITION, Sky(None, None, PLAN))
    early.now = RISE - 5000.0
    assert early.is_due()


@pytest.mark.parametrize(("fit", "fewest"), [(None, 5), (FIT, 1)])
async def test_while_locked_it_asks_each_second_where_there_are_readings_enough(
    fit: FitResult | None, fewest: int
) -> None:
    room = Room(sky=Sky(FULL, fit, PLAN))
    room.reply = replace(room.reply, fit=fit)
    await room.refit()
    room.give(fewest - 1)
    assert not room.is_due(1.5)
    room.give(1)
    assert room.is_due()
    await room.refit()
    room.give(fewest)
    assert not room.is_due(0.9)
    assert room.is_due(0.2)
    assert len(room.asked[-1].readings) == fewest
    await room.refit()
    assert len(room.asked[-1].readings) == fewest
    assert not room.area.to_fit


async def test_a_loss_is_asked_about_once_and_at_once() -> None:
    for track in (TrackState.HOLD_FITTED, TrackState.HOLD_TLE):
        room = Room()
        await room.refit()
        assert not room.is_due()
        room.track(track)
        assert room.is_due()
        assert not room.is_due()
        room.track(TrackState.SEARCH)
        assert not room.is_due()


@pytest.mark.parametrize("track", [TrackState.HOLD_FITTED, TrackState.HOLD_TLE])
@pytest.mark.parametrize("side", ["ahead", "behind"])
async def test_at_low_water_it_asks_each_half_second_until_there_is_more(track: TrackState, side: str) -> None:
    """What a satellite that is late or early asks for belongs to it, where one is searched."""
    beside_s = 10.0 if track in BESIDE else 0.0
    ends = {"ahead": (-beside_s - 1.0, LOW_S + beside_s), "behind": (-beside_s + 1.0, 150.0)}[side]
    for change_s, is_due in ((0.2, False), (-0.2, True)):
        room = Room(track)
        room.background._seen = track
        start, end = (ends[0], ends[1] + change_s) if side == "ahead" else (ends[0] - change_s, ends[1])
        await room.refit(replace(room.reply, prediction=buffer(start, end)))
        room.now += 0.4
        room.area.sky = replace(room.area.sky, prediction=_shifted(buffer(start, end), 0.4))
        assert not room.is_due()
        room.now += 0.2
        room.area.sky = replace(room.area.sky, prediction=_shifted(buffer(start, end), 0.6))
        assert room.is_due() is is_due


def _shifted(prediction: Prediction, by_s: float) -> Prediction:
    return replace(prediction, start_tai_s=prediction.start_tai_s + by_s)


@pytest.mark.parametrize("track", list(TrackState))
async def test_the_buffer_that_is_asked_for_begins_before_now_and_reaches_beyond_the_horizon_where_one_may_be_late(
    track: TrackState,
) -> None:
    room = Room(track)
    await room.refit()
    (request,) = room.asked
    beside_s = 10.0 if track in BESIDE else 0.0
    assert request.start_tai_s == pytest.approx(NOW - PAST_S - beside_s)
    assert request.start_tai_s + request.horizon_s == pytest.approx(NOW + HORIZON_S + beside_s)
    assert request.now_tai_s == NOW


@pytest.mark.parametrize(
    ("from_s", "to_s", "past_s", "ahead_s"),
    [
        (-1000.0, 1000.0, 10.0, 10.0),
        (-30.0, 1000.0, 10.0, 10.0),
        (-20.0, 1000.0, 20.0 - WINDOW_S - PAST_S, 10.0),
        (-13.0, 1000.0, 0.0, 10.0),
        (-1000.0, 95.0, 10.0, 5.0),
        (-1000.0, 80.0, 10.0, 0.0),
    ],
)
def test_an_ephemeris_that_has_not_so_much_is_asked_for_what_it_has(
    from_s: float, to_s: float, past_s: float, ahead_s: float
) -> None:
    room = Room(TrackState.SEARCH)
    room.background._buffer._spans_tai_s = ((NOW - 9000.0, NOW - 8000.0), (NOW + from_s, NOW + to_s))
    assert room.background._buffer._reach_s(NOW) == pytest.approx((past_s, ahead_s), abs=0.01)
    request = room.background._buffer._request(NOW, room.area.take_readings())
    assert request.start_tai_s == pytest.approx(NOW - PAST_S - past_s, abs=0.01)
    assert request.start_tai_s + request.horizon_s == pytest.approx(NOW + min(HORIZON_S + ahead_s, to_s), abs=0.01)


@pytest.mark.parametrize(
    ("track", "at_s", "path_az_deg", "stands_az_deg", "near_az_deg"),
    [
        (TrackState.PREPOSITION, -1.0, 100.0, 100.0, 50.0),  # before the pass: on the turn of the plan
        (TrackState.HOLD_FITTED, 100.0, 100.0, 279.0, 100.0),
        (TrackState.HOLD_FITTED, 100.0, 100.0, -79.0, 100.0),
        (TrackState.AUTOTRACK_FITTED, 100.0, 100.0, -79.0, 100.0),
        (TrackState.AUTOTRACK_FITTED, 100.0, 100.0, -81.0, -81.0),  # autotrack has gone another way round
        (TrackState.AUTOTRACK_TLE, 100.0, 100.0, 281.0, 281.0),
        (TrackState.HOLD_FITTED, 100.0, 100.0, -100.0, 100.0),
        (TrackState.HOLD_TLE, 500.0, 100.0, 260.0, 260.0),  # outside the buffer
        (TrackState.AUTOTRACK_TLE, 500.0, 100.0, 260.0, 260.0),
    ],
)
def test_the_path_goes_on_on_the_turn_of_the_last_buffer_but_autotracks_where_it_has_gone_round(
    track: TrackState, at_s: float, path_az_deg: float, stands_az_deg: float, near_az_deg: float
) -> None:
    room = Room(track, Sky(buffer(-200.0, 150.0, path_az_deg), FIT, PLAN))
    room.area.state = remembering(room.area.state, az_deg=stands_az_deg)
    assert room.background._buffer._near_az_deg(RISE + at_s) == near_az_deg
    room.area.sky = Sky(None, None, PLAN)
    assert room.background._buffer._near_az_deg(RISE + at_s) == 50.0
    room.area.sky = Sky(None, None, None)
    assert room.background._buffer._near_az_deg(RISE + at_s) == stands_az_deg


def events(logs: list[Any]) -> list[tuple[str, str]]:
    return [(log["event"], log["log_level"]) for log in logs if log["log_level"] != "debug"]


async def test_what_the_gate_says_is_told_when_it_changes_and_only_of_readings() -> None:
    room = Room(sky=Sky(FULL, None, PLAN))
    steps: list[tuple[Any, int, list[tuple[str, str]]]] = [
        (GateVerdict(), 1, [("fit.first", "info"), ("model.changed", "info")]),
        (GateVerdict(), 1, []),
        (GateVerdict(OFF_PATH), 1, [("fit.rejecting", "warning")]),
        (GateVerdict(OFF_PATH), 1, []),
        (GateVerdict(), 0, []),
        (GateVerdict(ABOVE_MAX_ELEVATION), 1, [("fit.rejecting", "info")]),
        (GateVerdict("", {}, 1), 1, [("fit.accepting", "info"), ("fit.reset", "warning")]),
        (GateVerdict("", {}, 1), 1, []),
        (GateVerdict("", {}, 2), 1, [("fit.reset", "warning")]),
    ]
    for k, (verdict, reading_count, expected) in enumerate(steps):
        room.give(reading_count)
        with capture_logs() as logs:
            fitted = replace(FULL, kind="FITTED", model=Model.NEW_FIT)
            await room.refit(replace(room.reply, gate=verdict, prediction=fitted))
        assert events(logs) == expected, k
        assert room.area.gate == verdict
    assert room.area.refit_count == len(steps)
    assert room.fits == [FIT] * len(steps)


async def test_what_is_not_finite_is_refused_told_and_counted_and_the_last_good_one_stays() -> None:
    wrong = replace(FULL, el_deg=FULL.el_deg * np.nan)
    for reply in (
        RefitReply(FIT, wrong, model=Model.NEW_FIT),
        RefitReply(replace(FIT, across_deg=np.inf), FULL, model=Model.NEW_FIT),
    ):
        room = Room()
        with capture_logs() as logs:
            await room.refit(reply)
        assert events(logs) == [("fit.refused", "warning")]
        assert room.area.sky == Sky(FULL, FIT, PLAN)
        assert (room.area.refit_failed_count, room.area.refit_count, room.fits) == (1, 0, [])


async def test_notes_are_told_each_time() -> None:
    room = Room()
    with capture_logs() as logs:
        await room.refit(replace(room.reply, notes=("one", "two")))
    assert events(logs) == [("fit.note", "warning")] * 2


class Predictions:
    """Counts what the daemon predicts itself."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.made: list[tuple[FitResult | None, Model, float]] = []
        monkeypatch.setattr(module, "predict_from", self._predict)

    def _predict(self, _setup: Any, fit: FitResult | None, request: RefitRequest, model: Model) -> Prediction:
        self.made.append((fit, model, request.now_tai_s - NOW))
        return FULL


async def test_while_the_fit_process_does_not_answer_the_daemon_predicts_itself_below_half_of_the_low_water(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = Predictions(monkeypatch)
    waiting = asyncio.Event()

    async def never(_request: RefitRequest) -> RefitReply:
        await waiting.wait()
        raise AssertionError

    room = Room(TrackState.HOLD_FITTED, Sky(buffer(-20.0, LOW_S - 5.0), FIT, PLAN))
    room.background._runner.refit = never  # type: ignore[method-assign]
    task = asyncio.ensure_future(room.background._refit())
    await asyncio.sleep(0)
    for _ in range(9):
        room.is_due(1.0)
    assert made.made == []  # 16 s are left, half of the low water is 15
    room.is_due(2.0)
    assert made.made == [(FIT, Model.NEW_FIT, 11.0)]
    room.area.sky = replace(room.area.sky, prediction=buffer(-20.0, 12.0))
    room.is_due(0.3)
    assert len(made.made) == 1
    room.is_due(0.3)
    assert len(made.made) == 2
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    room.area.sky = replace(room.area.sky, prediction=buffer(-20.0, 12.0))
    room.is_due(5.0)
    assert len(made.made) == 2  # nobody is waited for


def test_a_new_plan_is_predicted_for_and_asked_about_at_once_where_its_pass_is_near(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for before_s, is_near in ((100.0, True), (2000.0, False)):
        made = Predictions(monkeypatch)
        room = Room(TrackState.IDLE, Sky(None, None, None))
        room.now = RISE - before_s
        room.background._has_asked = True
        room.background.set_plan(PLAN)
        assert room.area.sky.plan == PLAN
        assert bool(made.made) is is_near
        assert room.background._due.is_set() is is_near


@pytest.mark.parametrize("before_s", [100.0, 2000.0])
@pytest.mark.parametrize("answer", ["comes", "fails", "does not come"])
async def test_a_plan_is_made_by_the_fit_process_and_where_that_does_not_answer_before_it_is_needed(
    answer: str, before_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    theirs, ours = PlanAnswer(replace(PLAN, note="theirs")), PlanAnswer(replace(PLAN, note="ours"))
    monkeypatch.setattr(planner, "planned_pass", lambda *_: ours)
    Predictions(monkeypatch)
    room = Room(TrackState.IDLE, Sky(None, None, None))
    room.now = RISE - before_s
    told, never = [], asyncio.Event()
    room.background._on_plan = told.append

    async def plan(_: PlanRequest) -> PlanAnswer:
        if answer == "fails":
            raise FitFailedError("it failed")
        if answer == "does not come":
            await never.wait()
        return theirs

    room.background._runner.plan = plan  # type: ignore[method-assign]
    coming = Pass(RISE, RISE + 100.0, RISE + 200.0, 0.0, 50.0, 90.0, 180.0)
    asked = PlanRequest(coming, 0.0, 45.0, CONFIG_HERE.envelope, room.now, 0, SETUP.keyhole)
    room.background.ask_plan(asked)
    room.background.ask_plan(replace(asked, now_tai_s=room.now + 0.1))  # it is asked for at every tick
    task = asyncio.create_task(room.background.run())
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    has_waited = answer == "does not come"
    assert bool(told) is not has_waited
    room.is_due(PLAN_WAIT_S - 0.1)
    assert bool(told) is not has_waited
    room.is_due(0.2)
    expected = [] if has_waited and before_s > 1000.0 else [theirs if answer == "comes" else ours]
    assert told == expected
    assert room.area.sky.plan == (expected[0].plan if expected else None)
    never.set()
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


@pytest.mark.parametrize("before_s", [-10.0, 0.0])
async def test_a_pass_that_is_on_is_planned_at_once_and_the_fit_process_is_not_waited_for(
    before_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours = PlanAnswer(replace(PLAN, note="ours"))
    monkeypatch.setattr(planner, "planned_pass", lambda *_: ours)
    Predictions(monkeypatch)
    room = Room(TrackState.IDLE, Sky(None, None, None))
    room.now = RISE - before_s
    coming = Pass(RISE, RISE + 100.0, RISE + 200.0, 0.0, 50.0, 90.0, 180.0)
    room.background.ask_plan(PlanRequest(coming, 0.0, 45.0, CONFIG_HERE.envelope, room.now, 0, SETUP.keyhole))
    assert room.background.is_planning
    room.is_due(0.0)
    assert room.area.sky.plan == ours.plan
    assert not room.background.is_planning


def test_without_the_fit_process_the_next_buffer_is_made_from_what_the_last_one_was() -> None:
    room = Room()
    assert room.background._buffer._in_force(NOW) == (FIT, Model.NEW_FIT)
    room.area.sky = Sky(FULL, None, PLAN)
    assert room.background._buffer._in_force(NOW) == (None, Model.ELEMENTS)
    room.area.sky = Sky(replace(FULL, model=Model.LAST_PASS), None, PLAN)
    assert room.background._buffer._in_force(NOW) == (None, Model.ELEMENTS)  # nothing was left by a pass before


@pytest.mark.parametrize("is_of_this_pass", [False, True])
def test_started_again_in_a_pass_that_had_a_fit_it_begins_with_that_and_the_pass_counts_as_acquired(
    is_of_this_pass: bool,
) -> None:
    fit = replace(FIT, reading_count=500, at_tai_s=NOW - 30.0, covariance=np.diag(np.full(STATE_COUNT, 1e-10)))
    carried = carry_over_of(fit, SOURCE, WHERE)
    assert carried is not None
    setup = replace(SETUP, carried=replace(carried, is_of_this_pass=is_of_this_pass))
    room = Room(sky=Sky(FULL, None, PLAN), setup=setup)
    assert (room.area.sky.fit is not None) is is_of_this_pass
    assert room.area.state.signal.has_acquired is is_of_this_pass
    assert room.area.sky.prediction is FULL
