"""`acu-daemon wait`: until the running daemon tracks, has a pass, or is idle; for scripts."""

import math
import time
from collections.abc import Callable
from typing import Annotated

import typer

from acu_daemon.cli.asking import asked_snapshot
from acu_daemon.cli.operator_commands import Config, Rehearsal, State
from acu_daemon.daemon.goal import Goal, is_reached
from acu_daemon.daemon.health import status_line
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.errors import AcuDaemonError, NoAcuError, NoDaemonError, UsageError

EVERY_S = 0.5


def command(
    goal: Annotated[Goal, typer.Argument(help="tracking: by the ACU, with signal; pass: the satellite is up; idle.")],
    timeout: Annotated[
        float, typer.Option("--timeout", metavar="S", help="Give up after this long; 0: look once.", show_default=False)
    ],
    config: Config = None,
    state: State = None,
    rehearsal: Rehearsal = False,
) -> None:
    """Wait until the running daemon tracks, has a pass in hand, or is idle; then print in a line what it does.

    A daemon that is not there yet, or is started again, is waited for as well:

    \b
      acu-daemon wait tracking --timeout 900 && start-recorder
      acu-daemon wait idle --timeout 1800 || mail -s "still busy" operator

    Exit status: 0 it is so; 1 not within the time, or the daemon may not be asked; 2 wrong use; 3 not within the time,
    and at its end no daemon answers or it has no link to the ACU.
    """
    if not 0.0 <= timeout < math.inf:
        raise UsageError(f"--timeout {timeout:g}: expected seconds from 0 on")
    seen = wait_for(
        goal, timeout, lambda: asked_snapshot(config, state, is_rehearsal=rehearsal), time.monotonic, time.sleep
    )
    typer.echo(status_line(seen))


def wait_for(
    goal: Goal,
    timeout_s: float,
    ask: Callable[[], Snapshot],
    monotonic: Callable[[], float],
    sleep: Callable[[float], None],
) -> Snapshot:
    """The snapshot in which the goal is reached.

    Raises: NoAcuError: the time is over, without a daemon or without its ACU at the end; AcuDaemonError: it is over, or
    the daemon may not be asked.
    """
    end_s = monotonic() + timeout_s
    while True:
        seen, problem = None, ""
        try:
            seen = ask()
        except NoDaemonError as error:
            problem = str(error)
        if seen is not None and is_reached(goal, seen):
            return seen
        left_s = end_s - monotonic()
        if left_s <= 0.0:
            said = f"not {goal} within {timeout_s:g} s: {problem if seen is None else status_line(seen)}"
            raise (AcuDaemonError if seen is not None and seen.is_link_up else NoAcuError)(said)
        sleep(min(EVERY_S, left_s))
