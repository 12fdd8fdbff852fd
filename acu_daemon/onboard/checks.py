"""Whether a profile keeps what it promises, judged on its polynomials at 20 Hz."""

from dataclasses import dataclass

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.corrections import after_backlash
from acu_daemon.onboard.gimbal_frames import Gimbal
from acu_daemon.onboard.profile import Profile, Task, off_pointing
from acu_daemon.onboard.quintic import Path
from acu_daemon.units import Array

JOINT_DEG = 1e-6
_RANGE_DEG = 1e-6  # rounding of coefficients


@dataclass(frozen=True, slots=True)
class Backlash:
    """The play of the two gears, degrees from stop to stop."""

    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0


NO_BACKLASH = Backlash()


@dataclass(frozen=True, slots=True)
class Check:
    """One promise: what was measured, what is allowed."""

    name: str
    value: float
    limit: float
    unit: str
    is_met: bool
    detail: str = ""

    def __str__(self) -> str:
        mark = "ok  " if self.is_met else "FAIL"
        return f"{mark} {self.name}: {self.value:.4g} of {self.limit:.4g} {self.unit}{self.detail}"


def check_profile(task: Task, profile: Profile, backlash: Backlash = NO_BACKLASH) -> list[Check]:
    """Communication, ranges, rates, accelerations and joints, in this order."""
    commands = profile.gimbal(task.view.time_s)
    antenna = Gimbal(
        after_backlash(commands.az_deg, backlash.azimuth_deg), after_backlash(commands.el_deg, backlash.elevation_deg)
    )
    found = [check_communication(task, antenna)]
    for name, path, limits in (
        ("azimuth", profile.azimuth, task.azimuth),
        ("elevation", profile.elevation, task.elevation),
    ):
        found += check_axis(name, path, limits, task.view.time_s)
    return found


def check_communication(task: Task, antenna: Gimbal) -> Check:
    """The beam's largest angle from the station against the margin."""
    off = off_pointing(task, antenna, task.view)
    lost_s = float((off > task.margin_deg).sum()) * task.view.step_s
    worst_s = float(task.view.time_s[int(np.argmax(off))])
    lost = f", contact lost for {lost_s:.2f} s" if lost_s else ""
    return Check("off-pointing", float(off.max()), task.margin_deg, "deg", lost_s == 0.0, f" at {worst_s:.1f} s{lost}")


def check_axis(name: str, path: Path, limits: AxisLimits, time_s: Array) -> list[Check]:
    """Range, rate, acceleration and joints of one axis."""
    angle, rate, acceleration = (path.value(time_s, k) for k in range(3))
    low, high = float(angle.min()), float(angle.max())
    over, nearest, edge = max(
        (limits.min_deg - low, low, limits.min_deg), (high - limits.max_deg, high, limits.max_deg)
    )
    found = [Check(f"{name} range", nearest, edge, "deg", over <= _RANGE_DEG, f" ({low:.2f} to {high:.2f})")]
    for what, values, limit, unit in (
        ("rate", rate, limits.max_rate_deg_s, "deg/s"),
        ("acceleration", acceleration, limits.max_acceleration_deg_s2, "deg/s2"),
    ):
        most = float(np.abs(values).max())
        found.append(Check(f"{name} {what}", most, limit, unit, most <= limit))
    jump = float(np.abs(path.joints_deg()).max(initial=0.0))
    found.append(Check(f"{name} joints", jump, JOINT_DEG, "deg", jump <= JOINT_DEG))
    return found
