"""`acu-daemon groundtrack simulate`: years of a satellite that keeps its own ground track."""

import json
import sys
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer

from acu_daemon.cli.outputs import refuse_no_picture

TRUE_DEGREE, KNOWN_DEGREE = 20, 12  # of the tesserals: what pulls, and what the table on board has

Jobs = Annotated[int | None, typer.Option("--jobs", min=1, metavar="N", help="Processes.  Default: one a core.")]
Dask = Annotated[
    str | None,
    typer.Option(
        "--dask",
        metavar="ADDRESS",
        help="Run on the workers of this dask scheduler, such as tcp://host:8786 (extra `cluster`).",
    ),
]
Tesserals = Annotated[
    bool,
    typer.Option(
        "--tesserals/--no-tesserals",
        help="The tesserals' ripple in orbit and on-board table (extra `accuracy`; 15 s once).  Without it small "
        "bands look easier than they are.",
    ),
]


def command(
    profile: Annotated[
        str,
        typer.Option(
            "--profile", help="moderate, critical, critical-physical, or a CSV file: date,f107_sfu,kp, a line a day."
        ),
    ] = "moderate",
    band_m: Annotated[float, typer.Option("--band-m", help="Half the band: D is kept within +- this.")] = 3900.0,
    controller: Annotated[str, typer.Option("--controller", help="ours, or paper (Galski and Orlando 2011).")] = "ours",
    navigator: Annotated[
        str,
        typer.Option(
            "--navigator", help="ours; paper (a filter at each fix: 5 minutes a year); perfect (D without noise)."
        ),
    ] = "ours",
    days: Annotated[float, typer.Option("--days", help="Length of a run.")] = 365.0,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of all that is random.")] = 0,
    runs: Annotated[int, typer.Option("--runs", min=1, help="Runs, with the seeds from --seed on.")] = 1,
    jobs: Jobs = None,
    dask: Dask = None,
    execution_error: Annotated[
        float, typer.Option("--execution-error", min=0.0, max=0.3, help="1 sigma of a manoeuvre's size.")
    ] = 0.02,
    density_error: Annotated[
        float,
        typer.Option("--density-error", min=0.0, max=1.0, help="1 sigma by which the air departs from its model."),
    ] = 0.0,
    storms: Annotated[int, typer.Option("--storms", min=0, help="Geomagnetic storms put into the profile.")] = 0,
    semi_annual: Annotated[
        bool, typer.Option("--semi-annual/--no-semi-annual", help="The density's semi-annual variation.")
    ] = True,
    smoothing: Annotated[
        str, typer.Option("--smoothing", help="The paper's means: recursion, as its sums make it; or window.")
    ] = "recursion",
    acceleration_scale: Annotated[
        float,
        typer.Option(
            "--acceleration-scale",
            min=0.01,
            max=10.0,
            help="What the paper's controller takes for D's acceleration: 1 is right.",
        ),
    ] = 1.0,
    tesserals: Tesserals = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the outcome as JSON; a list for --runs.")] = False,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE.png", help="Draw D and the manoeuvres of the first run.")
    ] = None,
) -> None:
    """SIMULATION: keep the ground track of a CBERS-like satellite within a band, by GPS and its own decisions.

    D is where the satellite crosses the equator less where its reference orbit does, metres, east positive.  Drag
    moves it east, a manoeuvre raises the semi-major axis and turns it back.  bound: the number of manoeuvres that
    would do if each parabola filled the band.
    """
    from acu_daemon.edge.campaign import results_of
    from acu_daemon.edge.flux_file import load_flux
    from acu_daemon.groundtrack.simulate import Case, CaseOutcome, check_case, make_world
    from acu_daemon.groundtrack.storms import with_storms

    refuse_no_picture(plot)
    flux = load_flux(profile)
    world = make_world(with_storms(flux, storms, seed) if storms else flux)
    case = Case(
        profile=profile,
        band_m=band_m,
        controller=controller,
        navigator=navigator,
        days=days,
        seed=seed,
        execution_sigma=execution_error,
        density_sigma=density_error,
        acceleration_scale=acceleration_scale,
        smoothing=smoothing,
        has_semi_annual=semi_annual,
    )
    check_case(world, case)
    warn_of(world, case)
    if navigator != "perfect":
        world = with_tesserals(world, is_wanted=tesserals)
    outcomes = _run(world, [replace(case, seed=seed + k) for k in range(runs)], jobs, dask)
    done = [one for one in outcomes if isinstance(one, CaseOutcome)]
    if as_json:
        objects = [as_object(outcome) for outcome in done]
        typer.echo(json.dumps(objects if runs > 1 else objects[0] if objects else None, indent=1))
    else:
        typer.echo("\n".join([HEAD, *(as_row(outcome) for outcome in done)]))
    results_of(outcomes)  # tells the runs that failed; those that did not are written
    if plot is not None:
        from acu_daemon.report.groundtrack_plot import plot_run

        plot_run(plot, done[0])


