"""What a pass left, aged, as the next pass's prior.  Pure.

Theory: docs/estimation.md, Carry-over.
"""

from math import exp, hypot

import numpy as np

from acu_daemon.assist.estimators.full.carry_over import CarryOver, mean_of
from acu_daemon.assist.estimators.full.estimated_states import (
    ORBIT,
    STATE_COUNT,
    Prior,
    bias_of,
    correction_of,
    make_prior,
    shift_of,
)
from acu_daemon.assist.estimators.full.pedestal_prior import PEDESTAL, PedestalPrior
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings, StateSigmas
from acu_daemon.model import FitResult, Site
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, Array

_MEAN_ANOMALY, _MEAN_MOTION = 1, 2
_SLOW = [0, 3, 4, 5, *PEDESTAL]  # node, e-vector, inclination, encoders: without a trend
_SLOW_SHARE_PER_DAY = 0.1  # of the variance of new elements, of a new station's biases
_WOBBLES = (3e-5, 5e-5, 0.0, 2e-5, 2e-5, 3e-5)  # of the orbit's states, rad: tesseral terms left out, 0.1 to 0.4 km
_WOBBLE_RAD = 1e-4  # 0.7 km along the track, which come and go within hours, are nothing to carry
_LONG_MEAN_MOTION_SHARES = (0.08, 0.24)  # of the a-priori sigma, without drag and by drag at 400 km: from pass to pass
_DRAG_SHARES = (0.03, 0.4)  # of what elements' mean motion loses in worth by the day, likewise
_DRAG_FALLS_M = 75e3  # the air's density by a factor e, 400 to 800 km
_MOST_FALLS = 2.0  # below 250 km it no longer rises so
_LEAST_AGE_S = 0.5 * DAY_S


def aged_prior(
    carried: CarryOver,
    source: Propagator,
    site: Site,
    settings: EstimatorSettings,
    at_tai_s: float,
    pedestal: PedestalPrior | None = None,
) -> Prior:
    """What the carry-over tells of the states at at_tai_s, in place of `make_prior`.

    The mean motion is first held to what elements are worth over days: within one pass its error looks like others',
    and what a pass's noise leaves in it runs away until the next.  What is left of the correction counts as far as it
    stands out from its own uncertainty.  Then come drag, as a constant error of the mean motion's rate from the fit on,
    and slow drifts.  What the station remembers of its pedestal (of more passes than that one) takes the place of the
    biases.  A fit of this pass is taken as it is.
    """
    fresh = make_prior(source, settings, at_tai_s)
    fresh = fresh if pedestal is None else pedestal.of(fresh)
    if carried.is_of_this_pass:
        return _without_fixed(mean_of(carried), carried.covariance.copy(), fresh)
    mean, covariance = _held_to_long_mean_motion(mean_of(carried), carried, settings)
    mean[ORBIT] *= _significance(mean[ORBIT], covariance[ORBIT, ORBIT])
    covariance = covariance + _process_noise(carried, settings, np.diag(fresh.covariance), at_tai_s)
    if carried.station != site.station:
        mean, covariance = _orbit_alone(mean, covariance, fresh)
    prior = _without_fixed(mean, covariance, fresh)
    return prior if pedestal is None else pedestal.of(prior)


def _without_fixed(mean: Array, covariance: Array, fresh: Prior) -> Prior:
    """Leave alone what the configuration does not let a fit change."""
    is_no_state = np.diag(fresh.covariance) == 0.0
    mean[is_no_state] = 0.0
    covariance[is_no_state], covariance[:, is_no_state] = 0.0, 0.0
    return Prior(mean, covariance)


def first_fit(carried: CarryOver, prior: Prior) -> FitResult:
    """The prior in the shape of a fit without readings: what the first prediction of a pass is made from."""
    return FitResult(
        estimator=carried.estimator,
        correction=correction_of(prior.mean),
        at_tai_s=carried.at_tai_s,
        reading_count=0,
        rejected_count=0,
        residual_rms_deg=0.0,
        along_s=0.0,
        across_deg=0.0,
        bias=bias_of(prior.mean),
        station_shift_enu_m=shift_of(prior.mean),
        covariance=prior.covariance,
    )


def _element_sigmas(carried: CarryOver, settings: EstimatorSettings) -> ElementSigmas:
    sigmas = settings.sigmas_of(carried.elements_kind)
    return sigmas if isinstance(sigmas, ElementSigmas) else ElementSigmas()


