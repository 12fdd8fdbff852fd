"""The free path in the cone: azimuth first, which is all that the tube asks for, then elevation in what that leaves."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.bound import Bound, least_rate
from acu_daemon.onboard.cone import Tube, azimuth_tube, elevation_interval, windings
from acu_daemon.onboard.least_path import Band, Mask, least_path
from acu_daemon.onboard.pointed import fit
from acu_daemon.onboard.profile import Objective, Profile, Task, caps, off_pointing, peak_rate_deg_s
from acu_daemon.onboard.quintic import Knots, Path
from acu_daemon.onboard.view import PER_PLAN_STEP
from acu_daemon.units import Array

PIECES = ((20.0, 0.5), (20.0, 0.1), (10.0, 0.1), (5.0, 0.05))  # longest, s; and how near to the station it would stay
AZIMUTH_GUARD, ELEVATION_GUARD = 0.995, 0.997  # of the margin, in plans: between the samples the paths bulge
_GOOD_ENOUGH = 1.01  # times the bound: no finer pieces are tried
_TURNS = (0, 1, -1, 2, -2)


@dataclass(frozen=True, slots=True)
class Branch:
    """A tube within azimuth's range: one winding, on one turn of the cable."""

    tube: Tube
    guess_deg: Array
    bound: Bound


def free_profile(task: Task, objective: Objective = "peak", cap_deg_s: float | None = None) -> Profile | None:
    """The best path of all branches and lengths of pieces, or None where none keeps to margin, ranges and rates.

    objective: "peak", the least largest azimuth rate; "imaging", the least one while the camera works, with
    `cap_deg_s` (default: the drive's rate) for the rest of the pass.
    """
    branches = find_branches(task)
    goal = _goal(task, objective)
    best: tuple[float, Profile] | None = None
    station = task.station_gimbal(task.view)
    for longest_s, share in PIECES:
        knots = fit(task.view.time_s, station, longest_s, share * task.margin_deg)[0].knots
        for branch in branches:
            if best is not None and best[0] <= branch.bound.rate_deg_s:
                continue
            profile = _in_branch(task, branch, knots, goal, cap_deg_s)
            if profile is None:
                continue
            cost = _cost(task, profile, objective)
            if best is None or cost < best[0]:
                best = cost, profile
        if best is not None and (objective == "imaging" or best[0] <= _GOOD_ENOUGH * branches[0].bound.rate_deg_s):
            break
    return None if best is None else replace(best[1], bound=branches[0].bound)


def find_branches(task: Task) -> list[Branch]:
    """All windings, each on the best turn of the cable that azimuth's range allows, the least bound first."""
    view = task.view.plan
    station = task.station_gimbal(view)
    wide = windings(azimuth_tube(task.cone, view.time_s, station.az_deg, station.el_deg), station.az_deg)
    narrow_cone = replace(task.cone, margin_deg=AZIMUTH_GUARD * task.margin_deg)
    narrow = azimuth_tube(narrow_cone, view.time_s, station.az_deg, station.el_deg)
    guarded = windings(narrow, station.az_deg)
    if len(wide) != len(guarded):  # the axis grazes the cone: only the guarded one can be passed on either side
        wide = [azimuth_tube(task.cone, view.time_s, station.az_deg, station.el_deg)] if len(guarded) == 1 else guarded
    found = []
    for outer_tube, inner_tube in zip(wide, guarded, strict=True):
        turns = [
            Branch(inner, guess, least_rate(outer))
            for outer, inner, guess in _within_range(outer_tube, inner_tube, task.azimuth)
        ]
        if turns:
            found.append(min(turns, key=_rank))
    return sorted(found, key=_rank)


def _rank(branch: Branch) -> tuple[float, float]:
    """Slower first, then nearer to the middle of the cable."""
    return round(branch.bound.rate_deg_s, 9), abs(float(branch.guess_deg.min() + branch.guess_deg.max()))


def _within_range(outer: Tube, inner: Tube, limits: AxisLimits) -> Iterator[tuple[Tube, Tube, Array]]:
    middle = _bridged(inner)
    for turn in _TURNS:
        clipped = [
            Tube(
                tube.time_s,
                np.maximum(tube.lower_deg + 360.0 * turn, limits.min_deg),
                np.minimum(tube.upper_deg + 360.0 * turn, limits.max_deg),
            )
            for tube in (outer, inner)
        ]
        if all((tube.lower_deg <= tube.upper_deg).all() for tube in clipped):
            yield clipped[0], clipped[1], np.clip(middle + 360.0 * turn, limits.min_deg, limits.max_deg)


def _bridged(tube: Tube) -> Array:
    """The tube's middle, straight across spans without bounds."""
    is_bound = np.isfinite(tube.lower_deg)
    if not is_bound.any():
        return np.zeros(tube.time_s.size)
    middle = (tube.lower_deg[is_bound] + tube.upper_deg[is_bound]) / 2.0
    bridged: Array = np.interp(tube.time_s, tube.time_s[is_bound], middle)
    return bridged


def _goal(task: Task, objective: Objective) -> Mask:
    if objective == "imaging":
        return task.imaging[::PER_PLAN_STEP]
    return np.ones(task.view.plan.time_s.size, dtype=bool)


def _cost(task: Task, profile: Profile, objective: Objective) -> float:
    if objective == "peak" or not task.imaging.any():
        return peak_rate_deg_s(profile.azimuth, task.view)
    return float(np.abs(profile.azimuth.value(task.view.time_s[task.imaging], 1)).max())


def _in_branch(task: Task, branch: Branch, knots: Knots, goal: Mask, cap_deg_s: float | None) -> Profile | None:
    view = task.view.plan
    tube, limits = branch.tube, task.azimuth
    rate, acceleration = caps(limits)
    cap = rate if cap_deg_s is None else min(cap_deg_s, rate)
    band = Band(view.time_s, tube.lower_deg, tube.upper_deg, goal, cap, acceleration)
    azimuth = least_path(band, knots, branch.guess_deg)
    if azimuth is None:
        return None
    elevation = _elevation(task, azimuth, knots, goal)
    if elevation is None:
        return None
    profile = Profile("free", azimuth, elevation)
    is_within = off_pointing(task, profile.gimbal(task.view.time_s), task.view).max() <= task.margin_deg
    return profile if is_within and keeps_to_ranges(task, profile) else None


def _elevation(task: Task, azimuth: Path, knots: Knots, goal: Mask) -> Path | None:
    view, limits = task.view.plan, task.elevation
    cone = replace(task.cone, margin_deg=ELEVATION_GUARD * task.margin_deg)
    lower, upper = elevation_interval(cone, view.unit(task.station_itrs_m), azimuth.value(view.time_s))
    if (lower > upper).any():
        return None
    aim = goal if not goal.all() else np.zeros(goal.size, dtype=bool)
    band = Band(view.time_s, lower, upper, aim, *caps(limits))
    return least_path(band, knots, (lower + upper) / 2.0)


def keeps_to_ranges(task: Task, profile: Profile) -> bool:
    """Whether both angles stay within their ranges at 20 Hz."""
    gimbal = profile.gimbal(task.view.time_s)
    return all(
        bool(((angle >= limits.min_deg - 1e-6) & (angle <= limits.max_deg + 1e-6)).all())
        for angle, limits in ((gimbal.az_deg, task.azimuth), (gimbal.el_deg, task.elevation))
    )
