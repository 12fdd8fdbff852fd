"""The listening socket of the page: lets connections in at a bounded pace, bounds their number, ends the slow ones.

asyncio's own server takes as many as come in one turn of the loop, and waits for a request for ever: either would be
felt by the tick.  What is not let in waits in the kernel's queue, or is turned away there.
"""

import asyncio
import contextlib
import socket
from collections.abc import Callable

from acu_daemon.errors import UsageError
from acu_daemon.web.guard import Allowance

QUEUE = 64  # of the kernel
PER_S, AT_ONCE = 30.0, 20.0  # connections let in; a page needs five
MOST_WAITING = 24  # connections whose request is not whole, or not answered
PATIENCE_S = 8.0  # with one of them
SEND_BYTES = 65536  # of the kernel's buffer: a reader that does not read holds no more than that


class PageSocket:
    """Owned by the loop.  make_protocol: of aiohttp's server."""

    def __init__(self, make_protocol: Callable[[], asyncio.Protocol]) -> None:
        self._make_protocol = make_protocol
        self._listener: socket.socket | None = None
        self._task: asyncio.Task[None] | None = None
        self._allowance = Allowance.of(PER_S, AT_ONCE)
        self._waiting: dict[asyncio.BaseTransport, asyncio.TimerHandle] = {}

    def open(self, host: str, port: int) -> tuple[str, int]:
        """Listen; returns address and port, which port 0 chooses.  UsageError: it cannot be."""
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(
                host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE | socket.AI_NUMERICHOST
            )[0]
            listener = socket.socket(family, kind, protocol)
        except OSError as error:
            raise UsageError(f"[web] listen {host}:{port}: {error.strerror}; expected an ADDRESS of numbers") from None
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
            listener.bind(address)
            listener.listen(QUEUE)
            listener.setblocking(False)
        except OSError as error:
            listener.close()
            advice = "another program has it, or it is no address of this machine; choose another by --web or listen"
            raise UsageError(f"[web] listen {host}:{port}: {error.strerror}; {advice}") from None
        self._listener = listener
        self._task = asyncio.create_task(self._let_in(listener), name="page")
        found = listener.getsockname()
        return str(found[0]), int(found[1])

    async def close(self) -> None:
        """Listen no more."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
        if self._listener is not None:
            self._listener.close()
        for transport in [*self._waiting]:
            self._end(transport)

    def settle(self, transport: asyncio.BaseTransport | None) -> None:
        """A connection's request is answered, or it is a live one: its deadline is off."""
        if transport is not None and (timer := self._waiting.pop(transport, None)) is not None:
            timer.cancel()

    async def _let_in(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            if not self._allowance.take(loop.time()):
                await asyncio.sleep(self._allowance.wait_s())
                continue
            try:
                connection, _ = await loop.sock_accept(listener)
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                transport, _ = await loop.connect_accepted_socket(self._make_protocol, connection)
            except OSError:  # the peer went away, or the system has no room for it
                await asyncio.sleep(1.0 / PER_S)
                continue
            for gone in [one for one in self._waiting if one.is_closing()]:
                self.settle(gone)
            if len(self._waiting) >= MOST_WAITING:
                self._end(next(iter(self._waiting)))  # the oldest: whoever is honest is answered long before
            self._waiting[transport] = loop.call_later(PATIENCE_S, self._end, transport)

    def _end(self, transport: asyncio.BaseTransport) -> None:
        self.settle(transport)
        if isinstance(transport, asyncio.WriteTransport):
            transport.abort()
