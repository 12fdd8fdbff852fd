"""Profiles of solar flux and Kp: the package's own, by name, or a CSV file `date,f107_sfu,kp`, a line a day."""

import csv
from collections.abc import Iterator
from datetime import date, timedelta
from importlib.resources import files
from pathlib import Path

import numpy as np

from acu_daemon.errors import UsageError
from acu_daemon.groundtrack.environment import Flux
from acu_daemon.orbit.timescales import tai_from_utc

PROFILES = ("moderate", "critical", "critical-physical")
HEADER = ["date", "f107_sfu", "kp"]
_LOWEST_SFU, _HIGHEST_SFU = -200.0, 500.0  # beyond: another unit, or a wrong column


def load_flux(name: str) -> Flux:
    """Read a profile.

    Raises:  UsageError: no such profile or file; a line that is no day after the one before; values out of all reason.
    """
    if name in PROFILES:
        return _parsed(files("acu_daemon.groundtrack").joinpath("profiles", f"{name}.csv").read_text("ascii"), name)
    path = Path(name)
    if not path.is_file():
        raise UsageError(f"--profile {name}: neither a file nor one of {', '.join(PROFILES)}")
    try:
        return _parsed(path.read_text("utf-8-sig"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"--profile {path}: {error}") from None


def _parsed(text: str, file: str) -> Flux:
    rows = list(_rows(text))
    if not rows or [one.strip() for one in rows[0][1]] != HEADER:
        raise UsageError(f"{file}: the header must be {','.join(HEADER)}")
    days: list[date] = []
    values: list[tuple[float, float]] = []
    for number, row in rows[1:]:
        where = f"{file}, line {number}"
        try:
            day, flux, kp = date.fromisoformat(row[0].strip()), float(row[1]), float(row[2])
        except (ValueError, IndexError):
            raise UsageError(f"{where}: expected {','.join(HEADER)} such as 2010-01-01,120.5,2.7") from None
        if days and day != days[-1] + timedelta(days=1):
            raise UsageError(f"{where}: {day} does not follow {days[-1]}; a flux is needed for every day")
        if not (_LOWEST_SFU <= flux <= _HIGHEST_SFU and 0.0 <= kp <= 9.0):
            raise UsageError(f"{where}: a flux of {flux:g} sfu with Kp {kp:g}; expected sfu (60 to 400) and Kp 0 to 9")
        days.append(day)
        values.append((flux, kp))
    if len(days) < 2:
        raise UsageError(f"{file}: no days below the header")
    table = np.array(values)
    return Flux(tai_from_utc(f"{days[0]}T00:00:00Z"), table[:, 0], table[:, 1])


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    for number, row in enumerate(csv.reader(text.splitlines()), start=1):
        if row and not row[0].startswith("#"):
            yield number, row
