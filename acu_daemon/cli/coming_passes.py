"""`acu-daemon passes`: the coming passes."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from acu_daemon.cli.options import (
    Config,
    Target,
    beginning,
    cut_passes,
    ending,
    gaps,
    load_target,
    open_ends,
    parse_utc,
)
from acu_daemon.cli.outputs import refuse_no_picture
from acu_daemon.config.load import load_station, satellite_names
from acu_daemon.config.station_tables import StationFile
from acu_daemon.control.tracking.pass_plan import beyond_limits
from acu_daemon.edge.clock import SystemClock
from acu_daemon.errors import AcuDaemonError, OrbitError, UsageError
from acu_daemon.model import Pass
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator, is_ephemeris, spans_tai_s
from acu_daemon.orbit.selection import nearest_epoch_tai_s
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.orbit.visibility import why_none
from acu_daemon.pointing.outage import KeptOut, SunOutage, kept_out, sun_outages
from acu_daemon.pointing.reach import OutOfReach
from acu_daemon.units import DAY_S

MOST_TRACKS, TRACK_POINTS = 12, 200  # of a picture
ROW = "{name:16} {rise:19}  {duration:>8}  {rise_az:>6}  {culmination:>6}  {culmination_az:>6}  {set_az:>6}"


@dataclass(frozen=True, slots=True)
class _Seen:
    """A satellite's passes within a search, why there are none, and what there is to say of elements and search."""

    passes: list[Pass]
    epochs_tai_s: dict[Pass, float]  # of the elements that each is computed from
    beyond: dict[Pass, tuple[OutOfReach, ...]]  # when which axis cannot follow
    sun: dict[Pass, tuple[SunOutage, ...]]  # when it is near the sun
    zones: dict[Pass, tuple[KeptOut, ...]]  # when it is in a keep-out zone
    propagators: dict[Pass, Propagator]  # what each is computed from
    why_none: str
    said: list[str]


def command(
    config: Config,
    satellite: Annotated[
        str | None, typer.Option("--satellite", help="Only this satellite.  Default: all of the directory.")
    ] = None,
    start: Annotated[
        str | None, typer.Option("--from", metavar="UTC", help="Start of the search.  Default: now.")
    ] = None,
    days: Annotated[float, typer.Option("--days", metavar="N", min=0.01, max=60, help="Length of the search.")] = 1.0,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            help="Print a JSON list, angles in degrees; where satellites are left out, an object with the list as "
            "`passes` and them, each with its reason, as `omitted`.  A pass's `elements_epoch_utc` says which set of "
            "elements it is computed from.",
        ),
    ] = False,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE",
            help="Also draw the sky with mask, keep-out zones, the sun and the passes, the first twelve: .png, .svg, "
            ".pdf.",
        ),
    ] = None,
) -> None:
    """Show the passes above the station's lowest elevation: rise, duration, culmination, set.

    Elevations are apparent, in the air of [atmosphere]: at 5 deg a low satellite rises some 3 s sooner.

    Where the limits of an axis do not hold a pass, its line says which axis cannot follow, from when, for how long;
    where a hill of `[envelope] mask` hides it in its midst, where it comes near the sun, how near, and where it is in a
    keep-out zone, from when and for how long.

    Of several element sets of a satellite in its file, each pass is computed from the one nearest to it in time.

    A satellite whose files or elements cannot be used is left out with its reason, the others are shown; exit status 2
    where none is left.
    """
    refuse_no_picture(plot)
    start_tai_s = SystemClock().tai_s() if start is None else parse_utc("--from", start)
    end_tai_s = start_tai_s + days * DAY_S
    names = [satellite] if satellite is not None else satellite_names(config)
    if not names:
        raise UsageError(f"{config}/satellites holds no satellite; put a NAME.toml there")
    load_station(config)  # what is wrong with it is no single satellite's
    seen: dict[str, _Seen] = {}
    omitted: dict[str, str] = {}
    for name in names:
        try:
            seen[name] = _search(config, name, start_tai_s, end_tai_s)
        except AcuDaemonError as error:
            omitted[name] = str(error)
        else:
            for text in seen[name].said:
                typer.echo(text, err=True)
    if len(names) > 1:
        for name, reason in omitted.items():
            typer.echo(f"warning: {name} is left out: {'; '.join(reason.splitlines())}", err=True)
    _show(seen, omitted, start_tai_s, end_tai_s, as_json=as_json)
    if plot is not None and seen:
        _plot(plot, load_station(config), seen)
    if not seen:
        [(name, reason), *others] = omitted.items()
        if others:
            raise UsageError(f"no satellite of {config}/satellites can be used")
        raise UsageError(reason if satellite is not None else f"{name} is left out: {reason}")


