#!/usr/bin/env python3
"""The zenith in figures: the planned way past it against what no drive can beat, as docs/pass-plan.md has them.

Beside it the way over the top, for an elevation axis that reaches to 180 deg; a dash where the way round is better.

The bounds are those of tests/zenith_bound.py; tests/test_keyhole.py has them stored.  Half a minute.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import zenith_bound

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.keyhole import KeyholeRules, SkyPath, follow_path

DRIVE, HALF_BEAM_DEG = AxisLimits(-270.0, 270.0, 20.0, 10.0), 0.5
PASSES = {
    500: (88.0, 88.5, 89.0, 89.5, 89.8, 89.99),
    705: (88.5, 89.0, 89.3, 89.5, 89.8, 89.99),
    800: (89.0, 89.3, 89.5, 89.8, 89.99),
}


def main() -> None:
    print("| km, culmination | peak deg/s | largest error: plan / bound, ratio | then s lost |", end="")
    print(" seconds: plan / bound | over |")
    print("|---|---|---|---|---|---|")
    for height_km, tops_deg in PASSES.items():
        for top_deg in tops_deg:
            rows = zenith_bound.overhead_pass(height_km, top_deg, span_s=20.0)
            path = SkyPath(rows[1], rows[2], rows[3], rows[4], zenith_bound.STEP_S)
            _, one = follow_path(path, KeyholeRules(DRIVE, half_beam_deg=HALF_BEAM_DEG))
            _, other = follow_path(path, KeyholeRules(DRIVE, half_beam_deg=HALF_BEAM_DEG, objective="seconds"))
            turned_deg = np.where(rows[1][-1] > rows[1][0], -180.0, 180.0)
            rules = KeyholeRules(DRIVE, half_beam_deg=HALF_BEAM_DEG, may_plunge=True)
            _, over = follow_path(path, rules, plunged=(path.az_deg + turned_deg, 180.0 - path.el_deg))
            least_deg = zenith_bound.least_error_deg(rows, DRIVE.max_rate_deg_s, DRIVE.max_acceleration_deg_s2)
            drive = (DRIVE.max_rate_deg_s, DRIVE.max_acceleration_deg_s2)
            least_s = zenith_bound.least_lost_s(rows, *drive, HALF_BEAM_DEG)
            if one is None or other is None:
                continue
            errors = f"{one.largest_error_deg:.3f} / {least_deg:.3f}, {one.largest_error_deg / least_deg:.2f}"
            seconds = f"{one.lost_s:.1f} | {other.lost_s:.1f} / {least_s:.1f}"
            peak_deg_s = np.abs(rows[3]).max()
            beyond = "-"
            if over is not None and over.is_plunge:
                beyond = f"{over.largest_error_deg:.3f}, {over.lost_s:.1f} s"
            print(f"| {height_km} {top_deg:g} | {peak_deg_s:.0f} | {errors} | {seconds} | {beyond} |", flush=True)


if __name__ == "__main__":
    main()
