"""Rows of a table of positions, of whatever format, made into segments: parted at gaps, given velocities."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from acu_daemon.orbit.element_set import Problem, place
from acu_daemon.orbit.ephemeris_segment import LEAST_POSITIONS, EphemerisSegment, better_velocities_m_s, velocities_m_s
from acu_daemon.orbit.oem_text import BadSegmentError
from acu_daemon.units import Array

_GAP_STEPS = 2.5  # states farther apart than so many usual steps, one missing at most: a gap is between them
_SAME_M = 1.0
LARGEST = 1e12  # of a number in a file, whatever its unit: nothing that orbits the Earth is so far
_LEAST_STATES = 2

Vector = tuple[float, float, float]


@dataclass(slots=True)
class PositionRows:
    """A satellite's rows as they are read: metres, m/s; a velocity is None where the file has none there."""

    lines: list[int] = field(default_factory=list)
    tai_s: list[float] = field(default_factory=list)
    r_m: list[Vector] = field(default_factory=list)
    v_m_s: list[Vector | None] = field(default_factory=list)

    def add(self, line: int, tai_s: float, r_m: Vector) -> None:
        """A position; one that stands twice is left out.  BadSegmentError: the times do not rise."""
        if self.tai_s and tai_s <= self.tai_s[-1]:
            is_same = tai_s == self.tai_s[-1]
            if is_same and np.abs(np.subtract(r_m, self.r_m[-1])).max() <= _SAME_M:
                return
            two = ": two positions at one time, and they differ" if is_same else ""
            raise BadSegmentError(f"the times must rise, this one does not{two}", line)
        self.lines.append(line)
        self.tai_s.append(tai_s)
        self.r_m.append(r_m)
        self.v_m_s.append(None)


Maker = Callable[[int, Array, Array, Array], EphemerisSegment]  # from the line and the states


def segments_of(rows: PositionRows, file: str, make: Maker) -> tuple[list[EphemerisSegment], list[Problem]]:
    """Part the rows at gaps and make a segment of each part; a part that is too short is a problem with its line."""
    found: list[EphemerisSegment] = []
    problems: list[Problem] = []
    if not rows.tai_s:
        return found, problems
    tai_s, r_m = np.array(rows.tai_s), np.array(rows.r_m)
    steps_s = np.diff(tai_s)
    gaps = np.flatnonzero(steps_s > _GAP_STEPS * np.median(steps_s)) + 1 if steps_s.size else np.array([], dtype=int)
    for first, end in zip([0, *gaps.tolist()], [*gaps.tolist(), tai_s.size], strict=True):
        line = rows.lines[first]
        given = [one for one in rows.v_m_s[first:end] if one is not None]
        has_velocities = len(given) == end - first
        least = _LEAST_STATES if has_velocities else LEAST_POSITIONS
        if end - first < least:
            what = "states" if has_velocities else "positions without velocities"
            problems.append(Problem(file, line, f"{end - first} {what} in a row, at least {least} are needed"))
            continue
        times_s, places_m = tai_s[first:end], r_m[first:end]
        found.append(make(line, times_s, places_m, velocities_of(times_s, places_m, given if has_velocities else None)))
    return found, problems


def velocities_of(tai_s: Array, r_m: Array, given_m_s: list[Vector] | Array | None) -> Array:
    """Velocities (N, 3) of positions (N, 3), with what a file gives of them or without."""
    if given_m_s is None:
        return velocities_m_s(tai_s, r_m)
    return better_velocities_m_s(tai_s, r_m, np.asarray(given_m_s))


def at(file: str, line: int, text: str) -> str:
    """A note with its place."""
    return f"{place(file, line, None)}: {text}"
