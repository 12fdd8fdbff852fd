"""The satellite's attitude as a plan: holds of roll, pitch and yaw, and quintic slews between them.

A slew starts and ends at rest in rate and acceleration: s(u) = 10 u^3 - 15 u^4 + 6 u^5, whose rate is at most 1.875 and
whose acceleration 10 / sqrt(3) of the mean ones.  All three angles share the slew's time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Protocol

import numpy as np

from acu_daemon.errors import AttitudeError
from acu_daemon.onboard.gimbal_frames import body_from_lvlh
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

PEAK_RATE = 1.875
PEAK_ACCELERATION = 10.0 / sqrt(3.0)


class Attitude(Protocol):
    """Where the body points."""

    def body_from_lvlh(self, tai_s: Array, lvlh_from_teme: Array) -> Array:
        """Rotations (N, 3, 3) from LVLH to the body at the times (N,).

        lvlh_from_teme: (N, 3, 3) at the same times, for attitudes that are given in an inertial frame.
        Raises:  AttitudeError: a time that the attitude does not cover.
        """


@dataclass(frozen=True, slots=True)
class Agility:
    """What the body can do."""

    rate_deg_s: float = 1.0
    acceleration_deg_s2: float = 0.05
    settle_s: float = 5.0
    max_angle_deg: float = 30.0  # of roll and of pitch

    def slew_s(self, turn_deg: float) -> float:
        """The time of a slew whose largest angle is turn_deg."""
        turn = abs(turn_deg)
        return max(PEAK_RATE * turn / self.rate_deg_s, sqrt(PEAK_ACCELERATION * turn / self.acceleration_deg_s2))


@dataclass(frozen=True, slots=True)
class Hold:
    """Angles kept from start to end, degrees and TAI seconds."""

    start_tai_s: float
    end_tai_s: float
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    is_imaging: bool = False

    @property
    def angles_deg(self) -> tuple[float, float, float]:
        return self.roll_deg, self.pitch_deg, self.yaw_deg


@dataclass(frozen=True, slots=True)
class AttitudePlan:
    """Holds in order, slews between; before the first and after the last one these go on."""

    holds: tuple[Hold, ...]
    imaging_tai_s: tuple[tuple[float, float], ...] = ()  # when the camera works

    def angles_deg(self, tai_s: Array) -> Array:
        """Roll, pitch and yaw (N, 3)."""
        angles = np.broadcast_to(np.array(self.holds[0].angles_deg), (tai_s.size, 3)).copy()
        for one, following in zip(self.holds, self.holds[1:], strict=False):
            if following.angles_deg == one.angles_deg:
                continue
            u = np.clip((tai_s - one.end_tai_s) / (following.start_tai_s - one.end_tai_s), 0.0, 1.0)
            share = u**3 * (10.0 + u * (6.0 * u - 15.0))
            angles += share[:, None] * (np.array(following.angles_deg) - np.array(one.angles_deg))
        return angles

    def body_from_lvlh(self, tai_s: Array, lvlh_from_teme: Array) -> Array:
        """Rotations (N, 3, 3) from LVLH to the body; any time has an answer."""
        return body_from_lvlh(*self.angles_deg(tai_s).T)


def plan_attitude(holds: Sequence[Hold], agility: Agility) -> AttitudePlan:
    """Make a plan of holds in order of time; the time between two must suffice for the slew and settling.

    Raises:  AttitudeError: the holds overlap, are too near each other, or too far off nadir; says by how much.
    """
    for hold in holds:
        if hold.end_tai_s < hold.start_tai_s:
            raise AttitudeError(f"attitude: the hold of {utc_text(hold.start_tai_s)} ends before it starts")
        for name, angle_deg in (("roll", hold.roll_deg), ("pitch", hold.pitch_deg)):
            if abs(angle_deg) > agility.max_angle_deg:
                raise AttitudeError(
                    f"attitude: the hold of {utc_text(hold.start_tai_s)} needs {angle_deg:.1f} deg of {name}; the body "
                    f"turns {agility.max_angle_deg:g} deg at the most: choose another time or target"
                )
    for one, following in zip(holds, holds[1:], strict=False):
        turn_deg = max(abs(a - b) for a, b in zip(one.angles_deg, following.angles_deg, strict=True))
        needed_s = agility.slew_s(turn_deg) + agility.settle_s * (turn_deg > 0.0)
        there_s = following.start_tai_s - one.end_tai_s
        if there_s < max(needed_s, 0.0):
            raise AttitudeError(
                f"attitude: from {utc_text(one.end_tai_s)} to {utc_text(following.start_tai_s)} are {there_s:.1f} s; "
                f"the slew of {turn_deg:.1f} deg takes {needed_s:.1f} s with settling: move the holds apart"
            )
    settled = [
        Hold(hold.start_tai_s - agility.settle_s * bool(i), hold.end_tai_s, *hold.angles_deg)
        for i, hold in enumerate(holds)
    ]
    imaging = tuple((hold.start_tai_s, hold.end_tai_s) for hold in holds if hold.is_imaging)
    return AttitudePlan(tuple(settled), imaging)
