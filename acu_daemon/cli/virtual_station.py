"""The station of `acu-daemon run` in virtual time, on a SIMULATION: days in minutes, for tests and figures."""

import asyncio
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli.options import Target
from acu_daemon.cli.simulated import tilt_of
from acu_daemon.cli.station_runs import StationRuns
from acu_daemon.cli.station_setup import Reporter, StationSetup, first_usable
from acu_daemon.cli.virtual_pass import events_to
from acu_daemon.daemon.service import Outcome, PassJob
from acu_daemon.drivers.sa3842.codec import address_byte
from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.edge.writer import Writer
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.memory import MemoryLink
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.pedestal import STEP_S
from acu_daemon.sim.scenario import AcuChoice, Scenario, SkyErrors
from acu_daemon.sim.sky import Direction, SimulatedSky
from acu_daemon.sim.trace import TraceRow
from acu_daemon.sim.virtual import run_virtual

ERRORS = SkyErrors(along_track_s=0.5)
STANDING, KEPT_TICKS = (AcuMode.STANDBY, AcuMode.STOWED), 5
Action = Callable[["StationAccess"], None]


@dataclass
class Days:
    """What a run of the station left.  outcome None: it was killed."""

    rows: list[TraceRow] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)
    outcome: Outcome | None = None
    antenna: "tuple[FakeAcu, OneAtATime] | None" = None  # the ACU, and the sky above it

    def named(self, name: str) -> list[dict[str, Any]]:
        """Log events of a name."""
        return [one for one in self.events if one["event"] == name]


@dataclass(frozen=True, slots=True)
class StationAccess:
    """What a script can reach."""

    runs: StationRuns
    acu: FakeAcu
    link: MemoryLink
    config: Path


class DozingAcu(FakeAcu):
    """Skips the servo's ticks while the antenna stands, all but the last: a week between passes has thirty million."""

    def advance(self, now_tai_s: float) -> None:
        antenna = self._antenna
        if self._modes.mode in STANDING and not antenna.az.is_moving and not antenna.el.is_moving:
            self._tick = max(self._tick, int((now_tai_s - self.parts.start_tai_s) / STEP_S + 1e-6) - KEPT_TICKS)
        super().advance(now_tai_s)


class OneAtATime:
    """The sky of whichever satellite the station has turned to."""

    def __init__(self, errors: SkyErrors) -> None:
        self._errors = errors
        self._sky: SimulatedSky | None = None

    def turn_to(self, job: PassJob) -> None:
        """The satellite of a run."""
        self._sky = make_sky(job.refit.propagator, job.refit.site, Scenario(sky=self._errors))

    def direction(self, tai_s: float) -> Direction | None:
        return None if self._sky is None else self._sky.direction(tai_s)


def run_days(
    config: Path,
    directory: Path,
    begin_tai_s: float,
    end_tai_s: float,
    *,
    script: Sequence[tuple[float, Action]] = (),
    check: Callable[[str, float], list[str]] = lambda _name, _tai_s: [],
    errors: SkyErrors = ERRORS,
    has_phantom: bool = False,
    keeps_rows: bool = True,
    report: Reporter | None = None,
    before: Days | None = None,
) -> Days:
    """Run the station from one TAI to another; directory: its state.  script: what happens, each at its TAI.

    A script that raises KilledError ends the run there.  keeps_rows: ten of them a second, too many for a week.
    report: what makes the reports; with it passes are recorded too.
    before: the run that was killed; its ACU is found as it went on since.
    """
    days = Days()

    async def beside(what: Callable[..., Any], *given: Any) -> Any:
        return what(*given)

    async def main() -> None:
        clock = LoopClock(begin_tai_s)
        first = first_usable(config, begin_tai_s)
        antenna = None if before is None else before.antenna
        acu, sky = days.antenna = antenna or _simulated(first, begin_tai_s, errors, is_dozing=not keeps_rows)
        acu.observer = days.rows.append if keeps_rows else None
        link = MemoryLink(acu, clock)

        def runner(job: PassJob) -> InlineFitRunner:
            sky.turn_to(job)
            return InlineFitRunner(job.refit)

        files = Writer("files", math.inf)
        setup = StationSetup(
            config,
            clock,
            link,
            directory,
            files,
            math.inf,
            False,
            beside=beside,
            fly_beside=beside,
            make_runner=runner,
            check=check,
            is_recording=report is not None,
            report=report or no_report,
            has_phantom=has_phantom,
        )
        runs = StationRuns(setup, first, None)
        loop, killed = asyncio.get_running_loop(), loop_future()
        for tai_s, action in script:
            loop.call_later(tai_s - begin_tai_s, _do, action, StationAccess(runs, acu, link, config), killed)
        loop.call_later(end_tai_s - begin_tai_s, runs.stop, "the end of the days")
        await runs.day.keeper.first_plan()
        running: asyncio.Future[Any] = asyncio.ensure_future(runs.run())
        try:
            await asyncio.wait([running, killed], return_when=asyncio.FIRST_COMPLETED)
            days.outcome = running.result() if running.done() else None
        finally:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)
            await runs.close()
            files.close()

    with events_to(days.events):
        run_virtual(main())
    return days


async def no_report(_tape: TapeFile, _files: Writer, _config: Path) -> None:
    """Make none."""


def _simulated(target: Target, begin_tai_s: float, errors: SkyErrors, *, is_dozing: bool) -> tuple[FakeAcu, OneAtATime]:
    section, station, sky = target.station.acu, target.station, OneAtATime(errors)
    parts = AcuParts(
        section.azimuth.limits(),
        section.elevation.limits(),
        station.receiver.beamwidth_deg,
        sky,
        begin_tai_s,
        Scenario(acu=AcuChoice()),
        1,
        address_byte(section.address),
        station.site.skyline,
        tilt_of(station),
    )
    return DozingAcu(parts) if is_dozing else FakeAcu(parts), sky


def loop_future() -> "asyncio.Future[Any]":
    """A future of the running loop."""
    return asyncio.get_running_loop().create_future()


def _do(action: Action, access: StationAccess, killed: "asyncio.Future[Any]") -> None:
    try:
        action(access)
    except KilledError:
        access.link.is_cut = True  # what still ends in order has no way to the ACU
        if not killed.done():
            killed.set_result(None)


class KilledError(Exception):
    """What a script raises for a SIGKILL."""
