"""The wind at a station: read beside the loop, judged once a second, and what it wants of the stow."""

import asyncio
import math
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.config.station_day_tables import WindSection
from acu_daemon.control.tick_input import StowBy, StowWish
from acu_daemon.edge.wind_reader import WindReader
from acu_daemon.schedule.wind import Wind, WindSample, WindWatch, watch

Beside = Callable[..., Coroutine[Any, Any, Any]]
LOOK_S = 1.0
WEAKER = (StowBy.NOBODY, StowBy.SCHEDULE)


class StationWind:
    """Owned by the loop.  seen: what is known of the wind; rules that are read again hold at once, sensors do not."""

    def __init__(self, section: WindSection, config: Path, beside: Beside) -> None:
        self.section = section
        self.seen = WindWatch()
        self._beside = beside
        self._reader = WindReader(section.udp, None if section.file is None else config / section.file)
        self._reading: asyncio.Task[WindSample | None] | None = None
        self._begun_tai_s: float | None = None
        self._looked_tai_s = -math.inf
        self._log: Any = structlog.get_logger("station")

    async def open(self) -> None:
        """Begin to listen."""
        await self._reader.open()

    def close(self) -> None:
        """End what runs beside the loop."""
        self._reader.close()
        if self._reading is not None:
            self._reading.cancel()

    def look(self, now_tai_s: float, stow_by: StowBy) -> StowWish | None:
        """Judge what was heard; a wish where the stow is not as the wind wants it.  stow_by: whose it is now."""
        if not self.section.is_watched:
            return None
        if self._begun_tai_s is None:
            self._begun_tai_s = now_tai_s
            self.seen = WindWatch(wants_stow=stow_by is StowBy.WIND)  # it was strong before the start
        if not 0.0 <= now_tai_s - self._looked_tai_s < LOOK_S:
            self._looked_tai_s = now_tai_s
            self._judge(now_tai_s)
        if self.seen.wants_stow:
            return StowWish(StowBy.WIND) if stow_by in WEAKER else None
        return StowWish(StowBy.WIND, is_wanted=False) if stow_by is StowBy.WIND else None

    def _judge(self, now_tai_s: float) -> None:
        heard = self._heard(now_tai_s)
        rules, before, begun_tai_s = self.section.rules(), self.seen, self._begun_tai_s or now_tai_s
        if heard is None and before.newest is None and now_tai_s - begun_tai_s < rules.max_age_s:
            return  # nothing can have been heard yet
        self.seen = watch(before, heard, rules, now_tai_s)
        if (before.wind, before.wants_stow) != (self.seen.wind, self.seen.wants_stow):
            tell = self._log.info if self.seen.wind is Wind.CALM else self._log.warning
            tell("wind.changed", wind=self.seen.words)

    def _heard(self, now_tai_s: float) -> WindSample | None:
        """What the last look has brought; a file on a disk that hangs brings nothing, and the wind grows stale."""
        heard = None
        if self._reading is not None:
            if not self._reading.done():
                return None
            heard = None if self._reading.cancelled() or self._reading.exception() else self._reading.result()
        self._reading = asyncio.create_task(self._beside(self._reader.now, now_tai_s), name="wind")
        return heard

    def why_not_unstow(self, stow_by: StowBy) -> str:
        """Why a person may not end the stow; empty: it may.  A wind that is stale is a person's to judge."""
        if stow_by is StowBy.WIND and self.seen.wants_stow and self.seen.wind is Wind.STRONG:
            return f"the {self.seen.words}: the stow ends by itself once it is calm"
        return ""

    def let_go(self) -> None:
        """A person ends a stow in a stale wind: it is believed calm until it is heard to be strong."""
        self.seen = WindWatch(wind=self.seen.wind, newest=self.seen.newest, is_let_go=True)
