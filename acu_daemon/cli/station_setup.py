"""What a running station is made from, and what stays the same while it runs."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from acu_daemon.assist.session.refit import RefitReply, RefitRequest
from acu_daemon.cli.options import Target, load_target
from acu_daemon.cli.page import PageFrame
from acu_daemon.cli.pass_checks import Check
from acu_daemon.cli.report_after import report_after
from acu_daemon.cli.station_wind import Beside
from acu_daemon.config.load import satellite_names
from acu_daemon.control.tracking.pass_plan import PlanAnswer, PlanRequest
from acu_daemon.daemon.background import fit_deadline_s
from acu_daemon.daemon.service import PassJob
from acu_daemon.edge.apart import apart
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.fit import FitRunner, ProcessFitRunner
from acu_daemon.edge.link import Link
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.edge.writer import Job, Writer
from acu_daemon.errors import AcuDaemonError, UsageError

Reporter = Callable[[TapeFile, Writer, Path], Coroutine[Any, Any, None]]


@dataclass(frozen=True, slots=True)
class StationSetup:
    """What stays the same while the station runs.  end_s: of --duration, on CLOCK_MONOTONIC.  acu: URL of --acu."""

    config: Path
    clock: Clock
    link: Link
    directory: Path
    files: Writer
    end_s: float
    is_shadow: bool
    older: tuple[Path, ...] = ()
    page: PageFrame | None = None
    beside: Beside = asyncio.to_thread
    fly_beside: Beside = apart
    acu: str | None = None
    put: Callable[[Job], object] = lambda job: job()  # writes the schedule: by a queue, where the loop must not wait
    has_phantom: bool = True
    check: Check | None = None  # of a satellite at a TAI; None: as `acu-daemon check`
    is_recording: bool = True  # what [recording] of station.toml asks for
    report: Reporter = report_after
    make_runner: Callable[[PassJob], FitRunner] = lambda job: ProcessFitRunner(
        job.refit, fit_deadline_s(job.low_water_s)
    )


class NoFits:
    """The fit runner of a daemon that rests or moves: nothing is fitted, no process runs."""

    async def refit(self, request: RefitRequest) -> RefitReply:
        raise RuntimeError(f"nothing is fitted between passes: {request}")

    async def plan(self, asked: PlanRequest) -> PlanAnswer:
        raise RuntimeError(f"nothing is planned between passes: {asked}")

    async def close(self) -> None:
        """Nothing runs."""


def first_usable(config: Path, now_tai_s: float) -> Target:
    """The first satellite whose files can be used: what a rest is made from.  UsageError: none is, and why."""
    reasons = []
    for name in satellite_names(config):
        try:
            target = load_target(config, name, now_tai_s)
        except AcuDaemonError as error:
            reasons.append(f"{name}: {error}")
        else:
            return target
    what = "\n".join(reasons) or f"{config}/satellites holds no satellite; put a NAME.toml there"
    raise UsageError(f"no satellite can be used:\n{what}" if reasons else what)
