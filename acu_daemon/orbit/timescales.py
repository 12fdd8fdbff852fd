"""Time scales: TAI seconds since 2000-01-01T12:00:00 TAI against UTC, POSIX time, Julian days and sidereal time.

UTC follows the leap seconds of IERS Bulletin C; the table ends with the leap second of 2016-12-31, the last one
announced by 2026, and a newer one may be adopted.  Before 1972 TAI-UTC is taken as 10 s.
"""

import re
from bisect import bisect_right
from collections.abc import Sequence
from datetime import date, timedelta
from math import pi

import numpy as np

from acu_daemon.units import DAY_S, Array

_LEAP_TEXTS = (
    *("1972-01-01", "1972-07-01", "1973-01-01", "1974-01-01", "1975-01-01", "1976-01-01", "1977-01-01"),
    *("1978-01-01", "1979-01-01", "1980-01-01", "1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01"),
    *("1988-01-01", "1990-01-01", "1991-01-01", "1992-07-01", "1993-07-01", "1994-07-01", "1996-01-01"),
    *("1997-07-01", "1999-01-01", "2006-01-01", "2009-01-01", "2012-07-01", "2015-07-01", "2017-01-01"),
)
LEAP_DATES = tuple(date.fromisoformat(text) for text in _LEAP_TEXTS)
# TAI-UTC becomes 10 s on the first date and one more on each later one; source: IERS Bulletin C

_DAY_S = 86400
_J2000_ORDINAL = date(2000, 1, 1).toordinal()
_J2000_UNIX_S = 946728000  # 2000-01-01T12:00:00Z as POSIX time
_J2000_JD = 2451545.0
_UTC_TEXT = re.compile(r"(\d{4})-(\d\d)-(\d\d)T(\d\d):(\d\d):(\d\d)(\.\d{1,12})?Z", re.ASCII)
_CCSDS_TEXT = re.compile(
    r"(\d{4})-(?:(\d\d-\d\d)|(\d{3}))(?:T| +)(\d\d:\d\d)(?::(\d\d)(?:\.(\d*))?)?(?: ?(?:Z|UTC)|[+-]00:?00)?", re.ASCII
)
_UNIFORM_MINUS_TAI_S = {"TAI": 0.0, "TT": 32.184, "GPS": -19.0}
TIME_SYSTEMS = ("UTC", *_UNIFORM_MINUS_TAI_S)
_EXPECTED = "expected UTC as YYYY-MM-DDThh:mm:ss[.fff]Z"


def _midnight_s(day: date) -> int:
    """Seconds from 2000-01-01T12:00:00 to the day's begin, every day counted as 86400 s."""
    return (day.toordinal() - _J2000_ORDINAL) * _DAY_S - _DAY_S // 2


def adopt_leap_dates(dates: Sequence[date]) -> None:
    """Take these in place of LEAP_DATES, for all functions here: once, when a process starts, before any time is read.

    dates: as LEAP_DATES, and the later ones that a leap-seconds.list has (acu_daemon.orbit.leap_seconds).  What a
    process has read before would keep the old leap seconds, and each process adopts them for itself.
    """
    global _DATES, _STEPS_UTC_S, _STEPS_TAI_S, _STEPS_TAI_ARRAY, _LEAP_SECONDS_TAI_S
    _DATES = tuple(dates)
    _STEPS_UTC_S = [_midnight_s(day) for day in dates]
    _STEPS_TAI_S = [utc_s + 10 + i for i, utc_s in enumerate(_STEPS_UTC_S)]
    _STEPS_TAI_ARRAY = np.array(_STEPS_TAI_S, dtype=np.float64)
    _LEAP_SECONDS_TAI_S = frozenset(tai_s - 1 for tai_s in _STEPS_TAI_S[1:])


def leap_dates() -> tuple[date, ...]:
    """Give those in force, for another process to adopt."""
    return _DATES


_DATES: tuple[date, ...]
_STEPS_UTC_S: list[int]
_STEPS_TAI_S: list[int]
_STEPS_TAI_ARRAY: Array
_LEAP_SECONDS_TAI_S: frozenset[int]
adopt_leap_dates(LEAP_DATES)


def _tai_minus_utc_s(utc_s: float) -> int:
    return 10 + max(0, bisect_right(_STEPS_UTC_S, utc_s) - 1)


def tai_from_utc(text: str) -> float:
    """Read ISO 8601 UTC with Z, fractions allowed; 23:59:60Z where a leap second was.

    Raises:  ValueError: says what was expected.
    """
    match = _UTC_TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r}: {_EXPECTED}")
    year, month, day, hour, minute, second = (int(group) for group in match.groups()[:6])
    fraction_s = float(match[7] or 0.0)
    is_leap = (hour, minute, second) == (23, 59, 60)
    if hour > 23 or minute > 59 or (second > 59 and not is_leap):
        raise ValueError(f"{text!r}: no such time of day, {_EXPECTED}")
    try:
        midnight_s = _midnight_s(date(year, month, day))
    except ValueError:
        raise ValueError(f"{text!r}: no such date, {_EXPECTED}") from None
    if is_leap and midnight_s + _DAY_S not in _STEPS_UTC_S[1:]:
        raise ValueError(f"{text!r}: that day had no leap second")
    whole_s = midnight_s + 3600 * hour + 60 * minute + second
    return whole_s + _tai_minus_utc_s(midnight_s) + fraction_s


