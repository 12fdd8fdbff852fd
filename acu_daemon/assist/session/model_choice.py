"""Which model the prediction is made from: the elements alone, the last pass's fit, or the new one.  Pure.

The newest locked residuals decide; a new fit that is bad three times in a row starts afresh: docs/estimation.md, Model
choice.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.assist.screening.offsets import angles_deg
from acu_daemon.model import FitResult, Model, Readings, Site
from acu_daemon.orbit.propagator import Propagator

NEWEST_S = 5.0
RESET_AFTER_COUNT = 3
BAD_SIGMAS = 3.0  # a smaller residual is never bad
BAD_RATIO = 1.5  # nor one that is not so much larger than the best other model's


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """The model in use, and how often in a row the new fit was bad."""

    model: Model = Model.ELEMENTS
    bad_count: int = 0

    @property
    def is_reset_due(self) -> bool:
        return self.bad_count >= RESET_AFTER_COUNT


def choose(before: ModelChoice, residuals_deg: dict[Model, float], noise_deg: float) -> ModelChoice:
    """Choose by what each model leaves of the newest locked readings; the new fit wins unless it is bad.

    residuals_deg: such as `newest_residual_deg` gives, of the models there are, or of a good new fit alone.
    """
    best = min(residuals_deg, key=lambda one: residuals_deg[one])
    if Model.NEW_FIT not in residuals_deg:
        return ModelChoice(best)
    left_deg = residuals_deg[Model.NEW_FIT]
    is_bad = not is_good(left_deg, noise_deg) and left_deg > BAD_RATIO * residuals_deg[best]
    return ModelChoice(best, before.bad_count + 1) if is_bad else ModelChoice(Model.NEW_FIT)


def is_good(residual_deg: float, noise_deg: float) -> bool:
    """Whether a new fit wins, whatever the others leave."""
    return residual_deg <= BAD_SIGMAS * noise_deg


def newest_residual_deg(source: Propagator, site: Site, fit: FitResult | None, readings: Readings) -> float:
    """Robust mean of the angles on the sky between the newest readings and a model: their median.

    Raises:  OrbitError: the source has no answer for one of the times.
    """
    newest = readings.part(readings.tai_s >= readings.tai_s[-1] - NEWEST_S)
    return float(np.median(angles_deg(source, site, fit, newest)))
