"""The daemon's side of a page that is open: sends the newest state, two texts ahead of what the page has taken."""

import asyncio
import contextlib
from collections import deque
from collections.abc import Callable
from typing import Any

from aiohttp import web

from acu_daemon.web.feed import Feed, Topic, to_json
from acu_daemon.web.guard import Allowance
from acu_daemon.web.order_desk import Person

AHEAD = 2  # texts that the page has not acknowledged
BEAT_S = 0.4  # at least so often something is sent: a page that hears nothing for a second says so
SILENT_S = 20.0  # a page that takes nothing for so long is gone
MOST_REPLIES = 20
SAID_PER_S, SAID_AT_ONCE = 60.0, 120.0  # messages of a page: its acknowledgements come ten times a second


class LiveSide:
    """Owned by its connection's task."""

    def __init__(self, socket: web.WebSocketResponse, person: Person, feed: Feed, now_s: Callable[[], float]) -> None:
        self.person = person
        self._socket, self._feed, self._now_s = socket, feed, now_s
        self._known: dict[Topic, int] = {}
        self._replies: deque[dict[str, Any]] = deque(maxlen=MOST_REPLIES)
        self._open_count = 0
        self._woken = asyncio.Event()
        self._taken_s = now_s()
        self._allowance = Allowance.of(SAID_PER_S, SAID_AT_ONCE)

    def wake(self) -> None:
        """There is something new."""
        self._woken.set()

    def may_speak(self) -> bool:
        """Whether the page has not said too much."""
        return self._allowance.take(self._now_s())

    def acknowledge(self) -> None:
        """The page has taken a text."""
        self._open_count = max(0, self._open_count - 1)
        self._taken_s = self._now_s()
        self._woken.set()

    def reply(self, reply: dict[str, Any]) -> None:
        """Answer an order."""
        self._replies.append(reply)
        self._woken.set()

    async def send(self) -> None:
        """Send until the connection ends, or its reader takes nothing any more."""
        await self._put(self._hello())
        while True:
            is_beat = False
            try:
                async with asyncio.timeout(BEAT_S):
                    await self._woken.wait()
            except TimeoutError:
                is_beat = True
            self._woken.clear()
            if self._now_s() - self._taken_s > SILENT_S:
                await self.end()
                return
            if self._open_count < AHEAD and ((text := self._newest()) or is_beat):
                self._open_count += 1
                await self._put(f"{{{text}}}")

    async def _put(self, text: str) -> None:
        async with asyncio.timeout(SILENT_S):
            await self._socket.send_str(text)

    async def end(self) -> None:
        """End the connection."""
        with contextlib.suppress(ConnectionError, TimeoutError, RuntimeError):
            async with asyncio.timeout(0.5):
                await self._socket.close()

    def _hello(self) -> str:
        self._open_count += 1
        seals = self.person.seals
        hello = {"nonce": seals.nonce, "may_order": seals.token is not None, "verbs": self._feed.verbs()}
        return f'{{"hello":{to_json(hello)},"strip":{self._feed.strip()}}}'

    def _newest(self) -> str:
        """What is new, as the inside of a JSON object; empty: nothing is."""
        inside, self._known = self._feed.news(self._known)
        replies = [self._replies.popleft() for _ in range(len(self._replies))]
        if replies:
            inside = ",".join(part for part in (f'"replies":{to_json(replies)}', inside) if part)
        return inside
