"""SIMULATION: what an ACU is made of, and the one place that puts it together."""

from dataclasses import dataclass, field
from math import radians
from pathlib import Path

from acu_daemon.model import AxisLimits, Correction, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.protocol.sa3842 import DEFAULT_ADDRESS
from acu_daemon.sim.scenario import Scenario
from acu_daemon.sim.sky import DelayedPropagator, OrbitSky, Sky, read_truth


@dataclass(frozen=True, slots=True)
class AcuBuild:
    """What a simulated ACU is made of; angles of the limits are those of the encoder."""

    azimuth: AxisLimits
    elevation: AxisLimits
    beamwidth_deg: float
    sky: Sky
    start_tai_s: float
    scenario: Scenario = field(default_factory=Scenario)
    seed: int = 0
    address: int = DEFAULT_ADDRESS


def make_sky(propagator: Propagator, site: Site, scenario: Scenario, truth: Path | None = None) -> Sky:
    """The sky from a truth CSV, else from the elements with the scenario's errors.  UsageError: the CSV is wrong."""
    if truth is not None:
        return read_truth(truth)
    errors = scenario.sky
    turned = propagator.corrected(Correction(delta_raan_rad=radians(errors.delta_raan_deg)))
    return OrbitSky(DelayedPropagator(turned, errors.along_track_s), site)
