"""Orbit mean-elements messages (CCSDS 502.0) as people have them: KVN, XML, JSON and CSV, one or many in a file.

Only messages made for SGP4 are taken: theory SGP4 (or SGP, SDP4), frame TEME; an EPHEMERIS_TYPE of SGP4-XP is refused.
"""

import re
from collections.abc import Mapping
from math import isfinite

from acu_daemon.orbit.element_set import ElementSet, Problem, rad_s_from_rev_day
from acu_daemon.orbit.omm_text import BadRecordError, Record, read_records
from acu_daemon.orbit.timescales import TIME_SYSTEMS, tai_from_ccsds
from acu_daemon.orbit.tle import catalogue_number
from acu_daemon.units import DEG

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"(\d+)\.0*", re.ASCII)
_REQUIRED_WORDS = {  # what a field may be, without blanks, hyphens and underscores, and what is said else
    "MEAN_ELEMENT_THEORY": (r"(SGP4?|SDP4)([/,+](SGP4?|SDP4))*", "SGP4 or SGP/SGP4"),
    "REF_FRAME": (r"TEME(OFDATE)?|TRUEEQUATORMEANEQUINOX(OFDATE)?|TOD|TRUEOFDATE", "TEME"),
    "TIME_SYSTEM": ("|".join(TIME_SYSTEMS), " or ".join(TIME_SYSTEMS)),
    "CENTER_NAME": ("EARTH", "EARTH"),
    "EPHEMERIS_TYPE": (r"0*[023]?(\.0*)?|SGP4?", "0 or 2 or 3"),  # 4 is SGP4-XP
}
_TRUE_OF_DATE = ("TOD", "TRUEOFDATE")


def parse_omm(text: str, file: str) -> tuple[list[ElementSet], list[Problem]]:
    """Read every message of a text; the format is recognised by its first character or first line.

    Args:    file: the name that messages give.
    Returns: the good sets, and for everything else a problem with its line (XML and JSON: the record's number from 1).
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    sets: list[ElementSet] = []
    problems: list[Problem] = []
    for item in read_records(text):
        if isinstance(item, BadRecordError):
            problems.append(Problem(file, item.line, str(item), item.record))
            continue
        number = _catalogue_number(item.fields.get("NORAD_CAT_ID", ""))
        name = item.fields.get("OBJECT_NAME", "")
        numbers = () if number is None else (number,)
        try:
            sets.append(_element_set(item, file))
        except BadRecordError as error:
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


def _element_set(item: Record, file: str) -> ElementSet:
    fields = item.fields
    for key, (allowed, said) in _REQUIRED_WORDS.items():
        value = fields.get(key, "")
        if value and re.fullmatch(allowed, _plain(value)) is None:
            raise BadRecordError(f"{key} is {value[:40]!r}; only {said} can be used with SGP4")
    number_text = _text(fields, "NORAD_CAT_ID")
    norad_id = _catalogue_number(number_text)
    if norad_id is None:
        raise BadRecordError(f"NORAD_CAT_ID is {number_text[:40]!r}, not a catalogue number")
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
        raise BadRecordError(f"{key} is missing")
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
        raise BadRecordError(f"{key} is {text[:40]!r}, not a number")
    value = float(plain)
    if not low <= value <= high:
        raise BadRecordError(f"{key} is {text[:40]}, outside {low:g}..{high:g}")
    return value


def _epoch_tai_s(text: str, system: str) -> float:
    try:
        return tai_from_ccsds(text, system)
    except ValueError as error:
        raise BadRecordError(f"EPOCH is {text[:40]!r}, not a UTC time: {error}") from None
