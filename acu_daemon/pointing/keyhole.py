"""The way through the keyhole: an azimuth path the drive can follow where the true one is too fast.  Pure.

Near the zenith the drive starts to turn before culmination and ends after it, at nearly its full rate; the elevation
stays true.  So the beam leaves the satellite a little, before and after culmination, in place of far and for long.
"""

from math import sqrt

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.units import Array

MARGIN = 0.95  # of the drive's rate and acceleration, so that it can still correct an error while it turns


def longest_window_s(azimuth: AxisLimits) -> float:
    """Bound the seconds a half turn takes: a path that starts this much before now has its whole window in sight."""
    rate, acceleration = MARGIN * azimuth.max_rate_deg_s, MARGIN * azimuth.max_acceleration_deg_s2
    return 180.0 / rate + 2.0 * rate / acceleration


def follow_path(az_deg: Array, az_rate_deg_s: Array, step_s: float, azimuth: AxisLimits) -> tuple[Array, Array]:
    """Give azimuths and rates, both (N,), that the drive can follow.

    az_deg (N,) continuous, az_rate_deg_s (N,), at even steps.  The result is the path itself where its rate and
    acceleration lie within the drive's; else a window around the fastest instant, as short as the drive allows and
    centred in time on it, holds a profile that joins position and rate at both ends: accelerate, cruise, decelerate,
    at MARGIN of the limits.  A window is cut by the path's ends; if the drive is too slow even then, it chases the
    path from the start.
    """
    acceleration = np.abs(np.diff(az_rate_deg_s)) / step_s
    is_beyond = np.abs(az_rate_deg_s) > azimuth.max_rate_deg_s
    is_beyond[:-1] |= acceleration > azimuth.max_acceleration_deg_s2
    beyond = np.flatnonzero(is_beyond)
    if beyond.size == 0:
        return az_deg, az_rate_deg_s
    fastest = int(np.argmax(np.abs(az_rate_deg_s)))
    last = az_deg.size - 1
    half_smallest = max(fastest - int(beyond[0]), int(beyond[-1]) + 1 - fastest)
    for half in range(max(half_smallest, 1), az_deg.size):
        i, j = max(fastest - half, 0), min(fastest + half, last)
        cruise = _cruise_rate(az_deg, az_rate_deg_s, i, j, step_s, azimuth)
        if cruise is not None:
            return _with_profile(az_deg, az_rate_deg_s, i, j, step_s, cruise, azimuth)
    return _chase(az_deg, az_rate_deg_s, step_s, azimuth)


def _cruise_rate(az: Array, rate: Array, i: int, j: int, step_s: float, azimuth: AxisLimits) -> float | None:
    """Find the cruise rate that joins samples i and j in their time; None if it is beyond the drive.

    Distance covered = c T - ((c - r0)^2 + (c - r1)^2) / (2 A), with cruise rate c, end rates r0 and r1, time T.
    """
    sign = 1.0 if az[j] >= az[i] else -1.0
    distance, span_s = sign * float(az[j] - az[i]), step_s * (j - i)
    r0, r1 = sign * float(rate[i]), sign * float(rate[j])
    most, a = MARGIN * azimuth.max_rate_deg_s, MARGIN * azimuth.max_acceleration_deg_s2
    b = r0 + r1 + a * span_s
    inside = b * b - 2.0 * (r0 * r0 + r1 * r1) - 4.0 * a * distance
    if inside < 0.0:
        return None
    cruise = (b - sqrt(inside)) / 2.0
    if cruise > most or cruise < max(r0, r1):
        return None
    return sign * cruise


def _with_profile(
    az: Array, rate: Array, i: int, j: int, step_s: float, cruise: float, azimuth: AxisLimits
) -> tuple[Array, Array]:
    """Put accelerate, cruise, decelerate between samples i and j."""
    a = MARGIN * azimuth.max_acceleration_deg_s2
    t = step_s * np.arange(j - i + 1)
    r0, r1 = float(rate[i]), float(rate[j])
    up_s, down_s = abs(cruise - r0) / a, abs(cruise - r1) / a
    left_s = t[-1] - t
    lag_up = (cruise - r0) / 2.0 * np.maximum(up_s - t, 0.0) ** 2 / max(up_s, 1e-9)
    lag_down = (cruise - r1) / 2.0 * np.maximum(down_s - left_s, 0.0) ** 2 / max(down_s, 1e-9)
    line = float(az[i]) - (cruise - r0) / 2.0 * up_s + cruise * t
    new_az, new_rate = az.copy(), rate.copy()
    new_az[i : j + 1] = line + lag_up - lag_down
    new_rate[i : j + 1] = np.where(
        t < up_s,
        r0 + np.sign(cruise - r0) * a * t,
        np.where(left_s < down_s, r1 + np.sign(cruise - r1) * a * left_s, cruise),
    )
    return new_az, new_rate


def _chase(az: Array, rate: Array, step_s: float, azimuth: AxisLimits) -> tuple[Array, Array]:
    most = azimuth.max_rate_deg_s
    state = AxisState(float(az[0]), min(max(float(rate[0]), -most), most))
    states = [state]
    for target, target_rate in zip(az[1:].tolist(), rate[1:].tolist(), strict=True):
        state = step(state, target, target_rate, step_s, azimuth)
        states.append(state)
    return np.array([s.position_deg for s in states]), np.array([s.rate_deg_s for s in states])
