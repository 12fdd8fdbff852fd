"""Where the antenna waits for a pass that is hours away: the direction of its rise, found beside the loop."""

import asyncio
from pathlib import Path

from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.cli.station_wind import Beside
from acu_daemon.config.to_settings import leaning, planned_tilt
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.schedule.book import Entry

Rise = tuple[float, float]  # azimuth, continuous, and elevation, encoder frame


class NextRise:
    """Owned by the loop.  What cannot be found, because the satellite's files are refused, stays unknown."""

    def __init__(self, config: Path, directory: Path, beside: Beside) -> None:
        self._config, self._directory, self._beside = config, directory, beside
        self._number = 0
        self._finding: asyncio.Task[Rise] | None = None

    def at(self, entry: Entry, now_tai_s: float) -> Rise | None:
        """The direction in which a pass rises; None: it is not known yet, or at all."""
        if self._number != entry.number:
            self.close()
            self._number = entry.number
            self._finding = asyncio.create_task(self._beside(self._find, entry, now_tai_s), name="next rise")
        if self._finding is None or not self._finding.done() or self._finding.exception() is not None:
            return None
        return self._finding.result()

    def _find(self, entry: Entry, now_tai_s: float) -> Rise:
        """Raises: AcuDaemonError: of the satellite's files."""
        rise_tai_s = entry.rise_tai_s
        target = load_target(self._config, entry.satellite, now_tai_s, at_tai_s=rise_tai_s, folders=(self._directory,))
        station, coming = target.station, coming_pass(target, rise_tai_s - 60.0)
        plan = plan_pass(
            target.elements.propagator,
            leaning(station.site, planned_tilt(station, target.elements.propagator, coming)),
            coming,
            entry.start_az_deg or 0.0,
            station.acu.azimuth.limits(),
            rise_tai_s,
            elevation=station.acu.elevation.limits(),
        )
        return plan.start_az_deg, plan.start_el_deg

    def close(self) -> None:
        """End what runs beside the loop."""
        if self._finding is not None:
            self._finding.cancel()
            self._finding = None
