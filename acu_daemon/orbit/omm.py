"""Orbit mean-elements messages (CCSDS 502.0) as people have them: KVN, XML, JSON and CSV, one or many in a file.

Only messages made for SGP4 are taken: theory SGP4 (or SGP, SDP4), frame TEME; an EPHEMERIS_TYPE of SGP4-XP is refused.
"""

import csv
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any
from xml.etree import ElementTree

from acu_daemon.orbit.element_set import ElementSet, Problem, rad_s_from_rev_day
from acu_daemon.orbit.timescales import TIME_SYSTEMS, tai_from_ccsds
from acu_daemon.orbit.tle import catalogue_number
from acu_daemon.units import DEG

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"(\d+)\.0*", re.ASCII)
_FORBIDDEN_XML = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_REQUIRED_WORDS = {  # what a field may be, without blanks, hyphens and underscores, and what is said else
    "MEAN_ELEMENT_THEORY": (r"(SGP4?|SDP4)([/,+](SGP4?|SDP4))*", "SGP4 or SGP/SGP4"),
    "REF_FRAME": (r"TEME(OFDATE)?|TRUEEQUATORMEANEQUINOX(OFDATE)?|TOD|TRUEOFDATE", "TEME"),
    "TIME_SYSTEM": ("|".join(TIME_SYSTEMS), " or ".join(TIME_SYSTEMS)),
    "CENTER_NAME": ("EARTH", "EARTH"),
    "EPHEMERIS_TYPE": (r"0*[023]?(\.0*)?|SGP4?", "0 or 2 or 3"),  # 4 is SGP4-XP
}
_TRUE_OF_DATE = ("TOD", "TRUEOFDATE")
_OF_A_RECORD = ("EPOCH", "MEAN_MOTION", "NORAD_CAT_ID", "ECCENTRICITY")
_JSON_BETWEEN = re.compile(r"[\s,\[\]]*")
_IGNORED_KVN = ("COMMENT", "META_START", "META_STOP", "DATA_START", "DATA_STOP")


@dataclass(frozen=True, slots=True)
class _Record:
    fields: Mapping[str, str]
    line: int | None = None
    record: int | None = None


class _BadRecordError(ValueError):
    """What is wrong with a record; becomes a Problem."""

    def __init__(self, reason: str, line: int | None = None, record: int | None = None) -> None:
        super().__init__(reason)
        self.line = line
        self.record = record


