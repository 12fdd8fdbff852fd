#!/usr/bin/env python3
"""Plans real passes by the thousands, and counts: does a plan meet a stop that another turn would not?

    .venv/bin/python scripts/planned_passes.py                     10 000 passes, some minutes on two cores
    .venv/bin/python scripts/planned_passes.py --passes 300

The low satellites of a public list over 20 stations, with ranges of +-270, 0 to 360 and 0 to 450 deg in turn; the
antenna stands where the pass before it has ended.  The check looks at the path alone: whether some multiple of 360 deg
holds it.
"""

import argparse
import gzip
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import joblib
import numpy as np

from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.model import AxisLimits, Site, Station
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.pointing.keyhole import KeyholeRules

LIST = Path(__file__).resolve().parents[2] / "shared" / "data" / "tle_sets" / "celestrak_active_2026-08-18.3le.gz"
RANGES = {"+-270": (-270.0, 270.0), "0 to 360": (0.0, 360.0), "0 to 450": (0.0, 450.0)}
LATITUDES_DEG = (-77.8, -53.2, -45.0, -33.4, -25.9, -15.5, -5.9, 0.0, 5.2, 13.1)
LATITUDES_DEG += (19.0, 28.2, 35.0, 40.4, 45.5, 51.5, 57.0, 64.9, 69.7, 78.2)
LEAST_EL_DEG, DAY_S, LOW_M = 5.0, 86400.0, 8400e3


@dataclass(frozen=True, slots=True)
class Seen:
    """What one plan is like."""

    limits: str
    culmination_deg: float
    meets_stop: bool
    has_turn: bool  # some turn holds the path
    other_way: bool
    is_longer: bool  # another turn that holds the path is nearer to where the antenna stood
    ms: float


def seen_of(elements: ElementSet, station: int, count: int, seed: int) -> list[Seen]:
    """Plan passes of one satellite over one station."""
    source = Sgp4Propagator(elements)
    site = Site(Station(f"S{station}", LATITUDES_DEG[station], 137.5 * station % 360.0, 100.0))
    begin = elements.epoch_tai_s
    passes = find_passes(source, site, begin, begin + 2.0 * DAY_S, LEAST_EL_DEG)[:count]
    random = np.random.default_rng(seed)
    found, present = [], {name: random.uniform(*RANGES[name]) for name in RANGES}
    for k, coming in enumerate(passes):
        name = tuple(RANGES)[(k + seed) % len(RANGES)]
        limits = AxisLimits(*RANGES[name], 20.0, 10.0)
        started_s = time.process_time()
        plan = plan_pass(
            *(source, site, coming, present[name], limits, coming.rise_tai_s - 600.0), keyhole=KeyholeRules(limits)
        )
        ms = 1e3 * (time.process_time() - started_s)
        tai_s = np.arange(coming.rise_tai_s, coming.set_tai_s, 0.5)
        path = np.degrees(np.unwrap(np.radians(look_at(source, tai_s, site).az_deg)))
        turns = path[0] + 360.0 * np.arange(-4, 5)
        rest = path - path[0]
        holds = (turns + rest.min() >= limits.min_deg) & (turns + rest.max() <= limits.max_deg)
        ways = np.abs(turns[holds] - present[name])
        way_deg = abs(plan.start_az_deg - present[name])
        is_longer = bool(holds.any()) and way_deg > ways.min() + 1.0 and coming.culmination_el_deg < 85.0
        other = plan.zenith_turn != 0
        found.append(
            Seen(name, coming.culmination_el_deg, bool(plan.unwindings), bool(holds.any()), other, is_longer, ms)
        )
        present[name] = float(np.clip(plan.start_az_deg + rest[-1], limits.min_deg, limits.max_deg))
    return found


def tasks(total: int, each: int) -> Iterator[tuple[ElementSet, int, int, int]]:
    """Satellites of the list and stations, drawn with a fixed seed."""
    sets, _ = parse_tle(gzip.decompress(LIST.read_bytes()).decode(), LIST.name)
    low = [one for one in sets if one.semi_major_axis_m < LOW_M]
    random = np.random.default_rng(26)
    for seed in range(3 * total // (2 * each)):
        yield low[int(random.integers(len(low)))], seed % len(LATITUDES_DEG), each, seed


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--passes", type=int, default=10000)
    options.add_argument("--jobs", type=int, default=2)
    asked = options.parse_args()
    started_s, found = time.perf_counter(), []
    parallel = joblib.Parallel(n_jobs=asked.jobs, return_as="generator", batch_size=8)
    for more in parallel(joblib.delayed(seen_of)(*one) for one in tasks(asked.passes, 6)):
        found += more
        if len(found) // 500 > (len(found) - len(more)) // 500:
            print(f"{len(found)} of {asked.passes}", flush=True)
        if len(found) >= asked.passes:
            break
    found = found[: asked.passes]
    plan_ms = np.median([one.ms for one in found])
    print(f"\n{time.perf_counter() - started_s:.0f} s; a plan takes {plan_ms:.0f} ms in the median")
    print("| range, deg | passes | meet a stop | though a turn holds it | other way round | way longer than needed |")
    print("|---|---|---|---|---|---|")
    for name in RANGES:
        these = [one for one in found if one.limits == name]
        kinds = Counter(
            (one.meets_stop, one.meets_stop and one.has_turn, one.other_way, one.is_longer) for one in these
        )
        sums = [sum(count for kind, count in kinds.items() if kind[k]) for k in range(4)]
        print(f"| {name} | {len(these)} | {sums[0]} | {sums[1]} | {sums[2]} | {sums[3]} |")


if __name__ == "__main__":
    main()
