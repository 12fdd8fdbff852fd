"""Orbit ephemeris messages (CCSDS 502.0), KVN and XML: states of one satellite at rising times, in segments.

Comments, covariances, accelerations and the recommended interpolation are passed over: `orbit.ephemeris` interpolates
by its own method.  Only the Earth as centre, and frames and time systems that are turned into TEME and TAI here.
"""

import re
from math import isfinite

import numpy as np

from acu_daemon.orbit.element_set import Problem, place
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment, Frame
from acu_daemon.orbit.oem_text import BadSegmentError, RawSegment, read_segments
from acu_daemon.orbit.timescales import TIME_SYSTEMS, tai_from_ccsds
from acu_daemon.units import Array

_FRAMES: tuple[tuple[str, Frame], ...] = (
    (r"TEME(_?OF_?DATE)?", "TEME"),
    (r"TOD(_EARTH)?|TRUE_?OF_?DATE", "TOD"),
    (r"EME2000|J2000", "EME2000"),
    (r"GCRF\d?|ICRF\d?", "GCRF"),
    (r"ITRF-?(\d\d|\d{4})?|WGS84", "ITRF"),
)
SUPPORTED_FRAMES = "TEME, TOD, EME2000, GCRF, ICRF, ITRF and ITRFyyyy"
_OF_DATE = ("TEME", "TOD")
_LEAST_STATES = 2
_SAME = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])  # metres, m/s: by so much a state that stands twice may differ
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


def parse_oem(text: str, file: str) -> tuple[list[EphemerisSegment], list[Problem]]:
    """Read every segment of a text, KVN or XML as its first character says.

    Args:    file: the name that messages give.
    Returns: the good segments in the order of the file, and for each other one a problem with its line.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    segments: list[EphemerisSegment] = []
    problems: list[Problem] = []
    try:
        found = read_segments(text)
    except BadSegmentError as error:
        return [], [Problem(file, error.line, str(error))]
    for raw in found:
        try:
            segments.append(_segment(raw, file))
        except BadSegmentError as error:
            problems.append(Problem(file, error.line, str(error)))
    if not found:
        problems.append(Problem(file, None, "no orbit ephemeris message in it (KVN or XML)"))
    return segments, problems


def _segment(raw: RawSegment, file: str) -> EphemerisSegment:
    if raw.problem is not None:
        raise raw.problem
    frame, system = _frame(raw), time_system(raw)
    if len(raw.states) < _LEAST_STATES:
        raise BadSegmentError(f"{len(raw.states)} states in the segment, at least {_LEAST_STATES} are needed", raw.line)
    tai_s = np.array([epoch_tai_s(epoch, system, line) for line, epoch, _ in raw.states])
    states = np.array([numbers(values, line) for line, _, values in raw.states]) * 1e3
    tai_s, states, notes = _without_repeats(raw, tai_s, states)
    start_tai_s, end_tai_s = useable_span_tai_s(raw, system, tai_s)
    return EphemerisSegment(
        kind="oem",
        version=raw.version,
        name=raw.fields.get("OBJECT_NAME", "").strip() or "(no OBJECT_NAME)",
        object_id=raw.fields.get("OBJECT_ID", ""),
        frame=frame,
        start_tai_s=start_tai_s,
        end_tai_s=end_tai_s,
        created_tai_s=_created_tai_s(raw),
        tai_s=tai_s,
        r_m=states[:, :3].copy(),
        v_m_s=states[:, 3:].copy(),
        file=file,
        line=raw.line,
        notes=tuple(f"{place(file, line, None)}: {text}" for line, text in [*raw.notes, *notes]),
    )


def _without_repeats(raw: RawSegment, tai_s: Array, states: Array) -> tuple[Array, Array, list[tuple[int, str]]]:
    """Leave out states that stand twice in a row, with a note; times that fall or have two states are refused."""
    steps_s = np.diff(tai_s)
    is_same = np.all(np.abs(np.diff(states, axis=0)) <= _SAME, axis=1) & (steps_s == 0.0)
    bad = np.flatnonzero((steps_s <= 0.0) & ~is_same)
    if bad.size:
        line, epoch, _ = raw.states[int(bad[0]) + 1]
        two = ": two states at one time, and they differ" if steps_s[bad[0]] == 0.0 else ""
        raise BadSegmentError(f"the times must rise, {epoch} does not{two}", line)
    twice = np.flatnonzero(is_same) + 1
    if not twice.size:
        return tai_s, states, []
    if tai_s.size - twice.size < _LEAST_STATES:
        raise BadSegmentError("one state only, it stands several times", raw.line)
    what = "this state stands" if twice.size == 1 else f"{twice.size} states, this the first, stand"
    notes = [(raw.states[int(twice[0])][0], f"{what} twice: the second is left out")]
    return np.delete(tai_s, twice), np.delete(states, twice, axis=0), notes


def _frame(raw: RawSegment) -> Frame:
    centre = required(raw, "CENTER_NAME")
    if centre.upper() != "EARTH":
        raise BadSegmentError(f"CENTER_NAME is {centre[:40]!r}; only EARTH can be used", raw.line)
    name = required(raw, "REF_FRAME")
    frame = frame_named(name)
    if frame is None:
        raise BadSegmentError(f"REF_FRAME is {name[:40]!r}; {SUPPORTED_FRAMES} can be used", raw.line)
    if frame in _OF_DATE and raw.fields.get("REF_FRAME_EPOCH"):
        raise BadSegmentError(f"REF_FRAME_EPOCH: {frame} can be used of date only, not of one epoch", raw.line)
    return frame


def frame_named(name: str) -> Frame | None:
    """The frame that a message names, None for one that is not known here."""
    plain = name.upper().replace(" ", "")
    return next((frame for pattern, frame in _FRAMES if re.fullmatch(pattern, plain)), None)


def time_system(raw: RawSegment) -> str:
    """The segment's TIME_SYSTEM.  BadSegmentError: none, or one that is not known here."""
    system = required(raw, "TIME_SYSTEM").upper()
    if system not in TIME_SYSTEMS:
        raise BadSegmentError(f"TIME_SYSTEM is {system[:40]!r}; {', '.join(TIME_SYSTEMS)} can be used", raw.line)
    return system


