"""Whether each axis does what it is told: one that stands still, runs away or turns the wrong way is found.  Pure.

Azimuth counts as on the sky (times cos el), so the angles of the configuration mean the same at every elevation.
An axis is judged by a mark: where it was when it last did what was wanted.  A single late, frozen or wild reading moves
no axis, and what a drive needs to brake, or an encoder to jump, is not held against it.
"""

from dataclasses import dataclass, replace
from enum import Enum, auto
from math import cos, inf, radians

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.model import AxisLimits

PROGRESS_SHARE = 0.25  # of the following error: an axis that came so much nearer to its command obeys
AWAY_S = 0.5  # a motion the wrong way must be seen for this long
BRAKING_MARGIN = 2.0  # a drive may brake with half of its acceleration limit
FAST_MARGIN = 2.0  # of the drive's rate: faster than that no drive is by its own will
FAST_S = 1.0
GAP_S = 1.0  # without a reading for so long, everything begins anew
LEAST_COS_EL = 0.01
AWAY = "moves away from its command"

STANDING_MODES = (AcuMode.STANDBY, AcuMode.ACQUIRE, AcuMode.POSITION_MEMORY, AcuMode.STOWED)
UNWATCHED_MODES = (AcuMode.MANUAL, AcuMode.FAULT, AcuMode.STOWING)  # somebody else's hand, or no drive


class Duty(Enum):
    """What the ACU's mode makes of an axis."""

    FOLLOW = auto()  # the registers
    STAND = auto()
    FREE = auto()  # moves by itself: autotrack, rate memory
    UNWATCHED = auto()


@dataclass(frozen=True, slots=True)
class Bounds:
    """The configured angle on the sky and time; error_s = 0: nothing is watched."""

    error_deg: float = 1.0
    error_s: float = 2.0


@dataclass(frozen=True, slots=True)
class AxisSeen:
    """One reading of an axis.  gap_deg: from there to its command; None: not known.  scale: its degrees on the sky."""

    tai_s: float
    angle_deg: float
    rate_deg_s: float
    duty: Duty
    gap_deg: float | None = None
    scale: float = 1.0


@dataclass(frozen=True, slots=True)
class AxisWatch:
    """The memory of one axis: the newest reading, and the mark."""

    last: AxisSeen | None = None
    side: int = 0  # where the command is, seen from the axis: +1, -1; 0: near enough
    mark_tai_s: float = -inf
    mark_deg: float = 0.0
    wrong_deg_s: float = 0.0  # how fast the axis moved the wrong way at the mark: it may brake
    wrong_since_tai_s: float = inf
    fast_since_tai_s: float = inf


def duty_of(status: AcuStatus) -> Duty:
    """What the mode asks of the axes (docs/adding-an-acu.md, Modes)."""
    if status.mode in UNWATCHED_MODES or not status.is_remote_enabled:
        return Duty.UNWATCHED
    if status.follows_registers:
        return Duty.FOLLOW
    return Duty.STAND if status.mode in STANDING_MODES else Duty.FREE


def watch_axis(watch: AxisWatch, seen: AxisSeen, limits: AxisLimits, bounds: Bounds) -> tuple[AxisWatch, str]:
    """Judge one more reading.  Returns what is wrong with the axis, in words; empty: nothing."""
    last = watch.last
    if last is not None and seen.tai_s <= last.tai_s:
        return watch, ""
    if seen.duty is Duty.UNWATCHED or last is None or _is_new(last, seen, limits, bounds):
        return _marked(seen, inf, abs(seen.rate_deg_s)), ""
    fast_since_tai_s = _fast_since_tai_s(watch, seen, limits, bounds)
    is_fast = seen.tai_s - fast_since_tai_s >= FAST_S
    is_judged = seen.duty is Duty.STAND or (seen.duty is Duty.FOLLOW and seen.gap_deg is not None)
    if not is_fast and not is_judged:
        return _marked(seen, fast_since_tai_s), ""
    watch = replace(watch, last=seen, fast_since_tai_s=fast_since_tai_s)
    if is_fast:
        return watch, "moves faster than its drive can"
    if seen.duty is Duty.FOLLOW and seen.gap_deg is not None:
        return _watch_following(watch, seen, seen.gap_deg, limits, bounds)
    return _watch_standing(watch, seen, limits, bounds)


def _is_new(last: AxisSeen, seen: AxisSeen, limits: AxisLimits, bounds: Bounds) -> bool:
    """Another duty, a pause, or a jump that is the encoder's and not the axis's."""
    span_s = seen.tai_s - last.tai_s
    jump_deg = abs(seen.angle_deg - last.angle_deg)
    is_jump = jump_deg > FAST_MARGIN * limits.max_rate_deg_s * span_s + bounds.error_deg / seen.scale
    return seen.duty is not last.duty or span_s > GAP_S or is_jump


def _marked(seen: AxisSeen, fast_since_tai_s: float, wrong_deg_s: float = 0.0, side: int = 0) -> AxisWatch:
    return AxisWatch(seen, side, seen.tai_s, seen.angle_deg, wrong_deg_s, fast_since_tai_s=fast_since_tai_s)


