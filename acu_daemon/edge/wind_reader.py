"""The wind, as JSON from a file or in UDP datagrams.

{"mean_m_s": 8.2, "gust_m_s": 12.9, "utc": "2026-08-18T12:00:00Z"}

Where several sensors send to the address, the one that tells the strongest gust counts.
"""

import json
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.edge.carry_over_file import reason_of
from acu_daemon.edge.newest_text import NewestText
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.schedule.wind import WindSample

MOST_AHEAD_S = 60.0  # of our clock


def wind_of(text: bytes, now_tai_s: float) -> WindSample:
    """Read a wind.  ValueError: what is wrong with it."""
    try:
        said = json.loads(text)
        if not isinstance(said, dict):
            raise ValueError("expected a JSON object")
        sample = WindSample(_number(said, "mean_m_s"), _number(said, "gust_m_s"), tai_from_utc(said["utc"]))
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError, OverflowError) as error:
        raise ValueError(reason_of(error)) from None
    if not sample.is_possible:
        raise ValueError(f"mean_m_s = {sample.mean_m_s:g}, gust_m_s = {sample.gust_m_s:g}: no such wind")
    if sample.tai_s > now_tai_s + MOST_AHEAD_S:
        raise ValueError(f"it is of {utc_text(sample.tai_s, 0)}, ahead of this clock")
    return sample


def _number(said: dict[str, Any], key: str) -> float:
    value = said[key]
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{key} = {value!r}: expected a number")
    return float(value)


class WindReader:
    """Hands out the newest usable wind.  Owned by the loop."""

    def __init__(self, udp: str | None, file: Path | None) -> None:
        self._source = NewestText(udp, file)
        self._said = ""
        self._log: Any = structlog.get_logger("wind")

    async def open(self) -> None:
        """Listen for datagrams, where asked; an address that cannot be had is told: the wind is stale then."""
        if reason := await self._source.open():
            self._log.warning("wind.no_socket", reason=reason)

    def close(self) -> None:
        self._source.close()

    def now(self, now_tai_s: float) -> WindSample | None:
        """The strongest wind that came since the last look; None: nothing usable did.  Reads a small file."""
        texts, problem = self._source.newest()
        found, reasons = [], [problem] if problem else []
        for source, text in texts:
            try:
                found.append(wind_of(text, now_tai_s))
            except ValueError as error:
                reasons.append(f"{source}: {error}")
        said = "; ".join(reasons)
        if said and said != self._said:
            self._log.warning("wind.ignored", reason=said)
        self._said = said
        return max(found, key=lambda one: one.gust_m_s, default=None)
