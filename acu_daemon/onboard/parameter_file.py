"""The tracking-parameter file: polynomials of the gimbal's angles, with the conventions they mean, as text.

A header of KEY = VALUE lines, then a line for each piece and axis.  Read back it gives the same angles to 1e-8 deg.
Coefficients count seconds from the start of their own piece, with ten digits; from the profile's start ten would be
useless.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from acu_daemon.errors import UsageError
from acu_daemon.onboard.bound import Bound
from acu_daemon.onboard.checks import Check
from acu_daemon.onboard.profile import METHODS, Method, Profile
from acu_daemon.onboard.quintic import Path
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.units import DAY_S, Array

VERSION = "1"
_TITLE = "TRACKING_PARAMETER_FILE"
_CONVENTIONS = """\
# Angles of the two-axis gimbal of a satellite's antenna, degrees, as polynomials of fifth order.
#   azimuth    about the gimbal's +Z axis, from its +X towards its +Y; continuous, on one turn of the cable
#   elevation  angle FROM the +Z axis: 0 is along the axis
#   gimbal     mount matrix times body; body = Rx(roll) Ry(pitch) Rz(yaw) LVLH, passive
#   LVLH       z to the Earth's centre, y against the orbit's momentum (inertial velocity), x = y cross z
# angle(t) = c0 + c1 t + c2 t^2 + c3 t^3 + c4 t^4 + c5 t^5, t in seconds of TAI since the start of the same piece.
# Value, rate and acceleration are continuous where pieces meet.
# CERTIFICATE: within the margin azimuth is at least LOW_DEG at LOW_S and at most HIGH_DEG at HIGH_S (seconds since
#   START_UTC), so no path's largest azimuth rate is below (LOW_DEG - HIGH_DEG) / |LOW_S - HIGH_S| = RATE_DEG_S.
"""
_MILLISECONDS = 3
_AXES = ("AZ", "EL")
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d{1,3})?", re.ASCII)


@dataclass(frozen=True, slots=True)
class ParameterFile:
    """What a tracking-parameter file says."""

    start_tai_s: float
    profile: Profile
    header: Mapping[str, str]

    @property
    def end_s(self) -> float:
        path = self.profile.azimuth
        return float(path.start_s[-1] + path.length_s[-1])

    def number(self, key: str) -> float | None:
        """A number of the header, None where it has none.  UsageError: it is none."""
        try:
            return _number(self.header[key]) if key in self.header else None
        except ValueError as error:
            raise UsageError(f"{key}: {error}") from None


def write(start_tai_s: float, profile: Profile, about: Mapping[str, str], checks: list[Check]) -> str:
    """The file's text.

    start_tai_s: of the profile, a whole second.  about: more of the header, in this order; values without line ends.
    """
    azimuth, elevation = _on_same_pieces(profile)
    end_s = float(azimuth.start_s[-1] + azimuth.length_s[-1])
    header = {
        _TITLE: VERSION,
        "START_UTC": utc_text(start_tai_s, _MILLISECONDS),
        "STOP_UTC": utc_text(start_tai_s + end_s, _MILLISECONDS),
        "METHOD": profile.method,
        **about,
    }
    lines = [f"{key} = {value}" for key, value in header.items()]
    lines += [f"CHECK = {check}" for check in checks]
    if profile.bound is not None:
        lines.append(f"CERTIFICATE = {_certificate(profile.bound)}")
    lines += [f"PIECES = {azimuth.start_s.size}", "# axis, start UTC, length in seconds, c0 to c5"]
    for k in range(azimuth.start_s.size):
        start = utc_text(start_tai_s + float(azimuth.start_s[k]), _MILLISECONDS)
        for axis, path in zip(_AXES, (azimuth, elevation), strict=True):
            coefficients = " ".join(f"{value:+.9e}" for value in path.coefficients[k])
            lines.append(f"{axis} {start} {azimuth.length_s[k]:.3f} {coefficients}")
    return _CONVENTIONS + "\n".join(lines) + "\n"


def read(text: str, file: str) -> ParameterFile:
    """Read a file's text.  UsageError: names file, line and what was expected."""
    header: dict[str, str] = {}
    rows: dict[str, list[tuple[float, float, Array]]] = {axis: [] for axis in _AXES}
    for number, raw_line in enumerate(text.splitlines(), start=1):
        line = raw_line.strip()
        if not line or line.startswith("#"):
            continue
        try:
            if (axis := line.split(maxsplit=1)[0]) in _AXES:
                rows[axis].append(_piece(line))
                continue
            key, equals, value = (part.strip() for part in line.partition("="))
            if not equals:
                raise ValueError("expected KEY = VALUE, or a piece: AZ or EL, start, length and six coefficients")
            header[key] = f"{header[key]}\n{value}" if key == "CHECK" and key in header else value
        except ValueError as error:
            raise UsageError(f"{file}, line {number}: {error}") from None
    try:
        return _assembled(header, rows)
    except ValueError as error:
        raise UsageError(f"{file}: {error}") from None


