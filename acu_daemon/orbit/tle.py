"""Two-line element sets, with or without name lines, checked before SGP4 sees them.

Columns: Spacetrack Report #3 and CelesTrak's format description; catalogue numbers from 100000 on in Alpha-5.
"""

import re
from dataclasses import dataclass
from datetime import date, timedelta

from acu_daemon.orbit.element_set import ElementSet, Problem, rad_s_from_rev_day
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, DEG

_LENGTH = 69
_BLANK_COLUMNS = {"1": (2, 9, 18, 33, 44, 53, 62, 64), "2": (2, 8, 17, 26, 34, 43, 52)}  # counted from 1
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)", re.ASCII)
_EXPONENT = re.compile(r"([+-]?)(\d{1,5})([+-]\d)", re.ASCII)
_ALPHA_5 = "ABCDEFGHJKLMNPQRSTUVWXYZ"
_SGP4_XP = "4"


@dataclass(frozen=True, slots=True)
class _Line:
    number: int  # in the file, from 1
    text: str


class _BadLineError(ValueError):
    """What is wrong with a line; becomes a Problem."""

    def __init__(self, line: _Line, reason: str) -> None:
        super().__init__(reason)
        self.line = line


def parse_tle(text: str, file: str) -> tuple[list[ElementSet], list[Problem]]:
    """Read every element set of a text, two or three lines each; any line ends; `#` comments and blank lines skipped.

    Args:    file: the name that messages give.
    Returns: the good sets, and for everything else a problem with its line; a bad set loses no other.
    """
    sets: list[ElementSet] = []
    problems: list[Problem] = []
    lines = _content_lines(text)
    name: _Line | None = None
    i = 0
    while i < len(lines):
        line, following = lines[i], lines[i + 1] if i + 1 < len(lines) else None
        if following is not None and _is_pair(line, following):
            try:
                sets.append(_element_set(line, following, name.text if name else "", file))
            except _BadLineError as error:
                problems.append(Problem(file, error.line.number, str(error)))
            name, i = None, i + 2
            continue
        if name is not None:
            problems.append(_stray(name, file))
        name = line if _kind(line) == "N" else None
        if name is None:
            problems.append(Problem(file, line.number, f"line {_kind(line)} of an element set without the other line"))
        i += 1
    if name is not None:
        problems.append(_stray(name, file))
    return sets, problems


def _stray(line: _Line, file: str) -> Problem:
    return Problem(file, line.number, f"{line.text[:40]!r} is neither an element line nor the name of a set below it")


def _content_lines(text: str) -> list[_Line]:
    raw = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    numbered = (_Line(number, line.strip()) for number, line in enumerate(raw, start=1))
    return [line for line in numbered if line.text and not line.text.startswith("#")]


def _kind(line: _Line) -> str:
    return line.text[0] if line.text[:2] in ("1 ", "2 ") else "N"


def _is_pair(line: _Line, following: _Line) -> bool:
    """Two lines of one set, in order or swapped (swapped only if of one satellite: else a line is missing)."""
    kinds = _kind(line) + _kind(following)
    return kinds == "12" or (kinds == "21" and line.text[2:7] == following.text[2:7])


