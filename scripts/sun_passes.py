#!/usr/bin/env python3
"""Flies passes near the sun with sun_policy = "avoid" in virtual time, and says how near to it the beam comes.

What it does
  Looks for passes of the demo's satellite that come within 12 deg of the sun, takes 1 to 3 deg more than that as the
  keep-out, and flies each from 15 s before it to 15 s after it, the daemon against the simulated ACU.

Prints a Markdown table.  Exit status: 0 no beam was inside, 1 one was.

Examples
  scripts/sun_passes.py            14 passes, a minute or two
  scripts/sun_passes.py --count 3
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from flights import DEMO_TAI_S, demo_target, events_named, flight_of

from acu_daemon.model import Pass
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.keep_out import Sun
from acu_daemon.pointing.outage import sun_outages
from acu_daemon.sim.scenario import AcuChoice
from acu_daemon.units import DAY_S

NEAR_DEG, LEAST_DEG = 12.0, 1.0
MORE_DEG = (3.0, 1.0, 1.0)  # than the least angle, in turn
BESIDE_S = 15.0
SEARCH_DAYS = 60.0
NOISE_DEG = 0.03


def fly(coming: Pass, radius_deg: float) -> tuple[str, float]:
    """One line of the table, and the least clearance of the beam."""
    target = demo_target(envelope={"sun_policy": "avoid", "sun_keep_out_deg": radius_deg})
    propagator, site, sun = target.elements.propagator, target.station.site, target.station.bounds.sun
    assert sun is not None
    outage = sun_outages(propagator, site, sun, coming)[0]
    begin_tai_s = max(outage.from_tai_s - BESIDE_S, coming.rise_tai_s)
    end_tai_s = min(outage.to_tai_s + BESIDE_S, coming.set_tai_s)
    look = apparent_at(propagator, np.array([begin_tai_s]), site)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    flight = flight_of(target, begin_tai_s, end_tai_s - begin_tai_s, antenna=antenna, noise_deg=NOISE_DEG)
    clear_deg = min(
        sun.angle_deg(row.boresight_az_deg, row.boresight_el_deg, row.tai_s) - radius_deg for row in flight.rows
    )
    cells = (
        utc_text(coming.rise_tai_s, 0),
        f"{outage.least_deg:.1f}",
        f"{radius_deg:.1f}",
        f"{outage.duration_s:.0f}",
        f"{clear_deg:.2f}",
        flight.states()[-1],
        str(len(events_named(flight, "fence.refused"))),
    )
    return f"| {' | '.join(cells)} |", clear_deg


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=14, help="passes; default: 14")
    count = parser.parse_args().count
    target = demo_target()
    propagator, site = target.elements.propagator, target.station.site
    begin_tai_s = DEMO_TAI_S - 20.0 * DAY_S
    passes = find_passes(propagator, site, begin_tai_s, begin_tai_s + SEARCH_DAYS * DAY_S, 5.0)
    near = [(one, found) for one in passes for found in sun_outages(propagator, site, Sun(site, NEAR_DEG), one)]
    print("| rise | least angle, deg | keep-out, deg | outage, s | beam outside by, deg | at the end | refused |")
    print("|---|---|---|---|---|---|---|")
    least_deg = 90.0
    for number, (coming, found) in enumerate(near[:count]):
        radius_deg = max(LEAST_DEG, found.least_deg + MORE_DEG[number % len(MORE_DEG)])
        line, clear_deg = fly(coming, radius_deg)
        least_deg = min(least_deg, clear_deg)
        print(line, flush=True)
    print(f"\n{len(near[:count])} passes: the beam was outside by {least_deg:.2f} deg at least")
    return 0 if least_deg >= 0.0 else 1


if __name__ == "__main__":
    sys.exit(main())