def required(raw: RawSegment, key: str) -> str:
    """A field of the metadata.  BadSegmentError: it is missing."""
    value = raw.fields.get(key, "")
    if not value:
        raise BadSegmentError(f"{key} is missing", raw.line)
    return value


def useable_span_tai_s(raw: RawSegment, system: str, tai_s: Array) -> tuple[float, float]:
    """The useable span, within the states; without one, that of the states."""
    first, last = float(tai_s[0]), float(tai_s[-1])
    if start := raw.fields.get("USEABLE_START_TIME"):
        first = max(first, epoch_tai_s(start, system, raw.line))
    if stop := raw.fields.get("USEABLE_STOP_TIME"):
        last = min(last, epoch_tai_s(stop, system, raw.line))
    if first >= last:
        raise BadSegmentError("USEABLE_START_TIME to USEABLE_STOP_TIME leaves nothing of the states", raw.line)
    return first, last


def _created_tai_s(raw: RawSegment) -> float | None:
    """None where the header has no such date, or no date that can be read."""
    try:
        return epoch_tai_s(raw.created, "UTC", raw.line)
    except BadSegmentError:
        return None


def epoch_tai_s(text: str, system: str, line: int) -> float:
    """Read a time of a message.  BadSegmentError: it is none."""
    try:
        return tai_from_ccsds(text, system)
    except ValueError as error:
        raise BadSegmentError(f"{text[:40]!r} is not a time: {error}", line) from None


def numbers(values: list[str], line: int) -> list[float]:
    """Finite numbers.  BadSegmentError: a text that is none."""
    plain = [text.upper().replace("D", "E") for text in values]  # as Fortran writes exponents
    for text in plain:
        if _NUMBER.fullmatch(text) is None or not isfinite(float(text)):
            raise BadSegmentError(f"{values[plain.index(text)][:40]!r} is not a number", line)
    return [float(text) for text in plain]
