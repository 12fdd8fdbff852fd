#!/usr/bin/env python3
"""Value of the exact schedule beside two greedy ones, over random days of real satellites, and its time.

scripts/schedule_figures.py FILE [--days 100] [--satellites 20] [--hours 24] [--seed 0]     FILE: element sets, TLE
"""

import argparse
import gzip
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from acu_daemon.model import AxisLimits, Site, Station
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.schedule.exact_plan import Slot, best_slots, slots_of
from acu_daemon.schedule.pass_track import PassTrack, track_of
from acu_daemon.schedule.rules import SatelliteRules, StationRules
from acu_daemon.units import DAY_S

LOWEST_DEG, LOW_ORBIT_REV_DAY = 5.0, 11.0
BOUNDS = Envelope(AxisLimits(-270.0, 270.0, 6.0, 3.0), AxisLimits(0.0, 90.0, 3.0, 2.0))
RULES = StationRules(BOUNDS.azimuth, BOUNDS.elevation)


def main() -> None:
    arguments = _arguments()
    opened = gzip.open if arguments.file.suffix == ".gz" else open
    with opened(arguments.file, "rt") as file:
        sets, _ = parse_tle(file.read(), str(arguments.file))
    low = [one for one in sets if one.mean_motion_rad_s * DAY_S / (2.0 * np.pi) > LOW_ORBIT_REV_DAY]
    random = np.random.default_rng(arguments.seed)
    gains: dict[str, list[float]] = {"by priority": [], "by culmination": []}
    seconds = []
    for day in range(arguments.days):
        tracks = _random_day(low, random, arguments)
        begin_s = time.process_time()
        plan = best_slots(tracks, RULES)
        seconds.append(time.process_time() - begin_s)
        value = sum(slot.value for slot in plan)
        orders: dict[str, Callable[[PassTrack], float]] = {
            "by priority": lambda one: 1e3 * one.rules.priority + one.coming.culmination_el_deg,
            "by culmination": lambda one: one.coming.culmination_el_deg,
        }
        for name, order in orders.items():
            other = sum(slot.value for slot in greedy(sorted(tracks, key=order, reverse=True)))
            assert value >= other - 1e-6, f"day {day}: {value} below greedy {name}: {other}"
            gains[name].append(value / other - 1.0 if other else 0.0)
    print(f"{arguments.days} days of {arguments.hours:g} h, {arguments.satellites} satellites: never below")
    for name, found in gains.items():
        print(f"gain over greedy {name}: median {np.median(found):.1%}, largest {max(found):.1%}")
    print(f"planning: median {np.median(seconds):.2f} s, largest {max(seconds):.2f} s")


def greedy(tracks: Iterable[PassTrack]) -> list[Slot]:
    """Whole passes, the first of the order first, each where it still fits."""
    taken: list[Slot] = []
    for track in tracks:
        whole = replace(track, rules=replace(track.rules, may_be_cut=False))
        for slot in slots_of(whole, (), RULES):
            if all(_is_apart(slot, other) for other in taken):
                taken.append(slot)
                break
    return taken


def _is_apart(one: Slot, other: Slot) -> bool:
    first, second = (one, other) if one.start_tai_s < other.start_tai_s else (other, one)
    slew_s = RULES.slew_s(second.start_deg[0] - first.end_deg[0], second.start_deg[1] - first.end_deg[1])
    return first.end_tai_s + RULES.post_s + slew_s + RULES.pre_s <= second.start_tai_s


def _random_day(sets: list[ElementSet], random: np.random.Generator, arguments: argparse.Namespace) -> list[PassTrack]:
    site = Site(Station("", float(random.uniform(-60, 70)), float(random.uniform(-180, 180)), 100.0))
    start_tai_s = max(one.epoch_tai_s for one in sets) + float(random.uniform(0.0, 5.0)) * DAY_S
    tracks: list[PassTrack] = []
    for at in random.choice(len(sets), arguments.satellites, replace=False).tolist():
        propagator, rules = (
            Sgp4Propagator(sets[at]),
            SatelliteRules(int(random.integers(1, 10)), may_be_cut=bool(random.integers(2))),
        )
        passes = find_passes(propagator, site, start_tai_s, start_tai_s + 3600.0 * arguments.hours, LOWEST_DEG)
        tracks += [track_of(str(sets[at].norad_id), propagator, site, one, rules, BOUNDS) for one in passes]
    return tracks


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--days", type=int, default=100)
    parser.add_argument("--satellites", type=int, default=20)
    parser.add_argument("--hours", type=float, default=24.0)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


if __name__ == "__main__":
    main()
