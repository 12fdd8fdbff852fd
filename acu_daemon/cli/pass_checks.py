"""The checks before a pass, at their times and, after a no-go, again and again until half of the pass is gone."""

import asyncio
import math
from collections.abc import Callable
from typing import Any

import structlog

from acu_daemon.cli.station_wind import Beside
from acu_daemon.errors import failure_text
from acu_daemon.schedule.book import Entry

CHECKS_S = (300.0, 60.0)  # before the rise
AGAIN_S = 15.0  # a no-go is tried again
Check = Callable[[str, float], list[str]]  # of a satellite at a TAI: what of its pass is a no-go


class PassChecks:
    """Owned by the loop; checks go on beside it.  told: called with an entry and the reason where it is a no-go."""

    def __init__(self, check: Check, beside: Beside, told: Callable[[Entry, str], None]) -> None:
        self._check, self._beside, self._told = check, beside, told
        self._checking: asyncio.Task[list[str]] | None = None
        self._entry: Entry | None = None  # that was checked last
        self._before_s = math.inf
        self._again_tai_s = -math.inf
        self.no_go = ""
        self._log: Any = structlog.get_logger("station")

    def look(self, entry: Entry, now_tai_s: float) -> None:
        """Begin a check where it is time, or take what one has found."""
        if self._checking is not None:
            if self._checking.done():
                done, self._checking = self._checking, None
                self._find(entry, self._result(done))
            return
        before_s = entry.rise_tai_s - now_tai_s
        if self._entry is None or self._entry.number != entry.number:
            self._before_s, self.no_go = math.inf, ""
        is_time = any(before_s <= at_s < self._before_s for at_s in CHECKS_S)
        if is_time or (self.no_go and now_tai_s >= self._again_tai_s):
            self._entry, self._before_s = entry, before_s
            self._checking = asyncio.create_task(self._beside(self._check, entry.satellite, now_tai_s), name="check")

    def _result(self, done: asyncio.Task[list[str]]) -> str:
        """What is a no-go; a check that fails itself is one, and ends no station."""
        try:
            return "; ".join(done.result())
        except Exception as error:  # noqa: BLE001
            return f"the check failed: {failure_text(error)}"

    def _find(self, entry: Entry, no_go: str) -> None:
        self.no_go = no_go
        if no_go:
            self._log.warning("check.no_go", entry=entry.name, reason=no_go)
            self._told(entry, no_go)

    def said_of(self, entry: Entry) -> str | None:
        """What the newest check says against an entry; empty: nothing, None: it has not been checked."""
        return self.no_go if self._entry is not None and self._entry.number == entry.number else None

    def may_begin(self, now_tai_s: float) -> bool:
        """Whether no check is under way, and none has just said no."""
        return self._checking is None and now_tai_s >= self._again_tai_s

    def refuse(self, entry: Entry, now_tai_s: float) -> bool:
        """Put a pass off for AGAIN_S; whether it has failed instead: half of it is gone."""
        self._again_tai_s = now_tai_s + AGAIN_S
        return now_tai_s > (entry.rise_tai_s + entry.set_tai_s) / 2.0

    def cannot_begin(self, entry: Entry, reason: str) -> None:
        """The files of a pass are refused: that is a no-go too."""
        self._find(entry, reason)

    def forget(self) -> None:
        """The pass has begun."""
        self._again_tai_s = -math.inf

    def close(self) -> None:
        """End what runs beside the loop."""
        if self._checking is not None:
            self._checking.cancel()
