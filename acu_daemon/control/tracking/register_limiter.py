"""The register limiter: every register write is limited to what axes and drives can do; none passes beside it.  Pure.

Not finite: refused with a reason, the last good value stays.  Outside the limits: each axis goes as near as they allow,
and the other one follows.  Registers that the antenna follows are clamped to what the axis can do; registers it does
not follow hold the true path, also through the zenith.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import copysign, cos, isfinite, radians

from acu_daemon.acu.angle_steps import clamp_to_step
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tracking.keep_clear import AROUND_SHARE, braking, is_far, led_clear
from acu_daemon.model import AxisLimits, Pointing
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.pointing.wrap import nearest_end_deg

LIMIT_SLACK_DEG = 0.1  # noise of a reading at a limit is clamped without a word
PATH_MARGIN = 1.0  # of the drive's limits, on the path: a way past the zenith takes 0.98 of them (pointing.keyhole)
BRAKING_MARGIN = 0.98  # of an axis that moves away from its path
NEAR_DEG, NEAR_DEG_S = 0.5, 2.0  # nearer than this to the path in angle and rate is on it
CHASE_RATE_MARGIN = 0.9  # while it chases the path: an antenna that fell behind must be able to catch up,
CHASE_ACCELERATION_MARGIN = 0.6  # and must not stay behind its registers all the way (decision 0020)
CATCH_UP_SHARE = 0.02  # of the drive's rate: more than a path takes
ENTRY_S = 1.2  # where the satellite enters the beam, autotrack takes over: half a beam in no less time than this
STRAY_DEG = 0.5  # an antenna this far from the register it is about to follow starts from where it is
WINDUP_DEG = 10.0  # a followed register may lead the antenna by this and WINDUP_S of the motion, then it waits
WINDUP_S = 0.2
LEAST_COS_EL = 0.01
FRESH_S = 1.0  # readings older than this say nothing about the present rate


@dataclass(frozen=True, slots=True)
class Passed:
    """What may be sent: axis states at angles that the ACU can carry, within the limits; or why nothing new."""

    az: AxisState
    el: AxisState
    is_held_back: bool
    refusal: str = ""
    limited: str = ""  # which axis is held at its limit, for people


def limit(
    wanted: Pointing, state: ControlState, now_tai_s: float, *, is_followed: bool, dt_s: float, config: ControlConfig
) -> Passed:
    """Let a wanted pointing pass, hold it back, or refuse it.  dt_s: since the last write."""
    az, el = _from(state, now_tai_s, is_followed=is_followed)
    step_deg = config.acu.angle_step_deg
    if not wanted.is_finite:
        az, el = replace(az, rate_deg_s=0.0), replace(el, rate_deg_s=0.0)
        return Passed(
            _legal(az, config.azimuth, step_deg), _legal(el, config.elevation, step_deg), True, "not a finite angle"
        )
    wanted, limited = within_limits(wanted, az.position_deg, config)
    azimuth, elevation = config.azimuth, config.elevation
    has_zones = config.envelope.has_zones and not is_far(wanted, az, el, dt_s, now_tai_s, config.envelope)
    if has_zones:
        led = led_clear(wanted, az, el, now_tai_s, config.envelope, is_followed=is_followed)
        wanted, limited = led.wanted, limited or led.told
        if led.is_around:
            azimuth, elevation = _share(azimuth, AROUND_SHARE, 1.0), _share(elevation, AROUND_SHARE, 1.0)
    new_az, new_el = (
        AxisState(wanted.az_deg, wanted.az_rate_deg_s),
        AxisState(wanted.el_deg, wanted.el_rate_deg_s),
    )
    if is_followed:
        half_beam_deg = config.beamwidth_deg / 2
        half_beam_az_deg = half_beam_deg / max(abs(cos(radians(wanted.el_deg))), LEAST_COS_EL)
        antenna_az, antenna_el = _antenna(state, now_tai_s)
        new_az = _reachable(az, _waiting(az, antenna_az, new_az), dt_s, azimuth, half_beam_az_deg)
        new_el = _reachable(el, _waiting(el, antenna_el, new_el), dt_s, elevation, half_beam_deg)
        if has_zones:
            new_az, new_el = braking((az, el), (new_az, new_el), dt_s, now_tai_s, config.envelope)
    is_held_back = new_az.position_deg != wanted.az_deg or new_el.position_deg != wanted.el_deg
    az, el = _legal(new_az, config.azimuth, step_deg), _legal(new_el, config.elevation, step_deg)
    return Passed(az, el, is_held_back, limited=limited)


def within_limits(wanted: Pointing, near_az_deg: float, config: ControlConfig) -> tuple[Pointing, str]:
    """Take each axis as near to a finite pointing as its limits allow; what is held there is said.

    An azimuth that no turn reaches goes to the end of the range that is nearest to its bearing; near_az_deg (the
    register, or the antenna) decides where both are.
    """
    if is_within(wanted.az_deg, config.azimuth) and is_within(wanted.el_deg, config.elevation):
        return wanted, ""
    held = []
    if not is_within(wanted.az_deg, config.azimuth):
        end_deg = nearest_end_deg(wanted.az_deg, near_az_deg, config.azimuth)
        wanted = replace(wanted, az_deg=end_deg, az_rate_deg_s=0.0)
        held.append(_held_text("azimuth", end_deg, config.azimuth))
    if not is_within(wanted.el_deg, config.elevation):
        end_deg = min(max(wanted.el_deg, config.elevation.min_deg), config.elevation.max_deg)
        wanted = replace(wanted, el_deg=end_deg, el_rate_deg_s=0.0)
        held.append(_held_text("elevation", end_deg, config.elevation))
    return wanted, "; ".join(held)


def is_within(angle_deg: float, limits: AxisLimits) -> bool:
    """Whether an axis reaches an angle; one at a limit has noise."""
    return limits.min_deg - LIMIT_SLACK_DEG <= angle_deg <= limits.max_deg + LIMIT_SLACK_DEG


def _held_text(name: str, end_deg: float, limits: AxisLimits) -> str:
    return f"{name} outside {limits.min_deg:g} to {limits.max_deg:g} deg, held at {end_deg:g}"


def _from(state: ControlState, now_tai_s: float, *, is_followed: bool) -> tuple[AxisState, AxisState]:
    """Where a followed register starts from: the last command, or the antenna when it is not there."""
    az, el = _antenna(state, now_tai_s)
    return (
        _anchor(state.registers.axis_az, az, begins=is_followed and not state.registers.was_followed),
        _anchor(state.registers.axis_el, el, begins=is_followed and not state.registers.was_followed),
    )


def _antenna(state: ControlState, now_tai_s: float) -> tuple[AxisState, AxisState]:
    """Where the antenna is now and how fast it moves, from the last half second of readings."""
    intake = state.intake
    if not intake.track_of_readings:
        return AxisState(intake.az_deg), AxisState(intake.status.el_deg if intake.status is not None else 0.0)
    first, last = intake.track_of_readings[0], intake.track_of_readings[-1]
    span_s, age_s = last[0] - first[0], now_tai_s - last[0]
    if not (0.0 < span_s < FRESH_S and age_s < FRESH_S):
        return AxisState(last[1]), AxisState(last[2])
    az_rate, el_rate = (last[1] - first[1]) / span_s, (last[2] - first[2]) / span_s
    return AxisState(last[1] + az_rate * age_s, az_rate), AxisState(last[2] + el_rate * age_s, el_rate)


def _anchor(last: AxisState | None, antenna: AxisState, *, begins: bool) -> AxisState:
    if last is None:
        return replace(antenna, rate_deg_s=0.0)
    is_stray = abs(last.position_deg - antenna.position_deg) > STRAY_DEG + _moving_deg(last, antenna)
    return antenna if begins and is_stray else last


def _moving_deg(register: AxisState, antenna: AxisState) -> float:
    return WINDUP_S * max(abs(register.rate_deg_s), abs(antenna.rate_deg_s))


def _waiting(register: AxisState, antenna: AxisState, wanted: AxisState) -> AxisState:
    """Let a register stand that leads its antenna by too much, until the antenna has come; it is never put back."""
    lead_deg = register.position_deg - antenna.position_deg
    is_leaving = (wanted.position_deg - register.position_deg) * lead_deg > 0.0
    if is_leaving and abs(lead_deg) > WINDUP_DEG + _moving_deg(register, antenna):
        return AxisState(register.position_deg)
    return wanted


def _reachable(start: AxisState, wanted: AxisState, dt_s: float, limits: AxisLimits, half_beam_deg: float) -> AxisState:
    """On the path: all that the drive can do.  Off it: a chase that the antenna can follow easily.

    half_beam_deg: in degrees of this axis.  An axis that moves away from the path brakes with all it has.
    """
    on_path = _share(limits, PATH_MARGIN, PATH_MARGIN)
    reached = step(start, wanted.position_deg, wanted.rate_deg_s, dt_s, on_path)
    is_near = abs(reached.position_deg - wanted.position_deg) < NEAR_DEG
    if is_near and abs(reached.rate_deg_s - wanted.rate_deg_s) < NEAR_DEG_S:
        return reached
    gap_deg = wanted.position_deg - wanted.rate_deg_s * dt_s - start.position_deg  # both at the start of the step
    is_leaving = (start.rate_deg_s - wanted.rate_deg_s) * gap_deg < 0.0
    fast = round(min(abs(wanted.rate_deg_s) / limits.max_rate_deg_s + CATCH_UP_SHARE, PATH_MARGIN), 2)
    chase_rate = max(CHASE_RATE_MARGIN, fast)  # on a way past the zenith the path itself takes nearly all
    chase = _share(limits, chase_rate, BRAKING_MARGIN if is_leaving else CHASE_ACCELERATION_MARGIN)
    aim_deg = wanted.position_deg
    if abs(gap_deg) > half_beam_deg:
        aim_deg -= copysign(_short_deg(half_beam_deg, chase.max_acceleration_deg_s2), gap_deg)
    bounded = replace(start, rate_deg_s=min(max(start.rate_deg_s, -chase.max_rate_deg_s), chase.max_rate_deg_s))
    return step(bounded, aim_deg, wanted.rate_deg_s, dt_s, chase)


def _short_deg(half_beam_deg: float, acceleration_deg_s2: float) -> float:
    """How far short of the path to aim, so that a braking axis enters the beam with half a beam in ENTRY_S."""
    entry_deg_s = half_beam_deg / ENTRY_S
    return max(half_beam_deg - entry_deg_s**2 / 2.0 / acceleration_deg_s2, 0.0)


@lru_cache(maxsize=16)
def _share(limits: AxisLimits, rate: float, acceleration: float) -> AxisLimits:
    return replace(
        limits,
        max_rate_deg_s=limits.max_rate_deg_s * rate,
        max_acceleration_deg_s2=limits.max_acceleration_deg_s2 * acceleration,
    )


def _legal(axis: AxisState, limits: AxisLimits, step_deg: float) -> AxisState:
    if not isfinite(axis.position_deg):
        return axis  # nothing good was known: the command permit keeps it back
    return AxisState(clamp_to_step(axis.position_deg, limits.min_deg, limits.max_deg, step_deg), axis.rate_deg_s)