def _assembled(header: dict[str, str], rows: dict[str, list[tuple[float, float, Array]]]) -> ParameterFile:
    if header.get(_TITLE) != VERSION:
        raise ValueError(f"expected {_TITLE} = {VERSION}: is it a tracking-parameter file of this version?")
    for key in ("START_UTC", "PIECES", "METHOD"):
        if key not in header:
            raise ValueError(f"{key} is missing in the header: the file is cut, or not whole")
    start_tai_s = tai_from_utc(header["START_UTC"])
    method = _method(header["METHOD"])
    azimuth, elevation = (_path(rows[axis], start_tai_s, axis, header["PIECES"]) for axis in _AXES)
    if not np.array_equal(azimuth.start_s, elevation.start_s) or not np.array_equal(
        azimuth.length_s, elevation.length_s
    ):
        raise ValueError("AZ and EL have different pieces")
    bound = _bound(header["CERTIFICATE"]) if "CERTIFICATE" in header else None
    return ParameterFile(start_tai_s, Profile(method, azimuth, elevation, bound), header)


def _method(text: str) -> Method:
    for method in METHODS:
        if text == method:
            return method
    raise ValueError(f"METHOD = {text[:40]!r}: expected one of {', '.join(METHODS)}")


def _piece(line: str) -> tuple[float, float, Array]:
    fields = line.split()
    if len(fields) != 9:
        raise ValueError(f"{len(fields)} fields in a piece, expected 9: axis, start, length and six coefficients")
    return tai_from_utc(fields[1]), _number(fields[2]), np.array([_number(field) for field in fields[3:]])


def _number(text: str) -> float:
    if _NUMBER.fullmatch(text) is None or not isfinite(float(text)):
        raise ValueError(f"{text[:40]!r} is not a number")
    return float(text)


def _path(rows: list[tuple[float, float, Array]], start_tai_s: float, axis: str, pieces: str) -> Path:
    if str(len(rows)) != pieces or not rows:
        raise ValueError(f"{len(rows)} pieces of {axis}, PIECES = {pieces[:40]}: the file is not whole")
    start_s = np.array([round(tai_s - start_tai_s, _MILLISECONDS) for tai_s, _, _ in rows])
    length_s = np.array([length for _, length, _ in rows])
    gaps = np.flatnonzero(np.abs(start_s[1:] - start_s[:-1] - length_s[:-1]) > 0.5e-3)
    if start_s[0] != 0.0 or gaps.size or (length_s <= 0.0).any():
        where = int(gaps[0]) + 2 if gaps.size else 1
        raise ValueError(f"piece {where} of {axis} does not begin where the one before ends")
    if start_s[-1] + length_s[-1] > DAY_S:
        raise ValueError("a profile of more than a day is none of a pass")
    return Path(start_s, length_s, np.stack([coefficients for _, _, coefficients in rows]))


def _certificate(bound: Bound) -> str:
    return (
        f"RATE_DEG_S {bound.rate_deg_s:.9e} LOW_S {bound.low_time_s:.3f} LOW_DEG {bound.low_deg:.9f} "
        f"HIGH_S {bound.high_time_s:.3f} HIGH_DEG {bound.high_deg:.9f}"
    )


def _bound(text: str) -> Bound:
    fields = text.split()
    names = ["RATE_DEG_S", "LOW_S", "LOW_DEG", "HIGH_S", "HIGH_DEG"]
    if fields[::2] != names or len(fields) != 2 * len(names):
        raise ValueError(f"CERTIFICATE: expected {' .. '.join(names)} .. with their numbers")
    return Bound(*(_number(field) for field in fields[1::2]))


def _on_same_pieces(profile: Profile) -> tuple[Path, Path]:
    """Both paths on the pieces of either: an exact change of coefficients."""
    starts = np.union1d(profile.azimuth.start_s, profile.elevation.start_s)
    end_s = profile.azimuth.knots.time_s[-1]
    return profile.azimuth.cut(starts, end_s), profile.elevation.cut(starts, end_s)
