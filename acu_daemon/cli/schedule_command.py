"""`acu-daemon schedule`, `pause`: which passes the station tracks, why not the others, and what people say of them."""

import getpass
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from acu_daemon.cli.options import Config, antenna_of, parse_utc
from acu_daemon.cli.schedule_plan import StationPlan, station_plan
from acu_daemon.config.load import load_station, satellite_names
from acu_daemon.config.station_tables import StationFile
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.schedule_file import NAME, NO_PAUSE, ScheduleFile, Words
from acu_daemon.edge.state_directory import antenna_directory, state_directory, state_path
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.calendar import calendar_text
from acu_daemon.schedule.book import Entry, PassState, merged, paused
from acu_daemon.schedule.rules import PassRequest, Wish
from acu_daemon.units import DAY_S

ROW = "{state:9} {satellite:16} {rise:19}  {length:>7}  {top:>6}  {priority:>8}  {reason}"
GRANTED = (PassState.PLANNED, PassState.PREPASS, PassState.PASS)

State = Annotated[
    Path | None,
    typer.Option("--state", metavar="DIR", help="The station's --state, if it is started with one."),
]
Rehearsal = Annotated[bool, typer.Option("--rehearsal", help="Of the station that runs as a rehearsal (--at).")]
Pass2 = tuple[str, str]


def command(
    config: Config,
    start: Annotated[
        str | None, typer.Option("--from", metavar="UTC", help="Plan from then on.  Default: now.")
    ] = None,
    days: Annotated[
        float | None,
        typer.Option("--days", metavar="N", min=0.01, max=10, help="Default: [schedule] horizon_days."),
    ] = None,
    state: State = None,
    rehearsal: Rehearsal = False,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json", help="A list: satellite, rise_utc, set_utc, priority, state, reason, and more.  Refused ones too."
        ),
    ] = False,
    as_calendar: Annotated[bool, typer.Option("--ics", help="The granted passes as a calendar (iCalendar).")] = False,
    past: Annotated[
        float, typer.Option("--past", metavar="DAYS", min=0, help="Also the passes of the last DAYS, as they came out.")
    ] = 0.0,
    force: Annotated[
        Pass2 | None,
        typer.Option("--force", metavar="NAME UTC", help="Have the pass of a satellite that is up then tracked."),
    ] = None,
    exclude: Annotated[
        Pass2 | None, typer.Option("--exclude", metavar="NAME UTC", help="Have the pass that is up then not tracked.")
    ] = None,
    as_planned: Annotated[
        Pass2 | None, typer.Option("--as-planned", metavar="NAME UTC", help="Withdraw such a word.")
    ] = None,
    prune: Annotated[
        float | None, typer.Option("--prune", metavar="DAYS", min=1, help="Forget passes older than this.")
    ] = None,
) -> None:
    """Show which passes the station tracks, and of every other one why not.

    The plan is exact: of all sets of passes that this antenna can track one after the other, with the way between them,
    it is one whose priority x useful seconds is largest ([schedule] of station.toml and of each satellite's file).
    Without a running station it is computed from the files, with what people said and what was already tracked.
    """
    station = load_station(config)
    directory = antenna_of(station).folder(state_path(state, is_rehearsal=rehearsal))
    now_tai_s = SystemClock().tai_s() if start is None else parse_utc("--from", start)
    if prune is not None or any((force, exclude, as_planned)):
        directory = _made(station, state, is_rehearsal=rehearsal)
    for wish, said in ((Wish.FORCE, force), (Wish.EXCLUDE, exclude), (Wish.NONE, as_planned)):
        if said is not None:
            _say(config, directory, wish, said, now_tai_s)
    if prune is not None:
        with ScheduleFile(directory) as file:
            typer.echo(f"{file.prune(now_tai_s - prune * DAY_S)} passes forgotten", err=True)
    words, book = _kept(directory, now_tai_s - past * DAY_S)
    until_tai_s = None if days is None else now_tai_s + days * DAY_S
    plan = station_plan(config, now_tai_s, until_tai_s=until_tai_s, requests=words.requests)
    entries = merged(book, plan.decisions, now_tai_s, plan.until_tai_s).book
    if words.pause_until_tai_s > now_tai_s:
        entries = tuple(paused(one, words.pause_until_tai_s) for one in entries)
    for name, reason in plan.omitted.items():
        typer.echo(f"warning: {name} is left out: {reason}", err=True)
    if as_json:
        typer.echo(json.dumps([as_record(one) for one in entries], indent=1))
    elif as_calendar:
        typer.echo(calendar_text(_granted(entries), station.station.name, now_tai_s), nl=False)
    else:
        _show(entries, plan, words, now_tai_s)


