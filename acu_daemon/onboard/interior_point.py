"""Convex quadratic programs over paths, by Mehrotra's predictor-corrector interior point.

    minimise 1/2 x' Q x + c' x   subject to   G x <= h

Source:  Mehrotra, On the Implementation of a Primal-Dual Interior Point Method, SIAM J. Optim. 2 (1992); the quadratic
         form as in Nocedal and Wright, Numerical Optimization, algorithm 16.4.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.onboard.quintic import Rows
from acu_daemon.units import Array

_LEAST_SLACK = 0.05  # degrees; nearer to the bounds the first steps are too short
_START = 0.1  # complementarity at first; too small a one never lets the multipliers grow
_MOST_STEPS = 60
_GAP, _RESIDUAL = 1e-5, 1e-6
_REGULAR = 1e-11
_LOST = 1e7  # multipliers or unknowns beyond: no point satisfies the bounds


def solve(q: Array, c: Array, rows: Rows, bound: Array, start: Array) -> Array | None:
    """The least x (K,), or None where the bounds leave no point or the iteration does not converge.

    bound: (R,) in the order of `rows`, finite.  start: a first guess of x; it may violate bounds.
    """
    x = start.copy()
    s = np.maximum(bound - rows.dot(x), _LEAST_SLACK)
    z = _START / s
    size = 1.0 + float(np.abs(c).max(initial=0.0))
    for _ in range(_MOST_STEPS):
        dual = q @ x + c + rows.transposed_dot(z)
        primal = rows.dot(x) + s - bound
        gap = float(s @ z) / bound.size
        is_met = np.abs(primal).max() < _RESIDUAL and np.abs(dual).max() < _RESIDUAL * size
        if is_met and gap * bound.size < _GAP * (1.0 + abs(float(c @ x + 0.5 * x @ q @ x))):
            return x
        matrix = q + rows.gram(z / s)
        matrix[np.diag_indices_from(matrix)] += _REGULAR * (1.0 + matrix.diagonal())
        try:
            inverse: Array = np.linalg.inv(matrix).astype(np.float64, copy=False)
        except np.linalg.LinAlgError:
            return None

        newton = _Newton(rows, s, z, dual, primal, inverse)
        _, ds, dz = newton.step(s * z)
        share = min(_longest(s, ds), _longest(z, dz))
        after = float((s + share * ds) @ (z + share * dz)) / bound.size
        centre = (after / gap) ** 3
        dx, ds, dz = newton.step(s * z + ds * dz - centre * gap)
        ahead, behind = 0.995 * _longest(s, ds), 0.995 * _longest(z, dz)
        if q.any():
            ahead = behind = min(ahead, behind)
        ahead, behind = min(1.0, ahead), min(1.0, behind)
        x, s, z = x + ahead * dx, s + ahead * ds, z + behind * dz
        if not np.isfinite(x).all() or np.abs(x).max() > _LOST or z.max() > _LOST * size:
            return None
    return None


@dataclass(frozen=True, slots=True)
class _Newton:
    """The linear system at one iterate: slacks s, multipliers z, residuals, and the inverse of its matrix."""

    rows: Rows
    s: Array
    z: Array
    dual: Array
    primal: Array
    inverse: Array

    def step(self, complement: Array) -> tuple[Array, Array, Array]:
        """Steps of x, s and z that take the products s z down by `complement`."""
        dx = self.inverse @ (-self.dual - self.rows.transposed_dot((self.z * self.primal - complement) / self.s))
        ds = -self.primal - self.rows.dot(dx)
        return dx, ds, (-complement - self.z * ds) / self.s


def _longest(value: Array, step: Array) -> float:
    """The share of a step, 1 at the most over 0.995, that keeps all values positive."""
    falling = step < 0.0
    return float(min(1.0 / 0.995, (-value[falling] / step[falling]).min(initial=np.inf)))
