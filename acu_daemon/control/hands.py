"""Hands on the antenna beside the daemon's: arming, disarming, STOP from elsewhere, the interlock, the latch.  Pure.

Disarmed, nothing is written; in mid-pass a STOP goes before that.  A STOP by another hand disarms too, and so do
the emergency stop and an open door.  The latch stays until a person clears it, whatever the link and the ACU do.
"""

from collections.abc import Iterable
from math import inf

from acu_daemon.control.axis_watch import AWAY, AxisSeen, duty_of, sky_scale, watch_axes
from acu_daemon.control.changed import changed
from acu_daemon.control.lag import LagEstimate
from acu_daemon.control.relearn import doubt, may_be_other_turn
from acu_daemon.control.start import WATCHDOG, anew
from acu_daemon.control.state import ControlConfig, ControlState, Event, Held, Observation, Request, Stage, Watchdog
from acu_daemon.control.states import ACTIVE, TrackState
from acu_daemon.protocol.messages import AcuMode, Backup, Command, Faults, Nak, ReadFaults, Status, Stop, WriteParameter
from acu_daemon.units import wrap_180

NO_STOP_MODES = (AcuMode.MANUAL, AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)  # a stop would disturb, or do nothing
STOPPED_FROM = (AcuMode.REMOTE, AcuMode.ACQUIRE, AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP)
ANOTHER_HAND = "another hand that stopped the antenna"
RATE_SPAN_S = 1.0
AZIMUTH_AWAY = f"azimuth {AWAY}"
EMERGENCY_STOP, DOOR_OPEN = 1, 2  # of the interlock nibble, ICD section 4
WATCHDOG_TRIPPED = 2  # of the system nibble


def obey(state: ControlState, requests: Iterable[Request], config: ControlConfig, events: list[Event]) -> ControlState:
    """Do what people ask."""
    for request in requests:
        if request is Request.CLEAR and state.latch:
            events.append(Event("latch.cleared", {"latch": state.latch}))
            is_stop_due = state.is_stop_due and not state.is_armed(config)
            state = changed(anew(state), latch="", is_stop_due=is_stop_due)
        elif request is Request.ARM and not config.is_shadow:
            state = changed(state, held=None, is_stop_doubted=False)  # whoever says so has seen how the antenna stands
            if not state.is_armed(config):
                events.append(Event("armed"))
                is_stop_due = state.is_stop_due and bool(state.latch)
                state = changed(anew(state), arming=True, disarmed_by="", is_stop_due=is_stop_due, faults_read=None)
        elif request is Request.DISARM and state.is_armed(config):
            is_ours = state.in_force is not None or state.held is not None  # the latter of a daemon that was killed
            state = _disarm(state, "a person", events)
            state = changed(state, is_stop_due=state.is_stop_due or is_ours)
    return state


def _disarm(state: ControlState, by: str, events: list[Event]) -> ControlState:
    advice = "`acu-daemon arm` goes on"
    events.append(Event("disarmed", {"by": by, "advice": advice}, is_warning=True))
    return changed(anew(state), arming=False, disarmed_by=by, watchdog=state.watchdog)


def respect_stop(before: ControlState, state: ControlState, config: ControlConfig, events: list[Event]) -> ControlState:
    """Take STANDBY where the daemon held the antenna for a STOP by another hand, unless the ACU did it itself.

    Held before a lost link, a hang or a crash counts as well.  Sign of a power cycle: the backup is forgotten.  Of the
    register watchdog: its fault bit.  That stays until it is reset; where it stood already, time must tell.  Where the
    status does not show it, but time would have been, it is doubted until FAULT DETAIL tells.
    before: the memory one tick ago.
    """
    now, held = state.status, state.held
    if now is before.status or now is None or state.reading is None or held is None:
        return state
    is_stopped = now.mode is AcuMode.STANDBY and now.backup_selected is Backup.REMOTE
    is_stopped = is_stopped and now.is_remote_enabled  # else it is the local panel's, and ends with it
    unwritten_s = inf if before.in_force is None else state.reading.tai_s - before.in_force[0]
    is_new_fault = now.has_interlock_fault and not held.has_interlock_fault
    may_be_watchdog = 0.0 < config.register_watchdog_s <= unwritten_s
    if not is_stopped or is_new_fault or not state.is_armed(config) or state.latch:
        return changed(state, is_stop_doubted=False) if state.is_stop_doubted else state
    if may_be_watchdog:
        return changed(state, is_stop_doubted=not now.has_interlock_fault)
    return _disarm(state, ANOTHER_HAND, events)


def settle_doubt(state: ControlState, seen: Observation, events: list[Event]) -> ControlState:
    """Take the answer of FAULT DETAIL: the register watchdog has tripped, or another hand has stopped the antenna."""
    if not state.is_stop_doubted or seen.extra is None or seen.extra.command != ReadFaults():
        return state
    reply = seen.extra.reply  # FAULT DETAIL is answered always; an ACU that refuses it knows no such bit
    if isinstance(reply, Faults) and reply.system & WATCHDOG_TRIPPED:
        return changed(state, is_stop_doubted=False, held=None)
    return _disarm(state, ANOTHER_HAND, events) if isinstance(reply, Faults | Nak) else state


