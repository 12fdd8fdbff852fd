#!/usr/bin/env python3
"""What a bad minute of readings does to the prediction, with the gate and without it: real passes, 0.03 deg noise.

    .venv/bin/python scripts/gate_figures.py                    the table (some minutes)
    .venv/bin/python scripts/gate_figures.py --only hunting     the kinds with that word in their name
    .venv/bin/python scripts/gate_figures.py --first-locks      first locks on a side lobe, without AGC
    .venv/bin/python scripts/gate_figures.py --vacuum           without air

A minute of lock, a bad minute, and a prediction of the rest of the pass, 300 s at most.  Change: the largest angle
between that prediction and the daemon's from the good minute alone.  Without the gate all readings go to `full`, whose
robust weights are all that is left.  Right: the share of the bad readings left out for the reason expected; good lost:
the share of the good ones left out, 20 s after the bad minute among them.  The passes are seen in the simulator's air,
the refractivity of each drawn within +-10 % of what is told.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from real_pass import truth_path
from tables.air import DRAWN, told_air, with_scale
from tables.skies import real_elements, real_sky
from tables.workers import run_script

from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.reading_gate import (
    ABOVE_MAX_ELEVATION,
    ACCELERATION,
    CORRELATED,
    DWELL,
    OFF_PATH,
    SIDE_LOBE,
    WRONG_TARGET,
    Dwell,
    locked_readings,
)
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AxisLimits, FitResult, Reading, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.air import standard_air
from acu_daemon.sim.apparent_sky import ApparentSky, make_air
from acu_daemon.sim.sky import SimulatedSky, read_truth
from acu_daemon.units import Array

NOISE_DEG = 0.03
AZIMUTH, ELEVATION = AxisLimits(-270.0, 270.0, 20.0, 10.0), AxisLimits(0.0, 90.0, 5.0, 5.0)
SETTINGS = EstimatorSettings(NOISE_DEG, NOISE_DEG, azimuth=AZIMUTH, elevation=ELEVATION)
BEGIN_S, LOCK_S, BAD_S, AFTER_S, AHEAD_S = 80.0, 60.0, 60.0, 20.0, 300.0
MAIN_DB, LOBE_DB = 12.0, -2.0
PASSES = (
    "iss-2022-Huntsville-20220211T2156",
    "jason-3-Wallops-20180615T1827",
    "sentinel-3a-CachoeiraPaulista-20181225T0140",
)

Spoil = Callable[[Array], tuple[Array, Array]]  # seconds into the bad minute -> degrees right and up of the satellite


@dataclass(frozen=True)
class Kind:
    """A bad minute: what moves the readings, and the reason that is right."""

    reason: str
    spoil: Spoil
    agc_db: float | None = None
    dwell_s: float = 0.0  # over 0: the lock comes and goes, always for less than that


def steady(right_deg: float, up_deg: float) -> Spoil:
    return lambda t: (np.full_like(t, right_deg), np.full_like(t, up_deg))


def drift(right_deg_s: float, up_deg_s: float, from_deg: float = 0.0) -> Spoil:
    return lambda t: (from_deg + right_deg_s * t, up_deg_s * t)


def hunting(amplitude_deg: float, rad_s: float) -> Spoil:
    return lambda t: (amplitude_deg * np.sin(rad_s * t), amplitude_deg * np.cos(rad_s * t))


def jumps(t: Array) -> tuple[Array, Array]:
    rng = np.random.default_rng(2)
    right_deg, up_deg = rng.choice([-1.0, 1.0], (2, t.size)) * rng.uniform(8.0, 20.0, (2, t.size))
    return 4.0 * right_deg, up_deg


KINDS = {
    "faster than the axis": Kind(OFF_PATH, jumps),
    "encoder jump of 40 deg": Kind(OFF_PATH, steady(40.0, 0.0)),
    "side lobe along, no AGC": Kind(SIDE_LOBE, steady(0.3, 1.4)),
    "side lobe across, no AGC": Kind(SIDE_LOBE, steady(-1.9, 0.4)),
    "side lobe with AGC": Kind(SIDE_LOBE, steady(1.2, 0.9), LOBE_DB),
    "drawn away, 0.05 deg/s": Kind(WRONG_TARGET, drift(0.04, -0.03)),
    "drawn away, 0.22 deg/s": Kind(WRONG_TARGET, drift(-0.2, 0.1)),
    "another satellite": Kind(WRONG_TARGET, drift(-0.25, 0.1, 4.0)),
    "above the highest elevation": Kind(ABOVE_MAX_ELEVATION, steady(0.15, 0.1)),
    "azimuth lags near its limit": Kind(ACCELERATION, steady(0.15, 0.0)),
    "hunting 0.17 deg, 0.95 Hz": Kind(CORRELATED, hunting(0.17, 6.0)),
    "hunting 0.15 deg, 0.95 Hz": Kind(CORRELATED, hunting(0.15, 6.0)),
    "hunting 0.10 deg, 0.95 Hz": Kind(CORRELATED, hunting(0.10, 6.0)),
    "hunting 0.15 deg, 0.3 Hz": Kind(CORRELATED, hunting(0.15, 1.9)),
    "hunting 0.15 deg, 2 Hz": Kind(CORRELATED, hunting(0.15, 12.6)),
    "short locks off the satellite": Kind(DWELL, steady(0.15, 0.1), dwell_s=1.0),
}


@dataclass(frozen=True)
class Place:
    """A real pass: elements of its time, the station, the truth."""

    source: Propagator
    site: Site
    sky: SimulatedSky  # as the antenna meets it
    start_tai_s: float
    end_tai_s: float

    @classmethod
    def of(cls, name: str, has_air: bool = True) -> "Place":
        table, site = read_truth(truth_path(name)), real_sky(name).site
        sky: SimulatedSky = table
        if has_air:
            height_m, drawn_by = site.station.height_m, sum(name.encode())
            sky = ApparentSky(table, make_air(standard_air(site.station), DRAWN, height_m, drawn_by), is_late=True)
            site = told_air(site)
        return cls(real_elements(name), site, sky, table.start_tai_s, table.end_tai_s)

    @property
    def settings(self) -> EstimatorSettings:
        return with_scale(SETTINGS, self.site)

    def truth(self, tai_s: Array) -> tuple[Array, Array]:
        seen = [self.sky.direction(float(t)) or (np.nan, np.nan, np.nan) for t in tai_s]
        az_deg, el_deg, _ = np.array(seen, dtype=np.float64).T
        return az_deg, el_deg


@dataclass(frozen=True)
class Figures:
    """Of one bad minute: changes of the prediction in degrees, shares of readings."""

    gated_deg: float
    plain_deg: float
    right: float
    left_out: float
    good_lost: float


def minutes(place: Place, hz: float, kind: Kind, seed: int, begin_s: float) -> tuple[Readings, Array]:
    """A good minute, a bad one and some seconds more, and the seconds since the bad one began."""
    rng = np.random.default_rng(seed)
    tai_s = place.start_tai_s + begin_s + np.arange(0.0, LOCK_S + BAD_S + AFTER_S, 1.0 / hz)
    az_deg, el_deg = place.truth(tai_s)
    t = tai_s - tai_s[0] - LOCK_S
    is_bad = (t >= 0.0) & (t < BAD_S)
    right_deg, up_deg = NOISE_DEG * rng.standard_normal((2, tai_s.size))
    off = kind.spoil(t[is_bad])
    right_deg[is_bad] += off[0]
    up_deg[is_bad] += off[1]
    agc_db = None if kind.agc_db is None else np.where(is_bad, kind.agc_db, MAIN_DB)
    return Readings(tai_s, (az_deg + right_deg / np.cos(np.radians(el_deg))) % 360.0, el_deg + up_deg, agc_db), t


def settings_of(kind: Kind, place: Place, at_tai_s: float) -> EstimatorSettings:
    """The usual ones; a limit that the path passes at the beginning of the bad minute where the kind is about one."""
    az_deg, el_deg = place.truth(at_tai_s + np.array([-1.0, 0.0, 1.0]))
    if kind.reason == ABOVE_MAX_ELEVATION:
        return replace(place.settings, max_fit_elevation_deg=float(el_deg[1]))
    if kind.reason == ACCELERATION and kind.spoil(np.zeros(1))[1] == 0.0:
        limit_deg_s2 = float(abs(np.diff(np.unwrap(az_deg, period=360.0), 2)[0])) / 0.3
        return replace(place.settings, azimuth=replace(AZIMUTH, max_acceleration_deg_s2=limit_deg_s2))
    return place.settings


def locks(readings: Readings, t: Array, dwell_s: float) -> tuple[Readings, Readings]:
    """What the dwell leaves, and all while locked; the bad minute has no lock in the first of every two seconds."""
    is_locked = (t < 0.0) | (t >= BAD_S) | (t % 2.0 >= 1.0)
    rows = zip(readings.tai_s.tolist(), readings.az_deg.tolist(), readings.el_deg.tolist(), is_locked, strict=True)
    seen = [Reading(t, az, el, bool(locked)) for t, az, el, locked in rows]
    return locked_readings(seen, Dwell(dwell_s)), readings.part(is_locked)


def gated(place: Place, readings: Readings, settings: EstimatorSettings) -> Refitter:
    """The daemon's own refits, once a second."""
    refitter = Refitter(RefitSetup(place.source, place.site, "full", settings, AZIMUTH))
    second = np.floor(readings.tai_s - readings.tai_s[0] + 1e-6)
    for k in np.unique(second):
        part = readings.part(second == k)
        refitter.refit(RefitRequest(part, part.tai_s[-1], 1.0, part.tai_s[-1], 180.0))
    return refitter


