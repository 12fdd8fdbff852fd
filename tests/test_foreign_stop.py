"""control.safety.foreign_stop: what counts as a STOP by another hand, who is asked, and until when it is remembered."""

from dataclasses import replace
from typing import Any

import pytest
from memories import remembering
from test_tick import AZ_DEG, CONFIG, EL_DEG, NOW, status

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import AcuMode, Backup, Identify, ReadFaults
from acu_daemon.acu.replies import AcuStatus, Commanded, FaultReport, Refused, Reply
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.foreign_stop import (
    ANOTHER_HAND,
    STOPPED_FROM,
    forget_held,
    note_held,
    release,
    settle,
    take_faults,
    watch_for_stop,
)
from acu_daemon.control.safety.turn import Phase, TurnWatch
from acu_daemon.control.state import ControlState, ForeignStop, Held, StartStage
from acu_daemon.control.tick_input import Exchange, Observation
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.model import Reading

WATCHDOG_S = 5.0
BOTH = pytest.mark.parametrize("has_fault", [False, True])


def held(seen: AcuStatus, **changes: Any) -> ControlState:
    """The memory while the daemon holds the antenna."""
    values: dict[str, Any] = {
        "track": TrackState.HOLD_FITTED,
        "stage": StartStage.READY,
        "status": seen,
        "reading": Reading(NOW, AZ_DEG, EL_DEG, is_locked=False),
        "in_force": (NOW - 0.1, AZ_DEG, EL_DEG),
        "held": Held(),
    }
    return remembering(**(values | changes))


HOLDING = status(AcuMode.REMOTE_BACKUP)
STANDBY = status(AcuMode.STANDBY)


def found(
    seen: AcuStatus = STANDBY, config: ControlConfig = CONFIG, *, unwritten_s: float | None = 0.1, **changes: Any
) -> tuple[ControlState, bool]:
    """The antenna found so one tick after it was held.  unwritten_s: since the last write that was accepted."""
    in_force = None if unwritten_s is None else (NOW - unwritten_s, AZ_DEG, EL_DEG)
    before = held(HOLDING, in_force=in_force)
    return watch_for_stop(before, held(seen, **({"in_force": (NOW, AZ_DEG, EL_DEG)} | changes)), config)


# STANDBY


@pytest.mark.parametrize("mode", AcuMode)
def test_standby_alone_is_a_stop(mode: AcuMode) -> None:
    state = held(status(mode))
    assert watch_for_stop(held(HOLDING), state, CONFIG) == (state, mode is AcuMode.STANDBY)


@pytest.mark.parametrize("backup", Backup)
@pytest.mark.parametrize("has_backup", [False, True])
def test_an_acu_that_forgot_its_backup_had_a_power_cycle_and_one_that_has_none_had_not(
    backup: Backup, has_backup: bool
) -> None:
    config = replace(CONFIG, acu=Capabilities(has_backup=has_backup))
    expected = backup is Backup.REMOTE or not has_backup
    assert found(status(AcuMode.STANDBY, backup_selected=backup), config)[1] is expected


@pytest.mark.parametrize(
    ("changes", "config"),
    [
        ({"held": None}, CONFIG),
        ({"reading": None}, CONFIG),
        ({"status": None}, CONFIG),
        ({"by_people": False}, CONFIG),
        ({"latch": replace(ControlState().latch, problem="stands")}, CONFIG),
        ({}, replace(CONFIG, is_resting=True)),
        ({}, replace(CONFIG, is_shadow=True)),
        ({"status": status(AcuMode.STANDBY, is_remote_enabled=False)}, CONFIG),
    ],
)
def test_no_stop_is_taken_of_an_antenna_that_is_not_held_or_not_the_daemons_to_move(
    changes: dict[str, Any], config: ControlConfig
) -> None:
    assert found()[1]
    state = held(STANDBY, **changes)
    assert watch_for_stop(held(HOLDING), state, config) == (state, False)


def test_people_are_told_who_it_was() -> None:
    assert ANOTHER_HAND == "another hand that stopped the antenna"


def test_a_status_is_judged_once() -> None:
    state = held(STANDBY, is_doubted=True)
    assert watch_for_stop(state, state, CONFIG) == (state, False)
    other = held(replace(STANDBY, agc_db=1.0), is_doubted=True)
    assert watch_for_stop(state, other, CONFIG)[1]


@pytest.mark.parametrize("was", [False, True])
@BOTH
def test_a_fault_bit_that_is_new_is_the_register_watchdogs_and_one_that_stood_tells_nothing(
    was: bool, has_fault: bool
) -> None:
    seen = status(AcuMode.STANDBY, has_interlock_fault=has_fault)
    after, is_stopped = found(seen, held=Held(was), is_doubted=True)
    is_new = has_fault and not was
    assert is_stopped is not is_new
    assert after.foreign_stop == ForeignStop(Held(was), is_doubted=not is_new)


@pytest.mark.parametrize(
    ("unwritten_s", "watchdog_s", "is_doubted"),
    [
        (WATCHDOG_S, WATCHDOG_S, True),
        (WATCHDOG_S - 0.01, WATCHDOG_S, False),
        (WATCHDOG_S + 0.01, WATCHDOG_S, True),
        (None, WATCHDOG_S, True),
        (None, 0.0, False),
        (99.0, 0.0, False),
        (0.02, 0.01, True),
    ],
)
@BOTH
def test_where_the_watchdog_had_time_to_trip_the_acu_is_asked_unless_its_bit_stood_already(
    unwritten_s: float | None, watchdog_s: float, is_doubted: bool, has_fault: bool
) -> None:
    config = replace(CONFIG, register_watchdog_s=watchdog_s)
    seen = status(AcuMode.STANDBY, has_interlock_fault=has_fault)
    after, is_stopped = found(seen, config, unwritten_s=unwritten_s, held=Held(has_fault))
    assert is_stopped is not is_doubted
    assert after.foreign_stop == ForeignStop(Held(has_fault), is_doubted=is_doubted and not has_fault)


