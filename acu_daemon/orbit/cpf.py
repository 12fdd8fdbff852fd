"""Predictions of the International Laser Ranging Service (CPF, versions 1 and 2): positions of one satellite, UTC.

Source: Consolidated Laser Ranging Prediction Format, version 2.00 (ILRS, 2018), and its errata.  Positions (record 10)
and velocities (20) at one instant; corrections, rotation angles and transponders are passed over.  Behind a leap second
the times of a file go on as if there had been none, and the flag of the rows says by how much.
"""

from dataclasses import dataclass, field
from functools import partial

from acu_daemon.orbit.element_set import Problem
from acu_daemon.orbit.ephemeris_rows import LARGEST, PositionRows, at, segments_of
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment, Frame
from acu_daemon.orbit.oem_text import BadSegmentError
from acu_daemon.orbit.timescales import tai_from_unix, tai_from_utc
from acu_daemon.units import DAY_S, Array

_FRAMES: dict[str, Frame] = {"0": "ITRF", "1": "TOD", "2": "EME2000"}
_H2_LEAST, _ROW_LEAST, _VELOCITY_LEAST = 20, 8, 5
_UNIX_MJD = 40587  # 1970-01-01
_MJDS = (30000, 80000)  # 1941 to 2077: a number outside is no day
_DAY_WITH_LEAP_S = DAY_S + 1.0
_KNOWN = ("00", "30", "40", "50", "60", "70")


@dataclass(slots=True)
class _Prediction:
    """One prediction while it is read."""

    line: int
    version: str
    name: str
    created_tai_s: float | None
    object_id: str = ""
    frame: Frame | None = None
    rows: PositionRows = field(default_factory=PositionRows)
    notes: list[str] = field(default_factory=list)
    is_ended: bool = False


def parse_cpf(text: str, file: str) -> tuple[list[EphemerisSegment], list[Problem]]:
    """Read every prediction of a text; a bad line loses its prediction, and is a problem with its line.

    Args:    file: the name that messages give.
    Returns: the segments, and for each lost prediction or part of one a problem.
    """
    lines = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    last_line = max((number for number, line in enumerate(lines, start=1) if line.strip()), default=0)
    segments: list[EphemerisSegment] = []
    problems: list[Problem] = []
    now: _Prediction | None = None
    is_lost = False
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words:
            continue
        try:
            if words[0].upper() == "H1":
                _finish(now, file, segments, problems)
                now, is_lost = None, False
                now = _begun(words, number)
            elif now is not None:
                _take(now, words, number)
            elif not is_lost and not words[0].startswith("00"):
                raise BadSegmentError(f"{line[:40]!r} stands before the header H1", number)
        except BadSegmentError as error:
            if now is not None and number == last_line and now.rows.tai_s:
                now.notes.append(at(file, number, f"the file ends within this line, which is left out: {error}"))
                continue
            problems.append(Problem(file, error.line, str(error)))
            now, is_lost = None, True
    if now is not None and not now.is_ended and lines[-1]:
        _drop_cut_row(now, last_line, file)
    _finish(now, file, segments, problems)
    if not segments and not problems:
        problems.append(Problem(file, None, "no prediction in it (CPF)"))
    return segments, problems


def _begun(words: list[str], line: int) -> _Prediction:
    """The header H1: version, source, time of production, sequence numbers, target."""
    if len(words) < 10 or words[1].upper() != "CPF":
        raise BadSegmentError("H1 is not: H1 CPF, version, source, year, month, day, hour, number, target", line)
    version = words[2].split(".")[0]
    if version not in ("1", "2"):
        raise BadSegmentError(f"CPF version {words[2][:20]!r}; 1 and 2 can be read", line)
    name = words[10] if version == "2" and len(words) > 10 else words[9]
    return _Prediction(line, words[2], name, _created_tai_s(words[4:8]))


def _created_tai_s(words: list[str]) -> float | None:
    try:
        year, month, day, hour = (int(word) for word in words)
        return tai_from_utc(f"{year:04}-{month:02}-{day:02}T{hour:02}:00:00Z")
    except ValueError:
        return None


