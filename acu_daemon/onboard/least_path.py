"""The quietest path between two bounds: first the least largest rate, then the least acceleration at that rate.

Choosing and smoothing are one step: a path that is smoothed afterwards leaves the margin.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.onboard.interior_point import solve
from acu_daemon.onboard.quintic import Indices, Knots, Path, Rows
from acu_daemon.units import Array

_OVER_RATE = 1.002  # of the least rate: room for a smaller acceleration
_OVER_DEG_S = 1e-4

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Band:
    """Bounds of an angle at times (N,), infinite where there is none, and what its motion is held to.

    goal: where the largest rate is to be least; elsewhere only `cap_deg_s` holds (infinite: none), there too.
    """

    time_s: Array
    lower_deg: Array
    upper_deg: Array
    goal: Mask
    cap_deg_s: float = np.inf
    cap_deg_s2: float = np.inf


def least_path(band: Band, knots: Knots, guess_deg: Array) -> Path | None:
    """The path, or None where none of these pieces stays within the bounds.

    guess_deg: (N,), any path near the bounds.
    """
    problem = _Problem(band, knots)
    start = problem.near(guess_deg)
    rate = 0.0
    if band.goal.any():
        slope = np.einsum("rk,rk->r", problem.local(start), problem.rates)
        start[-1] = 1.1 * float(np.abs(slope).max()) + 0.01
        aim = np.zeros(knots.count + 1)
        aim[-1] = 1.0
        found = solve(np.zeros((knots.count + 1, knots.count + 1)), aim, *problem.bounds(None), start)
        if found is None:
            return None
        start, rate = found, float(found[-1])
    smooth = problem.acceleration_gram
    smooth[-1, -1] = 1.0
    start[-1] = 0.0
    aim = np.zeros(knots.count + 1)
    found = solve(smooth, aim, *problem.bounds(rate * _OVER_RATE + _OVER_DEG_S), start)
    return None if found is None else knots.path(found[:-1])


def nearest_path(time_s: Array, angle_deg: Array, knots: Knots, cap_deg_s: float, cap_deg_s2: float) -> Path | None:
    """The path nearest to angles (N,), in the least squares, whose rate and acceleration keep to the caps."""
    nowhere = np.full(time_s.size, np.inf)
    problem = _Problem(Band(time_s, -nowhere, nowhere, np.zeros(time_s.size, bool), cap_deg_s, cap_deg_s2), knots)
    start = problem.near(angle_deg)
    if np.isinf(cap_deg_s) and np.isinf(cap_deg_s2):
        return knots.path(start[:-1])
    pull = problem.value_gram
    pull[-1, -1] = 1.0
    found = solve(pull, -pull @ start, *problem.bounds(0.0), start)
    return None if found is None else knots.path(found[:-1])


class _Problem:
    """The band in terms of the unknowns."""

    def __init__(self, band: Band, knots: Knots) -> None:
        self._band, self._knots = band, knots
        self._piece = knots.piece_of(band.time_s)
        self._values, self.rates, self._accelerations = (knots.basis(band.time_s, k) for k in range(3))

    def local(self, x: Array) -> Array:
        """The six unknowns (N, 6) at each time."""
        joints = x[:-1].reshape(-1, 3)
        return np.concatenate([joints[:-1], joints[1:]], axis=1)[self._piece]

    @property
    def value_gram(self) -> Array:
        return self._gram(self._values)

    @property
    def acceleration_gram(self) -> Array:
        return self._gram(self._accelerations) / self._band.time_s.size

    def near(self, angle_deg: Array) -> Array:
        """Unknowns of the smooth path near angles (N,), and 0 for the extra one."""
        rows = Rows(self._knots, self._piece, self._values, np.zeros(angle_deg.size))
        matrix = rows.gram(np.ones(angle_deg.size)) + 1e-6 * self._gram(self._accelerations)
        matrix[np.diag_indices_from(matrix)] += 1e-9
        return np.linalg.solve(matrix, rows.transposed_dot(angle_deg[rows.order])).astype(np.float64, copy=False)

    def bounds(self, rate_deg_s: float | None) -> tuple[Rows, Array]:
        """Rows and their bounds: with a rate, the goal keeps to it; without, to the extra unknown."""
        band = self._band
        blocks: list[tuple[Indices, Array, Array, Array]] = []
        for sign, limit in ((1.0, band.upper_deg), (-1.0, -band.lower_deg)):
            blocks.append(self._block(self._values, sign, np.isfinite(limit), limit, 0.0))
            if rate_deg_s is None:
                blocks.append(self._block(self.rates, sign, band.goal, np.zeros(limit.size), -1.0))
            elif band.goal.any():
                blocks.append(self._block(self.rates, sign, band.goal, np.full(limit.size, rate_deg_s), 0.0))
            for basis, cap in ((self.rates, band.cap_deg_s), (self._accelerations, band.cap_deg_s2)):
                if np.isfinite(cap):
                    blocks.append(self._block(basis, sign, np.ones(limit.size, bool), np.full(limit.size, cap), 0.0))
        piece, basis, bound, extra = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        rows = Rows(self._knots, piece, basis, extra)
        return rows, bound[rows.order]

    def _block(
        self, basis: Array, sign: float, mask: Mask, limit: Array, extra: float
    ) -> tuple[Indices, Array, Array, Array]:
        return self._piece[mask], sign * basis[mask], limit[mask], np.full(int(mask.sum()), extra)

    def _gram(self, basis: Array) -> Array:
        return Rows(self._knots, self._piece, basis, np.zeros(basis.shape[0])).gram(np.ones(basis.shape[0]))
