"""By how much readings say less than their number: noise that goes on from one second to the next.  Pure.

The means of whole seconds are taken as an autoregressive process of first order: with r the correlation of successive
ones and c their variance by what white noise would leave, their sum has the variance of c (1 + r) / (1 - r) times as
few.  Both begin with what earlier passes showed, which counts like half a minute: a few seconds say little of it.
Theory: docs/estimation.md, Memory of the mount.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from acu_daemon.assist.estimators.full.normal_points import Points

_WORTH_COUNT = 30.0  # seconds
_LONGEST_STEP_S = 1.5  # between means of successive seconds
_MOST = 0.98


@dataclass(frozen=True, slots=True)
class NoiseCorrelation:
    """successive: r, 0 to 1; excess: c, 1 for white noise."""

    successive: float = 0.0
    excess: float = 1.0

    @property
    def factor(self) -> float:
        """By how much the variances of a fit are greater than with white noise."""
        return max(1.0, self.excess * (1.0 + self.successive) / (1.0 - self.successive))


WHITE = NoiseCorrelation()


def noise_correlation(points: "Points", fitted_count: float, known: NoiseCorrelation) -> NoiseCorrelation:
    """What the residuals of a fit show, with what is known already.  fitted_count: of the states, by the readings."""
    scaled = points.off * points.per_sigma
    is_some = points.per_sigma[0] > 1e-3 * float(points.per_sigma[0].max())  # a second of outliers has no weight
    is_next = (np.diff(points.tai_s) < _LONGEST_STEP_S) & is_some[1:] & is_some[:-1]
    squares = float(np.sum(scaled[:, is_some] ** 2))
    ends = (scaled[:, 1:] ** 2 + scaled[:, :-1] ** 2)[:, is_next] / 2.0
    products = float(np.sum((scaled[:, 1:] * scaled[:, :-1])[:, is_next]))
    free = max(2.0 * np.count_nonzero(is_some) - fitted_count, 1.0)
    excess = (squares + 2.0 * _WORTH_COUNT * known.excess) / (free + 2.0 * _WORTH_COUNT)
    level = max(squares / free, 1e-12)
    worth = 2.0 * _WORTH_COUNT
    successive = (products / level + worth * known.successive) / (float(np.sum(ends)) / level + worth)
    return NoiseCorrelation(float(min(max(successive, 0.0), _MOST)), float(max(excess, 1e-6)))
