"""D of a real satellite from what is known of its orbit now and then, without a reference orbit.

A phased satellite crosses the equator northwards at R longitudes, 360/R degrees apart.  Where it really crosses,
folded into one such spacing and unwound, times the Earth's radius, is D (Galski and Orlando 2011, eq 1) but for a
constant; the median is taken out.  At the node the short-period terms of J2 in the node vanish, so no mean elements
are needed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import gcd, radians
from typing import NamedTuple

import numpy as np

from acu_daemon.errors import OrbitError, UsageError
from acu_daemon.groundtrack.environment import even_steps, running_integral
from acu_daemon.groundtrack.lunisolar import plane_rates
from acu_daemon.groundtrack.reference import Cycle, ReferenceOrbit, phased
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.brouwer import secular_rates
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.timescales import gmst_rad, utc_text
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

LONGEST_CYCLE_DAYS = 45
KEPT_WITHIN_M, _SHARE_OF_SPACING = 20_000.0, 0.25  # a satellite that is kept stays within +- this, and this share
_EARTH_RATE_RAD_S = 2.0 * np.pi / DAY_S * (1.0 + 1.0 / 365.2421897)
_PER_DAY = 1e-3  # of the revolutions a day: some 300 m of the semi-major axis
_PER_DAY_SPARSE = 2e-4  # where gaps leave little else to go by; sets of phased satellites are within 1e-4 of theirs
_UNSURE_M_DAY = 500.0  # by how much dD/dt within a gap may differ from that at its ends: manoeuvres, drag
_OTHER_A_M, _OTHER_I_RAD = 10_000.0, radians(1.0)  # farther from the others: no manoeuvre that keeps a phase
_NODE_STEPS = 6
_FARTHEST_A_M = 2_000.0  # of the mean orbit from that of its cycle; the elements' own bias is a few hundred
LONGEST_GAP_DAYS = 15.0
_SKY_STEP_S = 3.0 * 3600.0
_NO_ORIENTATION = EarthOrientation()


class Crossing(NamedTuple):
    """A passage of the equator, northwards: when, and at which longitude east."""

    tai_s: float
    longitude_rad: float


class MeanOrbit(NamedTuple):
    """What the search for a cycle starts from: Brouwer's mean elements, good to some hundred metres."""

    a_m: float
    e: float
    i_rad: float


@dataclass(frozen=True, slots=True)
class History:
    """D over time, (N,) each; `reference` tells what a step of the semi-major axis does.

    sky_m: the part of D that Sun and Moon make, from rest at the first point.
    """

    reference: ReferenceOrbit
    tai_s: Array
    d_m: Array
    sky_m: Array


def crossing_near(propagator: Propagator, tai_s: float, revolution_s: float) -> Crossing:
    """The ascending node nearest to a time.  Raises: OrbitError: no position there, or no node."""
    times_s = tai_s + np.linspace(-0.75, 0.75, 61) * revolution_s
    z = propagator.states_teme(times_s)[0][:, 2]
    rising = np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))
    if rising.size == 0:
        raise OrbitError("the orbit does not cross the equator: a satellite above it has no ground track to keep")
    k = min(rising, key=lambda one: abs(times_s[one] - tai_s))
    at_s = float(times_s[k] - z[k] * (times_s[k + 1] - times_s[k]) / (z[k + 1] - z[k]))
    for _ in range(_NODE_STEPS):
        r_m, v_m_s = propagator.states_teme(np.array([at_s]))
        at_s -= float(r_m[0, 2] / v_m_s[0, 2])
    when = np.array([at_s])
    r_m, _ = itrs_from_teme(*propagator.states_teme(when), when, _NO_ORIENTATION)
    return Crossing(at_s, float(np.arctan2(r_m[0, 1], r_m[0, 0])))


def revolutions_per_day(mean: MeanOrbit) -> float:
    """Nodal revolutions in a nodal day, the P of which R/Q is to be."""
    rates = secular_rates(mean.a_m, mean.e, mean.i_rad)
    return float((rates.argp_rad_s + rates.mean_anomaly_rad_s) / (_EARTH_RATE_RAD_S - rates.raan_rad_s))


