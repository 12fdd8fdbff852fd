"""What forbids to move, in the state directory: `latch`, of an axis, `disarmed` and `stowed`, each a file of its own.

Its existence forbids, whatever it holds and whatever the pass: the text, and the UTC since when, each in a line.  One
that is kept under an older name of the antenna (edge/state_directory.py) stays where it is until a person clears it.
"""

import contextlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.edge.clock import Clock
from acu_daemon.edge.writer import Latest, Writer, remove_file, replace_file
from acu_daemon.orbit.timescales import utc_text

LATCH, DISARMED, STOWED = "latch", "disarmed", "stowed"
ADVICE = {
    LATCH: "look at the antenna, then `acu-daemon clear`",
    DISARMED: "look at the antenna, then `acu-daemon arm`",
    STOWED: "`acu-daemon unstow` ends it, or whose it is",
}
_LARGEST_BYTES = 1000


def read_latch(directory: Path, name: str = LATCH, older: Sequence[Path] = ()) -> str:
    """What is latched, or disarmed by; "" where there is no file.  One that cannot be read counts too, and says so.

    older: other folders of the same antenna.
    """
    return next((text for one in (directory, *older) if (text := _read(one, name))), "")


def _read(directory: Path, name: str) -> str:
    path, advice = directory / name, ADVICE[name]
    log: Any = structlog.get_logger("latch")
    try:
        with path.open("rb") as file:
            text, since = file.read(_LARGEST_BYTES).decode("utf-8").splitlines()
        if not text.isprintable() or not text.strip():
            raise ValueError("no text")
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except (OSError, ValueError) as error:
        log.error(f"{name}.unreadable", file=str(path), reason=str(error), action="it counts", advice=advice)
        return f"the file {name} in the state directory, which cannot be read: {advice}"
    log.warning(f"{name}.kept", **{name: text}, since=since, file=str(path), advice=advice)
    return text


class LatchKeeper:
    """Writes and removes a file.  The loop never waits for the disk; what fails is tried again at the next tick."""

    def __init__(
        self,
        directory: Path,
        writer: Writer,
        first: str,
        clock: Clock,
        name: str = LATCH,
        older: Sequence[Path] = (),
        *,
        is_left_out: bool = False,
    ) -> None:
        """older: other folders of the same antenna.  is_left_out: what the file holds is not what it begins with."""
        self._name = name
        self._older = [one / name for one in older]
        self._path = directory / name
        self._clock = clock
        self._wanted = first
        self._saved: str | None = None if is_left_out else first  # None: who knows what the file holds now
        self._latest: Latest[str] = Latest(writer, self._save)
        self.problem = ""  # why what is wanted is not saved

    def see(self, text: str) -> None:
        """Take what a tick says; "": nothing."""
        if text != self._wanted or text != self._saved:
            self._wanted = text
            self._latest.offer(text)

    def _save(self, text: str) -> None:
        if text == self._saved:
            return
        log: Any = structlog.get_logger("latch")
        try:
            self._put(text)
        except OSError as error:
            self._saved = None
            if not self.problem:
                log.error(f"{self._name}.not_saved", file=str(self._path), text=text, reason=str(error))
            self.problem = f"{self._name}: {error.strerror}"
            return
        self._saved = text
        if self.problem:
            log.info(f"{self._name}.saved_again", file=str(self._path))
            self.problem = ""

    def _put(self, text: str) -> None:
        if not text:
            for path in (*(one for one in self._older if os.path.lexists(one)), self._path):
                remove_file(path)
            return
        try:
            replace_file(self._path, f"{text}\n{utc_text(self._clock.tai_s())}\n".encode())
        except OSError:
            with contextlib.suppress(OSError):
                self._path.touch()  # an empty file needs no room on a full disk, and counts as well
            raise
