"""The weather in force for a run: looked at once a second while the antenna waits, taken where it moves the path.

The air of a pass is that of its beginning: in a quarter of an hour it changes by less than the scale of the refraction,
which every fit estimates, takes up.
"""

import asyncio
from dataclasses import replace
from pathlib import Path

from acu_daemon.cli.options import Target
from acu_daemon.config.antenna_tables import AtmosphereSection, antenna_of
from acu_daemon.edge.weather import WeatherReader
from acu_daemon.model import Station
from acu_daemon.pointing.air import refractivity

WORTH_N = 3.0  # N-units, 1 %: 0.002 deg at 5 deg of elevation


class WeatherWatch:
    """Owned by the daemon's loop."""

    def __init__(self, config: Path, target: Target, now_tai_s: float) -> None:
        station = target.station.site.station
        self._station: Station = station
        self._mount = target.station.mount
        self._given = target.station.atmosphere
        self._reader = WeatherReader(self._given, station, config)
        self._reading: asyncio.Task[AtmosphereSection] | None = None
        self.in_force = self._read(now_tai_s)
        self._reader.tell()

    async def open(self) -> None:
        """Begin to listen."""
        await self._reader.open()

    def close(self) -> None:
        self._reader.close()

    def on(self, target: Target, now_tai_s: float | None = None) -> Target:
        """The target in the air in force.  now_tai_s: look at it first, as where a pass begins."""
        if target.station.atmosphere != self._given:  # read again with other values: they hold until the next start
            return target
        if now_tai_s is not None and self._given.has_live_weather and self._reading is None:
            self.in_force = self._read(now_tai_s)
            self._reader.tell()
        if target.station.atmosphere == self.in_force:
            return target
        return replace(target, station=target.station.model_copy(update={"atmosphere": self.in_force}))

    def look(self, now_tai_s: float) -> bool:
        """Look at the weather; True: it has changed so much that the pass has to be planned anew."""
        if not self._given.has_live_weather:
            return False
        if self._reading is None:
            work = asyncio.to_thread(self._read, now_tai_s)
            self._reading = asyncio.get_running_loop().create_task(work, name="weather")
            return False
        if not self._reading.done():
            return False
        done, self._reading = self._reading, None
        try:
            now = done.result()
        except RuntimeError:  # the system denies a thread
            return False
        self._reader.tell()
        if abs(self._n(now) - self._n(self.in_force)) < WORTH_N:
            return False
        self.in_force = now
        return True

    def _read(self, now_tai_s: float) -> AtmosphereSection:
        """Read the weather, and trace the rays through its air, which whoever plans by it then finds done."""
        now = self._reader.now(now_tai_s)
        antenna_of(now, self._mount, self._station)
        return now

    def _n(self, atmosphere: AtmosphereSection) -> float:
        return refractivity(atmosphere.air(self._station))
