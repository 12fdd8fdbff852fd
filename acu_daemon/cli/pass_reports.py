"""The reports of a station's passes: each is made once the hooks of its pass have ended."""

import asyncio
from functools import partial
from typing import Any

from acu_daemon.cli.pass_record import write_record
from acu_daemon.cli.station_day import StationDay
from acu_daemon.cli.station_setup import StationSetup
from acu_daemon.edge.hooks import GRACE_S
from acu_daemon.edge.tape_file import TapeFile

SPARE_S = 5.0  # for a hook that is killed at its time limit, in both steps


class PassReports:
    """Owned by the loop."""

    def __init__(self, setup: StationSetup, day: StationDay) -> None:
        self._setup, self._day = setup, day
        self._making: set[asyncio.Task[None]] = set()

    def make(self, tape: TapeFile, *, has_report: bool) -> None:
        """Put beside a recording what the station knows of the pass, and have its report made."""
        course = self._day.course
        record = course.record if course.entry is None else {}  # else the run of the pass was broken off
        if record:
            self._write(tape, record)  # now: the daemon may end before the hooks do
        making = asyncio.create_task(self._make(tape, record, has_report=has_report), name="report")
        self._making.add(making)
        making.add_done_callback(self._making.discard)

    async def close(self) -> None:
        """End what is in the making."""
        for making in self._making:
            making.cancel()
        await asyncio.gather(*self._making, return_exceptions=True)

    async def _make(self, tape: TapeFile, record: dict[str, Any], *, has_report: bool) -> None:
        hooks, setup = self._day.hooks, self._setup
        if record:
            longest_s = self._day.station.hooks.time_limit_s + 2.0 * GRACE_S + SPARE_S
            await hooks.ended(record["number"], longest_s)
            self._day.course.gather()
            self._write(tape, record)
        if has_report:
            await setup.report(tape, setup.files, setup.config)

    def _write(self, tape: TapeFile, record: dict[str, Any]) -> None:
        running = [str(hook) for hook in self._day.hooks.running(record["number"])]
        written = record | {"hooks": list(record["hooks"]), "running_hooks": running}
        self._setup.files.put(partial(write_record, tape.path, written))
