"""A daemon in a day of trouble: the real one against the fake ACU in virtual time, broken, killed and started again.

`Rig` does what a rule of the state machine asks for, `Judge` (promise_judge.py) watches the wire and the daemon.
"""

import asyncio
import errno
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import inf
from pathlib import Path
from types import TracebackType
from typing import Any
from unittest.mock import patch

import structlog
from flights import NOISE_DEG, RISING_ANTENNA, RISING_TAI_S, WRONG_ORBIT, demo_target, sky_of, the_pass
from promise_judge import Judge

import acu_daemon.edge.carry_over_file as carry_over_file
import acu_daemon.edge.clock as clock_file
import acu_daemon.edge.run_state as run_state_file
from acu_daemon.acu.commands import AcuMode, SelectMode, Stop, Stow
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup
from acu_daemon.cli.kept import open_kept
from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.cli.run_setup import make_job
from acu_daemon.control.tracking.pass_plan import PlanAnswer, PlanRequest
from acu_daemon.daemon.service import Outcome, Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.drivers.sa3842.codec import CommandDecoder, address_byte
from acu_daemon.drivers.sa3842.messages import Command, Status
from acu_daemon.edge.clock import LoopClock, SystemClock
from acu_daemon.edge.fit import FitDiedError, InlineFitRunner
from acu_daemon.edge.writer import replace_file
from acu_daemon.errors import LinkError, NoAcuError
from acu_daemon.model import Pass, Readings
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.acu_faults import break_acu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import parse_fault
from acu_daemon.sim.memory import MemoryLink
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Encoder, Scenario
from acu_daemon.sim.sky import SimulatedSky
from acu_daemon.sim.virtual import VirtualTimeLoop

STALL_LEAD_S = 0.001
RESTART_S = 0.1  # RestartSec of the unit
FIT_TIMEOUT_S = 5.0
HANDS: dict[str, Command] = {"stop": Stop(), "standby": SelectMode(AcuMode.STANDBY), "stow": Stow()}


@dataclass(frozen=True)
class Scene:
    """Where and when."""

    target: Target
    sky: SimulatedSky
    begin_tai_s: float
    antenna: AcuChoice
    coming: Pass


@cache
def demo_scene() -> Scene:
    """In the climb of the demo's pass, on the satellite."""
    target = demo_target()
    return Scene(target, sky_of(target), RISING_TAI_S, RISING_ANTENNA, the_pass(target, RISING_TAI_S))


class RigClock(SystemClock):
    """The product's clock, on virtual time; the system's clock is the rig's to set."""

    def __init__(self, rig: "Rig") -> None:
        self._rig = rig
        self.is_rehearsal = False
        self.is_synchronised = None
        self._offset_s = rig.system_offset_s
        self._timer = None

    @property
    def offset_s(self) -> float:
        return self._offset_s

    def monotonic_s(self) -> float:
        return self._rig.loop.time()

    def tai_s(self) -> float:
        return self.monotonic_s() + self._offset_s

    async def sleep_until(self, tai_s: float) -> None:
        await asyncio.sleep(max(0.0, tai_s - self.tai_s()))


class RigAcu(FakeAcu):
    """Notes every status that it sends."""

    judge: Judge

    def status(self) -> Status:
        status = super().status()
        if hasattr(self, "judge"):
            self.judge.reported(status)
        return status

    @property
    def follows_registers(self) -> bool:
        return self.is_powered and self._modes.follows_registers


class RigLink(MemoryLink):
    """Shows the judge what passes; ends with its daemon."""

    def __init__(self, rig: "Rig", acu: RigAcu, clock: LoopClock, board: FaultBoard) -> None:
        super().__init__(acu, clock, board=board)
        self._rig = rig
        self._tap = CommandDecoder(acu.address, inf)
        self._is_ended = False

    def end(self) -> None:
        """The daemon is gone: nothing of it reaches the ACU any more."""
        self._is_ended = True

    async def open(self) -> None:
        if self._is_ended:
            raise LinkError("the daemon is gone")
        self._tap = CommandDecoder(self._acu.address, inf)
        self._rig.judge.opened()
        await super().open()

    def write(self, data: bytes) -> None:
        if self._is_ended:
            raise LinkError("the daemon is gone")
        for event in self._tap.feed(data, self._rig.loop.time()):
            if event.command is not None:
                self._rig.judge.sent(event.command)
        super().write(data)

    def _deliver(self, piece: bytes) -> None:
        self._rig.judge.heard()
        super()._deliver(piece)


