"""A turn of the azimuth that cannot be true is learned anew (control.safety.turn has the theory).  Pure.

    BELIEVED --doubt--> STOPPING --stands--> MOVING --has followed--> BELIEVED, until a place shows that it is so

STOPPING: STOP until it is acknowledged, no register is written and no mode selected until the antenna stands.  MOVING:
the other turn is taken for the true one, the start begins anew (the present angles first), and the antenna is moved by
STEP_DEG away from the stop that is nearer on that turn.  So no step goes towards a stop, whichever turn is true: on the
old one the same step leads away from it too, or into the wide part of the range.  The plan of the pass is made anew for
the turn that was learned.

An azimuth that does not follow even then, or stands on a turn that is sure, is no matter of turns: it is latched.  The
axis watch does so, and beside the zenith, where a register's whole lead is little on the sky, the time that goes by
without a motion (`STANDS`).
"""

from dataclasses import replace
from math import inf

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.intake import RATE_READINGS, shift_places
from acu_daemon.control.orders import Event
from acu_daemon.control.registers import forget_in_force, shift_registers
from acu_daemon.control.safety.arming import owe_stop
from acu_daemon.control.safety.axis_latch import forget_motion
from acu_daemon.control.safety.axis_watch import BRAKING_MARGIN, FAST_MARGIN, Duty, az_ends, duty_of, sky_scale
from acu_daemon.control.safety.foreign_stop import release
from acu_daemon.control.safety.fresh_start import anew
from acu_daemon.control.safety.turn import (
    PATIENCE_S,
    Phase,
    at_rest,
    drive_s,
    half_text,
    is_pulled_round,
    locate,
    other_turn,
    watch_goal,
    watch_pull,
)
from acu_daemon.control.state import ControlState, StartStage
from acu_daemon.control.tick_input import Observation
from acu_daemon.control.tracking.causes import is_acquired
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Reading

LONGEST_STEP_DEG = 170.0  # between two readings; with more the turn is not known by counting
STEP_DEG = 5.0
ARRIVED_DEG = 1.0
LEAD_DEG = 5.0  # of a command that has taken effect: no lag of a drive, and half of what a register waits at
STANDS = "azimuth stands still away from its command"
MOST_LEARNED = 4  # turns in a run
STANDING_DEG = 0.1  # over the newest readings
OTHERS_MODES = (AcuMode.MANUAL, AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)


def may_be_other_turn(state: ControlState, config: ControlConfig) -> bool:
    """Whether an azimuth that moves away from its command does so because it stands on the other turn."""
    if not _may_doubt(state) or state.registers.in_force is None:
        return False
    return is_pulled_round(state.intake.az_deg, _rate_deg_s(state), state.registers.in_force[1], config.azimuth)


def _rate_deg_s(state: ControlState) -> float:
    first, last = state.intake.track_of_readings[0], state.intake.track_of_readings[-1]
    return (last[1] - first[1]) / (last[0] - first[0]) if last[0] > first[0] else 0.0


def _may_doubt(state: ControlState) -> bool:
    """Not a turn that is sure, and not again and again: an axis that fails on both turns is latched at last."""
    turn = state.turn
    return turn.phase is Phase.BELIEVED and not turn.is_sure and turn.learned_count < MOST_LEARNED


def doubt(state: ControlState, config: ControlConfig, events: list[Event], why: str) -> ControlState:
    """Stop the antenna, and doubt the turn."""
    az_deg, status = state.intake.az_deg, state.intake.status
    other_deg, el_deg = other_turn(az_deg, config.azimuth), status.el_deg if status else None
    fields = {
        "reason": why,
        "az_deg": az_deg,
        "el_deg": el_deg,
        "goal_deg": state.registers.goal_az_deg,
        "turn": half_text(az_deg, config.azimuth),
        "other_turn_deg": other_deg,
        "sector_bit": int(status.is_sector_high) if status else None,
        "action": f"stopped; then moved by {STEP_DEG:g} deg on the other turn, away from the nearer stop",
    }
    events.append(Event("turn.doubted", fields, is_warning=True))
    problem = f"turn doubted: azimuth {az_deg:.1f} deg as believed, or {other_deg:.1f}" if other_deg else why
    turn = replace(at_rest(state.turn), phase=Phase.STOPPING, move_to_deg=None, is_sure=False, problem=problem)
    state = with_parts(state, turn=turn)
    return owe_stop(release(forget_in_force(forget_motion(state))))


