"""`acu-daemon onboard`: tracking profiles of a satellite's own steerable antenna."""

import json
from dataclasses import asdict, replace
from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.outputs import refuse_no_picture, refuse_unwritable, write_ascii
from acu_daemon.edge.campaign import progress_bar, results_of, run_campaign
from acu_daemon.edge.onboard_files import PlannedPass, load_pass
from acu_daemon.edge.onboard_scenarios import Run, run_scenario
from acu_daemon.errors import ProfileError, UsageError
from acu_daemon.onboard.checks import Check, check_axis, check_profile
from acu_daemon.onboard.methods import make_profile
from acu_daemon.onboard.parameter_file import ParameterFile, read, write
from acu_daemon.onboard.pipeline import Made, make
from acu_daemon.onboard.profile import METHODS, Profile, Task, peak_rate_deg_s
from acu_daemon.onboard.recheck import UNLIMITED, check_certificate, check_peaks, grid_s
from acu_daemon.report.onboard_text import header, scenario_table, summary

_LEAST_MARGIN_DEG, _WIDEST_MARGIN_DEG = 0.001, 30.0
_MARGINS = f"{_LEAST_MARGIN_DEG:g} to {_WIDEST_MARGIN_DEG:g} deg"


def profile(
    pass_file: Annotated[
        Path, typer.Argument(metavar="PASS.toml", help="The pass: orbit, station, attitude, antenna (docs/onboard.md).")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write the tracking-parameter file, text.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE.png", help="Draw the pass and its paths.")
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            metavar="M",
            help="single: the station; three: the best of three stations; search: ground station searching; free: the "
            "best path within the margin.  Default: the pass' file, else free.",
        ),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option("--objective", metavar="O", help="peak: least largest azimuth rate; imaging: quiet camera."),
    ] = None,
    margin_deg: Annotated[
        float | None, typer.Option("--margin-deg", metavar="M", help="Half cone, in place of the file's.")
    ] = None,
) -> None:
    """Make the tracking profile of one pass, check it, and write it as fifth-order polynomials.

    Exit status 1: no profile keeps to margin, ranges and limits; the message says what would.
    """
    refuse_unwritable(out)
    refuse_no_picture(plot)
    planned = load_pass(pass_file)
    for warning in planned.warnings:
        typer.echo(f"warning: {warning}", err=True)
    planned = _chosen(planned, method, objective)
    if margin_deg is not None and not _LEAST_MARGIN_DEG <= margin_deg <= _WIDEST_MARGIN_DEG:
        raise UsageError(f"--margin-deg {margin_deg:g}: expected {_MARGINS}")
    task, wanted = planned.task(margin_deg), planned.file.profile
    made = make(task, planned.station, wanted.method, wanted.objective, planned.file.antenna.play)
    for line in [*summary(planned, task, made, _single_deg_s(task, planned)), *map(str, made.second)]:
        typer.echo(line)
    if plot is not None:
        _draw(plot, planned, task, made)
    if not made.is_met:
        failed = ", ".join(check.name for check in made.second if not check.is_met)
        way = "change" if wanted.method == "free" else "--method free plans within margin and limits, or change"
        raise ProfileError(
            f"the profile of method {wanted.method} fails: {failed}; no file is written: {way} [antenna] in the pass' "
            "file"
        )
    if out is not None:
        about = {"PASS": pass_file.name, **header(planned, task, made, wanted.objective)}
        write_ascii(out, write(float(task.view.tai_s[0]), made.profile, about, made.second))
        typer.echo(f"written to {out}")


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A tracking-parameter file.")],
    pass_file: Annotated[
        Path | None,
        typer.Option("--pass", metavar="PASS.toml", help="Its pass.  Default: the one it names, beside it."),
    ] = None,
) -> None:
    """Read a tracking-parameter file back and check it: joints, rates, limits, and the margin all through the pass.

    Without the pass' file only what the polynomials say by themselves is checked.  Exit status 1: a check failed.
    """
    try:
        found = read(file.read_text(encoding="utf-8"), str(file))
    except UnicodeDecodeError:
        raise UsageError(f"{file}: not text: is it a tracking-parameter file?") from None
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}") from None
    beside = file.parent / found.header.get("PASS", "")
    path = pass_file or (beside if beside.is_file() else None)
    checks = _alone(found) if path is None else _with_pass(found, path)
    for one in checks:
        typer.echo(str(one))
    if path is None:
        typer.echo("the margin is not checked: give the pass by --pass PASS.toml", err=True)
    if failed := [one.name for one in checks if not one.is_met]:
        raise ProfileError(
            f"{file}: {', '.join(failed)}: do not upload it; make it anew by `acu-daemon onboard profile`"
        )


