"""Orbits in the Standard Product 3 format (SP3-a to SP3-d): positions, often velocities, of one satellite or many.

Source: Hilla, The Extended Standard Product 3 Orbit Format (SP3-d), NGS 2016.  Kilometres and dm/s in fixed columns;
zeros for what is not known.  Times are those of the header (%c), GPS time where it names none; frames are Earth-fixed.
"""

import re
from dataclasses import dataclass, field
from functools import partial

from acu_daemon.orbit.element_set import Problem
from acu_daemon.orbit.ephemeris_rows import LARGEST, PositionRows, Vector, at, segments_of
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment, Frame
from acu_daemon.orbit.oem_text import BadSegmentError
from acu_daemon.orbit.timescales import tai_from_ccsds
from acu_daemon.units import Array

_HEADER = re.compile(r"#([a-dA-D])([PV])\d{4} ")
_EPOCH_FIELDS = 6
_SYSTEMS = {"GPS": "GPS", "GAL": "GPS", "QZS": "GPS", "IRN": "GPS", "UTC": "UTC", "GLO": "UTC", "TAI": "TAI"}
_SYSTEMS |= {"BDT": "GPS", "": "GPS", "CCC": "GPS"}
_BDT_MINUS_GPS_S = -14.0
_EARTH_FIXED = re.compile(r"IT|IG|WGS|ECF|ECEF|TRF|SLR|PZ|GTRF|CGCS|UNDEF|SLRF", re.IGNORECASE)
_INERTIAL: tuple[tuple[str, Frame], ...] = (
    (r"J2000|EME2?0?0?0?", "EME2000"),
    (r"GCRF|ICRF\d?", "GCRF"),
    (r"TEME", "TEME"),
    (r"TOD", "TOD"),
)
_AMBIGUOUS = re.compile(r"ECI|INERT|CIS|MOD", re.IGNORECASE)
_M_PER_KM, _M_S_PER_DM_S = 1e3, 0.1


@dataclass(slots=True)
class _Orbit:
    """One satellite while it is read."""

    rows: PositionRows = field(default_factory=PositionRows)
    last_determined_tai_s: float | None = None
    has_predicted: bool = False
    manoeuvre_lines: list[int] = field(default_factory=list)


@dataclass(slots=True)
class _File:
    """A file while it is read."""

    line: int
    version: str
    frame: Frame
    notes: list[tuple[int, str]] = field(default_factory=list)
    system: str = ""
    tai_s: float | None = None  # of the rows that follow
    orbits: dict[str, _Orbit] = field(default_factory=dict)
    is_ended: bool = False


def parse_sp3(text: str, file: str) -> tuple[list[EphemerisSegment], list[Problem]]:
    """Read the orbits of all satellites of a text.  A line that cannot be read ends it: what is after it is not used.

    Args:    file: the name that messages give.
    Returns: the segments, by satellite, and problems with their lines.
    """
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    last_line = max((number for number, line in enumerate(lines, start=1) if line.strip()), default=0)
    problems: list[Problem] = []
    now: _File | None = None
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            if now is None:
                now = _begun(line, number)
            else:
                _take(now, line, number)
        except BadSegmentError as error:
            if now is None or number != last_line or not now.orbits:
                return [], [Problem(file, error.line, str(error))]
            now.notes.append((number, f"the file ends within this line, which is left out: {error}"))
        if now is not None and now.is_ended:
            break
    if now is None:
        return [], [Problem(file, None, "no orbit in it (SP3)")]
    if not now.is_ended:
        now.notes.append((last_line, "the file ends without its line EOF: it may have been cut"))
    segments: list[EphemerisSegment] = []
    for name, orbit in now.orbits.items():
        found, lost = segments_of(orbit.rows, file, partial(_segment, now, orbit, name, file))
        segments += found
        problems += lost
    if not segments and not problems:
        problems.append(Problem(file, now.line, "no satellite in it has a position"))
    return segments, problems


def _begun(line: str, number: int) -> _File:
    header = _HEADER.match(line)
    if header is None:
        raise BadSegmentError(
            f"{line[:40]!r} is not the first line of an SP3 file: # with a to d, P or V, a time", number
        )
    frame, note = _frame(line[46:51].strip(), number)
    return _File(number, header[1].lower(), frame, [(number, note)] if note else [])


def _frame(name: str, line: int) -> tuple[Frame, str]:
    for pattern, frame in _INERTIAL:
        if re.fullmatch(pattern, name, re.IGNORECASE):
            return frame, ""
    if _AMBIGUOUS.match(name):
        raise BadSegmentError(f"coordinate system {name!r}: an inertial one of which nobody knows the axes", line)
    if _EARTH_FIXED.match(name):
        return "ITRF", ""
    return "ITRF", f"coordinate system {name!r} is not known: read as Earth-fixed, as SP3 files are"


