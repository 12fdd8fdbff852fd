"""The exchange beside the register write: what is asked or commanded there, and when again.  Owner of `Asked`.  Pure.

A command repeats until the status shows it; what the ACU refuses waits.
"""

from dataclasses import replace

from acu_daemon.acu.commands import Command, Stop
from acu_daemon.acu.replies import Refused
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.arming import last_command
from acu_daemon.control.safety.interlock import question
from acu_daemon.control.safety.stow import stow_command
from acu_daemon.control.startup import next_command
from acu_daemon.control.state import ControlState, StartStage
from acu_daemon.control.tick_input import Exchange
from acu_daemon.control.tracking.mode_selection import wanted_mode_command
from acu_daemon.control.with_parts import with_parts

EXTRA_REPEAT_S = 0.3  # a command gets this long to show in the status before it is sent again
EXTRA_SETTLED_S = 0.7  # after that; a status that still contradicts itself means it
REFUSED_EXTRA_S = 2.0  # after a refusal the same extra command waits this long: no blind repetition
FRESH_S = 0.2  # a place that is sure is where the antenna is for so long


def wanted_extra(state: ControlState, now_tai_s: float, config: ControlConfig) -> Command | None:
    """What goes out beside the write now; None: nothing, or not yet again."""
    status, reading, asked = state.intake.status, state.intake.reading, state.asked
    if status is None or not status.is_remote_enabled or reading is None:
        return None
    wanted = last_command(state, config)
    if wanted is None and now_tai_s - reading.tai_s > config.acu.silence_s:
        return None  # a status from before an outage: who knows where the antenna is now
    wanted = wanted or question(state) or stow_command(state, now_tai_s, config) or next_command(state, config)
    may_select = state.is_armed(config) and not state.turn.is_stopping
    if wanted is None and may_select and _are_registers_fresh(state, now_tai_s, config):
        wanted = wanted_mode_command(state, config, is_settled=now_tai_s - asked.again_tai_s > EXTRA_SETTLED_S)
    if wanted is None or (wanted == asked.command and now_tai_s < asked.again_tai_s):
        return None
    return wanted


def needs_no_poll(state: ControlState, extra: Command, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether it is the start's, which may go on without another status: on a slow line each costs it half a tick."""
    reading = state.intake.reading
    is_fresh = reading is not None and now_tai_s - reading.tai_s < FRESH_S
    is_of_start = state.startup.stage is not StartStage.READY and extra == next_command(state, config)
    return is_of_start and state.intake.is_place_sure and is_fresh


def _are_registers_fresh(state: ControlState, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether a mode may be selected: the registers first, the mode second (docs/adding-an-acu.md, Modes)."""
    in_force = state.registers.in_force
    if state.startup.stage is not StartStage.READY or in_force is None:
        return False
    return now_tai_s - in_force[0] < config.acu.silence_s


def note_asked(state: ControlState, extra: Command | None, now_tai_s: float) -> ControlState:
    """Remember what is sent now."""
    if extra is None:
        return state
    return with_parts(state, asked=replace(state.asked, command=extra, again_tai_s=now_tai_s + EXTRA_REPEAT_S))


def wait_after_refusal(state: ControlState, extra: Exchange, now_tai_s: float) -> ControlState:
    """Let a command wait that the ACU refused; STOP never does."""
    if not isinstance(extra.reply, Refused) or isinstance(extra.command, Stop):
        return state
    return with_parts(state, asked=replace(state.asked, again_tai_s=now_tai_s + REFUSED_EXTRA_S))


def forget_asked(state: ControlState) -> ControlState:
    """Another start asks from the beginning."""
    return with_parts(state, asked=replace(state.asked, command=None))
