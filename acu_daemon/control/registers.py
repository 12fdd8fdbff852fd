"""The register writes: what is sent, what the ACU refuses, what is in force.  Pure.

Owner of `Registers` and `Refusals`.
"""

import math
from dataclasses import replace

from acu_daemon.acu.commands import PointAndPoll
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, Sent
from acu_daemon.control.tick_input import Observation
from acu_daemon.control.tracking.register_limiter import Passed, limit, within_limits
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.with_parts import with_parts
from acu_daemon.model import Pointing

REFUSED_PAUSE_S = 1.0  # a write that is refused again within REFUSED_AGAIN_S waits this long
REFUSED_AGAIN_S = 2.0
SETTLE_S = 1.0  # after a change of state the servo takes up the path: what it is short of then is no lag
LIMITED_S = 2.0  # an axis that was not held at its limit for so long is within them again
REGULAR_SHARE = 0.1  # of the period: of writes that come less regularly no lag is learned
CALM_SHARE = 0.25  # of the drive's rate: above it a lag is what the drive cannot do, not what it does late


def take_refusal(state: ControlState, now_tai_s: float, events: list[Event]) -> ControlState:
    """The ACU refused the last write: again and again, and the next one waits."""
    registers = state.registers
    is_again = now_tai_s - registers.refused_tai_s < REFUSED_AGAIN_S
    sent = registers.commands[-1] if registers.commands else None
    fields = {"az_deg": sent.az_deg, "el_deg": sent.el_deg} if sent else {}
    events.append(Event("acu.refused_write", fields, is_warning=True))
    pause_s = REFUSED_PAUSE_S if is_again else 0.0
    registers = replace(registers, refused_tai_s=now_tai_s, refused_until_tai_s=now_tai_s + pause_s)
    return with_parts(state, registers=registers)


def take_in_force(state: ControlState, seen: Observation) -> ControlState:
    """The write that this status answers is what the ACU holds now."""
    sent = state.registers.commands[-1] if state.registers.commands else None
    if sent is None or seen.refused is not None or seen.reading is None:
        return state
    in_force = (seen.reading.tai_s, sent.az_deg, sent.el_deg)
    return with_parts(state, registers=replace(state.registers, in_force=in_force))


def shift_registers(state: ControlState, shift_deg: float) -> ControlState:
    """Put what is in continuous azimuth on another turn: by a multiple of 360 deg further on."""
    axis_az, in_force = state.registers.axis_az, state.registers.in_force
    registers = replace(
        state.registers,
        axis_az=None if axis_az is None else replace(axis_az, position_deg=axis_az.position_deg + shift_deg),
        commands=(),
        in_force=None if in_force is None else (in_force[0], in_force[1] + shift_deg, in_force[2]),
    )
    return with_parts(state, registers=registers)


def forget_axes(state: ControlState) -> ControlState:
    """The next write starts from where the antenna is."""
    registers = replace(state.registers, axis_az=None, axis_el=None, was_followed=False)
    return with_parts(state, registers=registers)


def forget_writes(state: ControlState) -> ControlState:
    """With the link what was written last is lost."""
    registers = replace(state.registers, axis_az=None, axis_el=None, last_write_tai_s=None, commands=())
    return with_parts(state, registers=registers)


def forget_in_force(state: ControlState) -> ControlState:
    """Once the antenna was stopped no register is followed."""
    return with_parts(state, registers=replace(state.registers, in_force=None))


def note_no_write(state: ControlState) -> ControlState:
    """A tick without a write."""
    commands = (*state.registers.commands[-2:], None)
    return with_parts(state, registers=replace(state.registers, commands=commands))


def refuse_input(state: ControlState, refused: str, events: list[Event]) -> ControlState:
    """Count what the tick was given and is not finite, and tell it once."""
    refusals = state.refusals
    if refused and refused != refusals.refused_input:
        events.append(Event("input.refused", {"input": refused, "reason": "not finite"}, is_warning=True))
    if not refused and not refusals.refused_input:
        return state
    count = refusals.refusal_count + bool(refused)
    return with_parts(state, refusals=replace(refusals, refused_input=refused, refusal_count=count))


def count_refusals(state: ControlState, count: int) -> ControlState:
    """Count commands that were kept back."""
    refusals = replace(state.refusals, refusal_count=state.refusals.refusal_count + count)
    return with_parts(state, refusals=refusals)


