"""`acu-daemon groundtrack from-elements`: D and the manoeuvres of a real satellite, from a history of element sets."""

import json
import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from acu_daemon.cli.outputs import refuse_no_picture, refuse_unwritable
from acu_daemon.errors import OrbitError, UsageError
from acu_daemon.groundtrack.history import History, crossing_near, history_of, is_of_another_orbit, mean_orbit_of
from acu_daemon.groundtrack.kinks import FoundManoeuvre, find_manoeuvres
from acu_daemon.groundtrack.reference import Cycle
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.orbit.tle import parse_tle

_SHOWN_PROBLEMS = 5
_CYCLE = re.compile(r"([1-9][0-9]{0,4})/([1-9][0-9]{0,2})")

CycleText = Annotated[
    str | None,
    typer.Option(
        "--cycle",
        metavar="REVOLUTIONS/DAYS",
        help="The repeat cycle, such as 373/26 (CBERS), 233/16 (Landsat), 143/10 (Sentinel-2).  Default: found.",
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Csv = Annotated[Path | None, typer.Option("--csv", metavar="FILE.csv", help="Write utc,d_m, a line a point.")]
Plot = Annotated[Path | None, typer.Option("--plot", metavar="FILE.png", help="Draw D and the manoeuvres.")]


def command(
    file: Annotated[Path, typer.Argument(help="Element sets of one satellite over time, TLE or OMM.")],
    norad_id: Annotated[
        int | None, typer.Option("--norad-id", help="Which satellite, if the file has several.")
    ] = None,
    cycle: CycleText = None,
    csv: Csv = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Show how a phased satellite's ground track moved, and when it was manoeuvred.

    D is where the satellite crosses the equator northwards less where it does on average, metres, east positive.  Noise
    of real element sets is about 100 m in D: a band of +-4 km shows clearly, one of +-100 m does not.
    """
    refuse_unwritable(csv)
    refuse_no_picture(plot)
    sets = _one_orbit(_one_satellite(_read(file), norad_id, file))
    crossings = []
    for one in sets:
        try:
            crossings.append(crossing_near(Sgp4Propagator(one), one.epoch_tai_s, 2.0 * np.pi / one.mean_motion_rad_s))
        except OrbitError as error:
            raise UsageError(f"{one.where}: {error}") from None
    means = [mean_orbit_of(one.mean_motion_rad_s, one.eccentricity, one.inclination_rad) for one in sets]
    history, gaps = history_of(crossings, means, parsed_cycle(cycle))
    for text in gaps:
        typer.echo(f"warning: {text}", err=True)
    found = find_manoeuvres(history)
    if csv is not None:
        write_csv(csv, "utc,d_m", [f"{utc_text(t)},{d:.1f}" for t, d in zip(history.tai_s, history.d_m, strict=True)])
    if as_json:
        typer.echo(json.dumps(_as_object(sets[-1], history, found), indent=1))
    else:
        _print(sets[-1], history, found)
    if plot is not None:
        from acu_daemon.report.groundtrack_plot import plot_history

        plot_history(plot, history, found, sets[-1].label)


def parsed_cycle(text: str | None) -> Cycle | None:
    """UsageError: not REVOLUTIONS/DAYS."""
    if text is None:
        return None
    if (found := _CYCLE.fullmatch(text)) is None:
        raise UsageError(f"--cycle {text}: expected REVOLUTIONS/DAYS such as 373/26")
    return Cycle(int(found[1]), int(found[2]))


def write_csv(path: Path, header: str, rows: list[str]) -> None:
    """UsageError: it cannot be written."""
    try:
        path.write_text("\n".join([header, *rows]) + "\n", encoding="ascii")
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None


def _read(file: Path) -> list[ElementSet]:
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}") from None
    parse = parse_tle if any(line.startswith("1 ") for line in text.splitlines()) else parse_omm
    sets, problems = parse(text, str(file))
    for problem in problems[:_SHOWN_PROBLEMS]:
        typer.echo(f"warning: {problem}", err=True)
    if len(problems) > _SHOWN_PROBLEMS:
        typer.echo(f"warning: {file}: {len(problems) - _SHOWN_PROBLEMS} more element sets cannot be read", err=True)
    return sets


def _one_satellite(sets: list[ElementSet], norad_id: int | None, file: Path) -> list[ElementSet]:
    """The sets of one satellite, oldest first, one for each epoch (the last in the file)."""
    chosen = [one for one in sets if norad_id in (None, one.norad_id)]
    ids = sorted({one.norad_id for one in chosen})
    if not chosen:
        there = f"; it holds {', '.join(map(str, sorted({one.norad_id for one in sets})[:10]))}" if sets else ""
        raise UsageError(f"{file}: no element set{f' of {norad_id}' if norad_id is not None else ''}{there}")
    if len(ids) > 1:
        raise UsageError(
            f"{file}: element sets of {len(ids)} satellites ({', '.join(map(str, ids[:10]))}); "
            "say which with --norad-id"
        )
    by_epoch = {round(one.epoch_tai_s, 3): one for one in chosen}
    return [by_epoch[epoch] for epoch in sorted(by_epoch)]


def _one_orbit(sets: list[ElementSet]) -> list[ElementSet]:
    """The sets without those of quite another orbit, which are told: another satellite's, under the same number."""
    means = [mean_orbit_of(one.mean_motion_rad_s, one.eccentricity, one.inclination_rad) for one in sets]
    strangers = is_of_another_orbit(means)
    out = [one for one, is_other in zip(sets, strangers, strict=True) if is_other]
    for one in out[:_SHOWN_PROBLEMS]:
        typer.echo(f"warning: {one.where}: left out: of quite another orbit than the other sets", err=True)
    if len(out) > _SHOWN_PROBLEMS:
        typer.echo(f"warning: {len(out) - _SHOWN_PROBLEMS} more element sets of another orbit are left out", err=True)
    return [one for one, is_other in zip(sets, strangers, strict=True) if not is_other]


def _as_object(last: ElementSet, history: History, found: list[FoundManoeuvre]) -> dict[str, Any]:
    cycle = history.reference.cycle
    return {
        "satellite": last.label,
        "norad_id": last.norad_id,
        "cycle_revolutions": cycle.revolutions,
        "cycle_days": cycle.days,
        "d_min_m": round(float(history.d_m.min()), 1),
        "d_max_m": round(float(history.d_m.max()), 1),
        "d": [{"utc": utc_text(t), "d_m": round(float(d), 1)} for t, d in zip(history.tai_s, history.d_m, strict=True)],
        "manoeuvres": [
            {"utc": utc_text(one.tai_s), "delta_a_m": round(one.delta_a_m, 2), "sigma_m": round(one.sigma_m, 2)}
            for one in found
        ],
    }


def _print(last: ElementSet, history: History, found: list[FoundManoeuvre]) -> None:
    cycle = history.reference.cycle
    typer.echo(
        f"{last.label}: {history.tai_s.size} element sets, {utc_text(history.tai_s[0], 0)} to "
        f"{utc_text(history.tai_s[-1], 0)}; cycle of {cycle.revolutions} revolutions in {cycle.days} days ({cycle})"
    )
    typer.echo(f"D {history.d_m.min():.0f} to {history.d_m.max():.0f} m; {len(found)} manoeuvres found")
    for one in found:
        typer.echo(f"{utc_text(one.tai_s, 0)}  {one.delta_a_m:+8.1f} m  +- {one.sigma_m:.1f}")
