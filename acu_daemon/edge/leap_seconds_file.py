"""The system's leap-seconds.list: adopted where it is newer than the built-in table, its expiry told."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf
from pathlib import Path

from acu_daemon.errors import EarthOrientationError
from acu_daemon.orbit.leap_seconds import LeapSecondList, parse_leap_seconds
from acu_daemon.orbit.timescales import LEAP_DATES, adopt_leap_dates, utc_text
from acu_daemon.units import DAY_S

USUAL_PATHS = (  # of tzdata, ntpsec, ntp, chrony's packages
    Path("/usr/share/zoneinfo/leap-seconds.list"),
    Path("/var/lib/ntp/leap-seconds.list"),
    Path("/etc/ntp/leap-seconds.list"),
    Path("/usr/share/ntp/leap-seconds.list"),
)
MOST_EXPIRED_S = 366 * DAY_S


@dataclass(frozen=True, slots=True)
class FoundList:
    """The list that expires last, of those that can be read."""

    path: Path
    list: LeapSecondList

    def about(self) -> str:
        """Say where it is, and to when it holds."""
        expires_tai_s = self.list.expires_tai_s
        holds = "no expiry said" if expires_tai_s is None else f"holds until {utc_text(expires_tai_s, 0)[:10]}"
        return f"{self.path}: to {self.list.dates[-1]}, {holds}"


def find_leap_seconds(paths: Iterable[Path] = USUAL_PATHS) -> tuple[FoundList | None, list[str]]:
    """Give the list, None where there is none, and what is wrong with those that cannot be used."""
    found: list[FoundList] = []
    wrong: list[str] = []
    for path in paths:
        try:
            text = path.read_text(encoding="ascii", errors="replace")
            found.append(FoundList(path, parse_leap_seconds(text, str(path))))
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            wrong.append(f"{path}: {error.strerror}")
        except EarthOrientationError as error:
            wrong.append(str(error))
    newest = max(found, key=lambda one: (len(one.list.dates), one.list.expires_tai_s or -inf), default=None)
    return newest, wrong


def adopt_system_leap_seconds(paths: Iterable[Path] = USUAL_PATHS) -> None:
    """Take the system's list where it has leap seconds that the built-in table has not: once, when a process starts."""
    found, _ = find_leap_seconds(paths)
    if found is not None and found.list.is_newer():
        adopt_leap_dates(found.list.dates)


def leap_seconds_told(now_tai_s: float, paths: Iterable[Path] = USUAL_PATHS) -> tuple[str, bool]:
    """Say what leap seconds are known from, and to when; and whether a person should see to it.

    A list is a year late with many a system that is kept well, and leap seconds are announced half a year ahead.
    """
    found, wrong = find_leap_seconds(paths)
    if found is None:
        told = f"built-in table, to {LEAP_DATES[-1]}; this system has no leap-seconds.list"
        return "; ".join([told, *wrong]), bool(wrong)
    expired = found.list.warning(now_tai_s)
    is_late = found.list.warning(now_tai_s - MOST_EXPIRED_S) is not None
    return "; ".join([found.about(), *([expired] if expired else []), *wrong]), is_late or bool(wrong)
