"""The texts of a new station's files: station.toml as it is shipped with other numbers, and a satellite's file.  Pure
but for reading the shipped one.
"""

import json
import re
import unicodedata
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

Value = str | float
Values = Mapping[tuple[str, str], Value]  # by table and key

_TABLE = re.compile(r"^\[([\w.]+)\]")
_KEY = re.compile(r"^(\w+) = (\"[^\"]*\"|[^\s#]+)( *)")
_HEAD = """\
# The station, written by `acu-daemon init`.  docs/configuration.md tells every key; what is left out has a default.
# After a change: acu-daemon check --config DIR
"""
SATELLITE = """\
# {label}, written by `acu-daemon init`.  docs/configuration.md tells every key; what is left out has a default.

[satellite]
name = {name}
norad_id = {norad_id}

[elements]
kind = "{kind}"
file = {file}  # beside this file, searched by norad_id; write a newer one beside it and move it into place
# kind = "station"            # in place of both: fetched, by [elements] source of station.toml

# [uncertainty]               # without it, elements are worth what their kind and age say
# position_km = 3.0           # 1 sigma of each component of the state at the epoch
# velocity_m_s = 3.0

[fallback]
acquire_s = 60.0              # no signal this long after the rise: search
hold_s = 1200.0               # follow the prediction this long after a loss, then search
search_s = 120.0              # along the track first, then across it; the next search goes on
"""


def shipped_station() -> str:
    """The commented station.toml of the project: in the package, or beside it in a clone."""
    installed = resources.files("acu_daemon.cli") / "init_files" / "station.toml"
    if installed.is_file():
        return installed.read_text(encoding="utf-8")
    return (Path(__file__).resolve().parents[2] / "config" / "station.toml").read_text(encoding="utf-8")


def station_text(shipped: str, values: Values) -> str:
    """The shipped file with these values in place of its own; comments keep their columns.

    Raises: KeyError: a key that the file does not have.
    """
    wanted, table, lines = dict(values), "", []
    for line in shipped.splitlines():
        if found := _TABLE.match(line):
            table = found[1]
        elif (found := _KEY.match(line)) and (table, found[1]) in wanted:
            new = toml_value(wanted.pop((table, found[1])))
            rest = line[found.end() :]
            gap = max(len(found[2]) + len(found[3]) - len(new), 2) if rest else 0
            line = f"{found[1]} = {new}{' ' * gap}{rest}"
        lines.append(line)
    if wanted:
        raise KeyError(f"the shipped station.toml has no {', '.join('.'.join(one) for one in wanted)}")
    first = next(number for number, line in enumerate(lines) if not line.startswith("#"))
    return _HEAD + "\n".join(lines[first:]) + "\n"


def satellite_text(name: str, norad_id: int, kind: str, file: str) -> str:
    """The file of a satellite whose elements are in a list beside it."""
    label = f"{name} ({norad_id})".replace("\n", " ")
    return SATELLITE.format(
        label=label, name=toml_value(name), norad_id=norad_id, kind=kind, file=toml_value(file).ljust(21)
    )


def toml_value(value: Value) -> str:
    """A text or a number as TOML has it: its basic strings have the escapes of JSON."""
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(float(value))


def file_word(name: str) -> str:
    """A satellite's name as the name of its file, without what stands in brackets: NOAA 20 (JPSS-1) is noaa-20."""
    bare = re.sub(r"[(\[].*?[)\]]", "", name)
    plain = unicodedata.normalize("NFKD", bare).encode("ascii", "ignore").decode()
    return re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-")
