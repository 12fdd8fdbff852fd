"""An ephemeris as a source of orbits: interpolated states, and corrections of them as a relative orbit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction, EarthOrientation
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
from acu_daemon.orbit.ephemeris_states import check_neighbours, mean_motions_rad_s, states_teme
from acu_daemon.orbit.hermite import HermiteTable
from acu_daemon.orbit.kepler import OsculatingElements, osculating_from_state, state_from_elements
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import MU_M3_S2, Array

_EDGE_S = 1e-6  # by so much a time at a span's end may lie outside it


@dataclass(frozen=True, slots=True)
class _Piece:
    """A segment ready for use, TEME; the span is the useable one."""

    start_tai_s: float
    end_tai_s: float
    table: HermiteTable


class Ephemeris:
    """Interpolated states of one satellite, in the order of its segments.  Immutable, shared by all corrections."""

    def __init__(self, segments: Sequence[EphemerisSegment], orientation: EarthOrientation) -> None:
        """Turn the segments of one satellite into TEME.

        orientation: that of the station; with the same in both directions, it does not matter to an Earth-fixed one.
        Raises:  ElementsError: states that are no orbit around the Earth, or do not follow from each other.
        """
        self.segments = tuple(segments)  # as they were given
        self.kind = segments[0].kind
        self.label = segments[0].label
        self.file = segments[0].file
        self._pieces: list[_Piece] = []
        mean_motions = []
        for segment in segments:
            r_m, v_m_s = states_teme(segment, orientation)
            mean_motions.append(mean_motions_rad_s(segment, r_m, v_m_s))
            check_neighbours(segment, r_m, v_m_s)
            table = HermiteTable(segment.tai_s, r_m, v_m_s)
            self._pieces.append(_Piece(segment.start_tai_s, segment.end_tai_s, table))
        self.mean_motion_rad_s = float(np.mean(np.concatenate(mean_motions)))
        self.spans_tai_s = _merged([(piece.start_tai_s, piece.end_tai_s) for piece in self._pieces])
        self.epoch_tai_s = _last_determined(self.spans_tai_s, segments[-1].created_tai_s)

    @property
    def semi_major_axis_m(self) -> float:
        """Of the average mean motion."""
        return float((MU_M3_S2 / self.mean_motion_rad_s**2) ** (1.0 / 3.0))

    @property
    def coverage(self) -> str:
        """The spans as a text."""
        return " and ".join(f"{utc_text(start, 0)} to {utc_text(end, 0)}" for start, end in self.spans_tai_s)

    def span_at(self, tai_s: Array) -> tuple[Array, Array]:
        """Start and end (N,) of the spans that hold the times (N,).

        Raises:  OrbitError: names satellite, the first time outside, and the spans.
        """
        start, end = np.full((2, tai_s.size), np.nan)
        for low, high in self.spans_tai_s:
            is_in = (tai_s >= low - _EDGE_S) & (tai_s <= high + _EDGE_S)
            start[is_in], end[is_in] = low, high
        outside = np.flatnonzero(np.isnan(start))
        if outside.size:
            at = float(tai_s[outside[0]])
            when = utc_text(at) if np.isfinite(at) else "a time that is not finite"
            raise OrbitError(f"{self.label}: no position at {when}: the ephemeris covers {self.coverage}")
        return start, end

    def states(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions and velocities (N, 3), TEME, at times (N,) within the spans; of two segments the later one's."""
        r_m, v_m_s = np.empty((2, tai_s.size, 3))
        is_left: npt.NDArray[np.bool_] = np.ones(tai_s.size, dtype=bool)
        for piece in reversed(self._pieces):
            mine = is_left & (tai_s >= piece.start_tai_s - _EDGE_S) & (tai_s <= piece.end_tai_s + _EDGE_S)
            if mine.any():
                r_m[mine], v_m_s[mine] = piece.table.states(tai_s[mine])
                is_left &= ~mine
        return r_m, v_m_s


