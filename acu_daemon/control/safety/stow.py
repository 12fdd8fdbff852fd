"""The stow: whose it is, when STOW may be sent, and who ends it.  Owner of `Stowing`.  Pure.

A stow of ours is a wish that stands: STOW goes out, once nothing speaks against it, until the status shows STOWING or
STOWED.  Nothing is tracked meanwhile.  It outlives lost links, passes and restarts, and is ended by whose it is, or by
a person.  The antenna then stands where it is until a pass is near; there STANDBY leaves the stow.

A stow that begins without our wish is somebody's at the ACU, and is left alone.  One that is found at the start, over
already, is ours to take.
"""

from acu_daemon.acu.commands import STOW_MODES, AcuMode, Backup, Command, Stow
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, StartStage, Stowing
from acu_daemon.control.tick_input import STOWED_BY_US, StowBy, StowWish
from acu_daemon.control.with_parts import with_parts
from acu_daemon.pointing.way_round import why_not_stow

RANK = {by: place for place, by in enumerate(StowBy)}


def obey_stow(state: ControlState, wish: StowWish, config: ControlConfig, events: list[Event]) -> ControlState:
    """Take a wish; one that is weaker than the stow that stands changes nothing."""
    by = state.stow.stow_by
    if config.is_shadow:
        return state
    if wish.is_wanted:
        if RANK[wish.by] <= RANK[by]:
            return state
        events.append(Event("stow.begins", {"by": str(wish.by)}))
        return _by(state, wish.by)
    if by is StowBy.NOBODY or wish.by not in (by, StowBy.OPERATOR):
        return state
    events.append(Event("stow.ends", {"by": str(wish.by), "was_by": str(by)}))
    return _by(state, StowBy.NOBODY)


def watch_stow(before: ControlState, state: ControlState, events: list[Event]) -> tuple[ControlState, bool]:
    """See whose a stow is that begins or ends.  before: the memory one tick ago.

    Returns whether another hand has ended a stow of ours: a person may be at the antenna.  A backup that is forgotten
    shows a power cycle instead, after which STOW is sent again; under the local panel or in a fault the wish waits.
    """
    now, last, by = state.intake.status, before.intake.status, state.stow.stow_by
    if now is None or now is last:
        return state, False
    was_stowed, is_stowed = last is not None and last.mode in STOW_MODES, now.mode in STOW_MODES
    if by is StowBy.NOBODY and is_stowed and not was_stowed:
        is_seen = last is not None or now.mode is AcuMode.STOWING or before.foreign_stop.held is not None
        return (_by(state, StowBy.PANEL) if is_seen else state), False
    if by is StowBy.PANEL and not is_stowed:
        return _by(state, StowBy.NOBODY), False
    if by not in STOWED_BY_US or not was_stowed or is_stowed or last is None or not _is_anothers(last, now):
        return state, False
    events.append(Event("stow.ends", {"by": "another hand", "was_by": str(by)}, is_warning=True))
    return _by(state, StowBy.NOBODY), True


def _is_anothers(last: AcuStatus, now: AcuStatus) -> bool:
    is_power_cycle = last.backup_selected is Backup.REMOTE and now.backup_selected is not Backup.REMOTE
    return now.is_remote_enabled and now.mode not in (AcuMode.MANUAL, AcuMode.FAULT) and not is_power_cycle


def keeps_stowed(state: ControlState, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether a stow keeps the daemon from steering: it is under way, or STOW can be sent."""
    by, status = state.stow.stow_by, state.intake.status
    if by is StowBy.NOBODY or status is None:
        return False
    return by is StowBy.PANEL or status.mode in STOW_MODES or not why_not_sent(state, now_tai_s, config)


def stow_command(state: ControlState, now_tai_s: float, config: ControlConfig) -> Command | None:
    """STOW, where it is wanted, not seen yet, and nothing speaks against it."""
    status = state.intake.status
    if state.stow.stow_by not in STOWED_BY_US or status is None or status.mode in STOW_MODES:
        return None
    if state.startup.stage is StartStage.NEW or state.turn.is_stopping:
        return None
    return None if why_not_sent(state, now_tai_s, config) else Stow()


def why_not_sent(state: ControlState, now_tai_s: float, config: ControlConfig) -> str:
    """What forbids STOW now; empty: nothing."""
    status, envelope = state.intake.status, config.envelope
    if config.is_shadow:
        return "a shadow commands nothing"
    if not config.acu.has_stow:
        return "this ACU has no stow"
    if state.latch.problem:
        return f"latched: {state.latch.problem}"
    if not state.is_armed_by_people(config):
        return "disarmed"
    if status is None:
        return "nothing is known of the antenna"
    if not status.is_remote_enabled or status.mode is AcuMode.MANUAL:
        return "the local panel has control"
    if status.mode is AcuMode.FAULT:
        return "the ACU reports a fault"
    if status.has_interlock_fault and not state.interlock.is_watchdog_alone:
        return "the ACU reports an interlock, or another fault"
    if state.arming.is_stop_due:
        return "a STOP is due"
    if not envelope.has_zones:
        return ""
    if not state.intake.is_place_sure:
        return "where the antenna is, is not sure"
    return why_not_stow(envelope, (state.intake.az_deg, status.el_deg), now_tai_s)


def end_between_passes(state: ControlState) -> ControlState:
    """A pass is due, or another move: the schedule's stow is over."""
    return _by(state, StowBy.NOBODY) if state.stow.stow_by is StowBy.SCHEDULE else state


def _by(state: ControlState, by: StowBy) -> ControlState:
    return with_parts(state, stow=Stowing(by))
