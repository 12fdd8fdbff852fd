"""Whose a recording is: a JSON beside the CSV, FILE.csv.json, with station, satellite, elements and version."""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import count
from pathlib import Path
from typing import Any

from acu_daemon import __version__
from acu_daemon.edge.carry_over_file import number, reason_of
from acu_daemon.edge.writer import replace_file
from acu_daemon.model import Station

FORMAT = 1
SAME_PLACE_DEG = 1e-4  # 10 m
SAME_HEIGHT_M = 20.0
_LARGEST_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class ElementsUsed:
    """What a run predicted from.  file: as the satellite's TOML names it; "": the elements stand there."""

    kind: str
    epoch_utc: str
    file: str = ""


@dataclass(frozen=True, slots=True)
class Whose:
    """Station, satellite and elements of a recording."""

    station: Station
    satellite: str
    norad_id: int | None
    elements: ElementsUsed
    is_rehearsal: bool = False

    def __str__(self) -> str:
        number_text = "" if self.norad_id is None else f" ({self.norad_id})"
        rehearsal = "a rehearsal of " if self.is_rehearsal else ""
        return f"{rehearsal}{self.satellite}{number_text} over {self.station.name}"

    def is_of_satellite(self, other: "Whose") -> bool:
        """Whether the satellites are one: by catalogue number where both have it, else by name."""
        if self.norad_id is not None and other.norad_id is not None:
            return self.norad_id == other.norad_id
        return self.satellite.casefold() == other.satellite.casefold()

    def is_at_station(self, other: "Whose") -> bool:
        """Whether the stations stand at one place; a name alone makes no other one."""
        mine, its = self.station, other.station
        east_deg = abs((mine.longitude_deg - its.longitude_deg + 180.0) % 360.0 - 180.0)
        is_here = abs(mine.latitude_deg - its.latitude_deg) < SAME_PLACE_DEG and east_deg < SAME_PLACE_DEG
        return is_here and abs(mine.height_m - its.height_m) < SAME_HEIGHT_M

    def may_go_on(self, other: "Whose") -> bool:
        """Whether readings of both may stand in one file."""
        is_alike = self.is_rehearsal == other.is_rehearsal and self.station.name == other.station.name
        return is_alike and self.is_at_station(other) and self.is_of_satellite(other)


def whose_path(recording: Path) -> Path:
    """The JSON beside a recording."""
    return recording.with_name(f"{recording.name}.json")


def names_for(recording: Path) -> Iterator[Path]:
    """The name asked for, then FILE-2.csv, FILE-3.csv and so on."""
    yield recording
    for number_in_line in count(2):
        yield recording.with_name(f"{recording.stem}-{number_in_line}{recording.suffix}")


def read_whose(recording: Path) -> Whose | None:
    """Whose a recording says it is; None: it does not say.  ValueError: its JSON cannot be used, and why."""
    try:
        return _from_json(_read(recording))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise ValueError(f"{whose_path(recording).name}: {reason_of(error)}") from None


def save_whose(recording: Path, whose: Whose, begun_utc: str) -> None:
    """Put the JSON beside a recording that is begun or gone on with; other elements are added to it.  OSError."""
    run = {"elements": asdict(whose.elements), "version": __version__, "from_utc": begun_utc}
    try:
        said = _read(recording)
    except FileNotFoundError:
        said = {
            "format": FORMAT,
            "station": asdict(whose.station),
            "satellite": {"name": whose.satellite, "norad_id": whose.norad_id},
            **run,
            "rehearsal": whose.is_rehearsal,
        }
    else:
        later = said.setdefault("later", [])
        last = later[-1] if later else said
        if (last.get("elements"), last.get("version")) == (run["elements"], run["version"]):
            return
        later.append(run)
    text = json.dumps(said, indent=1, allow_nan=False)
    replace_file(whose_path(recording), f"{text}\n".encode("ascii"))


def _read(recording: Path) -> dict[str, Any]:
    with whose_path(recording).open("rb") as file:
        read = json.loads(file.read(_LARGEST_BYTES))
    if not isinstance(read, dict) or read.get("format") != FORMAT:
        raise ValueError(f"expected a JSON object with format {FORMAT}")
    if not isinstance(read.get("later", []), list) or not all(isinstance(one, dict) for one in read.get("later", [])):
        raise ValueError("later: expected a list of objects")
    return read


def _from_json(read: dict[str, Any]) -> Whose:
    station, satellite, elements = read["station"], read["satellite"], read["elements"]
    place = [number(station[name]) for name in ("latitude_deg", "longitude_deg", "height_m")]
    norad_id = satellite["norad_id"]
    if not (norad_id is None or (isinstance(norad_id, int) and not isinstance(norad_id, bool))):
        raise ValueError(f"norad_id = {norad_id!r}: expected a number or null")
    if not all(isinstance(name, str) for name in (station["name"], satellite["name"])):
        raise ValueError("name: expected a text")
    used = ElementsUsed(str(elements["kind"]), str(elements["epoch_utc"]), str(elements.get("file", "")))
    return Whose(
        Station(station["name"], *place), satellite["name"], norad_id, used, is_rehearsal=read.get("rehearsal") is True
    )


def why_not_here(recording: Path, whose: Whose, header_bytes: int) -> str:
    """Why a run's readings may not go into a file; "": they may, as far as its JSON says."""
    if recording.exists() and not recording.is_file():
        return ""  # a pipe or a device has nothing beside it
    has_lines = recording.exists() and recording.stat().st_size > header_bytes
    try:
        said = read_whose(recording)
    except ValueError as error:
        return str(error)
    if said is None:
        name = whose_path(recording).name
        return f"{recording.name} does not say whose it is: there is no {name}" if has_lines else ""
    return "" if whose.may_go_on(said) else f"{recording.name} is of {said}"