def write(
    state: ControlState, wanted: Pointing, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> tuple[ControlState, PointAndPoll]:
    """Make the register write for a wanted pointing, as near to it as limits and drives allow."""
    registers, status = state.registers, state.intake.status
    is_followed = status is not None and status.follows_registers
    dt_s = now_tai_s - registers.last_write_tai_s if registers.last_write_tai_s is not None else config.period_s
    dt_s = min(max(dt_s, config.period_s / 2), max(3 * config.period_s, config.acu.reply_deadline_s))
    passed = limit(wanted, state, now_tai_s, is_followed=is_followed, dt_s=dt_s, config=config)
    state = _tell(state, passed, wanted, now_tai_s, events, is_followed=is_followed)
    has_goal = is_followed and wanted.is_finite
    goal_az_deg = within_limits(wanted, state.intake.az_deg, config)[0].az_deg if has_goal else None
    return _sent(state, passed, now_tai_s, config, is_followed=is_followed, goal_az_deg=goal_az_deg)


def _tell(
    state: ControlState,
    passed: Passed,
    wanted: Pointing,
    now_tai_s: float,
    events: list[Event],
    *,
    is_followed: bool,
) -> ControlState:
    """Count what was held back, and tell it once for each edge.

    An axis that comes and goes at its limit is one that is held there.
    """
    refusals = state.refusals
    limited, limited_tai_s, limited_count = refusals.limited, refusals.limited_tai_s, refusals.limited_count
    where = {"az_deg": wanted.az_deg, "el_deg": wanted.el_deg}
    if passed.refusal and passed.refusal != refusals.refusal:
        events.append(Event("gate.refused", {"reason": passed.refusal, **where}, is_warning=True))
    if passed.limited:
        if passed.limited != limited:
            events.append(Event("gate.limited", {"axis": passed.limited, **where}, is_warning=True))
        limited, limited_tai_s, limited_count = passed.limited, now_tai_s, limited_count + 1
    elif limited and now_tai_s - limited_tai_s > LIMITED_S:
        events.append(Event("gate.within_limits"))
        limited = ""
    is_clamped = is_followed and passed.is_held_back and not passed.refusal
    if not (passed.refusal or refusals.refusal or limited or refusals.limited or is_clamped):
        return state
    refusals = replace(
        refusals,
        refusal=passed.refusal,
        limited=limited,
        limited_tai_s=limited_tai_s,
        limited_count=limited_count,
        refusal_count=refusals.refusal_count + bool(passed.refusal),
        clamped_count=refusals.clamped_count + is_clamped,
    )
    return with_parts(state, refusals=refusals)


def _sent(
    state: ControlState,
    passed: Passed,
    now_tai_s: float,
    config: ControlConfig,
    *,
    is_followed: bool,
    goal_az_deg: float | None,
) -> tuple[ControlState, PointAndPoll]:
    registers, az_deg, el_deg = state.registers, passed.az.position_deg, passed.el.position_deg
    is_calm = (
        abs(passed.az.rate_deg_s) < CALM_SHARE * config.azimuth.max_rate_deg_s
        and abs(passed.el.rate_deg_s) < CALM_SHARE * config.elevation.max_rate_deg_s
    )
    is_settled = now_tai_s - state.tracking.entered_tai_s > SETTLE_S
    since_s = now_tai_s - (registers.last_write_tai_s or -math.inf)
    is_regular = abs(since_s - config.period_s) < REGULAR_SHARE * config.period_s
    is_free = is_calm and is_settled and is_regular and is_followed and registers.was_followed
    is_beside_zenith = state.tracking.track is TrackState.ZENITH  # where noise of the azimuth is many times larger
    is_free = is_free and not passed.is_held_back and not passed.limited and not is_beside_zenith
    registers = replace(
        registers,
        axis_az=passed.az,
        axis_el=passed.el,
        was_followed=is_followed,
        last_write_tai_s=now_tai_s,
        commands=(*registers.commands[-2:], Sent(az_deg, el_deg, is_free)),
        goal_az_deg=goal_az_deg,
    )
    return with_parts(state, registers=registers), PointAndPoll(az_deg, el_deg, config.tilt_deg)


def note_as_if_written(state: ControlState, written: ControlState) -> ControlState:
    """What a disarmed daemon would write, for people to see: all of it but the commands, of which none was sent."""
    registers = replace(written.registers, commands=state.registers.commands)
    return with_parts(written, registers=registers)
