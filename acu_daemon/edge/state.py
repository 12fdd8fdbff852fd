"""Where state lives (docs/service.md): --state, else $STATE_DIRECTORY, else acu-daemon in the XDG state home."""

import json
import os
import stat
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from acu_daemon.edge.writer import Latest, Writer, replace_file
from acu_daemon.errors import UsageError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def state_directory(asked: Path | None, *, is_rehearsal: bool) -> Path:
    """Make and return the directory; a rehearsal has one of its own beside the real one.  UsageError: it cannot."""
    directory = state_path(asked, is_rehearsal=is_rehearsal)
    try:
        directory.mkdir(mode=0o750, parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"state directory {directory}: {error.strerror}; choose another with --state DIR") from None
    refuse_world_writable(directory)
    return directory


def state_path(asked: Path | None, *, is_rehearsal: bool) -> Path:
    """Where the directory is, made or not."""
    try:
        real = (asked or _default()).resolve()  # so that "." has a name
    except (OSError, RuntimeError) as error:  # a directory that was removed, or links that go round
        raise UsageError(f"state directory {asked}: {error}; choose another with --state DIR") from None
    return real.parent / f"{real.name}-rehearsal" if is_rehearsal else real


def refuse_world_writable(directory: Path) -> None:
    """UsageError: everybody may put files into a directory that decides how the antenna moves."""
    try:
        is_open = bool(directory.stat().st_mode & stat.S_IWOTH)
    except OSError:  # whoever reads its files says so
        return
    if is_open:
        raise UsageError(f"{directory}: everybody may write there; close it: chmod o-w {directory}")


def _default() -> Path:
    if given := os.environ.get("STATE_DIRECTORY"):  # systemd's; several are parted by colons
        return Path(given.split(":")[0])
    home = Path(os.environ.get("XDG_STATE_HOME", ""))
    if not home.is_absolute():  # such a one is to be ignored: XDG Base Directory Specification
        try:
            home = Path.home() / ".local" / "state"
        except RuntimeError:
            raise UsageError("this user has no home directory for the state; choose one with --state DIR") from None
    return home / "acu-daemon"


SNAPSHOT = "snapshot.json"
EVERY_TICKS = 10


class SnapshotFile:
    """The daemon's present view, once a second, for health checks and scripts.  The loop never waits for the disk."""

    def __init__(self, directory: Path, writer: Writer, snapshot_ticks: int = 1) -> None:
        """snapshot_ticks: a snapshot comes every so many ticks."""
        self._every_count = EVERY_TICKS // snapshot_ticks
        self._path = directory / SNAPSHOT
        self._latest: Latest[DataclassInstance] = Latest(writer, self._save)
        self._skip = 0
        self.failed_count = 0

    def write(self, seen: "DataclassInstance") -> None:
        """Take a snapshot."""
        self._skip = (self._skip + 1) % self._every_count
        if self._skip == 0:
            self._latest.offer(seen)

    def _save(self, seen: "DataclassInstance") -> None:
        try:
            replace_file(self._path, json.dumps(asdict(seen)).encode(), is_synced=False)
        except OSError:
            self.failed_count += 1
