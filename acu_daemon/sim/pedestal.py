"""SIMULATION of the pedestal: an axis with velocity and acceleration limits, driven at 50 Hz (docs/protocol.md, Servo).

Angles are those of the encoder, continuous through north.  Between two steps an axis moves at a constant rate.
"""

from dataclasses import dataclass, field
from math import copysign, exp, inf, sqrt
from random import Random

from acu_daemon.model import AxisLimits

STEP_S = 0.02
POSITION_GAIN_PER_S = 40.0  # following error 1/40 s x rate where no acceleration limit interferes
BRAKING_SHARE = 0.85  # of the acceleration limit: a 50 Hz servo sees the end of its way a step late
STANDING_DEG_S = 1e-3
END_BAND_DEG = 0.005  # this near to a soft limit counts as at it


def approach_rate_deg_s(gap_deg: float, gain_per_s: float, acceleration_deg_s2: float) -> float:
    """Fastest rate at which a gap can be closed without overshoot: linear near the end, square root far from it."""
    gap = abs(gap_deg)
    linear_deg = acceleration_deg_s2 / gain_per_s**2
    if gap <= linear_deg:
        return gain_per_s * gap_deg
    return copysign(sqrt(2.0 * acceleration_deg_s2 * (gap - linear_deg / 2.0)), gap_deg)


GUST_TIME_S = 1.0  # correlation time of the wind's gusts
_GUST_KEEP = exp(-STEP_S / GUST_TIME_S)
_GUST_RENEW = sqrt(1.0 - _GUST_KEEP**2)


@dataclass(slots=True)
class AxisTrouble:
    """What is wrong with an axis."""

    is_stuck: bool = False
    is_reversed: bool = False
    runaway_deg_s: float | None = None  # while it is driven, whatever the servo asks for
    rate_share: float = 1.0  # of the fastest rate
    upper_stop_deg: float = inf  # a limit switch that tripped here
    lower_stop_deg: float = -inf
    gust_deg_s: float = 0.0  # 1 sigma
    random: Random = field(default_factory=Random, compare=False)


