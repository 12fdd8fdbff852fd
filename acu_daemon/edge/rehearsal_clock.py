"""One clock for a rehearsal: daemon and simulator on one machine leave theirs beside the address of the ACU.

Whoever starts first has the clock: `--at` holds at the start of that process.  The other one finds it there, and takes
it where its own --at says the same; so either may be stopped and started again in mid-rehearsal.  The file, in the
user's runtime directory, is locked as long as its process lives: what a dead one left counts for nothing.  A line with
faults between the two (`fault-proxy`) leaves the place it leads to instead.  The wire carries no clock
(docs/testing.md), so a simulator of another hand has none to give.
"""

import contextlib
import fcntl
import json
import math
import os
import stat
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from acu_daemon.edge.acu_place import file_name, place_of, places_of

VERSION = 1
TOGETHER_S = 0.01  # clocks this near are one
_MOST_PLACES = 8  # a line behind a line, and so on
_PATIENCE_S = 1.0
_LARGEST_BYTES = 4096


class Role(StrEnum):
    """Which side of the ACU's line a process is on."""

    ACU = "acu"
    DAEMON = "run"


@dataclass(frozen=True, slots=True)
class SharedClock:
    """A clock.  at_tai_s: of --at; None: no rehearsal.  offset_s: TAI minus CLOCK_MONOTONIC.  pid: whose it is."""

    at_tai_s: float | None
    offset_s: float
    pid: int = 0

    @property
    def begun_s(self) -> float:
        """The reading of CLOCK_MONOTONIC at which --at held."""
        return math.nan if self.at_tai_s is None else self.at_tai_s - self.offset_s


@dataclass(slots=True)
class Meeting:
    """What a process found at the ACU's address; while it is open, its own clock stands there.

    other: the clock of the other side, None where nobody left one.  is_taken: ours is that one.  problem: why clocks
    cannot be left here.
    """

    clock: SharedClock
    other: SharedClock | None = None
    is_taken: bool = False
    problem: str = ""
    _held: list[tuple[int, Path]] = field(default_factory=list, repr=False)

    @property
    def apart_s(self) -> float:
        """How far the other's clock is ahead of ours."""
        return 0.0 if self.other is None else self.other.offset_s - self.clock.offset_s

    def move_to(self, url: str) -> None:
        """Leave our clock also at the address that a simulator got, where it had asked for any free one."""
        with contextlib.suppress(OSError), _alone() as directory:
            _leave(self, directory, place_of(url), Role.ACU, _what(self.clock))

    def close(self) -> None:
        """Take our clock away."""
        while self._held:
            fd, path = self._held.pop()
            with contextlib.suppress(OSError):
                path.unlink()
            os.close(fd)

    def __enter__(self) -> "Meeting":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def meet(url: str, role: Role, own: SharedClock, *, may_take: bool) -> Meeting:
    """Look for the other side's clock at the ACU's address and leave ours there, in one step.

    may_take: ours was not given to the instant.  One for another --at is not taken.
    """
    met = Meeting(own)
    try:
        with _alone() as directory:
            places = _way(directory, url) if role is Role.DAEMON else [place_of(url)]
            seen = (_clock_at(directory, place, _other(role)) for place in places)
            met.other = next((one for one in seen if one is not None), None)
            if may_take and met.other is not None and met.other.at_tai_s == own.at_tai_s is not None:
                met.clock, met.is_taken = met.other, True
            for place in places:
                if not place.endswith(":0"):  # nobody dials a port that is not known yet
                    _leave(met, directory, place, role, _what(met.clock))
    except OSError as error:
        met.problem = error.strerror or str(error)
    return met


def lead(url: str, to_url: str) -> Meeting:
    """Leave at an address that it leads to another one; for a line between daemon and ACU."""
    met = Meeting(SharedClock(None, 0.0))
    with contextlib.suppress(OSError), _alone() as directory:
        _leave(met, directory, place_of(url), Role.ACU, {"via": to_url})
    return met


