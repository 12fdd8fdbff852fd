"""Figure 1 of Song et al. 2016, every stage: preliminary to modified profile, check, polynomials, second check.

For the free path target choice, corrections for the boresight, limits and smoothing are one optimisation; for the three
ways with a target on the ground they are steps.  In all, mounting is in the frame that is planned in.
"""

from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.errors import ProfileError
from acu_daemon.model import AxisLimits, Station
from acu_daemon.onboard.branches import find_branches, least_bound
from acu_daemon.onboard.checks import NO_BACKLASH, Backlash, Check, check_profile
from acu_daemon.onboard.corrections import with_backlash
from acu_daemon.onboard.free import free_profile
from acu_daemon.onboard.gimbal_frames import Gimbal
from acu_daemon.onboard.methods import make_profile
from acu_daemon.onboard.pointed import FOLLOWS_DEG, fit
from acu_daemon.onboard.profile import Method, Objective, Profile, Task
from acu_daemon.onboard.relief import bound_at, least_interruption, least_margin_deg
from acu_daemon.orbit.timescales import utc_text

_TIGHT = 0.99  # of the rate limit: polynomials are that much above the bound


@dataclass(frozen=True)
class Made:
    """A profile with both checks: of the profile before backlash is led, and of the polynomials to be uploaded."""

    profile: Profile
    first: list[Check]
    second: list[Check]

    @property
    def is_met(self) -> bool:
        return all(one.is_met for one in self.second)


def make(
    task: Task, station: Station, method: Method, objective: Objective = "peak", backlash: Backlash = NO_BACKLASH
) -> Made:
    """Run all stages.

    Raises:  ProfileError: no path keeps to margin, ranges and limits; says what would.
    """
    refuse_out_of_reach(task)
    if objective == "imaging" and not task.imaging.any():
        raise ProfileError(
            "the camera never works in this pass: name a strip, a target or a span of imaging, or use peak"
        )
    play_deg = backlash.azimuth_deg + backlash.elevation_deg
    spare_deg = play_deg / 2.0 + FOLLOWS_DEG * (play_deg > 0.0)
    if spare_deg >= task.margin_deg:
        raise ProfileError(f"the margin of {task.margin_deg:g} deg is less than the backlash takes: widen margin_deg")
    planned = replace(task, cone=replace(task.cone, margin_deg=task.margin_deg - spare_deg))
    profile = make_profile(planned, station, method, objective)
    if profile is None:
        raise ProfileError(why_not(planned, spare_deg))
    if profile.bound is not None:
        profile = replace(profile, bound=least_bound(task))  # of the whole margin, the backlash's share too
    first = check_profile(task, profile)
    if play_deg > 0.0:
        profile = _led(task, profile, backlash)
    return Made(profile, first, check_profile(task, profile, backlash))


def _led(task: Task, profile: Profile, backlash: Backlash) -> Profile:
    time_s = task.view.time_s
    wanted = Gimbal(
        with_backlash(profile.azimuth, time_s, backlash.azimuth_deg),
        np.clip(
            with_backlash(profile.elevation, time_s, backlash.elevation_deg),
            task.elevation.min_deg,
            task.elevation.max_deg,
        ),
    )
    azimuth, elevation = fit(time_s, wanted)
    return replace(profile, azimuth=azimuth, elevation=elevation)


def refuse_out_of_reach(task: Task) -> None:
    """ProfileError: the station is beyond elevation's range by more than the margin for a part of the pass."""
    el_deg = task.station_gimbal(task.view).el_deg - task.cone.boresight_elevation_deg  # the motor's
    low_deg, high_deg = task.elevation.min_deg, task.elevation.max_deg
    for is_out, word, nearest_deg in (
        (el_deg > high_deg + task.margin_deg, "up to", el_deg.max()),
        (el_deg < low_deg - task.margin_deg, "only", el_deg.min()),
    ):
        if is_out.any():
            times = task.view.tai_s[is_out]
            raise ProfileError(
                f"the station is {word} {nearest_deg:.1f} deg from the gimbal's axis, beyond the elevation range from "
                f"{low_deg:g} to {high_deg:g} deg and the margin, from {utc_text(float(times[0]))} to "
                f"{utc_text(float(times[-1]))}: turn the satellite otherwise then, raise min_elevation_deg, or change "
                "the mount"
            )


def why_not(task: Task, spare_deg: float = 0.0) -> str:
    """Why no free path was found, in one line, and what would help; spare_deg: of the margin, beyond the task's."""
    limits = task.azimuth
    if not find_branches(task):
        span = np.ptp(task.station_gimbal(task.view).az_deg)
        return (
            f"azimuth turns by {span:.0f} deg over the pass, which no turn of the cable has within "
            f"{limits.min_deg:g} to {limits.max_deg:g} deg: widen the range or the margin, or shorten the pass"
        )
    if bound_at(task, task.margin_deg) > _TIGHT * limits.max_rate_deg_s:
        return _what_the_rate_needs(task, spare_deg)
    if free_profile(replace(task, azimuth=_unlimited(task.azimuth), elevation=_unlimited(task.elevation))) is not None:
        return (
            "accelerations or elevation's rate are too tight for the pass: raise max_acceleration_deg_s2 or the margin"
        )
    return "no polynomials keep to the margin: widen margin_deg, or turn the satellite more slowly"


def _what_the_rate_needs(task: Task, spare_deg: float) -> str:
    rate = task.azimuth.max_rate_deg_s
    margin_deg, gap = least_margin_deg(task, rate), least_interruption(task, rate)
    ways = []
    if margin_deg is not None:
        ways.append(f"a margin of {np.ceil(100.0 * (margin_deg + spare_deg)) / 100.0:.2f} deg")
    if gap is not None:
        start = utc_text(float(task.view.tai_s[0]) + gap.start_s, 0)
        ways.append(f"{np.ceil(gap.length_s):.0f} s of interruption from {start} on")
    least = bound_at(task, task.margin_deg)
    return (
        f"limit {rate:g} deg/s needs {', or '.join(ways) or 'another attitude'}; "
        f"with the margin of {task.margin_deg + spare_deg:g} deg the least rate is {least:.3g} deg/s"
    )


def _unlimited(limits: AxisLimits) -> AxisLimits:
    return replace(limits, max_rate_deg_s=np.inf, max_acceleration_deg_s2=np.inf)
