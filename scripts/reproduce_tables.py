#!/usr/bin/env python3
"""The simulations of Kuga and Carrara 1988 and 1990 run again: 18 rows x methods, beside the papers' figures.

    .venv/bin/python scripts/reproduce_tables.py                    100 runs, table on standard output
    .venv/bin/python scripts/reproduce_tables.py --json FILE        the same as JSON
    .venv/bin/python scripts/reproduce_tables.py --plot FILE.png    every row as a picture
    .venv/bin/python scripts/reproduce_tables.py --figures DIR      figures 5.2-5.7 of Kuga and Carrara 1988
    .venv/bin/python scripts/reproduce_tables.py --pass-8-as-printed

The same seed gives the same figures, however many processes run.  It needs brahe: pip install 'acu-daemon[accuracy]'.
Errors are eps = sqrt(dA^2 + dh^2) without cos h, the largest over the predicted rest of the pass.
"""

import argparse
import json
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from tables.bound import bounds_deg
from tables.charts import plot_figures_5, plot_rows
from tables.console import progress, say
from tables.errors_put_in import draw_errors
from tables.methods import IN_TABLE, METHODS
from tables.outputs import output_file, output_folder, output_picture
from tables.rows import Row, rows_of, table_text
from tables.seed_figures import PASSES, PRINTED_PASS_8, SeedPass
from tables.simulate import errors_over_time_deg, largest_errors_deg
from tables.true_pass import TruePass, true_passes
from tables.workers import run_script

from acu_daemon.edge.campaign import results_of, run_campaign

CHUNK = 5  # runs that a process does at once
SEED = 1990
FEWEST_RUNS = 20  # for 5 and 95 %
FIGURE_USED_S = 210  # Kuga and Carrara 1988, figures 5.2-5.7 show a loss in the pass 2 asc. over Alcantara


def simulate_chunk(
    methods: tuple[str, ...], job: tuple[TruePass, list[np.random.SeedSequence]]
) -> dict[str, list[list[float]]]:
    """Do some runs of a pass by every method, with the same errors for all."""
    true_pass, runs = job
    result: dict[str, list[list[float]]] = {name: [] for name in methods}
    for run in runs:
        errors = draw_errors(np.random.default_rng(run), true_pass.tai_s.size)
        for name in methods:
            result[name].append(largest_errors_deg(true_pass, METHODS[name], errors))
    return result


def reproduce(passes: tuple[SeedPass, ...], methods: tuple[str, ...], run_count: int, seed: int) -> list[Row]:
    """Simulate every pass and give the rows, in the papers' order."""
    orbits = dict.fromkeys(one.orbit for one in passes)
    groups = [tuple(one for one in passes if one.orbit == orbit) for orbit in orbits]
    say(f"integrating {len(orbits)} reference orbits")
    found = {one.seed: one for group in results_of(run_campaign(true_passes, groups)) for one in group}
    ordered = [found[one] for one in passes]
    jobs = []
    for true_pass, sequence in zip(ordered, np.random.SeedSequence(seed).spawn(len(passes)), strict=True):
        runs = sequence.spawn(run_count)
        jobs += [(true_pass, runs[start : start + CHUNK]) for start in range(0, run_count, CHUNK)]
    work = partial(simulate_chunk, methods)
    done = results_of(run_campaign(work, jobs, name_of=lambda job: str(job[0].seed.label), on_done=progress))
    rows = []
    for true_pass in ordered:
        chunks = [chunk for (one, _), chunk in zip(jobs, done, strict=True) if one is true_pass]
        eps_deg = {name: np.array([run for chunk in chunks for run in chunk[name]]) for name in methods}
        rows += rows_of(true_pass, eps_deg, bounds_deg(true_pass, np.random.default_rng(seed)))
    return rows


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=100, help="runs of each pass (100)")
    parser.add_argument("--seed", type=int, default=SEED, help="of the random numbers")
    parser.add_argument("--methods", default=",".join(IN_TABLE), help=f"of {', '.join(METHODS)}")
    parser.add_argument("--only", default="", help="passes whose station and name hold this")
    parser.add_argument("--pass-8-as-printed", action="store_true", help="the printed elements for pass 8")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="write the rows as JSON")
    parser.add_argument("--plot", type=output_picture, metavar="FILE", help="draw the rows (PNG)")
    parser.add_argument("--figures", type=output_folder, metavar="DIR", help="draw the paper's figures 5.2-5.7 there")
    chosen = parser.parse_args()
    chosen.methods = tuple(chosen.methods.split(","))
    unknown = [name for name in chosen.methods if name not in METHODS]
    if unknown:
        parser.error(f"no method {unknown[0]!r}: expected some of {', '.join(METHODS)}")
    if chosen.runs < 1:
        parser.error("--runs must be 1 or more")
    if chosen.seed < 0:
        parser.error("--seed must be 0 or more")
    return chosen


def main() -> int:
    chosen = options()
    if find_spec("brahe") is None:
        say("the reference orbit needs brahe: pip install -c constraints.txt '.[accuracy]'")
        return 2
    if chosen.figures:
        draw_figures(chosen.figures, chosen.runs, chosen.seed)
        return 0
    every = PRINTED_PASS_8 if chosen.pass_8_as_printed else PASSES
    passes = tuple(one for one in every if chosen.only.lower() in f"{one.station} {one.label}".lower())
    if not passes:
        say(f"no pass holds {chosen.only!r}: there are {', '.join(f'{one.station} {one.label}' for one in every)}")
        return 2
    rows = reproduce(passes, chosen.methods, chosen.runs, chosen.seed)
    print(table_text(rows, chosen.methods))
    if chosen.runs < FEWEST_RUNS:
        say(f"5-95 % of {chosen.runs} runs is too narrow: what ! marks means little below {FEWEST_RUNS} runs")
    if chosen.json:
        chosen.json.write_text(json.dumps({"rows": [row.as_json() for row in rows]}, indent=1) + "\n")
    if chosen.plot:
        plot_rows(chosen.plot, rows, chosen.methods, chosen.runs)
    return 0


def draw_figures(folder: Path, run_count: int, seed: int) -> None:
    """Errors over time of the pass that the papers show: both their methods."""
    (true_pass,) = true_passes(PASSES[:1])
    runs = np.random.SeedSequence(seed).spawn(run_count)
    curves: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {"deterministic": [], "kalman": []}
    for count, run in enumerate(runs, 1):
        errors = draw_errors(np.random.default_rng(run), true_pass.tai_s.size)
        for name, found in curves.items():
            found.append(errors_over_time_deg(true_pass, METHODS[name], errors, FIGURE_USED_S))
        progress(count, run_count)
    plot_figures_5(folder / "seed-002-figures.png", true_pass, curves, FIGURE_USED_S)


if __name__ == "__main__":
    run_script(main)
