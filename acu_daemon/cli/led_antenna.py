"""The antenna as a program at the rotctld port has it: what it reads, and how it leads."""

from collections.abc import Callable
from dataclasses import dataclass

from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.tick_input import SlaveWish
from acu_daemon.control.tracking.slaving import ENDED_BY
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.service import Service
from acu_daemon.daemon.tally import Tally
from acu_daemon.edge.clock import Clock
from acu_daemon.outlets.rotctld_port import PlaceShown

Answer = Callable[[str, str], str]


@dataclass(frozen=True, slots=True)
class DaemonSeen:
    """What of the daemon a program beside it needs: its tally, the run that goes on, who answers a person's line."""

    tally: Tally
    clock: Clock
    current: Callable[[], Service | None]
    answer: Answer


class LedAntenna:
    """Owned by the loop.  wish: what a program wants now, so that a daemon that rests can begin a run for it."""

    def __init__(self, station: StationFile, daemon: DaemonSeen) -> None:
        self._station, self._daemon = station, daemon
        self.wish: SlaveWish | None = None

    def place(self) -> PlaceShown | None:
        """Where the antenna is; None: nobody knows."""
        seen = self._daemon.tally.seen
        if seen is None or seen.az_deg is None or seen.el_deg is None or seen.reading_age_s is None:
            return None
        since_s = self._daemon.clock.tai_s() - seen.tai_s
        return PlaceShown(seen.az_deg, seen.el_deg, seen.reading_age_s + since_s, seen.verdict)

    def limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and most of azimuth, over all turns, and of elevation."""
        azimuth, elevation = self._station.acu.azimuth, self._station.acu.elevation
        return (azimuth.min_deg, azimuth.max_deg), (elevation.min_deg, elevation.max_deg)

    def park_deg(self) -> tuple[float, float] | None:
        """Where it is parked; None: nowhere."""
        schedule = self._station.schedule
        return (schedule.park_az_deg, schedule.park_el_deg) if schedule.after == "park" else None

    def lead(self, az_deg: float | None, el_deg: float | None, lasts_s: float, by: str) -> str:
        """Lead the antenna; returns why not, empty: it is.  Angles None: let it stand; lasts_s 0: lead it no more."""
        service = self._daemon.current()
        wish = SlaveWish(az_deg, el_deg, lasts_s, by)
        if lasts_s <= 0.0:
            self.wish = None
        elif why := self._why_not():
            self.wish = None
            return why
        else:
            self.wish = wish
        if service is not None:
            service.ask(wish)
        return ""

    def look(self) -> None:
        """Forget what a program wants where the antenna is not to be led: nothing moves again by itself later."""
        if self.wish is not None and self._why_not():
            self.wish = None

    def _why_not(self) -> str:
        seen = self._daemon.tally.seen
        if seen is None:
            return "the daemon starts"
        if seen.arming != "armed":
            return seen.arming
        if seen.latch:
            return f"latched: {seen.latch}"
        return f"the state is {seen.state}" if TrackState(seen.state) in ENDED_BY else ""

    def stop(self, who: str) -> None:
        """STOP, at once, whoever moves the antenna."""
        self.wish = None
        self._daemon.answer("stop", who)
