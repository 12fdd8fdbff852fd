"""The 10 Hz decision: what the ACU said goes in, what it is told comes out.  Pure.

`tick` absorbs the newest status, walks the table of states, finds the direction the registers shall hold at the moment
they take effect, and passes it through the safety gate.  control.state is its memory, control.states the table.
"""

from dataclasses import replace

from acu_daemon.control.causes import find_causes, is_acquired, path_point
from acu_daemon.control.gate import Passed, gate
from acu_daemon.control.modes import wanted_mode_command
from acu_daemon.control.search import search_offset, search_pointing
from acu_daemon.control.start import after_reply, next_command
from acu_daemon.control.state import (
    ControlConfig,
    ControlState,
    Event,
    Observation,
    Orders,
    Sent,
    Sky,
    Stage,
)
from acu_daemon.control.states import ACTIVE, AUTOTRACKING, HOLDING, TrackState, transition
from acu_daemon.model import Pointing, Reading
from acu_daemon.pointing.wrap import encoder_continuous, nearest_turn
from acu_daemon.protocol.angles import LSB_DEG
from acu_daemon.protocol.messages import AcuMode, Backup, Command, Nak, Poll, Status, WriteAndPoll
from acu_daemon.units import wrap_180

OFFSET_GAIN = 0.6  # of the newest reading in the smoothed distance to the prediction: autotrack pulls in quickly
RATE_READINGS = 6  # the rate of an axis is taken over this many readings: near the zenith one pair is all noise
EXTRA_REPEAT_S = 0.3  # a command gets this long to show in the status before it is sent again
SETTLE_S = 1.0  # after a change of state the servo takes up the path: what it is short of then is no lag
CALM_SHARE = 0.25  # of the drive's rate: above it a lag is what the drive cannot do, not what it does late
STEADY_SHARE = 0.1  # of a step of the registers: more change than that from one to the next is acceleration
REFUSED_EXTRA_S = 2.0  # after a NAK the same extra command waits this long: no blind repetition
REFUSED_PAUSE_S = 1.0  # a write that is refused again within REFUSED_AGAIN_S waits this long
REFUSED_AGAIN_S = 2.0


def tick(
    state: ControlState, seen: Observation, sky: Sky, now_tai_s: float, config: ControlConfig
) -> tuple[ControlState, Orders]:
    """Decide one tick.  now_tai_s: the moment the write starts, so that lateness is no pointing error."""
    events: list[Event] = []
    state = _absorb(state, seen, sky, now_tai_s, config, events)
    state = _walk(state, seen, sky, now_tai_s, config, events)
    extra = None if seen.must_poll else _extra(state, now_tai_s, config)
    if extra is not None and not seen.has_room:
        state = replace(state, commands=(*state.commands[-2:], None))
        return _remember(state, extra, now_tai_s), Orders(extra, None, tuple(events))
    if seen.must_poll or not _may_write(state, now_tai_s, config):
        state = replace(state, commands=(*state.commands[-2:], None))
        return _remember(state, extra, now_tai_s), Orders(Poll(), extra, tuple(events))
    state, write = _write(state, sky, now_tai_s, config, events)
    return _remember(state, extra, now_tai_s), Orders(write, extra, tuple(events))


def _may_write(state: ControlState, now_tai_s: float, config: ControlConfig) -> bool:
    return (
        config.is_armed
        and state.stage is Stage.READY
        and state.status is not None
        and state.status.is_remote_enabled
        and now_tai_s >= state.refused_until_tai_s
    )


# What the ACU said


