#!/usr/bin/env python3
"""The simulations of Aguirre and Medeiros 1988, 2.4, run again on an integrated Landsat-4-like orbit.

    .venv/bin/python scripts/reproduce_seed001.py               tables on standard output
    .venv/bin/python scripts/reproduce_seed001.py --plots DIR   figures 2.1 and 2.2, and the sensitivity of 2.4.3
    .venv/bin/python scripts/reproduce_seed001.py --air         losses with `full` alone, in air

Losses at every elevation of 32 passes (highest elevations from 10 to 89.9 degrees, four directions of the perigee).
Errors are angles on the sky.  It needs brahe: pip install -c constraints.txt '.[accuracy]'
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec

import numpy as np
from tables.charts_seed_001 import plot_losses, plot_sensitivity
from tables.console import progress, say
from tables.landsat import PERIGEES_DEG, LandsatPass, in_air, landsat_passes
from tables.outputs import output_folder
from tables.seed_001 import (
    A_ERRORS_KM,
    EXPERIMENTS,
    I_ERRORS_DEG,
    LIMIT_DEG,
    SENSITIVE,
    Experiment,
    LossTrial,
    loss_trials,
    verdict,
    where_beyond,
)
from tables.workers import run_script

from acu_daemon.edge.campaign import results_of, run_campaign

LOSS_STEP_S, SENSITIVITY_STEP_S = 10, 40
SEED = 1982
BANDS_DEG = (5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 80.0, 90.0)


def try_all(passes: Sequence[LandsatPass], experiments: Sequence[Experiment], step_s: int) -> list[list[LossTrial]]:
    """Try every experiment on every pass; the losses of each experiment."""
    jobs = [(experiment, one, k) for experiment in experiments for k, one in enumerate(passes)]
    tried = results_of(run_campaign(partial(_try_one, step_s), jobs, name_of=_named, on_done=progress))
    found: list[list[LossTrial]] = [[] for _ in experiments]
    for k, trials in enumerate(tried):
        found[k // len(passes)] += trials
    return found


def _named(job: tuple[Experiment, LandsatPass, int]) -> str:
    return f"{job[0]}, pass {job[2]}"


def _try_one(step_s: int, job: tuple[Experiment, LandsatPass, int]) -> list[LossTrial]:
    experiment, one, number = job
    return loss_trials(one, experiment, step_s, np.random.default_rng((SEED, number)))


def losses(
    passes: list[LandsatPass], experiments: Sequence[Experiment] = EXPERIMENTS, step_s: int = LOSS_STEP_S
) -> dict[str, list[LossTrial]]:
    """2.4.1: print the table, and give the losses."""
    say("losses at every elevation")
    found = try_all(passes, experiments, step_s)
    names = (
        "method",
        f"s until {LIMIT_DEG:g}°, shortest",
        "the same, lost above 80°",
        "worst within 10 s, lost above 80°",
        "worst over a pass",
        f"losses that leave {LIMIT_DEG:g}°",
    )
    print("| " + " | ".join(names) + " |\n" + "|---" * len(names) + "|")
    for experiment, trials in zip(experiments, found, strict=True):
        one = verdict(trials)
        cells = (
            experiment.name,
            _seconds(one.seconds_within),
            _seconds(one.seconds_within_overhead),
            f"{one.worst_at_10_s_overhead_deg:.3f}",
            f"{one.worst_deg:.2f}",
            f"{one.beyond_count} of {one.trial_count}",
        )
        print("| " + " | ".join(cells) + " |")
    _print_where(dict(zip((one.name for one in experiments), found, strict=True)))
    return {experiment.name: trials for experiment, trials in zip(experiments, found, strict=True)}


def _print_where(trials: dict[str, list[LossTrial]]) -> None:
    """Where `full` leaves the limit: by the elevation at the loss."""
    for name in (name for name in trials if name.startswith("full")):
        print(f"\n{name}: losses that leave {LIMIT_DEG:g}°, by the elevation at the loss (rising), and the worst error")
        bands = where_beyond(trials[name], BANDS_DEG)
        print("| " + " | ".join(band for band, *_ in bands) + " |\n" + "|---" * len(bands) + "|")
        print("| " + " | ".join(f"{beyond} of {count}, {worst:.2f}°" for _, beyond, count, worst in bands) + " |")
    print()


def sensitivity(passes: list[LandsatPass]) -> dict[str, tuple[list[float], list[float]]]:
    """2.4.3: print the table, and give the worst errors of each method against the errors of a and i."""
    say("sensitivity to errors of a and i")
    result = {}
    names = [*(f"a {error:+g} km" for error in A_ERRORS_KM), *(f"i {error:+g}°" for error in I_ERRORS_DEG)]
    print("| worst over a pass | " + " | ".join(names) + " |\n" + "|---" * (len(names) + 1) + "|")
    for method in SENSITIVE:
        cases = [replace(method, d_a_km=error) for error in A_ERRORS_KM]
        cases += [replace(method, d_i_deg=error) for error in I_ERRORS_DEG]
        worst = [verdict(trials).worst_deg for trials in try_all(passes, cases, SENSITIVITY_STEP_S)]
        print(f"| {method.name} | " + " | ".join(f"{value:.3f}" for value in worst) + " |", flush=True)
        result[method.name] = (worst[: len(A_ERRORS_KM)], worst[len(A_ERRORS_KM) :])
    return result


def _seconds(value: float) -> str:
    return f"{value:.0f}" if np.isfinite(value) else "never"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--air", action="store_true", help="losses with `full` alone, in air")
    parser.add_argument("--step", type=int, default=LOSS_STEP_S, metavar="S", help="s between losses (%(default)s)")
    parser.add_argument("--plots", type=output_folder, metavar="DIR", help="draw the figures there")
    chosen = parser.parse_args()
    if find_spec("brahe") is None:
        say("the reference orbit needs brahe: pip install -c constraints.txt '.[accuracy]'")
        return 2
    say("integrating the orbit and placing the stations")
    passes = landsat_passes()
    if chosen.air:
        of_full = [one for one in EXPERIMENTS if one.estimator == "full"]
        losses([in_air(one, seed) for seed, one in enumerate(passes)], of_full, chosen.step)
        return 0
    found = losses(passes, step_s=chosen.step)
    perigees = len(passes) // len(PERIGEES_DEG)
    worst = sensitivity(passes[:perigees] + passes[2 * perigees : 3 * perigees])
    if chosen.plots:
        plot_losses(chosen.plots / "seed-001-losses.png", found)
        plot_sensitivity(chosen.plots / "seed-001-sensitivity.png", worst)
    return 0


if __name__ == "__main__":
    run_script(main)
