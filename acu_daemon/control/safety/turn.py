"""On which turn of the cable wrap the antenna stands, and whether that can be true.  Pure.

The encoder shows a bearing.  With a range of at most 360 deg it has one turn; with a wider one a bearing beside the
ends has two, and one bit of the status (docs/adding-an-acu.md) tells them apart: the half of the range.  A bit may be
stuck, not driven or random, so it is believed only for the first place.  From there the motion is counted: between two
readings no drive makes a turn, so the turn nearest to the last place is the right one.  Three things make a place sure,
whatever was believed: a bearing that one turn alone reaches, a limit switch at its end, and a move that only one turn
explains.

    bearing    -270 ----- -90 ------------- 90 ----- 270       a range of -270..270: 90..270 is reached twice,
    turns      | two turns |     one turn    | two turns |      from -90 to 90 a bearing is sure

A place that was believed wrongly shows in two ways:
- the antenna stands.  At its stop, or with a register that the ACU refuses, it moves no further towards its goal
  (`watch_goal`).  What counts is the antenna's own motion, never the gap: a path near the zenith runs away from every
  drive, and an antenna that drives towards it as fast as it can, brakes or turns round is on no wrong turn;
- the ACU, which knows better, cannot go on past its stop and drives the antenna the long way round: away from its
  command, though no axis is reversed (`is_pulled_round`), and further than it needs to brake (`watch_pull`).
Either stops the antenna and puts the other turn in the place of the believed one; control.safety.turn_doubt then
moves it.
An azimuth that stands on a turn that is sure, or on either, is no matter of turns: it is latched.
"""

from dataclasses import dataclass, replace
from enum import Enum, auto
from math import inf

from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.safety.axis_watch import BRAKING_MARGIN
from acu_daemon.model import AxisLimits
from acu_daemon.pointing.wrap import END_SLACK_DEG, encoder_continuous, is_one_turn, middle_deg, nearest_turn, turns_of
from acu_daemon.units import wrap_180

SURE_COUNT, AGAINST_COUNT = 10, 5
BIT_MARGIN_DEG = 3.0  # so near to the middle the bit may be either
BIT_SCORE = 20  # of readings that belie the bit (2 each, -1 for one that does not): from then on it tells nothing
PULL_DEG_S, PULL_S = 1.0, 0.5  # so fast, for so long: no noise
NOISE_DEG = 0.1  # of a reading, at most, on the sky: beside the zenith it is many degrees of azimuth
GOAL_DEG = 2.0  # nearer than this the antenna is there
NEARER_DEG = 1.0  # an azimuth that has moved so much towards its goal makes progress
RATE_SHARE = 0.8  # of the drive's rate, which a move takes at least, starts and stops apart
PATIENCE_S = 5.0  # beside the time that the drives need
STEP_DEG = 10.0  # in the time for this and PATIENCE_S a drive makes progress


class Phase(Enum):
    """What is done about a turn."""

    BELIEVED = auto()
    STOPPING = auto()  # nothing is written, no mode is selected, until the antenna stands
    MOVING = auto()  # by a few degrees, on the other turn


@dataclass(frozen=True, slots=True)
class TurnWatch:
    """The memory of the turn."""

    is_sure: bool = False
    sure_count: int = 0  # of readings in a row that show the turn, as far as SURE_COUNT
    against_count: int = 0  # of readings in a row against it
    bit_score: int = 0
    wrong_half: int | None = None  # the half of the range in which the bit was found wrong; None: it is believed
    phase: Phase = Phase.BELIEVED
    move_to_deg: float | None = None  # while MOVING
    learned_count: int = 0
    goal_deg: float | None = None  # as it stood when the way to it began
    way_deg: float = 0.0  # to the goal, at the begin
    begun_tai_s: float = inf
    side: int = 0  # where the goal is, seen from the azimuth: +1, -1; 0: there
    mark_deg: float = 0.0  # where the azimuth was when it last made progress
    mark_tai_s: float = inf
    pulled_since_tai_s: float = inf
    pulled_from_deg: float = 0.0
    braking_deg: float = 0.0  # the way that it needs to brake from its speed then
    problem: str = ""  # for people, while the antenna is late

    @property
    def is_stopping(self) -> bool:
        return self.phase is Phase.STOPPING

    @property
    def alarm(self) -> str:
        """What a person should know; empty: nothing."""
        bit = "" if self.wrong_half is None else "the ACU's sector bit is wrong: the turn is counted without it"
        return "; ".join(text for text in (self.problem, bit) if text)