class RigFitRunner:
    """Fits in the loop as the child process would; its trouble is the rig's to set: "", "dies", "hangs"."""

    def __init__(self, setup: RefitSetup, rig: "Rig") -> None:
        self._setup = setup
        self._rig = rig
        self._given: list[Readings] = []
        self._inner: InlineFitRunner | None = None

    async def refit(self, request: RefitRequest) -> RefitReply:
        if len(request.readings):
            self._given.append(request.readings)
        if self._rig.fit_trouble:
            self._inner = None
            if self._rig.fit_trouble == "hangs":
                await asyncio.sleep(FIT_TIMEOUT_S)
            raise FitDiedError(f"the fit process {self._rig.fit_trouble}")
        if self._inner is None:
            self._inner = InlineFitRunner(self._setup)
            if self._given:
                request = replace(request, readings=Readings.joined(self._given))
        return await self._inner.refit(request)

    async def plan(self, asked: PlanRequest) -> PlanAnswer:
        if self._rig.fit_trouble:
            self._inner = None
            raise FitDiedError(f"the fit process {self._rig.fit_trouble}")
        return await InlineFitRunner(self._setup).plan(asked)

    async def close(self) -> None:
        """Nothing runs."""


class RigWriter:
    """Writes at once, in the place of the thread."""

    def put(self, job: Callable[[], None]) -> bool:
        job()
        return True


