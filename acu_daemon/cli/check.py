"""`acu-daemon check`: go or no-go before a pass, a line per check."""

import asyncio
import contextlib
import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from acu_daemon.acu.commands import AcuMode, Identify, ReadFaults
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, FaultReport, Reply
from acu_daemon.cli.options import (
    NEXT_PASS_DAYS,
    Config,
    Target,
    antenna_of,
    ending,
    load_target,
    longest_lead,
    nearest_to_pass,
    not_covered,
    open_ends,
    parse_utc,
)
from acu_daemon.cli.own_daemon import OwnDaemon, find_daemon
from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.config.load import load_station, satellite_names
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import driver_of
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.daemon.health import status_line
from acu_daemon.daemon.port import AcuPort
from acu_daemon.daemon.verdict import Level, alarms, verdict
from acu_daemon.edge.clock import SystemClock, is_clock_synchronised, system_tai_s
from acu_daemon.edge.clock_sense import before_elements, before_release
from acu_daemon.edge.earth_orientation_file import at_date
from acu_daemon.edge.elements_status import standings
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.latch import ADVICE, DISARMED, LATCH
from acu_daemon.edge.leap_seconds_file import leap_seconds_told
from acu_daemon.edge.link import check_rate, make_link
from acu_daemon.edge.state_directory import SNAPSHOT, choice_text, folders_in, older_folders, state_path, with_choice
from acu_daemon.edge.weather import WeatherReader
from acu_daemon.errors import AcuDaemonError, LinkError, OrbitError, UsageError
from acu_daemon.model import Pass, Site
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import is_ephemeris
from acu_daemon.orbit.sun import RISEN_EL_DEG, sun_direction_deg
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.orbit.visibility import why_none
from acu_daemon.pointing.outage import kept_out, sun_outages
from acu_daemon.pointing.way_round import why_not_stow
from acu_daemon.pointing.wrap import middle_deg, nearest_turn
from acu_daemon.units import DAY_S, wrap_180

