"""Profiles that point at one place on the ground, as polynomials: pieces are halved until they follow it."""

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.corrections import aimed, best_turn_deg
from acu_daemon.onboard.gimbal_frames import Gimbal
from acu_daemon.onboard.least_path import nearest_path
from acu_daemon.onboard.profile import Method, Profile, Task, caps
from acu_daemon.onboard.quintic import Indices, Knots, Path
from acu_daemon.onboard.view import PER_PLAN_STEP
from acu_daemon.units import DEG, Array

FIRST_PIECE_S, SHORTEST_PIECE_S = 20.0, 0.3
FOLLOWS_DEG = 0.005  # on the sky
_MILLISECONDS = 3  # decimals of a piece's start: a time that a file can give exactly
_FOLLOWS_SHARE = 0.01  # of the margin, where that is less
_RIPPLE_DEG = 2.0 * FOLLOWS_DEG  # of the polynomials, at the ends of elevation's range
_SPARSE_PIECE_S = 4.0  # longer pieces are fitted at a quarter of a second


def pointed_profile(task: Task, target_itrs_m: Array, method: Method) -> Profile:
    """Follow a point (3,) of the Earth with the beam.

    On the best turn of the cable; outside its range elevation waits at the end of it.  Where an axis would be too fast,
    the path nearest to it that keeps to rate and acceleration takes its place: what that costs is the check's to say.
    """
    time_s = task.view.time_s
    aim = aimed(task.view.vectors_m(target_itrs_m), task.cone)
    wanted = Gimbal(
        aim.az_deg + best_turn_deg(aim.az_deg, task.azimuth),
        np.clip(aim.el_deg, task.elevation.min_deg + _RIPPLE_DEG, task.elevation.max_deg - _RIPPLE_DEG),
    )
    azimuth, elevation = fit(time_s, wanted, follows_deg=min(FOLLOWS_DEG, _FOLLOWS_SHARE * task.margin_deg))
    return Profile(
        method,
        _slowed(azimuth, time_s, wanted.az_deg, task.azimuth),
        _slowed(elevation, time_s, wanted.el_deg, task.elevation),
    )


def _slowed(path: Path, time_s: Array, wanted_deg: Array, limits: AxisLimits) -> Path:
    rate, acceleration = (float(np.abs(path.value(time_s, k)).max()) for k in (1, 2))
    if rate <= limits.max_rate_deg_s and acceleration <= limits.max_acceleration_deg_s2:
        return path
    used = samples_for(time_s, path.knots)
    slow = nearest_path(time_s[used], wanted_deg[used], path.knots, *caps(limits))
    return path if slow is None else slow


def fit(
    time_s: Array, wanted: Gimbal, first_piece_s: float = FIRST_PIECE_S, follows_deg: float = FOLLOWS_DEG
) -> tuple[Path, Path]:
    """Polynomials through sampled angles (N,), on pieces of their own need, the same for both."""
    count = max(1, int(np.ceil(time_s[-1] / first_piece_s)))
    starts: Array = np.round(np.linspace(0.0, float(time_s[-1]), count + 1), _MILLISECONDS)
    knots = Knots(starts)
    across = np.sin(wanted.el_deg * DEG)
    while True:
        used = samples_for(time_s, knots)
        paths = [_nearest(time_s[used], angle[used], knots) for angle in (wanted.az_deg, wanted.el_deg)]
        az_error, el_error = (
            path.value(time_s) - angle for path, angle in zip(paths, (wanted.az_deg, wanted.el_deg), strict=True)
        )
        error = np.hypot(az_error * across, el_error)
        worst = np.maximum.reduceat(error, np.searchsorted(time_s, knots.time_s[:-1]))
        is_off = (worst > follows_deg) & (knots.length_s > 2.0 * SHORTEST_PIECE_S)
        if not is_off.any():
            return paths[0], paths[1]
        halves: Array = np.round((knots.time_s[:-1] + knots.length_s / 2.0)[is_off], _MILLISECONDS)
        knots = Knots(np.sort(np.concatenate([knots.time_s, halves])))


def _nearest(time_s: Array, angle_deg: Array, knots: Knots) -> Path:
    path = nearest_path(time_s, angle_deg, knots, np.inf, np.inf)
    if path is None:
        raise ValueError("least squares without bounds always have an answer")
    return path


def samples_for(time_s: Array, knots: Knots) -> Indices:
    """Indices of samples: all of short pieces, every fifth of long ones."""
    index = np.arange(time_s.size)
    is_short = knots.length_s[knots.piece_of(time_s)] < _SPARSE_PIECE_S
    used: Indices = index[is_short | (index % PER_PLAN_STEP == 0)]
    return used