class Rig:
    """One daemon, one ACU, one state directory.  runs_on: after a pass another daemon is started for the next one."""

    def __init__(
        self, directory: Path, scene: Scene, *, is_armed: bool = True, runs_on: bool = False, seed: int = 1
    ) -> None:
        self.directory = directory
        self.scene, self.coming, self._runs_on = scene, scene.coming, runs_on
        self.satellite = scene.target.elements.label
        self.outcomes: list[Outcome] = []
        self.is_armed_at_start = is_armed
        self.fit_trouble = ""
        self.loop = VirtualTimeLoop()
        self._runner = asyncio.Runner(loop_factory=lambda: self.loop)
        self.true_offset_s = self.system_offset_s = scene.begin_tai_s
        self._is_disk_full = False
        self._before = structlog.get_config()
        self.errors: list[dict[str, Any]] = []
        structlog.configure(processors=[self._gather], cache_logger_on_first_use=False)
        self._patches = [
            patch.object(clock_file, "_system_offset_s", lambda: self.system_offset_s),
            patch.object(run_state_file, "replace_file", self._replace_file),
            patch.object(carry_over_file, "replace_file", self._replace_file),
        ]
        for one in self._patches:
            one.start()
        self._runner.run(self._build(seed))
        self.start()

    def _gather(self, _logger: Any, _name: str, entry: Any) -> Any:
        if entry["event"] in ("writer.failed", "run_state.unreadable", "carry_over.unreadable", "fence.refused"):
            self.errors.append(dict(entry))
        raise structlog.DropEvent

    def _replace_file(self, path: Path, data: bytes) -> None:
        if self._is_disk_full:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace_file(path, data)

    async def _build(self, seed: int) -> None:
        self.clock = LoopClock(self.true_offset_s)
        station = self.scene.target.station
        scenario = Scenario(sky=WRONG_ORBIT, encoder=Encoder(noise_deg=NOISE_DEG), acu=self.scene.antenna)
        self.acu = RigAcu(
            AcuParts(
                station.acu.azimuth.limits(),
                station.acu.elevation.limits(),
                station.receiver.beamwidth_deg,
                self.scene.sky,
                self.clock.tai_s(),
                scenario,
                seed,
                address_byte(station.acu.address),
            )
        )
        self.board = FaultBoard()
        break_acu(self.acu, self.board, self.clock)
        self.judge = self.acu.judge = Judge(self)
        self.acu.on_write = self.judge.applied

    # The daemon

    def start(self) -> None:
        """Start a daemon on what the last one left, with the clock right: one wrong from the start is not told."""
        self.system_offset_s = self.true_offset_s
        self._runner.run(self._start())

    async def _start(self) -> None:
        self.daemon_clock = RigClock(self)
        target = self.scene.target
        if self._runs_on:
            self.coming = coming_pass(target, self.daemon_clock.tai_s())
        kept = self._kept = open_kept(self.directory, target, self.coming, self.daemon_clock, RigWriter())  # type: ignore[arg-type]
        self.link = RigLink(self, self.acu, self.clock, self.board)
        job = make_job(target, self.coming, self.link, is_rehearsal=False, carried=kept.carried)
        job = replace(job, control=replace(job.control, is_armed=self.is_armed_at_start))
        job = replace(job, state=kept.state)
        self.config = job.control
        self.judge.started()
        self.service = Service(
            job,
            self.link,
            self.daemon_clock,
            RigFitRunner(job.refit, self),
            on_snapshot=self._see,
            on_fit=kept.offer,
            on_state=kept.see,
        )
        self.task = asyncio.create_task(self.service.run(), name="daemon")

    def _see(self, seen: Snapshot) -> None:
        self.judge.ticked(seen)

    @property
    def state(self) -> Any:
        """The memory of the daemon's decision."""
        return self.service._area.state

    def crash(self, pause_s: float) -> None:
        """SIGKILL, and the supervisor starts another."""
        self.link.end()
        self.task.cancel()
        self._runner.run(asyncio.wait([self.task]))
        self.judge.crashed()
        self._runner.run(asyncio.sleep(pause_s + RESTART_S))
        self.start()

    def end_and_run_again(self) -> None:
        """SIGTERM: a safe stop; then somebody starts it again."""
        self.service.stop("SIGTERM")
        self._runner.run(asyncio.wait([self.task]))
        self.judge.ended(self.task.result() if self.task.exception() is None else None)
        self._runner.run(asyncio.sleep(RESTART_S))
        self.start()

    # What happens

    def wait(self, time_s: float) -> None:
        """Let time pass, at most until a pass is over.

        A daemon that found no ACU is started again, as its supervisor would.
        """
        end_s = self.loop.time() + time_s
        while (left_s := end_s - self.loop.time()) > 1e-6:
            self.judge.begin()
            self._runner.run(asyncio.wait([self.task], timeout=left_s))
            self.judge.end()
            if self.task.done():
                self._after_end()
            if self.task.done():
                return

    def _after_end(self) -> None:
        error = self.task.exception()
        if isinstance(error, NoAcuError):
            self.judge.crashed()
            self._runner.run(asyncio.sleep(RESTART_S))
            self.start()
        elif error is not None:
            raise error
        else:
            self._kept.flush()
            self.outcomes.append(self.task.result())
            assert self._runs_on, f"the daemon ended: {self.outcomes[-1]}"

    def stall(self, time_s: float) -> None:
        """SIGSTOP just before a tick, and SIGCONT: the loop finds that time has passed."""
        period_s = self.config.period_s
        self.wait(period_s - self.daemon_clock.tai_s() % period_s - STALL_LEAD_S)
        self.skip(time_s)

    def skip(self, time_s: float) -> None:
        """Let time pass in which nothing runs."""
        self.judge.stalled(time_s)
        self.loop._now_s += time_s

    def fault(self, text: str) -> None:
        self._in_loop(lambda: self.board.add(parse_fault(text)))

    def clear_faults(self) -> None:
        self._in_loop(self.board.clear)

    def hand(self, what: str) -> None:
        """Somebody else, at another computer of the station."""

        def act() -> None:
            self.acu.advance(self.clock.tai_s())
            self.acu.answer(HANDS[what])

        self._in_loop(act)

    def ask(self, line: str) -> str:
        """A person at the control socket."""
        self.judge.asked(line)
        answer = self.service.answer(line)
        assert answer.startswith("ok ")
        return answer

    def step_clock(self, by_s: float) -> None:
        self.judge.clock_stepped()
        self.system_offset_s += by_s

    def fill_disk(self, is_full: bool) -> None:
        self._is_disk_full = is_full
        if is_full:
            self.judge.may_forget = True

    def _in_loop(self, act: Callable[[], object]) -> None:
        async def run() -> None:
            act()

        self._runner.run(run())

    def __enter__(self) -> "Rig":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.link.end()
        self.task.cancel()
        self._runner.run(asyncio.wait([self.task]))
        if not self.task.cancelled():
            self.task.exception()
        self._runner.close()
        for one in self._patches:
            one.stop()
        structlog.configure(**self._before)
