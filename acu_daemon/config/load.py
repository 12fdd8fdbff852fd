"""station.toml and satellites/NAME.toml: read and checked.

Unknown keys, wrong units and impossible values stop the start with file, key, value and what was expected.
"""

import errno
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from acu_daemon.config.envelope_tables import Points
from acu_daemon.config.problems import in_words
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.section import Section
from acu_daemon.config.station_tables import StationFile
from acu_daemon.errors import ConfigError
from acu_daemon.pointing.skyline import skyline_of

File = TypeVar("File", bound=Section)
MASK_HEADER = "az_deg,el_deg"
_NONE: Mapping[str, type[Section]] = {}


def load_station(directory: Path) -> StationFile:
    """Read DIR/station.toml, and the mask that it names.  ConfigError: names file, key, value and what was expected."""
    path = directory / "station.toml"
    station = parse(StationFile, path, read_toml(path))
    if not isinstance(station.envelope.mask, str):
        return station
    mask = read_mask(directory / station.envelope.mask)
    return station.model_copy(update={"envelope": station.envelope.model_copy(update={"mask": mask})})


def read_mask(path: Path) -> Points:
    """Read a skyline: lines az_deg,el_deg, a header and lines that begin with # left out.

    ConfigError: names file, line and what was expected.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}; it is [envelope] mask of station.toml") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start}: expected UTF-8 text; save the file in that encoding") from None
    points: list[tuple[float, float]] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#") or (not points and text.lower().replace(" ", "") == MASK_HEADER):
            continue
        try:
            az_deg, el_deg = map(float, text.split(","))
        except ValueError:
            raise ConfigError(f"{path}, line {number}: {text[:60]!r}: expected az_deg,el_deg") from None
        points.append((az_deg, el_deg))
    try:
        skyline_of(tuple(points))
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None
    return tuple(points)


def satellite_names(directory: Path) -> list[str]:
    """Names of the satellites' files, sorted.  ConfigError: the directory cannot be looked into."""
    satellites = directory / "satellites"
    try:
        names = os.listdir(satellites)  # noqa: PTH208  Path.glob finds nothing where it may not look
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise ConfigError(f"{satellites}: cannot be read: {error.strerror}") from None
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml") and not name.startswith("."))


def load_satellite(directory: Path, name: str, station: StationFile) -> tuple[SatelliteFile, StationFile]:
    """Read DIR/satellites/NAME.toml; also the station with that file's overrides applied."""
    path = directory / "satellites" / f"{name}.toml"
    if not _exists(path):
        known = ", ".join(satellite_names(directory)) or "none"
        raise ConfigError(f"{path}: no such file; satellites in {directory}: {known}")
    satellite = parse(SatelliteFile, path, read_toml(path))
    sections: dict[str, Section] = {
        "receiver": station.receiver,
        "readings": station.readings,
        "tracking": station.tracking,
    }
    for key, section in sections.items():
        override: dict[str, Any] = getattr(satellite, key)
        sections[key] = parse(type(section), path, section.model_dump() | override, under=key)
    return satellite, station.model_copy(update=sections)


def _exists(path: Path) -> bool:
    """Whether there is such a file; one that may not be looked at is there, and whoever reads it says why it cannot."""
    try:
        return path.exists()
    except OSError as error:
        return error.errno != errno.ENAMETOOLONG


def read_toml(path: Path, must_hold: str = "the station's [station] and [acu] tables") -> dict[str, Any]:
    """Read a TOML file.  ConfigError: names the file and what is wrong with it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; it must hold {must_hold}") from None
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: byte {error.start}: expected UTF-8 text; save the file in that encoding") from None
    except (ValueError, RecursionError) as error:  # tomllib's own errors, and numbers or nesting beyond Python's limits
        raise ConfigError(f"{path}: not TOML: {error}") from None


def parse(
    model: type[File], path: Path, values: dict[str, Any], under: str = "", also: Mapping[str, type[Section]] = _NONE
) -> File:
    """Make a table of a file's values.  ConfigError: names file, key, value and what was expected.

    also: other files that a misplaced key may belong to.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        files = also or {"station.toml": StationFile, "the satellite's file": SatelliteFile}
        known = {name: _keys(kind) for name, kind in files.items()}
        problems = [f"{path}: {in_words(dict(item), under, known)}" for item in error.errors()]
        raise ConfigError("\n".join(problems)) from None


def _keys(model: type[Section], table: str = "") -> dict[str, set[str]]:
    """The keys of a kind of file, by table."""
    found = {table: set(model.model_fields)}
    for name, field in model.model_fields.items():
        for kind in (field.annotation, *get_args(field.annotation)):
            if isinstance(kind, type) and issubclass(kind, Section):
                for under, keys in _keys(kind, f"{table}.{name}".lstrip(".")).items():
                    found.setdefault(under, set()).update(keys)
    return found
