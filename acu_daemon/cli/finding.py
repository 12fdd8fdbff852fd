"""Which of the daemons of this machine a command means."""

import shlex
from pathlib import Path

from acu_daemon.cli.options import antenna_of
from acu_daemon.config.load import load_station
from acu_daemon.edge.control_socket import is_answered, no_daemon
from acu_daemon.edge.state_directory import StateOwner, choice_text, folders_in, state_path
from acu_daemon.errors import AcuDaemonError, NoDaemonError


def find_daemon(word: str, config: Path | None, state: Path | None, *, is_rehearsal: bool) -> Path:
    """The folder of the daemon in the state directory: the configuration's, else the only one that runs.

    NoDaemonError: none; AcuDaemonError: several; says how to choose, by commands that work as they are printed.
    """
    antenna = None if config is None else antenna_of(load_station(config))
    directory = state_path(state, is_rehearsal=is_rehearsal)
    running = _running(directory)
    meant = running if antenna is None else _of_antenna(running, antenna, directory)
    if len(meant) == 1:
        return meant[0]
    if meant or running:
        what = "several daemons run here" if meant else f"{directory}: no daemon of {config} runs, but others do"
        raise AcuDaemonError("\n".join([f"{what}; name the one you mean:", *_commands(word, running)]))
    others = _running(state_path(state, is_rehearsal=not is_rehearsal))
    if not others:
        raise NoDaemonError(no_daemon(directory))
    kind = "a rehearsal does, and is" if not is_rehearsal else "one that is no rehearsal does, and is"
    choice = choice_text(config, state, is_rehearsal=not is_rehearsal)
    is_found_so = len(others) == 1 and config is None
    commands = [f"  acu-daemon {word} {choice}".rstrip()] if is_found_so else _commands(word, others)
    raise NoDaemonError("\n".join([f"{no_daemon(directory)}; {kind} asked by:", *commands]))


def _of_antenna(running: list[Path], antenna: StateOwner, directory: Path) -> list[Path]:
    own = [path for path in running if path == antenna.folder(directory)]
    return own or [path for path in running if path == directory or antenna.is_kept_in(path)]


def _running(directory: Path) -> list[Path]:
    try:
        return [path for path in folders_in(directory) if is_answered(path)]
    except PermissionError:
        raise AcuDaemonError(f"{directory}: not permitted; be root (sudo), its user or in its group") from None


def _commands(word: str, folders: list[Path]) -> list[str]:
    return [f"  acu-daemon {word} --state {shlex.quote(str(path))}" for path in folders]
