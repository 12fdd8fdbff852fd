"""The latch of an axis in the state directory: a file of its own, there as long as nothing may move.

Its existence is the latch, whatever it holds: the text, and the UTC since when, each in a line.
"""

import contextlib
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.control.state import ControlState
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.writer import Latest, Writer, remove_file, replace_file
from acu_daemon.orbit.timescales import utc_text

LATCH = "latch"
ADVICE = "look at the antenna, then `acu-daemon clear`"
_LARGEST_BYTES = 1000


def read_latch(directory: Path) -> str:
    """What is latched; "" where there is no file.  One that cannot be read latches too, and its text says so."""
    path = directory / LATCH
    log: Any = structlog.get_logger("latch")
    try:
        with path.open("rb") as file:
            text, since = file.read(_LARGEST_BYTES).decode("utf-8").splitlines()
        if not text.isprintable() or not text.strip():
            raise ValueError("no text")
    except FileNotFoundError:
        return ""
    except (OSError, ValueError) as error:
        log.error("latch.unreadable", file=str(path), reason=str(error), action="latched", advice=ADVICE)
        return f"the file {LATCH} in the state directory cannot be read: {ADVICE}"
    log.warning("latch.kept", latch=text, since=since, advice=ADVICE)
    return text


class LatchKeeper:
    """Writes and removes the file.  The loop never waits for the disk; what fails is tried again at the next tick."""

    def __init__(self, directory: Path, writer: Writer, first: str, clock: Clock) -> None:
        self._path = directory / LATCH
        self._clock = clock
        self._wanted = self._saved = first
        self._latest: Latest[str] = Latest(writer, self._save)
        self._has_failed = False

    def see(self, state: ControlState) -> None:
        """Take the memory of a tick."""
        if state.latch != self._wanted or state.latch != self._saved:
            self._wanted = state.latch
            self._latest.offer(state.latch)

    def _save(self, latch: str) -> None:
        if latch == self._saved:
            return
        log: Any = structlog.get_logger("latch")
        try:
            self._put(latch)
        except OSError as error:
            if not self._has_failed:
                log.error("latch.not_saved", file=str(self._path), latch=latch, reason=str(error))
            self._has_failed = True
            return
        self._saved = latch
        if self._has_failed:
            log.info("latch.saved_again", file=str(self._path))
            self._has_failed = False

    def _put(self, latch: str) -> None:
        if not latch:
            remove_file(self._path)
            return
        try:
            replace_file(self._path, f"{latch}\n{utc_text(self._clock.tai_s())}\n".encode())
        except OSError:
            with contextlib.suppress(OSError):
                self._path.touch()  # an empty file needs no room on a full disk, and latches as well
            raise
