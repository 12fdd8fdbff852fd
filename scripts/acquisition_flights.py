#!/usr/bin/env python3
"""How long the daemon takes to find a satellite whose elements are wrong: flights over the horizon, in virtual time.

    .venv/bin/python scripts/acquisition_flights.py                100 flights, a quarter of an hour on two cores
    .venv/bin/python scripts/acquisition_flights.py --flights 10

Circular orbits of 500 to 850 km over the demo's station, culminations as they come from 10 deg up; the satellite is
10 s early or late and its node 0.2 deg off to either side, told as worth 40 km; beams of 0.5 and 1 deg in turn.  From
the true rise until the ACU autotracks; what was seen before the rise counts as 0 s.
"""

import argparse
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import joblib
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from flights import flight_of, sky_of
from overhead_flights import EARTH_KM, TOP_TAI_S
from test_early_search import unsure_target

from acu_daemon.cli.options import Target, coming_pass
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.timescales import gmst_rad
from acu_daemon.sim.scenario import AcuChoice, SkyErrors

LATE_S, RAAN_DEG, WORTH_KM, FOUND_S = 10.0, 0.2, 40.0, 60.0
BEFORE_S, AFTER_S, LEAST_TOP_DEG = 45.0, 100.0, 10.0


@dataclass(frozen=True, slots=True)
class Found:
    """One flight; found_s: infinite where it was not acquired."""

    beam_deg: float
    height_km: float
    culmination_deg: float
    late_s: float
    raan_deg: float
    searched: bool
    found_s: float


def _passing(beam_deg: float, height_km: float, aside_rad: float) -> Target:
    target = unsure_target(beam_deg, WORTH_KM)
    place = target.station.site.station
    i, latitude = np.radians(97.5), np.radians(place.latitude_deg)
    u = np.arcsin(np.sin(latitude) / np.sin(i))
    node = float(gmst_rad(np.array([TOP_TAI_S]), 0.0)[0]) + np.radians(place.longitude_deg)
    raan = node - np.arctan2(np.sin(u) * np.cos(i), np.cos(u)) + aside_rad
    elements = BrouwerElements("MADE", TOP_TAI_S, (EARTH_KM + height_km) * 1e3, 1e-4, i, raan, 0.0, u)
    made = replace(target.elements, propagator=BrouwerPropagator(elements, short_period=False), epoch_tai_s=TOP_TAI_S)
    return replace(target, elements=made)


def flown(k: int) -> Found:
    """Flight number k, always the same."""
    random = np.random.default_rng([26, k])
    beam_deg = (0.5, 1.0)[k % 2]
    while True:
        height_km = float(random.uniform(500.0, 850.0))
        target = _passing(beam_deg, height_km, float(random.uniform(-0.25, 0.25)))
        coming = coming_pass(target, TOP_TAI_S - 900.0)
        is_near = coming is not None and abs(coming.culmination_tai_s - TOP_TAI_S) < 600.0
        if coming is not None and is_near and coming.culmination_el_deg > LEAST_TOP_DEG:
            break
    late_s, raan_deg = LATE_S * float(random.choice([-1, 1])), RAAN_DEG * float(random.choice([-1, 1]))
    errors = SkyErrors(along_track_s=late_s, delta_raan_deg=raan_deg)
    sky, lowest_deg = sky_of(target, errors), target.station.station.min_elevation_deg
    times = coming.rise_tai_s + np.arange(-40.0, 60.0, 0.1)
    risen = next(t for t in times.tolist() if (seen := sky.direction(t)) is not None and seen[1] >= lowest_deg)
    antenna = AcuChoice(azimuth_deg=coming.rise_az_deg, elevation_deg=lowest_deg)
    begin = min(risen, coming.rise_tai_s) - BEFORE_S
    flight = flight_of(target, begin, BEFORE_S + AFTER_S, antenna=antenna, errors=errors)
    locked = [seen.tai_s - risen for seen in flight.snapshots if seen.state.startswith("AUTOTRACK")]
    found_s = max(min(locked), 0.0) if locked else float("inf")
    place = (beam_deg, height_km, coming.culmination_el_deg)
    return Found(*place, late_s, raan_deg, "SEARCH" in flight.states(), found_s)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--flights", type=int, default=100)
    options.add_argument("--jobs", type=int, default=2)
    asked = options.parse_args()
    parallel = joblib.Parallel(n_jobs=asked.jobs, return_as="generator", batch_size=1)
    found: list[Found] = []
    for one in parallel(joblib.delayed(flown)(k) for k in range(asked.flights)):
        found.append(one)
        where = f"{one.height_km:.0f} km, {one.culmination_deg:.0f} deg, {one.late_s:+.0f} s, {one.raan_deg:+.1f} deg"
        how = "searched" if one.searched else "not searched"
        print(f"beam {one.beam_deg:g} deg, {where}: {one.found_s:.1f} s, {how}", flush=True)
    print(f"\n| beam, deg | flights | within {FOUND_S:.0f} s | median, s | 95 %, s | longest, s |")
    print("|---|---|---|---|---|---|")
    for beam_deg in (0.5, 1.0):
        all_s = np.sort([one.found_s for one in found if one.beam_deg == beam_deg])
        if all_s.size == 0:
            continue
        within = int((all_s <= FOUND_S).sum())
        high = float(all_s[min(int(np.ceil(0.95 * all_s.size)) - 1, all_s.size - 1)])
        print(
            f"| {beam_deg:g} | {all_s.size} | {within} | {float(np.median(all_s)):.1f} | {high:.1f} | {all_s[-1]:.1f} |"
        )


if __name__ == "__main__":
    main()
