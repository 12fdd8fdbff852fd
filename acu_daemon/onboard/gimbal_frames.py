"""Frames from the Earth to the antenna's gimbal, every matrix passive: it turns the coordinates of a fixed vector.

LVLH:    z towards the Earth's centre (geocentric, not the local vertical), y against the orbit's momentum (right of the
         flight), x = y cross z, forward.  The momentum is the inertial one; that of Earth-fixed states is 3.7 deg off.
Body:    Rx(roll) Ry(pitch) Rz(yaw) LVLH.  Positive roll turns the body's +Z towards LVLH -y, positive pitch
         turns it forward.
Gimbal:  a mount matrix times body.  Azimuth about the gimbal's +Z from +X to +Y; elevation is the angle FROM +Z, so the
         axis, where azimuth does not exist, is at elevation 0.
Source:  Song et al. 2016, eq 1 and the text around it; docs/onboard.md has the drawings.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.units import DEG, Array

_AXES = {"X": 0, "Y": 1, "Z": 2}


@dataclass(frozen=True, slots=True)
class Gimbal:
    """Angles of the two axes, each (N,); azimuth is continuous where it came from a path, not wrapped."""

    az_deg: Array
    el_deg: Array


def lvlh_from_inertial(r_m: Array, v_m_s: Array) -> Array:
    """Rotations (N, 3, 3) from the frame of inertial states (N, 3) to LVLH."""
    z = -r_m / np.linalg.norm(r_m, axis=1)[:, None]
    momentum = np.cross(r_m, v_m_s)
    y = -momentum / np.linalg.norm(momentum, axis=1)[:, None]
    return np.stack([np.cross(y, z), y, z], axis=1)


def turn(axis: str, angle_deg: Array) -> Array:
    """Passive rotations (N, 3, 3) by angles (N,) about "X", "Y" or "Z"."""
    c, s = np.cos(angle_deg * DEG), np.sin(angle_deg * DEG)
    k = _AXES[axis]
    i, j = (k + 1) % 3, (k + 2) % 3
    matrix = np.zeros((angle_deg.size, 3, 3))
    matrix[:, k, k] = 1.0
    matrix[:, i, i] = matrix[:, j, j] = c
    matrix[:, i, j], matrix[:, j, i] = s, -s
    return matrix


def body_from_lvlh(roll_deg: Array, pitch_deg: Array, yaw_deg: Array) -> Array:
    """Rotations (N, 3, 3) from LVLH to the body: yaw first, then pitch, then roll."""
    turned: Array = turn("X", roll_deg) @ turn("Y", pitch_deg) @ turn("Z", yaw_deg)
    return turned


def mount_matrix(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Array:
    """Rotation (3, 3) from the body to the gimbal's base, in the same order as the attitude's angles."""
    matrix: Array = body_from_lvlh(*(np.array([angle]) for angle in (roll_deg, pitch_deg, yaw_deg)))[0]
    return matrix


def roll_pitch_to(direction_lvlh: Array) -> tuple[float, float]:
    """Roll and pitch, degrees, with yaw 0, that point the body's +Z along a vector (3,) of LVLH."""
    x, y, z = direction_lvlh / np.linalg.norm(direction_lvlh)
    return float(-np.arcsin(y) / DEG), float(np.arctan2(x, z) / DEG)


def gimbal_angles(p: Array) -> Gimbal:
    """Angles that point at vectors (N, 3) of the gimbal's frame; azimuth follows continuously from the first one's."""
    az_deg = np.unwrap(np.arctan2(p[:, 1], p[:, 0])) / DEG
    return Gimbal(az_deg, np.arctan2(np.hypot(p[:, 0], p[:, 1]), p[:, 2]) / DEG)


def beam_direction(gimbal: Gimbal, boresight: Array) -> Array:
    """Unit vectors (N, 3) of the beam in the gimbal's frame.

    boresight: (3,), the beam in the moving antenna's own frame; (0, 0, 1) where it is aligned.
    """
    ca, sa = np.cos(gimbal.az_deg * DEG), np.sin(gimbal.az_deg * DEG)
    ce, se = np.cos(gimbal.el_deg * DEG), np.sin(gimbal.el_deg * DEG)
    along = boresight[0] * ce + boresight[2] * se
    up = boresight[2] * ce - boresight[0] * se
    return np.stack([ca * along - sa * boresight[1], sa * along + ca * boresight[1], up], axis=1)


def boresight_vector(elevation_deg: float, cross_deg: float) -> Array:
    """The beam (3,) in the antenna's frame: elevation_deg away from the axis, cross_deg towards growing azimuth."""
    e, c = elevation_deg * DEG, cross_deg * DEG
    return np.array([np.sin(e) * np.cos(c), np.sin(c), np.cos(e) * np.cos(c)])


def angles_between_deg(a: Array, b: Array) -> Array:
    """Angles (N,) between unit vectors (N, 3), exact also where they are small."""
    half = np.linalg.norm(a - b, axis=1) / 2.0
    angle: Array = 2.0 * np.arcsin(np.minimum(1.0, half)) / DEG
    return angle
