"""A memory after another pass, or why it stays as it is.  Pure.

Theory: docs/estimation.md, Memory of the mount.
"""

from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.assist.estimators.full.pedestal_prior import Doubt
from acu_daemon.assist.mount_memory.day_and_night import at_time_of_day
from acu_daemon.assist.mount_memory.pedestal_memory import (
    LATEST_COUNT,
    PedestalMemory,
    Remembered,
    a_priori_sigmas,
    aged,
    in_a_pass,
    rezeroed,
    smoothed_noise,
)
from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.units import DEG, Array

MOST_STRAIN = 8.0  # sigmas squared, of six states of the orbit
MOST_NOISE = 1.5  # times the configured one
REZEROED_CHI2 = 16.0  # of two; one pass in a thousand by chance, by the last, the last two or three together
_SEEN_SHARE = 0.02  # of a direction's variance that a pass must take away, that it counts as seen


@dataclass(frozen=True, slots=True)
class Updated:
    """The memory after a pass; why_not: why the pass did not go into it, empty: it did; note: what people should know.

    shift_deg: by how much IA and IE were re-zeroed.
    """

    memory: PedestalMemory
    why_not: str = ""
    note: str = ""
    shift_deg: tuple[float, float] | None = None


def updated(before: PedestalMemory, seen: PassEstimate, settings: EstimatorSettings) -> Updated:
    """Take a pass into the memory."""
    if why_not := _why_spoiled(seen):
        return Updated(before, why_not)
    memory = aged(before, settings, seen.at_tai_s)
    if memory.pass_count:
        doubts = (*memory.doubts, seen.doubt)[-LATEST_COUNT:]
        latest = max(_latest(doubts), key=lambda one: one.log_evidence)
        if latest.chi2 > REZEROED_CHI2:
            return _rezeroed(memory, latest)
        if seen.doubt.is_rezeroed:
            return Updated(replace(before, doubts=doubts), "it is likelier with encoders that were re-zeroed")
        memory = replace(memory, doubts=doubts)
        if why_not := _why_surprising(memory, seen, settings):
            return Updated(replace(before, doubts=doubts), why_not)
    sigmas = a_priori_sigmas(settings)
    const, mount = (
        fused(one, at_time_of_day(seen.begin_tai_s), in_a_pass(one, sigma, seen.begin_tai_s).covariance, estimate)
        for one, sigma, estimate in zip((memory.const, memory.mount), sigmas, (seen.const, seen.mount), strict=True)
    )
    after = replace(
        memory,
        pass_count=memory.pass_count + 1,
        const=const,
        mount=mount,
        evidence=memory.evidence + seen.evidence,
        noise=smoothed_noise(memory, seen.noise),
    )
    return Updated(after, note=_preference_text(before, after))


def fused(persistent: Remembered, h: Array, prior: Array, estimate: Remembered) -> Remembered:
    """The persistent part of a state after a pass's estimate of it.

    h: what that pass sees of the persistent part.  prior: covariance of the state in that pass, the persistent part's
    and what every pass has of its own; the estimate was made with it.
    K = P h^T inv(A), m + K (x - h m), P - K (A - C) K^T.
    """
    is_open = np.diag(prior) > 0.0
    which = np.ix_(is_open, is_open)
    unit = np.sqrt(np.diag(prior)[is_open])
    correlation = prior[which] / np.outer(unit, unit)
    gain = persistent.covariance @ h[is_open].T / unit @ np.linalg.inv(correlation) / unit
    mean = persistent.mean + gain @ (estimate.mean - h @ persistent.mean)[is_open]
    covariance = persistent.covariance - gain @ (prior - estimate.covariance)[which] @ gain.T
    return Remembered(mean, (covariance + covariance.T) / 2.0)


def _latest(doubts: tuple[Doubt, ...]) -> list[Doubt]:
    """The last, the last two and so on together: nobody knows since which pass an encoder is another."""
    return [sum(doubts[k + 1 :], start=doubts[k]) for k in range(len(doubts))]


def _rezeroed(memory: PedestalMemory, doubt: Doubt) -> Updated:
    ia_deg, ie_deg = (doubt.shift_rad / DEG).tolist()
    note = (
        f"the last passes agree that the encoders were re-zeroed, by {ia_deg:+.3f} deg in azimuth and {ie_deg:+.3f} in "
        "elevation: the memory goes on from there"
    )
    after = replace(rezeroed(memory, doubt), pass_count=memory.pass_count + 1)
    return Updated(after, note=note, shift_deg=(ia_deg, ie_deg))


def _why_spoiled(seen: PassEstimate) -> str:
    """Why a pass says nothing of the pedestal."""
    if seen.orbit_strain > MOST_STRAIN:
        return "the satellite was farther from its elements than their sigmas allow"
    if seen.noise_scale > MOST_NOISE:
        return f"its readings were {seen.noise_scale:.1f} times as noisy as [readings] says"
    return ""


def _why_surprising(memory: PedestalMemory, seen: PassEstimate, settings: EstimatorSettings) -> str:
    """Why a pass contradicts the memory of the mount; n + 4 sqrt(2 n) of n directions that it saw is no chance."""
    expected, estimate = in_a_pass(memory.mount, a_priori_sigmas(settings)[1], seen.begin_tai_s), seen.mount
    prior = expected.covariance
    is_open = np.diag(prior) > 0.0
    root = np.linalg.cholesky(prior[np.ix_(is_open, is_open)] + 1e-30 * np.eye(int(is_open.sum())))
    whitened = np.linalg.solve(root, estimate.covariance[np.ix_(is_open, is_open)])
    taken, directions = np.linalg.eigh(np.eye(len(root)) - np.linalg.solve(root, whitened.T))
    off = directions.T @ np.linalg.solve(root, (estimate.mean - expected.mean)[is_open])
    is_seen = taken > _SEEN_SHARE
    count = int(np.count_nonzero(is_seen))
    innovation = float(np.sum(off[is_seen] ** 2 / taken[is_seen]))
    return (
        f"it contradicts the passes before it ({innovation:.0f} sigmas squared of {count} terms)"
        if innovation > count + 4.0 * np.sqrt(2.0 * count)
        else ""
    )


def _preference_text(before: PedestalMemory, after: PedestalMemory) -> str:
    if after.has_mount == before.has_mount:
        return ""
    return (
        "the passes so far are likelier with NPAE, AN, AW and TF: they predict from now on"
        if after.has_mount
        else "the passes so far are as likely without NPAE, AN, AW and TF: they do not predict any more"
    )
