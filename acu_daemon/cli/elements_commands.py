"""`acu-daemon elements show`, `fetch`, `resume`: where the satellites' elements come from, and how fresh they are."""

import asyncio
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.options import Config, antenna_of, load_target, nearest_to_pass
from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.config.load import load_satellite, load_station, satellite_names
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.clock_sense import before_release
from acu_daemon.edge.elements_fetcher import Asker, Told, fetch_due, one_at_a_time
from acu_daemon.edge.elements_status import standings
from acu_daemon.edge.elements_store import WantedSatellite
from acu_daemon.edge.fetch_policy import HOUR_S, FetchOutcome, FetchState, is_due, resumed
from acu_daemon.edge.fetch_state_file import read_fetch_state, write_fetch_state
from acu_daemon.edge.state_directory import older_folders, refuse_world_writable, state_path
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.orbit.timescales import unix_from_tai, utc_text
from acu_daemon.units import DAY_S

State = Annotated[Path | None, typer.Option("--state", metavar="DIR", help="The daemon's --state, for the last fits.")]


def show(config: Config, state: State = None) -> None:
    """Show how each source stands, and which elements each satellite would be tracked by at its next pass.

    Sources are the URLs and directories of `[elements] source` in station.toml; a satellite's own file counts too.  The
    one that is expected to be off the least at the pass is used: by kind and age, with the last pass's fit if there is
    one (docs/elements.md).

    Exit status: 0; 1 where a satellite has no elements that can be used.
    """
    now_tai_s = SystemClock().tai_s()
    station = load_station(config)
    for one in standings(config, station.elements, now_tai_s):
        typer.echo(f"{'WARN' if one.is_problem else 'GO':6} {one.source}: {one.text}")
    if not station.elements.source:
        typer.echo("no [elements] source in station.toml: each satellite's own file is all there is")
    directory, antenna = state_path(state, is_rehearsal=False), antenna_of(station)
    folders = (antenna.folder(directory), *older_folders(directory, antenna))
    is_bad = False
    for name in satellite_names(config):
        try:
            target = load_target(config, name, now_tai_s, is_strict=False, folders=folders)
            target = nearest_to_pass(config, name, target, now_tai_s, is_strict=False, folders=folders)
        except AcuDaemonError as error:
            is_bad = True
            typer.echo(f"NO-GO  {name}: {'; '.join(str(error).splitlines())}")
            continue
        elements = target.elements
        is_bad = is_bad or bool(elements.errors)
        grade = "NO-GO" if elements.errors else "WARN" if elements.warnings else "GO"
        age_days = (now_tai_s - elements.epoch_tai_s) / DAY_S
        about = f"{elements.label}, {elements.propagator.kind} of {utc_text(elements.epoch_tai_s, 0)}"
        said = [*elements.errors, *elements.warnings, *([elements.choice] if elements.choice else [])]
        typer.echo(f"{grade:6} {name}: {'; '.join([f'{about}, {age_days:.1f} days old', *said])}")
    if is_bad:
        raise typer.Exit(1)


def fetch(
    config: Config,
    events: Annotated[
        bool,
        typer.Option("--events", help="Print events as JSON lines, for the daemon; leave the processor to it."),
    ] = False,
) -> None:
    """Ask the sources that are due, and keep what is better than what is there.

    The daemon does this by itself while the antenna waits, unless station.toml says `fetch = "command"`; then a timer
    calls it.  Each URL is asked at most every `every_h` hours, however often this is called.  A redirect or a 4xx stops
    it at once: look at the URL, then `acu-daemon elements resume`.  5xx and time-outs are tried again, ever later.
    Never is a set replaced by an older one, or by one that puts the satellite more than 5 sigma elsewhere.

    Exit status: 0, also where nothing was due; 1 where a source has stopped or an answer could not be used.
    """
    section = load_station(config).elements
    if not section.urls:
        raise UsageError(f"{config / 'station.toml'}: [elements] source names no URL: there is nothing to fetch")
    now_tai_s = SystemClock().tai_s()
    if wrong := before_release(now_tai_s):
        raise UsageError(wrong)
    try:
        told = fetch_once(config, section, _asker(config, section))
    except OSError as error:
        raise AcuDaemonError(
            f"{config / section.store}: {error.strerror}: nobody is asked where the answer cannot be kept; "
            "name a directory that can be written as [elements] store"
        ) from None
    for one in told:
        typer.echo(
            json.dumps({"event": one.event, "is_warning": one.is_warning, **one.fields}) if events else _line(one)
        )
    if not told and not events:
        typer.echo("nothing is due, or nothing is new:")
        for standing in standings(config, section, SystemClock().tai_s()):
            typer.echo(f"{standing.source}: {standing.text}")
    if any(one.event in ("elements.fetch_stopped", "elements.fetch_failed") for one in told) and not events:
        raise typer.Exit(1)