def _plot(path: Path, station: StationFile, seen: dict[str, _Seen]) -> None:
    """The sky with the first passes.  UsageError: the picture cannot be written."""
    from acu_daemon.report.sky_plot import SkyTrack, plot_sky  # matplotlib is slow to load

    rows = [(name, one, of.propagators[one]) for name, of in seen.items() for one in of.passes]
    tracks = []
    for name, one, propagator in sorted(rows, key=lambda row: row[1].rise_tai_s)[:MOST_TRACKS]:
        tai_s = np.linspace(one.rise_tai_s, one.set_tai_s, TRACK_POINTS)
        look = apparent_at(propagator, tai_s, station.site)
        label = f"{name} {utc_text(one.rise_tai_s, 0)[5:16].replace('T', ' ')}"
        tracks.append(SkyTrack(label, tai_s, look.az_deg, look.el_deg))
    lowest_deg = station.station.min_elevation_deg
    try:
        plot_sky(path, station.bounds, tracks, lowest_deg, f"The sky over {station.station.name}")
    except OSError as error:
        raise UsageError(f"--plot {path}: {error.strerror}") from None


def _search(config: Path, name: str, start_tai_s: float, end_tai_s: float) -> _Seen:
    """One satellite's passes.  AcuDaemonError: its files or elements cannot be used."""
    target = load_target(config, name, start_tai_s, is_strict=False)
    propagator, site = target.elements.propagator, target.station.site
    has_spans = is_ephemeris(propagator)
    if not has_spans and not any(end >= start_tai_s and start <= end_tai_s for start, end in spans_tai_s(propagator)):
        propagator.states_teme(np.array([start_tai_s]))  # says why it has none
        raise OrbitError(f"{target.elements.label}: the search lies outside what is known of it")
    said = [f"warning: {text}" for text in [*target.elements.errors, *target.elements.warnings]]
    if target.elements.choice:
        said.append(f"note: {target.elements.choice}")
    if since := beginning(target, start_tai_s):
        said.append(f"warning: {name}: {since}")
    if until := ending(target, end_tai_s):
        said.append(f"warning: {name}: {until}, no pass is looked for after that")
    lowest_deg = target.station.station.min_elevation_deg
    by_epoch = passes_by_epoch(config, name, target, start_tai_s, end_tai_s)
    found = [one for _, of_set in by_epoch for one in of_set]
    if len(by_epoch) > 1:
        used = ", ".join(f"{len(of_set)} of {utc_text(one.elements.epoch_tai_s, 0)}" for one, of_set in by_epoch)
        said.append(f"note: {name}: each pass is computed from the set nearest to it: {used}")
    said += [f"warning: {name}: {text}" for text in gaps(target, start_tai_s, end_tai_s) + cut_passes(target, found)]
    is_told = bool(found) or bool(until) or has_spans
    limits = target.station.acu.azimuth.limits(), target.station.acu.elevation.limits()
    beyond = {
        one: beyond_limits(of.elements.propagator, site, one, *limits) for of, of_set in by_epoch for one in of_set
    }
    bounds = target.station.bounds
    of_pass = {one: of.elements.propagator for of, of_set in by_epoch for one in of_set}
    epochs_tai_s = {one: of.elements.epoch_tai_s for of, of_set in by_epoch for one in of_set}
    return _Seen(
        found,
        epochs_tai_s,
        beyond,
        {one: sun_outages(of, site, bounds.sun, one) for one, of in of_pass.items()},
        {one: kept_out(of, site, bounds.keep_outs, one) for one, of in of_pass.items()},
        of_pass,
        "" if is_told else why_none(propagator, site, start_tai_s, end_tai_s, lowest_deg),
        said,
    )


