"""The pedestal from several recorded passes, and what it leaves of their readings.  Pure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import make_prior
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.full.least_squares import Batch, solve
from acu_daemon.assist.estimators.full.normal_points import Sights
from acu_daemon.assist.estimators.full.pedestal_prior import RF, PedestalPrior
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, Remembered, a_priori_sigmas, first_memory
from acu_daemon.assist.mount_memory.update import updated
from acu_daemon.assist.mount_memory.whole_pass import LEAST_S, estimate_pass
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array

SUPPORTED_SHARE = 0.5  # of the sigma before any pass: a term known that much better is told by the data


@dataclass(frozen=True)
class RecordedPass:
    """Locked readings of a pass, oldest first, and what the satellite and the station were taken for."""

    label: str
    source: Propagator
    site: Site
    settings: EstimatorSettings
    readings: Readings = field(repr=False)


@dataclass(frozen=True)
class FittedPass:
    """What the readings of a pass differ from the best orbit by: across and in elevation, (2, N), deg.

    before, after: with the mount as [mount] has it, and as the passes together have it.  why_not: why the pass tells
    nothing of it; empty: it does.  az_deg, el_deg: geometric.
    """

    label: str
    why_not: str
    az_deg: Array = field(repr=False)
    el_deg: Array = field(repr=False)
    before_deg: Array = field(repr=False)
    after_deg: Array = field(repr=False)


def fit_mount(
    passes: Sequence[RecordedPass], on_done: Callable[[int], None] = lambda _: None
) -> tuple[PedestalMemory, list[FittedPass]]:
    """Take passes, in the order of time, into a memory that begins with the configuration's sigmas.

    Raises:  OrbitError: the elements of one have no answer for its times; ValueError: there are no passes.
    """
    if not passes:
        raise ValueError("no passes")
    memory = first_memory(passes[0].settings, float(passes[0].readings.tai_s[0]))
    seen: list[tuple[RecordedPass, Sights, str]] = []
    for count, one in enumerate(passes, start=1):
        sights = sights_of(one)
        estimate = None if sights is None else estimate_pass(one.source, one.site, one.settings, memory, sights)
        if sights is None or estimate is None:
            raise ValueError(f"{one.label}: fewer than {LEAST_S:g} s of locked readings")
        found = updated(memory, estimate, one.settings)
        memory = found.memory
        seen.append((one, sights, found.why_not))
        on_done(count)
    return memory, [_fitted(one, sights, why_not, memory) for one, sights, why_not in seen]


def sights_of(one: RecordedPass) -> Sights | None:
    """The readings without air and mount; None: the gate leaves none."""
    estimator = FullEstimator(one.source, one.site, one.settings)
    estimator.add(one.readings)
    return estimator.seen


def _fitted(one: RecordedPass, sights: Sights, why_not: str, memory: PedestalMemory) -> FittedPass:
    found = memory.chosen.at(float(sights.tai_s[0])).mean
    before, after = (_left_deg(one, sights, mean) for mean in (np.zeros_like(found), found))
    az_deg = np.arctan2(sights.sin_az, sights.cos_az) / DEG % 360.0
    return FittedPass(one.label, why_not, az_deg, np.arctan2(sights.sin_el, sights.cos_el) / DEG, before, after)


def _left_deg(one: RecordedPass, sights: Sights, mean: Array) -> Array:
    """What the best orbit leaves with these terms; the scale of the refraction is of the day, and stays open."""
    covariance = np.zeros((mean.size, mean.size))
    covariance[RF, RF] = a_priori_sigmas(one.settings)[0][RF] ** 2
    fresh = make_prior(one.source, one.settings, float(sights.tai_s[0]))
    batch = Batch(one.source, one.site, one.settings, PedestalPrior(mean, covariance).of(fresh))
    return solve(batch, sights, None).left.off_rad / DEG


def supported(known: Remembered, sigma: Array) -> list[bool]:
    """Which terms the data tell, (8,): those known at least twice as well as before any pass, sigma."""
    now = np.sqrt(np.diag(known.covariance))
    told: list[bool] = ((sigma > 0.0) & (now <= SUPPORTED_SHARE * sigma)).tolist()
    return told