def find_cycle(crossings: Sequence[Crossing], means: Sequence[MeanOrbit]) -> Cycle:
    """The shortest repeat cycle about which D stays within a few kilometres.

    Raises:  UsageError: there is none: the satellite is not phased, or what is known of it is too little.
    """
    per_day = float(np.median([revolutions_per_day(one) for one in means]))
    cycles = [Cycle(round(per_day * days), days) for days in range(1, LONGEST_CYCLE_DAYS + 1)]
    longest_gap_s = max(float(after.tai_s - before.tai_s) for before, after in pairwise(crossings))
    candidates = [
        one
        for one in cycles
        if gcd(*one) == 1
        and abs(one.per_day - per_day) < (_PER_DAY if longest_gap_s < _bridged_s(one) else _PER_DAY_SPARSE)
    ]
    if not candidates:
        raise UsageError(
            f"no repeat cycle of up to {LONGEST_CYCLE_DAYS} days fits: the satellite makes {per_day:.5f} revolutions a "
            "day; if it is phased, name the cycle with --cycle REVOLUTIONS/DAYS"
        )
    tried = []
    for cycle in candidates:
        d_m = unwound(cycle, crossings, _reference(cycle, means), means)
        range_m = float(np.max(d_m) - np.min(d_m)) / 2.0
        if range_m < min(KEPT_WITHIN_M, _SHARE_OF_SPACING * spacing_m(cycle)):
            return cycle
        tried.append((range_m, cycle))
    range_m, nearest = min(tried)
    raise UsageError(
        f"no repeat cycle of up to {LONGEST_CYCLE_DAYS} days fits: the satellite makes {per_day:.5f} revolutions a "
        f"day, and about the nearest cycle ({nearest.revolutions} in {nearest.days} days) its track wanders "
        f"+-{range_m / 1e3:.0f} km; if it is phased, name the cycle with --cycle REVOLUTIONS/DAYS"
    )


def spacing_m(cycle: Cycle) -> float:
    """Between neighbouring nodes of the whole cycle, along the equator."""
    return 2.0 * np.pi * EARTH_EQUATORIAL_RADIUS_M / cycle.revolutions


def history_of(
    crossings: Sequence[Crossing], means: Sequence[MeanOrbit], cycle: Cycle | None = None
) -> tuple[History, list[str]]:
    """D at every crossing, its median taken out; and what has to be said about gaps.

    Raises:  UsageError: fewer than three crossings; no cycle is found, or the one given does not fit.
    """
    if len(crossings) < 3:
        raise UsageError(
            f"{len(crossings)} element sets or passes are too few to see a drift in; at least 3 are needed"
        )
    chosen = cycle or find_cycle(crossings, means)
    reference = _reference(chosen, means)
    _refuse_other_cycle(reference, means)
    d_m = unwound(chosen, crossings, reference, means)
    tai_s = np.array([one.tai_s for one in crossings])
    node_rad = float(gmst_rad(tai_s[:1], 0.0)[0]) + crossings[0].longitude_rad
    return History(reference, tai_s, d_m - np.median(d_m), _sky_m(reference, tai_s, node_rad)), _gaps(chosen, tai_s)


def unwound(
    cycle: Cycle, crossings: Sequence[Crossing], reference: ReferenceOrbit, means: Sequence[MeanOrbit]
) -> Array:
    """D in metres (N,), zero at the first: of all that the folding allows, each is the nearest to what is expected.

    Across a gap in which the drift is lost D is expected where it was: a phased satellite is kept.
    """
    spacing = spacing_m(cycle)
    folded = np.array([one.longitude_rad for one in crossings]) * EARTH_EQUATORIAL_RADIUS_M
    tai_s = np.array([one.tai_s for one in crossings])
    rates = np.array([reference.by_a.drift * (one.a_m - reference.a_m) for one in means])
    rates -= np.median(rates)  # the elements' semi-major axis has a bias of its own
    d_m = np.empty_like(folded)
    d_m[0] = 0.0
    for k in range(1, folded.size):
        gap_s = float(tai_s[k] - tai_s[k - 1])
        drift_m = 0.5 * float(rates[k] + rates[k - 1]) * gap_s if gap_s < _bridged_s(cycle) else 0.0
        expected = d_m[k - 1] + drift_m
        seen = folded[k] - folded[0]
        d_m[k] = seen + spacing * round(float((expected - seen) / spacing))
    return d_m


