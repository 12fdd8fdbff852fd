"""SIMULATION: a rotator behind a rotctld, in virtual time, and the daemon that flies a pass on it."""

import asyncio
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.cli.run_setup import make_job
from acu_daemon.cli.virtual_pass import events_to, taped
from acu_daemon.daemon.service import Outcome, Service, SignalSource
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.edge.clock import Clock, LoopClock
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.errors import LinkError, LinkRefusedError
from acu_daemon.model import Reading
from acu_daemon.sim.virtual import run_virtual

PIECE_S = 0.005
STATE = (
    "1\n{model}\nmin_az={az[0]:f}\nmax_az={az[1]:f}\nmin_el={el[0]:f}\nmax_el={el[1]:f}\n"
    "south_zero=0\nrot_type=AzEl\ndone\n"
)


@dataclass
class Rotator:
    """Two axes that run at one speed or stand, after their relays have switched; what it says is rounded."""

    rate_deg_s: tuple[float, float] = (6.0, 3.0)
    step_deg: float = 0.1
    relay_s: float = 0.2
    az_limits_deg: tuple[float, float] = (-180.0, 450.0)
    el_limits_deg: tuple[float, float] = (0.0, 180.0)
    model: int = 1
    place: list[float] = field(default_factory=lambda: [0.0, 0.0])
    orders: list[tuple[float, str]] = field(default_factory=list)  # P and S, when they came
    _goal: list[float] | None = None
    _moves_from_s: float = 0.0
    _now_s: float = 0.0

    def advance(self, now_s: float) -> None:
        moving_s = max(0.0, now_s - max(self._now_s, self._moves_from_s))
        self._now_s = now_s
        for axis, goal in enumerate(self._goal or ()):
            way_deg, most_deg = goal - self.place[axis], self.rate_deg_s[axis] * moving_s
            self.place[axis] += math.copysign(min(abs(way_deg), most_deg), way_deg)

    def shown(self) -> tuple[float, float]:
        az, el = (round(angle / self.step_deg) * self.step_deg for angle in self.place)
        return az, el

    def answer(self, line: str, now_s: float) -> str:
        """As rotctld 4.5 does."""
        self.advance(now_s)
        words = line.split()
        match words:
            case ["p"]:
                return "{:.2f}\n{:.2f}\n".format(*self.shown())
            case ["P", az, el]:
                self.orders.append((now_s, line))
                goal = [float(az), float(el)]
                for angle, (low, high) in zip(goal, (self.az_limits_deg, self.el_limits_deg), strict=True):
                    if not low <= angle <= high:
                        return "RPRT -1\n"
                if self._goal is None or self._goal == self.place:
                    self._moves_from_s = now_s + self.relay_s
                self._goal = goal
                return "RPRT 0\n"
            case ["S"]:
                self.orders.append((now_s, line))
                self._goal = None
                return "RPRT 0\n"
            case ["\\dump_state"]:
                return STATE.format(model=self.model, az=self.az_limits_deg, el=self.el_limits_deg)
        return ""


@dataclass
class Habits:
    """How a rotctld behaves; a test changes it in mid-flight."""

    latency_s: float = 0.005
    piece_bytes: int = 0  # each answer comes in pieces of so many bytes, PIECE_S apart; 0: whole
    refuses: dict[str, int] = field(default_factory=dict)  # code by first letter of the command
    is_dead: bool = False  # nobody listens; a connection that stands is closed


