"""`acu-daemon plan`: one pass as it will be flown, before it: text, data, picture."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from math import cos, degrees, radians
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from acu_daemon.cli.options import Config, Satellite, Target, coming_pass, load_target, parse_utc
from acu_daemon.cli.outputs import refuse_no_picture, refuse_unwritable, write_ascii
from acu_daemon.config.to_settings import keyhole_rules, leaning, planned_tilt
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.approach import ACQUIRE_LEAD_S, BEGIN_S, way_s
from acu_daemon.control.tracking.expected_way import ExpectedWay, expected_way
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.edge.clock import SystemClock
from acu_daemon.model import Pass, ZenithCrossing
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.outage import kept_out, sun_outages
from acu_daemon.pointing.reach import zenith_text
from acu_daemon.pointing.tilt import Tilt
from acu_daemon.pointing.wrap import middle_deg

ANGLES = ("path_az_deg", "path_el_deg", "antenna_az_deg", "antenna_el_deg", "off_deg")


@dataclass(frozen=True, slots=True)
class _Planned:
    """A pass, its plan, and what comes of it."""

    target: Target
    coming: Pass
    plan: PassPlan
    way: ExpectedWay
    present_deg: tuple[float, float]  # where the antenna is taken to stand
    tilt: Tilt | None  # of the pedestal; None: it has none that is moved

    @property
    def half_beam_deg(self) -> float:
        return self.target.station.receiver.beamwidth_deg / 2.0

    @property
    def lead_s(self) -> float:
        """How long before the rise the antenna sets out."""
        station = self.target.station
        az_s = way_s(self.plan.start_az_deg - self.present_deg[0], station.bounds.azimuth)
        el_s = way_s(self.plan.start_el_deg - self.present_deg[1], station.bounds.elevation)
        return max(station.tracking.preposition_s, BEGIN_S + max(az_s, el_s) + ACQUIRE_LEAD_S)


def command(
    config: Config,
    satellite: Satellite,
    at: Annotated[
        str | None,
        typer.Option("--at", metavar="UTC", help="Plan the pass in progress then, else the next one.  Default: now."),
    ] = None,
    azimuth: Annotated[
        float | None,
        typer.Option(
            "--azimuth",
            metavar="DEG",
            help="Where the antenna stands, continuous, as its limits count it.  Default: the middle of its range.",
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="FILE", help="Draw sky, axes and expected error into a PNG, SVG or PDF."),
    ] = None,
    as_json: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the plan and its path, each second, as JSON.")
    ] = None,
) -> None:
    """Show how a pass will be flown, before it: turn of the cable, way there, stops, zenith, sun, mask, expected loss.

    Nothing is asked of the ACU.  docs/pass-plan.md says what is chosen, and why.
    """
    refuse_unwritable(as_json)
    if plot is not None:
        refuse_no_picture(plot)
    now_tai_s = SystemClock().tai_s() if at is None else parse_utc("--at", at)
    target = load_target(config, satellite, now_tai_s)
    planned = _planned(target, coming_pass(target, now_tai_s), now_tai_s, azimuth)
    for warning in target.elements.warnings:
        typer.echo(f"warning: {warning}", err=True)
    for line in _lines(planned):
        typer.echo(line)
    if as_json is not None:
        write_ascii(as_json, json.dumps(_data(planned), indent=1) + "\n")
    if plot is not None:
        _draw(plot, planned)


def _planned(target: Target, coming: Pass, now_tai_s: float, present_az_deg: float | None) -> _Planned:
    station, propagator = target.station, target.elements.propagator
    bounds, rules = station.bounds, keyhole_rules(station)
    tilt = planned_tilt(station, propagator, coming)
    site = leaning(station.site, tilt)
    present = (middle_deg(bounds.azimuth) if present_az_deg is None else present_az_deg, bounds.elevation.min_deg)
    plan = plan_pass(
        *(propagator, site, coming, present[0], bounds.azimuth, now_tai_s),
        elevation=bounds.elevation,
        keyhole=rules,
    )
    return _Planned(target, coming, plan, expected_way(propagator, site, plan, bounds, rules), present, tilt)


def _lines(planned: _Planned) -> Iterator[str]:
    """The plan in words."""
    coming, plan, way, target = planned.coming, planned.plan, planned.way, planned.target
    rise, end = utc_text(coming.rise_tai_s, 0), utc_text(coming.set_tai_s, 0)
    yield f"{target.elements.label} over {target.station.station.name}"
    yield f"pass       {rise} to {end}, up to {coming.culmination_el_deg:.2f} deg"
    turns = plan.start_az_deg - way.antenna_az_deg[-1]
    from_to = f"azimuth {plan.start_az_deg:.2f} to {way.antenna_az_deg[-1]:.2f} deg ({-turns:+.1f})"
    yield f"turn       {from_to}, {plan.note or 'holds the whole pass'}"
    way_deg = plan.start_az_deg - planned.present_deg[0]
    if plan.start_tai_s > coming.rise_tai_s:
        when = f"{plan.start_tai_s - coming.rise_tai_s:.0f} s after the rise"
    else:
        when = f"the antenna sets out {utc_text(coming.rise_tai_s - planned.lead_s, 0)}"
    yield f"way there  {way_deg:+.1f} deg of azimuth from {planned.present_deg[0]:g}; {when}"
    if planned.tilt is not None:
        yield f"tilt       {planned.tilt.angle_deg:+.1f} deg towards {planned.tilt.towards_deg:g} deg"
    for change in plan.unwindings:
        yield f"unwinding  {change.by_deg:+.0f} deg from {utc_text(change.tai_s, 0)} on, {change.for_s:.0f} s"
    if plan.crossing is not None:
        other = ", the other way round because of the stops" if plan.zenith_turn else ""
        yield f"zenith     {zenith_text(plan.crossing)}{other}"
    yield from (f"{one.axis:10} {one}" for one in plan.beyond)
    yield from _around(planned)
    worst, out_s = float(way.off_deg.max()), way.out_s(planned.half_beam_deg)
    yield f"expected   at most {worst:.2f} deg off, {out_s:.1f} s out of half a beam ({planned.half_beam_deg:g} deg)"


def _around(planned: _Planned) -> Iterator[str]:
    """What the pass meets: sun, keep-out zones, hills."""
    propagator, station = planned.target.elements.propagator, planned.target.station
    site, bounds = station.site, station.bounds
    for outage in sun_outages(propagator, site, bounds.sun, planned.coming):
        yield f"sun        {outage}"
    for kept in kept_out(propagator, site, bounds.keep_outs, planned.coming):
        yield f"keep-out   {kept}"
    for begin, end in planned.coming.hidden_tai_s:
        yield f"hidden     behind the mask from {utc_text(begin, 0)} on, {end - begin:.0f} s"


def _data(planned: _Planned) -> dict[str, Any]:
    coming, plan, way = planned.coming, planned.plan, planned.way
    seconds = slice(0, None, max(1, round(1.0 / float(way.tai_s[1] - way.tai_s[0]))))
    return {
        "satellite": planned.target.elements.label,
        "station": planned.target.station.station.name,
        "rise_utc": utc_text(coming.rise_tai_s, 3),
        "set_utc": utc_text(coming.set_tai_s, 3),
        "culmination_deg": round(coming.culmination_el_deg, 4),
        "start_utc": utc_text(plan.start_tai_s, 3),
        "start_az_deg": round(plan.start_az_deg, 4),
        "start_el_deg": round(plan.start_el_deg, 4),
        "lead_s": round(planned.lead_s, 1),
        "tilt_deg": None if planned.tilt is None else planned.tilt.angle_deg,
        "note": plan.note,
        "unwindings": [
            {"utc": utc_text(one.tai_s, 1), "by_deg": one.by_deg, "for_s": round(one.for_s, 1)}
            for one in plan.unwindings
        ],
        "zenith": None if plan.crossing is None else _crossing_data(plan.crossing),
        "beyond": [str(one) for one in plan.beyond],
        "largest_error_deg": round(float(way.off_deg.max()), 4),
        "out_of_beam_s": round(way.out_s(planned.half_beam_deg), 1),
        "path": [
            {
                "utc": utc_text(float(tai_s), 1),
                **{name: round(float(x), 4) for name, x in zip(ANGLES, row, strict=True)},
            }
            for tai_s, *row in zip(way.tai_s[seconds], *(getattr(way, name)[seconds] for name in ANGLES), strict=True)
        ],
    }


def _crossing_data(crossing: ZenithCrossing) -> dict[str, Any]:
    """Its fields, times as UTC."""
    return {
        key.replace("_tai_s", "_utc"): utc_text(value, 2) if key.endswith("_tai_s") and value is not None else value
        for key, value in asdict(crossing).items()
    }


def _draw(path: Path, planned: _Planned) -> None:
    from acu_daemon.report.pass_plan_plot import PlannedPicture, plot_plan

    way, station, start = planned.way, planned.target.station, planned.plan.start_tai_s
    bounds, skyline = station.bounds, station.bounds.skyline
    around = np.linspace(0.0, 360.0, 721)
    sun = None
    if bounds.sun is not None:
        sun = (*bounds.sun.direction_deg(planned.coming.culmination_tai_s), bounds.sun.radius_deg)
    on_sky = np.vectorize(replace(bounds, tilt=planned.tilt).beam_deg, otypes=[np.float64, np.float64])
    sky_path, sky_antenna = on_sky(way.path_az_deg, way.path_el_deg), on_sky(way.antenna_az_deg, way.antenna_el_deg)
    sky_deg_s = float(np.abs(np.gradient(sky_path[1], way.tai_s)).max())
    share = sky_deg_s / bounds.azimuth.max_rate_deg_s
    is_keyhole = 0.0 < share < cos(radians(60.0))
    spans = [("unwinding", one.tai_s - start, one.tai_s - start + one.for_s) for one in planned.plan.unwindings]
    if (crossing := planned.plan.crossing) is not None:
        spans.append(("zenith", crossing.departure_tai_s - start, crossing.return_tai_s - start))
    title = f"{planned.target.elements.label} over {station.station.name}, {utc_text(planned.coming.rise_tai_s, 0)}"
    worst = f"at most {way.off_deg.max():.2f} deg off, {way.out_s(planned.half_beam_deg):.1f} s out of the beam"
    plot_plan(
        path,
        PlannedPicture(
            *(way.tai_s - start, way.path_az_deg, way.path_el_deg, way.antenna_az_deg, way.antenna_el_deg, way.off_deg),
            sky_path_deg=sky_path,
            sky_antenna_deg=sky_antenna,
            azimuth=bounds.azimuth,
            elevation=bounds.elevation,
            half_beam_deg=planned.half_beam_deg,
            min_elevation_deg=station.station.min_elevation_deg,
            hills=None if skyline is None else (around, np.maximum(skyline.heights_deg(around), 0.0)),
            sun_deg=sun,
            keyhole=on_sky(around, np.full(around.size, 90.0 - degrees(share))) if is_keyhole else None,
            spans=spans,
            begins=utc_text(start, 0),
        ),
        f"{title}: {worst}",
    )
