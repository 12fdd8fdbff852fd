"""An ACU on a bench for each driver: what the driver sends goes in, what the ACU answers comes out, bytes both."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Star
from rotators import Rotator
from skeleton_driver import SkeletonDriver

from acu_daemon.acu.driver import AcuDriver
from acu_daemon.drivers.rotctl.rotctl_driver import RotctlDriver
from acu_daemon.drivers.sa3842.codec import CommandDecoder, encode_reply
from acu_daemon.drivers.sa3842.messages import Nak
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario


class OnBench(Protocol):
    """The ACU's side."""

    def answer(self, data: bytes, now_s: float) -> bytes:
        """What it says to these bytes, whole commands."""

    def place(self, now_s: float) -> tuple[float, float]:
        """Where the antenna is, deg."""


@dataclass
class Sa3842OnBench:
    acu: FakeAcu = field(
        default_factory=lambda: FakeAcu(
            AcuParts(
                *(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S),
                Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0)),
            )
        )
    )
    decoder: CommandDecoder = field(default_factory=CommandDecoder)

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
)
