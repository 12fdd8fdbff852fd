"""Orbit mean-elements messages (CCSDS 502.0) as CelesTrak serves them: KVN, XML, JSON and CSV, one or a list.

Only messages made for SGP4 are taken: theory SGP4 or SGP/SGP4, frame TEME, times in UTC.
"""

import csv
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from xml.etree import ElementTree

from acu_daemon.orbit.element_set import ElementSet, Problem, rad_s_from_rev_day
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.orbit.tle import catalogue_number
from acu_daemon.units import DEG

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_FORBIDDEN_XML = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_REQUIRED_WORDS = {
    "MEAN_ELEMENT_THEORY": ("SGP4", "SGP/SGP4"),
    "REF_FRAME": ("TEME",),
    "TIME_SYSTEM": ("UTC",),
    "CENTER_NAME": ("EARTH",),
    "EPHEMERIS_TYPE": ("0", "2", "3"),  # 4 is SGP4-XP
}


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
        try:
            sets.append(_element_set(item, file))
        except _BadRecordError as error:
            problems.append(Problem(file, item.line, str(error), item.record))
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
    return _read_csv if "," in first_line and "=" not in first_line else _read_kvn


def _read_kvn(text: str) -> Iterator[_Record | _BadRecordError]:
    fields: dict[str, str] = {}
    begin = 0
    for number, raw in enumerate(text.split("\n"), start=1):
        line = raw.strip()
        if not line or line.split()[0] == "COMMENT":
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
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
    reader = csv.reader(text.strip("\n").split("\n"))
    skipped = len(text) - len(text.lstrip("\n"))
    header: list[str] | None = None
    try:
        for row in reader:
            line = reader.line_num + skipped
            if header is None:
                header = [key.strip() for key in row]
            elif len(row) == len(header):
                yield _Record(dict(zip(header, (value.strip() for value in row), strict=True)), line)
            elif row:
                yield _BadRecordError(f"{len(row)} values, the header names {len(header)}", line)
    except csv.Error as error:
        yield _BadRecordError(f"not CSV: {error}", reader.line_num + skipped)


def _read_json(text: str) -> Iterator[_Record | _BadRecordError]:
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        yield _BadRecordError(f"not JSON: {error.msg}", error.lineno)
        return
    except (ValueError, RecursionError):
        yield _BadRecordError("not JSON: nested too deep, or a number too long")
        return
    for record, item in enumerate(content if isinstance(content, list) else [content], start=1):
        if isinstance(item, dict):
            values = {key: str(value) for key, value in item.items() if isinstance(value, str | int | float)}
            yield _Record(values, record=record)
        else:
            yield _BadRecordError("not an object with the fields of an OMM", record=record)


def _read_xml(text: str) -> Iterator[_Record | _BadRecordError]:
    if _FORBIDDEN_XML.search(text):
        yield _BadRecordError("a DOCTYPE or ENTITY declaration: an OMM has none, so the file is not read")
        return
    try:
        root = ElementTree.fromstring(text.strip())
    except (ElementTree.ParseError, ValueError) as error:
        yield _BadRecordError(f"not XML: {error}")
        return
    segments = [node for node in root.iter() if _tag(node) == "segment"]
    for record, segment in enumerate(segments, start=1):
        leaves = {_tag(node): (node.text or "").strip() for node in segment.iter() if len(node) == 0}
        yield _Record(leaves, record=record)


def _tag(node: ElementTree.Element) -> str:
    return node.tag.rpartition("}")[2]


def _element_set(item: _Record, file: str) -> ElementSet:
    fields = item.fields
    for key, allowed in _REQUIRED_WORDS.items():
        value = fields.get(key, "")
        if value and value.upper() not in allowed:
            raise _BadRecordError(f"{key} is {value[:40]!r}; only {' or '.join(allowed)} can be used with SGP4")
    number_text = _text(fields, "NORAD_CAT_ID")
    norad_id = catalogue_number(number_text)
    if norad_id is None:
        raise _BadRecordError(f"NORAD_CAT_ID is {number_text[:40]!r}, not a catalogue number")
    return ElementSet(
        kind="omm",
        name=fields.get("OBJECT_NAME", ""),
        norad_id=norad_id,
        epoch_tai_s=_epoch_tai_s(_text(fields, "EPOCH")),
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


def _number(fields: Mapping[str, str], key: str, low: float, high: float) -> float:
    text = _text(fields, key)
    if _NUMBER.fullmatch(text) is None or not isfinite(float(text)):
        raise _BadRecordError(f"{key} is {text[:40]!r}, not a number")
    value = float(text)
    if not low <= value <= high:
        raise _BadRecordError(f"{key} is {text[:40]}, outside {low:g}..{high:g}")
    return value


def _epoch_tai_s(text: str) -> float:
    try:
        return tai_from_utc(text if text.endswith("Z") else f"{text}Z")
    except ValueError as error:
        raise _BadRecordError(f"EPOCH is {text[:40]!r}, not a UTC time: {error}") from None
