"""The command line itself: one typer app, and the exit status of every kind of failure."""

import contextlib
import gc
import io
import os
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Annotated, TextIO

import typer

from acu_daemon import __version__
from acu_daemon.edge.denied import denied
from acu_daemon.edge.leap_seconds_file import adopt_system_leap_seconds
from acu_daemon.errors import AcuDaemonError, NoAcuError, UsageError

EXIT_FAILED, EXIT_USAGE, EXIT_NO_ACU, EXIT_INTERNAL = 1, 2, 3, 4


@dataclass(frozen=True, slots=True)
class Group:
    """Commands under one word, such as `acu-daemon groundtrack simulate`."""

    help: str
    commands: Mapping[str, tuple[str, str]]  # as in COMMANDS


COMMANDS = {  # name: module of acu_daemon.cli, and the function in it
    "init": ("init", "command"),
    "run": ("run", "command"),
    "fake-acu": ("fake_acu", "command"),
    "fault-proxy": ("fault_proxy", "command"),
    "demo": ("demo", "command"),
    "rehearse": ("rehearse", "command"),
    "passes": ("coming_passes", "command"),
    "plan": ("pass_plan_command", "command"),
    "schedule": ("schedule_command", "command"),
    "pause": ("schedule_command", "pause"),
    "check": ("check", "command"),
    "latency-test": ("latency_test", "command"),
    "replay": ("replay_recording", "command"),
    "report": ("report_command", "command"),
    "safe-stop": ("safe_stop", "command"),
    "arm": ("operator_commands", "arm"),
    "disarm": ("operator_commands", "disarm"),
    "clear": ("operator_commands", "clear"),
    "stop": ("operator_commands", "stop"),
    "stow": ("operator_commands", "stow"),
    "unstow": ("operator_commands", "unstow"),
    "hold": ("operator_commands", "hold"),
    "track": ("operator_commands", "track"),
    "nudge": ("operator_commands", "nudge"),
    "skip": ("operator_commands", "skip"),
    "unskip": ("operator_commands", "unskip"),
    "grant": ("lease_commands", "grant"),
    "revoke": ("lease_commands", "revoke"),
    "reload": ("operator_commands", "reload"),
    "status": ("operator_commands", "status"),
    "wait": ("wait", "command"),
}
GROUPS: dict[str, Group] = {
    "elements": Group(
        "Where the satellites' elements come from, how fresh they are, and who is asked for newer ones.",
        {
            "show": ("elements_commands", "show"),
            "fetch": ("elements_commands", "fetch"),
            "resume": ("elements_commands", "resume"),
        },
    ),
    "groundtrack": Group(
        "Keep a phased satellite's ground track: simulate it (Galski and Orlando 2011), see it in elements and passes.",
        {
            "simulate": ("groundtrack_simulate", "command"),
            "reproduce": ("groundtrack_reproduce", "command"),
            "from-elements": ("groundtrack_elements", "command"),
            "from-passes": ("groundtrack_passes", "command"),
        },
    ),
    "mount": Group(
        """
        What the station remembers of its antenna: zero points of the encoders, axes, sag, the scale of the refraction.

        Every pass that `run` tracks to its end adds to it, whatever the satellite, and the next one begins with it:
        docs/estimation.md, Memory of the mount.  Nothing of it goes into a command but through the fit of a pass; what
        is to hold always goes into [mount] of station.toml, and `mount fit` says what that would be.
        """,
        {
            "show": ("mount_commands", "show"),
            "fit": ("mount_commands", "fit"),
            "forget": ("mount_commands", "forget"),
        },
    ),
    "onboard": Group(
        """
        The antenna on the satellite: tracking profiles of a steerable downlink antenna over a pass (Song et al. 2016).

        A pass is described in a PASS.toml (docs/onboard.md shows one).  `profile` makes its profile and writes the
        tracking-parameter file, `check` reads such a file back, `scenarios` compares the methods on made passes.
        """,
        {
            "profile": ("onboard_commands", "profile"),
            "check": ("onboard_commands", "check"),
            "scenarios": ("onboard_commands", "scenarios"),
        },
    ),
}
HELP = """
    Assisted tracking: keeps an antenna on a low-orbit satellite when its signal is lost.

    While the antenna control unit (ACU) autotracks, the daemon learns from its angles where the orbit really is, and
    keeps the ACU's remote command registers on the satellite ten times a second.  When the signal is lost the antenna
    follows the prediction, and is still on the satellite when the signal comes back.

    First steps, in a clone of the project (its satellite is one of 1989, so they are rehearsed there and then):

    \b
      acu-daemon demo
      acu-daemon passes --config config --from 1989-02-01T00:00:00Z
      acu-daemon fake-acu --config config --satellite scd-1 --at 1989-02-01T01:58:30Z &
      acu-daemon check --config config --at 1989-02-01T01:58:30Z
      acu-daemon run --config config --satellite scd-1 --at 1989-02-01T01:58:30Z

    `acu-daemon status --rehearsal` in another terminal tells what it does; Ctrl-C stops it safely.  Then your own
    station: `acu-daemon init DIR` writes its files, `acu-daemon rehearse` flies its next pass now (docs/tutorial.md).

    Exit status: 0 done, 1 the check or the pass failed, 2 wrong use or configuration, 3 no ACU within 10 s, 4 internal
    error.
    """


