"""SIMULATION of the ACU's end of a TCP connection, with its faults (docs/protocol.md, Link); sim.pty has a terminal's.

What stands behind it, the fake ACU or the way to a real one, is a Peer.
"""

import asyncio
import contextlib
import socket
import struct
from collections.abc import AsyncIterator, Callable
from math import inf
from typing import Protocol, get_args

from acu_daemon.edge.clock import Clock
from acu_daemon.errors import UsageError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import Fault, LineVerb, VerbName
from acu_daemon.sim.line import AcuLine

TCP_GAP_S = 0.250
PTY_GAP_S = 0.050
SILENT_S = 5.0  # a client that was silent for this long is replaced by a new one
ADVANCE_S = 0.1
_RESET = struct.pack("ii", 1, 0)  # SO_LINGER on, 0 s: close() sends RST
TCP_FAULTS: frozenset[VerbName] = frozenset(get_args(LineVerb))


class Peer(Protocol):
    """Takes what a client sends."""

    def receive(self, data: bytes) -> None: ...

    def close(self) -> None: ...


Send = Callable[[bytes], None]
MakePeer = Callable[[Send, Callable[[], None]], Peer]  # send: to the client; hang_up: the peer has gone


def acu_peer(acu: FakeAcu, clock: Clock, board: FaultBoard, baud: int = 0) -> MakePeer:
    """The fake ACU as a peer; baud: it paces both directions."""
    gap_s, byte_time_s = (PTY_GAP_S, 10.0 / baud) if baud else (TCP_GAP_S, 0.0)
    return lambda send, _hang_up: AcuLine(acu, clock, send, gap_s=gap_s, byte_time_s=byte_time_s, board=board)


async def keep_time(acu: FakeAcu, clock: Clock) -> None:
    """Let the servo tick while nobody speaks, so that the trace goes on; for ever."""
    while True:
        acu.advance(clock.tai_s())
        await asyncio.sleep(ADVANCE_S)


@contextlib.asynccontextmanager
async def serve_tcp(make_peer: MakePeer, board: FaultBoard, host: str, port: int) -> AsyncIterator[str]:
    """Serve on a TCP port, one client at a time; yields the URL (port 0: any free one).  UsageError: cannot listen."""
    door = _Door(make_peer, board, host)
    try:
        await door.open(port)
    except OSError as error:
        raise UsageError(f"cannot listen on tcp://{host}:{port}: {error.strerror or error}") from None
    board.listen(door.on_fault)
    try:
        yield f"tcp://{host}:{door.port}"
    finally:
        await door.close()


class _Door:
    """The listening socket, and the one place for a client."""

    def __init__(self, make_peer: MakePeer, board: FaultBoard, host: str) -> None:
        self.make_peer, self.board = make_peer, board
        self._host = host
        self._server: asyncio.Server | None = None
        self._loop = asyncio.get_running_loop()
        self.port = 0
        self.client: _Client | None = None
        self.clients: set[_Client] = set()  # the dead ones too
        self.taken_until_s = 0.0
        self._opening: asyncio.Task[None] | None = None

    async def open(self, port: int) -> None:
        self._server = await self._loop.create_server(lambda: _Client(self), self._host, port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        if self._opening is not None:
            await self._opening
        for client in tuple(self.clients):
            client.leave()
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()

    @property
    def is_closed_to_all(self) -> bool:
        is_taken = self._loop.time() < self.taken_until_s
        return is_taken or self.board.is_on("accept-then-close") or self.board.is_on("second-client")

    def on_fault(self, fault: Fault, is_on: bool) -> None:
        client = self.client
        match fault.verb:
            case "refuse" if is_on and self._server is not None:
                self._server.close()
                self._server = None
            case "refuse" if not is_on:
                self._opening = self._loop.create_task(self.open(self.port))
            case "slow-close" if not is_on:
                self.taken_until_s = -inf
            case "half-open" if client is not None:
                client.is_dead = True
                self.client = None  # a new connection works
            case "deaf" if client is not None:
                client.set_deaf(is_on)
            case "reset" if client is not None:
                client.leave()
            case "second-client" if is_on and client is not None:
                client.leave()


class _Client(asyncio.Protocol):
    def __init__(self, door: _Door) -> None:
        self._door = door
        self._loop = asyncio.get_running_loop()
        self._heard_s = self._loop.time()
        self._peer: Peer | None = None
        self._transport: asyncio.Transport | None = None
        self.is_dead = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if not isinstance(transport, asyncio.Transport):
            raise TypeError("a stream transport is needed")
        self._transport, door = transport, self._door
        door.clients.add(self)
        present = door.client
        if door.is_closed_to_all or (present is not None and present.silence_s < SILENT_S):
            transport.close()
            return
        if present is not None:
            present.leave()
        door.client = self
        self._peer = door.make_peer(self._send, self.leave)
        if door.board.is_on("deaf"):
            self.set_deaf(True)

    @property
    def silence_s(self) -> float:
        return self._loop.time() - self._heard_s

    def set_deaf(self, is_deaf: bool) -> None:
        """Read no more, so that what the client writes waits in the network; or read it all."""
        if self._transport is None or self._transport.is_closing():
            return
        if is_deaf:
            self._transport.pause_reading()
        else:
            self._transport.resume_reading()

    def _send(self, data: bytes) -> None:
        if self._transport is not None and not self.is_dead:
            self._transport.write(data)

    def leave(self) -> None:
        """Make room at once; the client sees a reset."""
        self._forget()
        if self._transport is not None:
            with contextlib.suppress(OSError):
                self._transport.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
            self._transport.abort()

    def _forget(self) -> None:
        if self._door.client is self:
            self._door.client = None
        if self._peer is not None:
            self._peer.close()
            self._peer = None

    def data_received(self, data: bytes) -> None:
        self._heard_s = self._loop.time()
        if self._peer is not None and not self.is_dead:
            self._peer.receive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._door.clients.discard(self)
        if self._door.client is self and self._door.board.is_on("slow-close"):
            self._door.taken_until_s = self._loop.time() + self._door.board.amount("slow-close")
        self._forget()
