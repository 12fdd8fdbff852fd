"""Paths of fifth-order polynomials, joined so that value, rate and acceleration are continuous.

A path is what its joints are: value, rate and acceleration at each make every piece by quintic Hermite interpolation.
These are all piecewise quintics with two continuous derivatives, the splines with knots of multiplicity three.
Pieces fitted one by one would jump where they meet.
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
import numpy.typing as npt

from acu_daemon.units import Array

_HERMITE = np.array(  # rows: value, rate, acceleration at the start, then at the end; columns: powers of u in 0..1
    [
        [1.0, 0.0, 0.0, -10.0, 15.0, -6.0],
        [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
        [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
        [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
        [0.0, 0.0, 0.0, -4.0, 7.0, -3.0],
        [0.0, 0.0, 0.0, 0.5, -1.0, 0.5],
    ]
)
_POWERS = np.arange(6)

Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Path:
    """Polynomials of one angle, degrees, in the seconds since each piece's start."""

    start_s: Array  # (n,), since the pass' first sample
    length_s: Array  # (n,)
    coefficients: Array  # (n, 6), rising powers

    def value(self, time_s: Array, derivative: int = 0) -> Array:
        """The angle, or its first or second derivative, at times (N,) since the pass' first sample."""
        piece = np.clip(np.searchsorted(self.start_s, time_s, side="right") - 1, 0, self.start_s.size - 1)
        tau = time_s - self.start_s[piece]
        coefficients = _derived(self.coefficients, derivative)[piece]
        value = np.zeros_like(tau)
        for k in range(coefficients.shape[1] - 1, -1, -1):
            value = value * tau + coefficients[:, k]
        return value

    def joints_deg(self, derivative: int = 0) -> Array:
        """How far value, rate or acceleration jump where two pieces meet, (n - 1,)."""
        coefficients = _derived(self.coefficients, derivative)
        powers = self.length_s[:, None] ** np.arange(coefficients.shape[1])
        jumps: Array = coefficients[1:, 0] - (coefficients * powers).sum(axis=1)[:-1]
        return jumps

    @property
    def knots(self) -> "Knots":
        return Knots(np.append(self.start_s, self.start_s[-1] + self.length_s[-1]))

    def cut(self, start_s: Array, end_s: float) -> "Path":
        """The same path in pieces that start at (M,) and end with the next one or at end_s; none may span a joint."""
        piece = self.knots.piece_of(start_s)
        offset = (start_s - self.start_s[piece])[:, None]
        moved = [
            (_derived(self.coefficients, k)[piece] * offset ** np.arange(6 - k)).sum(axis=1) / factorial(k)
            for k in range(6)
        ]
        return Path(start_s, np.diff(np.append(start_s, end_s)), np.stack(moved, axis=1))


def _derived(coefficients: Array, derivative: int) -> Array:
    for _ in range(derivative):
        coefficients = coefficients[:, 1:] * np.arange(1, coefficients.shape[1])
    return coefficients


