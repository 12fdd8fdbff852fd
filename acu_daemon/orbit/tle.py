"""Two-line element sets, with or without name lines, checked before SGP4 sees them.

Columns: Spacetrack Report #3 and CelesTrak's format description; catalogue numbers from 100000 on in Alpha-5.

Taken as people have them: any line ends, a byte order mark, blanks around a line or tabs in it, names that look like
element lines ("2 PATHFINDER"), `0` before a name or alone, text around the sets, small letters, blanks in place of
zeros, columns after the 69th, and sets without checksums (with a note).  A wrong checksum is refused.
"""

import re
from dataclasses import dataclass
from datetime import date, timedelta
from functools import lru_cache

from acu_daemon.orbit.element_set import ElementSet, Problem, rad_s_from_rev_day
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, DEG

_LENGTH = 69
_LEAST = {"1": 61, "2": 63}  # columns that SGP4 needs: up to B*, up to the mean motion
_BLANK_COLUMNS = {"1": (2, 9, 18, 33, 44, 53, 62, 64), "2": (2, 8, 17, 26, 34, 43, 52)}  # counted from 1
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)", re.ASCII)
_EXPONENT = re.compile(r"([+-]?) *(\d{1,6})([+ -]\d)", re.ASCII)
_NUMBERED = re.compile(r"[12] [ 0-9A-Za-z][ 0-9]{3}[0-9]([A-Za-z ]?$|[A-Za-z ] )", re.ASCII)
_WHOLE_FROM = 40  # a longer line is no name
_LEAST_DIGITS = 20  # of a whole line: a template of the format has fewer
ALPHA_5 = "ABCDEFGHJKLMNPQRSTUVWXYZ"
_SGP4_XP = "4"
_VALUES = bytes(c - 48 if 48 <= c <= 57 else c == 45 for c in range(256))  # of a character, for the checksum
_TYPED = str.maketrans(
    {"\ufeff": "", "\xa0": " ", "\x1a": " ", "\u2212": "-", "\u2013": "-"}
)  # by editors, web pages, DOS
_NO_CHECKSUM = "no checksum at the ends of the lines: damage would not be noticed"


@dataclass(frozen=True, slots=True)
class _Line:
    number: int  # in the file, from 1
    text: str
    kind: str  # "1" or "2" of an element set, "N": a name or other text

    @property
    def is_weak(self) -> bool:
        """Whether it may be a name all the same: too short for an element line."""
        return len(self.text) < _WHOLE_FROM


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
        line = lines[i]
        if i + 1 < len(lines) and _is_pair(line, lines[i + 1]) and not _is_name_of_next(lines, i):
            _read(line, lines[i + 1], _plain_name(name), file, sets, problems)
            name, i = None, i + 2
            continue
        if name is not None:
            problems.append(_stray(name, file))
        is_name = line.kind == "N" or _is_name_of_next(lines, i)
        if not is_name:
            problems.append(_half(line, _plain_name(name), file))
        name = line if is_name else None
        i += 1
    if name is not None:
        problems.append(_stray(name, file))
    return sets, problems


def _read(one: _Line, two: _Line, name: str, file: str, sets: list[ElementSet], problems: list[Problem]) -> None:
    try:
        sets.append(_element_set(one, two, name, file))
    except _BadLineError as error:
        problems.append(Problem(file, error.line.number, str(error), norad_ids=_numbers(one, two), name=name))
        return
    if len(one.text) < _LENGTH or len(two.text) < _LENGTH:
        numbers = (sets[-1].norad_id,)
        problems.append(Problem(file, one.number, _NO_CHECKSUM, norad_ids=numbers, name=name, kind="note"))


def _stray(line: _Line, file: str) -> Problem:
    reason = f"{line.text[:40]!r} is neither an element line nor the name of a set below it"
    return Problem(file, line.number, reason, name=_plain_name(line), kind="text")


def _half(line: _Line, name: str, file: str) -> Problem:
    reason = f"line {line.kind} of an element set without the other line"
    return Problem(file, line.number, reason, norad_ids=_numbers(line), name=name)


def _plain_name(line: _Line | None) -> str:
    """The name without the `0` that the three-line form puts before it."""
    return "" if line is None or line.text == "0" else line.text.removeprefix("0 ").strip()


def _numbers(*lines: _Line) -> tuple[int, ...]:
    found = (catalogue_number(line.text[2:7].strip().upper()) for line in lines)
    return tuple(number for number in found if number is not None)


def _content_lines(text: str) -> list[_Line]:
    text = text.replace("\r\n", "\n").replace("\r", "\n").translate(_TYPED)
    lines = []
    for number, raw in enumerate(text.split("\n"), start=1):
        line = raw.strip()
        if line and not line.startswith("#"):
            if "\t" in line:
                line = _without_tabs(line)
            lines.append(_Line(number, line, _kind(line)))
    return lines


def _without_tabs(line: str) -> str:
    """Blanks in place of tabs: one each, or up to the next of the stops at every eighth column, as fits the columns."""
    forms = (line.replace("\t", " "), line.expandtabs(8))
    return next((form for form in forms if form[:1] in _BLANK_COLUMNS and not _form_problem(form)), forms[0])


def _kind(text: str) -> str:
    if text[:2] not in ("1 ", "2 "):
        return "N"
    if _NUMBERED.match(text) or (len(text) >= _WHOLE_FROM and sum(map(str.isdigit, text)) >= _LEAST_DIGITS):
        return text[0]
    return "N"


def _is_pair(line: _Line, following: _Line) -> bool:
    """Two lines of one set, in order or swapped (swapped only if of one satellite: else a line is missing)."""
    kinds = line.kind + following.kind
    return kinds == "12" or (kinds == "21" and line.text[2:7] == following.text[2:7])


