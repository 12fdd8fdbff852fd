"""The page's server on a free port, before a daemon that is a few lines long."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from typing import Any

import aiohttp
import numpy as np

from acu_daemon.daemon.drawing import Aim, Backdrop, PathAhead
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import SystemClock
from acu_daemon.units import Array
from acu_daemon.web.feed import Feed
from acu_daemon.web.guard import seal_of
from acu_daemon.web.order_desk import OrderDesk
from acu_daemon.web.page_server import PageServer
from acu_daemon.web.recent_events import RecentEvents

TOKEN = b"0123456789abcdef"
PATIENCE_S = 60.0


class StandIn:
    """A daemon that only notes what it is asked."""

    is_station = True

    def __init__(self) -> None:
        self.asked: list[tuple[str, str]] = []

    def answer(self, line: str, who: str = "") -> str:
        self.asked.append((line, who))
        return "error not now" if line == "clear" else f"ok {line}"

    def aim(self) -> Aim | None:
        return Aim()

    def path_ahead(self) -> PathAhead | None:
        return PathAhead()

    def backdrop(self) -> Backdrop | None:
        return None

    def lateness_ms(self, most: int) -> Array:
        return np.full(min(most, 10), 0.3)

    def passes(self) -> list[dict[str, Any]]:
        return []


class PageAt:
    """The server, and what stands behind it."""

    def __init__(self, token: bytes | None = TOKEN) -> None:
        clock = SystemClock()
        self.daemon, self.events, self.lease = StandIn(), RecentEvents(), WriteLease(clock.monotonic_s)
        self.feed = Feed(self.daemon, self.events, self.lease, clock.monotonic_s, may_order=token is not None)
        desk = OrderDesk(self.daemon.answer, self.lease, clock.monotonic_s, self.feed.acknowledge)
        self.server = PageServer(self.feed, desk, clock, names=frozenset({"acu.lan"}), token=token)
        self.url = ""

    @property
    def port(self) -> int:
        return int(self.url.rstrip("/").rpartition(":")[2])

    @property
    def origin(self) -> str:
        return self.url.rstrip("/")


@contextlib.asynccontextmanager
async def page_at(token: bytes | None = TOKEN) -> AsyncIterator[PageAt]:
    page = PageAt(token)
    page.url = await page.server.open("127.0.0.1", 0)
    try:
        yield page
    finally:
        await page.server.close()


class LivePage:
    """What a page does, without a browser."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.nonce = ""
        self.number = 0
        self.newest: dict[str, Any] = {}

    async def hear(self, *, acknowledges: bool = True) -> dict[str, Any]:
        message = await self.socket.receive(PATIENCE_S)
        if message.type is not aiohttp.WSMsgType.TEXT:
            raise ConnectionError(f"the page was closed: {message.type}")
        if acknowledges:
            await self.socket.send_str("a")
        said: dict[str, Any] = json.loads(message.data)
        self.newest |= said
        return said

    async def reply(self) -> dict[str, Any]:
        """The next reply to an order."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                said = await self.hear()
                if said.get("replies"):
                    reply: dict[str, Any] = said["replies"][0]
                    return reply

    def sealed(self, order: dict[str, Any], token: bytes = TOKEN) -> str:
        self.number += 1
        text = json.dumps(order | {"n": self.number, "id": self.number})
        return json.dumps({"order": text, "seal": seal_of(token, self.nonce, text)})

    async def order(self, order: dict[str, Any], token: bytes = TOKEN) -> dict[str, Any]:
        await self.socket.send_str(self.sealed(order, token))
        return await self.reply()

    async def unlock(self, name: str = "Ann", *, takes_over: bool = False) -> dict[str, Any]:
        return await self.order({"do": "unlock", "name": name, "reason": "test", "takes_over": takes_over})


@contextlib.asynccontextmanager
async def live_page(page: PageAt, **headers: str) -> AsyncIterator[LivePage]:
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{page.url}live", headers={"Origin": page.origin} | headers) as socket,
    ):
        live = LivePage(socket)
        live.nonce = (await live.hear())["hello"]["nonce"]
        yield live
