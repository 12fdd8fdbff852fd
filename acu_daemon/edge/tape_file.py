"""A tape as a file: gzip that is readable up to the last half second of a daemon that was killed.

The first line is the head, a JSON object with all that the decision was made with; each other one is a record
(edge/tape_text.py).  `zcat` shows it.
"""

import contextlib
import json
import math
import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.edge.tape import Record
from acu_daemon.edge.tape_text import TapeReader, TapeWriter
from acu_daemon.edge.writer import Writer
from acu_daemon.errors import UsageError

SUFFIX = ".tape.gz"
FORMAT = 1
HAND_OVER_S = 0.4  # so long records wait in the loop at most, a tick more where it comes late
LEVEL = 4
LARGEST_BYTES = 200_000_000  # of a file: a month of one pass at 10 Hz
MOST_UNSAVED_BYTES = 1_000_000  # a quarter of an hour at 10 Hz
_LARGEST_TEXT = 4_000_000_000
_CHUNK = 65536
_GZIP = 31


class TapeFile:
    """Keeps the records of one run.  `note` belongs to the loop, all else is done in the writer's thread.

    On a full disk it waits in memory until there is room again.  Where that lasts too long, or the disk does not keep
    up, the tape ends there, which is told: one with a gap could not be replayed.  Nothing of that stops a pass.
    """

    def __init__(self, path: Path, head: dict[str, Any], writer: Writer, largest_bytes: int = LARGEST_BYTES) -> None:
        """Begin the file, under the next free name.  It is made in the thread; what fails there is in `problem`."""
        self.path = path
        self._writer = writer
        self._largest_bytes = largest_bytes
        self._waiting: list[Record] = []
        self._handed_tai_s = self._tick_tai_s = -math.inf
        self._is_due = False
        self._lines = TapeWriter()
        self._packer = zlib.compressobj(LEVEL, zlib.DEFLATED, _GZIP)
        self._fd = -1
        self._size = 0
        self._unsaved = b""  # what the disk has not taken yet
        self._is_over = self._is_closed = False
        self.problem = ""  # why the newest of it is not on the disk
        self._log: Any = structlog.get_logger("tape")
        self._put(partial(self._begin, json.dumps({"format": FORMAT, **head}, allow_nan=False) + "\n"))

    def note(self, record: Record) -> None:
        """Take a record; never waits."""
        self._waiting.append(record)
        letter = record[0]
        if letter == "T":
            waited_s = record[1] - self._handed_tai_s
            self._is_due = not 0.0 <= waited_s < HAND_OVER_S
            if not 0.0 <= waited_s < 2.0 * HAND_OVER_S:  # no reply has come
                self._hand_over(record[1])
            self._tick_tai_s = record[1]
        elif letter == "H" and self._is_due:  # the tick has its reply, and the loop is about to sleep
            self._hand_over(self._tick_tai_s)

    def _hand_over(self, tai_s: float) -> None:
        self._handed_tai_s, self._is_due = tai_s, False
        batch, self._waiting = self._waiting, []
        self._put(partial(self._write, batch))

    def _put(self, job: Any) -> None:
        if not self._is_over and not self._writer.put(job):
            self._end("the disk does not keep up")

    def _end(self, why: str) -> None:
        self._is_over, self.problem, self._unsaved = True, f"{self.path.name}: {why}", b""
        self._log.warning("tape.ended", file=str(self.path), reason=why)

    def _begin(self, head: str) -> None:
        self._append(self._packer.compress(head.encode()) + self._packer.flush(zlib.Z_SYNC_FLUSH))

    def _write(self, batch: list[Record]) -> None:
        if self._is_over:
            return
        try:
            text = "".join(map(self._lines.line, batch)).encode()
        except (ValueError, TypeError) as error:  # what comes after a gap could not be replayed
            self._end(str(error))
            return
        self._append(self._packer.compress(text) + self._packer.flush(zlib.Z_SYNC_FLUSH))
        if self._size > self._largest_bytes and not self._is_over:
            self._end(f"it has {self._size / 1e6:.0f} MB")

    def _append(self, data: bytes) -> None:
        """Write; what finds no room is kept, up to a quarter of an hour of it, and tried again with the next."""
        if self._is_over:
            return
        self._unsaved += data
        try:
            if self._fd < 0:
                self.path.parent.mkdir(mode=0o750, parents=True, exist_ok=True)
                self._fd, self.path = _new_file(self.path)
            while self._unsaved:
                written = os.write(self._fd, self._unsaved)
                self._size, self._unsaved = self._size + written, self._unsaved[written:]
        except OSError as error:
            self._cannot(error.strerror or str(error))
            return
        if self.problem:
            self._log.info("tape.saved_again", file=str(self.path))
            self.problem = ""

    def _cannot(self, why: str) -> None:
        if not self.problem:
            self._log.warning("tape.not_saved", file=str(self.path), reason=why)
        self.problem = f"{self.path.name}: {why}"
        if len(self._unsaved) > MOST_UNSAVED_BYTES:
            self._end(why)

    def close(self) -> None:
        """Keep what waits, and close; done when the writer has come to it."""
        batch, self._waiting = self._waiting, []
        self._writer.put(partial(self._close, batch))

    def _close(self, batch: list[Record]) -> None:
        if self._is_closed:
            return
        self._is_closed = True
        self._write(batch)
        self._append(self._packer.flush(zlib.Z_FINISH))
        if self._unsaved and not self._is_over:
            self._end(self.problem.partition(": ")[2])
        if self._fd >= 0:
            with contextlib.suppress(OSError):
                os.fsync(self._fd)
            os.close(self._fd)


