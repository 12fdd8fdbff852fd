"""`acu-daemon arm`, `disarm`, `clear`, `stow`, `nudge` and all that people say to the running daemon."""

from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.asking import asked_snapshot
from acu_daemon.cli.finding import find_daemon
from acu_daemon.daemon.overview import status_lines
from acu_daemon.edge.control_socket import ask
from acu_daemon.edge.rich_loading import let_rich_load
from acu_daemon.edge.state_directory import choice_text, with_choice

State = Annotated[
    Path | None,
    typer.Option("--state", metavar="DIR", help="The running daemon's --state, if it was started with one."),
]
Config = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="DIR",
        help="The running daemon's configuration: needed only where several run.  Without it, several are listed.",
    ),
]
Rehearsal = Annotated[bool, typer.Option("--rehearsal", help="The daemon of `rehearse` or `run --at`.")]

Satellite = Annotated[str | None, typer.Option("--satellite", metavar="NAME", help="Whose pass.")]
At = Annotated[str | None, typer.Option("--at", metavar="UTC", help="A time at which it is up.")]
Named = Annotated[str, typer.Option("--satellite", metavar="NAME", help="Whose pass.")]
Time = Annotated[str, typer.Option("--at", metavar="UTC", help="A time at which it is up.")]


def say(line: str, config: Path | None, state: Path | None, *, is_rehearsal: bool) -> None:
    word = line.split(" ")[0]
    answer = ask(find_daemon(word, config, state, is_rehearsal=is_rehearsal), line)
    typer.echo(with_choice(answer, choice_text(config, state, is_rehearsal=is_rehearsal)))


