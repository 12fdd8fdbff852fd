"""The pedestal's state from pass to pass: two memories and how likely they are, aged, updated, doubted.  Pure.

Theory: docs/estimation.md, Memory of the mount.  `const` knows IA, CA, IE and the scale of the refraction, `mount` also
NPAE, AN, AW and TF, and `still` these with zero points that day, night and weeks hardly move: which of them predicts is
decided by how likely whole passes were under each.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import MOUNT
from acu_daemon.assist.estimators.full.noise_correlation import WHITE, NoiseCorrelation
from acu_daemon.assist.estimators.full.pedestal_prior import IA, IE, RF, Doubt, PedestalPrior
from acu_daemon.assist.mount_memory.day_and_night import (
    COUNT,
    at_time_of_day,
    before_any_pass,
    swing_walk,
    without_swings,
)
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.units import DAY_S, DEG, Array

UNSURVEYED_SIGMA_DEG = 0.03  # of CA, NPAE, AN, AW, TF of a mount that nobody surveyed
PREFERRED = 3.0  # so much likelier, in its logarithm, whole passes must be with the mount's terms
LATEST_COUNT = 3  # of passes that are asked together whether an encoder was re-zeroed
_WALK_DEG = np.array([0.005, 0.0005, 0.005, 0.0, 0.0005, 0.002, 0.002, 0.0005])  # per square root of a day
_STILL_WALK_DEG = 0.002  # of IA and IE that hold still
_OF_A_PASS_DEG = np.array([0.008, 0.0, 0.008, 0.0, 0.0, 0.004, 0.004, 0.0])  # what comes and goes: sun, wind
_WALK_SHARE, _OF_A_PASS_SHARE = 0.3, 0.4  # of the a-priori sigma, for the refraction: its scale goes with the weather
_NOISE_PASSES = 4.0  # what is known of the noise is an average over about so many


@dataclass(frozen=True)
class Remembered:
    """Mean (8,), rad, and covariance (8, 8) of IA, CA, IE, RF, NPAE, AN, AW, TF; no variance: not estimated.

    Of a memory (12,) and (12, 12), with day and night.
    """

    mean: Array
    covariance: Array = field(repr=False)

    @property
    def terms(self) -> "Remembered":
        """The terms (8,) of a memory, over a day."""
        return Remembered(self.mean[:COUNT], self.covariance[:COUNT, :COUNT])

    def at(self, tai_s: float) -> "Remembered":
        """The terms (8,) of a memory at a time of the day."""
        h = at_time_of_day(tai_s)
        return Remembered(h @ self.mean, h @ self.covariance @ h.T)

    @property
    def still(self) -> "Remembered":
        """A memory without day and night."""
        return Remembered(*without_swings(self.mean, self.covariance))


@dataclass(frozen=True)
class PedestalMemory:
    """What is known after pass_count passes, the last at at_tai_s.

    evidence: how much likelier those passes were with `mount` than with `const`, in its logarithm; still_evidence: the
    last of them with `still` than with `mount`.  doubts: what the last say against the memory before them.
    """

    at_tai_s: float
    pass_count: int
    const: Remembered
    mount: Remembered
    still: Remembered
    evidence: float = 0.0
    still_evidence: float = 0.0
    doubts: tuple[Doubt, ...] = ()
    noise: NoiseCorrelation = WHITE

    @property
    def has_mount(self) -> bool:
        """Whether the mount's terms predict."""
        return self.evidence > PREFERRED

    @property
    def is_still(self) -> bool:
        """Whether, with the mount's terms, the zero points are taken to hold still."""
        return self.has_mount and self.still_evidence > PREFERRED

    @property
    def known(self) -> tuple[Remembered, Remembered, Remembered]:
        return self.const, self.mount, self.still

    @property
    def chosen(self) -> Remembered:
        return self.still if self.is_still else self.mount if self.has_mount else self.const


def first_memory(settings: EstimatorSettings, at_tai_s: float) -> PedestalMemory:
    """What is known before any pass: the sigmas of the configuration."""
    variances = [before_any_pass(sigma, is_still=is_still) for sigma, is_still in _assumed(settings)]
    const, mount, still = (Remembered(np.zeros(one.size), np.diag(one)) for one in variances)
    return PedestalMemory(at_tai_s, 0, const, mount, still)


def a_priori_sigmas(settings: EstimatorSettings) -> tuple[Array, Array]:
    """Of const and of mount, (8,) each, rad.  What [mount] says is surveyed has that sigma in both."""
    bias_deg = (
        settings.bias_sigma_azimuth_deg,
        settings.bias_sigma_azimuth_sec_deg,
        settings.bias_sigma_elevation_deg,
        settings.bias_sigma_elevation_cot_deg,
    )
    const = np.radians([*bias_deg, *settings.mount_sigmas_deg])
    mount = const.copy()
    axes = slice(COUNT - (MOUNT.stop - MOUNT.start), COUNT)
    mount[axes] = np.where(const[axes] > 0.0, const[axes], UNSURVEYED_SIGMA_DEG * DEG)
    if not settings.is_collimation_surveyed:
        mount[1] = max(mount[1], UNSURVEYED_SIGMA_DEG * DEG)
    return const, mount


