"""What the ACU said, taken into the memory of the decision: status, reading, replies, refusals.  Pure."""

from dataclasses import replace
from math import inf

from acu_daemon.control.axis_watch import FAST_MARGIN, AxesWatch
from acu_daemon.control.causes import is_acquired
from acu_daemon.control.changed import changed
from acu_daemon.control.encoder_watch import EncoderWatch, watch_encoders
from acu_daemon.control.start import after_reply
from acu_daemon.control.state import ControlConfig, ControlState, Event, Observation, Sky, Stage, Watchdog
from acu_daemon.control.states import AUTOTRACKING
from acu_daemon.control.turn import Phase, at_rest, locate
from acu_daemon.model import Pointing, Reading
from acu_daemon.protocol.angles import LSB_DEG
from acu_daemon.protocol.messages import AcuMode, Backup, Nak, Status, Stop

RATE_READINGS = 6  # the rate of an axis is taken over this many readings: near the zenith one pair is all noise
STEADY_SHARE = 0.1  # of a step of the registers: more change than that from one to the next is acceleration
REFUSED_EXTRA_S = 2.0  # after a NAK the same extra command waits this long: no blind repetition
REFUSED_PAUSE_S = 1.0  # a write that is refused again within REFUSED_AGAIN_S waits this long
REFUSED_AGAIN_S = 2.0
LONGEST_STEP_DEG = 170.0  # between two readings; with more the turn is not known by counting


