"""Small skies and a default ACU for the tests of the simulation."""

from dataclasses import dataclass

from acu_daemon.model import AxisLimits
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario
from acu_daemon.sim.sky import Direction, SimulatedSky

AZIMUTH = AxisLimits(-270.0, 270.0, 20.0, 10.0)
ELEVATION = AxisLimits(0.0, 90.0, 5.0, 5.0)
START_TAI_S = 6.0e8


@dataclass
class Star:
    """A satellite that moves at constant axis rates, and can be switched off."""

    az_deg: float = 30.0
    el_deg: float = 40.0
    az_rate_deg_s: float = 0.0
    el_rate_deg_s: float = 0.0
    is_on: bool = True

    def direction(self, tai_s: float) -> Direction | None:
        if not self.is_on:
            return None
        t = tai_s - START_TAI_S
        return (self.az_deg + self.az_rate_deg_s * t) % 360.0, self.el_deg + self.el_rate_deg_s * t, 1e6


class Bench:
    """A FakeAcu with its time."""

    def __init__(self, sky: SimulatedSky | None = None, scenario: Scenario | None = None, **parts: object) -> None:
        self.sky = sky if sky is not None else Star()
        scenario = scenario or Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0))
        values: dict[str, object] = {"azimuth": AZIMUTH, "elevation": ELEVATION, "beamwidth_deg": 1.0, **parts}
        self.acu = FakeAcu(AcuParts(sky=self.sky, start_tai_s=START_TAI_S, scenario=scenario, **values))  # type: ignore[arg-type]
        self.now_s = 0.0

    @property
    def tai_s(self) -> float:
        return START_TAI_S + self.now_s

    def wait(self, time_s: float) -> None:
        self.now_s += time_s
        self.acu.advance(self.tai_s)
