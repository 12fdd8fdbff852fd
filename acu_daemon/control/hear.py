"""A reply as it comes in: is it to be believed, when was it so, and may it be fitted?  Pure.

Owner of the plausibility of the statuses, of `Fitting` and of what a receiver beside the ACU says.  What is heard
between two ticks is gathered in an Observation for the next one; the fit is given its readings at once.
"""

from dataclasses import dataclass, replace

from acu_daemon.acu.commands import PointAndPoll, Poll
from acu_daemon.acu.replies import AcuStatus, Refused
from acu_daemon.assist.reading_gate import acquired_since_tai_s
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.receiver_signal import SignalSample, judge_signal
from acu_daemon.control.safety.status_plausibility import judge
from acu_daemon.control.state import ControlState, Fitting
from acu_daemon.control.tick_input import Arrival, Exchange, Observation
from acu_daemon.control.tracking.causes import is_acquired
from acu_daemon.control.tracking.state_table import AUTOTRACKING
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Reading

ROUNDING_S = 1e-6  # of differences of TAI


@dataclass(frozen=True, slots=True)
class Heard:
    """What came of a reply.  reading: of a status that is believed; is_to_fit: the fit may see it."""

    seen: Observation
    reading: Reading | None = None
    is_to_fit: bool = False
    doubt: str = ""  # why a status is not believed


def hear(state: ControlState, seen: Observation, arrival: Arrival, config: ControlConfig) -> tuple[ControlState, Heard]:
    """Take a reply in.  seen: what was heard before it since the last tick."""
    command, reply = arrival.command, arrival.reply
    if isinstance(reply, AcuStatus):
        return _hear_status(state, seen, arrival, reply, config)
    if not isinstance(command, PointAndPoll | Poll):
        return state, Heard(replace(seen, extra=Exchange(command, reply)))
    return state, Heard(replace(seen, refused=reply) if isinstance(reply, Refused) else seen)


def _hear_status(
    state: ControlState, seen: Observation, arrival: Arrival, status: AcuStatus, config: ControlConfig
) -> tuple[ControlState, Heard]:
    tai_s = _sample_tai_s(arrival, config)
    plausibility = judge(state.plausibility, status, tai_s, config.azimuth, config.elevation, config.acu.silence_s)
    if not plausibility.is_believed:
        return with_parts(state, plausibility=plausibility), Heard(seen, doubt=plausibility.reason)
    status = _unless_denied(status, state, tai_s, config)
    reading = Reading(tai_s, status.az_deg, status.el_deg, is_acquired(status), status.agc_db)
    seen = replace(
        seen,
        status=status,
        reading=reading,
        is_confirmed=plausibility.is_confirmed,
        is_in_step=arrival.is_sure,
    )
    fitting, is_locked = _dwelt(state.fitting, reading, config)
    if is_locked and not arrival.is_sure:
        fitting = replace(fitting, out_of_step_count=fitting.out_of_step_count + 1)
    is_tracked = config.acu.has_autotrack and state.tracking.track in AUTOTRACKING
    is_to_fit = is_locked and arrival.is_sure and is_tracked and not state.encoders.problem
    return with_parts(state, plausibility=plausibility, fitting=fitting), Heard(seen, reading, is_to_fit)


def take_receiver(
    state: ControlState, sample: SignalSample | None, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Take what a receiver beside the ACU has said; a change is told."""
    if config.receiver is None or sample is None:
        return state
    before, receiver = state.receiver, judge_signal(state.receiver, sample, config.receiver)
    if receiver is before:
        return state
    if receiver.is_locked is not before.is_locked:
        fields = {} if receiver.level_db is None else {"level_db": round(receiver.level_db, 2)}
        events.append(Event("signal.locked" if receiver.is_locked else "signal.lost", fields))
    return with_parts(state, receiver=receiver)


def _unless_denied(status: AcuStatus, state: ControlState, tai_s: float, config: ControlConfig) -> AcuStatus:
    """A signal that the ACU follows, and in which the receiver does not find the satellite's, is not acquired."""
    rules, receiver = config.receiver, state.receiver
    if rules is None or not status.is_acquired or receiver.is_locked or not receiver.is_known(tai_s, rules):
        return status
    return replace(status, is_acquired=False)


def _sample_tai_s(arrival: Arrival, config: ControlConfig) -> float:
    """Start of the write, wire time and device delay, never after the first byte of the reply."""
    delay_s = config.poll_sample_delay_s if isinstance(arrival.command, Poll) else config.sample_delay_s
    sample_tai_s = arrival.started_tai_s + delay_s
    return sample_tai_s if arrival.first_byte_tai_s is None else min(sample_tai_s, arrival.first_byte_tai_s)


def _dwelt(fitting: Fitting, reading: Reading, config: ControlConfig) -> tuple[Fitting, bool]:
    """Count a reading, and say whether it was acquired for the dwell time."""
    since_tai_s = acquired_since_tai_s(fitting.acquired_since_tai_s, fitting.last_acquired_tai_s, reading)
    if since_tai_s is None:
        return replace(fitting, acquired_since_tai_s=None, last_acquired_tai_s=None), False
    is_locked = reading.tai_s - since_tai_s >= config.lock_dwell_s - ROUNDING_S
    count = fitting.dwell_count + (not is_locked)
    return Fitting(since_tai_s, reading.tai_s, count, fitting.out_of_step_count), is_locked
