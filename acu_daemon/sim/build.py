"""SIMULATION: puts a fake ACU together from what a command line and a configuration give."""

from math import radians
from pathlib import Path

from acu_daemon.model import AxisLimits, Correction, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.protocol.sa3842 import DEFAULT_ADDRESS
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import Scenario, read_scenario
from acu_daemon.sim.sky import DelayedPropagator, OrbitSky, Sky, read_truth


def make_sky(propagator: Propagator, site: Site, scenario: Scenario, truth: Path | None = None) -> Sky:
    """The sky from a truth CSV, else from the elements with the scenario's errors.  UsageError: the CSV is wrong."""
    if truth is not None:
        return read_truth(truth)
    errors = scenario.sky
    turned = propagator.corrected(Correction(delta_raan_rad=radians(errors.delta_raan_deg)))
    return OrbitSky(DelayedPropagator(turned, errors.along_track_s), site)


def build_fake_acu(
    *,
    azimuth: AxisLimits,
    elevation: AxisLimits,
    beamwidth_deg: float,
    propagator: Propagator,
    site: Site,
    start_tai_s: float,
    scenario: Path | None = None,
    truth: Path | None = None,
    seed: int = 0,
    address: int = DEFAULT_ADDRESS,
) -> FakeAcu:
    """Build a fake ACU.  UsageError: the scenario or the truth file cannot be used."""
    chosen = Scenario() if scenario is None else read_scenario(scenario)
    sky = make_sky(propagator, site, chosen, truth)
    return FakeAcu(AcuParts(azimuth, elevation, beamwidth_deg, sky, start_tai_s, chosen, seed, address))
