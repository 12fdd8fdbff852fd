"""Passes of made orbits as a crooked pedestal shows them, by the simulator's axes: for tests of the memory."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from made_orbits import circular, site
from real_passes import noisy

from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.full.normal_points import Sights
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, first_memory
from acu_daemon.assist.mount_memory.update import Updated, updated
from acu_daemon.assist.mount_memory.whole_pass import PassEstimate, estimate_pass
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings
from acu_daemon.model import Readings, Site
from acu_daemon.orbit.brouwer import BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.units import DAY_S

NOISE_DEG = 0.03
HERE = site(5.0, 20.0)
SETTINGS = EstimatorSettings(NOISE_DEG, NOISE_DEG, orbit_sigmas=ElementSigmas())
CROOKED = MountAxes(0.08, -0.06, 0.02, -0.015, 0.02, -0.025, 0.015)
SQUARE = MountAxes(0.08, -0.06)
ORBITS = ((98.6, 7180.0), (66.0, 7350.0), (51.6, 6900.0), (82.5, 7400.0))
STEP_S = 4.0


@dataclass(frozen=True)
class MadePass:
    source: BrouwerPropagator
    readings: Readings  # without noise
    site: Site = HERE


@cache
def passes(axes: MountAxes, count: int, step_s: float = STEP_S) -> tuple[MadePass, ...]:
    """The first passes of four orbits in turn, one after the other; without noise."""
    found, now_tai_s = [], circular().epoch_tai_s
    while len(found) < count:
        source = circular(ORBITS[len(found) % len(ORBITS)][0], a_km=ORBITS[len(found) % len(ORBITS)][1])
        some = find_passes(source, HERE, now_tai_s, now_tai_s + DAY_S, 5.0)
        one = next(one for one in some if one.rise_tai_s > now_tai_s and 20.0 < one.culmination_el_deg < 85.0)
        found.append(made(source, axes, one.rise_tai_s, one.set_tai_s, step_s))
        now_tai_s = one.set_tai_s
    return tuple(found)


def made(source: BrouwerPropagator, axes: MountAxes, first_tai_s: float, last_tai_s: float, step_s: float) -> MadePass:
    tai_s = np.arange(first_tai_s, last_tai_s, step_s)
    seen = look_at(source, tai_s, HERE)
    shown = [axes.encoders_deg(*one) for one in zip(seen.az_deg.tolist(), seen.el_deg.tolist(), strict=True)]
    az_deg, el_deg = np.array(shown).T
    return MadePass(source, Readings(tai_s, az_deg % 360.0, el_deg))


def read(one: MadePass, seed: int, noise_deg: float = NOISE_DEG) -> Readings:
    shown = one.readings
    return noisy(shown.az_deg, shown.el_deg, shown.tai_s, noise_deg, np.random.default_rng(seed))


def sights_of(one: MadePass, readings: Readings) -> Sights:
    estimator = FullEstimator(one.source, one.site, SETTINGS)
    estimator.add(readings)
    assert estimator.seen is not None
    return estimator.seen


def estimate_of(one: MadePass, readings: Readings, memory: PedestalMemory) -> PassEstimate:
    found = estimate_pass(one.source, one.site, SETTINGS, memory, sights_of(one, readings))
    assert found is not None
    return found


def remembered(axes: MountAxes, count: int, first_seed: int = 0) -> tuple[PedestalMemory, list[Updated]]:
    """The memory after so many passes, and what became of each."""
    memory, told = first_memory(SETTINGS, circular().epoch_tai_s), []
    for seed, one in enumerate(passes(axes, count)):
        told.append(updated(memory, estimate_of(one, read(one, first_seed + seed), memory), SETTINGS))
        memory = told[-1].memory
    return memory, told
