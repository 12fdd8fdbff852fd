"""`acu-daemon check`: go or no-go before a pass, a line per check."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from acu_daemon.cli.check_acu import acu_findings
from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.cli.check_hooks import hooks_finding
from acu_daemon.cli.check_running import held_finding, left_behind, running_finding
from acu_daemon.cli.check_satellite import satellite_findings
from acu_daemon.cli.options import (
    Config,
    antenna_of,
    parse_utc,
    station_at,
)
from acu_daemon.cli.own_daemon import find_daemon
from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.config.load import load_station, satellite_names
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import driver_of
from acu_daemon.edge.clock import SystemClock, is_clock_synchronised, system_tai_s
from acu_daemon.edge.clock_sense import before_release
from acu_daemon.edge.earth_orientation_file import at_date
from acu_daemon.edge.elements_status import standings
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.leap_seconds_file import leap_seconds_told
from acu_daemon.edge.link import check_rate, make_link
from acu_daemon.edge.state_directory import older_folders, state_path
from acu_daemon.edge.weather import WeatherReader
from acu_daemon.errors import UsageError
from acu_daemon.model import Site
from acu_daemon.orbit.sun import RISEN_EL_DEG, sun_direction_deg
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import wrap_180


def command(
    config: Config,
    satellite: Annotated[
        str | None, typer.Option("--satellite", help="Also this satellite's elements and next pass.  Default: all.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            "--at", metavar="UTC", help="Check elements and next pass for a rehearsal at this time.  Default: now."
        ),
    ] = None,
    running: Annotated[
        bool, typer.Option("--running", help="Only look whether the daemon that runs here ticks (for health checks).")
    ] = False,
    state: Annotated[Path | None, typer.Option("--state", metavar="DIR", help="The daemon's --state.")] = None,
    rehearsal: Annotated[
        bool, typer.Option("--rehearsal", help="With --running: look at the daemon that runs as a rehearsal (--at).")
    ] = False,
) -> None:
    """Check everything a pass needs: files, clock, elements, next pass, cable wrap, axes, link, ACU.  Moves nothing.

    A line per check, GO, WARN or NO-GO; exit status 1 if any is NO-GO.  While a daemon runs it holds the ACU: then what
    it sees is shown in place of what the ACU would be asked.
    """
    now_tai_s = SystemClock().tai_s() if at is None else parse_utc("--at", at)
    worst = GO
    found = findings(config, satellite, now_tai_s, state)
    for finding in [running_finding(config, state, is_rehearsal=rehearsal)] if running else found:
        typer.echo(f"{finding.verdict:6} {finding.what:22} {'; '.join(finding.detail.splitlines())}")
        if finding.verdict == NO_GO or (finding.verdict == WARN and worst == GO):
            worst = finding.verdict
    typer.echo(f"{worst}: " + {GO: "ready", WARN: "ready, with warnings", NO_GO: "not ready"}[worst])
    if worst == NO_GO:
        raise typer.Exit(1)


def findings(
    config: Path, satellite: str | None, now_tai_s: float, state: Path | None, acu: str | None = None
) -> Iterator[Finding]:
    """Everything that the command shows, a line after the other.  acu: where the ACU is asked; None: at acu.url."""
    try:
        station, earth = at_date(load_station(config), config, now_tai_s)
    except UsageError as error:
        yield Finding(NO_GO, "station.toml", str(error))
        return
    asked = station_at(station, acu)
    yield Finding(GO, "station.toml", f"{station.station.name}, ACU at {asked.acu.url}")
    yield Finding(GO, "place", place_text(station.site, now_tai_s))
    if station.safety.arm == "manual":
        yield Finding(WARN, "arming", '[safety] arm = "manual": the daemon writes nothing until a person arms it')
    yield from left_behind(config, station, state)
    yield clock_finding()
    told, is_to_be_seen_to = leap_seconds_told(now_tai_s)
    yield Finding(WARN if is_to_be_seen_to else GO, "leap seconds", told)
    if earth.about or earth.warning:
        said = "; ".join(text for text in (earth.about, earth.warning) if text)
        yield Finding(WARN if earth.warning else GO, "Earth orientation", said)
    yield from _air(config, station, now_tai_s)
    if bounds := station.envelope.told():
        yield Finding(GO, "envelope", bounds)
    if (hooks := hooks_finding(station.hooks)) is not None:
        yield hooks
    yield from sources_findings(config, station.elements, now_tai_s)
    directory, antenna = state_path(state, is_rehearsal=False), antenna_of(station)
    folders = (antenna.folder(directory), *older_folders(directory, antenna))
    names = [satellite] if satellite else satellite_names(config)
    if not names:
        yield Finding(NO_GO, "satellites", f"{config}/satellites holds no satellite; put a NAME.toml there")
    for name in names:
        yield from satellite_findings(config, name, now_tai_s, folders)
    try:
        link = make_link(asked.acu.url)
        check_rate(link, driver_of(station), station.acu.period_s, station.acu.device_delay_s)
        yield Finding(GO, "line rate", f"{link.description} carries {1 / station.acu.period_s:g} writes a second")
    except UsageError as error:
        yield Finding(NO_GO, "line rate", str(error))
        return
    if (daemon := find_daemon(link.description, state)) is not None:
        yield held_finding(daemon)
        if daemon.seen is not None:
            return
    for finding in run_loop(acu_findings, asked):
        if finding.verdict == NO_GO and "another client holds" in finding.detail:
            hint = "; if it is an acu-daemon, name its state directory with --state"
            yield replace(finding, verdict=WARN) if daemon else replace(finding, detail=finding.detail + hint)
        else:
            yield finding


def _air(config: Path, station: StationFile, now_tai_s: float) -> Iterator[Finding]:
    """The air in force, and what is wrong with the weather of the file that [atmosphere] names."""
    reader = WeatherReader(station.atmosphere, station.site.station, config)
    if air := reader.now(now_tai_s).told(station.site.station):
        yield Finding(WARN if reader.problem else GO, "air", "; ".join(one for one in (air, reader.problem) if one))


def sources_findings(config: Path, section: ElementsSourcesSection, now_tai_s: float) -> Iterator[Finding]:
    """How the station's sources of elements stand: never a reason not to track, the elements' own age is."""
    for one in standings(config, section, now_tai_s):
        yield Finding(WARN if one.is_problem else GO, "elements source", f"{one.source}: {one.text}")


def place_text(site: Site, now_tai_s: float) -> str:
    """The position as a place, and where the sun stands there: a wrong sign is seen by looking out of the window."""
    station = site.station
    east_deg = wrap_180(station.longitude_deg)
    latitude = f"{abs(station.latitude_deg):g} deg {'north' if station.latitude_deg >= 0 else 'south'}"
    longitude = f"{abs(east_deg):g} deg {'east' if east_deg >= 0 else 'west'}"
    az_deg, el_deg = (float(angle[0]) for angle in sun_direction_deg(np.array([now_tai_s]), site))
    light = "day" if el_deg > RISEN_EL_DEG else "night"
    when = (
        f"at {utc_text(now_tai_s, 0)} it is {light} there, the sun at azimuth {az_deg:.1f}, elevation {el_deg:.1f} deg"
    )
    return f"{latitude}, {longitude}, {station.height_m:g} m; {when}"


def clock_finding() -> Finding:
    """Whether the system clock can be right, and is synchronised."""
    if wrong := before_release(system_tai_s()):
        return Finding(NO_GO, "clock", f"{wrong}; `run` waits until then")
    is_synchronised = is_clock_synchronised()
    if is_synchronised:
        return Finding(GO, "clock", "synchronised")
    if is_synchronised is None:
        return Finding(WARN, "clock", "neither the kernel nor systemd says whether it is synchronised; look yourself")
    return Finding(WARN, "clock", "not synchronised; start chrony or ntpd: 0.1 s is up to 0.1 deg on a low orbit")