def pause(
    config: Config,
    until: Annotated[
        str | None, typer.Option("--until", metavar="UTC", help="When the station goes on by itself.")
    ] = None,
    end: Annotated[bool, typer.Option("--end", help="End the pause now.")] = False,
    state: State = None,
    rehearsal: Rehearsal = False,
) -> None:
    """Have the station begin no pass until a time.  A pass that is being tracked is tracked to its end.

    The pause ends by itself; `acu-daemon schedule` shows when.
    """
    if (until is None) is not end:
        raise UsageError("pause needs --until UTC, a time at which it ends by itself; or --end")
    now_tai_s = SystemClock().tai_s()
    until_tai_s = NO_PAUSE if until is None else parse_utc("--until", until)
    if until is not None and until_tai_s <= now_tai_s:
        raise UsageError(f"--until {until}: expected a time to come; it is {utc_text(now_tai_s, 0)}")
    with ScheduleFile(_made(load_station(config), state, is_rehearsal=rehearsal)) as file:
        file.pause(until_tai_s, now_tai_s, getpass.getuser())
    typer.echo("the pause is over" if end else f"no pass is begun until {utc_text(until_tai_s, 0)}")


def as_record(entry: Entry) -> dict[str, Any]:
    """An entry as `--json` has it."""
    return {
        "satellite": entry.satellite,
        "rise_utc": utc_text(entry.rise_tai_s),
        "culmination_utc": utc_text(entry.culmination_tai_s),
        "set_utc": utc_text(entry.set_tai_s),
        "culmination_el_deg": round(entry.culmination_el_deg, 3),
        "priority": entry.priority,
        "state": str(entry.state),
        "reason": entry.reason,
        "useful_s": round(entry.useful_s, 1),
        "start_utc": None if entry.start_tai_s is None else utc_text(entry.start_tai_s),
        "end_utc": None if entry.end_tai_s is None else utc_text(entry.end_tai_s),
    }


def _kept(directory: Path, from_tai_s: float) -> tuple[Words, tuple[Entry, ...]]:
    if not (directory / NAME).exists():
        return Words(), ()
    with ScheduleFile(directory, is_read_only=True) as file:
        return file.words(), file.book(from_tai_s)


def _say(config: Path, directory: Path, wish: Wish, said: Pass2, now_tai_s: float) -> None:
    name, utc = said
    if name not in (names := satellite_names(config)):
        raise UsageError(f"{name}: no such satellite in {config}/satellites; there are {', '.join(names) or 'none'}")
    with ScheduleFile(directory) as file:
        file.say(PassRequest(name, parse_utc(f"--{wish}", utc), wish), now_tai_s, getpass.getuser())


def _made(station: StationFile, state: Path | None, *, is_rehearsal: bool) -> Path:
    return antenna_directory(state_directory(state, is_rehearsal=is_rehearsal), antenna_of(station))


def _granted(entries: Sequence[Entry]) -> list[Entry]:
    return [one for one in entries if one.state in GRANTED]


def _show(entries: Sequence[Entry], plan: StationPlan, words: Words, now_tai_s: float) -> None:
    if words.pause_until_tai_s > now_tai_s:
        typer.echo(f"PAUSED until {utc_text(words.pause_until_tai_s, 0)}; `acu-daemon pause --end` goes on")
    if not entries:
        typer.echo(f"no pass until {utc_text(plan.until_tai_s, 0)}; try --days 10")
        return
    head = ("state", "satellite", "rise UTC", "min:s", "top el", "priority", "why")
    names = ("state", "satellite", "rise", "length", "top", "priority", "reason")
    typer.echo(ROW.format(**dict(zip(names, head, strict=True))).rstrip())
    for one in entries:
        minutes, seconds = divmod(round(one.set_tai_s - one.rise_tai_s), 60)
        row = {
            "state": one.state,
            "satellite": one.satellite,
            "rise": utc_text(one.rise_tai_s, 0)[:19].replace("T", " "),
            "length": f"{minutes}:{seconds:02}",
            "top": f"{one.culmination_el_deg:.1f}",
            "priority": one.priority,
            "reason": one.reason,
        }
        typer.echo(ROW.format(**row).rstrip())
    granted = _granted(entries)
    useful_h = sum(one.useful_s for one in granted) / 3600.0
    typer.echo(f"{len(granted)} of {len(entries)} passes granted, {useful_h:.1f} useful hours")
