"""The phantom pass of a station: flown once beside the loop, five minutes before each pass."""

import asyncio
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.cli.pass_checks import CHECKS_S
from acu_daemon.cli.station_wind import Beside
from acu_daemon.config.to_settings import control_config, driver_of, keyhole_rules, leaning, planned_tilt
from acu_daemon.control.phantom import PhantomPass, fly_phantom
from acu_daemon.edge.apart import apart
from acu_daemon.errors import failure_text
from acu_daemon.pointing.wrap import middle_deg, nearest_turn
from acu_daemon.schedule.book import Entry

LEAST_S = 30.0  # before the rise: later it is no time to fly anything
Bearing = tuple[float, float]  # azimuth 0 to 360, and elevation, encoder frame


class PhantomCheck:
    """Owned by the loop.  found: of the entry that was looked at last; None: not flown, or it could not be."""

    def __init__(self, config: Path, directory: Path, beside: Beside, fly_beside: Beside = apart) -> None:
        """beside: reads the files.  fly_beside: flies, for seconds; a thread would make each tick late meanwhile."""
        self._config, self._directory, self._beside, self._fly_beside = config, directory, beside, fly_beside
        self._number = 0
        self._flying: asyncio.Task[PhantomPass] | None = None
        self.found: PhantomPass | None = None
        self._log: Any = structlog.get_logger("station")

    def look(self, entry: Entry, now_tai_s: float, place: Bearing | None) -> None:
        """Fly the pass where it is time, or take what was found.  place: where the antenna stands; None: not known."""
        is_time = LEAST_S < entry.rise_tai_s - now_tai_s <= CHECKS_S[0]
        if self._number != entry.number and is_time and place is not None:
            self.close()
            self._number, self.found = entry.number, None
            given = self._config, self._directory, entry, now_tai_s, place
            self._flying = asyncio.create_task(self._fly(*given), name="phantom")
        if self._flying is None or not self._flying.done():
            return
        flown, self._flying = self._flying, None
        try:
            self.found = flown.result()
        except Exception as error:  # noqa: BLE001  a pass that cannot be flown before it is tracked all the same
            self._log.warning("phantom.not_flown", entry=entry.name, reason=failure_text(error))
            return
        tell = self._log.warning if self.found.lost or self.found.no_go else self._log.info
        tell("phantom.flown", entry=entry.name, what=str(self.found), told="; ".join(self.found.told))

    def of(self, entry: Entry) -> PhantomPass | None:
        """What was found of a pass; None: nothing was."""
        return self.found if self._number == entry.number else None

    def no_go(self, entry: Entry) -> str:
        """Why a pass is not worth beginning; empty: it is, or nothing is known."""
        found = self.of(entry)
        return "" if found is None else found.no_go

    @property
    def words(self) -> str:
        """What was found, for people."""
        return "" if self.found is None else str(self.found)

    async def _fly(self, *given: Any) -> PhantomPass:
        """Raises: AcuDaemonError: of files or elements, or of the process."""
        flown: PhantomPass = await self._fly_beside(fly_phantom, *await self._beside(what_to_fly, *given))
        return flown

    def close(self) -> None:
        """End what runs beside the loop."""
        if self._flying is not None:
            self._flying.cancel()
            self._flying = None


def what_to_fly(config: Path, directory: Path, entry: Entry, now_tai_s: float, place: Bearing) -> tuple[Any, ...]:
    """What fly_phantom is given for an entry.  Raises: AcuDaemonError: of files or elements."""
    target = load_target(config, entry.satellite, now_tai_s, at_tai_s=entry.rise_tai_s, folders=(directory,))
    station, azimuth = target.station, target.station.acu.azimuth.limits()
    near_deg = middle_deg(azimuth) if entry.start_az_deg is None else entry.start_az_deg
    turned_deg = nearest_turn(place[0], near_deg, azimuth)
    coming = coming_pass(target, max(now_tai_s, entry.rise_tai_s - 60.0))
    tilt = planned_tilt(station, target.elements.propagator, coming)
    return (
        target.elements.propagator,
        leaning(station.site, tilt),
        coming,
        control_config(station, target.satellite, driver_of(station), 0.0, tilt),
        keyhole_rules(station),
        (place[0] if turned_deg is None else turned_deg, place[1]),
    )
