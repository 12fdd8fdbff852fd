"""Which turn of the cable wrap to stand on: chosen once for a whole pass, so that the dish never unwinds in its middle.

Continuous azimuth counts on through north; the bearing is the same modulo 360.  Pure.
"""

from dataclasses import dataclass
from math import ceil, floor, isfinite

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.units import Array, wrap_180

# Above this culmination the real path may pass the zenith on the other side than predicted, and turn the other way.
EITHER_WAY_ELEVATION_DEG = 85.0
# The two ways differ in what happens above this; below it they have the same bearings.
_COMMON_ELEVATION_DEG = 60.0
ROUNDING_DEG = 1e-6
END_SLACK_DEG = 1.0  # an encoder may read so far beyond a soft limit: noise, rounding, a drive that overshoots
END_TIE_DEG = 10.0


@dataclass(frozen=True, slots=True)
class Turn:
    """The turn to take: add offset_deg (a multiple of 360) to the path.

    held_fraction: how much of the path, from its start, lies within the soft limits; inside_fraction: of all of it.
    holds_either_way: also the path that passes the zenith on the other side (the same as holds_path where the
    culmination is too low for that).
    """

    offset_deg: float
    holds_path: bool
    holds_either_way: bool
    held_fraction: float
    inside_fraction: float
    reason: str


def choose_turn(path_az_deg: Array, path_el_deg: Array, limits: AxisLimits, present_az_deg: float) -> Turn:
    """Choose the turn that holds the whole path, the nearest to where the antenna stands among those that do.

    path_az_deg (N,): azimuth continuous over the whole pass (or the rest of it); path_el_deg (N,): elevations of the
    same instants.  Near the zenith a turn that holds both ways round is preferred.  If none holds the path: the one
    that holds it longest from its start, then the one that holds most of it, and the result says so.
    """
    best = equal_turns(path_az_deg, path_el_deg, limits)
    return min(best, key=lambda turn: abs(float(path_az_deg[0]) + turn.offset_deg - present_az_deg))


def equal_turns(path_az_deg: Array, path_el_deg: Array, limits: AxisLimits) -> tuple[Turn, ...]:
    """The turns between which only the way to them decides, lowest first; arguments as those of choose_turn."""
    other_az_deg = _other_way(path_az_deg, path_el_deg)
    first = floor((limits.min_deg - float(path_az_deg.max())) / 360.0)
    last = ceil((limits.max_deg - float(path_az_deg.min())) / 360.0)
    turns = [_judge(360.0 * k, path_az_deg, other_az_deg, limits) for k in range(first, last + 1)]
    best = max(map(_merit, turns))
    return tuple(turn for turn in turns if _merit(turn) == best)


def _merit(turn: Turn) -> tuple[float, ...]:
    return (turn.holds_either_way, turn.holds_path, turn.held_fraction, turn.inside_fraction)


def _other_way(az_deg: Array, el_deg: Array) -> Array:
    """The low parts of the same pass, had it passed the zenith on the other side; the path itself if it cannot."""
    top = int(np.argmax(el_deg))
    if el_deg[top] < EITHER_WAY_ELEVATION_DEG or top in (0, el_deg.size - 1):
        return az_deg
    is_low = el_deg <= _COMMON_ELEVATION_DEG
    is_low[[0, -1]] = True
    is_after = np.arange(az_deg.size) > top
    full_turn = 360.0 if az_deg[-1] > az_deg[0] else -360.0
    return np.where(is_after, az_deg - full_turn, az_deg)[is_low]


def judged(offset_deg: float, path_az_deg: Array, path_el_deg: Array, limits: AxisLimits) -> Turn:
    """What a turn holds of a path; arguments as those of choose_turn."""
    return _judge(offset_deg, path_az_deg, _other_way(path_az_deg, path_el_deg), limits)


def _judge(offset_deg: float, az_deg: Array, other_az_deg: Array, limits: AxisLimits) -> Turn:
    inside = (az_deg + offset_deg >= limits.min_deg) & (az_deg + offset_deg <= limits.max_deg)
    other = other_az_deg + offset_deg
    holds_path = bool(inside.all())
    holds_other = bool((other >= limits.min_deg).all() and (other <= limits.max_deg).all())
    held = 1.0 if holds_path else float(np.argmin(inside)) / az_deg.size
    if holds_path and holds_other:
        reason = "holds the whole pass"
    elif holds_path:
        reason = "holds the pass as predicted, not if it passes the zenith on the other side"
    else:
        reason = f"no turn holds the whole pass: this one holds the first {held:.0%} of it"
    return Turn(offset_deg, holds_path, holds_path and holds_other, held, float(inside.mean()), reason)