def _bridged_s(cycle: Cycle) -> float:
    """The longest gap over which the drift at its ends tells D to a quarter of the spacing."""
    return 0.25 * spacing_m(cycle) / _UNSURE_M_DAY * DAY_S


def is_of_another_orbit(means: Sequence[MeanOrbit]) -> list[bool]:
    """Which mean orbits are so far from the median that they are of another satellite, or of before it was phased."""
    a_m, i_rad = (float(np.median([one[k] for one in means])) for k in (0, 2))
    return [abs(one.a_m - a_m) > _OTHER_A_M or abs(one.i_rad - i_rad) > _OTHER_I_RAD for one in means]


def _sky_m(reference: ReferenceOrbit, tai_s: Array, node_rad: float) -> Array:
    """What Sun and Moon make of D since the first point, (N,), the node at `node_rad` there."""
    times_s = even_steps(0.0, _SKY_STEP_S, int((tai_s[-1] - tai_s[0]) / _SKY_STEP_S) + 2)
    node = node_rad + reference.raan_rate_rad_s * times_s
    rates = plane_rates(tai_s[0] + times_s, reference.a_m, reference.i_rad, node)
    tilt = running_integral(rates.inclination, _SKY_STEP_S)
    drift = reference.drift_m(rates.raan, rates.alpha) + reference.by_i.drift * tilt
    made: Array = np.interp(tai_s - tai_s[0], times_s, running_integral(drift, _SKY_STEP_S))
    return made


def _reference(cycle: Cycle, means: Sequence[MeanOrbit]) -> ReferenceOrbit:
    return phased(cycle, float(np.median([one.e for one in means])), float(np.median([one.i_rad for one in means])))


def _refuse_other_cycle(reference: ReferenceOrbit, means: Sequence[MeanOrbit]) -> None:
    off_m = float(np.median([one.a_m for one in means])) - reference.a_m
    if abs(off_m) > _FARTHEST_A_M:
        raise UsageError(
            f"a cycle of {reference.cycle.revolutions} revolutions in {reference.cycle.days} days needs a semi-major "
            f"axis of {reference.a_m / 1e3:.2f} km, this satellite is {off_m / 1e3:+.2f} km off: it is not its cycle"
        )


def _gaps(cycle: Cycle, tai_s: Array) -> list[str]:
    """Where so long nothing is known that D may have moved on by a whole spacing unseen."""
    return [
        f"nothing is known from {utc_text(float(a), 0)} to {utc_text(float(b), 0)}, {(b - a) / DAY_S:.0f} days: D "
        f"after it may be off by a multiple of {spacing_m(cycle) / 1e3:.0f} km, and manoeuvres in it are not seen"
        for a, b in zip(tai_s[:-1], tai_s[1:], strict=True)
        if b - a > LONGEST_GAP_DAYS * DAY_S
    ]


def mean_orbit_of(mean_motion_rad_s: float, e: float, i_rad: float) -> MeanOrbit:
    """Brouwer's mean semi-major axis of an SGP4 (Kozai) mean motion, to some hundred metres.

    Kozai's mean motion counts J2's part of the mean anomaly's rate, Brouwer's does not.
    """
    a_m = (MU_M3_S2 / mean_motion_rad_s**2) ** (1.0 / 3.0)
    for _ in range(20):
        rate = secular_rates(a_m, e, i_rad).mean_anomaly_rad_s
        a_m += (rate - mean_motion_rad_s) / (1.5 * mean_motion_rad_s / a_m)
    return MeanOrbit(a_m, e, i_rad)
