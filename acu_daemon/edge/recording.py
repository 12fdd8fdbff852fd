"""Readings CSV: written by `run --record`, read by `replay`."""

import contextlib
import errno
import math
import os
import stat
from collections.abc import Callable
from functools import partial
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any

import structlog

from acu_daemon.edge.writer import Writer
from acu_daemon.errors import UsageError
from acu_daemon.model import Reading
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

HEADER = ["utc", "az_deg", "el_deg", "locked"]
SET_BACK_US = 1e6
SYNC_S = 1.0  # a line is on the disk no later than this after its reading, while readings come
_HEADER_LINE = ",".join(HEADER) + "\n"
_TAIL_BYTES = 4096  # the last line lies within


class RecordingWriter:
    """Adds readings to a CSV file, whole lines only, each at once, synced to the disk once a second.

    With a writer the loop never waits for the disk.  Where a write fails (a full disk) lines are left out until one
    succeeds again, with a log line at each edge; a failed write never stops a pass.  A recording that exists already is
    continued, as after a restart.  Times must rise in a file: where the clock was set back, another is begun beside it.
    """

    def __init__(self, path: Path, writer: Writer | None = None, now_tai_s: float = math.inf) -> None:
        """Open the file.  UsageError: it cannot be, or holds something else, or readings later than now_tai_s.

        Where the disk has no room for another file, the first reading tries again.
        """
        self._path = path
        self._writer = writer
        self._fd = -1
        self._is_file = True
        self._last_us = self._synced_tai_s = -math.inf
        self._lost_count = 0
        self._failure = ""
        self._has_header = False
        self._log: Any = structlog.get_logger("record")
        try:
            self._open()
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise UsageError(f"--record {path}: {error.strerror}") from None
            return
        try:
            last_tai_s = self._continue(now_tai_s) if self._is_file else None
        except BaseException:
            os.close(self._fd)
            raise
        self._last_us = -math.inf if last_tai_s is None else round(last_tai_s * 1e6)
        self._has_header = self._is_file and os.fstat(self._fd).st_size > 0
        if not self._has_header:
            with contextlib.suppress(OSError):  # the first reading tries again
                self._append(_HEADER_LINE)
                self._has_header = True

    def _open(self) -> None:
        self._fd = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        self._is_file = stat.S_ISREG(os.fstat(self._fd).st_mode)

    @property
    def problem(self) -> str:
        """Why the newest line could not be written; "": it was."""
        return f"{self._path.name}: {self._failure}" if self._failure else ""

    def add(self, reading: Reading) -> None:
        """Write one reading; a reading not later than the one before is left out, since times must rise."""
        time_us = round(reading.tai_s * 1e6)
        if self._last_us - time_us > SET_BACK_US:
            self._do(self._begin_beside)
        elif time_us <= self._last_us:
            return
        self._last_us = time_us
        utc = utc_text(reading.tai_s, 6)
        line = f"{utc},{reading.az_deg:.5f},{reading.el_deg:.5f},{int(reading.is_locked)}\n"
        if not self._do(partial(self._write, line, reading.tai_s)):
            self._lose("the disk does not keep up")

    def _do(self, job: Callable[[], None]) -> bool:
        """Have it done, in order.  False: dropped."""
        if self._writer is not None:
            return self._writer.put(job)
        job()
        return True

    def _begin_beside(self) -> None:
        old = self._path
        names = (old.with_name(f"{old.stem}-{number}{old.suffix}") for number in count(2))
        self._path = next(name for name in names if not name.exists())
        self._log.warning("record.beside", file=str(self._path), reason=f"the clock was set back, {old.name} ends")
        self._close()
        self._fd, self._has_header, self._synced_tai_s = -1, False, -math.inf

    def _write(self, line: str, tai_s: float) -> None:
        try:
            self._append(line if self._has_header else _HEADER_LINE + line)
            if tai_s - self._synced_tai_s >= SYNC_S:
                self._synced_tai_s = tai_s
                self._sync()
        except OSError as error:
            self._lose(error.strerror or str(error))
            return
        self._has_header = True
        if self._failure:
            self._log.info("record.resumed", file=str(self._path), lost_count=self._lost_count)
            self._lost_count, self._failure = 0, ""

    def _lose(self, reason: str) -> None:
        if not self._failure:
            self._log.warning("record.failed", file=str(self._path), reason=reason)
        self._lost_count += 1
        self._failure = reason

    def _append(self, text: str) -> None:
        """Append whole lines, or nothing.  OSError: nothing."""
        data = text.encode("ascii")
        if self._fd < 0:
            self._open()
        size = os.fstat(self._fd).st_size
        try:
            while data:  # after a part of it, the next one says why
                data = data[os.write(self._fd, data) :]
        except OSError:
            if self._is_file:
                os.ftruncate(self._fd, size)
            raise

    def _sync(self) -> None:
        if self._is_file:
            os.fdatasync(self._fd)

    def _continue(self, now_tai_s: float) -> float | None:
        """Check what the file holds, cut a torn last line off, and return the time of its last reading."""
        size = os.fstat(self._fd).st_size
        head = os.pread(self._fd, len(_HEADER_LINE) + 4, 0).decode("ascii", "replace").replace("\r", "")
        if not head.startswith(_HEADER_LINE):
            if _HEADER_LINE.startswith(head):  # empty, or torn in its first line
                os.ftruncate(self._fd, 0)
                return None
            raise UsageError(
                f"--record {self._path}: this file is no recording and is left alone: choose another, or move it away"
            )
        tail = os.pread(self._fd, _TAIL_BYTES, max(0, size - _TAIL_BYTES))
        whole, _, torn = tail.rpartition(b"\n")
        if torn:
            os.ftruncate(self._fd, size - len(torn))
            structlog.get_logger("record").warning("record.torn", file=str(self._path), bytes=len(torn))
        last = whole.rpartition(b"\n")[2].decode("ascii", "replace")
        if last.rstrip() == ",".join(HEADER):
            return None
        try:
            _, _, last_tai_s = _row(last.split(","))
        except ValueError as error:
            raise UsageError(f"--record {self._path}: its last line is no reading ({error}): choose another") from None
        if last_tai_s > now_tai_s:
            raise UsageError(
                f"--record {self._path}: its last reading, {utc_text(last_tai_s, 0)}, is later than now, "
                f"{utc_text(now_tai_s, 0)}, and times must rise: choose another, or move it away"
            )
        return last_tai_s

    def close(self) -> None:
        """Sync and close, after what still waits; with a writer it is done when that is closed."""
        if self._writer is None:
            self._close()
        else:
            self._writer.put(self._close)

    def _close(self) -> None:
        if self._fd < 0:
            return
        with contextlib.suppress(OSError):  # of a failed recording
            self._sync()
        os.close(self._fd)

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_readings(path: Path, warn: Callable[[str], None] = lambda _: None) -> list[tuple[str, Reading | None, float]]:
    """Read a readings CSV: for each line its UTC text, the reading (None where the angles are empty), and its TAI.

    A last line that lacks its end and makes no sense was torn, as by a loss of power: `warn` is told, and it is left
    out.
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
            if number == len(lines) + 1:  # no line end after it
                warn(f"{path}, line {number}: torn, and left out")
                break
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
