"""What the simulated ACU and the fault proxy share: where they serve, their control port, and how they end."""

import asyncio
import contextlib
import sys
from collections.abc import Callable, Coroutine, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from acu_daemon.edge.signals import take_signals
from acu_daemon.errors import UsageError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_control import serve_control
from acu_daemon.sim.fault_verbs import Fault, FaultError, VerbName
from acu_daemon.sim.pty import PTY_FAULTS, serve_pty
from acu_daemon.sim.server import TCP_FAULTS, MakePeer, serve_tcp

Control = Annotated[
    str | None,
    typer.Option(
        "--control",
        metavar="HOST:PORT",
        help="Take faults live here: `fault VERB [KEY=VALUE ...]`, `list`, `clear [N|VERB]`, `help`.  Port 0 takes a "
        "free one; whoever reaches it can break things, so keep to 127.0.0.1.",
    ),
]


@dataclass(frozen=True, slots=True)
class Place:
    """A TCP port, or a pseudo terminal behind a link; baud: of a terminal that is paced."""

    host: str = ""
    port: int = 0
    pty: Path | None = None
    baud: int = 0

    @property
    def url(self) -> str:
        """Where it is found; of port 0, which takes a free one, nothing is known yet."""
        return f"serial://{self.pty.absolute()}" if self.pty is not None else f"tcp://{self.host}:{self.port}"

    @property
    def line_verbs(self) -> frozenset[VerbName]:
        """The faults of such a line."""
        return PTY_FAULTS if self.pty is not None else TCP_FAULTS


def parse_place(option: str, text: str) -> tuple[str, int]:
    """Host and port of an option.  UsageError: says what was expected."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or int(port) > 65535:
        raise UsageError(f"{option} {text!r}: expected HOST:PORT, such as 127.0.0.1:3842")
    return host, int(port)


async def serve_until_stopped(
    make_peer: MakePeer,
    board: FaultBoard,
    place: Place,
    control: str | None,
    faults: Iterable[Fault],
    beside: Callable[[], Coroutine[None, None, None]] | None = None,
    on_listening: Callable[[str], None] | None = None,
) -> None:
    """Serve, say where, and end on a signal.  UsageError: a fault that cannot be had.

    beside: what runs meanwhile; on_listening: takes the URL at which it is reached.
    """
    stopped = asyncio.Event()
    take_signals(asyncio.get_running_loop(), stop=lambda _: stopped.set(), told=lambda _: None)
    async with contextlib.AsyncExitStack() as servers:
        if place.pty is not None:
            where = await servers.enter_async_context(serve_pty(make_peer, board, place.pty, place.baud))
        else:
            where = await servers.enter_async_context(serve_tcp(make_peer, board, place.host, place.port))
        said = f"listening {where}\n"
        if on_listening is not None:
            on_listening(where)
        if control is not None:
            at = await servers.enter_async_context(serve_control(board, *parse_place("--control", control)))
            said += f"control {at}\n"
        for fault in faults:
            try:
                board.add(fault)
            except FaultError as error:
                raise UsageError(f"[[fault]] {error}") from None
        sys.stdout.write(said)
        sys.stdout.flush()
        await _until(stopped, beside)


async def _until(stopped: asyncio.Event, beside: Callable[[], Coroutine[None, None, None]] | None) -> None:
    tasks: set[asyncio.Task[Any]] = {asyncio.create_task(stopped.wait(), name="stop")}
    if beside is not None:
        tasks.add(asyncio.create_task(beside(), name="beside"))
    done, pending = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in pending:
        task.cancel()
    for task in done:
        task.result()
