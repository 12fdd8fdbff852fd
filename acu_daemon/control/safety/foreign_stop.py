"""A STOP by another hand: the antenna in STANDBY that the daemon held.  Owner of `ForeignStop`.  Pure."""

from dataclasses import replace
from math import inf

from acu_daemon.acu.commands import AcuMode, Backup, ReadFaults
from acu_daemon.acu.replies import FaultReport, Refused
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState, ForeignStop, Held, StartStage
from acu_daemon.control.tick_input import Observation
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.control.with_parts import with_parts

STOPPED_FROM = (AcuMode.REMOTE, AcuMode.ACQUIRE, AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP)
ANOTHER_HAND = "another hand that stopped the antenna"


def watch_for_stop(before: ControlState, state: ControlState, config: ControlConfig) -> tuple[ControlState, bool]:
    """Take STANDBY where the daemon held the antenna for a STOP by another hand, unless the ACU did it itself.

    Held before a lost link, a hang or a crash counts as well.  Sign of a power cycle: the backup is forgotten.  Of the
    register watchdog: its fault bit.  That stays until it is reset; where it stood already, time must tell.  Where the
    status does not show it, but time would have been, it is doubted until the ACU says what its fault is.
    before: the memory one tick ago.  Returns whether another hand has stopped the antenna.
    """
    now, held = state.intake.status, state.foreign_stop.held
    if now is before.intake.status or now is None or state.intake.reading is None or held is None:
        return state, False
    has_backup = now.backup_selected is Backup.REMOTE or not config.acu.has_backup
    is_stopped = now.mode is AcuMode.STANDBY and has_backup
    is_stopped = is_stopped and now.is_remote_enabled  # else it is the local panel's, and ends with it
    in_force = before.registers.in_force
    unwritten_s = inf if in_force is None else state.intake.reading.tai_s - in_force[0]
    is_new_fault = now.has_interlock_fault and not held.has_interlock_fault
    may_be_watchdog = 0.0 < config.register_watchdog_s <= unwritten_s
    if not is_stopped or is_new_fault or not state.is_armed(config) or state.latch.problem:
        return settle(state), False
    if may_be_watchdog:
        return with_parts(state, foreign_stop=ForeignStop(held, not now.has_interlock_fault)), False
    return state, True


def take_faults(state: ControlState, seen: Observation) -> tuple[ControlState, bool]:
    """Take what the ACU says of its faults: its register watchdog has tripped, or another hand has stopped it."""
    if not state.foreign_stop.is_doubted or seen.extra is None or seen.extra.command != ReadFaults():
        return state, False
    reply = seen.extra.reply  # an ACU that refuses to tell knows no such fault
    if isinstance(reply, FaultReport) and reply.has_watchdog_tripped:
        return forget_held(state), False
    return state, isinstance(reply, FaultReport | Refused)


def note_held(state: ControlState, config: ControlConfig) -> ControlState:
    """Remember that the daemon holds the antenna, through lost links and new starts until the ACU says otherwise.

    Disarmed or latched it holds it until its STOP is acknowledged.
    """
    status, held = state.intake.status, state.foreign_stop.held
    if config.is_shadow:  # it belongs to the daemon that commands, before or after this one
        return state
    if not state.is_armed(config) or state.latch.problem:
        has_fault = status is not None and status.has_interlock_fault
        return _hold(state, (held or Held(has_fault)) if state.arming.is_stop_due else None)
    if status is None or state.tracking.track is TrackState.LINK_LOST or state.foreign_stop.is_doubted:
        return state
    is_held = state.tracking.track in ACTIVE if state.startup.stage is StartStage.READY else held is not None
    is_held = is_held and not state.turn.is_stopping  # our own STOP is no other hand's
    return _hold(state, Held(status.has_interlock_fault) if is_held and status.mode in STOPPED_FROM else None)


def _hold(state: ControlState, held: Held | None) -> ControlState:
    if held == state.foreign_stop.held:
        return state
    return with_parts(state, foreign_stop=replace(state.foreign_stop, held=held))


def release(state: ControlState) -> ControlState:
    """Hold the antenna no more: it was stopped, and whoever starts next must not take that for another hand's."""
    return _hold(state, None)


def settle(state: ControlState) -> ControlState:
    """Doubt no more who has stopped it."""
    if not state.foreign_stop.is_doubted:
        return state
    return with_parts(state, foreign_stop=ForeignStop(state.foreign_stop.held))


def forget_held(state: ControlState) -> ControlState:
    """Hold the antenna no more, whoever has stopped it."""
    return with_parts(state, foreign_stop=ForeignStop())
