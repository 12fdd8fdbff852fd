"""Earth orientation of a date out of the files of the IERS: finals2000A and C04.  Pure.

finals2000A (.all, .data, .daily): fixed columns, Bulletin A's values, measured (I) or predicted (P) for a year ahead.
C04 (eopc04, of series 05, 08, 14 and 20): numbers between blanks, measured, about a month behind; series 20 has the
hour between date and MJD.  Both give the values of 0h UTC of each day.

UT1-TAI and the pole are linear between the days (0.1 ms, 0.0005 arcsec; the tides of a day and less, as much again, are
left out), UT1-UTC gets its leap seconds from acu_daemon.orbit.timescales.  0.1 ms of UT1 is 4e-7 deg.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from math import isfinite

import numpy as np

from acu_daemon.errors import EarthOrientationError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.timescales import tai_from_unix, unix_from_tai, utc_text
from acu_daemon.units import DAY_S, Array

_MJD_UNIX = 40587  # 1970-01-01
_MJD_UTC_BEGINS = 41317  # 1972-01-01: before, UTC had no whole seconds
_MJD_J2000 = 51544.5
_UT1_DEG_PER_S = 360.0 / DAY_S
_UT1_DRIFT_S_PER_DAY = 1e-3  # the usual excess of the day; what held values lose
_MOST_HELD_ERROR_S = 1.8  # leap seconds keep UT1-UTC within 0.9 s
_MOST_UT1_UTC_S, _MOST_POLE_ARCSEC = 0.95, 1.5


@dataclass(frozen=True, slots=True)
class _Day:
    mjd: int
    x_arcsec: float
    y_arcsec: float
    ut1_utc_s: float
    is_measured: bool


@dataclass(frozen=True, slots=True, eq=False)
class EarthOrientationTable:
    """Values at 0h UTC, rising in time: tai_s, ut1_tai_s, x_arcsec, y_arcsec, each (N,).

    The first measured_count of them are measured, the rest predicted.  name: of the file, for people.
    """

    name: str
    tai_s: Array
    ut1_tai_s: Array
    x_arcsec: Array
    y_arcsec: Array
    measured_count: int

    def at(self, tai_s: float) -> EarthOrientation:
        """Give the orientation of a time; beyond the table's ends the UT1-UTC and pole of its first or last day."""
        within_s = min(max(tai_s, float(self.tai_s[0])), float(self.tai_s[-1]))
        ut1_utc_s = float(np.interp(within_s, self.tai_s, self.ut1_tai_s)) + _tai_minus_utc_s(within_s)
        x_arcsec, y_arcsec = (float(np.interp(within_s, self.tai_s, one)) for one in (self.x_arcsec, self.y_arcsec))
        return EarthOrientation(ut1_utc_s, x_arcsec, y_arcsec)

    def warning(self, tai_s: float) -> str | None:
        """Say that a time lies beyond the table, and what that costs; None inside."""
        first_s, last_s = float(self.tai_s[0]), float(self.tai_s[-1])
        if first_s <= tai_s <= last_s:
            return None
        away_days = max(first_s - tai_s, tai_s - last_s) / DAY_S
        off_s = min(_UT1_DRIFT_S_PER_DAY * away_days, _MOST_HELD_ERROR_S)
        edge, side, used = ("begins", "after", "first") if tai_s < first_s else ("ends", "before", "last")
        return (
            f"{self.name}: Earth orientation {edge} on {_day_text(first_s if tai_s < first_s else last_s)}, "
            f"{away_days:.0f} days {side} {_day_text(tai_s)}; its {used} values are used: UT1-UTC may be off by "
            f"{off_s:.2g} s, {off_s * _UT1_DEG_PER_S:.1g} deg of azimuth. Get a newer finals2000A from the IERS"
        )

    def about(self, now_tai_s: float) -> str:
        """Say how old the values are."""
        measured_s = float(self.tai_s[max(self.measured_count - 1, 0)])
        age_days = (now_tai_s - measured_s) / DAY_S
        until = f", predicted to {_day_text(float(self.tai_s[-1]))}" if self.measured_count < self.tai_s.size else ""
        age = f"{age_days:.0f} days ago" if age_days >= 0.0 else f"{-age_days:.0f} days from now"
        return f"{self.name}: Earth orientation measured to {_day_text(measured_s)} ({age}){until}"


