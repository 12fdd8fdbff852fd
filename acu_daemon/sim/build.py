"""SIMULATION: puts a fake ACU together from what a command line and a configuration give."""

from dataclasses import replace
from math import radians
from pathlib import Path

from acu_daemon.drivers.sa3842.codec import DEFAULT_ADDRESS
from acu_daemon.model import AxisLimits, Correction, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.air import Air
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.apparent_sky import LOWEST_GEOMETRIC_EL_DEG, ApparentSky, make_air
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AirChoice, Scenario, read_scenario
from acu_daemon.sim.sky import DelayedPropagator, OrbitSky, SimulatedSky, read_truth

_UNSAID = AirChoice(refractivity_drawn_within=0.1)  # where a scenario has no [air]: weather is never quite as told


def make_sky(
    propagator: Propagator,
    site: Site,
    scenario: Scenario,
    truth: Path | None = None,
    *,
    station_air: Air | None = None,
    seed: int = 0,
) -> SimulatedSky:
    """The sky as the antenna meets it: from a truth CSV, else from the elements with the scenario's errors.

    station_air: the weather that the daemon is told of; None is a vacuum, whatever the scenario says.
    UsageError: the CSV is wrong.
    """
    errors, air = scenario.sky, None
    if station_air is not None:
        air = make_air(station_air, scenario.air or _UNSAID, site.station.height_m, seed)
    lowest_el_deg = 0.0 if air is None else LOWEST_GEOMETRIC_EL_DEG
    geometric: SimulatedSky
    if truth is not None:
        geometric = read_truth(truth, lowest_el_deg)
    else:
        turned = propagator.corrected(Correction(delta_raan_rad=radians(errors.delta_raan_deg)))
        of_now = replace(site, has_light_time=False)
        geometric = OrbitSky(DelayedPropagator(turned, errors.along_track_s), of_now, lowest_el_deg)
    is_late = air is not None if errors.light_time is None else errors.light_time
    return ApparentSky(geometric, air, is_late) if is_late or air is not None else geometric


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
    station_air: Air | None = None,
    seed: int = 0,
    address: int = DEFAULT_ADDRESS,
    tilt: tuple[AxisLimits, float] | None = None,
) -> FakeAcu:
    """Build a fake ACU.  UsageError: the scenario or the truth file cannot be used."""
    chosen = Scenario() if scenario is None else read_scenario(scenario)
    sky = make_sky(propagator, site, chosen, truth, station_air=station_air, seed=seed)
    parts = AcuParts(azimuth, elevation, beamwidth_deg, sky, start_tai_s, chosen, seed, address, site.skyline, tilt)
    return FakeAcu(parts)
