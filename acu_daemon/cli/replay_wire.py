"""`acu-daemon replay --wire`: a recorded pass through the daemon's decision code, bit for bit."""

from dataclasses import dataclass
from pathlib import Path

import typer

from acu_daemon import __version__
from acu_daemon.cli.tape_head import TapedPass, taped_pass
from acu_daemon.daemon.tape_replay import Difference, TapeReplay, Watcher
from acu_daemon.edge.tape_file import read_tape
from acu_daemon.edge.tape_text import TapeError
from acu_daemon.orbit.timescales import utc_text


@dataclass(frozen=True, slots=True)
class ReplayedPass:
    """A recording and what its replay came to."""

    taped: TapedPass
    replay: TapeReplay
    is_whole: bool
    torn: str = ""  # why the replay ended before the recording did

    @property
    def difference(self) -> Difference | None:
        """The first one; None: every decision was the same."""
        return self.replay.difference


def replay_pass(path: Path, watcher: Watcher | None = None, *, fits_anew: bool = False) -> ReplayedPass:
    """Replay a recording.  UsageError: it is none."""
    tape = read_tape(path)
    taped = taped_pass(tape.head, str(path))
    replay = TapeReplay(taped.job, watcher, fits_anew=fits_anew)
    torn = ""
    try:
        replay.run(tape.records())
    except TapeError as error:
        torn = str(error)
    return ReplayedPass(taped, replay, tape.is_whole and not torn, torn)


def replay_wire(path: Path, *, fits_anew: bool) -> None:
    """Replay, and say what came of it.  Exit status 1: a decision differs, or a line of the recording is damaged."""
    done = replay_pass(path, fits_anew=fits_anew)
    replay, taped = done.replay, done.taped
    fits = f"{replay.fit_count} fits {'computed again' if fits_anew else 'as recorded'}"
    counts = f"{replay.tick_count} ticks, {replay.command_count} commands, {fits}"
    if taped.version != __version__:
        typer.echo(f"recorded by version {taped.version}, replayed by {__version__}")
    if not replay.is_ended:
        typer.echo("the recording was cut: its daemon was killed, or began the pass anew")
    if done.torn:
        typer.echo(f"{path}: {done.torn}", err=True)
    if (difference := done.difference) is not None:
        at = utc_text(difference.tai_s)
        typer.echo(f"a decision differs at {at}, after {counts}: {difference}", err=True)
    if done.torn or difference is not None:
        raise typer.Exit(1)
    typer.echo(f"every decision is the same: {counts}")