def _take(now: _Prediction, words: list[str], line: int) -> None:
    record = words[0].upper()
    if record == "H2":
        _take_target(now, words, line)
    elif record == "10":
        _take_position(now, words, line)
    elif record == "20":
        _take_velocity(now, words, line)
    elif record == "99":
        now.is_ended = True
    elif not record.startswith("H") and record not in _KNOWN:
        raise BadSegmentError(f"{record[:20]!r} is no record of a CPF", line)


def _take_target(now: _Prediction, words: list[str], line: int) -> None:
    """The header H2: numbers of the satellite, span, step, frame."""
    if len(words) < _H2_LEAST:
        raise BadSegmentError(f"H2 has {len(words)} fields, at least {_H2_LEAST} are needed", line)
    if words[19] not in _FRAMES:
        raise BadSegmentError(f"reference frame {words[19][:20]!r} of H2: 0 (Earth-fixed), 1 or 2 can be used", line)
    now.frame = _FRAMES[words[19]]
    now.object_id = words[3] if words[3].isascii() and words[3].isdigit() and int(words[3]) else words[1]


def _take_position(now: _Prediction, words: list[str], line: int) -> None:
    if now.frame is None:
        raise BadSegmentError("positions before the header H2", line)
    if len(words) < _ROW_LEAST:
        raise BadSegmentError(f"{len(words)} fields in a record 10, {_ROW_LEAST} are needed", line)
    if words[1] != "0":
        reason = f"direction flag {words[1][:20]!r}: only positions of one instant (0) can be used, no light times"
        raise BadSegmentError(reason, line)
    mjd, second, leap_s, x_m, y_m, z_m = (_number(word, line) for word in words[2:8])
    if not (mjd == int(mjd) and _MJDS[0] <= mjd <= _MJDS[1]):
        raise BadSegmentError(f"{words[2][:20]!r} is no modified Julian date", line)
    if not 0.0 <= second < _DAY_WITH_LEAP_S or leap_s not in (-1.0, 0.0, 1.0):
        raise BadSegmentError(f"second {words[3][:20]} with leap-second flag {words[4][:20]} is no time of a day", line)
    now.rows.add(line, tai_from_unix((mjd - _UNIX_MJD) * DAY_S) + second - leap_s, (x_m, y_m, z_m))


def _take_velocity(now: _Prediction, words: list[str], line: int) -> None:
    if len(words) < _VELOCITY_LEAST or not now.rows.tai_s:
        raise BadSegmentError("a record 20 follows the position that it belongs to, with three numbers", line)
    x_m_s, y_m_s, z_m_s = (_number(word, line) for word in words[2:5])
    now.rows.v_m_s[-1] = (x_m_s, y_m_s, z_m_s)


def _number(word: str, line: int) -> float:
    try:
        value = float(word.upper().replace("D", "E"))
    except ValueError:
        value = float("nan")
    if not abs(value) < LARGEST:
        raise BadSegmentError(f"{word[:40]!r} is not a number", line)
    return value


def _drop_cut_row(now: _Prediction, last_line: int, file: str) -> None:
    """The last number of a file without an end may have lost digits."""
    rows = now.rows
    if rows.lines and rows.lines[-1] == last_line:
        del rows.lines[-1], rows.tai_s[-1], rows.r_m[-1], rows.v_m_s[-1]
        now.notes.append(at(file, last_line, "the file ends within this line, which is left out"))


def _finish(now: _Prediction | None, file: str, segments: list[EphemerisSegment], problems: list[Problem]) -> None:
    if now is None:
        return
    if not now.rows.tai_s:
        problems.append(Problem(file, now.line, "a prediction without positions (records 10)"))
        return
    if not now.is_ended and not now.notes:
        now.notes.append(at(file, now.rows.lines[-1], "the file ends without its record 99: it may have been cut"))
    found, lost = segments_of(now.rows, file, partial(_segment, now, file))
    segments += found
    problems += lost


def _segment(now: _Prediction, file: str, line: int, tai_s: Array, r_m: Array, v_m_s: Array) -> EphemerisSegment:
    return EphemerisSegment(
        kind="cpf",
        version=now.version,
        name=now.name,
        object_id=now.object_id,
        frame=now.frame or "ITRF",
        start_tai_s=float(tai_s[0]),
        end_tai_s=float(tai_s[-1]),
        created_tai_s=now.created_tai_s,
        tai_s=tai_s,
        r_m=r_m,
        v_m_s=v_m_s,
        file=file,
        line=line,
        notes=tuple(now.notes),
    )
