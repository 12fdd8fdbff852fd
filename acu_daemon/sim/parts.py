"""SIMULATION: what an ACU is made of."""

from dataclasses import dataclass

from acu_daemon.drivers.sa3842.codec import DEFAULT_ADDRESS
from acu_daemon.model import AxisLimits, Horizon
from acu_daemon.sim.scenario import Scenario
from acu_daemon.sim.sky import SimulatedSky


@dataclass(frozen=True, slots=True)
class AcuParts:
    """What a simulated ACU is made of; the limits are angles of the encoder, the simulation begins at start_tai_s."""

    azimuth: AxisLimits
    elevation: AxisLimits
    beamwidth_deg: float
    sky: SimulatedSky
    start_tai_s: float
    scenario: Scenario = Scenario()
    seed: int = 0
    address: int = DEFAULT_ADDRESS
    skyline: Horizon | None = None  # behind which nothing is heard
    tilt: tuple[AxisLimits, float] | None = None  # a tilt that leans the pedestal, and towards which azimuth