def passes_by_epoch(
    config: Path, name: str, target: Target, start_tai_s: float, end_tai_s: float
) -> list[tuple[Target, list[Pass]]]:
    """The passes, each from the set of the file that is nearest to its rise; by set, in order."""
    lowest_deg = target.station.station.min_elevation_deg
    by_epoch: list[tuple[Target, list[Pass]]] = []
    from_tai_s = start_tai_s
    while True:
        elements = target.elements
        found = find_passes(elements.propagator, target.station.site, from_tai_s, end_tai_s, lowest_deg)
        epochs_tai_s = elements.epochs_tai_s or (elements.epoch_tai_s,)
        nearer_tai_s = [nearest_epoch_tai_s(epochs_tai_s, max(one.rise_tai_s, start_tai_s)) for one in found]
        count = next((k for k, one in enumerate(nearer_tai_s) if one > elements.epoch_tai_s), len(found))
        if count or not by_epoch:
            by_epoch.append((target, found[:count]))
        if count == len(found):
            return by_epoch
        from_tai_s = found[count - 1].set_tai_s + 1.0 if count else from_tai_s
        target = load_target(config, name, start_tai_s, is_strict=False, at_tai_s=nearer_tai_s[count])
        if target.elements.epoch_tai_s <= elements.epoch_tai_s:  # of several sources this is the better one all along
            by_epoch[-1] = by_epoch[-1][0], by_epoch[-1][1] + found[count:]
            return by_epoch


def _show(
    seen: dict[str, _Seen], omitted: dict[str, str], start_tai_s: float, end_tai_s: float, *, as_json: bool
) -> None:
    rows = [(name, one) for name, of in seen.items() for one in of.passes]
    rows.sort(key=lambda row: row[1].rise_tai_s)
    if as_json:
        passes = [
            _as_json(name, one, start_tai_s, end_tai_s)
            | {"elements_epoch_utc": utc_text(seen[name].epochs_tai_s[one])}
            | _beyond(seen[name].beyond[one])
            | _outages(seen[name].sun[one], seen[name].zones[one])
            for name, one in rows
        ]
        left_out = [{"satellite": name, "reason": reason} for name, reason in omitted.items()]
        typer.echo(json.dumps({"passes": passes, "omitted": left_out} if omitted else passes, indent=1))
        return
    if not seen:
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
        of = seen[name]
        hidden = (_hidden_text(*span) for span in one.hidden_tai_s)
        outages = map(str, (*of.sun[one], *of.zones[one]))
        said = (open_ends(one, start_tai_s, end_tai_s), *hidden, *outages, *map(_beyond_text, of.beyond[one]))
        notes = [text for text in said if text]
        typer.echo(f"{_as_text(name, one)}  {'; '.join(notes)}".rstrip())
    for name, of in seen.items():
        if of.why_none:
            typer.echo(f"{name}: {of.why_none}")
    if any(not of.why_none for of in seen.values()) and not rows:
        days = (end_tai_s - start_tai_s) / DAY_S
        typer.echo(f"no pass within {days:g} days; try --days {min(60, 3 * days):g}")


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


def _hidden_text(from_tai_s: float, to_tai_s: float) -> str:
    return f"behind the mask {to_tai_s - from_tai_s:.0f} s from {utc_text(from_tai_s, 0)[11:19]}"


def _beyond_text(one: OutOfReach) -> str:
    return f"{one.why} {one.duration_s:.0f} s from {utc_text(one.from_tai_s, 0)[11:19]}"


def _beyond(beyond: tuple[OutOfReach, ...]) -> dict[str, Any]:
    return {
        "beyond_limits": [
            {
                "axis": one.axis,
                "from_utc": utc_text(one.from_tai_s),
                "to_utc": utc_text(one.to_tai_s),
                "duration_s": round(one.duration_s, 3),
                "why": one.why,
            }
            for one in beyond
        ]
    }


def _outages(sun: tuple[SunOutage, ...], zones: tuple[KeptOut, ...]) -> dict[str, Any]:
    return {
        "sun": [
            _span(one.from_tai_s, one.to_tai_s)
            | {"least_deg": round(one.least_deg, 3), "least_utc": utc_text(one.least_tai_s)}
            for one in sun
        ],
        "keep_outs": [_span(one.from_tai_s, one.to_tai_s) | {"name": one.name} for one in zones],
    }


def _span(from_tai_s: float, to_tai_s: float) -> dict[str, Any]:
    return {
        "from_utc": utc_text(from_tai_s),
        "to_utc": utc_text(to_tai_s),
        "duration_s": round(to_tai_s - from_tai_s, 3),
    }


def _as_json(name: str, one: Pass, start_tai_s: float, end_tai_s: float) -> dict[str, Any]:
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
        "does_not_rise": one.rise_tai_s == start_tai_s,
        "does_not_set": one.set_tai_s == end_tai_s,
        "hidden": [_span(*span) for span in one.hidden_tai_s],
    }
