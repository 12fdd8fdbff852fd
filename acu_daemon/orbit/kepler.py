"""Two-body motion: Kepler's equation, and elements to and from states, all vectorised.

Any inertial frame; angles in radians, lengths in metres.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from acu_daemon.units import MU_M3_S2, Array

_MAX_NEWTON_STEPS = 60
_CONVERGED_RAD = 1e-14


@dataclass(frozen=True, slots=True)
class OsculatingElements:
    """Elements of the two-body orbit that touches the state; every array is (N,), every angle in [0, 2 pi)."""

    a_m: Array
    e: Array
    i_rad: Array
    raan_rad: Array
    argp_rad: Array
    mean_anomaly_rad: Array


def solve_kepler(mean_anomaly_rad: Array, e: Array) -> Array:
    """Eccentric anomaly from mean anomaly, any shape; the result lies in the same turn as the mean anomaly.

    Newton's method from min(|M| + e, pi), which lies right of the root of a convex function: it never overshoots.

    Raises:  ValueError: an eccentricity outside [0, 1), or a value that is not finite.
    """
    if not (np.isfinite(mean_anomaly_rad).all() and np.all((e >= 0.0) & (e < 1.0))):
        raise ValueError("Kepler's equation needs finite anomalies and eccentricities in [0, 1)")
    m = np.remainder(mean_anomaly_rad + pi, 2.0 * pi) - pi
    target = np.abs(m)
    anomaly = np.minimum(target + e, pi)
    for _ in range(_MAX_NEWTON_STEPS):
        step = (anomaly - e * np.sin(anomaly) - target) / (1.0 - e * np.cos(anomaly))
        anomaly = anomaly - step
        if not (np.abs(step) >= _CONVERGED_RAD).any():
            break
    result: Array = mean_anomaly_rad + (np.copysign(anomaly, m) - m)
    return result


def state_from_elements(elements: OsculatingElements, mu_m3_s2: float = MU_M3_S2) -> tuple[Array, Array]:
    """Positions and velocities (N, 3) in the frame of the elements."""
    a, e = elements.a_m, elements.e
    anomaly = solve_kepler(elements.mean_anomaly_rad, e)
    eta = np.sqrt(1.0 - e * e)
    cos_e, sin_e = np.cos(anomaly), np.sin(anomaly)
    speed = np.sqrt(mu_m3_s2 / a) / (1.0 - e * cos_e)
    p_axis, q_axis = perifocal_axes(elements.i_rad, elements.raan_rad, elements.argp_rad)
    r_m = (a * (cos_e - e))[:, None] * p_axis + (a * eta * sin_e)[:, None] * q_axis
    v_m_s = (-speed * sin_e)[:, None] * p_axis + (speed * eta * cos_e)[:, None] * q_axis
    return r_m, v_m_s


def perifocal_axes(i_rad: Array, raan_rad: Array, angle_rad: Array) -> tuple[Array, Array]:
    """Unit vectors (N, 3) in the orbit's plane, `angle_rad` past the node and a right angle further on."""
    ci, si = np.cos(i_rad), np.sin(i_rad)
    co, so = np.cos(raan_rad), np.sin(raan_rad)
    cw, sw = np.cos(angle_rad), np.sin(angle_rad)
    p_axis, q_axis = np.empty((2, *cw.shape, 3))
    p_axis[..., 0], p_axis[..., 1], p_axis[..., 2] = cw * co - sw * ci * so, cw * so + sw * ci * co, sw * si
    q_axis[..., 0], q_axis[..., 1], q_axis[..., 2] = -sw * co - cw * ci * so, -sw * so + cw * ci * co, cw * si
    return p_axis, q_axis


def osculating_from_state(r_m: Array, v_m_s: Array, mu_m3_s2: float = MU_M3_S2) -> OsculatingElements:
    """Elements from positions and velocities (N, 3).

    A circular orbit has its perigee, an equatorial one its node where rounding puts them; the sums
    argp + mean anomaly and raan + argp stay well defined.

    Raises:  ValueError: a state that is not on an ellipse (too fast, straight up, or not finite).
    """
    r = np.linalg.norm(r_m, axis=1)
    momentum = np.cross(r_m, v_m_s)
    h = np.linalg.norm(momentum, axis=1)
    a = 1.0 / (2.0 / r - np.sum(v_m_s * v_m_s, axis=1) / mu_m3_s2)
    if not (np.isfinite(a).all() and np.all(a > 0.0) and np.all(h > 0.0)):
        raise ValueError("the state is not on an elliptic orbit")
    radial = np.sum(r_m * v_m_s, axis=1)
    e_sin, e_cos = radial / np.sqrt(mu_m3_s2 * a), 1.0 - r / a
    e = np.hypot(e_sin, e_cos)
    eta = np.sqrt(np.maximum(0.0, 1.0 - e * e))
    true_anomaly = np.arctan2(eta * e_sin, e_cos - e * e)
    raan = np.arctan2(momentum[:, 0], -momentum[:, 1])
    node = np.stack([np.cos(raan), np.sin(raan), np.zeros_like(raan)], axis=-1)
    across = np.cross(momentum / h[:, None], node)
    argument = np.arctan2(np.sum(r_m * across, axis=1), np.sum(r_m * node, axis=1))
    return OsculatingElements(
        a_m=a,
        e=e,
        i_rad=np.arctan2(np.hypot(momentum[:, 0], momentum[:, 1]), momentum[:, 2]),
        raan_rad=raan % (2.0 * pi),
        argp_rad=(argument - true_anomaly) % (2.0 * pi),
        mean_anomaly_rad=(np.arctan2(e_sin, e_cos) - e_sin) % (2.0 * pi),
    )
