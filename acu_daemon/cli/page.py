"""The operator's page of `run` and `rehearse`: whether there is one, where, and what of the daemon it sees."""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import structlog
import typer

from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.web_tables import check_listen
from acu_daemon.daemon.drawing import Aim, Backdrop, PathAhead
from acu_daemon.daemon.service import Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import Clock
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import Entry
from acu_daemon.units import DAY_S, Array
from acu_daemon.web.feed import Feed
from acu_daemon.web.guard import read_token
from acu_daemon.web.order_desk import OrderDesk
from acu_daemon.web.recent_events import RecentEvents

if TYPE_CHECKING:  # with its server of pages it takes a fifth of what a daemon needs to start
    from acu_daemon.web.page_server import PageServer

OFF = "off"
SHOWN_BEFORE_S, SHOWN_MOST = 3600.0, 40  # of the schedule
Web = Annotated[
    str | None,
    typer.Option(
        "--web",
        metavar="ADDRESS:PORT",
        help="Serve the operator's page there, such as 127.0.0.1:8642; `off`: nowhere.  In place of web.listen of "
        "station.toml.",
    ),
]


@dataclass(frozen=True, slots=True)
class PageChoice:
    """Where the page is served, and to whom.  token None: it shows, and stops."""

    host: str
    port: int
    names: frozenset[str]
    token: bytes | None


def chosen_page(web: str | None, station: StationFile, config: Path) -> PageChoice | None:
    """What option and station.toml say; None: there is no page.  UsageError: what is wrong with it."""
    section = station.web
    listen = section.listen if web is None else web
    if listen is None or listen == OFF:
        return None
    try:
        host, port = check_listen(listen)
    except ValueError as error:
        raise UsageError(f"--web {listen!r}: {error}") from None
    token = None if section.token_file is None else read_token(config / section.token_file)
    return PageChoice(host, port, frozenset(name.lower() for name in section.names), token)


@dataclass(frozen=True, slots=True)
class PageFrame:
    """What of the page is there before the loop is.  choice None: there is no page."""

    choice: PageChoice | None
    events: RecentEvents
    lease: WriteLease


class RunningPage:
    """The page of this process, through all its runs.  Owned by the loop."""

    def __init__(self, frame: PageFrame | None, watched: "WatchedRuns", clock: Clock) -> None:
        """frame None: nothing has a page here."""
        self._choice = choice = None if frame is None else frame.choice
        self._server: PageServer | None = None
        self._task: asyncio.Task[None] | None = None
        self._newest: Snapshot | None = None
        self._woken = asyncio.Event()
        if frame is None or choice is None:
            return
        now_s = clock.monotonic_s
        self._feed = Feed(watched, frame.events, frame.lease, now_s, may_order=choice.token is not None)
        from acu_daemon.web import page_server

        desk = OrderDesk(watched.answer, frame.lease, now_s, self._feed.acknowledge)
        self._server = page_server.PageServer(self._feed, desk, clock, names=choice.names, token=choice.token)

    async def open(self) -> None:
        """Listen; where it cannot, say so and go on: the antenna matters more."""
        if self._server is None or self._choice is None:
            return
        log: Any = structlog.get_logger("page")
        try:
            url = await self._server.open(self._choice.host, self._choice.port)
        except UsageError as error:
            log.error("page.not_open", reason=str(error))
        else:
            self._task = asyncio.create_task(self._tend(), name="page feed")
            log.info("page.open", url=url, orders="with the token" if self._choice.token else "stop alone")

    def see(self, seen: Snapshot) -> None:
        """Take the newest snapshot; what is made of it is made after the tick."""
        self._newest = seen
        self._woken.set()

    async def _tend(self) -> None:
        """Feed the page.  An error of the page ends neither the daemon nor the page: it is told once."""
        log: Any = structlog.get_logger("page")
        has_failed = False
        while True:
            await self._woken.wait()
            self._woken.clear()
            try:
                if self._newest is not None:
                    self._feed.see(self._newest)
            except Exception as error:  # noqa: BLE001  the top of the page's own task
                if not has_failed:
                    log.error("page.failed", reason=repr(error), advice="an error of ours: please report it")
                has_failed = True

    async def close(self) -> None:
        """End all that is served."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        if self._server is not None:
            await self._server.close()


class WatchedRuns:
    """What the page sees of the run that goes on."""

    def __init__(
        self,
        current: Callable[[], Service | None],
        answer: Callable[[str, str], str],
        passes: Callable[[], list[dict[str, Any]]] | None = None,
    ) -> None:
        """passes: of a station's schedule; None: it is none."""
        self._current, self._answer, self._passes = current, answer, passes
        self.is_station = passes is not None

    def answer(self, line: str, who: str = "") -> str:
        """Do what a line says."""
        return self._answer(line, who)

    def aim(self) -> Aim | None:
        service = self._current()
        return None if service is None else service.drawing.aim()

    def path_ahead(self) -> PathAhead | None:
        service = self._current()
        return None if service is None else service.drawing.path_ahead()

    def backdrop(self) -> Backdrop | None:
        service = self._current()
        return None if service is None else service.drawing.backdrop()

    def lateness_ms(self, most: int) -> Array:
        service = self._current()
        return np.zeros(0) if service is None else service.lateness_ms(most)

    def passes(self) -> list[dict[str, Any]]:
        return [] if self._passes is None else self._passes()


def passes_shown(
    book: Iterable[Entry], said_of: Callable[[Entry], str | None], now_tai_s: float
) -> list[dict[str, Any]]:
    """The passes of the schedule around now, with reasons.  said_of: what the newest check says against one."""
    begin_tai_s, end_tai_s = now_tai_s - SHOWN_BEFORE_S, now_tai_s + DAY_S
    shown = [one for one in book if begin_tai_s < one.set_tai_s < end_tai_s]
    return [
        {
            "satellite": one.satellite,
            "rise_utc": utc_text(one.rise_tai_s, 0),
            "set_utc": utc_text(one.set_tai_s, 0),
            "at_utc": utc_text(one.culmination_tai_s, 0),
            "culmination_deg": round(one.culmination_el_deg, 1),
            "priority": one.priority,
            "state": str(one.state),
            "reason": one.reason,
            "no_go": said_of(one),
        }
        for one in shown[:SHOWN_MOST]
    ]