def _version(is_asked: bool) -> None:
    if is_asked:
        typer.echo(f"acu-daemon {__version__}")
        raise typer.Exit


def _common(
    _version_asked: Annotated[
        bool, typer.Option("--version", help="Show the version and end.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before the command."""


def make_app(asked: Sequence[str]) -> typer.Typer:
    """The command line for these arguments; of the commands' modules only those that they ask for are loaded.

    A restart in mid-pass is in a hurry.  Where no command is named, for the help, all are loaded.
    """
    app = _typer("acu-daemon", HELP)
    app.callback()(_common)
    word = asked[0] if asked else ""
    is_known = word in COMMANDS or word in GROUPS
    _add(app, COMMANDS, [word] if is_known else COMMANDS)
    for name in [word] if is_known else GROUPS:
        if (group := GROUPS.get(name)) is not None:
            under = _typer(name, group.help)
            under.callback()(_group)  # so that a group of one command keeps its word
            _add(under, group.commands, asked[1:2] if asked[1:2] and asked[1] in group.commands else group.commands)
            app.add_typer(under, name=name)
    return app


def _typer(name: str, text: str) -> typer.Typer:
    return typer.Typer(
        name=name,
        no_args_is_help=True,
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
        help=text,
    )


def _group() -> None:
    pass


def _add(app: typer.Typer, commands: Mapping[str, tuple[str, str]], names: Iterable[str]) -> None:
    for name in names:
        if name in commands:
            module, function = commands[name]
            app.command(name=name)(getattr(import_module(f"acu_daemon.cli.{module}"), function))


def main() -> None:
    """Run a command; every failure ends with its exit status and a message that says what to do."""
    have_streams()
    try:
        try:
            app = make_app(sys.argv[1:])
            adopt_system_leap_seconds()
            gc.freeze()  # what was loaded stays: no collection has to look at it again
            gc.enable()
            app()
        finally:
            sys.stdout.flush()  # while what a full disk says can still be told
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001  the last word of the program
        sys.exit(_last_word(error))


def have_streams() -> None:
    """Make sure that output goes somewhere, and that no name of a station is too much for the locale.

    A stream that whoever started this program has closed is put on /dev/null: else the next file that is opened takes
    its number, and what a library prints goes into that.
    """
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest free number: this one
        stream = getattr(sys, name)
        if stream is None:
            mode = "r" if name == "stdin" else "w"
            setattr(sys, name, open(descriptor, mode, errors="backslashreplace", closefd=False))  # noqa: SIM115
        elif name != "stdin" and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _last_word(error: BaseException) -> int:
    """Say what went wrong; returns the exit status."""
    match error:
        case KeyboardInterrupt():
            return 130
        case NoAcuError():
            return _complain(str(error), EXIT_NO_ACU)
        case UsageError():
            return _complain(str(error), EXIT_USAGE)
        case AcuDaemonError():
            return _complain(str(error), EXIT_FAILED)
        case BrokenPipeError():  # whoever read our output has gone, such as `| head`
            _forget(sys.stdout, 1)
            return EXIT_FAILED
    if words := denied(error):
        where = "standard output: " if _forget(sys.stdout, 1) else ""
        return _complain(f"the system denies what this needs: {where}{words}", EXIT_USAGE)
    traceback.print_exception(error)
    return _complain("internal error; please report the lines above", EXIT_INTERNAL)


def _forget(stream: TextIO, descriptor: int) -> bool:
    """Whether a stream cannot be written; then what it still holds is not tried again at the end."""
    try:
        stream.flush()
    except OSError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
        return True
    return False


def _complain(text: str, status: int) -> int:
    with contextlib.suppress(OSError):  # standard error may be full or gone
        for line in text.splitlines():
            print(f"acu-daemon: {line}", file=sys.stderr)  # noqa: T201
    _forget(sys.stderr, 2)
    return status
