#!/usr/bin/env python3
"""What `full` predicts of the unseen part of a pass, and whether its ellipses are honest.

    .venv/bin/python scripts/half_passes.py                every table (2 to 3 minutes on two cores)
    .venv/bin/python scripts/half_passes.py --draws 3      fewer draws of the noise, sooner
    .venv/bin/python scripts/half_passes.py --vacuum       without air
    .venv/bin/python scripts/half_passes.py --json FILE    the figures as JSON too
    .venv/bin/python scripts/half_passes.py --plot FILE    the worst error of every real pass as a picture (PNG)

Read at 1 Hz with 0.03 deg noise (across the elevation, and in elevation), default a-priori sigmas; angles on the sky in
the encoder frame: the real passes of ../shared/data, and passes of listed low orbits, in the simulator's air whose
refractivity is drawn within +-10 % of what is told.  The papers' simulation, which has no air, is run for the ellipses
alone; it needs brahe (pip install 'acu-daemon[accuracy]') and is left out without it.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.util import find_spec

import numpy as np
from real_pass import pass_names
from tables.air import seen_in_air, with_scale
from tables.charts_half_passes import plot_passes
from tables.console import progress, say
from tables.errors_put_in import azimuth_model_deg, corrupted_state, draw_errors, elevation_model_deg, readings_with
from tables.listed_passes import Wrong, accurate, as_assumed, dragged, late, listed_passes
from tables.methods import METHODS
from tables.outputs import output_file, output_picture
from tables.seed_figures import PASSES, SeedPass
from tables.skies import Sky, readings_of, real_elements, real_sky
from tables.trials import ASKED_WORST_DEG, Trial, tried
from tables.true_pass import TruePass, true_passes
from tables.workers import run_script

from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge.campaign import results_of, run_campaign
from acu_daemon.model import AngleBias, Readings
from acu_daemon.orbit.propagator import Propagator

NOISE_DEG = 0.03
SETTINGS = EstimatorSettings(NOISE_DEG, NOISE_DEG)
NONE, BIASED = AngleBias(), AngleBias(az_deg=0.05, el_deg=-0.04)
LOCK_S = 60
CHUNK = 12  # listed passes that a process does at once
SEED = 1990
HALF, HALF_BIASED = "real, half", "real, half, bias"
LISTED: dict[str, Wrong] = {
    "listed, accurate elements": accurate,
    "listed, up to 10 s off": late,
    "listed, drag up to 90 km": dragged,
    "listed, as the a-priori sigmas say": as_assumed,
}
STATIONS = {  # of the papers' simulation: whether the estimator has the exact coordinates, and what it thinks of them
    "papers, exact station": (True, 0.0),
    "papers, rounded station, uncertainty_m": (False, 6e3),
    "papers, rounded station taken as exact": (False, 0.0),
}
Work = Callable[[], list[Trial]]


@dataclass(frozen=True, slots=True)
class Lot:
    """Trials that belong together; angles in degrees."""

    label: str
    count: int
    median_deg: float
    p95_deg: float
    worst_deg: float
    bound_deg: float
    beyond_count: int  # worse than asked, ...
    beyond_expected: float  # ... and as the bound has it
    one_sigma: float
    two_sigma: float


def lot_of(label: str, trials: list[Trial]) -> Lot:
    """Summarise trials."""
    worst_deg = np.array([one.worst_deg for one in trials])
    return Lot(
        label=label,
        count=len(trials),
        median_deg=float(np.median(worst_deg)),
        p95_deg=float(np.quantile(worst_deg, 0.95)),
        worst_deg=float(worst_deg.max()),
        bound_deg=float(np.median([one.bound_deg for one in trials])),
        beyond_count=int(np.count_nonzero(worst_deg > ASKED_WORST_DEG)),
        beyond_expected=float(np.sum([one.bound_share for one in trials])),
        one_sigma=float(np.mean([one.one_sigma for one in trials])),
        two_sigma=float(np.mean([one.two_sigma for one in trials])),
    )


def shown_of(sky: Sky, bias: AngleBias) -> Readings:
    """What encoders with this bias and without noise show."""
    return Readings(sky.tai_s, sky.az_deg + bias.az_deg, sky.el_deg + bias.el_deg)


def one_trial(source: Propagator, sky: Sky, bias: AngleBias, used: int, rng: np.random.Generator) -> Trial:
    """Read a sky with noise, fit, judge."""
    readings = readings_of(sky, bias, NOISE_DEG, rng)
    settings = with_scale(SETTINGS, sky.site)
    return tried(sky.name, source, sky.site, settings, shown_of(sky, bias), readings, used)


def real_trials(
    name: str, bias: AngleBias, lock_s: int | None, wrong_deg: float, draws: int, has_air: bool = True
) -> list[Trial]:
    """A real pass with other noise and air each time, its first half read, or the first so many seconds."""
    sky, source = real_sky(name), real_elements(name, wrong_deg)
    used = lock_s or sky.tai_s.size // 2
    skies = [seen_in_air(sky, seed) if has_air else sky for seed in range(draws)]
    return [one_trial(source, sky, bias, used, np.random.default_rng(seed)) for seed, sky in enumerate(skies)]


def listed_trials(wrong: Wrong, seed: np.random.SeedSequence, has_air: bool = True) -> list[Trial]:
    """Some listed passes, each with a bias drawn from its a-priori sigma where the orbit's error is too."""
    rng = np.random.default_rng(seed)
    trials = []
    for source, sky in listed_passes(wrong, CHUNK, rng):
        az, el = (rng.standard_normal(2) * SETTINGS.bias_sigma_azimuth_deg).tolist()
        bias = AngleBias(az_deg=az, el_deg=el) if wrong is as_assumed else BIASED
        shown = seen_in_air(sky, int(rng.integers(2**31))) if has_air else sky
        trials.append(one_trial(source, shown, bias, sky.tai_s.size // 2, rng))
    return trials


def papers_trials(true_pass: TruePass, is_exact: bool, station_sigma_m: float, draws: int) -> list[Trial]:
    """The papers' simulation of one pass, every row of it."""
    site = true_pass.exact_site if is_exact else true_pass.rounded_site
    settings = replace(METHODS["full"].settings, station_sigma_m=station_sigma_m)
    az_deg = true_pass.az_deg + azimuth_model_deg(true_pass.el_deg, true_pass.range_km)
    shown = Readings(true_pass.tai_s, az_deg, true_pass.el_deg + elevation_model_deg(true_pass.el_deg))
    trials = []
    for run in np.random.SeedSequence(SEED).spawn(draws):
        errors = draw_errors(np.random.default_rng(run), true_pass.tai_s.size)
        source = METHODS["full"].source(corrupted_state(errors, true_pass), float(true_pass.tai_s[0]))
        readings = readings_with(errors, true_pass)
        trials += [
            tried(true_pass.seed.label, source, site, settings, shown, readings, row.used_s)
            for row in true_pass.seed.rows
        ]
    return trials


def true_pass_of(one: SeedPass) -> TruePass:
    """Integrate and find one pass of the papers."""
    return true_passes([one])[0]


def real_jobs(draws: int, has_air: bool) -> list[tuple[str, Work]]:
    """What is done with every real pass."""
    jobs: list[tuple[str, Work]] = []
    for name in pass_names():
        jobs.append((HALF, partial(real_trials, name, NONE, None, 0.0, draws, has_air)))
        jobs.append((HALF_BIASED, partial(real_trials, name, BIASED, None, 0.0, draws, has_air)))
        jobs.append((f"real, {LOCK_S} s", partial(real_trials, name, NONE, LOCK_S, 0.0, draws, has_air)))
        jobs.append((f"real, {LOCK_S} s, bias", partial(real_trials, name, BIASED, LOCK_S, 0.0, draws, has_air)))
        for wrong_deg in (-1.0, 1.0):
            for label, lock_s in (("half", None), (f"{LOCK_S} s", LOCK_S)):
                work = partial(real_trials, name, BIASED, lock_s, wrong_deg, draws, has_air)
                jobs.append((f"real, {label}, bias, M 1 deg off", work))
    return jobs


def all_trials(draws: int, listed_count: int, has_air: bool) -> dict[str, list[Trial]]:
    """Do everything, on all cores; the same figures however many there are."""
    jobs = real_jobs(draws, has_air)
    for (label, wrong), seed in zip(LISTED.items(), np.random.SeedSequence(SEED).spawn(len(LISTED)), strict=True):
        jobs += [(label, partial(listed_trials, wrong, one, has_air)) for one in seed.spawn(listed_count // CHUNK)]
    if listed_count and find_spec("brahe") is None:
        say("the papers' simulation is left out: it needs brahe, pip install -c constraints.txt '.[accuracy]'")
    elif listed_count:
        for true_pass in results_of(run_campaign(true_pass_of, PASSES)):
            jobs += [(label, partial(papers_trials, true_pass, *station, draws)) for label, station in STATIONS.items()]
    trials = results_of(run_campaign(_done, jobs, name_of=lambda job: job[0], on_done=progress))
    found: dict[str, list[Trial]] = {}
    for (label, _), some in zip(jobs, trials, strict=True):
        found.setdefault(label, []).extend(some)
    return found


def _done(job: tuple[str, Callable[[], list[Trial]]]) -> list[Trial]:
    return job[1]()


def passes_text(found: dict[str, list[Trial]]) -> str:
    """Every real pass: medians and worst over the draws."""
    lines = [f"| first half read, worst angle in the other, deg | {HALF}: median / worst | {HALF_BIASED} | bound |"]
    lines.append("|---|---|---|---|")
    for name in pass_names():
        none, biased = ([one for one in found[label] if one.name == name] for label in (HALF, HALF_BIASED))
        cells = [
            f"{np.median(w):.4f} / {max(w):.4f}" for w in ([one.worst_deg for one in few] for few in (none, biased))
        ]
        lines.append(f"| {name} | {' | '.join(cells)} | {np.median([one.bound_deg for one in none]):.4f} |")
    return "\n".join(lines)


def lots_text(lots: list[Lot]) -> str:
    """Every lot."""
    head = "| | trials | median | 95 % | worst | bound | above 0.035 | by the bound | in 1 sigma | in 2 sigma |"
    rows = [
        f"| {one.label} | {one.count} | {one.median_deg:.4f} | {one.p95_deg:.4f} | {one.worst_deg:.4f} | "
        f"{one.bound_deg:.4f} | {one.beyond_count} | {one.beyond_expected:.1f} | {one.one_sigma:.0%} | "
        f"{one.two_sigma:.0%} |"
        for one in lots
    ]
    return "\n".join([head, "|---" * 10 + "|", *rows])


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10, help="of the noise, for every real pass and papers' pass (10)")
    parser.add_argument("--listed", type=int, default=240, help="listed passes of each kind (240); 0: none")
    parser.add_argument("--vacuum", action="store_true", help="without air")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="write the figures here")
    parser.add_argument("--plot", type=output_picture, metavar="FILE", help="draw the real passes (PNG)")
    chosen = parser.parse_args()
    if not pass_names():
        say("no real passes: ../shared/data/passes is not there")
        return 1
    if chosen.draws < 1 or 0 != chosen.listed < CHUNK:
        parser.error(f"--draws must be 1 or more, --listed 0, or {CHUNK} or more")
    found = all_trials(chosen.draws, chosen.listed, not chosen.vacuum)
    lots = [lot_of(label, trials) for label, trials in found.items()]
    print(f"{passes_text(found)}\n\n{lots_text(lots)}")
    if chosen.json:
        figures = {"lots": [asdict(one) for one in lots]} | {
            label: [asdict(one) for one in found[label]] for label in (HALF, HALF_BIASED)
        }
        chosen.json.write_text(json.dumps(figures, indent=1) + "\n")
    if chosen.plot:
        plot_passes(chosen.plot, {"no bias": found[HALF], "bias 0.05/-0.04 deg": found[HALF_BIASED]})
    return 0


if __name__ == "__main__":
    run_script(main)
