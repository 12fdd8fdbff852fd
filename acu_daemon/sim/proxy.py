"""SIMULATION of a bad line: stands between a host and an ACU, real or simulated, and lets faults act on what passes."""

import asyncio
from collections.abc import Callable

from acu_daemon.edge.link import Link
from acu_daemon.errors import LinkError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.frame_faults import FaultyWire
from acu_daemon.sim.server import MakePeer, Send

RETRY_S = 0.5


class ProxyPeer:
    """The way from one client to the ACU; opens it, and hangs the client up when it ends."""

    def __init__(self, link: Link, board: FaultBoard, send: Send, hang_up: Callable[[], None]) -> None:
        self._link = link
        self._hang_up = hang_up
        self._wire = FaultyWire(board, send, self._to_acu)
        self._is_open = False
        self._waiting: list[bytes] = []
        self._task = asyncio.get_running_loop().create_task(self._run())

    def receive(self, data: bytes) -> None:
        """Take what the client sent."""
        self._wire.from_host(data)

    def close(self) -> None:
        """The client has gone."""
        self._task.cancel()

    def _to_acu(self, data: bytes) -> None:
        if not self._is_open:
            self._waiting.append(data)
            return
        try:
            self._link.write(data)
        except LinkError:  # the reader sees it too, and ends
            self._is_open = False

    async def _run(self) -> None:
        try:
            await self._link.open()
            self._is_open = True
            for data in self._waiting:
                self._link.write(data)
            while True:
                self._wire.from_acu((await self._link.read())[0])
        except LinkError:
            await asyncio.sleep(RETRY_S)  # a terminal is opened anew at once: no faster than this
            asyncio.get_running_loop().call_soon(self._hang_up)
        finally:
            self._is_open = False
            await self._link.close()


def proxy_peer(make_link: Callable[[], Link], board: FaultBoard) -> MakePeer:
    """The ACU behind a link as a peer; every client gets a connection of its own to it."""
    return lambda send, hang_up: ProxyPeer(make_link(), board, send, hang_up)
