#!/usr/bin/env python3
"""What `full` predicts of the unseen half of the real passes in the simulator's air, whose weather is not what is told.

    .venv/bin/python scripts/passes_in_air.py              10 draws of noise and weather (a minute)
    .venv/bin/python scripts/passes_in_air.py --draws 3
    .venv/bin/python scripts/passes_in_air.py --flown      by the daemon in virtual time, lost at 60 % (5 minutes)

Read at 1 Hz with 0.03 deg noise; the refractivity is drawn within +-10 % of what the weather told gives, the profile is
the simulator's (Hopfield's quartics), the station's weather the standard air.  Worst angle of each pass's unseen half,
in the encoder frame: median / worst over passes and draws.
"""

import argparse
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from figures import CASES as FLIGHTS
from figures import measure
from real_pass import pass_names, truth_path, truth_span, write_config
from tables.console import say
from tables.seed_001 import sky_angles_deg
from tables.skies import readings_of, real_elements, real_sky

from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.cli.options import load_target
from acu_daemon.cli.virtual_pass import fly
from acu_daemon.config.antenna_tables import AtmosphereSection
from acu_daemon.edge.campaign import results_of, run_campaign
from acu_daemon.model import AngleBias
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.air import standard_air
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.sim.apparent_sky import make_air
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.sim.scenario import AcuChoice, AirChoice, Encoder, Loss, Scenario
from acu_daemon.sim.sky import read_truth

NOISE_DEG = 0.03
SQUARE, BIASED = MountAxes(), MountAxes(ia_deg=0.05, ie_deg=-0.04)
CROOKED = MountAxes(0.05, -0.04, 0.005, 0.004, -0.005, 0.004, 0.004)
IN_AIR = AtmosphereSection(refraction=True)
CASES = {  # the daemon's [atmosphere], whether the scale is a state, the pedestal
    "vacuum": (AtmosphereSection(refraction=False), False, SQUARE),
    "told air, no scale": (IN_AIR, False, SQUARE),
    "told air, scale 0.1": (IN_AIR, True, SQUARE),
    "told air, scale 0.1, encoders off": (IN_AIR, True, BIASED),
    "told air, scale 0.1, crooked mount": (IN_AIR, True, CROOKED),
}


def worst_deg(name: str, case: str, draws: int) -> list[float]:
    """The worst angles of the unseen half of a pass."""
    atmosphere, has_scale, mount = CASES[case]
    sky, source = real_sky(name), real_elements(name)
    station = sky.site.station
    truth = read_truth(truth_path(name))
    range_m = np.array([(truth.direction(float(t)) or (0.0, 0.0, 1e6))[2] for t in sky.tai_s])
    refraction = atmosphere.traced(station)
    site = replace(sky.site, antenna=None if refraction is None else AntennaModel(refraction=refraction))
    settings = EstimatorSettings(NOISE_DEG, NOISE_DEG)
    if has_scale:
        settings = replace(settings, bias_sigma_elevation_cot_deg=atmosphere.cot_sigma_deg(station))
    found = []
    for seed in range(draws):
        air = make_air(standard_air(station), AirChoice(refractivity_drawn_within=0.1), station.height_m, seed)
        el_deg = [air.apparent_el_deg(el, far) for el, far in zip(sky.el_deg.tolist(), range_m.tolist(), strict=True)]
        encoders = np.array([mount.encoders_deg(*one) for one in zip(sky.az_deg.tolist(), el_deg, strict=True)]).T
        shown = replace(sky, az_deg=encoders[0] % 360.0, el_deg=encoders[1])
        readings = readings_of(shown, AngleBias(), NOISE_DEG, np.random.default_rng(seed))
        used = sky.tai_s.size // 2
        estimator = FullEstimator(source, site, settings)
        estimator.add(readings.part(slice(used)))
        fit = estimator.fit()
        if fit is None:
            raise ValueError(f"{name}: no fit from {used} readings")
        seen = encoder_look(source.corrected(fit.correction), sky.tai_s[used:], site, fit)
        found.append(float(sky_angles_deg(seen.az_deg, seen.el_deg, shown.az_deg[used:], shown.el_deg[used:]).max()))
    return found


def _done(job: tuple[str, str, int]) -> list[float]:
    return worst_deg(*job)


def flown(job: tuple[str, str, bool]) -> tuple[float, float, list[str]]:
    """Worst beam error of a real pass during the loss, where the drive can follow; its registers'; what was noted."""
    name, case, is_told = job
    begin_share, end_share, bias = FLIGHTS[case]
    first, last = (tai_from_utc(utc) for utc in truth_span(name))
    loss = first + begin_share * (last - first), first + end_share * (last - first)
    with tempfile.TemporaryDirectory() as directory:
        satellite = write_config(Path(directory), name)
        target = load_target(Path(directory), satellite, first)
    told = AtmosphereSection(refraction=True)
    station = target.station.model_copy(update={"atmosphere": told if is_told else AtmosphereSection()})
    scenario = Scenario(
        encoder=Encoder(0.05 * bias, -0.04 * bias, NOISE_DEG),
        acu=AcuChoice(azimuth_deg=0.0, elevation_deg=45.0),
        losses=(Loss(cause="receiver", from_utc=loss[0], to_utc=loss[1]),),
        air=AirChoice(refractivity_drawn_within=0.1),
    )
    seed = sum(name.encode())
    flight = fly(
        replace(target, station=station),
        truth_path(name),
        scenario,
        begin_tai_s=first - 60.0,
        end_tai_s=last,
        seed=seed,
    )
    row = measure(name, case, flight, read_truth(truth_path(name)), (loss[0], min(loss[1], last)), 0.0)
    notes = [str(event["note"]) for event in flight.events if event["event"] == "fit.note"]
    return row.worst_deg, row.worst_anywhere_deg, notes


def flown_table() -> None:
    """Fly every real pass with the air told and untold."""
    jobs = [(name, case, is_told) for case in FLIGHTS for is_told in (True, False) for name in pass_names()]
    say("| case | the daemon's air | median, deg | worst | passes with a note |\n|---|---|---|---|---|")
    found = dict(zip(jobs, results_of(run_campaign(flown, jobs)), strict=True))
    for case in FLIGHTS:
        for is_told in (True, False):
            some = [found[name, case, is_told] for name in pass_names()]
            worst, noted = [one[0] for one in some], [one[2] for one in some if one[2]]
            air = "told" if is_told else "none"
            say(f"| {case} | {air} | {np.median(worst):.3f} | {max(worst):.3f} | {len(noted)} |")
            for notes in noted:
                say(f"  {notes}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--flown", action="store_true", help="let the daemon fly them, with losses")
    asked = parser.parse_args()
    if asked.flown:
        flown_table()
        return
    draws = asked.draws
    jobs = [(name, case, draws) for case in CASES for name in pass_names()]
    rows: dict[str, list[float]] = {}
    for (_, case, _), some in zip(jobs, results_of(run_campaign(partial(_done), jobs)), strict=True):
        rows.setdefault(case, []).extend(some)
    say("| the daemon's model, the pedestal | median, deg | 95 % | worst |\n|---|---|---|---|")
    for case, worst in rows.items():
        say(f"| {case} | {np.median(worst):.4f} | {np.quantile(worst, 0.95):.4f} | {max(worst):.4f} |")


if __name__ == "__main__":
    main()