def _at_perigee(carried: CarryOver, shares: tuple[float, float]) -> float:
    """A share without drag and one by drag at 400 km together, as they are at the height of the perigee."""
    orbit = osculating_from_state(carried.states[:1, :3], carried.states[:1, 3:])
    height_m = float(orbit.a_m[0] * (1.0 - orbit.e[0])) - EARTH_EQUATORIAL_RADIUS_M
    return hypot(shares[0], shares[1] * exp(min((400e3 - height_m) / _DRAG_FALLS_M, _MOST_FALLS)))


def _held_to_long_mean_motion(mean: Array, carried: CarryOver, settings: EstimatorSettings) -> tuple[Array, Array]:
    """Observe the mean motion's correction as zero.

    1 sigma: a share of the a-priori one, or, where elements were far off along the track, the rate that brought them
    there since their epoch.  Without it where the configuration says what the elements are worth.
    """
    covariance = carried.covariance
    if isinstance(settings.orbit_sigmas, StateSigmas):
        return mean, covariance
    since_s = carried.at_tai_s - carried.elements_epoch_tai_s
    along_rad = mean[_MEAN_ANOMALY] + mean[_MEAN_MOTION] * since_s
    share = _at_perigee(carried, _LONG_MEAN_MOTION_SHARES)
    share_rad_s = share * _element_sigmas(carried, settings).mean_motion_rad_min / 60.0
    sigma_rad_s = hypot(share_rad_s, float(along_rad) / max(abs(since_s), _LEAST_AGE_S))
    gain = covariance[:, _MEAN_MOTION] / (covariance[_MEAN_MOTION, _MEAN_MOTION] + sigma_rad_s**2)
    return mean - gain * mean[_MEAN_MOTION], covariance - np.outer(gain, covariance[_MEAN_MOTION])


def _significance(correction: Array, covariance: Array) -> float:
    """The factor, 0 to 1, by which a correction shrinks: elements that one pass cannot better are left as they are.

    Source:  James and Stein, Estimation with quadratic loss, 4th Berkeley Symposium (1961), positive part.
    """
    sigma = np.sqrt(np.diag(covariance) + _WOBBLE_RAD**2 * (np.arange(correction.size) == _MEAN_ANOMALY))
    is_state = sigma > 0.0
    if np.count_nonzero(is_state) <= 2:
        return 1.0
    off = correction[is_state] / sigma[is_state]
    correlation = covariance[np.ix_(is_state, is_state)] / np.outer(sigma[is_state], sigma[is_state])
    np.fill_diagonal(correlation, 1.0)
    distance2 = float(off @ np.linalg.solve(correlation, off))
    return max(0.0, 1.0 - (off.size - 2) / distance2) if distance2 > 0.0 else 0.0


def _process_noise(carried: CarryOver, settings: EstimatorSettings, fresh_variance: Array, at_tai_s: float) -> Array:
    """What the time since the fit adds to the covariance (17, 17) of the states, which are those at epoch."""
    passed_s, since_epoch_s = max(0.0, at_tai_s - carried.at_tai_s), at_tai_s - carried.elements_epoch_tai_s
    noise = np.zeros((STATE_COUNT, STATE_COUNT))
    noise[_SLOW, _SLOW] = _SLOW_SHARE_PER_DAY * passed_s / DAY_S * fresh_variance[_SLOW]
    noise[ORBIT, ORBIT] += np.diag(np.square(_WOBBLES))
    drag = np.zeros(STATE_COUNT)  # of a unit of the mean motion's rate: 1/2 t^2 along the track at at_tai_s
    drag[_MEAN_MOTION] = passed_s
    drag[_MEAN_ANOMALY] = passed_s**2 / 2.0 - passed_s * since_epoch_s
    per_day_rad_min = _element_sigmas(carried, settings).mean_motion_per_day_rad_min
    rate_rad_s2 = _at_perigee(carried, _DRAG_SHARES) * per_day_rad_min / 60.0 / DAY_S
    total: Array = noise + rate_rad_s2**2 * np.outer(drag, drag)
    return total


def _orbit_alone(mean: Array, covariance: Array, fresh: Prior) -> tuple[Array, Array]:
    """The orbit's part; the station's comes from the fresh prior."""
    new_mean, new_covariance = fresh.mean.copy(), fresh.covariance.copy()
    new_mean[ORBIT] = mean[ORBIT]
    new_covariance[ORBIT, ORBIT] = covariance[ORBIT, ORBIT]
    return new_mean, new_covariance
