"""How far from its prediction a satellite may be, along the track and across it, 1 sigma.  Pure."""

from functools import lru_cache
from math import cos, hypot, radians

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import make_prior
from acu_daemon.assist.mount_model import sky_covariance
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Correction, FitResult, Prediction, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array

SLOWEST_DEG_S = 0.005  # below it, seconds along the track mean nothing
_SAME_S = 3600.0  # elements' worth changes over days


def spread_of(
    source: Propagator,
    site: Site,
    settings: EstimatorSettings,
    fit: FitResult | None,
    buffer: Prediction,
    tai_s: float,
) -> tuple[float, float] | None:
    """Seconds along and degrees across at an instant of a buffer; None outside it.

    fit: what the prediction is made from; None: the elements alone, which are worth what their kind and age say.  None
    for a fit without a covariance, and where a satellite stands still in the sky.
    Raises:  OrbitError: the source has no answer near the instant.
    """
    at = buffer.at(tai_s)
    if at is None:
        return None
    right, up = at.az_rate_deg_s * cos(radians(at.el_deg)), at.el_rate_deg_s
    speed = hypot(right, up)
    if fit is None:
        fit = _elements_alone(source, settings, _SAME_S * round(tai_s / _SAME_S))
    if fit.covariance is None or speed < SLOWEST_DEG_S:
        return None
    times = np.array([buffer.start_tai_s, tai_s, buffer.end_tai_s])  # on the grid that its sigma is computed on
    rr, ru, uu = (float(one[1]) for one in sky_covariance(source, times, site, fit))
    c, s = right / speed, up / speed
    along2, across2 = c * c * rr + 2.0 * c * s * ru + s * s * uu, s * s * rr - 2.0 * c * s * ru + c * c * uu
    return float(np.sqrt(max(along2, 0.0))) / DEG / speed, float(np.sqrt(max(across2, 0.0))) / DEG


@lru_cache(maxsize=4)
def _elements_alone(source: Propagator, settings: EstimatorSettings, tai_s: float) -> FitResult:
    covariance: Array = make_prior(source, settings, tai_s).covariance
    return FitResult("elements", Correction(), tai_s, 0, 0, 0.0, 0.0, 0.0, covariance=covariance)