@dataclass(frozen=True)
class Knots:
    """Where the pieces begin and end.  Unknowns: three for each knot, scaled by the longest piece's length."""

    time_s: Array  # (n + 1,)

    @property
    def count(self) -> int:
        """Of unknowns."""
        return 3 * int(self.time_s.size)

    @cached_property
    def length_s(self) -> Array:
        return np.diff(self.time_s)

    @cached_property
    def scale_s(self) -> float:
        return float(self.length_s.max())

    def piece_of(self, time_s: Array) -> Indices:
        """The piece (N,) of each time."""
        found = np.searchsorted(self.time_s, time_s, side="right") - 1
        return np.clip(found, 0, self.length_s.size - 1)

    def basis(self, time_s: Array, derivative: int = 0) -> Array:
        """What each of the six unknowns of its piece adds at a time, (N, 6)."""
        piece = self.piece_of(time_s)
        h = self.length_s[piece]
        u = (time_s - self.time_s[piece]) / h
        factors = np.ones(6)
        for k in range(derivative):
            factors = factors * np.maximum(_POWERS - k, 0)
        powers = u[:, None] ** np.maximum(_POWERS - derivative, 0) * factors
        share = (h / self.scale_s)[:, None] ** np.array([0, 1, 2, 0, 1, 2])
        basis: Array = (powers @ _HERMITE.T) * share / h[:, None] ** derivative
        return basis

    def path(self, unknowns: Array) -> Path:
        """The path of the unknowns (3 (n + 1),)."""
        local = self._local(unknowns)
        h = self.length_s[:, None]
        share = (h / self.scale_s) ** np.array([0, 1, 2, 0, 1, 2])
        return Path(self.time_s[:-1], self.length_s, (local * share) @ _HERMITE / h**_POWERS)

    def _local(self, unknowns: Array) -> Array:
        joints = unknowns.reshape(-1, 3)
        return np.concatenate([joints[:-1], joints[1:]], axis=1)


class Rows:
    """Linear forms of the unknowns of a path, and of one more unknown, in the order of their pieces.

    Each row is a basis of six unknowns and a coefficient of the extra one.
    """

    def __init__(self, knots: Knots, piece: Indices, basis: Array, extra: Array) -> None:
        """Rows (R,) in any order.  `order` says where each went."""
        self.order = np.argsort(piece, kind="stable")
        self.knots = knots
        self._piece, self._basis, self._extra = piece[self.order], basis[self.order], extra[self.order]
        count = knots.length_s.size
        self._starts = np.searchsorted(self._piece, np.arange(count))
        self._is_empty = np.bincount(self._piece, minlength=count) == 0
        self._outer = (self._basis[:, :, None] * self._basis[:, None, :]).reshape(-1, 36)

    def dot(self, x: Array) -> Array:
        """Values (R,) of the forms; x: the unknowns and the extra one."""
        joints = x[:-1].reshape(-1, 3)
        local = np.concatenate([joints[:-1], joints[1:]], axis=1)[self._piece]
        value: Array = np.einsum("rk,rk->r", local, self._basis) + self._extra * x[-1]
        return value

    def transposed_dot(self, y: Array) -> Array:
        """The forms' sum with the weights (R,)."""
        return np.append(self._gathered(self._basis * y[:, None]), self._extra @ y)

    def gram(self, weight: Array) -> Array:
        """The forms' weighted products, (K, K)."""
        blocks = self._summed(self._outer * weight[:, None]).reshape(-1, 6, 6)
        n = blocks.shape[0]
        full = np.zeros((n + 1, 3, n + 1, 3))
        i = np.arange(n)
        full[i, :, i, :] += blocks[:, :3, :3]
        full[i + 1, :, i + 1, :] += blocks[:, 3:, 3:]
        full[i, :, i + 1, :] += blocks[:, :3, 3:]
        full[i + 1, :, i, :] += blocks[:, 3:, :3]
        count = self.knots.count
        matrix = np.zeros((count + 1, count + 1))
        matrix[:count, :count] = full.reshape(count, count)
        edge = weight * self._extra
        matrix[:count, count] = matrix[count, :count] = self._gathered(self._basis * edge[:, None])
        matrix[count, count] = edge @ self._extra
        return matrix

    def _gathered(self, rows: Array) -> Array:
        sums = self._summed(rows)
        out = np.zeros((sums.shape[0] + 1, 3))
        out[:-1] += sums[:, :3]
        out[1:] += sums[:, 3:]
        return out.ravel()

    def _summed(self, rows: Array) -> Array:
        """Sums of the rows of each piece."""
        padded = np.concatenate([rows, np.zeros((1, rows.shape[1]))])
        sums: Array = np.add.reduceat(padded, self._starts, axis=0)
        sums[self._is_empty] = 0.0
        return sums