def resume(config: Config) -> None:
    """Let stopped sources be asked again, and forget their failures.  Look first why they stopped: `elements show`.

    A server that refused once because it was asked too often bars whoever goes on asking.

    Exit status: 0; 2 where the store cannot be written.
    """
    section = load_station(config).elements
    store, now_tai_s = config / section.store, SystemClock().tai_s()
    if not section.urls:
        raise UsageError(f"{config / 'station.toml'}: [elements] source names no URL: there is nothing to resume")
    for url in section.urls:
        before = read_fetch_state(store, url)
        later = resumed(before, now_tai_s, section.every_h * HOUR_S)
        try:
            store.mkdir(parents=True, exist_ok=True)
            write_fetch_state(store, later)
        except OSError as error:
            raise UsageError(f"{store}: {error.strerror}; run this as whoever fetches") from None
        was = before.stopped or before.problem or "nothing was wrong"
        due = is_due(later, now_tai_s, section.every_h * HOUR_S)
        then = "may be asked now" if due else f"is asked next at {utc_text(later.next_tai_s, 0)}"
        typer.echo(f"{url}: {then}; it was: {was}")


def fetch_once(config: Path, section: ElementsSourcesSection, ask: Asker) -> Sequence[Told]:
    """Ask what is due.  OSError: the store cannot be written."""
    clock, store = SystemClock(), config / section.store
    refuse_world_writable(store)
    with one_at_a_time(store) as is_alone:
        if not is_alone:
            return []
        every_s = section.every_h * HOUR_S
        return asyncio.run(fetch_due(store, section.urls, wanted_satellites(config), every_s, clock.tai_s, ask))


def wanted_satellites(config: Path) -> list[WantedSatellite]:
    """The satellites of a directory that have a catalogue number.  UsageError: none has."""
    station, found = load_station(config), []
    for name in satellite_names(config):
        try:
            satellite, _ = load_satellite(config, name, station)
        except AcuDaemonError:
            continue  # `check` says what is wrong with it
        if satellite.satellite.norad_id is not None:
            limits = satellite.elements.limits.limits()
            found.append(WantedSatellite(satellite.satellite.name, satellite.satellite.norad_id, limits))
    if not found:
        raise UsageError(f"{config}/satellites: no satellite with a norad_id, by which elements are fetched")
    return found


def _asker(config: Path, section: ElementsSourcesSection) -> Asker:
    from acu_daemon.edge.elements_request import ask_server, read_login, trust

    login = None if section.login is None else read_login(config / section.login)
    trusted = trust(None if section.ca_file is None else config / section.ca_file)
    clock = SystemClock()

    async def ask(state: FetchState) -> tuple[FetchOutcome, bytes]:
        return await ask_server(state, unix_from_tai(clock.tai_s()), trusted=trusted, login=login)

    return ask


def _line(one: Told) -> str:
    said = ", ".join(f"{key} {value}" for key, value in one.fields.items())
    return f"{'WARN' if one.is_warning else 'GO':6} {one.event.removeprefix('elements.')}: {said}"
