"""Threads for what may wait on a disk or on a reader: log lines and files.  The loop never waits for them."""

import contextlib
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Generic, TextIO, TypeVar

import structlog

Job = Callable[[], None]
Value = TypeVar("Value")
LIMIT = 1000
CLOSE_S = 2.0
LIVE_LIMIT = 20  # a live line is not drawn while so much waits before it
STUCK_S = 3.0  # a disk that a job has waited for so long is no more slow but stuck


class Writer:
    """Does jobs in a thread of its own, in order.  A job that finds the queue full is dropped and counted.

    on_drained: told, in the thread, how many jobs were dropped since it was told last, once the queue is empty again.
    """

    def __init__(self, name: str, limit: float = LIMIT, on_drained: Callable[[int], None] | None = None) -> None:
        self._limit = limit
        self._on_drained = on_drained
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._is_closed = False
        self._told_count = 0
        self._begun_s: float | None = None  # when the job in hand began, on the monotonic clock
        self.dropped_count = 0
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)  # a stuck one holds no exit up
        self._has_thread = False
        self._begin()

    def _begin(self) -> bool:
        """Have the thread; False: the system denies it, and every job that comes tries again."""
        if not self._has_thread:
            with contextlib.suppress(RuntimeError):
                self._thread.start()
                self._has_thread = True
        return self._has_thread

    @property
    def waiting_count(self) -> int:
        return self._jobs.qsize()

    @property
    def problem(self) -> str:
        """That the job in hand does not end, or that there is no thread; "": all is well."""
        if not self._has_thread:
            return "the system denies a thread: the loop itself waits for the disk"
        begun_s = self._begun_s
        if begun_s is None or time.monotonic() - begun_s < STUCK_S:
            return ""
        return f"the disk has not answered for {time.monotonic() - begun_s:.0f} s"

    def put(self, job: Job) -> bool:
        """Have a job done; never waits.  False: dropped.

        What a job puts itself is done at once, and so is what comes after `close`, unless the thread is stuck, and all
        while the system denies a thread.
        """
        if threading.current_thread() is self._thread or (self._is_closed and not self._thread.is_alive()):
            job()
            return True
        if not self._begin():
            self._do(job)
            return True
        if self._is_closed or self._jobs.qsize() >= self._limit:
            self.dropped_count += 1
            return False
        self._jobs.put(job)
        return True

    def close(self, timeout_s: float = CLOSE_S) -> bool:
        """Wait until all is done, but no longer than this.  True: it is."""
        if not self._is_closed:
            self._is_closed = True
            self._jobs.put(None)
        if self._has_thread:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            self._begun_s = time.monotonic()
            self._do(job)
            self._begun_s = None
            if self._jobs.empty():
                self._tell()
        self._tell()

    def _do(self, job: Job) -> None:
        try:
            job()
        except Exception as error:  # noqa: BLE001  one bad job must not end all others
            structlog.get_logger("writer").error("writer.failed", reason=f"{type(error).__name__}: {error}")

    def _tell(self) -> None:
        dropped_count = self.dropped_count - self._told_count
        if dropped_count and self._on_drained is not None:
            self._told_count += dropped_count
            self._on_drained(dropped_count)


class Latest(Generic[Value]):
    """Saves the newest of the values offered; what comes while an older one waits for the thread replaces it."""

    def __init__(self, writer: Writer, save: Callable[[Value], None]) -> None:
        self._writer = writer
        self._save = save
        self._newest: deque[Value] = deque(maxlen=1)
        self._is_waiting = False

    def offer(self, value: Value) -> None:
        """Take a value; never waits."""
        self._newest.append(value)
        if not self._is_waiting:
            self._is_waiting = True  # before the thread may say otherwise
            if not self._writer.put(self._work):
                self._is_waiting = False

    def _work(self) -> None:
        self._is_waiting = False
        try:
            newest = self._newest.pop()
        except IndexError:  # an earlier job has saved it
            return
        self._save(newest)


class QueuedStream:
    """A text stream whose writes go through a writer, in order with its other jobs; too many waiting are left out."""

    def __init__(self, stream: TextIO, writer: Writer) -> None:
        self._stream = stream
        self._writer = writer

    def write(self, text: str) -> None:
        if self._writer.waiting_count < LIVE_LIMIT:
            self._writer.put(partial(write_text, self._stream, text))

    def flush(self) -> None:
        """Each write is flushed."""


def write_text(stream: TextIO | None, text: str) -> None:
    """Write past the stream's buffer where it has a descriptor.  A reader that has gone costs the text, no more.

    A thread that is stuck in a stream's buffer would hold the lock that the end of the process wants.
    """
    if stream is None:
        return
    try:
        fd = stream.fileno()
    except (OSError, ValueError, AttributeError):  # one that lives in memory
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.write(text)
            stream.flush()
        return
    data = text.encode(getattr(stream, "encoding", None) or "utf-8", "backslashreplace")
    with contextlib.suppress(OSError):
        while data:
            data = data[os.write(fd, data) :]


def replace_file(path: Path, data: bytes, *, is_synced: bool = True) -> None:
    """Put a file in place, whole: written beside it, on the disk, renamed.  OSError: it cannot be.

    is_synced: it is on the disk then, so that it outlives a loss of power.  What a killed process left unfinished, the
    next one takes up again: on a full disk every one of them would cost room.
    """
    unfinished = path.with_name(f".{path.name}.new")
    try:
        with unfinished.open("wb") as file:
            file.write(data)
            if is_synced:
                file.flush()
                os.fsync(file.fileno())
        unfinished.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            unfinished.unlink()
        raise
    if is_synced:
        _sync_directory(path.parent)


def remove_file(path: Path) -> None:
    """Remove a file where there is one, and have it gone on the disk.  OSError: it cannot be."""
    path.unlink(missing_ok=True)
    _sync_directory(path.parent)


def _sync_directory(path: Path) -> None:
    directory = os.open(path, os.O_RDONLY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)
