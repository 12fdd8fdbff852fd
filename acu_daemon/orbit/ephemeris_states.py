"""The states of an ephemeris message turned into TEME, and whether they can be an orbit around the Earth."""

import numpy as np

from acu_daemon.errors import ElementsError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.celestial import teme_from_eme2000, teme_from_gcrf, teme_from_tod
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
from acu_daemon.orbit.frames import teme_from_itrs_states
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

_ROTATIONS = {"EME2000": teme_from_eme2000, "GCRF": teme_from_gcrf, "TOD": teme_from_tod}
_FARTHEST_RAD = 1.0  # about 10 minutes on a low orbit


def states_teme(segment: EphemerisSegment, orientation: EarthOrientation) -> tuple[Array, Array]:
    """Positions and velocities (N, 3), TEME; orientation: for Earth-fixed segments."""
    if segment.frame == "TEME":
        return segment.r_m, segment.v_m_s
    if segment.frame == "ITRF":
        return teme_from_itrs_states(segment.r_m, segment.v_m_s, segment.tai_s, orientation)
    rotation = _ROTATIONS[segment.frame](segment.tai_s)
    return (rotation @ segment.r_m[..., None])[..., 0], (rotation @ segment.v_m_s[..., None])[..., 0]


def mean_motions_rad_s(segment: EphemerisSegment, r_m: Array, v_m_s: Array) -> Array:
    """Osculating mean motions (N,) of the segment's states, turned into TEME.

    Raises:  ElementsError: a state that is not on an orbit around the Earth.
    """
    r = np.linalg.norm(r_m, axis=1)
    inverse_a = 2.0 / r - np.sum(v_m_s**2, axis=1) / MU_M3_S2
    bad = np.flatnonzero((r < EARTH_EQUATORIAL_RADIUS_M) | ~(inverse_a > 0.0))
    if bad.size:
        speed_km_s = np.linalg.norm(v_m_s[bad[0]]) / 1e3
        raise ElementsError(
            f"{_at(segment, bad[0])} the state is not on an orbit around the Earth: {r[bad[0]] / 1e3:.0f} km from its "
            f"centre at {speed_km_s:.3f} km/s; are units (km, km/s) and REF_FRAME ({segment.frame}) right?"
        )
    mean_motions: Array = np.sqrt(MU_M3_S2 * inverse_a**3)
    return mean_motions


def check_neighbours(segment: EphemerisSegment, r_m: Array, v_m_s: Array) -> None:
    """Compare each step with what its velocities and the Earth's pull make of it, by trapezoids.

    Positions, with the end correction: every step, loosely enough for a manoeuvre.  Velocities: the median, since a
    wrong frame is wrong everywhere.  The shares allow for what the rules leave out, the rest for the flattening.
    Raises:  ElementsError: they differ, or the states are too far apart to be interpolated.
    """
    step_s = np.diff(segment.tai_s)
    least_m = np.minimum(*(np.linalg.norm(one, axis=1) for one in (r_m[:-1], r_m[1:])))
    angle_rad = step_s * np.sqrt(2.0 * MU_M3_S2 / least_m**3)
    far = np.flatnonzero(angle_rad > _FARTHEST_RAD)
    if far.size:
        apart_s = step_s[far[0]]
        raise ElementsError(f"{_at(segment, far[0])} states {apart_s:.0f} s apart are too far apart to be interpolated")
    frame = f"is REF_FRAME ({segment.frame}) right"
    pull = -MU_M3_S2 * r_m / np.linalg.norm(r_m, axis=1)[:, None] ** 3
    h = step_s[:, None]
    made_m = h / 2.0 * (v_m_s[:-1] + v_m_s[1:]) - h**2 / 12.0 * np.diff(pull, axis=0)
    off_m = np.linalg.norm(np.diff(r_m, axis=0) - made_m, axis=1)
    bad = np.flatnonzero(off_m > 500.0 + 0.005 * step_s**2 + 0.01 * least_m * angle_rad**5)
    if bad.size:
        off_km, in_s = off_m[bad[0]] / 1e3, step_s[bad[0]]
        raise ElementsError(
            f"{_at(segment, bad[0])} position and velocity do not follow from each other, by {off_km:.1f} km in "
            f"{in_s:.0f} s: {frame}, a manoeuvre inside the segment?"
        )
    off_m_s2 = np.linalg.norm(np.diff(v_m_s, axis=0) / h - (pull[:-1] + pull[1:]) / 2.0, axis=1)
    allowed_m_s2 = 0.3 + 0.15 * np.linalg.norm(v_m_s[1:], axis=1) * angle_rad**3 / step_s
    if np.median(off_m_s2 / allowed_m_s2) > 1.0:
        raise ElementsError(
            f"{_at(segment, 0)} the velocities do not change as the Earth's pull makes them, by "
            f"{np.median(off_m_s2):.1f} m/s2: {frame}?"
        )


def _at(segment: EphemerisSegment, index: int) -> str:
    return f"{segment.where}: {segment.label}: from {utc_text(float(segment.tai_s[index]))} on"