def fitted(refitter: Refitter, place: Place, at_tai_s: float) -> tuple[FitResult | None, dict[str, int]]:
    """The fit in use, and readings left out by reason."""
    reply = refitter.refit(RefitRequest(Readings.of([]), at_tai_s, 1.0, at_tai_s, 180.0))
    return reply.fit, reply.gate.counts


def plain(place: Place, readings: Readings) -> FitResult | None:
    estimator = FullEstimator(place.source, place.site, place.settings)
    estimator.add(readings)
    return estimator.fit()


def directions(place: Place, fit: FitResult | None, tai_s: Array) -> Array:
    """Unit vectors of a prediction, (3, N), encoder frame."""
    source = place.source if fit is None else place.source.corrected(fit.correction)
    seen = encoder_look(source, tai_s, place.site, fit)
    az, el = np.radians(seen.az_deg), np.radians(seen.el_deg)
    return np.stack((np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)))


def apart_deg(place: Place, one: FitResult | None, other: FitResult | None, tai_s: Array) -> float:
    a, b = (directions(place, fit, tai_s) for fit in (one, other))
    return float(np.degrees(2.0 * np.arcsin(np.linalg.norm(a - b, axis=0) / 2.0)).max())


def measure(place: Place, kind: Kind, hz: float, seed: int) -> Figures:
    """One bad minute."""
    begin_s = BEGIN_S
    readings, t = minutes(place, hz, kind, seed, begin_s)
    settings = settings_of(kind, place, float(readings.tai_s[0]) + LOCK_S)
    before, bad, after = t < 0.0, (t >= 0.0) & (t < BAD_S), t >= BAD_S
    end_tai_s = float(readings.tai_s[bad][-1])
    ahead_tai_s = np.arange(end_tai_s, min(end_tai_s + AHEAD_S, place.end_tai_s - 1.0), 5.0)
    offered, dwelt_count, seen = readings, 0, readings.part(~after)
    if kind.dwell_s:
        offered, acquired = locks(readings, t, kind.dwell_s)
        seen = acquired.part(acquired.tai_s <= end_tai_s)
        dwelt_count = len(seen) - int(np.count_nonzero(offered.tai_s <= end_tai_s))
    good = offered.part(offered.tai_s < readings.tai_s[bad][0])
    reference, _ = fitted(gated(place, good, settings), place, float(good.tai_s[-1]))
    fit, counts = fitted(gated(place, offered.part(offered.tai_s <= end_tai_s), settings), place, end_tai_s)
    counts[DWELL] = dwelt_count
    bad_count = dwelt_count if kind.dwell_s else int(np.count_nonzero(bad))
    _, after_counts = fitted(gated(place, offered, settings), place, float(readings.tai_s[-1]))
    is_limit = settings != place.settings  # what comes after the bad minute is beyond it too, and rightly left out
    lost = max(sum(after_counts.values()) - int(np.count_nonzero(bad)), 0)
    return Figures(
        gated_deg=apart_deg(place, fit, reference, ahead_tai_s),
        plain_deg=apart_deg(place, plain(place, seen), reference, ahead_tai_s),
        right=counts.get(kind.reason, 0) / bad_count,
        left_out=sum(counts.values()) / bad_count,
        good_lost=np.nan if is_limit else lost / np.count_nonzero(before | after),
    )


