"""The sets of a few satellites out of a list of many, without reading the others: a full catalogue has 16,000.

A list is looked through for the catalogue number as its format writes it, and only what is around a hit is parsed.
Nothing is said of other sets then, and one that cannot be read so leaves the list to the whole reading.
"""

import json
import re
from dataclasses import replace
from typing import Literal

from acu_daemon.orbit.element_set import ElementSet, Problem
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.tle import ALPHA_5, parse_tle

_ELEMENT_LINE = 60  # characters: no name is so long
LONG = 50_000  # characters: a shorter list is read whole, and what is wrong in it is told

_CSV_HEADER = re.compile(r"\A\s*[\w,]*\bNORAD_CAT_ID\b[\w,]*$", re.IGNORECASE | re.MULTILINE)


def named_sets(
    kind: Literal["tle", "omm"], text: str, file: str, norad_id: int
) -> tuple[list[ElementSet], list[Problem]]:
    """Read the sets of one satellite; none where the list must be read whole.

    Args:    text: with line ends `\\n`; file: the name that messages give.
    Returns: the sets, with their place in the file, and notes on them.
    """
    if len(text) < LONG:
        return [], []
    if kind == "tle":
        return _from_tle(text, file, norad_id)
    if text.lstrip()[:1] in ("[", "{"):
        return _from_json(text, file, norad_id)
    header = _CSV_HEADER.search(text[:2000])
    return ([], []) if header is None else _from_csv(text, file, norad_id, header[0])


def _from_tle(text: str, file: str, norad_id: int) -> tuple[list[ElementSet], list[Problem]]:
    written = [f"{norad_id:05}", f"{norad_id:5}"] if norad_id < 100_000 else []
    if 100_000 <= norad_id < 10_000 * (10 + len(ALPHA_5)):
        letter = ALPHA_5[norad_id // 10_000 - 10]
        written = [f"{letter}{norad_id % 10_000:04}", f"{letter.lower()}{norad_id % 10_000:04}"]
    if not written:
        return [], []
    sets: list[ElementSet] = []
    problems: list[Problem] = []
    for found in re.finditer(rf"^[ \t]*1 (?:{'|'.join(written)})", text, re.MULTILINE):
        begin = text.rfind("\n", 0, max(found.start() - 1, 0)) + 1  # of the line before it, which may be the name
        end = text.find("\n", found.end())
        end = text.find("\n", end + 1) if end >= 0 else -1
        if len(text[begin : found.start()].strip()) >= _ELEMENT_LINE:  # of the set before: names may begin with a 2 too
            begin = found.start()
        mine, bad = parse_tle(text[begin : end if end >= 0 else len(text)], file)
        if len(mine) != 1 or any(one.kind != "note" for one in bad):
            return [], []
        before = text.count("\n", 0, begin)
        sets += [replace(one, line=(one.line or 1) + before) for one in mine]
        problems += [replace(one, line=(one.line or 1) + before) for one in bad]
    return sets, problems


def _from_json(text: str, file: str, norad_id: int) -> tuple[list[ElementSet], list[Problem]]:
    """Flat objects in a list; others are left to the whole reading."""
    sets: list[ElementSet] = []
    problems: list[Problem] = []
    decoder = json.JSONDecoder()
    for found in re.finditer(rf'"NORAD_CAT_ID"\s*:\s*"?0*{norad_id}"?\s*[,}}]', text):
        begin = text.rfind("{", 0, found.start())
        try:
            _, end = decoder.raw_decode(text, begin) if begin >= 0 else (None, 0)
        except ValueError:
            return [], []
        mine, bad = parse_omm(text[begin:end], file)
        if len(mine) != 1 or any(one.kind != "note" for one in bad):
            return [], []
        record = text.count("{", 0, begin) + 1
        sets += [replace(one, record=record) for one in mine]
        problems += [replace(one, record=record) for one in bad]
    return sets, problems


def _from_csv(text: str, file: str, norad_id: int, header: str) -> tuple[list[ElementSet], list[Problem]]:
    sets: list[ElementSet] = []
    problems: list[Problem] = []
    for found in re.finditer(rf"^.*,{norad_id},.*$", text, re.MULTILINE):
        mine, bad = parse_omm(f"{header.strip()}\n{found[0]}\n", file)
        if len(mine) != 1 or any(one.kind != "note" for one in bad):
            return [], []
        line = text.count("\n", 0, found.start()) + 1
        sets += [
            replace(one, line=line) for one in mine if one.norad_id == norad_id
        ]  # the number may be another column's
        problems += [replace(one, line=line) for one in bad]
    return sets, problems
