"""`acu-daemon groundtrack reproduce`: the runs and figures of Galski and Orlando 2011, beside ours."""

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from acu_daemon.cli.groundtrack_simulate import Dask, Jobs, Tesserals, as_object, with_tesserals
from acu_daemon.cli.outputs import refuse_unwritable
from acu_daemon.errors import UsageError
from acu_daemon.units import DAY_S

WINDOWS_DAYS = 4.0  # of figure 2
HOW = ("right", "fitted", "ours")
SAYS = {
    "right": "paper's controller, right acceleration",
    "fitted": "paper's controller, acceleration FITTED to its count",
    "ours": "our controller, 2 % execution error",
}
ROW = "{run:22}{how:55}{count:>6}{total:>8}{largest:>8}{smallest:>9}{low:>8}{high:>7}{bound:>7}"


def command(
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Draw figures 2 to 11 into this directory.")
    ] = None,
    days: Annotated[float, typer.Option("--days", help="Length of every run; the paper's table is of a year.")] = 365.0,
    seed: Annotated[int, typer.Option("--seed", min=0)] = 1,
    jobs: Jobs = None,
    dask: Dask = None,
    tesserals: Tesserals = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON list with the paper's figures.")] = False,
) -> None:
    """SIMULATION: the paper's table beside ours; 14 years of simulation, some 25 s of one core each.

    The paper's counts do not follow from the right acceleration of D: with it, its controller makes fewer and larger
    manoeuvres, and leaves the band to the west.  A scale of the acceleration, one for each run, gives its counts; such
    rows are labelled FITTED.  docs/groundtrack.md says what else of the paper is ambiguous.
    """
    from acu_daemon.edge.campaign import progress_bar, results_of, run_campaign
    from acu_daemon.edge.flux_file import load_flux
    from acu_daemon.groundtrack.simulate import check_case, make_world

    worlds = {name: make_world(load_flux(name)) for name in ("moderate", "critical")}
    labelled = _cases(days, seed)
    for _, _, case in labelled:
        check_case(worlds[case.profile], case)
    if out is not None:
        _make_directory(out)
    tables = with_tesserals(worlds["moderate"], is_wanted=tesserals)
    worlds = {
        name: replace(world, ripple=tables.ripple, known_ripple=tables.known_ripple) for name, world in worlds.items()
    }
    with progress_bar("SIMULATION, runs") as on_done:
        outcomes = results_of(
            run_campaign(
                partial(_simulate, worlds),
                [case for _, _, case in labelled],
                jobs=jobs,
                dask=dask,
                name_of=lambda case: f"{case.profile} +-{case.band_m:g} m, {case.controller}",
                on_done=on_done,
            )
        )
    if as_json:
        objects = [_as_object(label, outcome) for label, outcome in zip(labelled, outcomes, strict=True)]
        typer.echo(json.dumps(objects, indent=1))
    else:
        _print(labelled, outcomes)
    if out is not None:
        _draw(out, labelled, outcomes)
        typer.echo(f"figures in {out}", err=True)


def _cases(days: float, seed: int) -> list[tuple[Any, str, Any]]:
    """The paper's run (None for the two of 2001), how, and the case."""
    from acu_daemon.groundtrack.simulate import CONSTANT, OURS, PAPER, PAPER_RUNS, Case

    cases: list[tuple[Any, str, Any]] = []
    for run in PAPER_RUNS:
        case = partial(Case, run.profile, run.band_m, days=days, seed=seed)
        cases += [
            (run, "right", case(PAPER, execution_sigma=0.0)),
            (run, "fitted", case(PAPER, execution_sigma=0.0, acceleration_scale=run.fitted_scale)),
            (run, "ours", case(OURS)),
        ]
    for profile, size_m in (("moderate", 3.0), ("critical", 4.0)):
        steps = Case(profile, 100.0, CONSTANT, days=days, seed=seed, execution_sigma=0.0, constant_m=size_m)
        cases.append((None, f"steps of {size_m:g} m, as Galski et al. 2001", steps))
    return cases


def _simulate(worlds: dict[str, Any], case: Any) -> Any:
    from acu_daemon.groundtrack.simulate import simulate

    return simulate(worlds[case.profile], case)