def bad_minutes(word: str, runs: int, has_air: bool) -> Iterator[str]:
    """Lines of the table."""
    places = [Place.of(name, has_air) for name in PASSES]
    yield f"{len(places)} passes x {runs} runs: median / worst change of the prediction, deg; shares of readings"
    yield ""
    yield "| a minute of | Hz | with the gate | without | right reason | left out | good lost |"
    yield "|---|---|---|---|---|---|---|"
    for name, kind in KINDS.items():
        for hz in (1.0, 10.0) if word in name else ():
            seen = [measure(place, kind, hz, seed) for place in places for seed in range(runs)]
            of = {key: np.array([getattr(one, key) for one in seen]) for key in Figures.__dataclass_fields__}
            lost = "-" if np.isnan(of["good_lost"]).all() else f"{of['good_lost'].max():.0%}"
            yield (
                f"| {name} | {hz:g} | {np.median(of['gated_deg']):.3f} / {of['gated_deg'].max():.3f} "
                f"| {np.median(of['plain_deg']):.3f} / {of['plain_deg'].max():.3f} "
                f"| {of['right'].min():.0%} | {of['left_out'].min():.0%} | {lost} |"
            )


def first_locks(has_air: bool, seconds: tuple[float, ...] = (10.0, 20.0, 40.0, 80.0)) -> Iterator[str]:
    """Lines of the table of first locks on a side lobe for a minute: prediction's error after so much main lobe."""
    place = Place.of(PASSES[0], has_air)
    yield "| first lock, deg right / up | " + " | ".join(f"after {s:g} s" for s in seconds) + " |"
    yield "|---" * (len(seconds) + 1) + "|"
    for beams in (1.2, 1.5, 2.0):
        for angle in range(0, 360, 60):
            right_deg, up_deg = beams * np.cos(np.radians(angle)), beams * np.sin(np.radians(angle))
            yield (
                f"| {right_deg:+.1f} / {up_deg:+.1f} | "
                + " | ".join(_first_lock(place, right_deg, up_deg, seconds))
                + " |"
            )


