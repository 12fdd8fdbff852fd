"""The 10 Hz decision: what the ACU said goes in, what it is told comes out.  Pure.

`tick` absorbs the newest status, walks the table of states, finds the direction the registers shall hold at the moment
they take effect, and passes it through the safety gate.  control.state is its memory, control.states the table.
"""

import math
from dataclasses import replace

from acu_daemon.control.absorb import absorb
from acu_daemon.control.approach import way_to
from acu_daemon.control.axis_watch import AxesWatch
from acu_daemon.control.causes import LINK_SILENCE_S, find_causes, path_point
from acu_daemon.control.changed import changed
from acu_daemon.control.fence import fence
from acu_daemon.control.finite import finite_only
from acu_daemon.control.gate import Passed, gate, within_limits
from acu_daemon.control.hands import (
    last_command,
    let_be,
    note_held,
    obey,
    question,
    respect_interlock,
    respect_stop,
    settle_doubt,
    watch_antenna,
)
from acu_daemon.control.modes import wanted_mode_command
from acu_daemon.control.path_offset import forget_other_pass, learn_of_signal, learned_point
from acu_daemon.control.relearn import watch_turn
from acu_daemon.control.search import pointing
from acu_daemon.control.searching import search
from acu_daemon.control.start import next_command
from acu_daemon.control.state import (
    ControlConfig,
    ControlState,
    Event,
    Observation,
    Orders,
    Sent,
    Sky,
    Stage,
    Watchdog,
)
from acu_daemon.control.states import ACTIVE, AUTOTRACKING, HOLDING, TrackState, transition
from acu_daemon.model import Pointing
from acu_daemon.pointing.wrap import nearest_turn
from acu_daemon.protocol.messages import Command, Poll, WriteAndPoll

EXTRA_REPEAT_S = 0.3  # a command gets this long to show in the status before it is sent again
EXTRA_SETTLED_S = 0.7  # after that; a status that still contradicts itself means it
FRESH_S = 0.2  # a place that is sure is where the antenna is for so long
SETTLE_S = 1.0  # after a change of state the servo takes up the path: what it is short of then is no lag
LIMITED_S = 2.0  # an axis that was not held at its limit for so long is within them again
REGULAR_SHARE = 0.1  # of the period: of writes that come less regularly no lag is learned
CALM_SHARE = 0.25  # of the drive's rate: above it a lag is what the drive cannot do, not what it does late


def tick(
    state: ControlState, seen: Observation, sky: Sky, now_tai_s: float, config: ControlConfig
) -> tuple[ControlState, Orders]:
    """Decide one tick.  now_tai_s: the moment the write starts, so that lateness is no pointing error.

    What is not finite in seen and sky is left out, counted, and told once; without a finite time it only polls.
    """
    events: list[Event] = []
    seen, sky, refused = finite_only(seen, sky)
    if state.offset is not None and not math.isfinite(state.offset.along_s + state.offset.across_deg):
        state, refused = changed(state, offset=None), "offset"
    state = _refuse(state, refused if math.isfinite(now_tai_s) else "time", events)
    if not math.isfinite(now_tai_s):
        return state, Orders(Poll(), None, tuple(events))
    before = state
    state = absorb(state, seen, sky, now_tai_s, config, events)
    state = obey(state, seen.requests, config, events)
    state = settle_doubt(respect_stop(before, state, config, events), seen, events)
    state = respect_interlock(state, seen, config, events)
    state = let_be(watch_antenna(state, seen, config, events))
    state = watch_turn(state, seen, config, events)
    state = note_held(_walk(forget_other_pass(state, sky), seen, sky, now_tai_s, config, events), config)
    state = learn_of_signal(state, seen, sky, config, events)
    state = search(before, state, seen, sky, now_tai_s, config, events)
    is_write_owed = bool(before.commands) and before.commands[-1] is None
    state, orders = _order(state, seen, sky, now_tai_s, config, events, is_write_owed=is_write_owed)
    return fence(state, orders, config)


def _refuse(state: ControlState, refused: str, events: list[Event]) -> ControlState:
    if refused and refused != state.refused_input:
        events.append(Event("input.refused", {"input": refused, "reason": "not finite"}, is_warning=True))
    if not refused and not state.refused_input:
        return state
    return changed(state, refused_input=refused, gate_refusal_count=state.gate_refusal_count + bool(refused))