def note_held(state: ControlState, config: ControlConfig) -> ControlState:
    """Remember that the daemon holds the antenna, through lost links and new starts until the ACU says otherwise.

    Disarmed or latched it holds it until its STOP is acknowledged.
    """
    status = state.status
    if config.is_shadow:  # it belongs to the daemon that commands, before or after this one
        return state
    if not state.is_armed(config) or state.latch:
        has_fault = status is not None and status.has_interlock_fault
        held = (state.held or Held(has_fault)) if state.is_stop_due else None
        return state if held == state.held else changed(state, held=held)
    if status is None or state.track is TrackState.LINK_LOST or state.is_stop_doubted:
        return state
    is_held = state.track in ACTIVE if state.stage is Stage.READY else state.held is not None
    is_held = is_held and not state.turn.is_stopping  # our own STOP is no other hand's
    held = Held(status.has_interlock_fault) if is_held and status.mode in STOPPED_FROM else None
    return state if held == state.held else changed(state, held=held)


def respect_interlock(
    state: ControlState, seen: Observation, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Disarm for the emergency stop or an open door: a person is there, and only a person can say that it is over."""
    faults = seen.extra.reply if seen.extra is not None else None
    if not isinstance(faults, Faults) or state.status is None:
        return state if state.track is TrackState.FAULT else changed(state, faults_read=None)
    state = changed(state, faults_read=_faults(state.status))
    if not faults.interlock & (EMERGENCY_STOP | DOOR_OPEN) or not state.is_armed(config):
        return state
    return _disarm(state, "the emergency stop" if faults.interlock & EMERGENCY_STOP else "an open door", events)


def question(state: ControlState) -> Command | None:
    """Ask what a fault is, until it is answered, again when its bits change; and what put the antenna in STANDBY."""
    if state.stage is Stage.NEW or state.status is None:
        return None
    if state.is_stop_doubted:
        return ReadFaults()
    if state.track is not TrackState.FAULT:
        return None
    return ReadFaults() if state.faults_read != _faults(state.status) else None


def _faults(status: Status) -> tuple[bool, ...]:
    return (
        status.has_azimuth_fault,
        status.has_elevation_fault,
        status.has_tilt_fault,
        status.has_interlock_fault,
    )


def watch_antenna(state: ControlState, seen: Observation, config: ControlConfig, events: list[Event]) -> ControlState:
    """Judge the axes by a new reading; what they do wrong stops and latches."""
    if not state.is_armed(config) or state.latch or state.stage is not Stage.READY or config.following.error_s <= 0.0:
        return state
    if seen.status is None or seen.reading is None:
        return state
    duty, tai_s, el_deg = duty_of(seen.status), seen.reading.tai_s, seen.status.el_deg
    az_gap_deg = el_gap_deg = None
    if state.in_force is not None:
        az_gap_deg, el_gap_deg = wrap_180(state.in_force[1] - state.az_deg), state.in_force[2] - el_deg
    az_rate_deg_s, el_rate_deg_s = _rates_deg_s(state)
    axes, problem = watch_axes(
        state.axes,
        seen.status,
        AxisSeen(tai_s, state.az_deg, az_rate_deg_s, duty, az_gap_deg, sky_scale(el_deg)),
        AxisSeen(tai_s, el_deg, el_rate_deg_s, duty, el_gap_deg),
        (config.azimuth, config.elevation),
        config.following,
    )
    state = changed(state, axes=axes)
    if not problem:
        return state
    if problem == AZIMUTH_AWAY and may_be_other_turn(state, config):
        return doubt(state, config, events, problem)
    fields = {"problem": problem, "az_deg": state.az_deg, "el_deg": el_deg, "advice": "look, then `acu-daemon clear`"}
    events.append(Event("axis.latched", fields, is_warning=True))
    no_lag = LagEstimate()  # of an axis that failed nothing is kept
    return changed(state, latch=problem, is_stop_due=True, lag_az=no_lag, lag_el=no_lag)


def _rates_deg_s(state: ControlState) -> tuple[float, float]:
    first, last = state.track_of_readings[0], state.track_of_readings[-1]
    span_s = last[0] - first[0]
    if not 0.0 < span_s < RATE_SPAN_S:
        return 0.0, 0.0
    return (last[1] - first[1]) / span_s, (last[2] - first[2]) / span_s


def last_command(state: ControlState, config: ControlConfig) -> Command | None:
    """What still goes out of a daemon that is latched or was disarmed: STOP, then the ACU's register watchdog off."""
    if config.is_shadow or state.stage is Stage.NEW:  # a rehearsal must know first that the ACU is no real one
        return None
    if state.is_stop_due and state.status is not None and state.status.mode not in NO_STOP_MODES:
        return Stop()
    if state.watchdog is Watchdog.SET and not state.is_armed(config):
        return WriteParameter(WATCHDOG, 0)
    return None


def let_be(state: ControlState) -> ControlState:
    """Owe no STOP to an antenna that somebody else moves by now, or that cannot move."""
    is_others = state.status is not None and state.status.mode in NO_STOP_MODES
    return changed(state, is_stop_due=False) if state.is_stop_due and is_others else state
