"""The free path in the cone: azimuth first, which is all that the tube asks for, then elevation in what that leaves."""

from dataclasses import replace

import numpy as np

from acu_daemon.onboard.branches import RANGE_GUARD_DEG, Branch, find_branches, least_bound
from acu_daemon.onboard.cone import elevation_interval
from acu_daemon.onboard.least_path import Band, Mask, least_path
from acu_daemon.onboard.pointed import fit, samples_for
from acu_daemon.onboard.profile import Objective, Profile, Task, caps, off_pointing, peak_rate_deg_s
from acu_daemon.onboard.quintic import Indices, Knots, Path

PIECES = (  # the longest, s; how near to the station polynomials on them could stay, as a share of the margin
    (20.0, 0.5),
    (20.0, 0.1),
    (10.0, 0.1),
    (5.0, 0.05),
)
ELEVATION_GUARD = 0.997  # of the margin, more than azimuth's: where that is at its edge, elevation keeps some room
SHARES = (1.0, 0.98, 0.95)  # of the margin, in turn: where the axis is near, paths bulge more than the guards foresee
_GOOD_ENOUGH = 1.007  # times the least rate of the guarded tube: no finer pieces are tried


def free_profile(task: Task, objective: Objective = "peak", cap_deg_s: float | None = None) -> Profile | None:
    """The best path of all branches and lengths of pieces, or None where none keeps to margin, ranges and rates.

    objective: "peak", the least largest azimuth rate; "imaging", the least one while the camera works, with
    `cap_deg_s` (default: the drive's rate) for the rest of the pass.
    """
    bound = least_bound(task)
    if bound is None or bound.rate_deg_s > task.azimuth.max_rate_deg_s:
        return None
    for share in SHARES:
        planned = replace(task, cone=replace(task.cone, margin_deg=share * task.margin_deg))
        if (found := _best(task, planned, objective, cap_deg_s)) is not None:
            return replace(found, bound=bound)
    return None


def _best(task: Task, planned: Task, objective: Objective, cap_deg_s: float | None) -> Profile | None:
    """The best path that was planned for one margin and keeps to the other, the task's."""
    branches = find_branches(planned)
    goal = task.imaging if objective == "imaging" else np.ones(task.view.time_s.size, dtype=bool)
    station = task.station_gimbal(task.view)
    best: tuple[float, Profile] | None = None
    for longest_s, share in PIECES if branches else ():
        knots = fit(task.view.time_s, station, longest_s, share * task.margin_deg)[0].knots
        for branch in branches:
            if best is not None and objective == "peak" and best[0] <= branch.rate_deg_s:
                continue
            profile = _in_branch(planned, branch, knots, goal, cap_deg_s)
            if profile is None or not _keeps(task, profile):
                continue
            cost = _cost(task, profile, objective)
            if best is None or cost < best[0]:
                best = cost, profile
        if best is not None and (objective == "imaging" or best[0] <= _GOOD_ENOUGH * branches[0].rate_deg_s):
            break
    return None if best is None else best[1]


def _cost(task: Task, profile: Profile, objective: Objective) -> float:
    if objective == "peak":
        return peak_rate_deg_s(profile.azimuth, task.view)
    return float(np.abs(profile.azimuth.value(task.view.time_s[task.imaging], 1)).max(initial=0.0))


def _in_branch(task: Task, branch: Branch, knots: Knots, goal: Mask, cap_deg_s: float | None) -> Profile | None:
    time_s, tube = task.view.time_s, branch.tube
    at = samples_for(time_s, knots)
    rate, acceleration = caps(task.azimuth)
    cap = rate if cap_deg_s is None else min(cap_deg_s, rate)
    band = Band(time_s[at], tube.lower_deg[at], tube.upper_deg[at], goal[at], cap, acceleration)
    azimuth = least_path(band, knots, branch.guess_deg[at])
    if azimuth is None:
        return None
    elevation = _elevation(task, azimuth, knots, goal, at)
    if elevation is None:
        return None
    return Profile("free", azimuth, elevation)


def _elevation(task: Task, azimuth: Path, knots: Knots, goal: Mask, at: Indices) -> Path | None:
    time_s = task.view.time_s[at]
    cone = replace(task.cone, margin_deg=ELEVATION_GUARD * task.margin_deg)
    lower, upper = elevation_interval(cone, task.view.unit(task.station_itrs_m)[at], azimuth.value(time_s))
    if (lower > upper).any():
        return None
    low, high = task.elevation.min_deg + RANGE_GUARD_DEG, task.elevation.max_deg - RANGE_GUARD_DEG
    lower, upper = np.maximum(lower, np.minimum(low, upper)), np.minimum(upper, np.maximum(high, lower))
    aim = np.zeros(at.size, dtype=bool) if goal.all() else goal[at]
    return least_path(Band(time_s, lower, upper, aim, *caps(task.elevation)), knots, (lower + upper) / 2.0)


def _keeps(task: Task, profile: Profile) -> bool:
    """Whether margin and ranges are kept at 20 Hz."""
    gimbal = profile.gimbal(task.view.time_s)
    return bool(off_pointing(task, gimbal, task.view).max() <= task.margin_deg) and all(
        bool(((angle >= limits.min_deg - 1e-6) & (angle <= limits.max_deg + 1e-6)).all())
        for angle, limits in ((gimbal.az_deg, task.azimuth), (gimbal.el_deg, task.elevation))
    )
