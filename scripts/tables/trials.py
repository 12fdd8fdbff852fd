"""A fit of `full` to the first part of a pass, judged on the rest of it: error, least possible error, ellipses."""

from dataclasses import dataclass

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import states_of
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.estimators.full.path_partials import node_times, orbit_partials_itrs, site_of, sky_partials
from acu_daemon.assist.mount_model import encoder_look, sky_covariance
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array, wrap_180_array
from tables.seed_001 import sky_angles_deg

ASKED_WORST_DEG = 0.035
_DRAW_COUNT = 400


@dataclass(frozen=True, slots=True)
class Trial:
    """How wrong a prediction was, degrees on the sky in the encoder frame.

    bound_deg, bound_95_deg: median and 95 % of the worst error over draws from the fit's covariance, which is the least
    that the readings allow (Cramer-Rao) with all states unknown; bound_share: of the draws that are worse than asked.
    one_sigma, two_sigma: share of the directions inside those ellipses.
    """

    name: str
    worst_deg: float
    bound_deg: float
    bound_95_deg: float
    bound_share: float
    one_sigma: float
    two_sigma: float


def tried(
    name: str,
    source: Propagator,
    site: Site,
    settings: EstimatorSettings,
    shown: Readings,
    readings: Readings,
    used: int,
) -> Trial:
    """Fit the first readings and judge the prediction of the rest.  shown: what encoders without noise would show.

    Raises:  ValueError: no fit from these readings.
    """
    estimator = FullEstimator(source, site, settings)
    estimator.add(readings.part(slice(used)))
    fit = estimator.fit()
    if fit is None:
        raise ValueError(f"{name}: no fit from {used} readings")
    rest = shown.part(slice(used, None))
    corrected = source.corrected(fit.correction)
    seen = encoder_look(corrected, rest.tai_s, site, fit)
    angles_deg = sky_angles_deg(seen.az_deg, seen.el_deg, rest.az_deg, rest.el_deg)
    drawn_deg = _worst_drawn_deg(source, site, fit, rest.tai_s)
    across = wrap_180_array(seen.az_deg - rest.az_deg) * np.cos(np.radians(rest.el_deg)) * DEG
    squares = distance2(across, (seen.el_deg - rest.el_deg) * DEG, *sky_covariance(corrected, rest.tai_s, site, fit))
    return Trial(
        name=name,
        worst_deg=float(angles_deg.max()),
        bound_deg=float(np.median(drawn_deg)),
        bound_95_deg=float(np.quantile(drawn_deg, 0.95)),
        bound_share=float(np.mean(drawn_deg > ASKED_WORST_DEG)),
        one_sigma=float(np.mean(squares < 1.0)),
        two_sigma=float(np.mean(squares < 4.0)),
    )


def distance2(across: Array, upward: Array, c: Array, b: Array, e: Array) -> Array:
    """Squared distance in sigmas, (N,), of errors with the covariance c (across), b (both), e (upward)."""
    squares: Array = (across**2 * e - 2.0 * b * across * upward + upward**2 * c) / (c * e - b * b)
    return squares


def _worst_drawn_deg(source: Propagator, site: Site, fit: FitResult, tai_s: Array) -> Array:
    """The largest angle over the times, for each of many errors drawn from the fit's covariance."""
    if fit.covariance is None:
        raise ValueError("the fit has no covariance")
    sigma = np.sqrt(np.diag(fit.covariance))
    is_state = sigma > 0.0
    sigma, covariance = sigma[is_state], fit.covariance[np.ix_(is_state, is_state)]
    values, vectors = np.linalg.eigh(covariance / np.outer(sigma, sigma))
    normal = np.random.default_rng(0).standard_normal((sigma.size, _DRAW_COUNT))
    draws = sigma[:, None] * (vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * normal))
    x = states_of(fit.correction, fit.bias, fit.station_shift_enu_m)
    here, nodes = site_of(site, x), node_times(float(tai_s[0]), float(tai_s[-1]))
    path, partials = orbit_partials_itrs(source, x, site, nodes)
    h = sky_partials(path.at(tai_s), partials.at(tai_s), here, True)[is_state]
    moved = np.tensordot(draws.T, h, 1)
    worst: Array = np.hypot(moved[:, 0], moved[:, 1]).max(axis=1) / DEG
    return worst