def _element_set(one: _Line, two: _Line, name: str, file: str) -> ElementSet:
    if _kind(one) == "2":
        raise _BadLineError(one, "the two lines are swapped: line 2 stands before line 1")
    for line in (one, two):
        _check_form(line)
    norad_id = _catalogue_number(one)
    if norad_id != _catalogue_number(two):
        raise _BadLineError(
            two, f"catalogue number {two.text[2:7]} does not match {one.text[2:7]} of line {one.number}"
        )
    if one.text[62] == _SGP4_XP:
        raise _BadLineError(one, "ephemeris type 4 (SGP4-XP) needs a propagator of its own; get SGP4 elements (type 0)")
    _exponent(one, 45, 52, "second derivative of mean motion")
    _number(one, 34, 43, "first derivative of mean motion")
    rev_day = _number(two, 53, 63, "mean motion")
    if rev_day <= 0.0:
        raise _BadLineError(two, f"mean motion {rev_day} revolutions a day; it must be positive")
    inclination_deg = _number(two, 9, 16, "inclination")
    if not 0.0 <= inclination_deg <= 180.0:
        raise _BadLineError(two, f"inclination {inclination_deg} deg; it must lie in 0..180")
    return ElementSet(
        kind="tle",
        name=name.removeprefix("0 ").strip(),
        norad_id=norad_id,
        epoch_tai_s=_epoch_tai_s(one),
        mean_motion_rad_s=rad_s_from_rev_day(rev_day),
        eccentricity=_digits(two, 27, 33, "eccentricity") * 1e-7,
        inclination_rad=inclination_deg * DEG,
        raan_rad=_number(two, 18, 25, "right ascension of the node") * DEG,
        argp_rad=_number(two, 35, 42, "argument of perigee") * DEG,
        mean_anomaly_rad=_number(two, 44, 51, "mean anomaly") * DEG,
        bstar_per_radius=_exponent(one, 54, 61, "B*"),
        file=file,
        line=one.number,
    )


def _check_form(line: _Line) -> None:
    text = line.text
    if len(text) != _LENGTH:
        raise _BadLineError(line, f"{len(text)} characters, an element line has {_LENGTH}")
    if not text.isascii() or not text.isprintable():
        raise _BadLineError(line, "a character that is not printable ASCII")
    expected = sum(int(c) if c.isdigit() else c == "-" for c in text[:-1]) % 10
    if text[-1] != str(expected):
        raise _BadLineError(line, f"checksum {text[-1]}, computed {expected}: the line was changed; fetch it anew")
    filled = [column for column in _BLANK_COLUMNS[text[0]] if text[column - 1] != " "]
    if filled:
        raise _BadLineError(line, f"column {filled[0]} must be blank: the numbers are not in their columns")


def catalogue_number(text: str) -> int | None:
    """Read a NORAD number: digits, or Alpha-5 (a letter but I and O, then four digits); None if it is neither."""
    if text.isascii() and text.isdigit() and len(text) <= 9:
        return int(text)
    if len(text) == 5 and text[0] in _ALPHA_5 and text[1:].isascii() and text[1:].isdigit():
        return (_ALPHA_5.index(text[0]) + 10) * 10000 + int(text[1:])
    return None


def _catalogue_number(line: _Line) -> int:
    field = line.text[2:7].strip()
    number = catalogue_number(field)
    if number is None:
        raise _BadLineError(line, f"catalogue number {field!r}: five digits, or a letter (not I, O) and four digits")
    return number


def _number(line: _Line, first: int, last: int, what: str) -> float:
    field = line.text[first - 1 : last].strip()
    if _NUMBER.fullmatch(field) is None:
        raise _BadLineError(line, f"{what} (columns {first}-{last}) is {field!r}, not a number")
    return float(field)


def _digits(line: _Line, first: int, last: int, what: str) -> int:
    field = line.text[first - 1 : last]
    if not field.isdigit():
        raise _BadLineError(line, f"{what} (columns {first}-{last}) is {field!r}, not {last - first + 1} digits")
    return int(field)


def _exponent(line: _Line, first: int, last: int, what: str) -> float:
    """A field like ` 28098-4`: a decimal point before the digits, a power of ten after them."""
    field = line.text[first - 1 : last].strip()
    match = _EXPONENT.fullmatch(field)
    if match is None:
        raise _BadLineError(line, f"{what} (columns {first}-{last}) is {field!r}, not like 12345-3")
    return float(f"{match[1]}.{match[2]}e{match[3]}")


def _epoch_tai_s(line: _Line) -> float:
    year = _digits(line, 19, 20, "epoch year")
    year += 1900 if year >= 57 else 2000
    day = _number(line, 21, 32, "epoch day")
    if not 1.0 <= day < 366.0 + (date(year, 12, 31).timetuple().tm_yday == 366):
        raise _BadLineError(line, f"epoch day {day} is no day of {year}")
    midnight = date(year, 1, 1) + timedelta(days=int(day) - 1)
    return tai_from_utc(f"{midnight.isoformat()}T00:00:00Z") + (day - int(day)) * DAY_S
