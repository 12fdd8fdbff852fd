"""The text of orbit mean-elements messages, KVN, XML, JSON or CSV: their fields, still as text, with where they stand.

Keys are in capital letters, whatever the file has.
"""

import csv
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

_FORBIDDEN_XML = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_OF_A_RECORD = ("EPOCH", "MEAN_MOTION", "NORAD_CAT_ID", "ECCENTRICITY")
_JSON_BETWEEN = re.compile(r"[\s,\[\]]*")
_IGNORED_KVN = ("COMMENT", "META_START", "META_STOP", "DATA_START", "DATA_STOP")


@dataclass(frozen=True, slots=True)
class Record:
    """The fields of one message, with its first line or, in XML and JSON, its number from 1."""

    fields: Mapping[str, str]
    line: int | None = None
    record: int | None = None


class BadRecordError(ValueError):
    """What is wrong with a record; becomes a Problem."""

    def __init__(self, reason: str, line: int | None = None, record: int | None = None) -> None:
        super().__init__(reason)
        self.line = line
        self.record = record


def read_records(text: str) -> Iterator[Record | BadRecordError]:
    """Read the messages of a text one by one, in the format that its first character or first line says."""
    return _reader(text)(text)


def _reader(text: str) -> Callable[[str], Iterator[Record | BadRecordError]]:
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


def _read_kvn(text: str) -> Iterator[Record | BadRecordError]:
    fields: dict[str, str] = {}
    begin = 0
    for number, raw in enumerate(text.split("\n"), start=1):
        line = raw.strip()
        if not line or line.split()[0].upper() in _IGNORED_KVN:
            continue
        key, equals, value = (part.strip() for part in line.partition("="))
        key = key.upper()
        if not equals or not key:
            yield BadRecordError(f"{line[:40]!r} is not KEY = VALUE", number)
            continue
        if fields and (key == "CCSDS_OMM_VERS" or key in fields):
            yield Record(fields, begin)
            fields = {}
        if not fields:
            begin = number
        fields[key] = re.sub(r"\s*\[[^\]]*\]$", "", value)
    if fields:
        yield Record(fields, begin)


def _read_csv(text: str) -> Iterator[Record | BadRecordError]:
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
                yield Record(dict(zip(header, values, strict=True)), line)
            elif any(row) and not row[0].startswith("#"):
                yield BadRecordError(f"{len(row)} values, the header names {len(header)}", line)
    except csv.Error as error:
        yield BadRecordError(f"not CSV: {error}", reader.line_num + skipped)


def _read_json(text: str) -> Iterator[Record | BadRecordError]:
    """A list, an object, objects one after another, or what is whole of a list that was cut."""
    number = 0
    try:
        for content in _json_values(text):
            for item in _json_records(content):
                number += 1
                if item is None:
                    yield BadRecordError("not an object with the fields of an OMM", record=number)
                else:
                    yield Record(item, record=number)
    except json.JSONDecodeError as error:
        yield BadRecordError(f"not JSON: {error.msg}", error.lineno)
    except (ValueError, RecursionError):
        yield BadRecordError("not JSON: nested too deep, or a number too long")


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


def _read_xml(text: str) -> Iterator[Record | BadRecordError]:
    if _FORBIDDEN_XML.search(text):
        yield BadRecordError("a DOCTYPE or ENTITY declaration: an OMM has none, so the file is not read")
        return
    record = 0
    for part in re.split(r"(?=<\?xml\b)", text.strip()):
        if not part.strip():
            continue
        try:
            root = ElementTree.fromstring(part.strip())
        except (ElementTree.ParseError, ValueError) as error:
            yield BadRecordError(f"not XML: {error}")
            continue
        found = [node for node in root.iter() if _tag(node) == "segment"]
        for segment in found or [node for node in root.iter() if _tag(node) == "omm"]:
            record += 1
            leaves = {_tag(node).upper(): (node.text or "").strip() for node in segment.iter() if len(node) == 0}
            yield Record(leaves, record=record)


def _tag(node: ElementTree.Element) -> str:
    return node.tag.rpartition("}")[2]
