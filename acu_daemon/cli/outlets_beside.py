"""What of a daemon other programs see: one object for the process, through all its runs."""

import asyncio
import contextlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from acu_daemon.config.station_tables import StationFile
from acu_daemon.daemon.operator_verbs import VERBS
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.tally import Tally
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import Clock
from acu_daemon.schedule.wind import WindWatch

if TYPE_CHECKING:  # they take a third of a second to load, and most daemons have no use for them
    from acu_daemon.outlets.metric_families import Surroundings
    from acu_daemon.outlets.metrics_server import MetricsServer

DISK_S = 30.0
Answer = Callable[[str, str], str]


class Outlets:
    """Owned by the loop.  wind: what is known of it, of a station that watches it."""

    def __init__(
        self,
        station: StationFile,
        directory: Path,
        clock: Clock,
        lease: WriteLease | None = None,
        wind: Callable[[], WindWatch] = WindWatch,
    ) -> None:
        self.tally = Tally()
        self.lease = WriteLease(clock.monotonic_s) if lease is None else lease
        self._station, self._directory, self._wind = station, directory, wind
        self._metrics: MetricsServer | None = None
        self._disk_free_bytes: int | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def open(self) -> None:
        """Begin to serve, what is configured; what cannot is told, and no reason not to track."""
        if (address := self._station.metrics.address) is not None:
            from acu_daemon.outlets.metrics_server import MetricsServer

            self._metrics = MetricsServer(self.tally, self._around)
            await self._metrics.open(*address)
            self._tasks.append(asyncio.create_task(self._watch_disk(), name="disk"))

    def see(self, _seen: Snapshot) -> None:
        """A tick is over, and this is to be seen; the tally has it already."""
        if self._metrics is not None:
            self._metrics.ticked()

    def counted(self, answer: Answer) -> Answer:
        """What answers people's lines, with those counted that were obeyed."""

        def counting(line: str, who: str = "") -> str:
            reply, verb = answer(line, who), line.split(" ")[0]
            if verb in VERBS and reply.startswith("ok"):
                self.tally.count("actions", f"{verb} {via_of(who)}")
            return reply

        return counting

    def asked_for_elements(self, source: str, problem: str) -> None:
        """A server of elements was asked; problem: a word for why nothing good came, empty: it did."""
        self.tally.count("fetches", source)
        if problem:
            self.tally.count("fetches_failed", f"{source} {problem}")

    async def close(self) -> None:
        """End what is served."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._metrics is not None:
            await self._metrics.close()

    def _around(self) -> "Surroundings":
        from acu_daemon.outlets.metric_families import Surroundings

        held, section, newest = self.lease.held, self._station.wind, self._wind().newest
        return Surroundings(
            lease_via="" if held is None else held.claim.via,
            wind_m_s=None if newest is None else (newest.mean_m_s, newest.gust_m_s),
            wind_limits_m_s=(section.mean_limit_m_s, section.gust_limit_m_s) if section.is_watched else None,
            disk_free_bytes=self._disk_free_bytes,
        )

    async def _watch_disk(self) -> None:
        """A disk may hang: it is asked beside the loop."""
        while True:
            with contextlib.suppress(OSError, RuntimeError):
                self._disk_free_bytes = (await asyncio.to_thread(shutil.disk_usage, self._directory)).free
            await asyncio.sleep(DISK_S)


def via_of(who: str) -> str:
    """By which way a person's line came."""
    for via in ("page", "rotctl", "mqtt"):
        if f"by {via}" in who or who.startswith(via):
            return via
    return "cli"