def _run(world: Any, cases: list[Any], jobs: int | None, dask: str | None) -> list[Any]:
    from acu_daemon.edge.campaign import progress_bar, run_campaign
    from acu_daemon.groundtrack.simulate import simulate

    with progress_bar("SIMULATION, days" if len(cases) == 1 else "SIMULATION, runs") as on_done:
        if len(cases) == 1 and dask is None:
            (case,) = cases
            return [simulate(world, case, on_done and partial(_day_done, on_done, round(case.days)))]
        work = partial(simulate, world)
        return run_campaign(work, cases, jobs=jobs, dask=dask, name_of=lambda one: f"seed {one.seed}", on_done=on_done)


HEAD = (
    f"{'SIMULATION':18}{'band m':>8} {'control':>8} {'seed':>5} {'count':>6} {'bound':>6} {'sum m':>8} {'largest':>8} "
    f"{'smallest':>8} {'D min m':>9} {'D max m':>9}"
)


def as_object(outcome: Any) -> dict[str, Any]:
    """What `--json` writes of a run."""
    from acu_daemon.orbit.timescales import utc_text

    case, flown = outcome.case, outcome.flown
    sizes = flown.sizes_m
    return {
        "profile": case.profile,
        "band_m": case.band_m,
        "controller": case.controller,
        "seed": case.seed,
        "manoeuvre_count": len(flown.manoeuvres),
        "sum_m": round(float(sizes.sum()), 3),
        "largest_m": round(float(sizes.max()), 3) if sizes.size else None,
        "smallest_m": round(float(sizes.min()), 3) if sizes.size else None,
        "d_min_m": round(float(flown.d_m.min()), 3),
        "d_max_m": round(float(flown.d_m.max()), 3),
        "bound_count": round(outcome.bound_count, 2),
        "manoeuvres": [
            {"utc": utc_text(outcome.free.start_tai_s + one.time_s), "delta_a_m": round(one.delta_a_m, 4)}
            for one in flown.manoeuvres
        ],
    }


def as_row(outcome: Any) -> str:
    """A line of the table."""
    case, flown = outcome.case, outcome.flown
    sizes = flown.sizes_m
    largest, smallest = (f"{one(sizes):8.1f}" if sizes.size else f"{'-':>8}" for one in (max, min))
    return (
        f"{Path(case.profile).stem[:17]:18}{case.band_m:8.0f} {case.controller:>8} {case.seed:5d} {sizes.size:6d} "
        f"{outcome.bound_count:6.1f} {sizes.sum():8.1f} {largest} {smallest} {flown.d_m.min():9.0f} "
        f"{flown.d_m.max():9.0f}"
    )


def with_tesserals(world: Any, *, is_wanted: bool) -> Any:
    """The world with the tables of the tesserals, computed now; a warning where it stays without."""
    from acu_daemon.edge.tesserals import ripple_of
    from acu_daemon.groundtrack.environment import node_rad

    if not is_wanted:
        return world
    if find_spec("brahe") is None:
        warn(
            "the orbit is simulated without the tesserals, which makes small bands look easier than they are; "
            "they need brahe: pip install 'acu-daemon[accuracy]'"
        )
        return world
    if sys.stderr.isatty():
        typer.echo("the tesserals' tables of the repeat cycle ...", err=True)
    start_tai_s = world.start_tai_s
    node = node_rad(world.craft, start_tai_s)
    tables = [ripple_of(world.craft.reference, start_tai_s, node, degree) for degree in (TRUE_DEGREE, KNOWN_DEGREE)]
    return replace(world, ripple=tables[0], known_ripple=tables[1])


def warn_of(world: Any, case: Any) -> None:
    """Say what in the profile the polynomials do not cover."""
    from acu_daemon.groundtrack.environment import effective_flux, even_steps
    from acu_daemon.units import DAY_S

    flux = effective_flux(world.flux.at(even_steps(world.start_tai_s, DAY_S, int(case.days))))
    if count := world.polynomials.outside(flux):
        low, high = world.polynomials.lowest, world.polynomials.highest
        warn(
            f"--profile {case.profile}: on {count} of {int(case.days)} days the flux (down to {flux.min():.0f}, up to "
            f"{flux.max():.0f} sfu) is outside {low:g} to {high:g}, where the drag's polynomials were fitted; "
            "the edge's value is taken on board"
        )


def warn(text: str) -> None:
    """On stderr."""
    typer.echo(f"warning: {text}", err=True)


def _day_done(on_done: Any, total: int, day: float) -> None:
    on_done(min(total, int(day)), total)
