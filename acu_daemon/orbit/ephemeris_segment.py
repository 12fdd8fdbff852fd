"""A span of an ephemeris, of whatever format, and velocities for one that has positions alone."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from acu_daemon.orbit.element_set import place
from acu_daemon.units import Array

EphemerisKind = Literal["oem", "cpf", "sp3"]
Frame = Literal["TEME", "TOD", "EME2000", "GCRF", "ITRF"]

LEAST_POSITIONS = 8  # without velocities
_WIDTH = 10  # degree 9, as predictions of the ILRS are made for; more does worse at the ends of a table


@dataclass(frozen=True, slots=True)
class EphemerisSegment:
    """States of one satellite at rising times, as the file has them but for the units.

    r_m, v_m_s: (N, 3) in `frame`; in ITRF the velocity is that seen by an observer who turns with the Earth.
    """

    kind: EphemerisKind
    version: str  # of the message; empty where it says none
    name: str
    object_id: str
    frame: Frame
    start_tai_s: float  # of the span that may be used
    end_tai_s: float
    created_tai_s: float | None  # of the file; states after it are predicted
    tai_s: Array = field(repr=False)
    r_m: Array = field(repr=False)
    v_m_s: Array = field(repr=False)
    file: str
    line: int
    notes: tuple[str, ...] = ()  # what was left out of it

    @property
    def label(self) -> str:
        """Name and international designator, for messages."""
        return f"{self.name} ({self.object_id})" if self.object_id else self.name

    @property
    def where(self) -> str:
        """File and line, for messages."""
        return place(self.file, self.line, None)


def velocities_m_s(tai_s: Array, r_m: Array, width: int = _WIDTH) -> Array:
    """Velocities (N, 3) at the positions (N, 3) of rising times (N,), at least LEAST_POSITIONS of them.

    By the polynomial through the `width` positions around each, in the frame that they are in.
    Source:  Berrut and Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004), section 9.3.
    """
    width = min(width, tai_s.size)
    first = np.clip(np.arange(tai_s.size) - width // 2, 0, tai_s.size - width)
    index = first[:, None] + np.arange(width)  # (N, width)
    scale_s = (tai_s[-1] - tai_s[0]) / (tai_s.size - 1)
    nodes = (tai_s[index] - tai_s[:, None]) / scale_s
    apart = nodes[:, :, None] - nodes[:, None, :] + np.eye(width)
    weights = 1.0 / np.prod(apart, axis=2)  # barycentric
    is_own = index == np.arange(tai_s.size)[:, None]
    shares = np.where(is_own, 0.0, weights / weights[is_own][:, None] / np.where(is_own, 1.0, -nodes))
    slopes: Array = np.einsum("nk,nkx->nx", shares, r_m[index] - r_m[:, None]) / scale_s
    return slopes


def better_velocities_m_s(tai_s: Array, r_m: Array, given_m_s: Array) -> Array:
    """The given velocities (N, 3), but where the positions say better what they are.

    Those of files may be off by centimetres a second (Stella's in an SP3 file of the ILRS: 1.5 cm/s, 1.6 m at a
    held-back point).  A polynomial through more positions and one through fewer differ by what they are off.
    """
    if tai_s.size < LEAST_POSITIONS:
        return given_m_s
    made_m_s = velocities_m_s(tai_s, r_m)
    doubt_m_s = np.linalg.norm(made_m_s - velocities_m_s(tai_s, r_m, LEAST_POSITIONS), axis=1)
    is_better = doubt_m_s < np.linalg.norm(made_m_s - given_m_s, axis=1)
    return np.where(is_better[:, None], made_m_s, given_m_s)