def _print(labelled: list[tuple[Any, str, Any]], outcomes: list[Any]) -> None:
    typer.echo("SIMULATION; the paper's rows are of a year")
    typer.echo(
        ROW.format(
            run="profile, band", how="", count="count", total="sum m", largest="largest", smallest="smallest",
            low="D min", high="D max", bound="bound",
        )
    )  # fmt: skip
    for (run, how, case), outcome in zip(labelled, outcomes, strict=True):
        name = f"{case.profile} +-{case.band_m:g} m"
        if how == "right":
            typer.echo(
                ROW.format(
                    run=name, how="the paper", count=run.manoeuvre_count, total=f"{run.sum_m:.0f}",
                    largest=f"{run.largest_m:.1f}", smallest=f"{run.smallest_m:.1f}", low="", high="", bound="",
                )
            )  # fmt: skip
        said = SAYS.get(how, how) + (f", x {case.acceleration_scale:g}" if how == "fitted" else "")
        flown = outcome.flown
        sizes = flown.sizes_m
        typer.echo(
            ROW.format(
                run="" if run else name,
                how=said,
                count=sizes.size,
                total=f"{sizes.sum():.0f}",
                largest=f"{sizes.max():.1f}" if sizes.size else "-",
                smallest=f"{sizes.min():.1f}" if sizes.size else "-",
                low=f"{flown.d_m.min():.0f}",
                high=f"{flown.d_m.max():.0f}",
                bound=f"{outcome.bound_count:.1f}",
            )
        )


def _as_object(label: tuple[Any, str, Any], outcome: Any) -> dict[str, Any]:
    run, how, case = label
    found = as_object(outcome) | {"how": SAYS.get(how, how), "acceleration_scale": case.acceleration_scale}
    if run is not None:
        found["paper"] = {
            "manoeuvre_count": run.manoeuvre_count,
            "sum_m": run.sum_m,
            "largest_m": run.largest_m,
            "smallest_m": run.smallest_m,
        }
    return found


def _make_directory(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"--out {out}: {error.strerror}") from None
    refuse_unwritable(out / "figure-02.png")


def _draw(out: Path, labelled: list[tuple[Any, str, Any]], outcomes: list[Any]) -> None:
    from acu_daemon.edge.flux_file import PROFILES, load_flux
    from acu_daemon.groundtrack.environment import STEP_S
    from acu_daemon.groundtrack.smoothing import RECURSION, WINDOW, DriftSmoother
    from acu_daemon.report.groundtrack_plot import plot_paper_run, plot_profiles, plot_windows

    by_run = {(case.profile, case.band_m, how): one for (_, how, case), one in zip(labelled, outcomes, strict=True)}
    tight = by_run["moderate", 100.0, "right"].flown
    end = round(min([one.time_s for one in tight.manoeuvres[:1]] + [WINDOWS_DAYS * DAY_S]) / STEP_S)
    raw = tight.seen_m[1:end].tolist()
    smoothed: dict[str, Sequence[float]] = {}
    for hours, kind in ((3.0, RECURSION), (20.0, RECURSION), (20.0, WINDOW)):
        smoother = DriftSmoother(STEP_S, hours * 3600.0, hours * 3600.0, kind)
        smoothed[f"{hours:g} h, {'stored sums, eq 3' if kind == RECURSION else 'true window'}"] = [
            smoother.add(one)[0] for one in raw
        ]
    plot_windows(out / "figure-02.png", raw, smoothed)
    days = labelled[0][2].days
    plot_profiles(out / "figure-03.png", {name: load_flux(name) for name in PROFILES}, days)
    for number, run in zip(
        ("04-05", "06", "08-09", "10"), [run for run, how, _ in labelled if how == "right"], strict=True
    ):
        runs = {SAYS[how]: by_run[run.profile, run.band_m, how] for how in HOW}
        plot_paper_run(out / f"figure-{number}.png", runs, f"figure {number}: {run.profile} profile, ±{run.band_m:g} m")
    for number, (_, how, case), outcome in zip(("07", "11"), labelled[-2:], outcomes[-2:], strict=True):
        plot_paper_run(out / f"figure-{number}.png", {how: outcome}, f"figure {number}: {case.profile} profile, {how}")