def _order(
    state: ControlState,
    seen: Observation,
    sky: Sky,
    now_tai_s: float,
    config: ControlConfig,
    events: list[Event],
    *,
    is_write_owed: bool,
) -> tuple[ControlState, Orders]:
    """is_write_owed: the last tick had an exchange in the place of its write; no two in a row have."""
    may_write = not seen.must_poll and _may_write(state, now_tai_s, config)
    is_turn_of_write = is_write_owed and may_write and not seen.has_room
    extra = None if seen.must_poll or is_turn_of_write else _extra(state, now_tai_s, config)
    if may_write and (extra is None or seen.has_room):
        state, write = _write(state, sky, now_tai_s, config, events)
        return _remember(state, extra, now_tai_s), Orders(write, extra, tuple(events))
    state = changed(state, commands=(*state.commands[-2:], None))
    if not state.is_armed(config) and state.track is not TrackState.LINK_LOST:
        state = changed(_write(state, sky, now_tai_s, config, events)[0], commands=state.commands)
    if extra is not None and (not seen.has_room or _needs_no_poll(state, extra, now_tai_s, config)):
        return _remember(state, extra, now_tai_s), Orders(extra, None, tuple(events))
    return _remember(state, extra, now_tai_s), Orders(Poll(), extra, tuple(events))