def absorb(
    state: ControlState, seen: Observation, sky: Sky, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Take in what the last tick brought; facts for the log are added to events."""
    if seen.refused is not None:
        state = _absorb_refusal(state, now_tai_s, events)
    if seen.status is not None and seen.reading is not None:
        state = _absorb_in_force(state, seen)
        state = _absorb_reading(state, seen, seen.status, seen.reading, config, events)
    if seen.status is not None and seen.reading is not None and seen.is_in_step:
        is_ours = is_acquired(seen.status) and state.track in AUTOTRACKING
        path = sky.prediction.at(seen.reading.tai_s) if sky.prediction and is_ours else None
        path = path if path is not None and path.is_finite else None
        state = _absorb_encoders(state, path, seen.status, seen.reading, events)
    if seen.extra is not None:
        state = after_reply(state, seen.extra, now_tai_s, config, events)
        if isinstance(seen.extra.reply, Nak) and not isinstance(seen.extra.command, Stop):
            state = changed(state, extra_after_tai_s=now_tai_s + REFUSED_EXTRA_S)
    return state


def _absorb_refusal(state: ControlState, now_tai_s: float, events: list[Event]) -> ControlState:
    is_again = now_tai_s - state.refused_tai_s < REFUSED_AGAIN_S
    sent = state.commands[-1] if state.commands else None
    fields = {"az_deg": sent.az_deg, "el_deg": sent.el_deg} if sent else {}
    events.append(Event("acu.refused_write", fields, is_warning=True))
    pause_s = REFUSED_PAUSE_S if is_again else 0.0
    return changed(state, refused_tai_s=now_tai_s, refused_until_tai_s=now_tai_s + pause_s)


def _absorb_in_force(state: ControlState, seen: Observation) -> ControlState:
    """The write that this status answers is what the ACU holds now."""
    sent = state.commands[-1] if state.commands else None
    if sent is None or seen.refused is not None or seen.reading is None:
        return state
    return changed(state, in_force=(seen.reading.tai_s, sent.az_deg, sent.el_deg))


def _absorb_encoders(
    state: ControlState, path: Pointing | None, status: Status, reading: Reading, events: list[Event]
) -> ControlState:
    """Watch for frozen encoders while autotrack holds the satellite."""
    watch = watch_encoders(state.encoders, reading.tai_s, status, path) if path else EncoderWatch()
    if watch.problem and not state.encoders.problem:
        events.append(Event("encoder.frozen", {"problem": watch.problem, "action": "not fitted"}, is_warning=True))
    elif state.encoders.problem and not watch.problem:
        events.append(Event("encoder.moves"))
    return changed(state, encoders=watch)


def _absorb_reading(
    state: ControlState,
    seen: Observation,
    status: Status,
    reading: Reading,
    config: ControlConfig,
    events: list[Event],
) -> ControlState:
    state, az_deg = _located(state, status, reading, config, events)
    if seen.is_in_step:
        state = _learn_lag(state, az_deg, status.el_deg)
    return changed(
        state,
        stage=_stage_after(state, status),
        watchdog=_watchdog_after(state, status),
        status=status,
        reading=reading,
        is_place_sure=seen.is_confirmed,
        az_deg=az_deg,
        track_of_readings=(*state.track_of_readings[1 - RATE_READINGS :], (reading.tai_s, az_deg, status.el_deg)),
        is_stow_kept=_is_stow_kept(state, status),
    )


def _located(
    state: ControlState, status: Status, reading: Reading, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, float]:
    """The continuous azimuth.  Once the start is done, or the turn sure, it goes on from where it was."""
    last, turn = state.reading, state.turn
    moved_deg = inf if last is None else FAST_MARGIN * config.azimuth.max_rate_deg_s * (reading.tai_s - last.tai_s)
    is_doubted = turn.phase is not Phase.BELIEVED or turn.wrong_half is not None
    is_counted = state.stage is Stage.READY or turn.is_sure or is_doubted
    near_deg = state.az_deg if is_counted and moved_deg < LONGEST_STEP_DEG else None
    new, az_deg = locate(turn, status, config.azimuth, near_deg)
    if new.wrong_half is not None and turn.wrong_half is None:
        action = "the turn is counted without it"
        fields = {"az_deg": az_deg, "sector_bit": int(status.is_sector_high), "action": action}
        events.append(Event("sector.wrong", fields, is_warning=True))
    elif turn.wrong_half is not None and new.wrong_half is None:
        events.append(Event("sector.right"))
    shift_deg = 0.0 if last is None else 360.0 * round((az_deg - state.az_deg) / 360.0)
    if shift_deg and near_deg is None:
        state = on_other_turn(state, shift_deg)  # a rate over two turns would be a whole turn in a moment
    elif shift_deg:
        fields = {"az_deg": az_deg, "believed_deg": az_deg - shift_deg, "sector_bit": int(status.is_sector_high)}
        events.append(Event("turn.corrected", fields, is_warning=True))
        state = on_other_turn(state, shift_deg)
        new = changed(at_rest(new), learned_count=new.learned_count + 1)
    return changed(state, turn=new), az_deg


def on_other_turn(state: ControlState, shift_deg: float) -> ControlState:
    """Everything that is remembered in continuous azimuth, by a multiple of 360 deg further on."""
    register, in_force = state.axis_az, state.in_force
    return changed(
        state,
        az_deg=state.az_deg + shift_deg,
        axis_az=None if register is None else replace(register, position_deg=register.position_deg + shift_deg),
        track_of_readings=tuple((tai_s, az + shift_deg, el) for tai_s, az, el in state.track_of_readings),
        commands=(),
        in_force=None if in_force is None else (in_force[0], in_force[1] + shift_deg, in_force[2]),
        axes=AxesWatch(),
    )


def _stage_after(state: ControlState, status: Status) -> Stage:
    """A backup that changed by itself shows a power cycle: the registers, the tilt among them, are read again."""
    was_remote = state.status is not None and state.status.backup_selected is Backup.REMOTE
    if state.stage is Stage.READY and was_remote and status.backup_selected is not Backup.REMOTE:
        return Stage.IDENTIFIED
    return state.stage


def _watchdog_after(state: ControlState, status: Status) -> Watchdog:
    """A power cycle has switched it off."""
    is_new_start = _stage_after(state, status) is not state.stage
    return Watchdog.UNKNOWN if is_new_start and state.watchdog is Watchdog.SET else state.watchdog


def _is_stow_kept(state: ControlState, status: Status) -> bool:
    """A stow that began after the start is somebody's wish; an antenna found stowed at the start is ours to take."""
    if status.mode is AcuMode.STOWED:
        was_elsewhere = state.status is not None and state.status.mode is not AcuMode.STOWED
        return state.is_stow_kept or was_elsewhere or state.held is not None
    return status.mode is AcuMode.STOWING


def _learn_lag(state: ControlState, az_deg: float, el_deg: float) -> ControlState:
    """The newest of three commands is not in force yet when the angles are sampled: learn from the one before it."""
    if len(state.commands) < 3:
        return state
    before, in_force, newest = state.commands[-3:]
    if before is None or in_force is None or newest is None:
        return state
    if not (before.is_free and in_force.is_free and newest.is_free):
        return state
    if not (
        _is_steady(before.az_deg, in_force.az_deg, newest.az_deg)
        and _is_steady(before.el_deg, in_force.el_deg, newest.el_deg)
    ):
        return state
    return changed(
        state,
        lag_az=state.lag_az.seen(in_force.az_deg - before.az_deg, in_force.az_deg - az_deg),
        lag_el=state.lag_el.seen(in_force.el_deg - before.el_deg, in_force.el_deg - el_deg),
    )


def _is_steady(before_deg: float, in_force_deg: float, newest_deg: float) -> bool:
    """Whether an axis moves at a nearly constant rate, so that what it is short of is lag, not acceleration."""
    step_deg, next_deg = in_force_deg - before_deg, newest_deg - in_force_deg
    return abs(next_deg - step_deg) < STEADY_SHARE * abs(step_deg) + 2 * LSB_DEG
