"""Estimators side by side on one recording: how far each one's predictions are from the readings.  Pure."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from acu_daemon.assist.reading_gate import Dwell
from acu_daemon.assist.session.replay_readings import Replayed
from acu_daemon.model import FitResult, Reading, sky_angle_deg
from acu_daemon.units import Array

GAP_S = 6.0  # readings come at least every 5 s
MOST_ALONG_S = 300.0
MOST_ACROSS_DEG = 15.0
MOST_OFF_DEG = 60.0
LOWEST_DEG = -10.0


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
    by reason.  tracked: the errors at the locked readings, whatever is compared.  losses_tai_s: spans without lock;
    gaps_tai_s: spans without any line, as where the daemon was stopped.
    """

    is_held_back: bool
    errors: dict[str, Errors]
    last_fit: dict[str, FitResult | None]
    left_out: dict[str, dict[str, int]]
    tracked: dict[str, Errors] = field(default_factory=dict)
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
    is_held_back = any(k >= begin for k in held_back)
    chosen = [k for k in (held_back if is_held_back else locked) if k >= begin]
    spans = _spans(lines)
    return Comparison(
        tracked={name: _errors(lines, one, [k for k in locked if k >= begin]) for name, one in results.items()},
        losses_tai_s=spans[0],
        gaps_tai_s=spans[1],
        is_held_back=is_held_back,
        errors={name: _errors(lines, one, chosen) for name, one in results.items()},
        last_fit={name: one[-1].fit if one else None for name, one in results.items()},
        left_out={name: one[-1].left_out if one else {} for name, one in results.items()},
    )


def why_not_this_satellite(lines: list[tuple[float, Reading | None]], results: list[Replayed]) -> str:
    """Why the readings are probably not of the satellite whose elements they were replayed on; "": they may well be.

    Elements that are weeks old are seconds late and a few degrees off; what needs minutes, or tens of degrees, to fit
    is another satellite, however well it fits then.
    """
    fit = next((one.fit for one in reversed(results) if one.fit is not None), None)
    if fit is not None and (abs(fit.along_s) > MOST_ALONG_S or abs(fit.across_deg) > MOST_ACROSS_DEG):
        when = "late" if fit.along_s >= 0 else "early"
        return f"to fit them it has to be {abs(fit.along_s):.0f} s {when} and {fit.across_deg:+.1f} deg across"
    for (_, reading), one in zip(lines, results, strict=True):
        if reading is not None and reading.is_locked and one.fit is None:
            off_deg = sky_angle_deg(reading.az_deg, reading.el_deg, one.az_deg, one.el_deg)
            if off_deg > MOST_OFF_DEG or one.el_deg < LOWEST_DEG:
                return f"at their first lock the elements have it {off_deg:.0f} deg away, at elevation {one.el_deg:.0f}"
            return ""
    return ""


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
