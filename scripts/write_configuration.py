#!/usr/bin/env python3
"""Writes docs/configuration.md from the models that read the files, so the page cannot tell anything else.

A key's description is "What it is.  Decides what."; its unit stands in its name, its range in the model.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic.fields import FieldInfo

from acu_daemon.config.onboard_tables import PassFile
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.section import Section
from acu_daemon.config.station_tables import StationFile

PAGE = Path(__file__).resolve().parents[1] / "docs" / "configuration.md"
FILES: dict[str, tuple[type[Section], str]] = {
    "station.toml": (StationFile, "`config/station.toml` is an example with everything in it."),
    "satellites/NAME.toml": (
        SatelliteFile,
        "One file for each satellite; NAME is what `--satellite` takes.  `config/satellites/scd-1.toml` is an example.",
    ),
    "PASS.toml": (
        PassFile,
        "A pass of a satellite with a steerable antenna, for `acu-daemon onboard profile` ([onboard.md](onboard.md)).  "
        "`config/onboard/pass.toml` is an example; files are beside it.",
    ),
}
DECIDES = re.compile(r"(?s)(.+?[.)])  (Decides .+\.)")
UNITS = {  # by the end of a key, the longest first
    "_deg_s2": "deg/s²", "_deg_s": "deg/s", "_m_s": "m/s", "_deg": "deg", "_km": "km", "_m": "m", "_s": "s", "_c": "°C",
    "_db": "dB", "_h": "h", "_mb": "MB", "_hpa": "hPa", "_percent": "%", "_arcsec": "arcsec", "_days": "d",
    "_utc": "UTC", "_fraction": "of the beam",
}  # fmt: skip
BOUNDS = (("ge", ">= "), ("gt", "> "), ("le", "<= "), ("lt", "< "))
NEEDED = "**needed**"
HEAD = """# Configuration

Written by `scripts/write_configuration.py` from the models that read the files; a test holds it to them.

A directory, `--config DIR`, has `station.toml` and a file of `satellites/` for each satellite.  Both are TOML.  Keys
end in their unit.  **Needed** keys have no default; every other key may be left out, and so may a table without needed
keys.  An unknown key, a wrong type and an impossible value stop the start with file, key, value and what was expected,
exit status 2; `acu-daemon check --config DIR` looks without moving anything.

The keys of the simulator's scenario stand in `acu-daemon fake-acu --help`.
"""


@dataclass(frozen=True, slots=True)
class Key:
    """One line of the page.  decides: "" where the description does not say."""

    table: str
    name: str
    unit: str
    default: str
    range: str
    meaning: str
    decides: str


@dataclass(frozen=True, slots=True)
class Table:
    """One heading with its keys.  kind: of [elements], the values of the key that chooses it.  is_list: any number."""

    name: str
    meaning: str
    keys: tuple[Key, ...]
    kind: str = ""
    is_list: bool = False


def tables_of(
    model: type[Section], under: str = "", meaning: str = "", kind: str = "", is_list: bool = False
) -> Iterator[Table]:
    """Those of a file, in the order of the models: a table's own keys, then the tables in it."""
    tables = {name: sections_of(field) for name, field in model.model_fields.items()}
    keys = tuple(key_of(under, name, model.model_fields[name]) for name, below in tables.items() if not below)
    if under:
        yield Table(under, meaning, keys, kind, is_list)
    for name, below in tables.items():
        field = model.model_fields[name]
        for section in below:
            choice = " or ".join(_written(value) for value in get_args(_kind(section))) if len(below) > 1 else ""
            place = f"{under}.{field.alias or name}".lstrip(".")
            is_many = get_origin(field.annotation) is Sequence
            yield from tables_of(section, place, field.description or "", choice, is_many)


def sections_of(field: FieldInfo) -> list[type[Section]]:
    """The tables that may stand under a key; none: it is a value."""
    kinds = (field.annotation, *get_args(field.annotation))
    return [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Section)]


def _kind(section: type[Section]) -> Any:
    return section.model_fields["kind"].annotation


def key_of(table: str, name: str, field: FieldInfo) -> Key:
    """The line of a key."""
    match = DECIDES.fullmatch(field.description or "")
    meaning, decides = match.groups() if match else (field.description or "", "")
    unit = next((unit for end, unit in UNITS.items() if name.endswith(end)), "")
    return Key(table, name, unit, default_of(field), range_of(field), meaning, decides.removeprefix("Decides "))


def default_of(field: FieldInfo) -> str:
    """As it is written in TOML."""
    if field.is_required():
        return NEEDED
    return "none" if field.default is None else _written(field.default)


def range_of(field: FieldInfo) -> str:
    """What a value may be: said, a choice, or the bounds."""
    extra = field.json_schema_extra
    if isinstance(extra, dict) and "range" in extra:
        return str(extra["range"])
    kinds = set(_kinds(field.annotation))
    if bool in kinds:
        return "`true`, `false`"
    if choices := [value for value in kinds if isinstance(value, str)]:
        return ", ".join(_written(value) for value in get_args(field.annotation) if value in choices)
    given = {name: getattr(item, name) for item in field.metadata for name, _ in BOUNDS if hasattr(item, name)}
    if "ge" in given and "le" in given:
        return f"{given['ge']:.9g} to {given['le']:.9g}"
    if given:
        return ", ".join(f"{sign}{given[name]:.9g}" for name, sign in BOUNDS if name in given)
    return "text" if str in kinds else ""


def _kinds(annotation: Any) -> Iterator[Any]:
    """An annotation and all that it is made of."""
    yield annotation
    for part in get_args(annotation):
        yield from _kinds(part)


def _written(value: object) -> str:
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f'`"{value}"`'
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def page() -> str:
    """The whole page."""
    parts, told = [HEAD], set[Table]()
    for file, (model, intro) in FILES.items():
        parts.append(f"## {file}\n\n{intro}\n")
        new = [table for table in dict.fromkeys(tables_of(model)) if table not in told]  # [elements] is the satellite's
        parts += [section_of(table) for table in new]
        told.update(new)
        if model is SatelliteFile:
            parts.append(overrides())
        if same := dict.fromkeys(f"`[{table.name}]`" for table in tables_of(model) if table not in new):
            parts.append(f"{', '.join(same)}: as in the files above.\n")
    return "\n".join(parts)


def section_of(table: Table) -> str:
    """A heading and its table."""
    name = f"[[{table.name}]]" if table.is_list else f"[{table.name}]"
    heading = f"### {name}" + (f", kind = {table.kind}" if table.kind else "")
    lines = [heading, "", table.meaning]
    if table.keys:
        lines += ["", "| key | unit | default | range | what it is | what it decides |", "|---|---|---|---|---|---|"]
        lines += [
            f"| `{key.name}` | {key.unit} | {key.default} | {key.range} | {key.meaning} | {key.decides} |"
            for key in table.keys
        ]
    return "\n".join([*lines, ""])


def overrides() -> str:
    """The tables of the station that a satellite's file may have: values without a model of their own."""
    fields = {name: field for name, field in SatelliteFile.model_fields.items() if not sections_of(field)}
    lines = [f"- `[{name}]`: {field.description}" for name, field in fields.items()]
    return "\n".join(["### Values of the station for one satellite", "", *lines, ""])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(
        f"{PAGE}: {len({key for model, _ in FILES.values() for table in tables_of(model) for key in table.keys})} keys"
    )