def _take(now: _File, line: str, number: int) -> None:
    kind = line[0].upper()
    if line.startswith("EOF"):
        now.is_ended = True
    elif kind == "*":
        now.tai_s = _epoch_tai_s(line, now.system, number)
    elif kind == "P":
        _take_position(now, line, number)
    elif kind == "V":
        _take_velocity(now, line, number)
    elif line.startswith("%c") and now.tai_s is None and not now.system:
        now.system = line[9:12].strip().upper()
        if now.system not in _SYSTEMS:
            known = ", ".join(one for one in _SYSTEMS if one not in ("", "CCC"))
            raise BadSegmentError(f"time system {now.system!r} of %c; {known} can be used", number)
    elif not (line[0] in "#+%/" or line[:2].upper() in ("EP", "EV")):
        raise BadSegmentError(f"{line[:40]!r} is no line of an SP3 file", number)


def _epoch_tai_s(line: str, system: str, number: int) -> float:
    words = line[1:].split()
    try:
        if len(words) < _EPOCH_FIELDS:
            raise ValueError("it has too few fields")
        year, month, day, hour, minute = (int(word) for word in words[:5])
        second = words[5] if words[5].index(".") > 1 else f"0{words[5]}"
        text = f"{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second}"
        tai_s = tai_from_ccsds(text, _SYSTEMS[system])
    except ValueError as error:
        raise BadSegmentError(f"{line[:40]!r} is not a time: {error}", number) from None
    return tai_s - _BDT_MINUS_GPS_S if system == "BDT" else tai_s


def _take_position(now: _File, line: str, number: int) -> None:
    if now.tai_s is None:
        raise BadSegmentError("a position before the first time (*)", number)
    x_km, y_km, z_km = _vector(line, number)
    if x_km == y_km == z_km == 0.0:  # not known
        return
    orbit = now.orbits.setdefault(_satellite(line, number), _Orbit())
    orbit.rows.add(number, now.tai_s, (x_km * _M_PER_KM, y_km * _M_PER_KM, z_km * _M_PER_KM))
    if line[79:80] == "P":
        orbit.has_predicted = True
    else:
        orbit.last_determined_tai_s = now.tai_s
    if line[78:79] == "M":
        orbit.manoeuvre_lines.append(number)


def _take_velocity(now: _File, line: str, number: int) -> None:
    x, y, z = _vector(line, number)
    orbit = now.orbits.get(_satellite(line, number))
    if orbit is None or (x == y == z == 0.0) or orbit.rows.tai_s[-1] != now.tai_s:
        return
    orbit.rows.v_m_s[-1] = (x * _M_S_PER_DM_S, y * _M_S_PER_DM_S, z * _M_S_PER_DM_S)


def _satellite(line: str, number: int) -> str:
    name = line[1:4].strip()
    if not name:
        raise BadSegmentError(f"{line[:20]!r}: no satellite in columns 2 to 4", number)
    return name


def _vector(line: str, number: int) -> Vector:
    """Columns 5 to 46."""
    values = []
    for first in (4, 18, 32):
        text = line[first : first + 14].strip()
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not abs(value) < LARGEST or len(line) < first + 14:
            raise BadSegmentError(f"columns {first + 1} to {first + 14} are {text[:20]!r}, not a number", number)
        values.append(value)
    return values[0], values[1], values[2]


def _segment(
    now: _File, orbit: _Orbit, name: str, file: str, line: int, tai_s: Array, r_m: Array, v_m_s: Array
) -> EphemerisSegment:
    notes = [at(file, number, text) for number, text in now.notes]
    if orbit.manoeuvre_lines:
        count = len(orbit.manoeuvre_lines)
        flagged = "a manoeuvre before this position is flagged" + (f" ({count} in all)" if count > 1 else "")
        notes.append(at(file, orbit.manoeuvre_lines[0], f"{name}: {flagged}: across it the orbit is less exact"))
    return EphemerisSegment(
        kind="sp3",
        version=now.version,
        name=name,
        object_id="",
        frame=now.frame,
        start_tai_s=float(tai_s[0]),
        end_tai_s=float(tai_s[-1]),
        created_tai_s=orbit.last_determined_tai_s if orbit.has_predicted else None,
        tai_s=tai_s,
        r_m=r_m,
        v_m_s=v_m_s,
        file=file,
        line=line,
        notes=tuple(notes),
    )