def _absorb(
    state: ControlState, seen: Observation, sky: Sky, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> ControlState:
    if seen.extra is not None:
        state = after_reply(state, seen.extra)
        if isinstance(seen.extra.reply, Nak):
            state = replace(state, extra_after_tai_s=now_tai_s + REFUSED_EXTRA_S)
    if seen.refused is not None:
        is_again = now_tai_s - state.refused_tai_s < REFUSED_AGAIN_S
        pause_s = REFUSED_PAUSE_S if is_again else 0.0
        state = replace(state, refused_tai_s=now_tai_s, refused_until_tai_s=now_tai_s + pause_s)
        sent = state.commands[-1] if state.commands else None
        events.append(
            Event("acu.refused_write", {"az_deg": sent.az_deg, "el_deg": sent.el_deg} if sent else {}, is_warning=True)
        )
    if seen.status is not None and seen.reading is not None:
        state = _absorb_reading(state, seen.status, seen.reading, config)
        state = _absorb_offset(state, sky, seen.reading)
    return state


def _absorb_reading(state: ControlState, status: Status, reading: Reading, config: ControlConfig) -> ControlState:
    az_deg = encoder_continuous(status.az_deg, status.is_sector_high, config.azimuth)
    since = (state.acquired_since_tai_s or reading.tai_s) if is_acquired(status) else None
    state = _learn_lag(state, az_deg, status.el_deg)
    return replace(
        state,
        stage=_stage_after(state, status),
        status=status,
        reading=reading,
        az_deg=az_deg,
        track_of_readings=(*state.track_of_readings[1 - RATE_READINGS :], (reading.tai_s, az_deg, status.el_deg)),
        acquired_since_tai_s=since,
        has_acquired=state.has_acquired or since is not None,
        is_stow_kept=_is_stow_kept(state, status),
    )


def _stage_after(state: ControlState, status: Status) -> Stage:
    """A backup that changed by itself shows a power cycle: the registers, the tilt among them, are read again."""
    was_remote = state.status is not None and state.status.backup_selected is Backup.REMOTE
    if state.stage is Stage.READY and was_remote and status.backup_selected is not Backup.REMOTE:
        return Stage.IDENTIFIED
    return state.stage


def _is_stow_kept(state: ControlState, status: Status) -> bool:
    """A stow that began after the start is somebody's wish; an antenna found stowed at the start is ours to take."""
    if status.mode is AcuMode.STOWED:
        return state.is_stow_kept or (state.status is not None and state.status.mode is not AcuMode.STOWED)
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
    return replace(
        state,
        lag_az=state.lag_az.seen(in_force.az_deg - before.az_deg, in_force.az_deg - az_deg),
        lag_el=state.lag_el.seen(in_force.el_deg - before.el_deg, in_force.el_deg - el_deg),
    )


def _is_steady(before_deg: float, in_force_deg: float, newest_deg: float) -> bool:
    """Whether an axis moves at a nearly constant rate, so that what it is short of is lag, not acceleration."""
    step_deg, next_deg = in_force_deg - before_deg, newest_deg - in_force_deg
    return abs(next_deg - step_deg) < STEADY_SHARE * abs(step_deg) + 2 * LSB_DEG


def _absorb_offset(state: ControlState, sky: Sky, reading: Reading) -> ControlState:
    """Follow the distance between reading and prediction while acquired: it carries the path before the first fit."""
    point = sky.prediction.at(reading.tai_s) if sky.prediction else None
    if point is None or state.status is None or not is_acquired(state.status):
        return state
    az = wrap_180(reading.az_deg - point.az_deg)
    el = reading.el_deg - point.el_deg
    if state.offset_az_deg is None:
        return replace(state, offset_az_deg=az, offset_el_deg=el)
    return replace(
        state,
        offset_az_deg=state.offset_az_deg + OFFSET_GAIN * wrap_180(az - state.offset_az_deg),
        offset_el_deg=state.offset_el_deg + OFFSET_GAIN * (el - state.offset_el_deg),
    )


# The table


def _walk(
    state: ControlState, seen: Observation, sky: Sky, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> ControlState:
    causes = find_causes(state, sky, seen.silence_s, now_tai_s, config)
    if state.track in HOLDING and _is_sure(sky, now_tai_s, config):
        state = replace(state, hold_from_tai_s=now_tai_s)
    step = transition(state.track, causes)
    if step is None:
        return state
    track, cause = step
    events.append(
        Event(
            "state.changed",
            {"state": str(track), "before": str(state.track), "cause": str(cause)},
            is_warning=track in (TrackState.LINK_LOST, TrackState.FAULT, TrackState.SEARCH),
        )
    )
    state = replace(state, track=track, entered_tai_s=now_tai_s)
    if track is TrackState.LINK_LOST:
        state = replace(state, stage=Stage.NEW, last_extra=None, axis_az=None, axis_el=None, commands=())
    if track in HOLDING:
        state = replace(state, hold_from_tai_s=now_tai_s)
    return state


def _is_sure(sky: Sky, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether 3 sigma of the prediction still lie within half the beam (only for estimators that know a sigma)."""
    inside_s = sky.prediction.seconds_inside(now_tai_s, config.beamwidth_deg / 2) if sky.prediction else None
    return inside_s is not None and inside_s > 0.0


# What it is told


def _extra(state: ControlState, now_tai_s: float, config: ControlConfig) -> Command | None:
    if state.status is None or not state.status.is_remote_enabled:
        return None
    wanted = next_command(state, config)
    if wanted is None and state.stage is Stage.READY:
        wanted = wanted_mode_command(state)
    if wanted is None or (wanted == state.last_extra and now_tai_s < state.extra_after_tai_s):
        return None
    return wanted


def _remember(state: ControlState, extra: Command | None, now_tai_s: float) -> ControlState:
    if extra is None:
        return state
    return replace(state, last_extra=extra, extra_after_tai_s=now_tai_s + EXTRA_REPEAT_S)


def _write(
    state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, WriteAndPoll]:
    is_followed = state.status is not None and state.status.follows_registers
    wanted = _wanted(state, sky, now_tai_s, config, is_followed=is_followed)
    dt_s = now_tai_s - state.last_write_tai_s if state.last_write_tai_s is not None else config.period_s
    dt_s = min(max(dt_s, config.period_s / 2), 3 * config.period_s)
    passed = gate(wanted, state, now_tai_s, is_followed=is_followed, dt_s=dt_s, config=config)
    if passed.refusal != state.refusal:
        if passed.refusal:
            fields = {"reason": passed.refusal, "az_deg": wanted.az_deg, "el_deg": wanted.el_deg}
            events.append(Event("gate.refused", fields, is_warning=True))
        state = replace(state, refusal=passed.refusal)
    return _sent(state, passed, now_tai_s, config, is_followed=is_followed)


def _sent(
    state: ControlState, passed: Passed, now_tai_s: float, config: ControlConfig, *, is_followed: bool
) -> tuple[ControlState, WriteAndPoll]:
    az_deg, el_deg = passed.az.position_deg, passed.el.position_deg
    is_calm = (
        abs(passed.az.rate_deg_s) < CALM_SHARE * config.azimuth.max_rate_deg_s
        and abs(passed.el.rate_deg_s) < CALM_SHARE * config.elevation.max_rate_deg_s
    )
    is_settled = now_tai_s - state.entered_tai_s > SETTLE_S
    is_free = is_calm and is_settled and is_followed and state.was_followed and not passed.is_held_back
    sent = Sent(az_deg, el_deg, is_free)
    state = replace(
        state,
        axis_az=passed.az,
        axis_el=passed.el,
        was_followed=is_followed,
        last_write_tai_s=now_tai_s,
        commands=(*state.commands[-2:], sent),
        gate_refusal_count=state.gate_refusal_count + bool(passed.refusal),
    )
    return state, WriteAndPoll(az_deg, el_deg, state.tilt_code)


def _wanted(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig, *, is_followed: bool) -> Pointing:
    """The direction the registers shall hold: for the middle of the time they are in force, led by the learned lag."""
    lag_az_s, lag_el_s = state.lag_s(config) if is_followed else (0.0, 0.0)
    aim_tai_s = now_tai_s + config.effect_delay_s + config.period_s / 2
    az = _point(state, sky, aim_tai_s + lag_az_s, config, is_followed=is_followed)
    el = _point(state, sky, aim_tai_s + lag_el_s, config, is_followed=is_followed)
    if az is None or el is None:
        return _rest(state, is_followed=is_followed)
    az_deg = _on_turn(az.az_deg, state, config, is_followed=is_followed)
    return Pointing(az_deg, el.el_deg, az.az_rate_deg_s, el.el_rate_deg_s)


def _point(
    state: ControlState, sky: Sky, aim_tai_s: float, config: ControlConfig, *, is_followed: bool
) -> Pointing | None:
    if state.track not in ACTIVE or (not is_followed and state.track not in AUTOTRACKING):
        return None  # a mode that follows the registers must find them where the antenna is, not where it shall go
    if state.track is TrackState.SEARCH and sky.prediction is not None:
        offset = search_offset(
            aim_tai_s - state.entered_tai_s, config.search_s, config.search_along_s, config.search_across_deg
        )
        return search_pointing(sky.prediction, aim_tai_s, offset, config.elevation, config.min_elevation_deg)
    point = path_point(sky, aim_tai_s, follow=is_followed)
    if state.track in (TrackState.AUTOTRACK_TLE, TrackState.HOLD_TLE) and state.offset_az_deg is not None and point:
        return replace(point, az_deg=point.az_deg + state.offset_az_deg, el_deg=point.el_deg + state.offset_el_deg)
    return point


def _rest(state: ControlState, *, is_followed: bool) -> Pointing:
    """Where nothing is to be followed: the present angles, or a standstill for an antenna that follows."""
    if is_followed and state.axis_az is not None and state.axis_el is not None:
        return Pointing(state.axis_az.position_deg, state.axis_el.position_deg, 0.0, 0.0)
    el_deg = state.status.el_deg if state.status is not None else 0.0
    return Pointing(state.az_deg, el_deg, 0.0, 0.0)


def _on_turn(az_deg: float, state: ControlState, config: ControlConfig, *, is_followed: bool) -> float:
    """Take a bearing on a turn inside the limits: a follower's own, or past its end the long way round on another.

    PREPOSITION goes to the turn that was planned, and registers that are not followed may hold any.
    """
    near_deg = az_deg
    if is_followed and state.track is not TrackState.PREPOSITION:
        near_deg = state.axis_az.position_deg if state.axis_az is not None and state.was_followed else state.az_deg
    turned_deg = nearest_turn(az_deg, near_deg, config.azimuth)
    return az_deg if turned_deg is None else turned_deg
