"""SIMULATION: a whole pass in virtual time: the real daemon against the fake ACU, minutes in seconds, bit for bit."""

import asyncio
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory
from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.session.refit import RefitSetup
from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.cli.run_setup import make_job
from acu_daemon.cli.simulated import station_air, tilt_of
from acu_daemon.cli.tape_head import head_of
from acu_daemon.daemon.service import Outcome, PassJob, Service, SignalSource
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.tally import Tally
from acu_daemon.drivers.sa3842.codec import CommandDecoder, address_byte
from acu_daemon.drivers.sa3842.messages import Command
from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.fit import FitRunner, InlineFitRunner
from acu_daemon.edge.tape import Note, no_note
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.edge.writer import Writer
from acu_daemon.model import Reading
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.acu_faults import break_acu
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.memory import MemoryLink
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import Scenario
from acu_daemon.sim.sky import SimulatedSky
from acu_daemon.sim.trace import TraceRow
from acu_daemon.sim.virtual import run_virtual
from acu_daemon.sim.wire_log import RegisterWrite


@dataclass
class Flight:
    """What a virtual pass left behind."""

    rows: list[TraceRow] = field(default_factory=list)  # what really happened, ten a second
    snapshots: list[Snapshot] = field(default_factory=list)
    commands: list[tuple[float, Command]] = field(default_factory=list)  # start of the write, TAI, and the command
    writes: list[RegisterWrite] = field(default_factory=list)  # what the ACU accepted
    events: list[dict[str, Any]] = field(default_factory=list)  # the log
    outcome: Outcome | None = None
    readings: list[Reading] = field(default_factory=list)
    estimates: list[PassEstimate] = field(default_factory=list)  # what the pass said of the pedestal, with a memory

    def states(self) -> list[str]:
        """The states of the daemon in their order."""
        return [str(event["state"]) for event in self.events if event["event"] == "state.changed"]


@dataclass(frozen=True, slots=True)
class ScriptAccess:
    """What a script can reach."""

    acu: FakeAcu
    link: MemoryLink
    clock: LoopClock
    service: Service
    board: FaultBoard


Action = Callable[[ScriptAccess], None]


class _TappedLink(MemoryLink):
    """A memory link that notes every command."""

    def __init__(
        self, acu: FakeAcu, clock: LoopClock, byte_time_s: float, address: int, flight: Flight, board: FaultBoard
    ) -> None:
        super().__init__(acu, clock, byte_time_s, board)
        self._tap = CommandDecoder(address, math.inf)
        self._tap_clock = clock
        self._flight = flight

    def write(self, data: bytes) -> None:
        now_tai_s = self._tap_clock.tai_s()
        for event in self._tap.feed(data, now_tai_s):
            if event.command is not None:
                self._flight.commands.append((now_tai_s, event.command))
        super().write(data)


def fly(
    target: Target,
    sky: SimulatedSky | Path,
    scenario: Scenario,
    *,
    begin_tai_s: float,
    end_tai_s: float,
    seed: int = 1,
    byte_time_s: float = 0.0,
    is_shadow: bool = False,
    is_resting: bool = False,
    script: Sequence[tuple[float, Action]] = (),
    memory: PedestalMemory | None = None,
    make_acu: Callable[[AcuParts], FakeAcu] = FakeAcu,
    make_clock: Callable[[float], LoopClock] = LoopClock,
    make_runner: Callable[[RefitSetup], FitRunner] = InlineFitRunner,
    signal: SignalSource | None = None,
    tape: Path | None = None,
    tally: Tally | None = None,
) -> Flight:
    """Run the daemon on a pass in virtual time.

    sky: as the antenna meets it (make_sky), or a truth CSV, which is geometric.  script: what happens to the ACU and
    the link, each at its TAI, such as a power cycle.
    memory: what the station knows of its antenna; None: it keeps no such thing.
    make_...: other parts than the usual ones, such as a clock that stalls.  signal: of a receiver beside the ACU.
    tape: a file to keep the pass in, as the daemon does.
    """
    flight = Flight()
    truth = sky
    if isinstance(truth, Path):
        elements, station = target.elements.propagator, target.station
        truth = make_sky(elements, station.site, scenario, truth, station_air=station_air(station), seed=seed)

    async def main() -> None:
        clock = make_clock(begin_tai_s)
        acu_section = target.station.acu
        parts = AcuParts(
            acu_section.azimuth.limits(),
            acu_section.elevation.limits(),
            target.station.receiver.beamwidth_deg,
            truth,
            begin_tai_s,
            scenario,
            seed,
            address_byte(acu_section.address),
            target.station.site.skyline,
            tilt_of(target.station),
        )
        acu = make_acu(parts)
        acu.observer = flight.rows.append
        acu.on_write = flight.writes.append
        board = FaultBoard()
        break_acu(acu, board, clock)
        link = _TappedLink(acu, clock, byte_time_s, parts.address, flight, board)
        for fault in scenario.faults:
            board.add(fault)
        coming = coming_pass(target, begin_tai_s)
        job = make_job(target, coming, link, is_rehearsal=True, end_tai_s=end_tai_s, memory=memory)
        job = replace(job, control=replace(job.control, is_shadow=is_shadow, is_resting=is_resting))
        with taped(tape, target, job, link, begin_tai_s) as note:
            service = Service(
                job,
                link,
                clock,
                make_runner(job.refit),
                note=note,
                on_snapshot=flight.snapshots.append,
                on_estimate=flight.estimates.append,
                on_reading=flight.readings.append,
                signal=signal,
                tally=tally,
            )
            loop = asyncio.get_running_loop()
            for tai_s, action in script:
                loop.call_later(tai_s - begin_tai_s, action, ScriptAccess(acu, link, clock, service, board))
            flight.outcome = await service.run()
        acu.advance(clock.tai_s())

    with events_to(flight.events):
        run_virtual(main())
    return flight


@contextmanager
def taped(tape: Path | None, target: Target, job: PassJob, link: Any, begin_tai_s: float) -> Iterator[Note]:
    """What keeps a pass in a file; tape None: in none."""
    if tape is None:
        yield no_note
        return
    head = head_of(target, job, link, begin_tai_s)
    with closing(Writer("tape", math.inf)) as files, closing(TapeFile(tape, head, files)) as kept:
        yield kept.note


@contextmanager
def events_to(events: list[dict[str, Any]]) -> Iterator[None]:
    """Gather the log in place of printing it."""
    before = structlog.get_config()

    def gather(_logger: Any, _name: str, entry: Any) -> Any:
        events.append(dict(entry))
        raise structlog.DropEvent

    structlog.configure(
        processors=[gather],
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        cache_logger_on_first_use=False,
    )
    try:
        yield
    finally:
        structlog.configure(**before)