def look_for_simulator(url: str) -> SharedClock | None:
    """The clock of the simulator at the ACU's address, where one stands there."""
    with contextlib.suppress(OSError), _alone(is_made=False) as directory:
        for place in _way(directory, url):
            if (clock := _clock_at(directory, place, Role.ACU)) is not None:
                return clock
    return None


def _other(role: Role) -> Role:
    return Role.ACU if role is Role.DAEMON else Role.DAEMON


def _way(directory: Path, url: str) -> list[str]:
    """The places at which the ACU that a daemon dials may stand: by all names, and behind lines with faults."""
    places = places_of(url)
    for place in places:
        if len(places) > _MOST_PLACES:
            break
        read = _read(directory, place, Role.ACU)
        if read is not None and isinstance(via := read.get("via"), str):
            places += [one for one in places_of(via) if one not in places]
    return places


def _clock_at(directory: Path, place: str, role: Role) -> SharedClock | None:
    read: dict[str, Any] = _read(directory, place, role) or {}
    at_tai_s, offset_s, pid = read.get("at_tai_s"), read.get("offset_s"), read.get("pid")
    if not (isinstance(offset_s, float) and math.isfinite(offset_s) and isinstance(pid, int)):
        return None
    return SharedClock(at_tai_s, offset_s, pid) if at_tai_s is None or isinstance(at_tai_s, float) else None


def _what(clock: SharedClock) -> dict[str, float | None]:
    return {"at_tai_s": clock.at_tai_s, "offset_s": clock.offset_s}


def _path(directory: Path, place: str, role: Role) -> Path:
    return directory / f"{file_name(place)}.{role}.json"


def _read(directory: Path, place: str, role: Role) -> dict[str, Any] | None:
    """What a living process of this user left; None: nothing, or nothing that counts."""
    try:
        fd = os.open(_path(directory, place, role), os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        if os.fstat(fd).st_uid != os.geteuid() or _lock(fd):
            return None
        read = json.loads(os.pread(fd, _LARGEST_BYTES, 0))
    except (OSError, ValueError, RecursionError):
        return None
    finally:
        os.close(fd)
    is_of_place = isinstance(read, dict) and read.get("version") == VERSION and read.get("place") == place
    return read if is_of_place else None


def _leave(met: Meeting, directory: Path, place: str, role: Role, what: dict[str, Any]) -> None:
    """Leave it as long as this process lives; where another one of our side stands there already, that one stays."""
    path = _path(directory, place, role)
    if any(held == path for _, held in met._held):
        return
    fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    if not _lock(fd):
        os.close(fd)
        return
    met._held.append((fd, path))
    os.ftruncate(fd, 0)
    os.pwrite(fd, json.dumps({"version": VERSION, "place": place, "pid": os.getpid(), **what}).encode(), 0)


def _lock(fd: int) -> bool:
    """Lock a file for this process; False: a living one has it."""
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextlib.contextmanager
def _alone(*, is_made: bool = True) -> Iterator[Path]:
    """The directory, for one process of this user at a time.  OSError: it cannot be had."""
    directory = _directory()
    if is_made:
        directory.mkdir(mode=0o700, exist_ok=True)
    fd = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        seen = os.fstat(fd)
        if seen.st_uid != os.geteuid() or seen.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            raise OSError(f"{directory} is not this user's alone")
        end_s = time.monotonic() + _PATIENCE_S
        while not _lock(fd):
            if time.monotonic() > end_s:
                raise OSError(f"{directory} is held by another process")
            time.sleep(0.01)
        yield directory
    finally:
        os.close(fd)


def _directory() -> Path:
    """In the runtime directory of the user, which both terminals have in common, else in /tmp."""
    given, session = Path(os.environ.get("XDG_RUNTIME_DIR", "")), Path(f"/run/user/{os.geteuid()}")
    for home in (given, session):
        if home.is_absolute() and os.access(home, os.W_OK | os.X_OK):
            return home / "acu-daemon"
    return Path("/tmp") / f"acu-daemon-{os.geteuid()}"
