"""The ACU's bytes over TCP."""

import asyncio
import contextlib
import math
import socket
import struct
from collections.abc import Callable
from functools import partial

from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.edge.host_name import HostName
from acu_daemon.errors import LinkError, LinkRefusedError

CONNECT_TIMEOUT_S = 1.0  # with the back-off still well inside the service's watchdog
_DROP_UNSENT = struct.pack("ii", 1, 0)  # SO_LINGER on, 0 s: close() throws away what has not arrived


class TcpLink:
    """A TCP connection to an ACU or to a terminal server in front of it; can be opened again after close()."""

    def __init__(self, host: str, port: int, byte_time_s: float, monotonic: Callable[[], float]) -> None:
        self._name, self._port = HostName(host), port
        self._monotonic = monotonic
        self.byte_time_s = byte_time_s
        baud = f"?baud={round(10.0 / byte_time_s)}" if byte_time_s else ""
        self.description = f"tcp://{f'[{host}]' if ':' in host else host}:{port}{baud}"
        self._connection: _Connection | None = None
        self._first = 0  # of the addresses: where the next attempt begins
        self.address_count = 1

    async def open(self) -> None:
        """Connect.  LinkRefusedError: nobody listens; LinkError: no way there.

        The addresses of the host are tried in their order.  One that does not answer ends the attempt, so that none
        takes longer than the service's watchdog waits, and the next attempt begins with the address after it.
        """
        try:
            async with asyncio.timeout(CONNECT_TIMEOUT_S):
                addresses = await self._name.addresses()
        except TimeoutError:
            raise LinkError(
                f"{self.description}: its name server does not answer within {CONNECT_TIMEOUT_S:g} s"
            ) from None
        except OSError as error:
            raise self._unreachable(error) from None
        self.address_count = len(addresses)
        self._connection = await self._connect(addresses)

    async def _connect(self, addresses: list[str]) -> "_Connection":
        loop, refused = asyncio.get_running_loop(), OSError("the host has no address")
        make = partial(_Connection, self.description, self._monotonic)
        first = self._first % max(1, len(addresses))
        for index, address in enumerate(addresses[first:] + addresses[:first], first):
            self._first = index
            try:
                async with asyncio.timeout(CONNECT_TIMEOUT_S):
                    _, connection = await loop.create_connection(make, address, self._port)
            except TimeoutError:
                self._first = index + 1
                raise self._unanswered(address, len(addresses)) from None
            except OSError as error:
                refused = error
            except RuntimeError as error:  # an address with a scope is looked up in a thread
                refused = OSError(str(error))
            else:
                return connection
        raise self._unreachable(refused)

    def _unanswered(self, address: str, address_count: int) -> LinkError:
        others = f" at {address}, one of {address_count} of its name" if address_count > 1 else ""
        return LinkError(
            f"{self.description} does not answer within {CONNECT_TIMEOUT_S:g} s{others}: "
            "check the address, that the ACU is on, and that no firewall drops the connection"
        )

    def _unreachable(self, error: OSError) -> LinkError:
        if isinstance(error, ConnectionRefusedError):
            return LinkRefusedError(
                f"nobody listens at {self.description}: check the port, and that the ACU or the simulator is on"
            )
        return LinkError(f"{self.description} cannot be reached: {error.strerror or error}")

    def write(self, data: bytes) -> None:
        """Send; never waits.  LinkError: not connected."""
        self._connected().write(data)

    async def read(self, until_s: float = math.inf) -> tuple[bytes, float]:
        """Wait for the next bytes and their arrival time.

        LinkError: the other side closed.  TimeoutError: nothing has come until then, on the loop's clock.
        """
        return await self._connected().arrivals.get(until_s)

    def drain_input(self) -> bytes:
        """Take what has arrived and was not read.  LinkError: not connected."""
        return self._connected().arrivals.take_all()

    async def close(self) -> None:
        """Close at once; what an unanswered exchange still had to send never goes out."""
        connection, self._connection = self._connection, None
        if connection is not None:
            await connection.close()

    def _connected(self) -> "_Connection":
        if self._connection is None:
            raise LinkError(f"{self.description} is not open")
        return self._connection


class _Connection(asyncio.Protocol):
    def __init__(self, description: str, monotonic: Callable[[], float]) -> None:
        self._description = description
        self._monotonic = monotonic
        self._transport: asyncio.Transport | None = None
        self._closed = asyncio.Event()
        self._is_answer_due = False
        self.arrivals = Arrivals()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        if isinstance(transport, asyncio.Transport):
            self._transport = transport
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def data_received(self, data: bytes) -> None:
        self._is_answer_due = False
        self.arrivals.put(data, self._monotonic())

    def connection_lost(self, exc: Exception | None) -> None:
        self._closed.set()
        if self.arrivals.has_had_any:
            self.arrivals.fail(LinkError(f"{self._description} was closed by the other side"))
        else:
            self.arrivals.fail(
                LinkRefusedError(f"{self._description} was closed at once: another client holds the ACU; stop it first")
            )

    def write(self, data: bytes) -> None:
        if self._transport is None or self._transport.is_closing():
            raise LinkError(f"{self._description} is closed")
        self._is_answer_due = True
        self._transport.write(data)

    async def close(self) -> None:
        if self._transport is None:
            return
        if self._is_answer_due:
            with contextlib.suppress(OSError):
                sock = self._transport.get_extra_info("socket")
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _DROP_UNSENT)
        self._transport.abort()
        await self._closed.wait()