def _assumed(settings: EstimatorSettings) -> tuple[tuple[Array, bool], ...]:
    """Of const, mount and still: a-priori sigmas (8,), and whether the zero points hold still."""
    const, mount = a_priori_sigmas(settings)
    return (const, False), (mount, False), (mount, True)


def aged(memory: PedestalMemory, settings: EstimatorSettings, at_tai_s: float) -> PedestalMemory:
    """The memory at a time: what drifts is known less well, at worst as well as before any pass."""
    days = abs(at_tai_s - memory.at_tai_s) / DAY_S
    known = []
    for one, (sigma, is_still) in zip(memory.known, _assumed(settings), strict=True):
        most = np.sqrt(before_any_pass(sigma, is_still=is_still))
        known.append(replace(one, covariance=grown(one.covariance, _walk(sigma, is_still=is_still) * days, most)))
    const, mount, still = known
    return replace(memory, at_tai_s=at_tai_s, const=const, mount=mount, still=still)


def grown(covariance: Array, more: Array, sigma: Array) -> Array:
    """A covariance with variances added, bounded by those before any pass; correlations stay bounded with them."""
    grown = covariance + np.diag(more)
    variance = np.diag(grown)
    scale = np.where(variance > sigma**2, sigma / np.sqrt(np.where(variance > 0.0, variance, 1.0)), 1.0)
    bounded: Array = grown * np.outer(scale, scale)
    return bounded


def _walk(sigma: Array, *, is_still: bool) -> Array:
    """Variances that a day adds, (12,); none to what is not estimated."""
    walk_deg = _WALK_DEG.copy()
    if is_still:
        walk_deg[[IA, IE]] = _STILL_WALK_DEG
    walk_deg[RF] = _WALK_SHARE * sigma[RF] / DEG
    return np.concatenate((np.where(sigma > 0.0, (walk_deg * DEG) ** 2, 0.0), swing_walk(sigma)))


def in_a_pass(known: Remembered, sigma: Array, tai_s: float) -> Remembered:
    """The terms (8,) of a memory in a pass at a time, with what every pass has of its own; sigma: a-priori (8,)."""
    own_deg = _OF_A_PASS_DEG.copy()
    own_deg[RF] = _OF_A_PASS_SHARE * sigma[RF] / DEG
    now = known.at(tai_s)
    own = np.where(sigma > 0.0, (own_deg * DEG) ** 2, 0.0)
    return replace(now, covariance=grown(now.covariance, own, sigma))


def expected(memory: PedestalMemory, settings: EstimatorSettings, at_tai_s: float) -> list[Remembered]:
    """What const, mount and still, aged, say of the terms (8,) in a pass at a time."""
    both = zip(memory.known, _assumed(settings), strict=True)
    return [in_a_pass(one, sigma, at_tai_s) for one, (sigma, _) in both]


def priors(memory: PedestalMemory, settings: EstimatorSettings, at_tai_s: float) -> list[PedestalPrior]:
    """What const, mount and still say of a pass at a time."""
    seen = expected(aged(memory, settings, at_tai_s), settings, at_tai_s)
    return [PedestalPrior(one.mean, one.covariance, memory.noise) for one in seen]


def prior_of(memory: PedestalMemory, settings: EstimatorSettings, at_tai_s: float) -> PedestalPrior | None:
    """What predicts in a pass at a time; None before the first pass: then the configuration says it."""
    if memory.pass_count == 0:
        return None
    const, mount, still = priors(memory, settings, at_tai_s)
    return still if memory.is_still else mount if memory.has_mount else const


def smoothed_noise(memory: PedestalMemory, seen: NoiseCorrelation) -> NoiseCorrelation:
    """What is known of the noise after another pass."""
    count = min(float(memory.pass_count), _NOISE_PASSES)
    return NoiseCorrelation(
        (count * memory.noise.successive + seen.successive) / (count + 1.0),
        (count * memory.noise.excess + seen.excess) / (count + 1.0),
    )


def rezeroed(memory: PedestalMemory, doubt: Doubt) -> PedestalMemory:
    """The memory with IA and IE moved by what the last passes say, and known as well as they say.

    The shift is one from `mount`; that the zero points hold still must be seen anew.
    """
    zeros = np.ix_((IA, IE), (IA, IE))

    def moved(one: Remembered) -> Remembered:
        mean, covariance = one.mean.copy(), one.covariance.copy()
        mean[[IA, IE]] += doubt.shift_rad
        covariance[zeros] += doubt.covariance
        return Remembered(mean, covariance)

    const, mount, still = (moved(one) for one in memory.known)
    return replace(memory, const=const, mount=mount, still=still, still_evidence=0.0, doubts=())
