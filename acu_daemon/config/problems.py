"""What is wrong with a TOML file, in an operator's words: key, value, what was expected."""

import json
from collections.abc import Mapping
from datetime import date, time
from difflib import get_close_matches
from typing import Any

KINDS = ("tle", "omm", "oem", "cpf", "sp3", "station", "brouwer")
LONGEST_VALUE = 60

Keys = Mapping[str, Mapping[str, set[str]]]  # of every kind of file, by table; "": the top
_NO_KEYS: Keys = {}

_EXPECTED = {
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing_size": "a whole number of at most nine digits",
    "string_type": "text in quotes",
    "string_too_short": "a text that is not empty",
    "bool_type": "true or false",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}",
    "literal_error": "{expected}",
}


def in_words(item: Mapping[str, Any], under: str = "", known: Keys = _NO_KEYS) -> str:
    """Put one validation error, as pydantic's `errors()` lists it, into one line.

    under: the table that was validated, where it was not the whole file.  known: what an unknown key may stand for.
    """
    key = _key(item["loc"], under)
    kind, value = item["type"], item["input"]
    context: Mapping[str, Any] = item.get("ctx", {})
    if kind == "missing":
        return f"{key} is missing; it has no default"
    if kind == "extra_forbidden":
        return f"{key}{_assigned(value)}: unknown key; {_guess(key, known)}"
    if kind == "union_tag_not_found":
        return f"{key}.kind is missing; expected one of {', '.join(KINDS)}"
    if kind == "union_tag_invalid":
        return f"{key}.kind = {_shown(context['tag'])}: expected one of {', '.join(KINDS)}"
    if kind == "value_error":
        reason = item["msg"].removeprefix("Value error, ").removeprefix(f"{value!r}: ")
        return f"{key}.{reason}".lstrip(".") if isinstance(value, dict) else f"{key}{_assigned(value)}: {reason}"
    reason = f"expected {_EXPECTED[kind].format(**context)}" if kind in _EXPECTED else item["msg"]
    return f"{key}{_assigned(value)}: {reason}"


def _guess(key: str, known: Keys) -> str:
    """What was meant: a key of the same table that is written alike, else one of another table with that name."""
    table, _, name = key.rpartition(".")
    here = {other for tables in known.values() for other in tables.get(table, ())} - {name}
    if near := get_close_matches(name, sorted(here), 1):
        return f"did you mean {near[0]}?"
    places = [
        f"[{other}] of {file}" if other else file
        for file, tables in known.items()
        for other, names in tables.items()
        if name in names and (other != table or not table)  # a table at the top is another file's
    ]
    return f"it belongs to {' or '.join(places)}" if places else "is it misspelt, or in the wrong table?"


def _key(loc: tuple[str | int, ...], under: str) -> str:
    parts = [str(part) for part in loc]
    if parts[:1] == ["elements"] and parts[1:2] and parts[1] in KINDS:
        del parts[1]  # the kind is not written as a table
    return ".".join([under, *parts] if under else parts)


def _assigned(value: object) -> str:
    return "" if isinstance(value, dict) else f" = {_shown(value)}"


def _shown(value: object) -> str:
    """A value as it is written in TOML, shortened where it is long."""
    if isinstance(value, bool | str):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, date | time):
        text = value.isoformat().replace("+00:00", "Z")
    else:
        text = str(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."
