"""Readings CSV: written by `run --record`, read by `replay`."""

import contextlib
import errno
import fcntl
import math
import os
import stat
from collections.abc import Callable
from functools import partial
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any

import structlog

from acu_daemon.edge.recording_whose import Whose, names_for, save_whose, whose_path, why_not_here
from acu_daemon.edge.writer import Writer
from acu_daemon.errors import UsageError
from acu_daemon.model import Reading
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

HEADER = ["utc", "az_deg", "el_deg", "locked"]
SET_BACK_US = 1e6
MOST_NAMES = 1000  # of a recording: FILE.csv, FILE-2.csv and so on
SYNC_S = 1.0  # a line is on the disk no later than this after its reading, while readings come
_HEADER_LINE = ",".join(HEADER) + "\n"
_TAIL_BYTES = 4096  # the last line lies within


class RecordingWriter:
    """Adds readings to a CSV file, whole lines only, each at once, synced to the disk once a second.

    With a writer the loop never waits for the disk.  Where a write fails (a full disk) lines are left out until one
    succeeds again, with a log line at each edge; a failed write never stops a pass.  A recording that exists already is
    continued, as after a restart.  Times must rise in a file: where the clock was set back, another is begun beside it.

    whose: written as a JSON beside the file (edge/recording_whose.py).  What is somebody else's, or in the hands of
    another run, or does not say whose it is, is left alone: the readings go into a file of a new name beside it.
    """

    def __init__(
        self, path: Path, writer: Writer | None = None, now_tai_s: float = math.inf, whose: Whose | None = None
    ) -> None:
        """Open the file.  UsageError: it cannot be, or holds something else, or readings later than now_tai_s.

        Where the disk has no room for another file, the first reading tries again.
        """
        self._asked = self._path = path
        self._whose = whose
        self._is_whose_saved = whose is None
        self._writer = writer
        self._fd = -1
        self._is_file = True
        self._last_us = self._synced_tai_s = -math.inf
        self._lost_count = 0
        self._failure = ""
        self._has_header = False
        self._whose_failure = ""
        self._log: Any = structlog.get_logger("record")
        reasons: list[str] = []
        for self._path in islice(names_for(path), MOST_NAMES if whose is not None else 1):
            try:
                reason = self._begin(now_tai_s)
            except OSError as error:
                if error.errno not in (errno.ENOSPC, errno.EDQUOT):
                    raise UsageError(f"--record {self._path}: {error.strerror}") from None
                return
            if not reason:
                break
            reasons.append(reason)
        else:
            raise UsageError(f"--record {path}: {reasons[0]}, and so on up to {self._path.name}: choose another")
        if reasons:
            self._log.warning("record.beside", file=str(self._path), reason="; ".join(reasons))
        self._save_whose(now_tai_s)
        self._has_header = self._is_file and os.fstat(self._fd).st_size > 0
        if not self._has_header:
            with contextlib.suppress(OSError):  # the first reading tries again
                self._append(_HEADER_LINE)
                self._has_header = True

    def _begin(self, now_tai_s: float) -> str:
        """Open the present name, and look whether it can be gone on with; why not, empty where it can.

        UsageError, OSError: no other name would help.
        """
        if self._whose is not None and (reason := why_not_here(self._path, self._whose, len(_HEADER_LINE))):
            if self._path == self._asked and self._path.exists() and not self._is_recording():
                raise UsageError(_foreign(self._path))
            return reason
        self._open()
        try:
            if not self._is_ours():
                raise _NotHereError(f"another run records into {self._path.name}")
            last_tai_s = self._continue(now_tai_s) if self._is_file else None
        except _NotHereError as error:
            os.close(self._fd)
            self._fd = -1
            return str(error)
        except BaseException:
            os.close(self._fd)
            raise
        self._last_us = -math.inf if last_tai_s is None else round(last_tai_s * 1e6)
        return ""

    def _is_recording(self) -> bool:
        """Whether the file begins as one, so far as it is there."""
        with self._path.open("rb") as file:
            head = file.read(len(_HEADER_LINE) + 4).decode("ascii", "replace").replace("\r", "")
        return head.startswith(_HEADER_LINE) or _HEADER_LINE.startswith(head)

    def _is_ours(self) -> bool:
        """Take the file for this run alone, until it is closed."""
        if not self._is_file or self._whose is None:
            return True
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # a disk of the network that knows no locks
            return True
        return True

    def _save_whose(self, tai_s: float) -> None:
        """Have the JSON beside the file; it is tried again with the readings."""
        if self._whose is None or self._is_whose_saved:
            return
        if not self._is_file:
            self._is_whose_saved = True
            return
        try:
            save_whose(self._path, self._whose, utc_text(tai_s, 3) if math.isfinite(tai_s) else "")
        except (OSError, ValueError) as error:
            if not self._whose_failure:
                self._log.warning("record.whose_not_saved", file=str(whose_path(self._path)), reason=str(error))
            self._whose_failure = str(error)
            return
        self._is_whose_saved, self._whose_failure = True, ""

    def _open(self) -> None:
        self._fd = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
        self._is_file = stat.S_ISREG(os.fstat(self._fd).st_mode)

    @property
    def problem(self) -> str:
        """Why the newest line could not be written; "": it was."""
        if not self._failure and self._whose_failure:
            return f"{whose_path(self._path).name}: {self._whose_failure}"
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
        self._path = next(name for name in names_for(self._asked) if not (name.exists() or whose_path(name).exists()))
        self._is_whose_saved = self._whose is None
        self._log.warning("record.beside", file=str(self._path), reason=f"the clock was set back, {old.name} ends")
        self._close()
        self._fd, self._has_header, self._synced_tai_s = -1, False, -math.inf

    def _write(self, line: str, tai_s: float) -> None:
        try:
            self._append(line if self._has_header else _HEADER_LINE + line)
            if tai_s - self._synced_tai_s >= SYNC_S:
                self._synced_tai_s = tai_s
                self._save_whose(tai_s)
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
            self._is_ours()
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
            if self._path != self._asked:
                raise _NotHereError(f"{self._path.name} is no recording")
            raise UsageError(_foreign(self._path))
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
            if self._whose is not None:
                raise _NotHereError(f"the last line of {self._path.name} is no reading ({error})") from None
            raise UsageError(f"--record {self._path}: its last line is no reading ({error}): choose another") from None
        if last_tai_s > now_tai_s and self._whose is not None:
            raise _NotHereError(f"the last reading of {self._path.name}, {utc_text(last_tai_s, 0)}, is later than now")
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


class _NotHereError(Exception):
    """A file that cannot be gone on with, while another name can."""


def _foreign(path: Path) -> str:
    return f"--record {path}: this file is no recording and is left alone: choose another, or move it away"


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