class Axis:
    """One axis.  Each 50 Hz step: move(), then one of drive_to(), drive_at() and halt()."""

    def __init__(self, limits: AxisLimits, angle_deg: float) -> None:
        self.limits = limits
        self.angle_deg = min(max(angle_deg, limits.min_deg), limits.max_deg)
        self.rate_deg_s = 0.0
        self.is_clamped = False
        self.trouble: AxisTrouble | None = None
        self._moves_at_deg_s = 0.0
        self._gust_deg_s = 0.0
        self._is_driven = False
        self._step_deg_s = limits.max_acceleration_deg_s2 * STEP_S
        self._braking_deg_s2 = BRAKING_SHARE * limits.max_acceleration_deg_s2

    def angle_after_deg(self, after_s: float) -> float:
        """Angle a part of a step after the last one."""
        rate_deg_s = self.rate_deg_s if self.trouble is None else self._moves_at_deg_s
        return self.angle_deg + rate_deg_s * after_s

    @property
    def is_moving(self) -> bool:
        return abs(self.rate_deg_s) > STANDING_DEG_S

    @property
    def is_at_max(self) -> bool:
        return self.angle_deg >= self._ends_deg()[1] - END_BAND_DEG

    @property
    def is_at_min(self) -> bool:
        return self.angle_deg <= self._ends_deg()[0] + END_BAND_DEG

    def _ends_deg(self) -> tuple[float, float]:
        limits, trouble = self.limits, self.trouble
        if trouble is None:
            return limits.min_deg, limits.max_deg
        return max(limits.min_deg, trouble.lower_stop_deg), min(limits.max_deg, trouble.upper_stop_deg)

    def move(self) -> None:
        """Move for one step; the mechanical end is the soft limit."""
        rate_deg_s = self.rate_deg_s if self.trouble is None else self._troubled_rate_deg_s(self.trouble)
        angle_deg = self.angle_deg + rate_deg_s * STEP_S
        least_deg, most_deg = self._ends_deg()
        if angle_deg > most_deg:
            angle_deg, self.rate_deg_s = most_deg, 0.0
        elif angle_deg < least_deg:
            angle_deg, self.rate_deg_s = least_deg, 0.0
        self.angle_deg = angle_deg

    def _troubled_rate_deg_s(self, trouble: AxisTrouble) -> float:
        """How fast the axis really moves during the coming step."""
        if trouble.is_stuck:
            self.rate_deg_s = 0.0
        elif trouble.runaway_deg_s is not None and self._is_driven:
            self.rate_deg_s = trouble.runaway_deg_s
        rate_deg_s = -self.rate_deg_s if trouble.is_reversed else self.rate_deg_s
        if trouble.gust_deg_s and not trouble.is_stuck:
            push_deg_s = trouble.random.gauss(0.0, trouble.gust_deg_s)
            self._gust_deg_s = _GUST_KEEP * self._gust_deg_s + _GUST_RENEW * push_deg_s
            rate_deg_s += self._gust_deg_s
        self._moves_at_deg_s = rate_deg_s
        return rate_deg_s

    def drive_to(self, target_deg: float, target_rate_deg_s: float) -> None:
        """Close in on a target inside the limits that moves at a known rate."""
        gap_deg = target_deg - self.angle_after_deg(STEP_S / 2.0)  # a step acts from its middle on
        self.is_clamped = False
        closing_deg_s = approach_rate_deg_s(gap_deg, POSITION_GAIN_PER_S, self._braking_deg_s2)
        self._change_rate(target_rate_deg_s + closing_deg_s)

    def drive_at(self, rate_deg_s: float) -> None:
        """Drive at a rate, braking before a soft limit."""
        limits, braking = self.limits, self._braking_deg_s2
        if rate_deg_s > 0:
            end_deg_s = approach_rate_deg_s(limits.max_deg - self.angle_deg, POSITION_GAIN_PER_S, braking)
            self.is_clamped = rate_deg_s > end_deg_s
        else:
            end_deg_s = approach_rate_deg_s(limits.min_deg - self.angle_deg, POSITION_GAIN_PER_S, braking)
            self.is_clamped = rate_deg_s < end_deg_s
        self._change_rate(end_deg_s if self.is_clamped else rate_deg_s)

    def halt(self) -> None:
        """Brake to a stand."""
        self.is_clamped = False
        self._change_rate(0.0)
        self._is_driven = False

    def _change_rate(self, wanted_deg_s: float) -> None:
        most_deg_s, step_deg_s, rate_deg_s = self.limits.max_rate_deg_s, self._step_deg_s, self.rate_deg_s
        self._is_driven = True
        if self.trouble is not None:
            most_deg_s *= self.trouble.rate_share
        if wanted_deg_s > most_deg_s:
            wanted_deg_s = most_deg_s
        elif wanted_deg_s < -most_deg_s:
            wanted_deg_s = -most_deg_s
        if wanted_deg_s > rate_deg_s + step_deg_s:
            wanted_deg_s = rate_deg_s + step_deg_s
        elif wanted_deg_s < rate_deg_s - step_deg_s:
            wanted_deg_s = rate_deg_s - step_deg_s
        self.rate_deg_s = wanted_deg_s


class Follower:
    """The handed-over targets of one axis: the last one, which stands still, and how fast one replaces the other."""

    STALE_S = 0.16  # no new target for this long: the path has ended

    def __init__(self, limits: AxisLimits) -> None:
        self._limits = limits
        self._age_s = 0.0
        self.target_deg = 0.0
        self.rate_deg_s = 0.0

    def start(self, target_deg: float) -> None:
        """Begin with a target at rest."""
        self.target_deg, self.rate_deg_s, self._age_s = target_deg, 0.0, 0.0

    def aim(self, target_deg: float) -> None:
        """Take the next target, in place of wait()."""
        self._age_s += STEP_S
        moved_deg_s = (target_deg - self.target_deg) / self._age_s
        is_path = self._age_s <= self.STALE_S and abs(moved_deg_s) <= self._limits.max_rate_deg_s
        most_deg_s = self._limits.max_acceleration_deg_s2 * self._age_s
        change_deg_s = (moved_deg_s if is_path else 0.0) - self.rate_deg_s
        self.rate_deg_s += min(max(change_deg_s, -most_deg_s), most_deg_s)
        self.target_deg, self._age_s = target_deg, 0.0

    def wait(self) -> None:
        """One step has passed without a new target."""
        self._age_s += STEP_S
        if self._age_s > self.STALE_S:
            self.rate_deg_s = 0.0