def locate(
    watch: TurnWatch, status: AcuStatus, limits: AxisLimits, near_deg: float | None, *, has_bit: bool = True
) -> tuple[TurnWatch, float]:
    """Where the azimuth is, continuous.  near_deg: where it was a moment ago; None: not known, or not to be relied on.

    What speaks against the turn that was counted is believed after AGAINST_COUNT readings in a row: beside the zenith
    the noise of an azimuth is many degrees.  What the bit says, where there is one, is compared with the turn, and
    counted.  An ACU that counts the turns itself is believed.
    """
    if status.turns_deg is not None:
        az_deg = nearest_turn(status.turns_deg, status.turns_deg, limits)
        watch = watch if watch.is_sure else replace(watch, is_sure=True, sure_count=SURE_COUNT)
        return watch, status.turns_deg if az_deg is None else az_deg
    end = int(status.is_at_cw_limit) - int(status.is_at_ccw_limit)
    az_deg = encoder_continuous(status.az_deg, status.is_sector_high, limits, near_deg=near_deg, end=end)
    if near_deg is not None:
        counted_deg = near_deg + wrap_180(status.az_deg - near_deg)
        is_against = abs(az_deg - counted_deg) > 180.0
        against_count = (watch.against_count + 1) % AGAINST_COUNT if is_against else 0
        az_deg = counted_deg if is_against and against_count else az_deg
        watch = watch if against_count == watch.against_count else replace(watch, against_count=against_count)
    if is_one_turn(limits):
        return watch, az_deg
    watch = _judge_bit(watch, status, az_deg, limits) if has_bit else watch
    end_deg = {1: limits.max_deg, -1: limits.min_deg}.get(end)
    is_at_end = end_deg is not None and abs(az_deg - end_deg) <= END_SLACK_DEG
    is_shown = is_at_end or len(turns_of(status.az_deg, limits, END_SLACK_DEG)) == 1
    count = min(watch.sure_count + 1, SURE_COUNT) if is_shown else 0
    is_sure = count == SURE_COUNT or (watch.is_sure and near_deg is not None)
    if (is_sure, count) == (watch.is_sure, watch.sure_count):
        return watch, az_deg
    return replace(watch, is_sure=is_sure, sure_count=count), az_deg


def _judge_bit(watch: TurnWatch, status: AcuStatus, az_deg: float, limits: AxisLimits) -> TurnWatch:
    off_deg = az_deg - middle_deg(limits)
    half = int(off_deg >= 0.0)
    if watch.phase is not Phase.BELIEVED:
        return watch
    if abs(off_deg) < BIT_MARGIN_DEG or (watch.wrong_half is not None and watch.wrong_half != half):
        return watch
    is_wrong = status.is_sector_high != bool(half)
    score = min(max(watch.bit_score + (2 if is_wrong else -1), 0), BIT_SCORE)
    if score == watch.bit_score:
        return watch
    wrong_half = half if score == BIT_SCORE else watch.wrong_half
    return replace(watch, bit_score=score, wrong_half=None if score == 0 else wrong_half)


def other_turn(az_deg: float, limits: AxisLimits) -> float | None:
    """The other continuous angle with this bearing, the nearest; None: there is none."""
    others = [turn for turn in turns_of(az_deg % 360.0, limits) if abs(turn - az_deg) > 180.0]
    return min(others, key=lambda turn: abs(turn - az_deg), default=None)


def is_pulled_round(az_deg: float, rate_deg_s: float, command_deg: float, limits: AxisLimits) -> bool:
    """Whether an azimuth moves away from its command because it stands on the other turn, and its stop is in between.

    All continuous, on the turn believed.  An axis that is reversed or runs away moves against both turns' ways.
    """
    gap_deg, other_deg = command_deg - az_deg, other_turn(az_deg, limits)
    if other_deg is None or abs(gap_deg) < GOAL_DEG or abs(rate_deg_s) < PULL_DEG_S or gap_deg * rate_deg_s > 0.0:
        return False
    reached_deg = nearest_turn(command_deg, other_deg, limits)
    return reached_deg is not None and (reached_deg - other_deg) * rate_deg_s > 0.0


