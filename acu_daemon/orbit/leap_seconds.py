"""Leap seconds out of the system's leap-seconds.list, the file of NIST and IERS that NTP and tzdata bring.  Pure.

Lines: `#$` when it was made, `#@` when it expires, `#h` SHA-1 over the digits of these and of the data, each in seconds
since 1900 (NTP); data: `<seconds> <TAI-UTC from then on> # <date>`.
"""

import re
from dataclasses import dataclass
from datetime import date, timedelta
from hashlib import sha1

from acu_daemon.errors import EarthOrientationError
from acu_daemon.orbit.timescales import LEAP_DATES, tai_from_unix, utc_text
from acu_daemon.units import DAY_S

_UNIX_NTP_S = 2208988800  # 1970-01-01 since 1900-01-01
_FIRST_TAI_UTC_S = 10
_DATA = re.compile(r"(\d+)\s+(\d+)\s*(?:#.*)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class LeapSecondList:
    """dates: TAI-UTC is 10 s from the first, one second more from each later one; expires_tai_s: None if not said."""

    dates: tuple[date, ...]
    expires_tai_s: float | None

    def is_newer(self) -> bool:
        """Whether it has leap seconds that the built-in table has not."""
        return len(self.dates) > len(LEAP_DATES)

    def warning(self, now_tai_s: float) -> str | None:
        """Say that the list has expired, and what that may cost; None while it holds, or if it does not say."""
        if self.expires_tai_s is None or now_tai_s < self.expires_tai_s:
            return None
        days = (now_tai_s - self.expires_tai_s) / DAY_S
        return (
            f"the list of leap seconds expired on {utc_text(self.expires_tai_s, 0)[:10]}, {days:.0f} days ago: a leap "
            "second announced since would put all times off by 1 s. Update tzdata"
        )


def parse_leap_seconds(text: str, name: str) -> LeapSecondList:
    """Read a leap-seconds.list.

    Raises:  EarthOrientationError: names file, line and reason; also where it contradicts the built-in table.
    """
    marks: dict[str, str] = {}
    dates: list[date] = []
    digits = ""
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip()
        if stripped[:2] in ("#$", "#@", "#h"):
            marks[stripped[1]] = stripped[2:].strip()
        if not stripped or stripped.startswith("#"):
            continue
        match = _DATA.fullmatch(stripped)
        day = _date_of(int(match[1])) if match else None
        if match is None or day is None or int(match[2]) != _FIRST_TAI_UTC_S + len(dates):
            raise EarthOrientationError(
                f"{name}, line {number}: expected seconds since 1900 at 0h, and TAI-UTC one second above the last: "
                f"{stripped[:60]!r}"
            )
        dates.append(day)
        digits += match[1] + match[2]
    _check_hash(marks, digits, name)
    shared = min(len(dates), len(LEAP_DATES))
    if not dates or tuple(dates[:shared]) != LEAP_DATES[:shared]:
        raise EarthOrientationError(f"{name}: not a list of leap seconds: it contradicts those up to {LEAP_DATES[-1]}")
    expires = marks.get("@")
    return LeapSecondList(tuple(dates), tai_from_unix(int(expires) - _UNIX_NTP_S) if expires else None)


def _date_of(ntp_s: int) -> date | None:
    days, rest_s = divmod(ntp_s, int(DAY_S))
    return None if rest_s or days > 100_000 else date(1900, 1, 1) + timedelta(days=days)


def _check_hash(marks: dict[str, str], digits: str, name: str) -> None:
    """Compare the SHA-1, if there is one; its five words may lack leading zeros."""
    if "h" not in marks:
        return
    told = "".join(word.rjust(8, "0") for word in marks["h"].split())
    made = sha1((marks.get("$", "") + marks.get("@", "") + digits).encode(), usedforsecurity=False).hexdigest()
    if told != made:
        raise EarthOrientationError(f"{name}: damaged: its SHA-1 is not that of its data")
