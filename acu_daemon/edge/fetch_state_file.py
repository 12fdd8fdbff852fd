"""How things stand with each URL of elements (.fetch-NAME.json in the store): whole at any time, over restarts."""

import json
import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from acu_daemon.edge.acu_place import file_name
from acu_daemon.edge.fetch_policy import FetchState
from acu_daemon.edge.writer import replace_file
from acu_daemon.orbit.timescales import utc_text

VERSION = 1
LONGEST_TEXT = 2000  # of a reason, so that the file stays small
_LARGEST_BYTES = 100_000
_TIMES = ("asked", "next", "good")


def state_file(store: Path, url: str) -> Path:
    """Where the state of a URL is."""
    return store / f".fetch-{file_name(url)}.json"


def group_file(store: Path, url: str) -> Path:
    """Where the last good answer of a URL is, as it came."""
    return store / f"group-{file_name(url)}"


def read_fetch_state(store: Path, url: str) -> FetchState:
    """The state of a URL; a new one where there is none.

    One that cannot be read is as good as one that has stopped: else whoever damages it would begin a storm.
    """
    path = state_file(store, url)
    try:
        with path.open("rb") as file:
            return _from_json(json.loads(file.read(_LARGEST_BYTES)), url)
    except FileNotFoundError:
        return FetchState(url)
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as error:
        reason = f"{path} cannot be read ({getattr(error, 'strerror', None) or error})"
        return FetchState(url, problem=reason, stopped=reason)


def write_fetch_state(store: Path, state: FetchState) -> None:
    """Put the state in place.  OSError: it cannot be."""
    times = {f"{name}_utc": utc_text(at, 0) for name in _TIMES if math.isfinite(at := getattr(state, f"{name}_tai_s"))}
    plain = {key: value for key, value in asdict(state).items() if not (isinstance(value, float) and math.isinf(value))}
    replace_file(state_file(store, state.url), json.dumps({"version": VERSION, **plain, **times}, indent=1).encode())


def _from_json(read: Any, url: str) -> FetchState:
    """Raises: ValueError, TypeError: what is wrong."""
    if not isinstance(read, dict) or read.get("version") != VERSION or read.get("url") != url:
        raise ValueError(f"expected a JSON object with version {VERSION} and this URL")
    values: dict[str, Any] = {"url": url}
    for one in fields(FetchState):
        value = read.get(one.name)
        if value is None or one.name == "url":
            continue
        kind: type = type(one.default)
        if kind is float and isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            values[one.name] = float(value)
        elif type(value) is kind and len(str(value)) <= LONGEST_TEXT:
            values[one.name] = value
        else:
            raise ValueError(f"{one.name} is {str(value)[:40]!r}")
    return FetchState(**values)