def watch_pull(
    watch: TurnWatch,
    tai_s: float,
    az_deg: float,
    rate_deg_s: float,
    limits: AxisLimits,
    *,
    scale: float,
    is_pulled: bool,
) -> tuple[TurnWatch, bool]:
    """Judge one more reading: whether the antenna is pulled the other way for good, further than it would brake.

    scale: its degrees on the sky.
    """
    if not is_pulled:
        return (watch if watch.pulled_since_tai_s == inf else replace(watch, pulled_since_tai_s=inf)), False
    if watch.pulled_since_tai_s == inf:
        braking_deg = rate_deg_s**2 * BRAKING_MARGIN / (2.0 * limits.max_acceleration_deg_s2)
        watch = replace(watch, pulled_since_tai_s=tai_s, pulled_from_deg=az_deg, braking_deg=braking_deg)
    is_far = abs(az_deg - watch.pulled_from_deg) > watch.braking_deg + NEARER_DEG + NOISE_DEG / scale
    return watch, is_far and tai_s - watch.pulled_since_tai_s >= PULL_S


def watch_goal(
    watch: TurnWatch,
    tai_s: float,
    az_deg: float,
    goal_deg: float | None,
    limits: AxisLimits,
    *,
    scale: float,
) -> tuple[TurnWatch, bool]:
    """Judge one more reading of an azimuth on its way.  Returns whether it stands, or moves away, short of its goal.

    goal_deg: where it shall go in the end, continuous; None: nowhere.  What stands, and what takes longer than the
    drive needs to a goal that stands still, is said in `problem`.  scale: degrees of azimuth on the sky.
    """
    gap_deg = inf if goal_deg is None else abs(goal_deg - az_deg)
    if goal_deg is None or gap_deg < GOAL_DEG:
        return (at_rest(watch) if watch.goal_deg is not None or watch.problem else watch), False
    side = 1 if goal_deg > az_deg else -1
    if watch.goal_deg is None or side != watch.side:
        watch = replace(at_rest(watch), side=side, mark_deg=az_deg, mark_tai_s=tai_s)
    if watch.goal_deg is None or abs(goal_deg - watch.goal_deg) > NEARER_DEG:
        watch = replace(watch, goal_deg=goal_deg, way_deg=gap_deg, begun_tai_s=tai_s)
    moved_deg = side * (az_deg - watch.mark_deg)
    if moved_deg > NEARER_DEG:
        watch = replace(watch, mark_deg=az_deg, mark_tai_s=tai_s)
    elif moved_deg < -GOAL_DEG - 2.0 * NOISE_DEG / scale:  # it brakes: from where it turns round it shall come on
        watch = replace(watch, mark_deg=az_deg)
    is_standing = tai_s - watch.mark_tai_s > PATIENCE_S + drive_s(STEP_DEG, limits)
    is_late = tai_s - watch.begun_tai_s > PATIENCE_S + drive_s(watch.way_deg, limits)
    if not (is_standing or is_late) or watch.problem:
        return watch, is_standing
    turn = "" if is_one_turn(limits) else f", {half_text(az_deg, limits)}"
    problem = f"azimuth late: at {az_deg:.1f} deg{turn}, its goal at {goal_deg:.1f} deg"
    return replace(watch, problem=problem), is_standing


def half_text(az_deg: float, limits: AxisLimits) -> str:
    """Which turn is believed, for people."""
    return f"on the {'high' if az_deg >= middle_deg(limits) else 'low'} half of the range as believed"


def drive_s(way_deg: float, limits: AxisLimits) -> float:
    """How long a drive takes for a way from rest to rest, at most."""
    rate_deg_s = RATE_SHARE * limits.max_rate_deg_s
    return way_deg / rate_deg_s + 2.0 * rate_deg_s / limits.max_acceleration_deg_s2


def at_rest(watch: TurnWatch) -> TurnWatch:
    """Forget the way to the goal: it begins anew."""
    return replace(watch, goal_deg=None, way_deg=0.0, begun_tai_s=inf, side=0, mark_tai_s=inf, problem="")
