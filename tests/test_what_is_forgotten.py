"""What each occasion makes the decision forget, field by field of its memory; all else is kept."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Any

import pytest
import test_tick
from memories import remembering
from test_tick import AZ_DEG, EL_DEG, FITTED, NOW, PLAN, SKY, ready, saw, status

from acu_daemon.acu.commands import (
    AcuMode,
    Backup,
    Command,
    Identify,
    ReadCommanded,
    ReadFaults,
    ReadTurnChoice,
    SelectMode,
    SetWatchdog,
    Stop,
)
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, FaultReport
from acu_daemon.control.extra_exchange import EXTRA_REPEAT_S
from acu_daemon.control.safety.axis_watch import AxesWatch, AxisSeen, AxisWatch, Duty
from acu_daemon.control.safety.encoder_watch import EncoderWatch
from acu_daemon.control.safety.turn import Phase, TurnWatch
from acu_daemon.control.state import ControlState, Held, Lag, PathOffset, Scan, Sent, StartStage, Watchdog
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, Request, Sky, StowBy, TickInput
from acu_daemon.control.tracking.lag import LagEstimate
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import Model, Reading
from acu_daemon.pointing.axis import AxisState

CONFIG = replace(test_tick.CONFIG, register_watchdog_s=2.0)
HOLDING = status(AcuMode.REMOTE_BACKUP)
IN_AUTOTRACK = status()
IN_STANDBY = status(AcuMode.STANDBY)


def axis(angle_deg: float, gap_deg: float, stands_s: float = 0.5) -> AxisWatch:
    """That is short of its command, and has stood so long."""
    return AxisWatch(AxisSeen(NOW - 0.19, angle_deg, 0.0, Duty.FOLLOW, gap_deg), 1, NOW - stands_s, angle_deg)


def full(track: TrackState, seen: AcuStatus) -> ControlState:
    """A memory in which no field is as at the beginning, where that can be."""
    sent = Sent(AZ_DEG, EL_DEG, is_free=False)
    return remembering(
        ready(track, seen),
        reading=Reading(NOW - 0.19, AZ_DEG, EL_DEG, False),
        is_place_sure=True,
        track_of_readings=tuple((NOW - 0.19 - 0.1 * k, AZ_DEG, EL_DEG) for k in range(5, -1, -1)),
        identity=AcuIdentity("SA3842 2.03", True, False),
        is_identity_sure=True,
        present_deg=(AZ_DEG, EL_DEG),
        watchdog=Watchdog.SET,
        watchdog_from_tai_s=NOW - 1.0,
        by_people=True,
        disarmed_by="somebody",
        held=Held(),
        axes=AxesWatch(axis(AZ_DEG, 2.0), axis(EL_DEG, 2.0)),
        axis_az=AxisState(AZ_DEG, 0.5),
        axis_el=AxisState(EL_DEG, 0.3),
        was_followed=True,
        last_write_tai_s=NOW - 0.1,
        commands=(sent, sent, sent),
        goal_az_deg=AZ_DEG,
        refused_tai_s=NOW - 50.0,
        refused_until_tai_s=NOW - 49.0,
        limited_tai_s=NOW - 60.0,
        refusal_count=3,
        clamped_count=4,
        limited_count=5,
        command=Stop(),
        again_tai_s=NOW - 5.0,
        hold_from_tai_s=NOW - 20.0,
        pass_rise_tai_s=PLAN.rise_tai_s,
        has_acquired=True,
        has_locked=True,
        offset=PathOffset(0.5, 0.1, Model.ELEMENTS),
        is_offset_refused=True,
        scan=Scan(Model.ELEMENTS, ((0, (-1.0, 1.0)),), 1, 1, 0.5, True, True, 2.0, 1),
        scanned_tai_s=NOW - 40.0,
        lag=Lag(LagEstimate(9, 2.0, 1.0, 1.0), LagEstimate(8, 2.0, 1.0, 1.0)),
        turn=TurnWatch(learned_count=1),
    )


def named(state: ControlState) -> Iterator[tuple[str, Any]]:
    """Every field of every part."""
    for part in fields(state):
        yield from (
            (f"{part.name}.{one.name}", getattr(getattr(state, part.name), one.name)) for one in fields(part.default)
        )


NEW = dict(named(ControlState()))


TOUCHED = {  # by every tick that has a status, or writes
    *("intake.status", "intake.reading", "intake.track_of_readings", "latch.axes"),
    *(
        f"registers.{name}"
        for name in ("axis_az", "axis_el", "last_write_tai_s", "commands", "in_force", "goal_az_deg")
    ),
}


@dataclass(frozen=True)
class Occasion:
    """What the memory is like before, beside what `full` says; what the tick sees; what it forgets and what changes."""

    forgets: str = ""
    changes: dict[str, Any] = field(default_factory=dict)
    track: TrackState = TrackState.HOLD_FITTED
    was: AcuStatus = HOLDING
    before: dict[str, Any] = field(default_factory=dict)
    seen: Observation = field(default_factory=lambda: saw(HOLDING))
    sky: Sky = FITTED


def goes_to(track: TrackState) -> dict[str, Any]:
    return {"tracking.track": track, "tracking.entered_tai_s": NOW}


def asks(command: Command) -> dict[str, Any]:
    return {"asked.command": command, "asked.again_tai_s": NOW + EXTRA_REPEAT_S}


DISARMED = {"arming.by_people": False, "startup.stage": StartStage.REGISTERS_KNOWN}
BEGUN = {"startup.stage": StartStage.REGISTERS_KNOWN, **asks(ReadTurnChoice())}
ANEW = "latch.axes registers.axis_az registers.axis_el registers.was_followed startup.watchdog"
NOT_FOLLOWED = "registers.goal_az_deg registers.was_followed"
JUST_ASKED = {"again_tai_s": NOW + 0.2}
STOPPING = TurnWatch(phase=Phase.STOPPING, problem="doubted", begun_tai_s=NOW - 9.0, learned_count=1)
MOVING = replace(STOPPING, phase=Phase.MOVING, move_to_deg=AZ_DEG + 0.5, begun_tai_s=NOW - 2.0)
TURN = "turn.phase turn.problem turn.begun_tai_s"
STOWING = replace(HOLDING, mode=AcuMode.STOWING, is_autotrack_selected=False)
OTHERS = "another hand that stopped the antenna"
OCCASIONS = {
    "nothing": Occasion(),
    "the link is lost": Occasion(
        "startup.stage startup.watchdog startup.watchdog_from_tai_s tracking.track intake.is_place_sure"
        " latch.axes registers.axis_az registers.axis_el registers.last_write_tai_s",
        {"tracking.entered_tai_s": NOW, "registers.commands": (None,), **asks(Identify())},
        before={"command": Identify(), **JUST_ASKED},
        seen=Observation(silence_s=0.6),
    ),
    "another pass": Occasion(
        "search.scan signal.offset signal.has_acquired signal.has_locked signal.is_offset_refused",
        {"signal.pass_rise_tai_s": NOW - 60.0},
        sky=replace(FITTED, plan=replace(PLAN, rise_tai_s=NOW - 60.0)),
    ),
    "a person disarms": Occasion(
        "latch.axes",
        DISARMED
        | asks(Stop())
        | {"arming.disarmed_by": "a person", "arming.is_stop_due": True, "refusals.clamped_count": 5},
        before=JUST_ASKED,
        seen=saw(HOLDING, requests=(Request.DISARM,)),
    ),
    "a person arms": Occasion(
        f"{ANEW} arming.disarmed_by foreign_stop.held arming.is_stop_due",
        BEGUN | {"arming.by_people": True},
        before={"by_people": False, "command": ReadTurnChoice(), "is_stop_due": True, **JUST_ASKED},
        seen=saw(HOLDING, requests=(Request.ARM,)),
    ),
    "a person arms in a fault": Occasion(
        f"{ANEW} arming.disarmed_by foreign_stop.held interlock.faults_read",
        BEGUN | {"arming.by_people": True} | asks(ReadFaults()),
        track=TrackState.FAULT,
        was=status(AcuMode.FAULT),
        before={"by_people": False, "faults_read": (False,) * 4, "command": ReadFaults(), **JUST_ASKED},
        seen=saw(status(AcuMode.FAULT), requests=(Request.ARM,)),
    ),
    "a person arms what is armed and has not begun": Occasion(
        "foreign_stop.held",
        asks(ReadTurnChoice()),
        before={"stage": StartStage.REGISTERS_KNOWN},
        seen=saw(HOLDING, requests=(Request.ARM,)),
    ),
    "a person clears": Occasion(
        f"{ANEW} latch.problem arming.is_stop_due",
        BEGUN,
        before={"problem": "an axis", "command": ReadTurnChoice(), "is_stop_due": True, **JUST_ASKED},
        seen=saw(HOLDING, requests=(Request.CLEAR,)),
    ),
    "the ACU forgets its backup": Occasion(
        "startup.watchdog",
        {"startup.stage": StartStage.IDENTIFIED, **asks(ReadCommanded())},
        seen=saw(replace(HOLDING, backup_selected=Backup.RATE)),
    ),
    "another hand stops": Occasion(
        f"latch.axes foreign_stop.held {NOT_FOLLOWED}",
        DISARMED | goes_to(TrackState.IDLE) | asks(SetWatchdog(0.0)) | {"arming.disarmed_by": OTHERS},
        seen=saw(IN_STANDBY),
    ),
    "another hand, or the register watchdog, stops": Occasion(
        "",
        goes_to(TrackState.IDLE) | asks(ReadFaults()) | {"foreign_stop.is_doubted": True},
        before={"in_force": (NOW - 5.0, AZ_DEG, EL_DEG), "commands": (None,)},
        seen=saw(IN_STANDBY),
    ),
    "the signal is back": Occasion(
        f"{NOT_FOLLOWED} search.scan",
        {"signal.acquired_since_tai_s": NOW - 0.09, **goes_to(TrackState.AUTOTRACK_FITTED)},
        seen=saw(IN_AUTOTRACK),
    ),
    "the signal is lost": Occasion(
        "signal.acquired_since_tai_s encoders.tai_s encoders.az_deg encoders.el_deg encoders.az_moved_deg",
        goes_to(TrackState.HOLD_FITTED) | {"tracking.hold_from_tai_s": NOW},
        track=TrackState.AUTOTRACK_FITTED,
        was=IN_AUTOTRACK,
        before={"acquired_since_tai_s": NOW - 9.0, "encoders": EncoderWatch(NOW - 0.19, AZ_DEG, EL_DEG, 0.05)},
    ),
    "an encoder moves again": Occasion(
        f"encoders.az_moved_deg encoders.el_moved_deg search.scan {NOT_FOLLOWED}",
        {"encoders.tai_s": NOW - 0.09, "encoders.az_deg": AZ_DEG, "encoders.el_deg": EL_DEG},
        track=TrackState.AUTOTRACK_FITTED,
        was=IN_AUTOTRACK,
        before={
            "acquired_since_tai_s": NOW - 9.0,
            "encoders": EncoderWatch(NOW - 0.19, AZ_DEG - 0.1, EL_DEG - 0.1, -0.5, -0.5),
        },
        seen=saw(IN_AUTOTRACK),
    ),
    "an offset is near again": Occasion(
        f"{NOT_FOLLOWED} search.scan signal.is_offset_refused",
        {
            "signal.acquired_since_tai_s": NOW - 0.09,
            "signal.offset": PathOffset(pytest.approx(-0.09, abs=0.01), pytest.approx(0.0, abs=0.01), Model.ELEMENTS),  # type: ignore[arg-type]
            **goes_to(TrackState.AUTOTRACK_TLE),
        },
        track=TrackState.SEARCH,
        before={"offset": None},
        seen=saw(IN_AUTOTRACK),
        sky=SKY,
    ),
    "an axis is latched": Occasion(
        "lag.az lag.el",
        goes_to(TrackState.FAULT)
        | asks(Stop())
        | {"latch.problem": "azimuth stands still away from its command", "arming.is_stop_due": True},
        before={
            "axes": AxesWatch(axis(AZ_DEG, 9.0, 5.0), axis(EL_DEG, 0.0)),
            "commands": (Sent(AZ_DEG + 9.0, EL_DEG, False),) * 3,
        },
    ),
    "the ACU stows": Occasion(
        f"arming.is_stop_due foreign_stop.held {NOT_FOLLOWED} {TURN}",
        {"stow.stow_by": StowBy.PANEL, **goes_to(TrackState.STOW)},
        before={"is_stop_due": True, "turn": STOPPING},
        seen=saw(STOWING),
    ),
    "the stow is left": Occasion(
        f"stow.stow_by {NOT_FOLLOWED}",
        goes_to(TrackState.IDLE),
        track=TrackState.STOW,
        was=status(AcuMode.STOWED),
        before={"stow_by": StowBy.PANEL, "held": None},
        seen=saw(IN_STANDBY),
    ),
    "a fault is gone": Occasion(
        NOT_FOLLOWED,
        goes_to(TrackState.IDLE),
        track=TrackState.FAULT,
        was=status(AcuMode.FAULT),
        before={"held": None},
        seen=saw(IN_STANDBY),
    ),
    "no fault is there": Occasion("interlock.faults_read", before={"faults_read": (True, False, False, False)}),
    "STOP is acknowledged": Occasion(
        "arming.is_stop_due", before={"is_stop_due": True}, seen=saw(HOLDING, extra=Exchange(Stop(), Done()))
    ),
    "a doubted stop was the watchdog's": Occasion(
        f"foreign_stop.held foreign_stop.is_doubted {NOT_FOLLOWED}",
        goes_to(TrackState.HOLD_FITTED)
        | asks(SelectMode(AcuMode.AUTOTRACK))
        | {"tracking.hold_from_tai_s": NOW, "interlock.faults_read": (False,) * 4},
        track=TrackState.IDLE,
        was=IN_STANDBY,
        before={"is_doubted": True},
        seen=saw(IN_STANDBY, extra=Exchange(ReadFaults(), FaultReport(has_watchdog_tripped=True))),
    ),
    "a doubted stop was another hand's": Occasion(
        f"latch.axes foreign_stop.held foreign_stop.is_doubted {NOT_FOLLOWED}",
        DISARMED | asks(SetWatchdog(0.0)) | {"arming.disarmed_by": OTHERS, "interlock.faults_read": (False,) * 4},
        track=TrackState.IDLE,
        was=IN_STANDBY,
        before={"is_doubted": True},
        seen=saw(IN_STANDBY, extra=Exchange(ReadFaults(), FaultReport())),
    ),
    "a doubted standby is over": Occasion("foreign_stop.is_doubted", was=IN_STANDBY, before={"is_doubted": True}),
    "all that was kept back is good again": Occasion(
        "refusals.limited refusals.refusal refusals.refused_input",
        before={"refused_input": "status", "refusal": "not a finite angle", "limited": "azimuth"},
    ),
    "the antenna stands on a doubted turn": Occasion(
        f"{ANEW} turn.begun_tai_s registers.in_force",
        {
            "intake.az_deg": AZ_DEG - 360.0,
            "turn.phase": Phase.MOVING,
            "turn.move_to_deg": AZ_DEG - 360.0 + 5.0,
            **BEGUN,
        },
        was=IN_STANDBY,
        before={"turn": STOPPING, "held": None, "in_force": None, "commands": (None, None, None)},
        seen=saw(IN_STANDBY),
    ),
    "the antenna follows on a doubted turn": Occasion(
        f"{TURN} turn.move_to_deg", {"turn.learned_count": 2}, before={"turn": MOVING}
    ),
}


@pytest.mark.parametrize("name", OCCASIONS)
def test_an_occasion_makes_the_memory_forget_what_belongs_to_it_and_nothing_else(name: str) -> None:
    occasion = OCCASIONS[name]
    state = remembering(full(occasion.track, occasion.was), **occasion.before)
    before, forgets = dict(named(state)), occasion.forgets.split()
    after = dict(named(tick(state, TickInput(occasion.seen, occasion.sky, NOW), CONFIG)[0]))
    assert all(before[one] != NEW[one] for one in forgets if one not in TOUCHED), "there is something to forget"
    expected = before | {one: NEW[one] for one in forgets} | occasion.changes
    unlike = {
        one: (before[one], after[one])
        for one in expected
        if after[one] != expected[one] and (one not in TOUCHED or one in forgets or one in occasion.changes)
    }
    assert unlike == {}


def test_all_that_is_remembered_in_continuous_azimuth_goes_to_the_turn_that_a_limit_switch_shows() -> None:
    """The fifth reading in a row at the counter-clockwise end, where 91 deg was counted."""
    before = remembering(
        full(TrackState.HOLD_FITTED, HOLDING),
        az_deg=91.0,
        turn=TurnWatch(against_count=4, learned_count=1),
        axis_az=AxisState(91.0, 0.0),
        commands=(Sent(91.0, EL_DEG, is_free=True),) * 3,
        in_force=(NOW - 0.3, 91.0, EL_DEG),
        track_of_readings=tuple((NOW - 0.19 - 0.1 * k, 91.0, EL_DEG) for k in range(5, -1, -1)),
    )
    seen = replace(HOLDING, az_deg=91.0, is_at_ccw_limit=True)
    after, _ = tick(before, TickInput(saw(seen), FITTED, NOW), CONFIG)
    assert after.intake.az_deg == -269.0
    assert {az_deg for _, az_deg, _ in after.intake.track_of_readings} == {-269.0}
    assert after.registers.in_force == (NOW - 0.09, -269.0, EL_DEG)
    assert after.registers.axis_az is not None
    assert after.registers.axis_az.position_deg == pytest.approx(-269.0, abs=1.0)
    assert len(after.registers.commands) == 1  # a lag over two turns is none
    assert after.lag == before.lag
    assert after.turn.learned_count == 2
    assert after.latch.axes == AxesWatch() or after.latch.axes.az.mark_deg == -269.0
    unwritten = remembering(before, axis_az=None, in_force=None, commands=(None,) * 3)
    after, _ = tick(unwritten, TickInput(saw(seen), FITTED, NOW), CONFIG)
    assert (after.intake.az_deg, after.registers.in_force) == (-269.0, None)
