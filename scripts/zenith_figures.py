#!/usr/bin/env python3
"""The zenith in figures: the planned way past it against what no drive can beat, as docs/pass-plan.md has them.

    .venv/bin/python scripts/zenith_figures.py           the plan against the bound, half a minute
    .venv/bin/python scripts/zenith_figures.py --flown   the daemon against the simulated ACU, round and over the top

The bounds are those of tests/zenith_bound.py; tests/test_keyhole.py has them stored.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import zenith_bound
from overhead_flights import errors_deg, lost_s, over_the_zenith, overhead_target
from test_plunge import buffer_of, plunging

from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.model import AxisLimits, ZenithCrossing
from acu_daemon.pointing.keyhole import KeyholeRules, SkyPath, follow_path

DRIVE, HALF_BEAM_DEG = AxisLimits(-270.0, 270.0, 20.0, 10.0), 0.5
PASSES = {
    500: (88.0, 88.5, 89.0, 89.5, 89.8, 89.99),
    705: (88.5, 89.0, 89.3, 89.5, 89.8, 89.99),
    800: (89.0, 89.3, 89.5, 89.8, 89.99),
}


FLOWN = ((500, 88.5), (705, 89.0), (705, 89.5), (800, 89.3), (500, 90.0), (705, 90.0), (800, 90.0))
OVER = ((500, 89.2), (500, 89.55), (500, 89.7), (705, 89.6), (500, 89.88))
NEVER = {"zenith_takeover": "never"}


def against_bound() -> None:
    print("| km, culmination | peak deg/s | largest error: plan / bound, ratio | then s lost | seconds: plan / bound |")
    print("|---|---|---|---|---|")
    for height_km, tops_deg in PASSES.items():
        for top_deg in tops_deg:
            rows = zenith_bound.overhead_pass(height_km, top_deg, span_s=20.0)
            path = SkyPath(rows[1], rows[2], rows[3], rows[4], zenith_bound.STEP_S)
            _, one = follow_path(path, KeyholeRules(DRIVE, half_beam_deg=HALF_BEAM_DEG))
            _, other = follow_path(path, KeyholeRules(DRIVE, half_beam_deg=HALF_BEAM_DEG, objective="seconds"))
            least_deg = zenith_bound.least_error_deg(rows, DRIVE.max_rate_deg_s, DRIVE.max_acceleration_deg_s2)
            drive = (DRIVE.max_rate_deg_s, DRIVE.max_acceleration_deg_s2)
            least_s = zenith_bound.least_lost_s(rows, *drive, HALF_BEAM_DEG)
            if one is None or other is None:
                continue
            errors = f"{one.largest_error_deg:.3f} / {least_deg:.3f}, {one.largest_error_deg / least_deg:.2f}"
            seconds = f"{one.lost_s:.1f} | {other.lost_s:.1f} / {least_s:.1f}"
            peak_deg_s = np.abs(rows[3]).max()
            print(f"| {height_km} {top_deg:g} | {peak_deg_s:.0f} | {errors} | {seconds} |", flush=True)


def _planned(crossing: ZenithCrossing | None) -> str:
    return "-" if crossing is None else f"{crossing.largest_error_deg:.2f} / {crossing.lost_s:.1f}"


def _seen(flight: Flight) -> str:
    return f"{lost_s(flight):.1f} / {errors_deg(flight).max():.2f}"


def flown() -> None:
    print("| km, culmination | autotrack alone | with takeover |\n|---|---|---|")
    for height_km, top_deg in FLOWN:
        alone = over_the_zenith(overhead_target(height_km, top_deg, tracking=NEVER))
        led = over_the_zenith(overhead_target(height_km, top_deg))
        print(f"| {height_km} {top_deg:g} | {_seen(alone)} | {_seen(led)} |", flush=True)
    print("\n| km, culmination | round, deg / s lost | over the top, plan | flown |\n|---|---|---|---|")
    for height_km, top_deg in OVER:
        target = plunging(height_km, top_deg)
        ways = [_planned(buffer_of(one).crossing) for one in (overhead_target(height_km, top_deg), target)]
        flight = over_the_zenith(target)
        seen = f"{errors_deg(flight).max():.2f} / {lost_s(flight):.1f}"
        print(f"| {height_km} {top_deg:g} | {ways[0]} | {ways[1]} | {seen} |", flush=True)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--flown", action="store_true")
    flown() if options.parse_args().flown else against_bound()


if __name__ == "__main__":
    main()
