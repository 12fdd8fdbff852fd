"""Serves the metrics over HTTP, in the daemon's loop and out of its ticks' way.

A page is rendered at most twice a second, right after a tick, when the loop has most of a period to itself; whoever
asks meanwhile waits for it.  Where no tick comes, as between two runs, it is rendered all the same.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Any

import structlog
from aiohttp import web
from prometheus_client import CollectorRegistry
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4, generate_latest

from acu_daemon.daemon.tally import Tally
from acu_daemon.outlets.metric_families import DaemonCollector, Surroundings

FRESH_S = 0.5
TICK_PATIENCE_S = 1.2  # between passes it ticks once a second


class MetricsServer:
    """Owned by the loop.  around: what is known beside the tally, asked when a page is rendered."""

    def __init__(self, tally: Tally, around: Callable[[], Surroundings]) -> None:
        self._tally, self._around = tally, around
        self._page, self._rendered_s = b"", float("-inf")
        self._ticked = asyncio.Event()
        self._seen_unix_s = time.time()
        self._runner: web.AppRunner | None = None
        self._log: Any = structlog.get_logger("metrics")
        self.address = ""

    async def open(self, host: str, port: int) -> None:
        """Listen; where that cannot be, it is told, and no reason not to track."""
        app = web.Application()
        app.router.add_get("/metrics", self._metrics)
        app.router.add_get("/", self._hint)
        self._runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=0.1)
        await self._runner.setup()
        try:
            await web.TCPSite(self._runner, host, port).start()
        except OSError as error:
            self._log.error("metrics.not_open", address=f"{host}:{port}", reason=error.strerror or str(error))
            return
        bound = self._runner.addresses[0]
        self.address = f"{bound[0]}:{bound[1]}"
        self._log.info("metrics.open", url=f"http://{self.address}/metrics")

    async def close(self) -> None:
        if self._runner is not None:
            await self._runner.cleanup()

    def ticked(self) -> None:
        """A tick is over, and what it brought is in the tally: the loop has time."""
        self._seen_unix_s = time.time()
        self._ticked.set()
        self._ticked.clear()

    async def _metrics(self, _request: web.Request) -> web.Response:
        if time.monotonic() - self._rendered_s > FRESH_S:
            await self._after_tick()
        if time.monotonic() - self._rendered_s > FRESH_S:  # nobody has done it meanwhile
            self._page = render(self._tally, self._around(), self._seen_unix_s)
            self._rendered_s = time.monotonic()
        return web.Response(body=self._page, headers={"Content-Type": CONTENT_TYPE_PLAIN_0_0_4})

    async def _after_tick(self) -> None:
        try:
            async with asyncio.timeout(TICK_PATIENCE_S):
                await self._ticked.wait()
        except TimeoutError:
            return

    async def _hint(self, _request: web.Request) -> web.Response:
        return web.Response(text="acu-daemon: /metrics\n")


def render(tally: Tally, around: Surroundings, now_unix_s: float) -> bytes:
    """The page, in the text format 0.0.4."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(DaemonCollector(tally, around, now_unix_s))
    return generate_latest(registry)