def watch_turn(
    state: ControlState, seen: Observation, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, str]:
    """Judge the way to the goal by a new reading, and go on with a turn that is doubted.

    Returns what the azimuth does wrong that no turn explains; empty: nothing.
    """
    status = seen.status
    if status is None or seen.reading is None:
        return state, ""
    is_ours = state.is_armed(config) and not state.latch.problem and state.tracking.track is not TrackState.LINK_LOST
    if not is_ours or not status.is_remote_enabled or status.mode in OTHERS_MODES:
        is_plain = state.turn.phase is Phase.BELIEVED and not state.turn.problem
        return (state if is_plain else _settled(state)), ""
    if state.turn.phase is Phase.STOPPING:
        return _stopped(state, status, config, events), ""
    if state.turn.phase is Phase.MOVING:
        return _moved(state, status, config, events)
    return _on_its_way(state, status, seen.reading.tai_s, config, events)


def _on_its_way(
    state: ControlState, status: AcuStatus, tai_s: float, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, str]:
    goal_deg = _goal_deg(state, status)
    az_deg, limits, scale = state.intake.az_deg, config.azimuth, sky_scale(status.el_deg)
    turn, is_standing = watch_goal(state.turn, tai_s, az_deg, goal_deg, limits, scale=scale)
    if turn.problem and not state.turn.problem:
        fields = {"az_deg": az_deg, "el_deg": status.el_deg, "goal_deg": goal_deg, "problem": turn.problem}
        events.append(Event("azimuth.late", fields, is_warning=True))
    is_pulled = goal_deg is not None and duty_of(status) is Duty.FOLLOW and may_be_other_turn(state, config)
    turn, is_pulled_for_good = watch_pull(
        turn, tai_s, az_deg, _rate_deg_s(state), limits, scale=scale, is_pulled=is_pulled
    )
    state = state if turn is state.turn else with_parts(state, turn=turn)
    if is_pulled_for_good:
        why = "the azimuth moves away from its command, as it would on the other turn"
        return doubt(state, config, events, why), ""
    if is_standing and _may_doubt(state) and other_turn(az_deg, limits) is not None:
        return doubt(state, config, events, "the azimuth moves no further towards its goal"), ""
    is_stuck = is_standing and is_watched(config) and _is_led(state, status, turn.side)
    return state, STANDS if is_stuck else ""


def is_watched(config: ControlConfig) -> bool:
    """Whether an axis that does not obey is latched."""
    return config.following.error_s > 0.0


def _is_led(state: ControlState, status: AcuStatus, side: int) -> bool:
    """Whether a command is in force that the azimuth should move by, to this side, and no limit switch holds it."""
    in_force, (is_at_max, is_at_min) = state.registers.in_force, az_ends(status)
    if in_force is None or duty_of(status) is not Duty.FOLLOW or (is_at_max if side > 0 else is_at_min):
        return False
    return side * (in_force[1] - state.intake.az_deg) > LEAD_DEG


def _goal_deg(state: ControlState, status: AcuStatus) -> float | None:
    """Where the azimuth shall go.  On the way to a pass it keeps its goal also while the ACU leaves REMOTE."""
    if state.startup.stage is not StartStage.READY or state.tracking.track not in ACTIVE:
        return None
    if duty_of(status) is Duty.FOLLOW and state.registers.goal_az_deg is not None:
        return state.registers.goal_az_deg
    return state.turn.goal_deg if state.tracking.track is TrackState.PREPOSITION else None


def _stopped(state: ControlState, status: AcuStatus, config: ControlConfig, events: list[Event]) -> ControlState:
    """Wait until the antenna stands; then the other turn is the believed one.

    Beside the zenith, where the noise of an azimuth is many degrees, the time that its drive needs to brake must do.
    """
    if state.arming.is_stop_due or duty_of(status) is not Duty.STAND:
        return state
    last_tai_s, limits = state.intake.track_of_readings[-1][0], config.azimuth
    state = _under_way(state, last_tai_s)
    az_deg = [az for _, az, _ in state.intake.track_of_readings]
    moved_deg = max(az_deg) - min(az_deg)
    braking_s = BRAKING_MARGIN * limits.max_rate_deg_s / limits.max_acceleration_deg_s2
    has_braked = (
        last_tai_s - state.turn.begun_tai_s > braking_s and moved_deg * sky_scale(status.el_deg) < 2.0 * STANDING_DEG
    )
    if len(az_deg) < RATE_READINGS or (moved_deg >= STANDING_DEG and not has_braked):
        return state
    other_deg = other_turn(state.intake.az_deg, limits)
    if other_deg is None:  # it has come to a bearing that one turn alone reaches
        return anew(_settled(state))
    up_deg, down_deg = limits.max_deg - other_deg, other_deg - limits.min_deg
    move_to_deg = other_deg + (STEP_DEG if down_deg < up_deg else -STEP_DEG)
    events.append(
        Event("turn.tried", {"az_deg": other_deg, "believed_deg": state.intake.az_deg, "move_to_deg": move_to_deg})
    )
    state = anew(on_other_turn(state, other_deg - state.intake.az_deg))
    turn = replace(state.turn, phase=Phase.MOVING, move_to_deg=move_to_deg, begun_tai_s=inf)
    return with_parts(state, turn=turn)