def parse_omm(text: str, file: str) -> tuple[list[ElementSet], list[Problem]]:
    """Read every message of a text; the format is recognised by its first character or first line.

    Args:    file: the name that messages give.
    Returns: the good sets, and for everything else a problem with its line (XML and JSON: the record's number from 1).
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    sets: list[ElementSet] = []
    problems: list[Problem] = []
    for item in _reader(text)(text):
        if isinstance(item, _BadRecordError):
            problems.append(Problem(file, item.line, str(item), item.record))
            continue
        number = _catalogue_number(item.fields.get("NORAD_CAT_ID", ""))
        name = item.fields.get("OBJECT_NAME", "")
        numbers = () if number is None else (number,)
        try:
            sets.append(_element_set(item, file))
        except _BadRecordError as error:
            problems.append(Problem(file, item.line, str(error), item.record, numbers, name))
            continue
        if _plain(item.fields.get("REF_FRAME", "")) in _TRUE_OF_DATE:
            reason = (
                f"REF_FRAME is {item.fields['REF_FRAME'][:40]!r}, read as TEME: elements of SGP4 are of no other frame"
            )
            problems.append(Problem(file, item.line, reason, item.record, numbers, name, "note"))
    if not sets and not problems:
        problems.append(Problem(file, None, "no orbit mean-elements message in it (KVN, XML, JSON or CSV)"))
    return sets, problems


def _reader(text: str) -> Callable[[str], Iterator[_Record | _BadRecordError]]:
    start = text.lstrip()
    if start[:1] == "<":
        return _read_xml
    if start[:1] in ("{", "["):
        return _read_json
    first_line = start.split("\n", 1)[0]
    return _read_csv if _delimiter(first_line) and "=" not in first_line else _read_kvn


def _delimiter(header: str) -> str:
    """What stands between the columns of a CSV, empty where it is none."""
    return next((one for one in (",", ";", "\t") if one in header), "")


def _read_kvn(text: str) -> Iterator[_Record | _BadRecordError]:
    fields: dict[str, str] = {}
    begin = 0
    for number, raw in enumerate(text.split("\n"), start=1):
        line = raw.strip()
        if not line or line.split()[0].upper() in _IGNORED_KVN:
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        key = key.upper()
        if not equals or not key:
            yield _BadRecordError(f"{line[:40]!r} is not KEY = VALUE", number)
            continue
        if fields and (key == "CCSDS_OMM_VERS" or key in fields):
            yield _Record(fields, begin)
            fields = {}
        if not fields:
            begin = number
        fields[key] = re.sub(r"\s*\[[^\]]*\]$", "", value)
    if fields:
        yield _Record(fields, begin)


def _read_csv(text: str) -> Iterator[_Record | _BadRecordError]:
    body = text.strip("\n")
    reader = csv.reader(body.split("\n"), delimiter=_delimiter(body.lstrip().split("\n", 1)[0]), skipinitialspace=True)
    skipped = len(text) - len(text.lstrip("\n"))
    header: list[str] | None = None
    try:
        for row in reader:
            line = reader.line_num + skipped
            if header is None:
                header = [key.strip().upper() for key in row]
            elif len(row) >= len(header) and not any(row[len(header) :]):
                values = (value.strip() for value in row[: len(header)])
                yield _Record(dict(zip(header, values, strict=True)), line)
            elif any(row) and not row[0].startswith("#"):
                yield _BadRecordError(f"{len(row)} values, the header names {len(header)}", line)
    except csv.Error as error:
        yield _BadRecordError(f"not CSV: {error}", reader.line_num + skipped)


def _read_json(text: str) -> Iterator[_Record | _BadRecordError]:
    """A list, an object, objects one after another, or what is whole of a list that was cut."""
    number = 0
    try:
        for content in _json_values(text):
            for item in _json_records(content):
                number += 1
                if item is None:
                    yield _BadRecordError("not an object with the fields of an OMM", record=number)
                else:
                    yield _Record(item, record=number)
    except json.JSONDecodeError as error:
        yield _BadRecordError(f"not JSON: {error.msg}", error.lineno)
    except (ValueError, RecursionError):
        yield _BadRecordError("not JSON: nested too deep, or a number too long")


def _json_values(text: str) -> Iterator[Any]:
    """The values of a text; of a list those within it, so that a cut one gives what is before the cut."""
    decoder = json.JSONDecoder()
    at = 0
    while (found := _JSON_BETWEEN.match(text, at)) and found.end() < len(text):
        value, at = decoder.raw_decode(text, found.end())
        yield value


def _json_records(content: Any) -> Iterator[dict[str, str] | None]:
    """The objects that are OMMs, however deep; None for what is none."""
    if isinstance(content, list):
        for item in content:
            yield from _json_records(item)
        return
    leaves = _json_leaves(content) if isinstance(content, dict) else {}
    if any(key in leaves for key in _OF_A_RECORD):
        yield leaves
        return
    lists = [value for value in content.values() if isinstance(value, list)] if isinstance(content, dict) else []
    if not lists:
        yield None
    for value in lists:
        yield from _json_records(value)


def _json_leaves(item: dict[str, Any]) -> dict[str, str]:
    """The fields of an object and of those within it, as the XML form nests them."""
    leaves: dict[str, str] = {}
    for key, value in item.items():
        if isinstance(value, dict):
            leaves |= _json_leaves(value)
        elif isinstance(value, str | int | float):
            leaves[key.strip().upper()] = str(value).strip()
    return leaves


def _read_xml(text: str) -> Iterator[_Record | _BadRecordError]:
    if _FORBIDDEN_XML.search(text):
        yield _BadRecordError("a DOCTYPE or ENTITY declaration: an OMM has none, so the file is not read")
        return
    record = 0
    for part in re.split(r"(?=<\?xml\b)", text.strip()):
        if not part.strip():
            continue
        try:
            root = ElementTree.fromstring(part.strip())
        except (ElementTree.ParseError, ValueError) as error:
            yield _BadRecordError(f"not XML: {error}")
            continue
        found = [node for node in root.iter() if _tag(node) == "segment"]
        for segment in found or [node for node in root.iter() if _tag(node) == "omm"]:
            record += 1
            leaves = {_tag(node).upper(): (node.text or "").strip() for node in segment.iter() if len(node) == 0}
            yield _Record(leaves, record=record)


def _tag(node: ElementTree.Element) -> str:
    return node.tag.rpartition("}")[2]


def _element_set(item: _Record, file: str) -> ElementSet:
    fields = item.fields
    for key, (allowed, said) in _REQUIRED_WORDS.items():
        value = fields.get(key, "")
        if value and re.fullmatch(allowed, _plain(value)) is None:
            raise _BadRecordError(f"{key} is {value[:40]!r}; only {said} can be used with SGP4")
    number_text = _text(fields, "NORAD_CAT_ID")
    norad_id = _catalogue_number(number_text)
    if norad_id is None:
        raise _BadRecordError(f"NORAD_CAT_ID is {number_text[:40]!r}, not a catalogue number")
    return ElementSet(
        kind="omm",
        name=fields.get("OBJECT_NAME", ""),
        norad_id=norad_id,
        epoch_tai_s=_epoch_tai_s(_text(fields, "EPOCH"), fields.get("TIME_SYSTEM", "").upper() or "UTC"),
        mean_motion_rad_s=rad_s_from_rev_day(_number(fields, "MEAN_MOTION", 1e-6, 20.0)),
        eccentricity=_number(fields, "ECCENTRICITY", 0.0, 0.9999999),
        inclination_rad=_number(fields, "INCLINATION", 0.0, 180.0) * DEG,
        raan_rad=_number(fields, "RA_OF_ASC_NODE", -360.0, 360.0) * DEG,
        argp_rad=_number(fields, "ARG_OF_PERICENTER", -360.0, 360.0) * DEG,
        mean_anomaly_rad=_number(fields, "MEAN_ANOMALY", -360.0, 360.0) * DEG,
        bstar_per_radius=_number(fields, "BSTAR", -100.0, 100.0),
        file=file,
        line=item.line,
        record=item.record,
    )


def _text(fields: Mapping[str, str], key: str) -> str:
    value = fields.get(key, "")
    if not value:
        raise _BadRecordError(f"{key} is missing")
    return value


def _plain(text: str) -> str:
    return "".join(c for c in text.upper() if c not in " -_")


def _catalogue_number(text: str) -> int | None:
    """As in the file: digits, digits that became a fraction (25544.0), or Alpha-5."""
    whole = _WHOLE.fullmatch(text.strip())
    return catalogue_number(whole[1] if whole else text.strip().upper())


def _number(fields: Mapping[str, str], key: str, low: float, high: float) -> float:
    text = re.sub(r"\s*\[[^\]]*\]$", "", _text(fields, key))
    plain = text.upper().replace("D", "E")  # as Fortran writes exponents
    if _NUMBER.fullmatch(plain) is None or not isfinite(float(plain)):
        raise _BadRecordError(f"{key} is {text[:40]!r}, not a number")
    value = float(plain)
    if not low <= value <= high:
        raise _BadRecordError(f"{key} is {text[:40]}, outside {low:g}..{high:g}")
    return value


def _epoch_tai_s(text: str, system: str) -> float:
    try:
        return tai_from_ccsds(text, system)
    except ValueError as error:
        raise _BadRecordError(f"EPOCH is {text[:40]!r}, not a UTC time: {error}") from None