def _fast_since_tai_s(watch: AxisWatch, seen: AxisSeen, limits: AxisLimits, bounds: Bounds) -> float:
    most_deg_s = FAST_MARGIN * limits.max_rate_deg_s + bounds.error_deg / seen.scale / AWAY_S
    is_fast = abs(seen.rate_deg_s) > most_deg_s
    return min(watch.fast_since_tai_s, seen.tai_s) if is_fast else inf


def _braking(watch: AxisWatch, limits: AxisLimits) -> tuple[float, float]:
    """Way and time that an axis needs to brake from its speed at the mark."""
    braking_deg_s2 = limits.max_acceleration_deg_s2 / BRAKING_MARGIN
    return watch.wrong_deg_s**2 / (2.0 * braking_deg_s2), watch.wrong_deg_s / braking_deg_s2


def _wrong_for_s(watch: AxisWatch, seen: AxisSeen, *, is_wrong: bool) -> tuple[AxisWatch, float]:
    since_tai_s = min(watch.wrong_since_tai_s, seen.tai_s) if is_wrong else inf
    return replace(watch, wrong_since_tai_s=since_tai_s), seen.tai_s - since_tai_s


def _watch_standing(watch: AxisWatch, seen: AxisSeen, limits: AxisLimits, bounds: Bounds) -> tuple[AxisWatch, str]:
    braking_deg, braking_s = _braking(watch, limits)
    moved_deg = abs(seen.angle_deg - watch.mark_deg)
    is_wrong = moved_deg > bounds.error_deg / seen.scale + braking_deg
    watch, wrong_s = _wrong_for_s(watch, seen, is_wrong=is_wrong)
    if is_wrong:
        return watch, "moves without a command" if wrong_s >= bounds.error_s else ""
    if seen.tai_s - watch.mark_tai_s > bounds.error_s + braking_s:
        return _marked(seen, watch.fast_since_tai_s), ""
    return watch, ""


def _watch_following(
    watch: AxisWatch, seen: AxisSeen, gap_deg: float, limits: AxisLimits, bounds: Bounds
) -> tuple[AxisWatch, str]:
    error_deg = bounds.error_deg / seen.scale
    side = 0 if abs(gap_deg) <= error_deg else (1 if gap_deg > 0 else -1)
    if side == 0:
        return _marked(seen, watch.fast_since_tai_s), ""
    nearer_deg = side * (seen.angle_deg - watch.mark_deg)
    if side != watch.side or nearer_deg >= PROGRESS_SHARE * error_deg:
        return _marked(seen, watch.fast_since_tai_s, max(-side * seen.rate_deg_s, 0.0), side), ""
    braking_deg, braking_s = _braking(watch, limits)
    watch, wrong_s = _wrong_for_s(watch, seen, is_wrong=nearer_deg < -error_deg - braking_deg)
    if wrong_s >= AWAY_S:
        return watch, AWAY
    if seen.tai_s - watch.mark_tai_s >= bounds.error_s + braking_s and wrong_s < 0.0:
        return watch, "stands still away from its command"
    return watch, ""


@dataclass(frozen=True, slots=True)
class AxesWatch:
    """The memory of both axes."""

    az: AxisWatch = AxisWatch()
    el: AxisWatch = AxisWatch()


def watch_axes(
    watch: AxesWatch,
    status: AcuStatus,
    az: AxisSeen,
    el: AxisSeen,
    limits: tuple[AxisLimits, AxisLimits],
    bounds: Bounds,
) -> tuple[AxesWatch, str]:
    """Judge one more reading of both; an axis at a limit switch that its command lies behind is left alone."""
    new_az, az_problem = watch_axis(watch.az, _open(az, *az_ends(status)), limits[0], bounds)
    new_el, el_problem = watch_axis(watch.el, _open(el, *el_ends(status)), limits[1], bounds)
    problems = [f"{name} {text}" for name, text in (("azimuth", az_problem), ("elevation", el_problem)) if text]
    return AxesWatch(new_az, new_el), "; ".join(problems)


def az_ends(status: AcuStatus) -> tuple[bool, bool]:
    """Whether the azimuth is at its clockwise and at its counter-clockwise limit."""
    return status.is_at_cw_limit, status.is_at_ccw_limit


def el_ends(status: AcuStatus) -> tuple[bool, bool]:
    """Whether the elevation is at its upper and at its lower limit."""
    return status.is_at_up_limit, status.is_at_down_limit


def _open(seen: AxisSeen, is_at_max: bool, is_at_min: bool) -> AxisSeen:
    gap_deg = seen.gap_deg
    is_behind = gap_deg is not None and ((is_at_max and gap_deg > 0.0) or (is_at_min and gap_deg < 0.0))
    return replace(seen, gap_deg=None) if is_behind else seen


def sky_scale(el_deg: float) -> float:
    """How many degrees on the sky a degree of azimuth is."""
    return max(abs(cos(radians(el_deg))), LEAST_COS_EL)  # beyond the zenith as before it