def nearest_turn(az_deg: float, near_deg: float, limits: AxisLimits) -> float | None:
    """Give a bearing as the continuous angle within the soft limits nearest to near_deg; None if no turn reaches it."""
    if not isfinite(az_deg) or not isfinite(near_deg):
        return None
    nearest = near_deg + wrap_180(az_deg - near_deg)
    first, last = ceil((limits.min_deg - nearest) / 360.0), floor((limits.max_deg - nearest) / 360.0)
    if first > last:
        return None
    return nearest + 360.0 * min(max(0, first), last)


def sector_for(az_deg: float, limits: AxisLimits) -> int:
    """Give the ACU's parameter S for a wanted continuous angle: 1 low half of the wrap, 2 high (docs/protocol.md,
    Parameters)."""
    return 2 if az_deg >= middle_deg(limits) else 1


def turns_of(az_deg: float, limits: AxisLimits, slack_deg: float = ROUNDING_DEG) -> tuple[float, ...]:
    """Every continuous angle of a bearing within the soft limits, or beyond them by slack_deg, lowest first."""
    first = ceil((limits.min_deg - slack_deg - az_deg) / 360.0)
    last = floor((limits.max_deg + slack_deg - az_deg) / 360.0)
    return tuple(az_deg + 360.0 * turn for turn in range(first, last + 1))


def is_one_turn(limits: AxisLimits) -> bool:
    """Whether the range has one turn for every bearing (its ends apart): there the sector bit means nothing."""
    return limits.max_deg - limits.min_deg <= 360.0 + ROUNDING_DEG


def encoder_continuous(
    az_deg: float,
    is_sector_high: bool,
    limits: AxisLimits,
    *,
    near_deg: float | None = None,
    end: int = 0,
) -> float:
    """Turn an encoder azimuth in [0, 360) into the continuous angle within the soft limits (docs/protocol.md,
    Behaviour).

    end: +1 at the clockwise limit switch, -1 at the other, if the bearing is that of the end.  near_deg: where the axis
    was a moment ago; no drive makes a turn in a moment, so it decides next.  Else the only turn inside the limits is
    taken, whatever the sector bit n6.b3 says; with a range of more than 360 deg and two such turns the bit decides.
    An angle that no turn reaches is the one nearest to the limits.
    """
    near = turns_of(az_deg, limits, END_SLACK_DEG)
    if not near:
        around = turns_of(az_deg, limits, 360.0)
        return min(around, key=lambda turn: max(limits.min_deg - turn, turn - limits.max_deg))
    at_end_deg = {1: limits.max_deg, -1: limits.min_deg}.get(end)
    at_end = [turn for turn in near if at_end_deg is not None and abs(turn - at_end_deg) <= END_SLACK_DEG]
    if at_end:
        return at_end[0]
    if near_deg is not None:
        return min(near, key=lambda turn: abs(turn - near_deg))
    inside = turns_of(az_deg, limits) or near
    if len(inside) == 1 or is_one_turn(limits):
        return inside[0]
    middle = middle_deg(limits)
    low, high = (middle, limits.max_deg) if is_sector_high else (limits.min_deg, middle)
    return min(inside, key=lambda turn: (max(low - turn, turn - high, 0.0), abs(turn - (low + high) / 2)))


def nearest_end_deg(az_deg: float, near_deg: float, limits: AxisLimits) -> float:
    """Give the end of the range nearest to a bearing that no turn reaches.

    Where both are as near, within END_TIE_DEG: the one nearest to near_deg, so that no noise moves the axis from end
    to end.
    """
    low_deg, high_deg = (abs(wrap_180(az_deg - end)) for end in (limits.min_deg, limits.max_deg))
    if abs(low_deg - high_deg) < END_TIE_DEG:
        return min((limits.min_deg, limits.max_deg), key=lambda end: abs(end - near_deg))
    return limits.min_deg if low_deg < high_deg else limits.max_deg


def middle_deg(limits: AxisLimits) -> float:
    """What divides the halves of the sector bit."""
    return (limits.min_deg + limits.max_deg) / 2
