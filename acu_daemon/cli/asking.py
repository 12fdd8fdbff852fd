"""Asks the running daemon what it sees."""

import json
from pathlib import Path

from acu_daemon.cli.finding import find_daemon
from acu_daemon.daemon.snapshot import Snapshot, snapshot_of
from acu_daemon.edge.control_socket import ask
from acu_daemon.errors import AcuDaemonError


def asked_snapshot(config: Path | None, state: Path | None, *, is_rehearsal: bool) -> Snapshot:
    """The snapshot of the daemon that is meant.

    NoDaemonError: none runs.  AcuDaemonError: several do, no permission, or it is of another version.
    """
    answer = ask(find_daemon("status", config, state, is_rehearsal=is_rehearsal), "status")
    try:
        return snapshot_of(json.loads(answer))
    except (ValueError, TypeError) as error:
        raise AcuDaemonError(f"the daemon runs another version than this command ({error}); see --json") from None