def _new_file(path: Path) -> tuple[int, Path]:
    """Make it, or NAME-2, NAME-3 and so on beside one that is there."""
    stem = path.name.removesuffix(SUFFIX)
    for number in count(1):
        name = path if number == 1 else path.with_name(f"{stem}-{number}{SUFFIX}")
        with contextlib.suppress(FileExistsError):
            return os.open(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o640), name
    raise AssertionError


@dataclass(frozen=True, slots=True)
class Tape:
    """A tape that was read.  is_whole: its daemon has closed it."""

    head: dict[str, Any]
    lines: list[str]
    is_whole: bool

    def records(self) -> Iterator[Record]:
        """The records in their order.  TapeError: a line makes no sense; says which."""
        return TapeReader().records(self.lines, first=2)


def read_tape(path: Path) -> Tape:
    """Read what there is of a tape; of one that was cut the last line that is not whole is left out.

    Raises: UsageError: it is none, or of a later version.
    """
    try:
        packed = path.read_bytes()
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror}") from None
    data, is_whole = _unpacked_begin(packed)
    *lines, torn = data.decode("utf-8", "replace").split("\n")
    try:
        head = json.loads(lines[0]) if lines else None
    except ValueError:
        head = None
    if not isinstance(head, dict) or "format" not in head:
        raise UsageError(f"{path}: this is no tape of a pass ({SUFFIX}, kept by `acu-daemon run`)")
    if head["format"] != FORMAT:
        raise UsageError(f"{path}: a tape of format {head['format']}, this version reads format {FORMAT}")
    return Tape(head, lines[1:], is_whole and not torn)


def _unpacked_begin(packed: bytes) -> tuple[bytes, bool]:
    """What can be unpacked from the beginning on, and whether that is all."""
    unpacker = zlib.decompressobj(wbits=_GZIP)
    found = bytearray()
    try:
        for first in range(0, len(packed), _CHUNK):
            found += unpacker.decompress(packed[first : first + _CHUNK], _LARGEST_TEXT)
    except zlib.error:
        return bytes(found), False
    return bytes(found), unpacker.eof


def tapes_in(directory: Path) -> list[Path]:
    """The tapes of a directory, the oldest first."""
    try:
        return sorted(directory.glob(f"*{SUFFIX}"))
    except OSError:
        return []
