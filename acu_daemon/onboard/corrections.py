"""From the direction of a target to what the gimbal is told: boresight, backlash, and the turn of the cable.

The mounting and the misalignment with the satellite's bus are in the rotation to the gimbal's frame (`view`).
"""

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.gimbal_frames import Gimbal, gimbal_angles
from acu_daemon.onboard.quintic import Path
from acu_daemon.units import DEG, Array

_REVERSAL_DEG_S = 0.02  # below this rate the backlash is taken up gradually: a step is no path for a motor
_TURNS = (0, 1, -1, 2, -2)


def aimed(p: Array, cone: Cone) -> Gimbal:
    """Angles that put the beam, boresight's offsets included, on directions (N, 3) of the gimbal's frame.

    Nearer to the axis than the offset across, no angles do; there the beam comes as near as it can.
    """
    straight = gimbal_angles(p)
    unit = p / np.linalg.norm(p, axis=1)[:, None]
    sin_el = np.maximum(np.hypot(unit[:, 0], unit[:, 1]), 1e-12)
    lead_deg = np.arcsin(np.clip(np.sin(cone.boresight_cross_deg * DEG) / sin_el, -1.0, 1.0)) / DEG
    az_deg = straight.az_deg - lead_deg
    return Gimbal(az_deg, straight.el_deg - _elevation_offset_deg(cone, unit, az_deg, straight.el_deg))


def _elevation_offset_deg(cone: Cone, unit: Array, az_deg: Array, el0_deg: Array) -> Array:
    """How far elevation stays behind the direction's angle from the axis."""
    c, s = np.cos(az_deg * DEG), np.sin(az_deg * DEG)
    x, z, b = c * unit[:, 0] + s * unit[:, 1], unit[:, 2], cone.boresight
    offset: Array = el0_deg - np.arctan2(x * b[2] - z * b[0], x * b[0] + z * b[2]) / DEG
    return offset


def with_backlash(path: Path, time_s: Array, backlash_deg: float) -> Array:
    """Commands (N,) that lead by half the backlash in the direction of the motion."""
    rate = path.value(time_s, 1)
    led: Array = path.value(time_s) + backlash_deg / 2.0 * rate / np.hypot(rate, _REVERSAL_DEG_S)
    return led


def after_backlash(command_deg: Array, backlash_deg: float) -> Array:
    """Where the antenna is (N,) while the motor follows commands (N,): half the backlash behind, or at rest."""
    if backlash_deg == 0.0:
        return command_deg
    half = backlash_deg / 2.0
    at = float(command_deg[0]) - half * float(np.sign(command_deg[1] - command_deg[0]))
    out = []
    for command in command_deg.tolist():
        at = min(max(at, command - half), command + half)
        out.append(at)
    return np.array(out)


def best_turn_deg(az_deg: Array, limits: AxisLimits) -> float:
    """The multiple of 360 deg that brings azimuth (N,) into its range, or nearest to it; the most central of those."""
    low, high = float(az_deg.min()), float(az_deg.max())

    def rank(turn: int) -> tuple[float, float]:
        over = max(0.0, limits.min_deg - low - 360.0 * turn) + max(0.0, high + 360.0 * turn - limits.max_deg)
        return over, abs(low + high + 720.0 * turn - limits.min_deg - limits.max_deg)

    return 360.0 * min(_TURNS, key=rank)
