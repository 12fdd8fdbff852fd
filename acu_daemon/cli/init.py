"""`acu-daemon init DIR`: a station's first files, asked for or given by options."""

import contextlib
import math
import re
import shlex
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from acu_daemon.cli.check import command as check
from acu_daemon.cli.station_files import Value, file_word, satellite_text, shipped_station, station_text
from acu_daemon.config.load import load_station, parse
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile
from acu_daemon.edge.link import make_link
from acu_daemon.edge.orbit_file import SET_PARSERS, read_orbit_file
from acu_daemon.errors import UsageError
from acu_daemon.orbit.element_set import ElementSet

MOST_NAMED = 8
AXIS_KEYS = ("min_deg", "max_deg", "max_rate_deg_s", "max_acceleration_deg_s2")
ACU = "tcp://127.0.0.1:3842"

Shaped = TypeVar("Shaped")


def command(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Where the files go; made where it is missing.")],
    name: Annotated[str | None, typer.Option("--name", help="The station's name.")] = None,
    latitude: Annotated[str | None, typer.Option("--latitude", metavar="DEG", help="Geodetic, WGS84, north +.")] = None,
    longitude: Annotated[str | None, typer.Option("--longitude", metavar="DEG", help="East +.")] = None,
    height: Annotated[str | None, typer.Option("--height", metavar="M", help="Above the ellipsoid.")] = None,
    lowest: Annotated[
        str | None, typer.Option("--min-elevation", metavar="DEG", help="Where passes begin and end.")
    ] = None,
    acu: Annotated[
        str | None, typer.Option("--acu", metavar="URL", help="tcp://HOST:PORT or serial:///dev/ttyUSB0?baud=9600.")
    ] = None,
    azimuth: Annotated[
        str | None,
        typer.Option(
            "--azimuth", metavar="MIN,MAX,V,A", help="Soft limits, deg, over all turns; largest deg/s and deg/s2."
        ),
    ] = None,
    elevation: Annotated[
        str | None, typer.Option("--elevation", metavar="MIN,MAX,V,A", help="The same of the elevation.")
    ] = None,
    beamwidth: Annotated[
        str | None, typer.Option("--beamwidth", metavar="DEG", help="Full width at half power.")
    ] = None,
    elements: Annotated[
        str | None, typer.Option("--elements", metavar="FILE", help="List of element sets (TLE, OMM); it is copied.")
    ] = None,
    satellite: Annotated[
        list[str] | None,
        typer.Option("--satellite", help="Catalogue number or name in that list; may be given several times."),
    ] = None,
) -> None:
    """Write a station's first files: DIR/station.toml and a file for each satellite, commented; ends with `check`.

    On a terminal it asks for what no option gives; else all of it must be given.  Nothing is ever overwritten: where
    station.toml is there already, satellites are added to it.

    \b
      acu-daemon init mystation
      acu-daemon init mystation --elements weather.txt --satellite 43013 --satellite "NOAA 21"

    Exit status: 0 the files are written (the check may still find what is missing, such as the ACU); 2 wrong use.
    """
    given = {
        "--name": name, "--latitude": latitude, "--longitude": longitude, "--height": height,
        "--min-elevation": lowest, "--acu": acu, "--azimuth": azimuth, "--elevation": elevation,
        "--beamwidth": beamwidth,
    }  # fmt: skip
    may_ask = sys.stdin is not None and sys.stdin.isatty()
    station = directory / "station.toml"
    files = {}
    if station.exists():
        load_station(directory)
        if useless := [option for option, text in given.items() if text is not None]:
            raise UsageError(f"{station} is there already: change it by hand, not by {useless[0]}")
    else:
        files[station] = _station_text(station, given, may_ask=may_ask)
    wanted = _wanted(elements, satellite or [], may_ask=may_ask)
    if wanted is not None:
        files |= _satellite_texts(directory, wanted)
    _write(directory, files, wanted)
    _check(directory, [path.stem for path in files if path != station])


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked for a key; shape raises ValueError, which says what was expected."""

    text: str
    shape: Callable[[str], tuple[Value, ...]]
    keys: tuple[tuple[str, str], ...]
    default: str | None = None


def _number(low: float, high: float) -> Callable[[str], tuple[Value, ...]]:
    def shaped(text: str) -> tuple[Value, ...]:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise ValueError(f"expected a number from {low:g} to {high:g}")
        return (value,)

    return shaped


def _name(text: str) -> tuple[Value, ...]:
    if not text.strip() or not text.isprintable():
        raise ValueError("expected a name")
    return (text.strip(),)


def _axis(text: str) -> tuple[Value, ...]:
    try:
        values = tuple(float(part) for part in text.replace(",", " ").split())
    except ValueError:
        values = ()
    if len(values) != len(AXIS_KEYS) or not all(map(math.isfinite, values)):
        raise ValueError("expected four numbers: MIN,MAX in deg, largest deg/s, largest deg/s2")
    low, high, rate, acceleration = values
    if low >= high or rate <= 0.0 or acceleration <= 0.0:
        raise ValueError("expected MIN below MAX, rate and acceleration above 0")
    return values


def _url(text: str) -> tuple[Value, ...]:
    try:
        make_link(text)
    except UsageError as error:
        raise ValueError(str(error)) from None
    return (text,)


QUESTIONS = {
    "--name": Question("Name of the station", _name, (("station", "name"),)),
    "--latitude": Question("Latitude, deg, north positive", _number(-90, 90), (("station", "latitude_deg"),)),
    "--longitude": Question("Longitude, deg, east positive", _number(-180, 360), (("station", "longitude_deg"),)),
    "--height": Question("Height above the ellipsoid, m", _number(-500, 9000), (("station", "height_m"),)),
    "--min-elevation": Question(
        "Lowest elevation of a pass, deg", _number(0, 90), (("station", "min_elevation_deg"),), "5"
    ),
    "--acu": Question("Where the ACU is reached", _url, (("acu", "url"),), ACU),
    "--azimuth": Question(
        "Azimuth: soft limits over all turns of the cable, largest rate and acceleration (MIN,MAX,V,A)",
        _axis,
        tuple(("acu.azimuth", key) for key in AXIS_KEYS),
    ),
    "--elevation": Question(
        "Elevation: the same (MIN,MAX,V,A)", _axis, tuple(("acu.elevation", key) for key in AXIS_KEYS)
    ),
    "--beamwidth": Question(
        "Beam, full width at half power, deg", _number(0.01, 30), (("receiver", "beamwidth_deg"),), "1"
    ),
}


def _station_text(path: Path, given: Mapping[str, str | None], *, may_ask: bool) -> str:
    """Text of station.toml.  UsageError: an option is missing or wrong; says all that are missing."""
    missing = [option for option, text in given.items() if text is None and QUESTIONS[option].default is None]
    if missing and not may_ask:
        raise UsageError(f"no terminal to ask on: give also {', '.join(missing)} (acu-daemon init --help)")
    values: dict[tuple[str, str], Value] = {}
    for option, question in QUESTIONS.items():
        text = given[option]
        if text is None:
            answer = _asked(question.text, question.shape, question.default) if may_ask else None
            shaped = answer or question.shape(question.default or "")
        else:
            try:
                shaped = question.shape(text)
            except ValueError as error:
                raise UsageError(f"{option} {text!r}: {error}") from None
        values |= dict(zip(question.keys, shaped, strict=True))
    written = station_text(shipped_station(), values)
    parse(StationFile, path, tomllib.loads(written))
    return written


def _asked(text: str, shape: Callable[[str], Shaped], default: str | None = None) -> Shaped:
    """Ask until the answer can be used."""
    while True:
        answer = typer.prompt(text, default=default)
        try:
            return shape(answer)
        except (ValueError, UsageError) as error:
            typer.echo(f"  {error}")


@dataclass(frozen=True, slots=True)
class Wanted:
    """Satellites out of a list of element sets: one set of each."""

    path: Path
    kind: str
    sets: tuple[ElementSet, ...]


def _wanted(file: str | None, words: Sequence[str], *, may_ask: bool) -> Wanted | None:
    """The satellites that are asked for; None: none.  UsageError: no such list, or not in it."""
    if words and file is None and not may_ask:
        raise UsageError("--satellite needs --elements FILE, the list in which it is looked for")
    if file is None and may_ask:
        text = "File with element sets (TLE, OMM) of your satellites; - for none yet"
        listed = _asked(text, lambda answer: None if answer == "-" else _list(Path(answer).expanduser()), "-")
    else:
        listed = None if file is None else _list(Path(file))
    if listed is None:
        return None
    if not words and may_ask:
        return _asked(
            f"Which of its {len({one.norad_id for one in listed.sets})} satellites: numbers or names, by commas",
            lambda answer: _chosen(listed, [word.strip() for word in answer.split(",") if word.strip()]),
        )
    if not words:
        raise UsageError(f"--elements {file}: say which satellites of it, by --satellite")
    return _chosen(listed, words)


def _list(path: Path) -> Wanted:
    try:
        kind, text = read_orbit_file(path)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    if kind not in SET_PARSERS:
        raise UsageError(f"{path}: an ephemeris (kind {kind!r}), no list of element sets: see docs/elements.md")
    sets, problems = SET_PARSERS[kind](text, str(path))
    if not sets:
        raise UsageError(f"{path}: no element set can be read: {'; '.join(map(str, problems[:3]))}")
    return Wanted(path, kind, tuple(sets))


def _chosen(listed: Wanted, words: Sequence[str]) -> Wanted:
    if not words:
        raise UsageError("expected at least one satellite")
    sets = {one.norad_id: one for one in (_find(listed, word) for word in words)}
    return Wanted(listed.path, listed.kind, tuple(sets.values()))


def _find(listed: Wanted, word: str) -> ElementSet:
    """The satellite by number, by its whole name, else by a part of it that only one has."""
    if word.isdigit():
        found = [one for one in listed.sets if one.norad_id == int(word)]
    else:
        found = [one for one in listed.sets if _plain(one.name) == _plain(word)]
        found = found or [one for one in listed.sets if _plain(word) and _plain(word) in _plain(one.name)]
    labels = sorted({one.norad_id: one.label for one in found}.values())
    if not labels:
        names = {one.name.lower(): one.label for one in listed.sets}
        near = [names[name] for name in get_close_matches(word.lower(), names, MOST_NAMED, 0.5)]
        raise UsageError(f"{listed.path}: no satellite {word!r}" + (f"; near it: {', '.join(near)}" if near else ""))
    if len(labels) > 1:
        more = f" and {len(labels) - MOST_NAMED} more" if len(labels) > MOST_NAMED else ""
        raise UsageError(
            f"{listed.path}: {word!r} fits {', '.join(labels[:MOST_NAMED])}{more}: say which by its number"
        )
    return found[0]


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _satellite_texts(directory: Path, wanted: Wanted) -> dict[Path, str]:
    files: dict[Path, str] = {}
    for one in wanted.sets:
        word = file_word(one.name) or str(one.norad_id)
        path = directory / "satellites" / f"{word}.toml"
        if path in files:  # two satellites of one name
            path = directory / "satellites" / f"{word}-{one.norad_id}.toml"
        text = satellite_text(one.name or str(one.norad_id), one.norad_id, wanted.kind, wanted.path.name)
        parse(SatelliteFile, path, tomllib.loads(text))
        files[path] = text
    return files


def _write(directory: Path, files: Mapping[Path, str], wanted: Wanted | None) -> None:
    """Write all of it, or nothing.  UsageError: something is there already, or cannot be written."""
    contents = {path: text.encode() for path, text in files.items()}
    try:
        if wanted is not None:
            target, data = directory / "satellites" / wanted.path.name, wanted.path.read_bytes()
            if not target.exists():
                contents = {target: data} | contents
            elif target.read_bytes() != data:
                raise UsageError(
                    f"{target} is there already, with other content: nothing is written; name it otherwise"
                )
        for path in contents:
            if path.exists():
                raise UsageError(f"{path} is there already: nothing is written; remove it first, or leave it out")
        (directory / "satellites").mkdir(parents=True, exist_ok=True)
        for path, content in contents.items():
            with path.open("xb") as file:
                file.write(content)
            typer.echo(f"wrote  {path}")
    except OSError as error:
        raise UsageError(f"{error.filename or directory}: {error.strerror}") from None


def _check(directory: Path, names: list[str]) -> None:
    """What `check` says of it, and what comes next."""
    typer.echo()
    with contextlib.suppress(typer.Exit):  # no ACU yet: the files are there all the same
        check(directory)
    config = shlex.quote(str(directory))
    typer.echo("\nNext, without your ACU:")
    for name in names[:1] or ["NAME"]:
        typer.echo(f"  acu-daemon passes   --config {config}")
        typer.echo(f"  acu-daemon rehearse --config {config} --satellite {name}")
