"""An ACU on a bench for each driver: what the driver sends goes in, what the ACU answers comes out, bytes both."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Star
from rotators import Rotator
from skeleton_driver import SkeletonDriver
from tagged_driver import TaggedDriver

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.drivers.rotctl.rotctl_driver import RotctlDriver
from acu_daemon.drivers.sa3842.codec import CommandDecoder, encode_reply
from acu_daemon.drivers.sa3842.messages import Nak
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario
from acu_daemon.units import wrap_180


class OnBench(Protocol):
    """The ACU's side.  One with autotrack also `hears(is_on)`: a signal, from a little beside where it begins."""

    def answer(self, data: bytes, now_s: float) -> bytes:
        """What it says to these bytes, whole commands."""

    def place(self, now_s: float) -> tuple[float, float]:
        """Where the antenna is, deg."""


@dataclass
class Sa3842OnBench:
    star: Star = field(default_factory=lambda: Star(30.5, 40.3, is_on=False))
    decoder: CommandDecoder = field(default_factory=CommandDecoder)

    def __post_init__(self) -> None:
        antenna = AcuChoice(azimuth_deg=30.0, elevation_deg=40.0)
        self.acu = FakeAcu(AcuParts(AZIMUTH, ELEVATION, 5.0, self.star, START_TAI_S, Scenario(acu=antenna)))

    def hears(self, is_on: bool) -> None:
        self.star.is_on = is_on

    def answer(self, data: bytes, now_s: float) -> bytes:
        self.place(now_s)
        said = b""
        for event in self.decoder.feed(data, now_s):
            reply = Nak() if event.command is None else self.acu.answer(event.command)
            said += encode_reply(event.cmd, reply)
        return said

    def place(self, now_s: float) -> tuple[float, float]:
        self.acu.advance(START_TAI_S + now_s)
        status = self.acu.status()
        return status.az_deg, status.el_deg


@dataclass
class RotctldOnBench:
    rotator: Rotator = field(default_factory=lambda: Rotator(place=[30.0, 40.0]))

    def answer(self, data: bytes, now_s: float) -> bytes:
        return "".join(self.rotator.answer(line, now_s) for line in data.decode().splitlines()).encode()

    def place(self, now_s: float) -> tuple[float, float]:
        self.rotator.advance(now_s)
        return self.rotator.place[0], self.rotator.place[1]


@dataclass
class SkeletonOnBench:
    rotator: Rotator = field(default_factory=lambda: Rotator(place=[30.0, 40.0]))
    mode: str = "REMOTE"
    goal: str = ""

    def answer(self, data: bytes, now_s: float) -> bytes:
        return "".join(self._answer(line, now_s) + "\n" for line in data.decode().splitlines()).encode()

    def _answer(self, line: str, now_s: float) -> str:
        word, _, rest = line.partition(" ")
        match word:
            case "status":
                az_deg, el_deg = self.place(now_s)
                return f"status {az_deg:.2f} {el_deg:.2f} {self.mode}"
            case "who":
                return "who bench, simulated"
            case "point":
                self.goal = rest
            case "remote":
                self.mode = "REMOTE"
            case "standby":
                self.mode, self.goal = "STANDBY", ""
                self.rotator.answer("S", now_s)
            case _:
                return "no such command"
        if self.mode == "REMOTE" and self.goal:
            self.rotator.answer(f"P {self.goal}", now_s)
        return "ok"

    def place(self, now_s: float) -> tuple[float, float]:
        self.rotator.advance(now_s)
        return self.rotator.place[0], self.rotator.place[1]


@dataclass
class TaggedOnBench:
    rotator: Rotator = field(default_factory=lambda: Rotator(place=[30.0, 40.0], relay_s=0.0))
    mode: str = "program"
    goal: str = ""
    has_signal: bool = False
    source_deg: tuple[float, float] = (30.5, 40.3)  # where the signal comes from

    def hears(self, is_on: bool) -> None:
        self.has_signal = is_on

    def answer(self, data: bytes, now_s: float) -> bytes:
        return "".join(self.said(line, now_s) + "\n" for line in data.decode().splitlines()).encode()

    def said(self, line: str, now_s: float) -> str:
        tag, word, *rest = line.split()
        if word == "name":
            return f"{tag} name bench, simulated"
        if word == "goto":
            self.goal = " ".join(rest)
        elif word == "mode":
            self.mode = "seek" if rest == ["track"] else rest[0]
            self.goal = self.goal if self.mode != "halt" else ""
        az_deg, el_deg = self.place(now_s)
        return f"{tag} {az_deg % 360.0:.3f} {el_deg:.3f} {self.mode} {'signal' if self.has_signal else 'silence'}"

    def place(self, now_s: float) -> tuple[float, float]:
        if self.mode in ("seek", "track", "bridge"):
            self.mode = "track" if self.has_signal else "bridge" if self.mode != "seek" else "seek"
        if self.mode == "halt":
            self.rotator.answer("S", now_s)
        elif self.mode == "track":
            self.rotator.answer("P {} {}".format(*self.source_deg), now_s)
        elif self.goal:
            az_deg, el_deg = map(float, self.goal.split())
            here_deg = self.rotator.place[0]
            self.rotator.answer(f"P {here_deg + wrap_180(az_deg - here_deg)} {el_deg}", now_s)  # the nearest turn
        self.rotator.advance(now_s)
        return self.rotator.place[0], self.rotator.place[1]


@dataclass(frozen=True)
class Bench:
    """A driver, and its ACU."""

    name: str
    driver: Callable[[], AcuDriver]
    acu: Callable[[], OnBench]


BENCHES = (
    Bench("sa3842", Sa3842Driver, Sa3842OnBench),
    Bench("rotctl", RotctlDriver, RotctldOnBench),
    Bench("skeleton", SkeletonDriver, SkeletonOnBench),
    Bench("tagged", TaggedDriver, TaggedOnBench),
)
