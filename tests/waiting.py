"""A daemon that waits for a pass in virtual time, with a system clock and a configuration that change meanwhile."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Any

import pytest
import structlog
from flights import WRONG_ORBIT, sky_of

import acu_daemon.cli as cli
import acu_daemon.cli.elements_watch as elements_watch_file
import acu_daemon.edge.clock as clock_file
from acu_daemon.acu.commands import Command
from acu_daemon.cli.elements_watch import ElementsWatch
from acu_daemon.cli.options import load_target
from acu_daemon.cli.run_setup import Prepared, RunSetup, prepare
from acu_daemon.control.state import ControlState
from acu_daemon.daemon.runs import Runs
from acu_daemon.daemon.service import Outcome, Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.drivers.sa3842.codec import CommandEvent
from acu_daemon.edge.clock import LoopClock, SystemClock
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.errors import UsageError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.memory import MemoryLink
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario
from acu_daemon.sim.virtual import run_virtual

NAME = "demo-1"
DEMO = Path(cli.__file__).parent / "demo_config"  # where the satellite really is


class SetClock(SystemClock):
    """The product's clock on virtual time; the system's is the story's to set."""

    def __init__(self) -> None:
        self.is_rehearsal = False
        self.is_synchronised = None
        self.obey()

    def monotonic_s(self) -> float:
        return asyncio.get_running_loop().time()

    def tai_s(self) -> float:
        return self.monotonic_s() + self._offset_s

    async def sleep_until(self, tai_s: float) -> None:
        await asyncio.sleep(max(0.0, tai_s - self.tai_s()))

    def close(self) -> None:
        """Nothing to give back."""


class Now:
    """Writes at once, in the place of the thread."""

    problem = ""

    def put(self, job: Callable[[], None]) -> bool:
        job()
        return True


class Heard(FakeAcu):
    """Notes what it is told."""

    def __init__(self, parts: AcuParts, commands: list[Command]) -> None:
        super().__init__(parts)
        self._commands = commands

    def execute(self, event: CommandEvent, now_tai_s: float) -> bytes:
        if event.command is not None:
            self._commands.append(event.command)
        return super().execute(event, now_tai_s)


@dataclass
class Story:
    """What a daemon lives through, and what is seen of it.  Actions at seconds from the start."""

    config: Path
    begin_tai_s: float  # true
    duration_s: float
    slow_s: float = 0.0  # the system's clock, at the start
    actions: list[tuple[float, Callable[["Story"], None]]] = field(default_factory=list)
    is_refused_anew: bool = False  # the second run finds something that it cannot begin with
    system_offset_s: float = 0.0
    snapshots: list[Snapshot] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)
    jobs: list[Prepared] = field(default_factory=list)
    commands: list[Command] = field(default_factory=list)
    outcome: Outcome | None = None
    runs: Runs | None = None

    def step(self, by_s: float) -> None:
        """Somebody sets the system's clock."""
        self.system_offset_s += by_s

    def named(self, name: str) -> list[dict[str, Any]]:
        return [event for event in self.events if event["event"] == name]

    async def live(self, directory: Path) -> None:
        loop, truth = asyncio.get_running_loop(), LoopClock(self.begin_tai_s)
        self.system_offset_s = self.begin_tai_s - loop.time() - self.slow_s
        clock = SetClock()
        target = load_target(self.config, NAME, clock.tai_s())
        station = target.station
        scenario = Scenario(sky=WRONG_ORBIT, acu=AcuChoice(azimuth_deg=160.0, elevation_deg=5.0))
        limits = station.acu.azimuth.limits(), station.acu.elevation.limits()
        sky = sky_of(load_target(DEMO, NAME, self.begin_tai_s), WRONG_ORBIT)
        parts = AcuParts(*limits, station.receiver.beamwidth_deg, sky, truth.tai_s(), scenario)
        link = MemoryLink(Heard(parts, self.commands), truth)
        files: Any = Now()
        frame = RunSetup(self.config, NAME, clock, link, directory, files, inf, is_shadow=False)
        self.jobs = [prepare(frame, target)]
        elements = ElementsWatch(self.config, NAME, target, clock)

        def why_anew(is_waiting: bool, step_s: float) -> str:
            if step_s:
                return "clock"
            return "elements" if is_waiting and elements.look(self.jobs[-1].job.coming) else ""

        def begin(memory: ControlState | None) -> Service:
            if memory is not None:
                if self.is_refused_anew:
                    raise UsageError("no pass")
                clock.obey()
                self.jobs.append(prepare(frame, elements.target, memory))
            job = self.jobs[-1].job
            runner = InlineFitRunner(job.refit)
            return Service(job, link, clock, runner, on_snapshot=self.snapshots.append, why_anew=why_anew)

        self.runs = Runs(begin)
        for at_s, action in self.actions:
            loop.call_later(at_s, action, self)
        loop.call_later(self.duration_s, self.runs.stop, "SIGTERM")
        self.outcome = await self.runs.run()


def tell(story: Story, directory: Path) -> Story:
    """Live through it."""

    async def inline(function: Callable[[], Any]) -> Any:
        return function()

    def gather(_logger: Any, _name: str, entry: Any) -> Any:
        story.events.append(dict(entry))
        raise structlog.DropEvent

    directory.mkdir(exist_ok=True)
    before = structlog.get_config()
    structlog.configure(processors=[gather], cache_logger_on_first_use=False)
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(clock_file, "_system_offset_s", lambda: story.system_offset_s)
            patch.setattr(elements_watch_file.asyncio, "to_thread", inline)
            run_virtual(story.live(directory))
    finally:
        structlog.configure(**before)
    return story
