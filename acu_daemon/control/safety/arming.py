"""Whether the daemon may command anything, and the STOP that it owes.  Owner of `Arming`.  Pure.

Disarmed, nothing is written; in mid-pass a STOP goes before that.
"""

from dataclasses import replace

from acu_daemon.acu.commands import AcuMode, Command, SetWatchdog, Stop
from acu_daemon.acu.replies import Done
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import Arming, ControlState, StartStage, Watchdog
from acu_daemon.control.tick_input import Exchange
from acu_daemon.control.with_parts import with_parts

NO_STOP_MODES = (AcuMode.MANUAL, AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)  # a stop would disturb, or do nothing


def set_armed(state: ControlState, *, is_stop_due: bool) -> ControlState:
    """A person arms."""
    return with_parts(state, arming=Arming(by_people=True, is_stop_due=is_stop_due))


def set_disarmed(state: ControlState, by: str) -> ControlState:
    """Somebody disarms.  A STOP that is owed stays so."""
    return with_parts(state, arming=replace(state.arming, by_people=False, disarmed_by=by))


def owe_stop(state: ControlState, *, is_due: bool = True) -> ControlState:
    """Send STOP until it is acknowledged, or no more."""
    return with_parts(state, arming=replace(state.arming, is_stop_due=is_due))


def take_stop(state: ControlState, extra: Exchange) -> ControlState:
    """The ACU has acknowledged STOP: none is owed."""
    return owe_stop(state, is_due=False) if isinstance(extra.command, Stop) and isinstance(extra.reply, Done) else state


def owe_no_stop_to_others(state: ControlState) -> ControlState:
    """Owe no STOP to an antenna that somebody else moves by now, or that cannot move."""
    is_others = state.intake.status is not None and state.intake.status.mode in NO_STOP_MODES
    return owe_stop(state, is_due=False) if state.arming.is_stop_due and is_others else state


def last_command(state: ControlState, config: ControlConfig) -> Command | None:
    """What still goes out of a daemon that is latched or was disarmed: STOP, then the ACU's register watchdog off."""
    status, stage = state.intake.status, state.startup.stage
    if config.is_shadow or stage is StartStage.NEW:  # a rehearsal must know first that the ACU is no real one
        return None
    if state.arming.is_stop_due and status is not None and status.mode not in NO_STOP_MODES:
        return Stop()
    if state.startup.watchdog is Watchdog.SET and not state.is_armed(config):
        return SetWatchdog(0.0)
    return None


# From run to run


def begin_run(state: ControlState, config: ControlConfig) -> ControlState:
    """Of the STOP that was left owing: it is owed still by a daemon that is armed, or held the antenna.

    A daemon that rests owes one where it was killed while it held the antenna.
    """
    is_held = state.foreign_stop.held is not None
    is_owed = (state.arming.is_stop_due and (state.is_armed(config) or is_held)) or (config.is_resting and is_held)
    return owe_stop(state, is_due=is_owed and not config.is_shadow)


def owes_stop(state: ControlState, config: ControlConfig, *, has_written: bool) -> bool:
    """Whether the antenna obeys us, or who was killed before us, or a STOP for it was not acknowledged yet."""
    is_held = has_written or state.foreign_stop.held is not None
    return state.arming.is_stop_due or (is_held and state.is_armed(config))
