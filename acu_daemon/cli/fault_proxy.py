"""`acu-daemon fault-proxy`: a line between daemon and ACU that goes wrong when it is told to."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.serving import Control, Place, parse_place, serve_until_stopped
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.link import BITS_PER_CHARACTER, DEFAULT_BAUD, Link, make_link
from acu_daemon.edge.rehearsal_clock import lead
from acu_daemon.errors import UsageError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import FRAME_VERBS, Fault
from acu_daemon.sim.proxy import proxy_peer
from acu_daemon.sim.scenario import read_faults


def command(
    to: Annotated[
        str, typer.Option("--to", metavar="HOST:PORT|DEVICE|URL", help="The ACU.  A device may say DEVICE?baud=9600.")
    ],
    listen: Annotated[
        str | None, typer.Option("--listen", metavar="HOST:PORT", help="Serve on TCP; port 0 takes a free one.")
    ] = None,
    pty: Annotated[
        Path | None,
        typer.Option("--pty", metavar="LINK", help="Serve on a pseudo terminal and put a symbolic link to it here."),
    ] = None,
    control: Control = None,
    scenario: Annotated[
        Path | None, typer.Option("--scenario", metavar="FILE", help="TOML; only its [[fault]] tables count here.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Added to the seed of every fault of the file.")] = 0,
) -> None:
    """A bad line: passes everything on between a host and an ACU, real or simulated, with faults when told to.

    Prints `listening tcp://HOST:PORT` (or the link of the pseudo terminal) when it is ready; ends on SIGTERM or Ctrl-C.
    Point the daemon's acu.url at it.  Faults come from [[fault]] tables or live over --control, such as
    `fault xor-blind probability=0.1 duration_s=20`; `help` there lists the verbs.  Those of the ACU and the pedestal
    need the simulated ACU's own --control.  Never leave it in a line that moves a dish unattended.
    """
    if (listen is None) == (pty is None):
        raise UsageError("give --listen HOST:PORT or --pty LINK, one of them")
    faults = () if scenario is None else read_faults(scenario, seed)
    byte_time_s = _link(to).byte_time_s
    if pty is None:
        place = Place(*parse_place("--listen", listen or ""))
    else:
        place = Place(pty=pty, baud=round(BITS_PER_CHARACTER / byte_time_s) if byte_time_s else DEFAULT_BAUD)
    run_loop(_serve, to, place, control, faults)


async def _serve(to: str, place: Place, control: str | None, faults: tuple[Fault, ...]) -> None:
    board = FaultBoard(FRAME_VERBS | place.line_verbs)
    peer = proxy_peer(lambda: _link(to), board)
    with contextlib.ExitStack() as ends:

        def stand(where: str) -> None:
            ends.enter_context(lead(where, _url(to)))

        await serve_until_stopped(peer, board, place, control, faults, on_listening=stand)


def _link(to: str) -> Link:
    """The link of --to, not yet open."""
    return make_link(_url(to))


def _url(to: str) -> str:
    return to if "://" in to else f"serial://{to}" if to.startswith("/") else f"tcp://{to}"
