"""The 10 Hz decision: what the ACU said goes in, what it is told comes out.  Pure.

A tick takes in what has come, supervises the antenna, walks the table of states, aims the registers at the direction
of the moment they take effect, limits that to what axes and drives can do, and permits it or not.
control.state is its memory, control.tracking.state_table the table.
"""

import math

from acu_daemon.acu.commands import Poll
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.extra_exchange import needs_no_poll, note_asked, wait_after_refusal, wanted_extra
from acu_daemon.control.hear import take_receiver
from acu_daemon.control.intake import take_status
from acu_daemon.control.orders import Event, Orders
from acu_daemon.control.registers import (
    note_as_if_written,
    note_no_write,
    refuse_input,
    take_in_force,
    take_refusal,
    write,
)
from acu_daemon.control.safety.arming import take_stop
from acu_daemon.control.safety.command_permit import permit
from acu_daemon.control.safety.finite import finite_only
from acu_daemon.control.safety.foreign_stop import note_held
from acu_daemon.control.safety.supervision import supervise
from acu_daemon.control.safety.turn_doubt import locate_azimuth
from acu_daemon.control.startup import after_reply, watch_for_power_cycle
from acu_daemon.control.state import ControlState, StartStage
from acu_daemon.control.tick_input import TickInput
from acu_daemon.control.tracking.aim import aim
from acu_daemon.control.tracking.by_hand import steer_by_hand
from acu_daemon.control.tracking.false_lock import watch_lock
from acu_daemon.control.tracking.learned_lag import learn_lag
from acu_daemon.control.tracking.path_offset import drop_unusable_offset, forget_other_pass, learn_of_signal
from acu_daemon.control.tracking.search import search
from acu_daemon.control.tracking.slaving import take_slaving
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.tracking.walk import walk


def tick(state: ControlState, given: TickInput, config: ControlConfig) -> tuple[ControlState, Orders]:
    """Decide one tick.

    What is not finite in what it is given is left out, counted, and told once; without a finite time it only polls.
    """
    events: list[Event] = []
    given, refused = finite_only(given)
    state, refused = drop_unusable_offset(state, refused)
    is_time = math.isfinite(given.now_tai_s)
    state = refuse_input(state, refused if is_time else "time", events)
    if not is_time:
        return state, Orders(Poll(), None, tuple(events))
    before = state
    state = take_in(state, given, config, events)
    state = supervise(before, state, given.seen, config, events)
    state = watch_lock(state, given, config, events)
    state = steer_by_hand(state, given, config, events)
    state = take_slaving(state, given, config, events)
    state = note_held(walk(forget_other_pass(state, given.sky), given, config, events), config)
    state = learn_of_signal(state, given, config, events)
    state = search(before, state, given, config, events)
    state, orders = order(before, state, given, config, events)
    return permit(state, orders, given.now_tai_s, config)


def take_in(state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]) -> ControlState:
    """Take in what the last tick brought; facts for the log are added to events."""
    seen, now_tai_s = given.seen, given.now_tai_s
    status, reading, extra = seen.status, seen.reading, seen.extra
    state = take_receiver(state, given.signal, config, events)
    if seen.refused is not None:
        state = take_refusal(state, now_tai_s, events)
    if status is not None and reading is not None:
        state, az_deg = locate_azimuth(take_in_force(state, seen), status, reading, config, events)
        state = learn_lag(state, az_deg, status.el_deg, config) if seen.is_in_step else state
        state = watch_for_power_cycle(state, status)
        state = take_status(state, status, reading, az_deg, given, events)
    if extra is not None:
        state = after_reply(take_stop(state, extra), extra, now_tai_s, config, events)
        state = wait_after_refusal(state, extra, now_tai_s)
    return state


def order(
    before: ControlState, state: ControlState, given: TickInput, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, Orders]:
    """Aim and limit the register write, and choose the exchange beside it or in its place; no two in a row have one."""
    seen, now_tai_s = given.seen, given.now_tai_s
    is_write_owed = before.registers.commands[-1:] == (None,)
    may_write = not seen.must_poll and _may_write(state, now_tai_s, config)
    is_turn_of_write = is_write_owed and may_write and not seen.has_room
    extra = None if seen.must_poll or is_turn_of_write else wanted_extra(state, now_tai_s, config)
    if may_write and (extra is None or seen.has_room):
        state, first = write(state, aim(state, given.sky, now_tai_s, config), now_tai_s, config, events)
        return note_asked(state, extra, now_tai_s), Orders(first, extra, tuple(events))
    state = note_no_write(state)
    if not state.is_armed(config) and state.tracking.track is not TrackState.LINK_LOST:
        written, _ = write(state, aim(state, given.sky, now_tai_s, config), now_tai_s, config, events)
        state = note_as_if_written(state, written)
    if extra is not None and (not seen.has_room or needs_no_poll(state, extra, now_tai_s, config)):
        return note_asked(state, extra, now_tai_s), Orders(extra, None, tuple(events))
    return note_asked(state, extra, now_tai_s), Orders(Poll(), extra, tuple(events))


def _may_write(state: ControlState, now_tai_s: float, config: ControlConfig) -> bool:
    status = state.intake.status
    return (
        state.is_armed(config)
        and not state.latch.problem
        and not state.arming.is_stop_due
        and not state.foreign_stop.is_doubted
        and not state.turn.is_stopping
        and state.startup.stage is StartStage.READY
        and status is not None
        and status.is_remote_enabled
        and now_tai_s >= state.registers.refused_until_tai_s
    )
