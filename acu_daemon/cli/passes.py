"""`acu-daemon passes`: the coming passes."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from acu_daemon.cli.options import Config, cut_passes, ending, gaps, load_target, parse_utc
from acu_daemon.config import satellite_names
from acu_daemon.edge.clock import SystemClock
from acu_daemon.errors import OrbitError, UsageError
from acu_daemon.model import Pass
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

ROW = "{name:16} {rise:19}  {duration:>8}  {rise_az:>6}  {culmination:>6}  {culmination_az:>6}  {set_az:>6}"


def command(
    config: Config,
    satellite: Annotated[
        str | None, typer.Option("--satellite", help="Only this satellite.  Default: all of the directory.")
    ] = None,
    start: Annotated[
        str | None, typer.Option("--from", metavar="UTC", help="Start of the search.  Default: now.")
    ] = None,
    days: Annotated[float, typer.Option("--days", metavar="N", min=0.01, max=60, help="Length of the search.")] = 1.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print a JSON list, angles in degrees.")] = False,
) -> None:
    """Show the passes above the station's lowest elevation: rise, duration, culmination, set."""
    start_tai_s = SystemClock().tai_s() if start is None else parse_utc("--from", start)
    names = [satellite] if satellite is not None else satellite_names(config)
    if not names:
        raise UsageError(f"{config}/satellites holds no satellite; put a NAME.toml there")
    rows: list[tuple[str, Pass]] = []
    for name in names:
        try:
            rows += [(name, one) for one in _passes(config, name, start_tai_s, start_tai_s + days * DAY_S)]
        except OrbitError as error:
            if satellite is not None:
                raise
            typer.echo(f"warning: {name} is left out: {error}", err=True)
    rows.sort(key=lambda row: row[1].rise_tai_s)
    if as_json:
        typer.echo(json.dumps([_as_json(name, one) for name, one in rows], indent=1))
        return
    typer.echo(
        ROW.format(
            name="satellite",
            rise="rise UTC",
            duration="min:s",
            rise_az="az deg",
            culmination="top el",
            culmination_az="top az",
            set_az="set az",
        )
    )
    for name, one in rows:
        typer.echo(_as_text(name, one))
    if not rows:
        typer.echo(f"no pass within {days:g} days; try --days {min(60, 3 * days):g}")


def _passes(config: Path, name: str, start_tai_s: float, end_tai_s: float) -> list[Pass]:
    target = load_target(config, name, start_tai_s, is_strict=False)
    for text in [*target.elements.errors, *target.elements.warnings]:
        typer.echo(f"warning: {text}", err=True)
    if until := ending(target, end_tai_s):
        typer.echo(f"warning: {name}: {until}, no pass is looked for after that", err=True)
    lowest_deg = target.station.station.min_elevation_deg
    found = find_passes(target.elements.propagator, target.station.site, start_tai_s, end_tai_s, lowest_deg)
    for text in [*gaps(target, start_tai_s, end_tai_s), *cut_passes(target, found)]:
        typer.echo(f"warning: {name}: {text}", err=True)
    return found


def _as_text(name: str, one: Pass) -> str:
    minutes, seconds = divmod(round(one.duration_s), 60)
    return ROW.format(
        name=name,
        rise=utc_text(one.rise_tai_s, 0)[:19].replace("T", " "),
        duration=f"{minutes}:{seconds:02}",
        rise_az=f"{one.rise_az_deg:.1f}",
        culmination=f"{one.culmination_el_deg:.1f}",
        culmination_az=f"{one.culmination_az_deg:.1f}",
        set_az=f"{one.set_az_deg:.1f}",
    )


def _as_json(name: str, one: Pass) -> dict[str, Any]:
    return {
        "satellite": name,
        "rise_utc": utc_text(one.rise_tai_s),
        "culmination_utc": utc_text(one.culmination_tai_s),
        "set_utc": utc_text(one.set_tai_s),
        "duration_s": round(one.duration_s, 3),
        "rise_az_deg": round(one.rise_az_deg, 3),
        "culmination_az_deg": round(one.culmination_az_deg, 3),
        "culmination_el_deg": round(one.culmination_el_deg, 3),
        "set_az_deg": round(one.set_az_deg, 3),
    }
