"""Estimators side by side on one recording: how far each one's predictions are from the readings.  Pure."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from acu_daemon.assist.reading_gate import Dwell
from acu_daemon.assist.session.replay_readings import Replayed
from acu_daemon.model import FitResult, Reading, Readings, sky_angle_deg
from acu_daemon.units import DEG, Array

GAP_S = 6.0  # readings come at least every 5 s
FOLLOW_S = 5.0  # to each side: over so long the antenna's way is compared with the path's
FOLLOW_SHARE, FOLLOW_DEG = 0.5, 0.1  # of the path's way it may lack, and what noise may make


@dataclass(frozen=True, slots=True)
class Errors:
    """Angles on the sky between prediction and reading, (N,), at the lines that are compared."""

    tai_s: Array
    error_deg: Array


@dataclass(frozen=True, slots=True)
class Comparison:
    """Estimators by name.

    is_held_back: the compared readings are those without lock after the first one with, which no estimator has seen;
    else those with lock, each predicted from the ones up to a second before.  left_out: readings that no fit has seen,
    by reason.  tracked: the errors at the locked readings, whatever is compared.  stray_count, strays_tai_s: readings
    without lock, and their spans, that are not compared, since the antenna did not follow the path, as after a stop.
    losses_tai_s: spans without lock; gaps_tai_s: spans without any line, as where the daemon was stopped.
    """

    is_held_back: bool
    errors: dict[str, Errors]
    last_fit: dict[str, FitResult | None]
    left_out: dict[str, dict[str, int]]
    tracked: dict[str, Errors] = field(default_factory=dict)
    strays_tai_s: list[tuple[float, float]] = field(default_factory=list)
    stray_count: int = 0
    losses_tai_s: list[tuple[float, float]] = field(default_factory=list)
    gaps_tai_s: list[tuple[float, float]] = field(default_factory=list)

    @property
    def line_count(self) -> int:
        return next(iter(self.errors.values())).tai_s.size


def compare(
    lines: list[tuple[float, Reading | None]], results: dict[str, list[Replayed]], lock_dwell_s: float
) -> Comparison:
    """Compare at the same lines for all: with angles, and after the first fit of every estimator that has one."""
    held_back, locked = _kinds(lines, lock_dwell_s)
    begin = max(_first_fit(one) for one in results.values())
    strays = sorted(set(held_back).intersection(*(_strays(lines, one, held_back) for one in results.values())))
    held_back = sorted(set(held_back).difference(strays))
    is_held_back = any(k >= begin for k in held_back)
    chosen = [k for k in (held_back if is_held_back else locked) if k >= begin]
    spans = _spans(lines)
    return Comparison(
        tracked={name: _errors(lines, one, [k for k in locked if k >= begin]) for name, one in results.items()},
        losses_tai_s=spans[0],
        gaps_tai_s=spans[1],
        strays_tai_s=_runs(lines, strays),
        stray_count=len(strays),
        is_held_back=is_held_back,
        errors={name: _errors(lines, one, chosen) for name, one in results.items()},
        last_fit={name: one[-1].fit if one else None for name, one in results.items()},
        left_out={name: one[-1].left_out if one else {} for name, one in results.items()},
    )


def locked_readings(lines: list[tuple[float, Reading | None]], lock_dwell_s: float) -> Readings:
    """The readings that are locked for the dwell."""
    locked = _kinds(lines, lock_dwell_s)[1]
    return Readings.of(reading for k in locked if (reading := lines[k][1]) is not None)


def what_is_left_out(counts: dict[str, int]) -> str:
    """Counts by reason, the most frequent first, in one line."""
    return ", ".join(f"{counts[one]} {one}" for one in sorted(counts, key=lambda one: -counts[one])) or "none"


def _kinds(lines: list[tuple[float, Reading | None]], lock_dwell_s: float) -> tuple[list[int], list[int]]:
    """Lines with angles: without lock after the first lock, and locked for the dwell."""
    dwell = Dwell(lock_dwell_s)
    held_back: list[int] = []
    locked: list[int] = []
    for k, (_, reading) in enumerate(lines):
        if reading is None:
            continue
        if dwell.is_locked(reading):
            locked.append(k)
        elif locked and not reading.is_locked:
            held_back.append(k)
    return held_back, locked


def _strays(lines: list[tuple[float, Reading | None]], results: list[Replayed], held_back: list[int]) -> set[int]:
    """The held-back lines around which the antenna moved unlike the path: it stood still, or went elsewhere."""
    strays: set[int] = set()
    for run in _unbroken(lines, held_back):
        tai_s = np.array([lines[k][0] for k in run])
        seen = _unit_vectors([(one.az_deg, one.el_deg) for k in run if (one := lines[k][1]) is not None])
        path = _unit_vectors([(results[k].az_deg, results[k].el_deg) for k in run])
        count = len(run)
        first = np.minimum(np.searchsorted(tai_s, tai_s - FOLLOW_S), np.maximum(np.arange(count) - 1, 0))
        last = np.searchsorted(tai_s, tai_s + FOLLOW_S, side="right") - 1
        last = np.maximum(last, np.minimum(np.arange(count) + 1, count - 1))
        way = path[last] - path[first]
        lacks = np.linalg.norm(seen[last] - seen[first] - way, axis=1)
        allowed = np.maximum(FOLLOW_SHARE * np.linalg.norm(way, axis=1), FOLLOW_DEG * DEG)
        strays.update(k for k, lack, most in zip(run, lacks, allowed, strict=True) if lack > most)
    return strays


def _unbroken(lines: list[tuple[float, Reading | None]], chosen: list[int]) -> list[list[int]]:
    """Runs of chosen lines with none with lock, and no gap, between."""
    runs: list[list[int]] = []
    for k in chosen:
        last = runs[-1][-1] if runs else None
        is_on = last is not None and lines[k][0] - lines[last][0] <= GAP_S
        between = lines[(last or 0) + 1 : k]
        if is_on and not any(one is not None and one.is_locked for _, one in between):
            runs[-1].append(k)
        else:
            runs.append([k])
    return runs


def _runs(lines: list[tuple[float, Reading | None]], chosen: list[int]) -> list[tuple[float, float]]:
    return [(lines[run[0]][0], lines[run[-1]][0]) for run in _unbroken(lines, chosen)]


def _unit_vectors(directions: list[tuple[float, float]]) -> Array:
    """Azimuths and elevations, degrees, as unit vectors (N, 3): east, north, up."""
    az, el = np.radians(np.array(directions).reshape(-1, 2)).T
    return np.stack((np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)), axis=1)


def _spans(lines: list[tuple[float, Reading | None]]) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Spans without lock, and spans without lines."""
    losses: list[tuple[float, float]] = []
    gaps = []
    for (before_s, before), (tai_s, _) in pairwise(lines):
        if tai_s - before_s > GAP_S:
            gaps.append((before_s, tai_s))
        elif before is None or not before.is_locked:
            is_same = bool(losses) and losses[-1][1] == before_s
            losses[-1 if is_same else len(losses) :] = [(losses[-1][0] if is_same else before_s, tai_s)]
    return losses, gaps


def _first_fit(results: list[Replayed]) -> int:
    return next((k for k, one in enumerate(results) if one.fit is not None), 0)


def _errors(lines: list[tuple[float, Reading | None]], results: list[Replayed], chosen: list[int]) -> Errors:
    rows = []
    for k in chosen:
        tai_s, reading = lines[k]
        if reading is not None:
            seen = results[k]
            rows.append((tai_s, sky_angle_deg(reading.az_deg, reading.el_deg, seen.az_deg, seen.el_deg)))
    tai, error = np.array(rows, dtype=np.float64).reshape(-1, 2).T
    return Errors(tai, error)
