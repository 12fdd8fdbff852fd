"""Finds the daemon that holds this ACU, by the control sockets of the state directories that are known."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from acu_daemon.daemon.snapshot import Snapshot, snapshot_of
from acu_daemon.edge.control_socket import SOCKET, ask
from acu_daemon.edge.state_directory import state_path
from acu_daemon.errors import AcuDaemonError, NoDaemonError, UsageError

SERVICES = Path("/var/lib/acu-daemon")  # StateDirectory= of the service


@dataclass(frozen=True, slots=True)
class OwnDaemon:
    """A daemon that runs: where, and what it sees; None: it may not be asked, or is of another version."""

    directory: Path
    seen: Snapshot | None
    problem: str = ""


def find_daemon(acu: str, state: Path | None) -> OwnDaemon | None:
    """The daemon that holds the ACU of this description, or one that does not say which it holds; None: there is none.

    state: of --state; without it the service's directories are looked into as well.
    """
    silent = None
    for directory in _directories(state):
        try:
            seen = snapshot_of(json.loads(ask(directory, "status")))
        except (AcuDaemonError, ValueError, TypeError) as error:
            if _listens(directory, error):
                silent = silent or OwnDaemon(directory, None, str(error))
            continue
        if seen.acu == acu:
            return OwnDaemon(directory, seen)
    return silent


def _listens(directory: Path, error: Exception) -> bool:
    """Whether somebody is there all the same; nobody listens at a socket that a killed daemon left."""
    return not isinstance(error, NoDaemonError) and str(directory) in str(error)


def _directories(state: Path | None) -> Iterator[Path]:
    try:
        bases = [state_path(state, is_rehearsal=is_rehearsal) for is_rehearsal in (False, True)]
    except UsageError:
        bases = []
    for base in [*bases, *([SERVICES] if state is None else [])]:
        yield base
        try:
            for depth in ("*", "*/*"):  # an antenna's folder, and one in a service's directory
                yield from sorted(path.parent for path in base.glob(f"{depth}/{SOCKET}"))
        except OSError:  # not ours to look into
            continue
