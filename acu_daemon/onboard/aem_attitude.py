"""The attitude of a CCSDS message as a source: cubics through four states, and its frame turned to LVLH."""

from collections.abc import Sequence

import numpy as np

from acu_daemon.errors import AttitudeError
from acu_daemon.model import EarthOrientation
from acu_daemon.onboard.aem import AemSegment, ReferenceFrame, matrices
from acu_daemon.orbit.celestial import teme_from_eme2000, teme_from_gcrf, teme_from_tod
from acu_daemon.orbit.element_set import place
from acu_daemon.orbit.frames import teme_from_itrs
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

_EDGE_S = 1e-6
_FROM_INERTIAL = {"EME2000": teme_from_eme2000, "GCRF": teme_from_gcrf, "TOD": teme_from_tod}
_RTN_FROM_LVLH = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


class AemAttitude:
    """Segments of one body, interpolated; where they overlap the later one holds.  Immutable."""

    def __init__(self, segments: Sequence[AemSegment], orientation: EarthOrientation) -> None:
        """Take the segments of one file, at least one.  orientation: for Earth-fixed attitudes."""
        self._segments, self._orientation = tuple(segments), orientation

    @property
    def coverage(self) -> str:
        """The spans as a text."""
        spans = (f"{utc_text(one.start_tai_s)} to {utc_text(one.end_tai_s)}" for one in self._segments)
        return " and ".join(spans)

    def body_from_lvlh(self, tai_s: Array, lvlh_from_teme: Array) -> Array:
        """Rotations (N, 3, 3).  AttitudeError: a time outside the segments."""
        rotations = np.full((tai_s.size, 3, 3), np.nan)
        for one in self._segments:
            is_in = (tai_s >= one.start_tai_s - _EDGE_S) & (tai_s <= one.end_tai_s + _EDGE_S)
            if is_in.any():
                _refuse_gap(one, tai_s)
                body = matrices(interpolated(one.tai_s, one.quaternion, tai_s[is_in]))
                rotations[is_in] = body @ self._from_lvlh(one.reference, tai_s[is_in], lvlh_from_teme[is_in])
        outside = np.flatnonzero(np.isnan(rotations[:, 0, 0]))
        if outside.size:
            raise AttitudeError(
                f"{self._segments[0].file}: no attitude at {utc_text(float(tai_s[outside[0]]))}: it covers "
                f"{self.coverage}, the pass lasts from {utc_text(float(tai_s[0]))} to {utc_text(float(tai_s[-1]))}; "
                "get a longer file, or raise min_elevation_deg"
            )
        return rotations

    def _from_lvlh(self, reference: ReferenceFrame, tai_s: Array, lvlh_from_teme: Array) -> Array:
        """Rotations (N, 3, 3) from LVLH to the reference frame."""
        if reference == "LVLH":
            return np.broadcast_to(np.eye(3), lvlh_from_teme.shape)
        if reference == "RTN":
            return np.broadcast_to(_RTN_FROM_LVLH, lvlh_from_teme.shape)
        teme_from_lvlh = lvlh_from_teme.transpose(0, 2, 1)
        if reference == "TEME":
            return teme_from_lvlh
        if reference == "ITRF":
            earth = np.stack([teme_from_itrs(axis, tai_s, self._orientation) for axis in np.eye(3)], axis=2)
        else:
            earth = _FROM_INERTIAL[reference](tai_s)
        turned: Array = earth.transpose(0, 2, 1) @ teme_from_lvlh
        return turned


def _refuse_gap(segment: AemSegment, tai_s: Array) -> None:
    """AttitudeError: one of the times lies in a gap."""
    for gap in segment.gaps:
        if ((tai_s > gap.start_tai_s) & (tai_s < gap.end_tai_s)).any():
            lasts_s = gap.end_tai_s - gap.start_tai_s
            raise AttitudeError(
                f"{place(segment.file, gap.line, None)}: a gap of {lasts_s:.1f} s in the attitude from "
                f"{utc_text(gap.start_tai_s)} on, where it turns by up to {gap.fastest_deg_s:.2f} deg/s: it cannot be "
                f"interpolated over more than {gap.allowed_s:.1f} s there; get a file without the gap or with shorter "
                "steps"
            )


def interpolated(tai_s: Array, quaternion: Array, at_tai_s: Array) -> Array:
    """Unit quaternions (M, 4) at times within those of a table (N,), by the cubic through the four states around."""
    first = np.clip(np.searchsorted(tai_s, at_tai_s, side="right") - 2, 0, tai_s.size - 4)
    nodes = tai_s[first[:, None] + np.arange(4)]
    mixed = np.zeros((at_tai_s.size, 4))
    for k in range(4):
        others = [j for j in range(4) if j != k]
        share = np.prod([(at_tai_s - nodes[:, j]) / (nodes[:, k] - nodes[:, j]) for j in others], axis=0)
        mixed += share[:, None] * quaternion[first + k]
    unit: Array = mixed / np.linalg.norm(mixed, axis=1)[:, None]
    return unit