def scenarios(
    count: Annotated[int, typer.Option("--count", metavar="N", min=1, help="Scenarios; 66 are eleven of a kind.")] = 66,
    seed: Annotated[int, typer.Option("--seed", metavar="N", min=0, help="Of the first one; they count up.")] = 0,
    margin_deg: Annotated[float, typer.Option("--margin-deg", metavar="M", help="Half cone at the satellite.")] = 1.0,
    jobs: Annotated[
        int | None, typer.Option("--jobs", min=1, metavar="N", help="Processes.  Default: one a core.")
    ] = None,
    dask: Annotated[str | None, typer.Option("--dask", metavar="ADDRESS", help="Run on this dask scheduler.")] = None,
    imaging: Annotated[bool, typer.Option("--imaging", help="Plan each for a quiet camera too.")] = False,
    json_file: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the rows, JSON.")] = None,
) -> None:
    """Compare the four methods on made passes of a satellite like KOMPSAT-3 over Daejeon.

    The same seed makes the same scenario, whatever the count and the processes: `--count 1 --seed 17` runs one again.
    """
    refuse_unwritable(json_file)
    if not _LEAST_MARGIN_DEG <= margin_deg <= _WIDEST_MARGIN_DEG:
        raise UsageError(f"--margin-deg {margin_deg:g}: expected {_MARGINS}")
    runs = [Run(seed + k, margin_deg, imaging) for k in range(count)]
    with progress_bar("scenarios") as on_done:
        rows = results_of(run_campaign(run_scenario, runs, jobs=jobs, dask=dask, on_done=on_done))
    typer.echo("\n".join(scenario_table(rows, margin_deg)))
    if json_file is not None:
        kept = [{key: _finite(value) for key, value in asdict(row).items() if value is not None} for row in rows]
        write_ascii(json_file, json.dumps({"margin_deg": margin_deg, "rows": kept}, indent=1) + "\n")


def _finite(value: object) -> object:
    """JSON has no word for what is not a number: null."""
    return None if isinstance(value, float) and not isfinite(value) else value


def _chosen(planned: PlannedPass, method: str | None, objective: str | None) -> PlannedPass:
    """The pass with method and objective of the command line."""
    for option, value, known in (
        ("--method", method, METHODS),
        ("--objective", objective, ("peak", "imaging")),
    ):
        if value is not None and value not in known:
            raise UsageError(f"{option} {value}: expected one of {', '.join(known)}")
    given = {key: value for key, value in (("method", method), ("objective", objective)) if value is not None}
    return planned.with_profile(given)


def _single_deg_s(task: Task, planned: PlannedPass) -> float:
    single = make_profile(replace(task, azimuth=UNLIMITED, elevation=UNLIMITED), planned.station, "single")
    return float("nan") if single is None else peak_rate_deg_s(single.azimuth, task.view)


def _draw(path: Path, planned: PlannedPass, task: Task, made: Made) -> None:
    from acu_daemon.report.onboard_plot import plot_profile  # matplotlib is slow to load

    others: dict[str, Profile] = {}
    for name in METHODS:
        found = made.profile if name == made.profile.method else make_profile(task, planned.station, name)
        if found is not None:
            others[name] = found
    try:
        plot_profile(path, planned.label, planned.station, task, made.profile, others)
    except OSError as error:
        raise UsageError(f"--plot {path}: {error.strerror}") from None


def _alone(found: ParameterFile) -> list[Check]:
    time_s = grid_s(found)
    axes = (("azimuth", found.profile.azimuth), ("elevation", found.profile.elevation))
    checks = [one for name, path in axes for one in check_axis(name, path, UNLIMITED, time_s) if "joints" in one.name]
    return [*checks, *check_peaks(found), *check_certificate(found, None)]


def _with_pass(found: ParameterFile, path: Path) -> list[Check]:
    planned = load_pass(path)
    margin_deg = found.number("MARGIN_DEG")
    if margin_deg is not None and not _LEAST_MARGIN_DEG <= margin_deg <= _WIDEST_MARGIN_DEG:
        raise UsageError(f"MARGIN_DEG = {margin_deg:g}: expected {_MARGINS}")
    task = planned.task(margin_deg, (found.start_tai_s, found.start_tai_s + found.end_s))
    checks = check_profile(task, found.profile, planned.file.antenna.play)
    return [*checks, *check_peaks(found), *check_certificate(found, task)]
