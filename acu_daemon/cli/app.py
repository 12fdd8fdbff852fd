"""The command line itself: one typer app, and the exit status of every kind of failure."""

import os
import sys
import traceback
from typing import Annotated

import typer

from acu_daemon import __version__
from acu_daemon.cli import check, demo, fake_acu, fault_proxy, hands, latency_test, passes, replay, run, safe_stop
from acu_daemon.errors import AcuDaemonError, NoAcuError, UsageError

EXIT_FAILED, EXIT_USAGE, EXIT_NO_ACU, EXIT_INTERNAL = 1, 2, 3, 4

app = typer.Typer(
    name="acu-daemon",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""
    Assisted tracking: keeps an antenna on a low-orbit satellite when its signal is lost.

    While the antenna control unit (ACU) autotracks, the daemon learns from its angles where the orbit really is, and
    keeps the ACU's remote command registers on the satellite ten times a second.  When the signal is lost the antenna
    follows the prediction, and is still on the satellite when the signal comes back.

    First steps:  acu-daemon demo;  acu-daemon passes --config config;
    acu-daemon check --config config;  acu-daemon run --config config --satellite NAME.

    Exit status: 0 done, 1 the check or the pass failed, 2 wrong use or configuration, 3 no ACU within 10 s, 4 internal
    error.
    """,
)


def _version(is_asked: bool) -> None:
    if is_asked:
        typer.echo(f"acu-daemon {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    _version_asked: Annotated[
        bool, typer.Option("--version", help="Show the version and end.", callback=_version, is_eager=True)
    ] = False,
) -> None:
    """Options before the command."""


app.command(name="run")(run.command)
app.command(name="fake-acu")(fake_acu.command)
app.command(name="fault-proxy")(fault_proxy.command)
app.command(name="demo")(demo.command)
app.command(name="passes")(passes.command)
app.command(name="check")(check.command)
app.command(name="latency-test")(latency_test.command)
app.command(name="replay")(replay.command)
app.command(name="safe-stop")(safe_stop.command)
for person_says in (hands.arm, hands.disarm, hands.clear, hands.status):
    app.command()(person_says)


def main() -> None:
    """Run a command; every failure ends with its exit status and a message that says what to do."""
    try:
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