def test_what_was_doubted_is_settled_when_the_antenna_moves_again() -> None:
    after, is_stopped = found(replace(HOLDING, agc_db=1.0), is_doubted=True, held=Held(True))
    assert (after.foreign_stop, is_stopped) == (ForeignStop(Held(True)), False)


# What the ACU says of its faults

DOUBTING = held(STANDBY, is_doubted=True)


@pytest.mark.parametrize(
    ("reply", "is_forgotten", "is_stopped"),
    [
        (FaultReport(has_watchdog_tripped=True), True, False),
        (FaultReport(("door",), is_door_open=True), False, True),
        (FaultReport(), False, True),
        (Refused(), False, True),
        (None, False, False),
        (Commanded(1.0, 2.0), False, False),
    ],
)
def test_the_acu_that_was_asked_tells_the_watchdog_from_another_hand(
    reply: Reply | None, is_forgotten: bool, is_stopped: bool
) -> None:
    after, stopped = take_faults(DOUBTING, Observation(extra=Exchange(ReadFaults(), reply)))
    assert stopped is is_stopped
    assert after.foreign_stop == (ForeignStop() if is_forgotten else DOUBTING.foreign_stop)
    sure = held(STANDBY)
    assert take_faults(sure, Observation(extra=Exchange(ReadFaults(), reply))) == (sure, False)
    assert take_faults(DOUBTING, Observation(extra=Exchange(Identify(), reply))) == (DOUBTING, False)


def test_without_an_answer_the_doubt_stays() -> None:
    assert take_faults(DOUBTING, Observation()) == (DOUBTING, False)


# Who holds it


def note(config: ControlConfig = CONFIG, seen: AcuStatus | None = HOLDING, **changes: Any) -> Held | None:
    return note_held(held(seen, **({"held": None} | changes)), config).foreign_stop.held  # type: ignore[arg-type]


@BOTH
@pytest.mark.parametrize("mode", AcuMode)
def test_it_holds_the_antenna_in_the_modes_that_follow_or_autotrack_and_notes_the_fault_bit(
    mode: AcuMode, has_fault: bool
) -> None:
    modes = {AcuMode.REMOTE, AcuMode.ACQUIRE, AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP}
    assert set(STOPPED_FROM) == modes
    expected = Held(has_fault) if mode in modes else None
    assert note(seen=status(mode, has_interlock_fault=has_fault)) == expected
    assert note(seen=status(mode, has_interlock_fault=has_fault), held=Held(not has_fault)) == expected


@pytest.mark.parametrize("track", TrackState)
def test_it_holds_the_antenna_in_active_states_and_through_a_start_as_before(track: TrackState) -> None:
    is_link = track is not TrackState.LINK_LOST
    before = Held(True)
    assert note(track=track) == (Held() if track in ACTIVE else None)
    assert note(track=track, held=before) == (before if not is_link else Held() if track in ACTIVE else None)
    for stage in set(StartStage) - {StartStage.READY}:
        assert note(track=track, stage=stage) is None
        assert note(track=track, stage=stage, held=before) == (Held() if is_link else before)


def test_what_is_held_stays_as_it_was_in_a_shadow_without_a_status_and_in_doubt() -> None:
    for before in (None, Held(True)):
        shadow = replace(CONFIG, is_shadow=True)
        assert note(shadow, held=before, is_stop_due=not before) == before
        assert note(seen=None, held=before) == before
        assert note(held=before, is_doubted=True) == before


def test_its_own_stop_of_a_doubted_turn_is_no_other_hands() -> None:
    assert note(held=Held(), turn=TurnWatch(phase=Phase.STOPPING)) is None
    assert note(turn=TurnWatch(phase=Phase.MOVING)) == Held()


@BOTH
@pytest.mark.parametrize("how", ["disarmed", "resting", "latched"])
def test_disarmed_or_latched_it_holds_the_antenna_until_its_stop_is_acknowledged(how: str, has_fault: bool) -> None:
    config = replace(CONFIG, is_resting=how == "resting")
    problem = "stands" if how == "latched" else ""
    changes: dict[str, Any] = {"latch": replace(ControlState().latch, problem=problem)}
    changes["by_people"] = how != "disarmed"
    seen = status(AcuMode.STANDBY, has_interlock_fault=has_fault)
    assert note(config, seen, is_stop_due=True, **changes) == Held(has_fault)
    assert note(config, None, is_stop_due=True, **changes) == Held(False)
    assert note(config, seen, is_stop_due=True, held=Held(not has_fault), **changes) == Held(not has_fault)
    assert note(config, seen, is_stop_due=False, held=Held(True), **changes) is None


def test_what_does_not_change_leaves_the_memory_as_it_is() -> None:
    state = held(HOLDING)
    assert note_held(state, CONFIG) is state
    assert settle(state) is state


@BOTH
@pytest.mark.parametrize("is_doubted", [False, True])
def test_released_it_is_held_no_more_settled_it_is_doubted_no_more_forgotten_it_is_neither(
    has_fault: bool, is_doubted: bool
) -> None:
    state = held(STANDBY, held=Held(has_fault), is_doubted=is_doubted)
    assert release(state).foreign_stop == ForeignStop(None, is_doubted)
    assert settle(state).foreign_stop == ForeignStop(Held(has_fault))
    assert forget_held(state).foreign_stop == ForeignStop()