ACU_S = 3.0  # for all that is asked of it: a reply or two may be lost
HEALTHY_AGE_S = 5.0
GO, WARN, NO_GO = "GO", "WARN", "NO-GO"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the check."""

    verdict: str
    what: str
    detail: str


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
    found = _findings(config, satellite, now_tai_s, state)
    for finding in [_running(config, state, is_rehearsal=rehearsal)] if running else found:
        typer.echo(f"{finding.verdict:6} {finding.what:22} {'; '.join(finding.detail.splitlines())}")
        if finding.verdict == NO_GO or (finding.verdict == WARN and worst == GO):
            worst = finding.verdict
    typer.echo(f"{worst}: " + {GO: "ready", WARN: "ready, with warnings", NO_GO: "not ready"}[worst])
    if worst == NO_GO:
        raise typer.Exit(1)


def _findings(config: Path, satellite: str | None, now_tai_s: float, state: Path | None) -> Iterator[Finding]:
    try:
        station, earth = at_date(load_station(config), config, now_tai_s)
    except UsageError as error:
        yield Finding(NO_GO, "station.toml", str(error))
        return
    yield Finding(GO, "station.toml", f"{station.station.name}, ACU at {station.acu.url}")
    yield Finding(GO, "place", place_text(station.site, now_tai_s))
    if station.safety.arm == "manual":
        yield Finding(WARN, "arming", '[safety] arm = "manual": the daemon writes nothing until a person arms it')
    yield from _left_behind(config, station, state)
    yield clock_finding()
    told, is_to_be_seen_to = leap_seconds_told(now_tai_s)
    yield Finding(WARN if is_to_be_seen_to else GO, "leap seconds", told)
    if earth.about or earth.warning:
        said = "; ".join(text for text in (earth.about, earth.warning) if text)
        yield Finding(WARN if earth.warning else GO, "Earth orientation", said)
    yield from _air(config, station, now_tai_s)
    yield from sources_findings(config, station.elements, now_tai_s)
    directory, antenna = state_path(state, is_rehearsal=False), antenna_of(station)
    folders = (antenna.folder(directory), *older_folders(directory, antenna))
    names = [satellite] if satellite else satellite_names(config)
    if not names:
        yield Finding(NO_GO, "satellites", f"{config}/satellites holds no satellite; put a NAME.toml there")
    for name in names:
        yield from _satellite(config, name, now_tai_s, folders)
    try:
        link = make_link(station.acu.url)
        check_rate(link, driver_of(station), station.acu.period_s, station.acu.device_delay_s)
        yield Finding(GO, "line rate", f"{link.description} carries {1 / station.acu.period_s:g} writes a second")
    except UsageError as error:
        yield Finding(NO_GO, "line rate", str(error))
        return
    if (daemon := find_daemon(link.description, state)) is not None:
        yield _held(daemon)
        if daemon.seen is not None:
            return
    for finding in run_loop(_acu, station):
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


def _held(daemon: OwnDaemon) -> Finding:
    """A daemon that tracks has the ACU for itself: what it sees of it stands for what would be asked."""
    if daemon.seen is None:
        return Finding(WARN, "running daemon", f"one runs with {daemon.directory}: {daemon.problem}")
    seen = daemon.seen
    is_well = verdict(seen).level < Level.WATCH and not alarms(seen)
    about = f"a daemon runs and holds the ACU, which is not asked: {status_line(seen)}; {verdict(seen).why}"
    return Finding(GO if is_well else WARN, "running daemon", f"{about} ({daemon.directory})")


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


def _left_behind(config: Path, station: StationFile, state: Path | None) -> Iterator[Finding]:
    """What of the last run forbids the next one to move."""
    directory, antenna = state_path(state, is_rehearsal=False), antenna_of(station)
    advice = {name: with_choice(text, choice_text(config, state, is_rehearsal=False)) for name, text in ADVICE.items()}
    for grade, name in ((NO_GO, LATCH), (WARN, DISARMED)):
        for folder in (antenna.folder(directory), *older_folders(directory, antenna)):
            if os.access(folder / name, os.F_OK):  # one that is not ours to look into says nothing
                yield Finding(grade, name, f"{folder / name} is there: {advice[name]}")


def _snapshot(config: Path, directory: Path) -> Path:
    """The newest one of the configuration's antenna, by this or an older name; of any, where it cannot be read."""
    folders = [directory]
    with contextlib.suppress(OSError):
        folders = folders_in(directory)
    with contextlib.suppress(UsageError):
        antenna = antenna_of(load_station(config))
        folders = [antenna.folder(directory), *older_folders(directory, antenna)]
    ages = {}
    for folder in folders:
        with contextlib.suppress(OSError):
            ages[folder / SNAPSHOT] = (folder / SNAPSHOT).stat().st_mtime
    return max(ages, key=lambda path: ages[path], default=folders[0] / SNAPSHOT)


def _running(config: Path, state: Path | None, *, is_rehearsal: bool) -> Finding:
    path = _snapshot(config, state_path(state, is_rehearsal=is_rehearsal))
    try:
        age_s = time.time() - path.stat().st_mtime
    except OSError:
        return Finding(NO_GO, "running daemon", f"{path}: no daemon has written it")
    verdict = GO if age_s < HEALTHY_AGE_S else NO_GO
    alarms = _alarms(path)
    detail = "; ".join([f"{path}: written {age_s:.1f} s ago", *alarms])
    return Finding(WARN if alarms and verdict == GO else verdict, "running daemon", detail)


def _alarms(snapshot: Path) -> list[str]:
    """What a person should see to: a latched axis, a daemon that was disarmed, the clock, an encoder, a disk."""
    try:
        seen = json.loads(snapshot.read_text(encoding="utf-8"))
        latch, disarmed_by = seen.get("latch", ""), seen.get("disarmed_by", "")
        names = ("clock_alarm", "encoder_problem", "files_alarm", "turn_alarm", "limit_alarm", "line_alarm")
        others = [seen.get(name, "") for name in names]
    except (OSError, ValueError, AttributeError):
        return []
    texts = [latch and f"latched: {latch}", disarmed_by and f"disarmed by {disarmed_by}", *others]
    return [text for text in texts if text]


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


