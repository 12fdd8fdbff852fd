"""SIMULATION served over TCP and over a pseudo terminal, as ICD section 1 asks of an ACU."""

import asyncio
import contextlib
import os
import tty
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from acu_daemon.edge.clock import Clock
from acu_daemon.errors import UsageError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.line import AcuLine

TCP_GAP_S = 0.250
PTY_GAP_S = 0.050
SILENT_S = 5.0  # a client that was silent for this long is replaced by a new one
ADVANCE_S = 0.1
READ_BYTES = 4096


async def keep_time(acu: FakeAcu, clock: Clock) -> None:
    """Let the servo tick while nobody speaks, so that the trace goes on; for ever."""
    while True:
        acu.advance(clock.tai_s())
        await asyncio.sleep(ADVANCE_S)


@contextlib.asynccontextmanager
async def serve_tcp(acu: FakeAcu, clock: Clock, host: str, port: int) -> AsyncIterator[str]:
    """Serve on a TCP port, one client at a time; yields the URL (port 0: any free one).  UsageError: cannot listen."""
    seat = _Seat()
    try:
        server = await asyncio.get_running_loop().create_server(lambda: _Client(acu, clock, seat), host, port)
    except OSError as error:
        raise UsageError(f"cannot listen on tcp://{host}:{port}: {error.strerror or error}") from None
    try:
        yield f"tcp://{host}:{server.sockets[0].getsockname()[1]}"
    finally:
        server.close()
        if seat.client is not None:
            seat.client.leave()
        await server.wait_closed()


class _Seat:
    """The one place for a client."""

    def __init__(self) -> None:
        self.client: _Client | None = None


class _Client(asyncio.Protocol):
    def __init__(self, acu: FakeAcu, clock: Clock, seat: _Seat) -> None:
        self._acu, self._clock, self._seat = acu, clock, seat
        self._loop = asyncio.get_running_loop()
        self._heard_s = self._loop.time()
        self._line: AcuLine | None = None
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if not isinstance(transport, asyncio.Transport):
            raise TypeError("a stream transport is needed")
        self._transport = transport
        present = self._seat.client
        if present is not None:
            if present.silence_s < SILENT_S:
                transport.close()
                return
            present.leave()
        self._seat.client = self
        self._line = AcuLine(self._acu, self._clock, transport.write, gap_s=TCP_GAP_S)

    @property
    def silence_s(self) -> float:
        return self._loop.time() - self._heard_s

    def leave(self) -> None:
        """Make room at once."""
        if self._seat.client is self:
            self._seat.client = None
        if self._line is not None:
            self._line.close()
        if self._transport is not None:
            self._transport.abort()

    def data_received(self, data: bytes) -> None:
        self._heard_s = self._loop.time()
        if self._line is not None:
            self._line.receive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self.leave()


@contextlib.asynccontextmanager
async def serve_pty(acu: FakeAcu, clock: Clock, link: Path, baud: int) -> AsyncIterator[str]:
    """Serve on a pseudo terminal, paced at the baud rate both ways, found at a symbolic link; yields the URL.

    UsageError: the link cannot be made.
    """
    master, slave = os.openpty()
    try:
        tty.setraw(slave)
        os.set_blocking(master, False)
        loop = asyncio.get_running_loop()

        def send(piece: bytes) -> None:
            with contextlib.suppress(BlockingIOError):  # nobody reads: lost, as on a wire
                os.write(master, piece)

        line = AcuLine(acu, clock, send, gap_s=PTY_GAP_S, byte_time_s=10.0 / baud)
        with _symbolic_link(link, os.ttyname(slave)) as path:
            loop.add_reader(master, lambda: line.receive(os.read(master, READ_BYTES)))
            try:
                yield f"serial://{path}?baud={baud}"
            finally:
                loop.remove_reader(master)
                line.close()
    finally:
        os.close(slave)  # held open until now, so that the line outlives its clients
        os.close(master)


@contextlib.contextmanager
def _symbolic_link(link: Path, device: str) -> Iterator[Path]:
    if link.exists() and not link.is_symlink():
        raise UsageError(f"--pty {link} exists and is no symbolic link; choose another name")
    try:
        link.unlink(missing_ok=True)
        link.symlink_to(device)
    except OSError as error:
        raise UsageError(f"--pty {link} cannot be made: {error.strerror}") from None
    try:
        yield link.absolute()
    finally:
        link.unlink(missing_ok=True)