class RotctldLink:
    """A Link to a rotctld in memory.  It answers one line after the other."""

    description = "tcp://rotator:4533"
    byte_time_s = 0.0

    def __init__(self, rotator: Rotator, clock: Clock, habits: Habits) -> None:
        self._rotator, self._clock, self._habits = rotator, clock, habits
        self._arrivals: Arrivals | None = None
        self._free_s = self._out_s = 0.0
        self.connect_count = 0

    async def open(self) -> None:
        if self._habits.is_dead:
            raise LinkRefusedError(f"nobody listens at {self.description}")
        self._arrivals = Arrivals()
        self._free_s = self._clock.monotonic_s()
        self.connect_count += 1

    def die(self) -> None:
        """The process ends: the connection with it.  The rotator goes on to where it was sent."""
        self._habits.is_dead = True
        if self._arrivals is not None:
            self._arrivals.fail(LinkError(f"{self.description} was closed by the other side"))

    def write(self, data: bytes) -> None:
        if self._arrivals is None:
            raise LinkError(f"{self.description} is not open")
        for line in data.decode("ascii").splitlines():
            self._free_s = max(self._free_s, self._clock.monotonic_s()) + self._habits.latency_s
            asyncio.get_running_loop().call_at(self._free_s, self._answer, line, self._arrivals)

    def _answer(self, line: str, arrivals: Arrivals) -> None:
        if self._habits.is_dead:
            return
        code = self._habits.refuses.get(line[:1])
        text = self._rotator.answer(line, self._clock.monotonic_s()) if code is None else f"RPRT -{code}\n"
        size = self._habits.piece_bytes or len(text) or 1
        self._out_s = max(self._out_s, self._clock.monotonic_s())
        for first in range(0, len(text), size):
            piece = text[first : first + size].encode()
            asyncio.get_running_loop().call_at(self._out_s, self._arrive, piece, arrivals)
            self._out_s += PIECE_S

    def _arrive(self, piece: bytes, arrivals: Arrivals) -> None:
        arrivals.put(piece, self._clock.monotonic_s())

    async def read(self, until_s: float = math.inf) -> tuple[bytes, float]:
        return await self._opened().get(until_s)

    def drain_input(self) -> bytes:
        return self._opened().take_all()

    async def close(self) -> None:
        self._arrivals = None

    def _opened(self) -> Arrivals:
        if self._arrivals is None:
            raise LinkError(f"{self.description} is not open")
        return self._arrivals


@dataclass
class RotatorFlight:
    """What a flight left behind.  places: time, and where the rotator really was, ten a second."""

    rotator: Rotator
    link: RotctldLink | None = None
    snapshots: list[Snapshot] = field(default_factory=list)
    places: list[tuple[float, float, float]] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)
    to_fit_count: int = 0
    readings: list[Reading] = field(default_factory=list)
    outcome: Outcome | None = None

    def states(self) -> list[str]:
        return [str(event["state"]) for event in self.events if event["event"] == "state.changed"]

    def named(self, name: str) -> list[dict[str, Any]]:
        return [event for event in self.events if event["event"] == name]


Action = Callable[[RotctldLink, Habits, Service], None]


def fly_rotator(
    target: Target,
    rotator: Rotator,
    begin_tai_s: float,
    end_tai_s: float,
    *,
    habits: Habits | None = None,
    script: Sequence[tuple[float, Action]] = (),
    is_rehearsal: bool = True,
    driver: AcuDriver | None = None,
    signal: SignalSource | None = None,
    tape: Path | None = None,
) -> RotatorFlight:
    """Run the daemon on a pass in virtual time.  script: what happens, in seconds from the beginning.

    driver: of another ACU that speaks in lines, as `rotator` does then; by default that of rotctld.
    tape: a file to record the pass in.
    """
    flight, habits = RotatorFlight(rotator), habits or Habits()

    async def main() -> None:
        clock = LoopClock(begin_tai_s)
        flight.link = link = RotctldLink(rotator, clock, habits)
        job = make_job(target, coming_pass(target, begin_tai_s), link, is_rehearsal=is_rehearsal, end_tai_s=end_tai_s)

        if driver is not None:
            can = driver.capabilities
            watchdog_s = job.control.register_watchdog_s if can.has_register_watchdog else 0.0
            control = replace(job.control, acu=can, has_signal=can.has_autotrack, register_watchdog_s=watchdog_s)
            job = replace(job, driver=driver, control=control)

        def look(seen: Snapshot) -> None:
            rotator.advance(clock.monotonic_s())
            flight.places.append((clock.tai_s(), rotator.place[0], rotator.place[1]))
            flight.snapshots.append(seen)
            flight.to_fit_count += len(service._area.to_fit)

        with taped(tape, target, job, link, begin_tai_s) as note:
            service = Service(
                job,
                link,
                clock,
                InlineFitRunner(job.refit),
                note=note,
                on_snapshot=look,
                on_reading=flight.readings.append,
                signal=signal,
            )
            for at_s, action in script:
                asyncio.get_running_loop().call_later(at_s, action, link, habits, service)
            flight.outcome = await service.run()

    with events_to(flight.events):
        run_virtual(main())
    return flight