def _satellite(config: Path, name: str, now_tai_s: float, folders: tuple[Path, ...]) -> Iterator[Finding]:
    try:
        target = load_target(config, name, now_tai_s, is_strict=False, folders=folders)
        target = nearest_to_pass(config, name, target, now_tai_s, is_strict=False, folders=folders)
    except AcuDaemonError as error:
        yield Finding(NO_GO, f"{name}: files", str(error))
        return
    elements = target.elements
    age = f"epoch {utc_text(elements.epoch_tai_s, 0)}, {(now_tai_s - elements.epoch_tai_s) / DAY_S:.1f} days old"
    is_now = abs(now_tai_s - system_tai_s()) < DAY_S  # not a rehearsal's time
    if is_now and (wrong := before_elements(elements, now_tai_s, is_clock_synchronised())):
        yield Finding(NO_GO, f"{name}: elements", f"{wrong}; `run` waits until then")
        return
    if elements.errors:
        yield Finding(NO_GO, f"{name}: elements", "; ".join(elements.errors))
        return
    told = [*elements.warnings, age, *([elements.choice] if elements.choice else [])]
    yield Finding(
        WARN if elements.warnings else GO,
        f"{name}: elements",
        "; ".join(told),
    )
    try:
        yield from _next_pass(name, target, now_tai_s)
    except OrbitError as error:
        yield Finding(NO_GO, f"{name}: next pass", str(error))


def _next_pass(name: str, target: Target, now_tai_s: float) -> Iterator[Finding]:
    station = target.station
    lowest_deg = station.station.min_elevation_deg
    propagator = target.elements.propagator
    passes = find_passes(propagator, station.site, now_tai_s, now_tai_s + DAY_S, lowest_deg)
    has_spans = is_ephemeris(propagator)
    if not passes:
        until = ending(target, now_tai_s + DAY_S)
        why = "" if until else why_none(propagator, station.site, now_tai_s, now_tai_s + DAY_S, lowest_deg)
        texts = [f"none above {lowest_deg:g} deg within a day", why, until]
        verdict = NO_GO if until and not has_spans else WARN
        yield Finding(verdict, f"{name}: next pass", "; ".join(text for text in texts if text))
        return
    coming = passes[0]
    if lacking := not_covered(target, coming, now_tai_s):
        yield Finding(NO_GO, f"{name}: next pass", lacking)
        return
    lasts = open_ends(coming, now_tai_s, now_tai_s + DAY_S) or f"{coming.duration_s / 60:.1f} min"
    hidden_s = sum(end - begin for begin, end in coming.hidden_tai_s)
    hidden = f", {hidden_s:.0f} s of it behind the mask" if hidden_s else ""
    yield Finding(
        GO,
        f"{name}: next pass",
        f"{utc_text(coming.rise_tai_s, 0)}, {lasts}, up to {coming.culmination_el_deg:.1f} deg{hidden}",
    )
    if not has_spans and (until := ending(target, now_tai_s + NEXT_PASS_DAYS * DAY_S)):
        yield Finding(WARN, f"{name}: decay", until)
    azimuth, elevation = station.acu.azimuth.limits(), station.acu.elevation.limits()
    start_tai_s = coming.rise_tai_s
    plan = plan_pass(propagator, station.site, coming, middle_deg(azimuth), azimuth, start_tai_s, elevation=elevation)
    if plan.note:
        yield Finding(WARN, f"{name}: cable wrap", plan.note)
    else:
        yield Finding(GO, f"{name}: cable wrap", f"the pass is held from azimuth {plan.start_az_deg:.1f} deg on")
    for one in plan.beyond:
        yield Finding(WARN, f"{name}: {one.axis}", str(one))
    yield from _outages(name, target, coming)
    lead_s, left_s = longest_lead(target), coming.rise_tai_s - now_tai_s
    if 0.0 < left_s < lead_s:
        why = f"the rise is in {left_s:.0f} s, from the far end of its drives the antenna needs {lead_s:.0f} s"
        yield Finding(WARN, f"{name}: approach", f"{why}: it may be late, `run` says by how much")


