"""Readings CSV: written by `run --record`, read by `replay` (design section 8)."""

import contextlib
import math
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

import structlog

from acu_daemon.errors import UsageError
from acu_daemon.model import Reading
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

HEADER = ["utc", "az_deg", "el_deg", "locked"]


class RecordingWriter:
    """Writes readings to a CSV file; every line is complete, and flushed at least once a second.

    A write that fails (a full disk) ends the recording, with a log line, and never the pass.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._file = path.open("w", encoding="ascii", newline="")
        except OSError as error:
            raise UsageError(f"--record {path}: {error.strerror}") from None
        self._path = path
        self._last_us = -math.inf
        self._flushed_tai_s = -math.inf
        self.has_failed = False
        self._try(self._file.write, ",".join(HEADER) + "\n")

    def add(self, reading: Reading) -> None:
        """Write one reading; a reading not later than the one before is left out, since times must rise."""
        time_us = round(reading.tai_s * 1e6)
        if time_us <= self._last_us:
            return
        self._last_us = time_us
        utc = utc_text(reading.tai_s, 6)
        self._try(self._file.write, f"{utc},{reading.az_deg:.5f},{reading.el_deg:.5f},{int(reading.is_locked)}\n")
        if reading.tai_s - self._flushed_tai_s >= 1.0:
            self._flushed_tai_s = reading.tai_s
            self._try(self._file.flush)

    def _try(self, action: Callable[..., object], *arguments: str) -> None:
        if self.has_failed:
            return
        try:
            action(*arguments)
        except OSError as error:
            self.has_failed = True
            structlog.get_logger("record").warning("record.failed", file=str(self._path), reason=error.strerror)

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._try(self._file.flush)
        with contextlib.suppress(OSError):  # of a failed recording: what is still buffered cannot be written either
            self._file.close()


def read_readings(path: Path) -> list[tuple[str, Reading | None, float]]:
    """Read a readings CSV: for each line its UTC text, the reading (None where the angles are empty), and its TAI.

    Raises: UsageError: names file, line and what was expected.
    """
    try:
        header, *lines = path.read_text(encoding="utf-8-sig").split("\n")
    except OSError as error:
        raise UsageError(f"--readings {path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"--readings {path}: byte {error.start}: expected a CSV file in plain text") from None
    if header.rstrip() != ",".join(HEADER):
        raise UsageError(f"{path}, line 1: expected the header {','.join(HEADER)}, found {header.rstrip()[:60]!r}")
    result: list[tuple[str, Reading | None, float]] = []
    for number, line in enumerate(lines, start=2):
        if not line.strip():
            continue
        try:
            utc, reading, tai_s = _row(line.split(","))
        except ValueError as error:
            raise UsageError(f"{path}, line {number}: {error}") from None
        if result and tai_s <= result[-1][2]:
            raise UsageError(f"{path}, line {number}: {utc} is not later than the line before; times must rise")
        result.append((utc, reading, tai_s))
    return result


def _row(row: list[str]) -> tuple[str, Reading | None, float]:
    if len(row) != len(HEADER):
        raise ValueError(f"expected {len(HEADER)} fields, found {len(row)}")
    utc, az_text, el_text, locked = (field.strip() for field in row)
    tai_s = tai_from_utc(utc)
    if locked not in ("0", "1"):
        raise ValueError(f"locked = {locked!r}: expected 0 or 1")
    if locked == "0" and not (az_text and el_text):
        return utc, None, tai_s
    az_deg, el_deg = _angle("az_deg", az_text), _angle("el_deg", el_text)
    if not 0.0 <= az_deg <= 360.0:
        raise ValueError(f"az_deg = {az_text}: expected 0 to 360")
    if not -90.0 <= el_deg <= 180.0:
        raise ValueError(f"el_deg = {el_text}: expected -90 to 180")
    return utc, Reading(tai_s, az_deg % 360.0, el_deg, locked == "1"), tai_s


def _angle(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{name} = {text!r}: expected a number of degrees") from None
    if not math.isfinite(value):
        raise ValueError(f"{name} = {text}: expected a finite number")
    return value
