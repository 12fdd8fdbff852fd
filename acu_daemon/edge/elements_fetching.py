"""Has the daemon's elements fetched while the antenna waits: by a process of its own, so that no tick notices."""

import asyncio
import contextlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import structlog

from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.edge.child_process import answer_of, start_python
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.clock_sense import before_release
from acu_daemon.edge.elements_status import fetch_problems
from acu_daemon.edge.fetch_policy import FIRST_PAUSE_S, HOUR_S, LONGEST_PAUSE_S, FetchState, is_due
from acu_daemon.edge.fetch_state_file import read_fetch_state

LOOK_S = 60.0
LONGEST_S = 1800.0  # of a process that fetches
MOST_LINES = 200


class ElementsFetching:
    """Looks once a minute whether a URL is due, and starts the process that asks.  Owned by the daemon's loop.

    problem: what is wrong with the sources, for `status`; "": nothing.
    """

    def __init__(
        self,
        config: Path,
        section: ElementsSourcesSection,
        clock: Clock,
        *,
        is_rehearsal: bool,
        on_asked: Callable[[str, str], None] = lambda _source, _problem: None,
    ) -> None:
        """is_rehearsal: at another time than now nothing is fetched.

        on_asked: told the host that was asked and in a word why nothing good came, whichever process asked.
        """
        self._on_asked = on_asked
        self._asked_tai_s: dict[str, float] = {}
        self._config, self._section, self._clock = config, section, clock
        self._is_on = bool(section.urls) and not is_rehearsal
        self._looked_s = -LOOK_S
        self._fetch: asyncio.Task[None] | None = None
        self._log: Any = structlog.get_logger("elements")
        self._failed_count = 0  # of processes that could not do it, in a row
        self._not_before_s = -LOOK_S
        self._complaint = ""
        self.problem = ""
        self.start_count = 0

    def look(self) -> None:
        """Look whether anything is due.  Call it while the antenna waits, as often as you like."""
        now_s = self._clock.monotonic_s()
        if not self._is_on or now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        now_tai_s, section = self._clock.tai_s(), self._section
        self.problem = fetch_problems(self._config, section, now_tai_s)
        is_idle = (self._fetch is None or self._fetch.done()) and now_s >= self._not_before_s
        states = [read_fetch_state(self._config / section.store, url) for url in section.urls]
        self._count(states)
        if section.fetch != "daemon" or not is_idle or before_release(now_tai_s):
            return
        if any(is_due(one, now_tai_s, section.every_h * HOUR_S) for one in states):
            self.start_count += 1
            self._fetch = asyncio.get_running_loop().create_task(self._run(), name="elements-fetch")

    def _count(self, states: list[FetchState]) -> None:
        for state in states:
            before_tai_s, self._asked_tai_s[state.url] = self._asked_tai_s.get(state.url), state.asked_tai_s
            if before_tai_s is not None and state.asked_tai_s > before_tai_s:
                problem = "stopped" if state.stopped else "failed" if state.problem else ""
                self._on_asked(urlsplit(state.url).hostname or "unknown", problem)

    async def close(self) -> None:
        """End the process, if one runs; what it has written is whole."""
        if self._fetch is not None:
            self._fetch.cancel()
            await asyncio.gather(self._fetch, return_exceptions=True)

    async def _run(self) -> None:
        complaint = await self._fetched()
        if not complaint:
            self._failed_count, self._complaint = 0, ""
            return
        pause_s = min(FIRST_PAUSE_S * 2.0 ** min(self._failed_count, 20), LONGEST_PAUSE_S)
        self._failed_count, self._not_before_s = self._failed_count + 1, self._clock.monotonic_s() + pause_s
        if complaint != self._complaint:
            self._complaint = complaint
            self._log.warning("elements.fetch_failed", reason=complaint)

    async def _fetched(self) -> str:
        """Have a process ask what is due; returns what it complains of, where it could not."""
        try:
            child = await start_python(
                "acu_daemon",
                *("elements", "fetch", "--events", "--config", str(self._config)),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.PIPE,
            )
        except OSError as error:
            return f"no process for it: {error.strerror or error}"
        try:
            said, complaint = await answer_of(child, LONGEST_S)
        except TimeoutError:
            return f"the process took more than {LONGEST_S:g} s and was ended"
        self._tell(said)
        if not child.returncode:
            return ""
        lines = complaint.decode("utf-8", "replace").strip().splitlines()
        return lines[-1][:300] if lines else f"the process ended with {child.returncode}"

    def _tell(self, said: bytes) -> None:
        for line in said.decode("utf-8", "replace").splitlines()[:MOST_LINES]:
            with contextlib.suppress(ValueError, KeyError, TypeError, AttributeError):
                event = json.loads(line)
                log = self._log.warning if event.pop("is_warning") else self._log.info
                log(event.pop("event"), **event)
