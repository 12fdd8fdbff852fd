"""The operator's page over HTTP: its files, the live line as a WebSocket, and a stop that needs no live line.

All that comes in is bounded: connections and their pace (web.listening), sizes, and how often who orders what.  All
that goes out is the newest state: with two texts on their way to a page the next waits until one is acknowledged, and
is then the newest of that moment.
"""

import asyncio
import json
import logging
import secrets
from collections.abc import Awaitable, Callable
from importlib import resources
from typing import Any

from aiohttp import WSMsgType, web

from acu_daemon.edge.clock import Clock
from acu_daemon.web.feed import Feed, to_json
from acu_daemon.web.guard import Seals, is_our_host, is_our_origin
from acu_daemon.web.listening import PageSocket
from acu_daemon.web.live_side import LiveSide
from acu_daemon.web.order_desk import OrderDesk, Person

MOST_PAGES = 16
LARGEST_MESSAGE = 4096  # bytes, from a page
LARGEST_HEAD = 8190
FILES = {"index.html": "text/html", "page.css": "text/css", "icon.svg": "image/svg+xml"}
SCRIPT, SCRIPTS = "page.js", ("seal.js", "draw.js", "strips.js", "tables.js", "hands.js", "main.js")
POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-cache",
    "Server": "acu-daemon",
}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class PageServer:
    """Owned by the loop.  names: host names under which people reach it; token None: it only shows, and stops."""

    def __init__(
        self,
        feed: Feed,
        desk: OrderDesk,
        clock: Clock,
        *,
        names: frozenset[str] = frozenset(),
        token: bytes | None = None,
    ) -> None:
        self._feed, self._desk, self._clock, self._names, self._token = feed, desk, clock, names, token
        self._lives: set[LiveSide] = set()
        self._files = page_files()
        self._runner: web.AppRunner | None = None
        self._socket: PageSocket | None = None
        feed.on_news = self._tell
        feed.names = lambda: [live.person.name or live.person.peer for live in self._lives]

    async def open(self, host: str, port: int) -> str:
        """Listen; returns the address to open in a browser.  UsageError: it cannot be."""
        quiet = logging.getLogger("acu_daemon.page")  # what strangers send is no matter for the log
        quiet.addHandler(logging.NullHandler())
        quiet.propagate = False

        @web.middleware
        async def guarded(request: web.Request, handler: Handler) -> web.StreamResponse:
            return await self._guarded(request, handler)

        app = web.Application(middlewares=[guarded], client_max_size=LARGEST_MESSAGE, logger=quiet)
        app.router.add_get("/live", self._live)
        app.router.add_post("/stop", self._stop)
        app.router.add_get("/{name:[a-z_]*[.]?[a-z]*}", self._file)
        self._runner = web.AppRunner(
            app,
            access_log=None,
            logger=quiet,
            max_line_size=LARGEST_HEAD,
            max_field_size=LARGEST_HEAD,
            keepalive_timeout=1.0,
            shutdown_timeout=0.5,
            handler_cancellation=True,
        )
        await self._runner.setup()
        if self._runner.server is None:
            raise RuntimeError("a set-up runner has a server")
        self._socket = PageSocket(self._runner.server)
        address, port = self._socket.open(host, port)
        return f"http://{f'[{address}]' if ':' in address else address}:{port}/"

    async def close(self) -> None:
        """End all connections."""
        if self._socket is not None:
            await self._socket.close()
        for live in [*self._lives]:
            await live.end()
        if self._runner is not None:
            await self._runner.cleanup()

    def _tell(self) -> None:
        for live in self._lives:
            live.wake()

    async def _guarded(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse what is not for us; close after each answer: whoever needs more connects again."""
        host, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        try:
            if not is_our_host(host, self._names):
                raise web.HTTPMisdirectedRequest(text="this is not a name of this station: [web] names\n")
            if origin is not None and not is_our_origin(origin, host):
                raise web.HTTPForbidden(text="this comes from another site\n")
            response = await handler(request)
        except web.HTTPException as refused:
            response = web.Response(status=refused.status, text=refused.text)
        if not response.prepared:
            response.headers.update(HEADERS)
            response.force_close()
        return response

    async def _file(self, request: web.Request) -> web.StreamResponse:
        name = request.match_info["name"] or "index.html"
        if name not in self._files:
            raise web.HTTPNotFound(text="there is no such file\n")
        text, kind = self._files[name]
        return web.Response(body=text, content_type=kind, charset="utf-8")

    async def _stop(self, request: web.Request) -> web.StreamResponse:
        """STOP without a live line; a form or another site cannot send it: it must come as JSON from our own page."""
        if request.headers.get("Origin") is None or request.content_type != "application/json":
            raise web.HTTPForbidden(text="expected JSON from the page itself\n")
        said = self._desk.stop(Person(str(request.remote), Seals(None, "")))
        return web.Response(text=to_json({"text": said}), content_type="application/json")

    async def _live(self, request: web.Request) -> web.StreamResponse:
        if request.headers.get("Origin") is None:
            raise web.HTTPForbidden(text="expected an Origin\n")
        if len(self._lives) >= MOST_PAGES:
            raise web.HTTPServiceUnavailable(text="too many pages are open\n")
        socket = web.WebSocketResponse(compress=False, max_msg_size=LARGEST_MESSAGE, timeout=1.0, autoping=True)
        await socket.prepare(request)
        if self._socket is not None:
            self._socket.settle(request.transport)
        person = Person(str(request.remote), Seals(self._token, secrets.token_hex(16)))
        live = LiveSide(socket, person, self._feed, self._clock.monotonic_s)
        self._lives.add(live)
        try:
            self._feed.is_watched = True
            self._feed.refresh()
            async with asyncio.TaskGroup() as both:
                sending = both.create_task(live.send())
                await self._hear(socket, live)
                sending.cancel()
        except* (ConnectionError, TimeoutError, RuntimeError):
            pass  # the peer went away
        finally:
            self._lives.discard(live)
            self._feed.is_watched = bool(self._lives)
        return socket

    async def _hear(self, socket: web.WebSocketResponse, live: LiveSide) -> None:
        async for message in socket:
            if message.type is not WSMsgType.TEXT or not live.may_speak():
                break
            if message.data == "a":
                live.acknowledge()
                continue
            try:
                said = json.loads(message.data)
            except ValueError:
                break
            if not isinstance(said, dict):
                break
            live.reply(self._reply(live.person, said))
            if live.person.is_barred:
                break

    def _reply(self, person: Person, said: dict[str, Any]) -> dict[str, Any]:
        if "stop" in said:
            verdict, _, text = self._desk.stop(person).partition(" ")
            return {"id": said["stop"], "ok": verdict == "ok", "text": text}
        return self._desk.take(person, said.get("order"), said.get("seal"))


def page_files() -> dict[str, tuple[bytes, str]]:
    """The page's files and their kinds, read once: no path of a request ever reaches the disk.

    The scripts are sent as one, so that a page is three files.
    """
    folder = resources.files("acu_daemon.web") / "page"
    found = {name: ((folder / name).read_bytes(), kind) for name, kind in FILES.items()}
    found[SCRIPT] = b"".join((folder / name).read_bytes() for name in SCRIPTS), "text/javascript"
    return found
