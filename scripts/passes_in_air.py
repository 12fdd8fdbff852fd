#!/usr/bin/env python3
"""What `full` predicts of the unseen half of the real passes in the simulator's air, whose weather is not what is told.

    .venv/bin/python scripts/passes_in_air.py              10 draws of noise and weather (a minute)
    .venv/bin/python scripts/passes_in_air.py --draws 3
    .venv/bin/python scripts/passes_in_air.py --first 10 --draws 50 --case "told air, scale a state"      600 others

Read at 1 Hz with 0.03 deg noise; the refractivity is drawn within +-10 % of what the weather told gives, the profile is
the simulator's (Hopfield's quartics), the station's weather the standard air.  Worst angle of each pass's unseen half,
in the encoder frame: median / worst over passes and draws.
"""

import argparse
from dataclasses import replace
from functools import partial

import numpy as np
from real_pass import pass_names
from tables.air import seen_in_air, with_scale
from tables.console import say
from tables.seed_001 import sky_angles_deg
from tables.skies import readings_of, real_elements, real_sky

from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge.campaign import results_of, run_campaign
from acu_daemon.model import AngleBias
from acu_daemon.sim.mount_axes import MountAxes

NOISE_DEG = 0.03
BOUND_DEG = 0.04
SQUARE, BIASED = MountAxes(), MountAxes(ia_deg=0.05, ie_deg=-0.04)
CROOKED = MountAxes(0.05, -0.04, 0.005, 0.004, -0.005, 0.004, 0.004)
ZENITH = {"max_fit_elevation_deg": 90.0}
REMEMBERED = {"bias_sigma_azimuth_deg": 0.007, "bias_sigma_elevation_deg": 0.0035}  # after some twenty passes
CASES: dict[str, tuple[bool, bool, MountAxes, dict[str, float]]] = {  # told of the air, scale a state, pedestal, more
    "vacuum": (False, False, SQUARE, {}),
    "told air, no scale": (True, False, SQUARE, {}),
    "told air, scale a state": (True, True, SQUARE, {}),
    "the same, encoders off": (True, True, BIASED, {}),
    "the same, crooked mount": (True, True, CROOKED, {}),
    "scale a state, read up to the zenith": (True, True, SQUARE, ZENITH),
    "scale a state, encoders known": (True, True, SQUARE, REMEMBERED),
}


def worst_deg(name: str, case: str, draws: range) -> list[float]:
    """The worst angles of the unseen half of a pass."""
    is_told, has_scale, mount, more = CASES[case]
    sky, source = real_sky(name), real_elements(name)
    found = []
    for seed in draws:
        apparent = seen_in_air(sky, seed)
        pairs = zip(apparent.az_deg.tolist(), apparent.el_deg.tolist(), strict=True)
        az_deg, el_deg = np.array([mount.encoders_deg(*one) for one in pairs]).T
        shown = replace(apparent, az_deg=az_deg % 360.0, el_deg=el_deg)
        readings = readings_of(shown, AngleBias(), NOISE_DEG, np.random.default_rng(seed))
        site = apparent.site if is_told else sky.site
        settings = replace(EstimatorSettings(NOISE_DEG, NOISE_DEG), **more)
        if has_scale:
            settings = with_scale(settings, site)
        used = sky.tai_s.size // 2
        estimator = FullEstimator(source, site, settings)
        estimator.add(readings.part(slice(used)))
        fit = estimator.fit()
        if fit is None:
            raise ValueError(f"{name}: no fit from {used} readings")
        seen = encoder_look(source.corrected(fit.correction), sky.tai_s[used:], site, fit)
        found.append(float(sky_angles_deg(seen.az_deg, seen.el_deg, shown.az_deg[used:], shown.el_deg[used:]).max()))
    return found


def _done(job: tuple[str, str, range]) -> list[float]:
    return worst_deg(*job)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="number of the first draw")
    parser.add_argument("--case", choices=CASES, help="this one alone")
    asked = parser.parse_args()
    draws = range(asked.first, asked.first + asked.draws)
    jobs = [(name, case, draws) for case in ([asked.case] if asked.case else CASES) for name in pass_names()]
    rows: dict[str, list[float]] = {}
    for (_, case, _), some in zip(jobs, results_of(run_campaign(partial(_done), jobs)), strict=True):
        rows.setdefault(case, []).extend(some)
    say("| the daemon's model, the pedestal | median, deg | 95 % | worst | beyond 0.04 |\n|---|---|---|---|---|")
    for case, worst in rows.items():
        beyond = sum(one > BOUND_DEG for one in worst)
        say(f"| {case} | {np.median(worst):.4f} | {np.quantile(worst, 0.95):.4f} | {max(worst):.4f} | {beyond} |")


if __name__ == "__main__":
    main()
