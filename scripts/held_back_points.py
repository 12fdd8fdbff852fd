#!/usr/bin/env python3
"""How far an ephemeris is off its own points, each taken out of the file in turn: leave-one-out, in metres.

    .venv/bin/python scripts/held_back_points.py                    the CPF and SP3 files of ../shared/data/orbits
    .venv/bin/python scripts/held_back_points.py FILE ...           others: CPF, SP3 or OEM (KVN), gzip too
    .venv/bin/python scripts/held_back_points.py --spare 1 FILE     the second point from each end as well

A point that is taken out doubles the step around it, so that the ephemeris as it is does better.  Next to an end the
polynomials lean to one side; two points at each end are spared unless --spare says otherwise.
"""

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tables.console import say

from acu_daemon.edge.orbit_file import EPHEMERIS_PARSERS, read_orbit_file
from acu_daemon.errors import ElementsError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.ephemeris import Ephemeris
from acu_daemon.orbit.ephemeris_segment import LEAST_POSITIONS, EphemerisSegment
from acu_daemon.orbit.ephemeris_states import states_teme
from acu_daemon.units import Array

ORBITS = Path(__file__).resolve().parents[2] / "shared" / "data" / "orbits"
APART = 26  # points that are taken out together: farther apart than the polynomials reach
NO_ORIENTATION = EarthOrientation()
POINTS = {  # where a point begins, and the lines that belong to it
    "cpf": (re.compile(r"10\s"), re.compile(r"20\s")),
    "sp3": (re.compile(r"\*"), re.compile(r"[PVE]")),
    "oem": (re.compile(r"\s*\d{4}-"), re.compile(r"(?!)")),
}


def without(text: str, kind: str, held: set[int]) -> str:
    """The text of a file without some of its points, counted from 0."""
    begins, belongs = POINTS[kind]
    kept, count, is_held = [], -1, False
    for line in text.split("\n"):
        if begins.match(line):
            count += 1
            is_held = count in held
        elif not belongs.match(line) or line.startswith("EOF"):
            is_held = False
        if not is_held:
            kept.append(line)
    return "\n".join(kept)


def held_back_m(text: str, kind: str, segment: EphemerisSegment, spare: int = 2) -> Array:
    """How far the ephemeris is off each point of a segment but `spare` ones at each end, in metres.

    The points of the file must be the segment's.  ElementsError: what is left is no orbit.
    """
    inside = np.arange(spare, segment.tai_s.size - spare)
    off_m = np.empty(inside.size)
    truth_m, _ = states_teme(segment, NO_ORIENTATION)
    for first in range(min(APART, inside.size)):
        held = inside[first::APART]
        segments, _ = EPHEMERIS_PARSERS[kind](without(text, kind, set(held.tolist())), segment.file)
        mine = [one for one in segments if one.label == segment.label]
        made_m, _ = Ephemeris(mine, NO_ORIENTATION).states(segment.tai_s[held])
        off_m[first::APART] = np.linalg.norm(made_m - truth_m[held], axis=1)
    return off_m


def told(path: Path, spare: int) -> Iterator[str]:
    """A line for each satellite of a file.  ElementsError, OSError: it cannot be read."""
    kind, text = read_orbit_file(path)
    if kind not in EPHEMERIS_PARSERS:
        raise ElementsError(f"{path}: elements ({kind}), no ephemeris")
    segments, problems = EPHEMERIS_PARSERS[kind](text, str(path))
    yield from map(str, problems[:3])
    point_count = sum(1 for line in text.split("\n") if POINTS[kind][0].match(line))
    for segment in segments:
        count = segment.tai_s.size
        if count <= LEAST_POSITIONS or count != point_count:
            yield f"{path.name} {segment.label}: {count} of {point_count} points in a row: none is held back"
            continue
        off_m, step_s = held_back_m(text, kind, segment, spare), float(np.median(np.diff(segment.tai_s)))
        yield (
            f"{path.name} {segment.label}: {off_m.size} points held back, {step_s:g} s steps: "
            f"median {np.median(off_m):.4f} m, worst {off_m.max():.3f} m"
        )


def main() -> None:
    """Print the lines of all files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--spare", type=int, default=2, metavar="N", help="points at each end that stay (default 2)")
    asked = parser.parse_args()
    files = asked.files or sorted([*ORBITS.glob("*cpf*"), *ORBITS.glob("*.sp3")])
    if not files:
        parser.error(f"name a FILE: {ORBITS} is absent")
    for path in files:
        try:
            for line in told(path, max(asked.spare, 1)):
                say(line)
        except (ElementsError, OSError) as error:
            parser.error(str(error))


if __name__ == "__main__":
    main()