def arm(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Let the running daemon move the antenna.

    Needed after `disarm`, after a STOP by another hand, the emergency stop or an open door: these hold through restarts
    and for later passes too.  With `[safety] arm = "manual"` needed for every pass.
    It goes on with the pass at once: the present angles are written first, then the path.  `acu-daemon status` tells
    what it is doing.

    Exit status: 0 armed; 1 no daemon, no permission, or it runs with --shadow.
    """
    say("arm", config, state, is_rehearsal=rehearsal)


def disarm(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Take the running daemon's hands off the antenna: STOP if it moves it, then nothing but polls.

    It goes on recording, fitting and predicting.  `acu-daemon arm` gives the antenna back.

    Exit status: 0 disarmed; 1 no daemon or no permission.
    """
    say("disarm", config, state, is_rehearsal=rehearsal)


def clear(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Clear the latch of an axis that stood still, ran away or turned the wrong way.  Look at the antenna first.

    An armed daemon goes on with the pass at once.  If the axis fails again, it is stopped and latched again.

    Exit status: 0 cleared, or nothing was latched; 1 no daemon or no permission.
    """
    say("clear", config, state, is_rehearsal=rehearsal)


def stop(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Stop the antenna now: STOP to the ACU at once, whoever moves it, then nothing but polls until `acu-daemon arm`.

    A stow that is under way, the local panel and a fault are left alone: there STOP would disturb, or do nothing.  The
    daemon itself goes on; SIGTERM ends it.

    Exit status: 0 sent; 1 no daemon, no permission, or it runs with --shadow.
    """
    say("stop", config, state, is_rehearsal=rehearsal)


def stow(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Send the antenna to the ACU's stow position, and keep it there until `acu-daemon unstow`.

    Nothing is tracked meanwhile; it holds through restarts and for later passes.  A stow by the wind or between passes
    becomes a person's by it.  Refused while disarmed, under the local panel, with an interlock open or a latched axis,
    and where the straight way leads through a keep-out.

    Exit status: 0 asked; 1 refused, no daemon or no permission.
    """
    say("stow", config, state, is_rehearsal=rehearsal)


def unstow(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """End a stow, whoever's it is.  The antenna stands where it is until a pass is near; then it leaves the stow.

    Refused while the wind is strong: then the stow ends by itself once it is calm.

    Exit status: 0; 1 refused, no daemon or no permission.
    """
    say("unstow", config, state, is_rehearsal=rehearsal)


def hold(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Leave autotrack, and have the antenna follow the prediction, to the end of the pass or until `acu-daemon track`.

    Exit status: 0; 1 no pass is on, disarmed, no daemon or no permission.
    """
    say("hold", config, state, is_rehearsal=rehearsal)


def track(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """End a `hold`: autotrack is selected again on the path.

    Exit status: 0; 1 no pass is on, disarmed, no daemon or no permission.
    """
    say("track", config, state, is_rehearsal=rehearsal)


def nudge(
    config: Config = None,
    state: State = None,
    rehearsal: Rehearsal = False,
    along_s: Annotated[
        float | None,
        typer.Option("--along-s", metavar="S", help="Seconds late: -60 to 60.  Left out: as it is."),
    ] = None,
    across_deg: Annotated[
        float | None,
        typer.Option("--across-deg", metavar="DEG", help="Right of the motion, degrees: -5 to 5.  Left out: as it is."),
    ] = None,
    keep: Annotated[
        bool,
        typer.Option("--keep", help="The satellite's next passes begin with it too, while these elements hold."),
    ] = False,
) -> None:
    """Move the path that the antenna is led along: in all so many seconds late, and degrees across.

    Both 0 undo it.  It ends with the pass, and when a fit makes the path anew; autotrack goes where the signal is.

    Exit status: 0; 1 no pass is on, disarmed, no daemon or no permission.
    """
    given = {"along_s": along_s, "across_deg": across_deg, "keep": "yes" if keep else None}
    words = [f"{name}={value}" for name, value in given.items() if value is not None]
    say(" ".join(["nudge", *words]), config, state, is_rehearsal=rehearsal)


def skip(
    config: Config = None, state: State = None, rehearsal: Rehearsal = False, satellite: Satellite = None, at: At = None
) -> None:
    """Give a pass up: the one of --satellite at --at, else the one that is on, with a safe stop, else the next one.

    Of a running station (`run` without --satellite).  `unskip` withdraws it; where none runs, `schedule --exclude` is
    for the same.

    Exit status: 0; 1 refused, no station or no permission.
    """
    say(_about_pass("skip", satellite, at), config, state, is_rehearsal=rehearsal)


def unskip(
    satellite: Named, at: Time, config: Config = None, state: State = None, rehearsal: Rehearsal = False
) -> None:
    """Withdraw a word about a pass: it is tracked or not as the plan says.

    Exit status: 0; 1 refused, no station or no permission.
    """
    say(_about_pass("unskip", satellite, at), config, state, is_rehearsal=rehearsal)


def _about_pass(verb: str, satellite: str | None, at: str | None) -> str:
    given = {"satellite": satellite, "at": at}
    return " ".join([verb, *(f"{name}={value}" for name, value in given.items() if value is not None)])


def reload(config: Config = None, state: State = None, rehearsal: Rehearsal = False) -> None:
    """Have a running station (`run` without --satellite) read its files and elements again, between passes.

    A bad file is refused with its reason, in the log, and what was read before stays.  SIGHUP does the same where the
    station has no terminal.

    Exit status: 0 asked; 1 no daemon, no permission, or it tracks a single satellite.
    """
    say("reload", config, state, is_rehearsal=rehearsal)


def status(
    config: Config = None,
    state: State = None,
    rehearsal: Rehearsal = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="One line of JSON, with every figure; docs/status.md tells each key.")
    ] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Go on showing it, redrawn twice a second, until Ctrl-C.")
    ] = False,
) -> None:
    """Print what the running daemon does: the verdict, alarms, the pass, where the antenna points, the prediction.

    --watch is a live view, and goes on through a restart of the daemon; scripts take --json, or `acu-daemon wait`.

    Exit status: 0; 1 no daemon or no permission.
    """
    if as_json:
        typer.echo(ask(find_daemon("status", config, state, is_rehearsal=rehearsal), "status"))
        return
    if watch:
        let_rich_load()
        from acu_daemon.cli.status_watch import watch_status  # slow to load, and no other command needs it

        watch_status(lambda: asked_snapshot(config, state, is_rehearsal=rehearsal))
        return
    text = "\n".join(status_lines(asked_snapshot(config, state, is_rehearsal=rehearsal)))
    typer.echo(with_choice(text, choice_text(config, state, is_rehearsal=rehearsal)))
