"""SIMULATION of the sky: where the satellite really is, from a truth file or from an orbit of its own, in a vacuum.

Directions are geometric and true; between the nodes they are cubics through unit vectors, since a linear azimuth is
wrong by 0.06 deg at the zenith.  Asked fifty times a second, so a question costs microseconds.
"""

import csv
from bisect import bisect_right
from dataclasses import dataclass
from math import asin, atan2, degrees, radians, sin
from pathlib import Path
from typing import Protocol

import numpy as np

from acu_daemon.errors import UsageError
from acu_daemon.model import Correction, Site
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.propagator import Propagator, spans_tai_s
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DEG, Array

Direction = tuple[float, float, float]  # az_deg in [0, 360), el_deg, range_m
TRUTH_HEADER = ["utc", "az_deg", "el_deg", "range_km"]
_NODES = 4  # of a cubic
_BLOCK_S = 60.0
_BLOCK_STEP_S = 1.0


class SimulatedSky(Protocol):
    """Where the satellite is: what an antenna is given is where it appears (apparent_sky.py)."""

    def direction(self, tai_s: float) -> Direction | None:
        """True direction and range; None where the satellite is unknown or below the horizon."""


class DirectionTable:
    """Cubics through four directions each: azimuth, elevation (N,) in degrees, range (N,) in metres, times rising.

    lowest_el_deg: where the sky ends; below the horizon for one that air lifts.
    """

    def __init__(self, tai_s: Array, az_deg: Array, el_deg: Array, range_m: Array, lowest_el_deg: float = 0.0) -> None:
        self._least_up = sin(radians(lowest_el_deg))
        self.start_tai_s, self.end_tai_s = float(tai_s[0]), float(tai_s[-1])
        times = tai_s - tai_s[0]
        flat = np.cos(el_deg * DEG)
        values = np.stack((flat * np.sin(az_deg * DEG), flat * np.cos(az_deg * DEG), np.sin(el_deg * DEG), range_m))
        first = np.clip(np.arange(times.size - 1) - 1, 0, times.size - _NODES)
        t = times[first[:, None] + np.arange(_NODES)]
        d = values[:, first[:, None] + np.arange(_NODES)]
        coefficients = [d[..., 0]]
        for order in range(1, _NODES):  # Newton's divided differences
            d = (d[..., 1:] - d[..., :-1]) / (t[:, order:] - t[:, :-order])
            coefficients.append(d[..., 0])
        self._times: list[float] = times.tolist()
        self._nodes: list[list[float]] = t.tolist()
        self._cubics: list[list[list[float]]] = np.stack(coefficients).transpose(2, 1, 0).tolist()
        self._last = 0

    def direction(self, tai_s: float) -> Direction | None:
        """Interpolate; None outside the span or below the lowest elevation."""
        t = tai_s - self.start_tai_s
        times = self._times
        if not 0.0 <= t <= times[-1]:
            return None
        i = self._last
        if not times[i] <= t <= times[i + 1]:
            i = self._last = min(bisect_right(times, t), len(times) - 1) - 1
        t0, t1, t2, _ = self._nodes[i]
        u, v, w = t - t0, t - t1, t - t2
        east, north, up, range_m = (a + u * (b + v * (c + w * d)) for a, b, c, d in self._cubics[i])
        if up < self._least_up:
            return None
        return degrees(atan2(east, north)) % 360.0, degrees(asin(min(up, 1.0))), range_m


def read_truth(path: Path, lowest_el_deg: float = 0.0) -> DirectionTable:
    """Read a truth CSV (TRUTH_HEADER), whose directions are geometric.  UsageError: names file and line."""
    rows: list[tuple[float, float, float, float]] = []
    try:
        file = path.open(newline="", encoding="utf-8", errors="replace")
    except OSError as error:
        raise UsageError(f"--truth {path}: {error.strerror}") from None
    with file:
        lines = csv.reader(file)
        if (header := next(lines, [])) != TRUTH_HEADER:
            raise UsageError(f"{path}, line 1: header {','.join(header)!r}, expected {','.join(TRUTH_HEADER)!r}")
        for number, line in enumerate(lines, start=2):
            try:
                utc, az_deg, el_deg, range_km = line
                row = tai_from_utc(utc), float(az_deg), float(el_deg), 1e3 * float(range_km)
            except ValueError as error:
                raise UsageError(f"{path}, line {number}: {error}") from None
            if not np.all(np.isfinite(row)):
                raise UsageError(f"{path}, line {number}: every number must be finite")
            if rows and row[0] <= rows[-1][0]:
                raise UsageError(f"{path}, line {number}: the times must rise, {utc} does not")
            rows.append(row)
    if len(rows) < _NODES:
        raise UsageError(f"{path}: {len(rows)} lines of data, at least {_NODES} are needed for a cubic")
    tai_s, az_deg, el_deg, range_m = np.array(rows).T
    return DirectionTable(tai_s, az_deg, el_deg, range_m, lowest_el_deg)


@dataclass(frozen=True, slots=True)
class DelayedPropagator:
    """A satellite that runs late (+) or early (-) on the orbit of another."""

    source: Propagator
    delay_s: float

    @property
    def kind(self) -> str:
        return self.source.kind

    @property
    def epoch_tai_s(self) -> float:
        return self.source.epoch_tai_s

    @property
    def spans_tai_s(self) -> tuple[tuple[float, float], ...]:
        return tuple((start + self.delay_s, end + self.delay_s) for start, end in spans_tai_s(self.source))

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        return self.source.states_teme(tai_s - self.delay_s)

    def corrected(self, correction: Correction) -> "DelayedPropagator":
        return DelayedPropagator(self.source.corrected(correction), self.delay_s)


class OrbitSky:
    """A sky from a propagator, computed a block at a time."""

    def __init__(self, propagator: Propagator, site: Site, lowest_el_deg: float = 0.0) -> None:
        self._propagator = propagator
        self._lowest_el_deg = lowest_el_deg
        self._site = site
        self._block: DirectionTable | None = None

    def direction(self, tai_s: float) -> Direction | None:
        """Interpolate; None below the lowest elevation or outside the propagator's spans.

        Raises:  OrbitError: the propagator has no answer.
        """
        block = self._block
        if block is None or not block.start_tai_s <= tai_s <= block.end_tai_s:
            span = next((one for one in spans_tai_s(self._propagator) if one[0] <= tai_s <= one[1]), None)
            if span is None:
                return None
            block = self._block = self._compute(tai_s, *span)
        return block.direction(tai_s)

    def _compute(self, tai_s: float, span_start_tai_s: float, span_end_tai_s: float) -> DirectionTable:
        start_s = tai_s // _BLOCK_S * _BLOCK_S - _BLOCK_STEP_S
        start_tai_s = max(start_s, span_start_tai_s)
        end_tai_s = min(start_s + _BLOCK_S + 2 * _BLOCK_STEP_S, span_end_tai_s)
        count = max(_NODES, 1 + round((end_tai_s - start_tai_s) / _BLOCK_STEP_S))
        times = np.linspace(start_tai_s, end_tai_s, count)
        look = look_at(self._propagator, times, self._site)
        return DirectionTable(times, look.az_deg, look.el_deg, look.range_m, self._lowest_el_deg)