def _outages(name: str, target: Target, coming: Pass) -> Iterator[Finding]:
    """The sun and keep-out zones in a pass."""
    bounds, policy = target.station.bounds, target.station.envelope.sun_policy
    propagator, site = target.elements.propagator, target.station.site
    led = "; it is led around" if policy == "avoid" else "; it is followed (sun_policy)"
    for outage in sun_outages(propagator, site, bounds.sun, coming):
        yield Finding(WARN, f"{name}: sun", f"{outage}{led}")
    for kept in kept_out(propagator, site, bounds.keep_outs, coming):
        yield Finding(WARN, f"{name}: keep-out", f"{kept}; it is led around")


async def _acu(station: StationFile) -> list[Finding]:
    """Ask identity, status and faults: nothing that moves or changes the ACU."""
    acu = station.acu
    link, clock = make_link(acu.url), SystemClock()
    port = AcuPort(link, clock, driver_of(station), acu.period_s, acu.device_delay_s)
    try:
        await port.open(tries_all=True)
        async with asyncio.timeout(ACU_S):
            first = port.take_first()
            status = first.reply if first and isinstance(first.reply, AcuStatus) else await port.status()
            identity, faults = await port.reply_to(Identify()), await port.reply_to(ReadFaults())
    except LinkError as error:
        return [Finding(NO_GO, "ACU", str(error))]
    except TimeoutError:
        why = port.problem or f"{port.failed_exchange_count} replies were missing or late"
        return [Finding(NO_GO, "ACU", f"{link.description}: {why}: look at the line")]
    finally:
        await link.close()
        clock.close()
    findings = list(_acu_findings(status, identity, faults))
    bounds = station.bounds
    az_deg = nearest_turn(status.az_deg, middle_deg(bounds.azimuth), bounds.azimuth)
    if bounds.stow_deg is not None and az_deg is not None:
        why = why_not_stow(bounds, (az_deg, status.el_deg), system_tai_s())
        findings.append(Finding(WARN if why else GO, "way to stow", why or "clear from where the antenna stands"))
    if port.failed_exchange_count:
        late = f" {port.late_count} came too late, {port.lateness}:" if port.late_count else ""
        lost = f"{port.failed_exchange_count} had no answer in time;{late} look at the line, `latency-test` measures it"
        findings.append(Finding(WARN, "ACU replies", lost))
    return findings


def _acu_findings(status: AcuStatus, identity: Reply, faults: Reply) -> Iterator[Finding]:
    who = str(identity) if isinstance(identity, AcuIdentity) else "does not identify itself"
    yield Finding(
        GO,
        "ACU",
        f"{who}, {status.mode.name}, az {status.az_deg:.2f} el {status.el_deg:.2f}, AGC {status.agc_db:.1f} dB",
    )
    if status.mode is AcuMode.MANUAL or not status.is_remote_enabled:
        yield Finding(NO_GO, "ACU control", "the local panel has control: switch the ACU to REMOTE")
    else:
        yield Finding(GO, "ACU control", "remote control is enabled")
    named = ", ".join(faults.texts) if isinstance(faults, FaultReport) else ""
    if status.mode is AcuMode.FAULT or named:
        yield Finding(NO_GO, "ACU faults", named or "mode FAULT")
    else:
        yield Finding(GO, "ACU faults", "none")
    if not status.is_receiver_valid:
        yield Finding(WARN, "receiver", "the ACU calls its receiver not valid: no AGC, or no demodulator")
    if status.mode in (AcuMode.STOWED, AcuMode.STOWING):
        yield Finding(WARN, "stow", f"{status.mode.name}: the daemon leaves it when the pass is near")