def _is_name_of_next(lines: list[_Line], i: int) -> bool:
    """Whether what looks like the begin of an element line stands as a name above a whole set."""
    if not lines[i].is_weak or i + 2 >= len(lines):
        return False
    one, two = lines[i + 1], lines[i + 2]
    return one.kind + two.kind == "12" and not one.is_weak and not two.is_weak


def _element_set(one: _Line, two: _Line, name: str, file: str) -> ElementSet:
    if one.kind == "2":
        raise _BadLineError(one, "the two lines are swapped: line 2 stands before line 1")
    _check_form(one, two)
    norad_id = _catalogue_number(one)
    if norad_id != _catalogue_number(two):
        raise _BadLineError(
            two, f"catalogue number {two.text[2:7]} does not match {one.text[2:7]} of line {one.number}"
        )
    if one.text[62:63] == _SGP4_XP:
        raise _BadLineError(one, "ephemeris type 4 (SGP4-XP) needs a propagator of its own; get SGP4 elements (type 0)")
    rev_day = _number(two, 53, 63, "mean motion")
    if rev_day <= 0.0:
        raise _BadLineError(two, f"mean motion {rev_day} revolutions a day; it must be positive")
    inclination_deg = _number(two, 9, 16, "inclination")
    if not 0.0 <= inclination_deg <= 180.0:
        raise _BadLineError(two, f"inclination {inclination_deg} deg; it must lie in 0..180")
    return ElementSet(
        kind="tle",
        name=name,
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


def _check_form(one: _Line, two: _Line) -> None:
    """With a checksum or, cut at the end, without; one line of 68 characters may have lost any one of them."""
    are_both_cut = len(one.text) < _LENGTH and len(two.text) < _LENGTH
    for line in (one, two):
        is_cut = len(line.text) < (_LENGTH if are_both_cut else _LENGTH - 1)
        if len(line.text) < (_LEAST[line.kind] if is_cut else _LENGTH):
            raise _BadLineError(line, f"{len(line.text)} characters, an element line has {_LENGTH}")
        if problem := _form_problem(line.text):
            raise _BadLineError(line, problem)


def _form_problem(text: str) -> str:
    """What is wrong with the form of a line, empty where nothing is; the checksum only where there is one."""
    if not text.isascii() or not text.isprintable():
        return "a character that is not printable ASCII"
    if len(text) > _LENGTH and text[_LENGTH] != " ":
        return f"{len(text)} characters, an element line has {_LENGTH}"
    if len(text) >= _LENGTH:
        expected = sum(text[: _LENGTH - 1].encode().translate(_VALUES)) % 10
        if text[_LENGTH - 1] != str(expected):
            given = text[_LENGTH - 1]
            return f"checksum {given}, computed {expected}: the line was changed; fetch it anew"
    filled = [column for column in _BLANK_COLUMNS[text[0]] if text[column - 1 : column] not in (" ", "")]
    return f"column {filled[0]} must be blank: the numbers are not in their columns" if filled else ""


def catalogue_number(text: str) -> int | None:
    """Read a NORAD number: digits, or Alpha-5 (a letter but I and O, then four digits); None if it is neither."""
    if text.isascii() and text.isdigit() and len(text) <= 9:
        return int(text)
    if len(text) == 5 and text[0] in ALPHA_5 and text[1:].isascii() and text[1:].isdigit():
        return (ALPHA_5.index(text[0]) + 10) * 10000 + int(text[1:])
    return None


def _catalogue_number(line: _Line) -> int:
    field = line.text[2:7].strip()
    number = catalogue_number(field.upper())
    if number is None:
        raise _BadLineError(line, f"catalogue number {field!r}: five digits, or a letter (not I, O) and four digits")
    return number


def _number(line: _Line, first: int, last: int, what: str) -> float:
    field = line.text[first - 1 : last].strip()
    if _NUMBER.fullmatch(field) is None:
        raise _BadLineError(line, f"{what} (columns {first}-{last}) is {field!r}, not a number")
    return float(field)


def _digits(line: _Line, first: int, last: int, what: str) -> int:
    """Digits; blanks among them are zeros, as Fortran wrote them."""
    given = line.text[first - 1 : last]
    field = given.replace(" ", "0") if given.strip() else ""
    if not (field.isascii() and field.isdigit()):
        raise _BadLineError(line, f"{what} (columns {first}-{last}) is {given!r}, not {last - first + 1} digits")
    return int(field)


def _exponent(line: _Line, first: int, last: int, what: str) -> float:
    """A field like ` 28098-4`: a decimal point before the digits, a power of ten after them."""
    field = line.text[first - 1 : last].strip()
    match = _EXPONENT.fullmatch(field)
    if match is None:
        raise _BadLineError(line, f"{what} (columns {first}-{last}) is {field!r}, not like 12345-3")
    return float(f"{match[1]}.{match[2]}e{match[3].strip()}")


def _epoch_tai_s(line: _Line) -> float:
    year = _digits(line, 19, 20, "epoch year")
    year += 1900 if year >= 57 else 2000
    day = _number(line, 21, 32, "epoch day")
    if not 1.0 <= day < 366.0 + (date(year, 12, 31).timetuple().tm_yday == 366):
        raise _BadLineError(line, f"epoch day {day} is no day of {year}")
    return _midnight_tai_s(year, int(day)) + (day - int(day)) * DAY_S


@lru_cache(maxsize=4096)
def _midnight_tai_s(year: int, day: int) -> float:
    midnight = date(year, 1, 1) + timedelta(days=day - 1)
    return tai_from_utc(f"{midnight.isoformat()}T00:00:00Z")