def _moved(
    state: ControlState, status: AcuStatus, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, str]:
    """Whether it follows.  If not in the time that its drive needs: the turn that was believed is, and it is stuck."""
    to_deg, az_deg, limits = state.turn.move_to_deg, state.intake.az_deg, config.azimuth
    is_led = to_deg is not None and state.startup.stage is StartStage.READY and duty_of(status) is Duty.FOLLOW
    has_followed = is_led and to_deg is not None and abs(az_deg - to_deg) < ARRIVED_DEG
    if not has_followed and not is_acquired(status):
        tai_s = state.intake.track_of_readings[-1][0]
        state = _under_way(state, tai_s) if is_led else state
        if tai_s - state.turn.begun_tai_s <= PATIENCE_S + drive_s(2.0 * STEP_DEG, limits) or not is_watched(config):
            return state, ""
        believed_deg = other_turn(az_deg, limits)
        return _settled(on_other_turn(state, (believed_deg or az_deg) - az_deg)), STANDS
    by = "the antenna follows on it" if has_followed else "autotrack holds the satellite"
    events.append(Event("turn.learned", {"az_deg": state.intake.az_deg, "by": by}))
    return _settled(state, learned_count=1), ""


def _under_way(state: ControlState, tai_s: float) -> ControlState:
    """Note when the antenna was seen first in a mode that stops it, or moves it."""
    return with_parts(state, turn=replace(state.turn, begun_tai_s=min(state.turn.begun_tai_s, tai_s)))


def _settled(state: ControlState, learned_count: int = 0) -> ControlState:
    """The turn is believed again.  learned_count: turns learned by this."""
    count = state.turn.learned_count + learned_count
    turn = replace(at_rest(state.turn), phase=Phase.BELIEVED, move_to_deg=None, learned_count=count)
    return with_parts(state, turn=turn)


def locate_azimuth(
    state: ControlState, status: AcuStatus, reading: Reading, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, float]:
    """The continuous azimuth.  Once the start is done, or the turn sure, it goes on from where it was."""
    last, turn, before_deg = state.intake.reading, state.turn, state.intake.az_deg
    moved_deg = inf if last is None else FAST_MARGIN * config.azimuth.max_rate_deg_s * (reading.tai_s - last.tai_s)
    is_doubted = turn.phase is not Phase.BELIEVED or turn.wrong_half is not None
    is_counted = state.startup.stage is StartStage.READY or turn.is_sure or is_doubted
    near_deg = before_deg if is_counted and moved_deg < LONGEST_STEP_DEG else None
    new, az_deg = locate(turn, status, config.azimuth, near_deg, has_bit=config.acu.has_sector_bit)
    if new.wrong_half is not None and turn.wrong_half is None:
        action = "the turn is counted without it"
        fields = {"az_deg": az_deg, "sector_bit": int(status.is_sector_high), "action": action}
        events.append(Event("sector.wrong", fields, is_warning=True))
    elif turn.wrong_half is not None and new.wrong_half is None:
        events.append(Event("sector.right"))
    shift_deg = 0.0 if last is None else 360.0 * round((az_deg - before_deg) / 360.0)
    if shift_deg:  # a rate over two turns would be a whole turn in a moment
        state = on_other_turn(state, shift_deg)
    if shift_deg and near_deg is not None:
        fields = {"az_deg": az_deg, "believed_deg": az_deg - shift_deg, "sector_bit": int(status.is_sector_high)}
        events.append(Event("turn.corrected", fields, is_warning=True))
        new = replace(at_rest(new), learned_count=new.learned_count + 1)
    return state if new is turn else with_parts(state, turn=new), az_deg


def on_other_turn(state: ControlState, shift_deg: float) -> ControlState:
    """Everything that is remembered in continuous azimuth, by a multiple of 360 deg further on."""
    return forget_motion(shift_registers(shift_places(state, shift_deg), shift_deg))
