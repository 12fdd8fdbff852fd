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
    aged,
    expected,
    rezeroed,
    smoothed_noise,
)
from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.units import DEG, Array

MOST_STRAIN = 8.0  # sigmas squared, of six states of the orbit
MOST_NOISE = 1.5  # times the configured one
REZEROED_CHI2 = 16.0  # of two; one pass in a thousand by chance, by the last, the last two or three together
MOST_STILL = 10.0  # of the evidence of `still`, for or against: a pedestal that begins to move is found out
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
    given = expected(memory, settings, seen.begin_tai_s)
    if memory.pass_count:
        doubts = (*memory.doubts, seen.doubt)[-LATEST_COUNT:]
        latest = max(_latest(doubts), key=lambda one: one.log_evidence)
        if latest.chi2 > REZEROED_CHI2:
            return _rezeroed(memory, latest)
        if seen.doubt.is_rezeroed:
            return Updated(replace(before, doubts=doubts), "it is likelier with encoders that were re-zeroed")
        memory = replace(memory, doubts=doubts)
        if why_not := _why_surprising(given[1], seen.mount):
            return Updated(replace(before, doubts=doubts), why_not)
    if_still, likelier = under_another_prior(seen.mount, given[1], given[2])
    const, mount, still = (
        fused(one, at_time_of_day(seen.begin_tai_s), prior.covariance, estimate)
        for one, prior, estimate in zip(memory.known, given, (seen.const, seen.mount, if_still), strict=True)
    )
    after = replace(
        memory,
        pass_count=memory.pass_count + 1,
        const=const,
        mount=mount,
        still=still,
        evidence=memory.evidence + seen.evidence,
        still_evidence=float(np.clip(memory.still_evidence + likelier, -MOST_STILL, MOST_STILL)),
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


def under_another_prior(estimate: Remembered, given: Remembered, other: Remembered) -> tuple[Remembered, float]:
    """What a pass says of its terms under another prior, and how much likelier it is, in its logarithm.

    estimate: (x, C), made with the prior `given`, (m, P), so that g = inv(P) (x - m) and L = inv(P) - inv(P) C inv(P)
    are gradient and information of a shift of that mean.  Under (m', P'), with d = m' - m, D = P' - P and h = g - L d:
    g' = inv(1 + L D) h, L' = inv(1 + L D) L, x' = m' + P' g', C' = P' - P' L' P', and it is likelier by
    d^T g - d^T L d / 2 + h^T D g' / 2 - ln det(1 + L D) / 2.
    """
    is_open = np.diag(given.covariance) > 0.0
    which = np.ix_(is_open, is_open)
    unit = np.sqrt(np.diag(given.covariance)[is_open])
    scale = np.outer(unit, unit)
    prior, found, wanted = (one.covariance[which] / scale for one in (given, estimate, other))
    inverse = np.linalg.inv(prior)
    gradient = inverse @ ((estimate.mean - given.mean)[is_open] / unit)
    information = inverse - inverse @ found @ inverse
    aside, wider = (other.mean - given.mean)[is_open] / unit, wanted - prior
    turned = np.eye(unit.size) + information @ wider
    at_other = gradient - information @ aside
    gradient_after, information_after = np.linalg.solve(turned, at_other), np.linalg.solve(turned, information)
    likelier = aside @ (gradient + at_other) + at_other @ wider @ gradient_after - np.linalg.slogdet(turned)[1]
    mean, covariance = other.mean.copy(), other.covariance.copy()
    mean[is_open] += unit * (wanted @ gradient_after)
    covariance[which] -= scale * (wanted @ information_after @ wanted)
    return Remembered(mean, covariance), float(likelier) / 2.0


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


def _why_surprising(expected: Remembered, estimate: Remembered) -> str:
    """Why a pass contradicts the memory of the mount; n + 4 sqrt(2 n) of n directions that it saw is no chance."""
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
    if after.is_still != before.is_still:
        return f"the zero points of the last passes {'hold still' if after.is_still else 'move, by day or in weeks'}"
    if after.has_mount == before.has_mount:
        return ""
    return (
        "the passes so far are likelier with NPAE, AN, AW and TF: they predict from now on"
        if after.has_mount
        else "the passes so far are as likely without NPAE, AN, AW and TF: they do not predict any more"
    )