def tai_from_ccsds(text: str, system: str = "UTC") -> float:
    """Read a time of a CCSDS message, of one of TIME_SYSTEMS, as people write it.

    YYYY-MM-DDThh:mm:ss[.fff][Z] or YYYY-DDDThh:mm:ss[.fff][Z], a blank for the T, no seconds, small letters.
    Raises:  ValueError: says what was expected.
    """
    match = _CCSDS_TEXT.fullmatch(text.strip().upper())
    if match is None:
        raise ValueError(f"{text[:40]!r}: expected a time as YYYY-MM-DDThh:mm:ss[.fff] or YYYY-DDDThh:mm:ss[.fff]")
    day = f"{match[1]}-{match[2]}" if match[2] else _calendar(int(match[1]), int(match[3]))
    tai_s = tai_from_utc(f"{day}T{match[4]}:{match[5] or '00'}.{(match[6] or '0')[:12]}Z")
    if system == "UTC":
        return tai_s
    as_uniform_s = unix_from_tai(tai_s) - unix_from_tai(tai_from_utc("2000-01-01T12:00:00Z"))
    return as_uniform_s - _UNIFORM_MINUS_TAI_S[system]


def _calendar(year: int, day: int) -> str:
    """The date of a day of the year.  ValueError: no such day."""
    try:
        found = date(year, 1, 1) + timedelta(days=day - 1)
    except (ValueError, OverflowError):
        raise ValueError("no such date") from None
    if found.year != year:
        raise ValueError(f"{year} has no day {day}")
    return found.isoformat()


def tai_from_unix(unix_s: float) -> float:
    """Turn POSIX time into TAI."""
    utc_s = unix_s - _J2000_UNIX_S
    return utc_s + _tai_minus_utc_s(utc_s)


def unix_from_tai(tai_s: float) -> float:
    """Turn TAI into POSIX time; a leap second has the POSIX time of the second after it."""
    return tai_s - max(10, 9 + bisect_right(_STEPS_TAI_S, tai_s)) + _J2000_UNIX_S


def utc_text(tai_s: float, digits: int = 3) -> str:
    """Print TAI as ISO 8601 UTC, rounded to `digits` decimals of a second; a leap second reads 23:59:60."""
    scale = 10**digits
    whole_s, fraction = divmod(round(tai_s * scale), scale)
    is_leap = whole_s in _LEAP_SECONDS_TAI_S
    if is_leap:
        whole_s -= 1
    utc_s = whole_s - max(10, 9 + bisect_right(_STEPS_TAI_S, whole_s)) + _DAY_S // 2
    days, second_of_day = divmod(utc_s, _DAY_S)
    day = date(2000, 1, 1) + timedelta(days=days)
    minutes, second = divmod(second_of_day, 60)
    tail = f".{fraction:0{digits}d}" if digits else ""
    return f"{day.isoformat()}T{minutes // 60:02d}:{minutes % 60:02d}:{second + is_leap:02d}{tail}Z"


def _utc_s(tai_s: Array) -> Array:
    """UTC seconds since 2000-01-01T12:00:00, every day counted as 86400 s."""
    utc_s: Array = tai_s - np.maximum(10, 9 + _STEPS_TAI_ARRAY.searchsorted(tai_s, side="right"))
    return utc_s


def utc_days(tai_s: Array) -> tuple[Array, Array]:
    """Turn TAI into UTC Julian days.

    Returns: the day's begin (ends in .5) and the fraction of the day in [0, 1), of the shape of `tai_s`.
             A leap second repeats the fractions of the second after it.
    """
    utc_s = _utc_s(tai_s)
    days = np.floor(utc_s / DAY_S + 0.5) - 0.5
    return days + _J2000_JD, utc_s / DAY_S - days


def gmst_rad(tai_s: Array, ut1_utc_s: float) -> Array:
    """Greenwich mean sidereal time, radians in [0, 2 pi), of the shape of `tai_s`.

    Source:  IAU 1982 (Aoki et al., A&A 105, 359), as in Vallado, Fundamentals of Astrodynamics, eq 3-45.
    """
    ut1_days = (_utc_s(tai_s) + ut1_utc_s) / DAY_S
    t = ut1_days / 36525.0
    seconds = 67310.54841 + t * (8640184.812866 + t * (0.093104 - 6.2e-6 * t))
    turns: Array = (seconds / DAY_S + ut1_days % 1.0) % 1.0
    return 2.0 * pi * turns
