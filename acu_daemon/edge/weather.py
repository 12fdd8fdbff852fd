"""Live weather, as JSON from a file or in UDP datagrams: read, judged, and heeded while it is fresh.

{"pressure_hpa": 1002.5, "temperature_c": 24.0, "humidity_percent": 70, "utc": "2026-08-18T12:00:00Z"}

The pressure is that at the antenna.  Weather that is old, of the future, or no weather is told once and passed over:
then the values of [atmosphere] hold.  What comes by UDP may be anybody's; at worst it is within the limits of a station
at this height.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.config.antenna_tables import AtmosphereSection
from acu_daemon.edge.carry_over_file import reason_of
from acu_daemon.edge.newest_text import NewestText
from acu_daemon.model import Station
from acu_daemon.orbit.timescales import tai_from_utc, utc_text

VALUES = ("pressure_hpa", "temperature_c", "humidity_percent")
MOST_AHEAD_S = 60.0  # of our clock: a weather station's may be that wrong


@dataclass(frozen=True, slots=True)
class Weather:
    """What a source said: [atmosphere] with it, and of when it is."""

    atmosphere: AtmosphereSection
    tai_s: float


def weather_of(text: bytes, given: AtmosphereSection, station: Station, now_tai_s: float) -> Weather:
    """Read weather.  ValueError: what is wrong with it."""
    try:
        said = json.loads(text)
        if not isinstance(said, dict):
            raise ValueError("expected a JSON object")
        values = {name: said[name] for name in VALUES}
        tai_s = tai_from_utc(said["utc"])
    except (KeyError, TypeError, AttributeError, ValueError, RecursionError) as error:
        raise ValueError(reason_of(error)) from None
    if tai_s > now_tai_s + MOST_AHEAD_S:
        raise ValueError(f"it is of {utc_text(tai_s, 0)}, {tai_s - now_tai_s:.0f} s ahead of this clock")
    if now_tai_s - tai_s > given.weather_max_age_s:
        raise ValueError(
            f"it is of {utc_text(tai_s, 0)}, {now_tai_s - tai_s:.0f} s old (weather_max_age_s = "
            f"{given.weather_max_age_s:g})"
        )
    return Weather(given.with_weather(values, station), tai_s)


class WeatherReader:
    """Hands out the newest usable weather of the file and of the datagrams.  Owned by the loop."""

    def __init__(self, given: AtmosphereSection, station: Station, config: Path) -> None:
        self._given, self._station = given, station
        is_used = given.refraction
        file = None if given.weather_file is None or not is_used else config / given.weather_file
        self._source = NewestText(given.weather_udp if is_used else None, file)
        self._newest: Weather | None = None
        self._said = self.problem = ""  # problem: what was wrong at the last look
        self._log: Any = structlog.get_logger("weather")

    async def open(self) -> None:
        """Listen for datagrams, where asked; an address that cannot be had is told, and no reason not to track."""
        if reason := await self._source.open():
            self._log.warning(
                "weather.no_socket", address=self._given.weather_udp, reason=reason, in_force="[atmosphere]"
            )

    def close(self) -> None:
        self._source.close()

    def take(self, datagram: bytes) -> None:
        """Keep a datagram."""
        self._source.take(datagram)

    def now(self, now_tai_s: float) -> AtmosphereSection:
        """[atmosphere] as it is now.  Reads the file: call it beside the loop, one at a time."""
        found: list[Weather] = []
        texts, unread = self._source.newest()
        reasons = [unread] if unread else []
        for source, text in texts:
            try:
                found.append(weather_of(text, self._given, self._station, now_tai_s))
            except ValueError as error:
                reasons.append(f"weather_{source}: {error}")
        if self._newest is not None:
            if now_tai_s - self._newest.tai_s <= self._given.weather_max_age_s:
                found.append(self._newest)
            elif not found:
                reasons.append(f"nothing came since {utc_text(self._newest.tai_s, 0)}")
        self._newest = max(found, key=lambda one: one.tai_s) if found else None
        self.problem = "; ".join(reasons)
        return self._given if self._newest is None else self._newest.atmosphere

    def tell(self) -> None:
        """Log what was wrong, where it is another kind of thing than before: ages in seconds change at every look."""
        reason = self.problem
        kind = "".join(letter for letter in reason if not letter.isdecimal())
        if kind != self._said and reason:
            in_force = "[atmosphere]" if self._newest is None else f"of {utc_text(self._newest.tai_s, 0)}"
            self._log.warning("weather.ignored", reason=reason, in_force=in_force)
        self._said = kind
