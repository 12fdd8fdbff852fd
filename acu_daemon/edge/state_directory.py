"""Where state lives (docs/service.md): --state, else $STATE_DIRECTORY, else acu-daemon in the XDG state home.

In that directory every antenna has a folder of its own, STATION@ACU: the station's name and the ACU's address.  What
forbids to move holds for the antenna under an older name too: directly in the directory, as earlier versions kept it,
or in the folder of a station or an ACU that was renamed.  Nothing of that is carried from one rehearsal to another.
"""

import contextlib
import errno
import json
import os
import re
import shlex
import stat
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from acu_daemon.edge.acu_place import file_name, place_of
from acu_daemon.edge.writer import Latest, Writer, replace_file
from acu_daemon.errors import UsageError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_AT = "@"  # no name for files has it
_COMMAND = re.compile(r"(`acu-daemon (?:arm|disarm|clear|status))`")


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


@dataclass(frozen=True, slots=True)
class StateOwner:
    """Whose state it is, as names for files.  station: by its name; acu: by its address and its number on the line."""

    station: str
    acu: str

    @classmethod
    def of(cls, station: str, acu_url: str, acu_address: str) -> "StateOwner":
        return cls(file_name(station), file_name(f"{place_of(acu_url)} {acu_address}"))

    def folder(self, directory: Path) -> Path:
        """The antenna's own folder in a state directory."""
        return directory / f"{self.station}{_AT}{self.acu}"

    def is_kept_in(self, folder: Path) -> bool:
        """Whether a folder is this antenna's, by this name or by an older one: the same station, or the same ACU."""
        station, at, acu = folder.name.partition(_AT)
        return bool(at) and (station == self.station or acu == self.acu)


def antenna_directory(directory: Path, antenna: StateOwner) -> Path:
    """Make and return the antenna's folder; on a full disk the directory itself serves.  UsageError: it cannot be."""
    folder = antenna.folder(directory)
    try:
        folder.mkdir(mode=0o750, exist_ok=True)
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS):
            return directory
        raise UsageError(f"state directory {folder}: {error.strerror}; choose another with --state DIR") from None
    refuse_world_writable(folder)
    return folder


def folders_in(directory: Path) -> list[Path]:
    """The folders of antennas in a state directory, and itself, where an earlier version kept all.  OSError."""
    found = []
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        found = sorted(path for path in directory.iterdir() if _AT in path.name and path.is_dir())
    return [directory, *found]


def older_folders(directory: Path, antenna: StateOwner) -> tuple[Path, ...]:
    """Where else something may be kept of the same antenna."""
    own = antenna.folder(directory)
    try:
        found = folders_in(directory)
    except OSError:
        found = [directory]
    return tuple(path for path in found if path != own and (path == directory or antenna.is_kept_in(path)))


def choice_text(config: Path | None, asked: Path | None, *, is_rehearsal: bool) -> str:
    """The options that let `arm`, `disarm`, `clear` and `status` find this daemon from anywhere on this machine."""
    words = [] if config is None else ["--config", str(config.resolve())]
    if asked is not None or os.environ.get("STATE_DIRECTORY"):
        words += ["--state", str(state_path(asked, is_rehearsal=False))]
    return shlex.join([*words, "--rehearsal"] if is_rehearsal else words)


def with_choice(text: str, choice: str) -> str:
    """A text whose commands name the daemon that they are for."""
    return _COMMAND.sub(lambda found: f"{found[1]} {choice}`", text) if choice else text


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