def _first_lock(place: Place, right_deg: float, up_deg: float, seconds: tuple[float, ...]) -> Iterator[str]:
    rng = np.random.default_rng(1)
    tai_s = place.start_tai_s + BEGIN_S + np.arange(0.0, BAD_S + max(seconds), 0.5)
    az_deg, el_deg = place.truth(tai_s)
    is_bad = tai_s < tai_s[0] + BAD_S
    noise_deg = NOISE_DEG * rng.standard_normal((2, tai_s.size))
    right, up = right_deg * is_bad + noise_deg[0], up_deg * is_bad + noise_deg[1]
    readings = Readings(tai_s, (az_deg + right / np.cos(np.radians(el_deg))) % 360.0, el_deg + up)
    for after_s in seconds:
        now_tai_s = tai_s[0] + BAD_S + after_s
        refitter = gated(place, readings.part(tai_s < now_tai_s), place.settings)
        fit, _ = fitted(refitter, place, now_tai_s)
        ahead = now_tai_s + np.arange(0.0, 60.0, 5.0)
        az, el = np.radians(place.truth(ahead))
        truth = np.stack((np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)))
        off = np.linalg.norm(directions(place, fit, ahead) - truth, axis=0)
        yield f"{np.degrees(off.max()):.3f}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0] if __doc__ else None)
    parser.add_argument("--only", default="", metavar="WORD", help="the kinds with that word in their name")
    parser.add_argument("--runs", type=int, default=2, metavar="N", help="noises for each pass (default %(default)s)")
    parser.add_argument("--first-locks", action="store_true", help="first locks on a side lobe in place of bad minutes")
    parser.add_argument("--vacuum", action="store_true", help="without air")
    asked = parser.parse_args()
    has_air = not asked.vacuum
    for line in first_locks(has_air) if asked.first_locks else bad_minutes(asked.only, asked.runs, has_air):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    run_script(main)