def parse_earth_orientation(text: str, name: str) -> EarthOrientationTable:
    """Read a finals2000A or a C04 file, told apart by its lines.

    Raises:  EarthOrientationError: names file, line and what was expected.
    """
    days = [day for day in _days(text, name) if day.mjd >= _MJD_UTC_BEGINS]
    if not days:
        raise EarthOrientationError(
            f"{name}: no Earth orientation: expected a finals2000A or an eopc04 file of the IERS"
        )
    tai_s = np.array([tai_from_unix((day.mjd - _MJD_UNIX) * DAY_S) for day in days])
    ut1_utc_s = np.array([day.ut1_utc_s for day in days])
    ahead_s = np.array([_tai_minus_utc_s(one) for one in tai_s.tolist()])
    measured_count = next((i for i, day in enumerate(days) if not day.is_measured), len(days))
    return EarthOrientationTable(
        name,
        tai_s,
        ut1_utc_s - ahead_s,
        np.array([day.x_arcsec for day in days]),
        np.array([day.y_arcsec for day in days]),
        measured_count,
    )


def _days(text: str, name: str) -> Iterator[_Day]:
    """The days of a file, checked one by one and against the one before."""
    last_mjd = 0
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            day = _c04_day(line) if _is_c04(line) else _finals_day(line)
            if day is None:
                continue
            _check(day, last_mjd)
        except ValueError as problem:
            raise EarthOrientationError(f"{name}, line {number}: {problem}: {line.strip()[:60]!r}") from None
        last_mjd = day.mjd
        yield day


def _is_c04(line: str) -> bool:
    return len(line) > 40 and line[:4].strip().isdigit() and len(line[:4].strip()) == 4 and line[4:8].strip().isdigit()


def _c04_day(line: str) -> _Day:
    """Year, month, day, in series 20 the hour, MJD, x, y (arcsec), UT1-UTC (s)."""
    fields = line.split()
    mjd = _mjd(date(int(fields[0]), int(fields[1]), int(fields[2])))
    after = next((i for i in (3, 4) if float(fields[i]) == mjd), None)
    if after is None:
        raise ValueError(f"no Modified Julian Date {mjd} of 0h after the date")
    if len(fields) < after + 5:
        raise ValueError("a line that is cut")
    x_arcsec, y_arcsec, ut1_utc_s = (float(field) for field in fields[after + 1 : after + 4])
    return _Day(mjd, x_arcsec, y_arcsec, ut1_utc_s, True)


def _finals_day(line: str) -> _Day | None:
    """Columns (from 1) 1-6 date, 8-15 MJD, 17 and 58 I or P, 19-27 x, 38-46 y, 59-68 UT1-UTC; None: no values yet."""
    flag, ut1 = line[57:58], line[58:68]
    if not line[:2].strip().isdigit() or not line[7:15].strip():
        return None
    mjd = float(line[7:15])
    year = int(line[0:2])
    if mjd != _mjd(date(year + (1900 if year >= 73 else 2000), int(line[2:4]), int(line[4:6]))):
        raise ValueError(f"the Modified Julian Date {mjd:g} is not 0h of the date")
    if not ut1.strip():
        return None
    if len(ut1) < 10:
        raise ValueError("a line that is cut")
    if flag not in "IP" or line[16:17] not in "IP":
        raise ValueError("neither I nor P in columns 17 and 58")
    is_measured = flag == "I" and line[16:17] == "I"
    return _Day(int(mjd), float(line[18:27]), float(line[37:46]), float(ut1), is_measured)


def _check(day: _Day, last_mjd: int) -> None:
    if day.mjd <= last_mjd:
        raise ValueError("not later than the line before")
    pole = max(abs(day.x_arcsec), abs(day.y_arcsec))
    if not (isfinite(pole + day.ut1_utc_s) and abs(day.ut1_utc_s) < _MOST_UT1_UTC_S and pole < _MOST_POLE_ARCSEC):
        raise ValueError("no possible pole or UT1-UTC")


def _mjd(day: date) -> int:
    return day.toordinal() - date(1858, 11, 17).toordinal()


def _tai_minus_utc_s(tai_s: float) -> float:
    """TAI-UTC; unix_from_tai counts from 1970, and 2000-01-01T12:00:00 is 946728000."""
    return tai_s - (unix_from_tai(tai_s) - (_MJD_J2000 - _MJD_UNIX) * DAY_S)


def _day_text(tai_s: float) -> str:
    return utc_text(tai_s, 0)[:10]
