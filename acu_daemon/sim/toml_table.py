"""One table of a TOML file into one frozen dataclass: unknown keys, wrong types and impossible values are refused."""

from dataclasses import MISSING, fields
from datetime import UTC, datetime
from math import isfinite
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from acu_daemon.orbit.timescales import tai_from_utc

T = TypeVar("T")
NOT_NEGATIVE = ("noise_deg", "noise_db", "latency_s", "duration_s", "start_s", "agc_db", "depth_db")


def read_table(kind: type[T], table: object, name: str) -> T:
    """Make a dataclass of a table.  ValueError: names table, key, value and what was expected.

    Numbers are finite; keys that end in `_utc` hold a time and become TAI seconds; the dataclass' defaults fill gaps.
    """
    if not isinstance(table, dict):
        raise ValueError(f"{name} = {table!r}, expected a table")
    known = {item.name: item for item in fields(kind)}  # type: ignore[arg-type]
    if unknown := sorted(table.keys() - known.keys()):
        raise ValueError(f"[{name}] {unknown[0]} is unknown, expected one of {', '.join(known)}")
    missing = [key for key, item in known.items() if item.default is MISSING and key not in table]
    if missing:
        raise ValueError(f"[{name}] {missing[0]} is missing")
    hints = get_type_hints(kind)
    values: dict[str, Any] = {}
    for key, value in table.items():
        try:
            values[key] = _value(key, value, hints[key])
        except ValueError as error:
            raise ValueError(f"[{name}] {key} = {value!r}: {error}") from None
    return kind(**values)


def _value(key: str, value: object, hint: Any) -> object:
    if get_origin(hint) is Literal:
        if value not in get_args(hint):
            raise ValueError(f"expected one of {', '.join(map(repr, get_args(hint)))}")
        return value
    if hint in (bool, bool | None):
        if not isinstance(value, bool):
            raise ValueError("expected true or false")
        return value
    if key.endswith("_utc"):
        return _tai_s(value)
    if hint is int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise ValueError("expected a whole number")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ValueError("expected a number")
    if key.endswith(NOT_NEGATIVE) and value < 0:
        raise ValueError("expected 0 or more")
    return float(value)


def _tai_s(value: object) -> float:
    if isinstance(value, datetime) and value.tzinfo is not None:
        return tai_from_utc(value.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ"))
    if isinstance(value, str):
        return tai_from_utc(value)
    raise ValueError("expected a time like 2018-12-25T01:40:00Z")