def _needs_no_poll(state: ControlState, extra: Command, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether it is the start's, which may go on without another status: on a slow line each costs it half a tick."""
    is_fresh = state.reading is not None and now_tai_s - state.reading.tai_s < FRESH_S
    is_of_start = state.stage is not Stage.READY and extra == next_command(state, config)
    return is_of_start and state.is_place_sure and is_fresh


def _may_write(state: ControlState, now_tai_s: float, config: ControlConfig) -> bool:
    return (
        state.is_armed(config)
        and not state.latch
        and not state.is_stop_due
        and not state.is_stop_doubted
        and not state.turn.is_stopping
        and state.stage is Stage.READY
        and state.status is not None
        and state.status.is_remote_enabled
        and now_tai_s >= state.refused_until_tai_s
    )


# The table


def _walk(
    state: ControlState, seen: Observation, sky: Sky, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> ControlState:
    causes = find_causes(state, sky, seen.silence_s, now_tai_s, config)
    if state.track in HOLDING and _is_sure(sky, now_tai_s, config):
        state = changed(state, hold_from_tai_s=now_tai_s)
    step = transition(state.track, causes)
    if step is None:
        return state
    before, (track, cause) = state.track, step
    events.append(
        Event(
            "state.changed",
            {"state": str(track), "before": str(state.track), "cause": str(cause)},
            is_warning=track in (TrackState.LINK_LOST, TrackState.FAULT, TrackState.SEARCH),
        )
    )
    if track is TrackState.PREPOSITION:
        events += _lateness(state, sky, now_tai_s, config)
    state = changed(state, track=track, entered_tai_s=now_tai_s)
    if track is TrackState.LINK_LOST:
        watchdog = Watchdog.UNKNOWN if state.watchdog is Watchdog.SET else state.watchdog
        state = changed(
            state, stage=Stage.NEW, last_extra=None, axis_az=None, axis_el=None, last_write_tai_s=None, commands=()
        )
        state = changed(state, watchdog=watchdog, watchdog_from_tai_s=None, axes=AxesWatch(), is_place_sure=False)
    if track in HOLDING and before not in HOLDING:
        state = changed(state, hold_from_tai_s=now_tai_s)
    return state


def _lateness(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> list[Event]:
    """Say that the antenna sets out too late to be there at the rise."""
    if sky.plan is None or state.has_acquired:
        return []
    way = way_to(sky.plan, state, config)
    late_s = now_tai_s + way.both_s - sky.plan.rise_tai_s
    if late_s <= 0.0:
        return []
    seconds = {"late_s": late_s, "azimuth_s": way.azimuth_s, "elevation_s": way.elevation_s}
    fields = {name: round(value, 1) for name, value in seconds.items()}
    return [Event("pass.late", fields, is_warning=True)]


def _is_sure(sky: Sky, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether 3 sigma of the prediction still lie within half the beam (only for estimators that know a sigma)."""
    inside_s = sky.prediction.seconds_inside(now_tai_s, config.beamwidth_deg / 2) if sky.prediction else None
    return inside_s is not None and inside_s > 0.0


# What it is told


def _extra(state: ControlState, now_tai_s: float, config: ControlConfig) -> Command | None:
    if state.status is None or not state.status.is_remote_enabled or state.reading is None:
        return None
    wanted = last_command(state, config)
    if wanted is None and now_tai_s - state.reading.tai_s > LINK_SILENCE_S:
        return None  # a status from before an outage: who knows where the antenna is now
    wanted = wanted or question(state) or next_command(state, config)
    may_select = state.is_armed(config) and not state.turn.is_stopping
    if wanted is None and may_select and _are_registers_fresh(state, now_tai_s):
        wanted = wanted_mode_command(state, is_settled=now_tai_s - state.extra_after_tai_s > EXTRA_SETTLED_S)
    if wanted is None or (wanted == state.last_extra and now_tai_s < state.extra_after_tai_s):
        return None
    return wanted


def _are_registers_fresh(state: ControlState, now_tai_s: float) -> bool:
    """Whether a mode may be selected: the registers first, the mode second (ICD section 5)."""
    if state.stage is not Stage.READY or state.in_force is None:
        return False
    return now_tai_s - state.in_force[0] < LINK_SILENCE_S


def _remember(state: ControlState, extra: Command | None, now_tai_s: float) -> ControlState:
    if extra is None:
        return state
    return changed(state, last_extra=extra, extra_after_tai_s=now_tai_s + EXTRA_REPEAT_S)


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
        state = changed(state, refusal=passed.refusal)
    goal_deg = within_limits(wanted, state.az_deg, config)[0].az_deg if is_followed and wanted.is_finite else None
    state = _tell_limits(changed(state, goal_az_deg=goal_deg), passed, wanted, now_tai_s, events)
    return _sent(state, passed, now_tai_s, config, is_followed=is_followed)


def _tell_limits(
    state: ControlState, passed: Passed, wanted: Pointing, now_tai_s: float, events: list[Event]
) -> ControlState:
    """Once for each edge; an axis that comes and goes at its limit is one that is held there."""
    if passed.limited:
        if passed.limited != state.limited:
            fields = {"axis": passed.limited, "az_deg": wanted.az_deg, "el_deg": wanted.el_deg}
            events.append(Event("gate.limited", fields, is_warning=True))
        count = state.gate_limited_count + 1
        return changed(state, limited=passed.limited, limited_tai_s=now_tai_s, gate_limited_count=count)
    if state.limited and now_tai_s - state.limited_tai_s > LIMITED_S:
        events.append(Event("gate.within_limits"))
        return changed(state, limited="")
    return state


def _sent(
    state: ControlState, passed: Passed, now_tai_s: float, config: ControlConfig, *, is_followed: bool
) -> tuple[ControlState, WriteAndPoll]:
    az_deg, el_deg = passed.az.position_deg, passed.el.position_deg
    is_calm = (
        abs(passed.az.rate_deg_s) < CALM_SHARE * config.azimuth.max_rate_deg_s
        and abs(passed.el.rate_deg_s) < CALM_SHARE * config.elevation.max_rate_deg_s
    )
    is_settled = now_tai_s - state.entered_tai_s > SETTLE_S
    since_s = now_tai_s - (state.last_write_tai_s or -math.inf)
    is_regular = abs(since_s - config.period_s) < REGULAR_SHARE * config.period_s
    is_free = is_calm and is_settled and is_regular and is_followed and state.was_followed and not passed.is_held_back
    is_free = is_free and not passed.limited
    sent = Sent(az_deg, el_deg, is_free)
    state = changed(
        state,
        axis_az=passed.az,
        axis_el=passed.el,
        was_followed=is_followed,
        last_write_tai_s=now_tai_s,
        commands=(*state.commands[-2:], sent),
        gate_refusal_count=state.gate_refusal_count + bool(passed.refusal),
        gate_clamped_count=state.gate_clamped_count + (is_followed and passed.is_held_back and not passed.refusal),
    )
    return state, WriteAndPoll(az_deg, el_deg, state.tilt_code)


def _wanted(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig, *, is_followed: bool) -> Pointing:
    """The direction the registers shall hold: for the middle of the time they are in force, led by the learned lag."""
    if is_followed and state.turn.move_to_deg is not None:
        return replace(_rest(state, is_followed=True), az_deg=state.turn.move_to_deg)
    lag_az_s, lag_el_s = state.lag_s(config) if is_followed else (0.0, 0.0)
    aim_tai_s = now_tai_s + config.effect_delay_s + config.period_s / 2
    az = _point(state, sky, aim_tai_s + lag_az_s, config, is_followed=is_followed)
    el = az if lag_el_s == lag_az_s else _point(state, sky, aim_tai_s + lag_el_s, config, is_followed=is_followed)
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
        return pointing(state.scan, sky.prediction, aim_tai_s, config) or path_point(sky, aim_tai_s)
    return learned_point(state, sky, aim_tai_s, follow=is_followed) or path_point(sky, aim_tai_s, follow=is_followed)


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
