"""The command line itself: one typer app, and the exit status of every kind of failure."""

import gc
import os
import sys
import traceback
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Annotated

import typer

from acu_daemon import __version__
from acu_daemon.errors import AcuDaemonError, NoAcuError, UsageError

EXIT_FAILED, EXIT_USAGE, EXIT_NO_ACU, EXIT_INTERNAL = 1, 2, 3, 4


@dataclass(frozen=True, slots=True)
class Group:
    """Commands under one word, such as `acu-daemon groundtrack simulate`."""

    help: str
    commands: Mapping[str, tuple[str, str]]  # as in COMMANDS


COMMANDS = {  # name: module of acu_daemon.cli, and the function in it
    "run": ("run", "command"),
    "fake-acu": ("fake_acu", "command"),
    "fault-proxy": ("fault_proxy", "command"),
    "demo": ("demo", "command"),
    "passes": ("passes", "command"),
    "check": ("check", "command"),
    "latency-test": ("latency_test", "command"),
    "replay": ("replay", "command"),
    "safe-stop": ("safe_stop", "command"),
    "arm": ("hands", "arm"),
    "disarm": ("hands", "disarm"),
    "clear": ("hands", "clear"),
    "status": ("hands", "status"),
}
GROUPS: dict[str, Group] = {}
HELP = """
    Assisted tracking: keeps an antenna on a low-orbit satellite when its signal is lost.

    While the antenna control unit (ACU) autotracks, the daemon learns from its angles where the orbit really is, and
    keeps the ACU's remote command registers on the satellite ten times a second.  When the signal is lost the antenna
    follows the prediction, and is still on the satellite when the signal comes back.

    First steps:  acu-daemon demo;  acu-daemon passes --config config;
    acu-daemon check --config config;  acu-daemon run --config config --satellite NAME.

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
    try:
        app = make_app(sys.argv[1:])
        gc.freeze()  # what was loaded stays: no collection has to look at it again
        gc.enable()
        app()
    except NoAcuError as error:
        _complain(error)
        sys.exit(EXIT_NO_ACU)
    except UsageError as error:
        _complain(error)
        sys.exit(EXIT_USAGE)
    except AcuDaemonError as error:
        _complain(error)
        sys.exit(EXIT_FAILED)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # whoever read our output has gone, such as `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(EXIT_FAILED)
    except Exception:  # noqa: BLE001  the last word of the program: an error of ours, with all we know
        traceback.print_exc()
        print("acu-daemon: internal error; please report the lines above", file=sys.stderr)  # noqa: T201
        sys.exit(EXIT_INTERNAL)


def _complain(error: AcuDaemonError) -> None:
    for line in str(error).splitlines():
        print(f"acu-daemon: {line}", file=sys.stderr)  # noqa: T201