class EphemerisPropagator:
    """An ephemeris, corrected as a relative orbit.  Immutable and picklable.

    The correction of the mean anomaly (and that of the mean motion times the seconds since the epoch) becomes a shift
    in time along the ephemeris, by its average mean motion: whatever the Earth's flattening does to the orbit, it does
    to the shifted one as well.  A shift that leaves the span goes on by two-body motion (30 m off after a minute).
    The other corrections are added to the osculating elements at each time.  What they change in the secular drifts is
    left out: 0.01 deg of inclination (1.2 km) would move the ISS by 0.3 km a day.  Within a pass it does not show, the
    fit of node and anomaly takes it up.  `epoch_tai_s` is the message's creation, from which on the states are
    predicted, or the time of the spans next to it.
    """

    def __init__(self, ephemeris: Ephemeris, correction: Correction | None = None) -> None:
        self.ephemeris = ephemeris
        self.correction = correction or Correction()
        self.kind: str = ephemeris.kind
        self.epoch_tai_s = ephemeris.epoch_tai_s

    @property
    def spans_tai_s(self) -> tuple[tuple[float, float], ...]:
        """When there are answers."""
        return self.ephemeris.spans_tai_s

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and velocities (N, 3) in m/s, TEME of date, at the times (N,).

        Raises:  OrbitError: a time outside the spans; the message names them.  Or the corrected orbit is no ellipse.
        """
        start, end = self.ephemeris.span_at(tai_s)
        if self.correction == Correction():
            return self.ephemeris.states(np.clip(tai_s, start, end))
        given = self.correction
        moved_rad = given.delta_mean_anomaly_rad + given.delta_mean_motion_rad_s * (tai_s - self.epoch_tai_s)
        shifted_s = tai_s + moved_rad / self.ephemeris.mean_motion_rad_s
        within_s = np.clip(shifted_s, start, end)
        try:
            elements = osculating_from_state(*self.ephemeris.states(within_s))
            return state_from_elements(moved_elements(elements, given, shifted_s - within_s))
        except ValueError as error:
            raise OrbitError(f"{self.ephemeris.label}: the corrected orbit is no ellipse: {error}") from None

    def corrected(self, correction: Correction) -> "EphemerisPropagator":
        """The same ephemeris with this correction in place of any earlier one."""
        return EphemerisPropagator(self.ephemeris, correction)


def moved_elements(elements: OsculatingElements, correction: Correction, beyond_s: Array) -> OsculatingElements:
    """Add the corrections but the mean anomaly's, and go on by two-body motion for `beyond_s` (N,)."""
    mean_motion = np.sqrt(MU_M3_S2 / elements.a_m**3)
    changed_mean_motion = mean_motion + correction.delta_mean_motion_rad_s
    e_cos = elements.e * np.cos(elements.argp_rad) + correction.delta_e_cos_argp
    e_sin = elements.e * np.sin(elements.argp_rad) + correction.delta_e_sin_argp
    argp_rad = np.arctan2(e_sin, e_cos)
    latitude_rad = elements.argp_rad + elements.mean_anomaly_rad + mean_motion * beyond_s
    return OsculatingElements(
        a_m=(MU_M3_S2 / changed_mean_motion**2) ** (1.0 / 3.0),
        e=np.hypot(e_cos, e_sin),
        i_rad=elements.i_rad + correction.delta_inclination_rad,
        raan_rad=elements.raan_rad + correction.delta_raan_rad,
        argp_rad=argp_rad,
        mean_anomaly_rad=latitude_rad - argp_rad,
    )


def _last_determined(spans_tai_s: tuple[tuple[float, float], ...], created_tai_s: float | None) -> float:
    """The last time within the spans that is not after the creation; the start where all are or nobody knows it."""
    start_tai_s = spans_tai_s[0][0]
    if created_tai_s is None:
        return start_tai_s
    return max([start_tai_s, *(min(end, created_tai_s) for start, end in spans_tai_s if start <= created_tai_s)])


def _merged(spans: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Join spans that overlap or touch, in order."""
    merged: list[tuple[float, float]] = []
    for start, end in sorted(spans):
        if merged and start <= merged[-1][1] + _EDGE_S:
            merged[-1] = merged[-1][0], max(merged[-1][1], end)
        else:
            merged.append((start, end))
    return tuple(merged)
