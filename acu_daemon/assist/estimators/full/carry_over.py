"""What one pass leaves to the next of the same satellite: the last fit, aged, as the next pass's prior.  Pure.

The orbit's corrections hold wherever the satellite is seen from; the angle biases and the station's place are kept too
where the next pass is seen by the same station.
"""

from dataclasses import dataclass, field, replace
from math import exp, hypot, radians

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import (
    BIAS,
    MOUNT,
    ORBIT,
    STATE_COUNT,
    STATION,
    Prior,
    bias_of,
    correction_of,
    make_prior,
    shift_of,
    states_of,
)
from acu_daemon.assist.estimators.full.pedestal_prior import PedestalPrior
from acu_daemon.assist.estimators.full.prior_inflation import WIDTHS
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings, StateSigmas
from acu_daemon.errors import OrbitError
from acu_daemon.model import AngleBias, Correction, FitResult, Site, Station
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, Array

LEAST_READINGS = 30
LONGEST_S = 10.0 * DAY_S  # after that, new elements' own uncertainty is as good
WIDEST_SIGMAS = 5.0  # what is beyond this many a-priori sigmas was no orbit's, but another signal's or a damaged file's
SAME_M, SAME_M_S = 1.0, 1e-3

_MEAN_ANOMALY, _MEAN_MOTION = 1, 2
_SLOW = (
    0,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    13,
    14,
    15,
    16,
)  # node, e-vector, inclination, encoders: without a trend
_SLOW_SHARE_PER_DAY = 0.1  # of the variance of new elements, of a new station's biases
_WOBBLES = (3e-5, 5e-5, 0.0, 2e-5, 2e-5, 3e-5)  # of the orbit's states, rad: tesseral terms left out, 0.1 to 0.4 km
_WOBBLE_RAD = 1e-4  # 0.7 km along the track, which come and go within hours, are nothing to carry
_LONG_MEAN_MOTION_SHARES = (0.08, 0.24)  # of the a-priori sigma, without drag and by drag at 400 km: from pass to pass
_DRAG_SHARES = (0.03, 0.4)  # of what elements' mean motion loses in worth by the day, likewise
_DRAG_FALLS_M = 75e3  # the air's density by a factor e, 400 to 800 km
_MOST_FALLS = 2.0  # below 250 km it no longer rises so
_LEAST_AGE_S = 0.5 * DAY_S


@dataclass(frozen=True, slots=True)
class CarryOver:
    """The last fit of a pass, and which elements it corrects.

    states: of the uncorrected elements at their epoch and at at_tai_s, (2, 6), TEME, metres and m/s: the same elements
    give the same ones.
    """

    at_tai_s: float
    estimator: str
    station: Station
    elements_kind: str
    elements_epoch_tai_s: float
    states: Array = field(compare=False, repr=False)
    correction: Correction
    bias: AngleBias
    station_shift_enu_m: tuple[float, float, float]
    covariance: Array = field(compare=False, repr=False)  # (17, 17), see estimated_states
    frame: str = ""  # Antenna.frame of the site; empty: a perfect mount in a vacuum
    is_of_this_pass: bool = False  # of the pass in progress, left by a daemon that was started again: it does not age


def resume_of(fit: FitResult, source: Propagator, site: Site) -> CarryOver | None:
    """What a fit leaves to the same pass, should the daemon start again; None where no reading is behind it.

    Of an estimator without a covariance it holds zeros, which nobody looks at.
    Raises:  OrbitError: the source has no answer at its epoch.
    """
    if fit.reading_count == 0:
        return None
    covariance = np.zeros((STATE_COUNT, STATE_COUNT)) if fit.covariance is None else fit.covariance
    return replace(_of(fit, covariance, source, site), is_of_this_pass=True)


def why_not_resume(
    carried: CarryOver,
    source: Propagator,
    site: Site,
    estimator: str,
    settings: EstimatorSettings,
    now_tai_s: float,
    *,
    has_covariance: bool,
) -> str:
    """Why a fit of this pass cannot be gone on from; empty where it can.  Its prior may have been widened."""
    if not 0.0 <= now_tai_s - carried.at_tai_s <= LONGEST_S:
        return "it is from a later time than now, or of long ago"
    if carried.station != site.station or carried.estimator != estimator:
        return "the station or the estimator has changed"
    if why := why_other_frame(carried, site):
        return why
    if not _has_same_elements(carried, source):
        return "the elements have changed"
    sigma = _prior_sigma(carried, source, settings)
    sigma[ORBIT] *= WIDTHS[-1].factor
    sigma[_MEAN_ANOMALY] += radians(WIDTHS[-1].along_deg)
    return _too_far(carried, sigma, has_covariance=has_covariance)


def why_other_frame(carried: CarryOver, site: Site) -> str:
    """Why a fit says nothing with this antenna; empty where it does: what a fit in a vacuum took for an orbit was air.

    Of another station only the orbit is carried, whatever the mount was.
    """
    frame = frame_of(site)
    if carried.station != site.station:
        return (
            ""
            if carried.frame.startswith("air") == frame.startswith("air")
            else "it was fitted with air, or without, and this station is not"
        )
    return "" if carried.frame == frame else "[atmosphere] refraction or [mount] has changed"


def frame_of(site: Site) -> str:
    """Antenna.frame of a site; empty: a perfect mount in a vacuum."""
    return "" if site.antenna is None else site.antenna.frame


def carry_over_of(fit: FitResult, source: Propagator, site: Site) -> CarryOver | None:
    """What a fit leaves to the next pass; None without a covariance or from too few readings.

    Raises:  OrbitError: the source has no answer at its epoch.
    """
    if fit.covariance is None or fit.reading_count < LEAST_READINGS:
        return None
    return _of(fit, fit.covariance, source, site)


def _of(fit: FitResult, covariance: Array, source: Propagator, site: Site) -> CarryOver:
    return CarryOver(
        at_tai_s=fit.at_tai_s,
        estimator=fit.estimator,
        station=site.station,
        elements_kind=source.kind,
        elements_epoch_tai_s=source.epoch_tai_s,
        states=_states(source, fit.at_tai_s),
        correction=fit.correction,
        bias=fit.bias,
        station_shift_enu_m=fit.station_shift_enu_m,
        covariance=covariance,
        frame=frame_of(site),
    )


def why_not(carried: CarryOver, source: Propagator, settings: EstimatorSettings, now_tai_s: float) -> str:
    """Why a carry-over must be dropped; empty where it may be used."""
    age_s = now_tai_s - carried.at_tai_s
    if age_s < 0.0:
        return "it is from a later time than now"
    if age_s > LONGEST_S:
        return f"it is {age_s / DAY_S:.1f} days old, the limit is {LONGEST_S / DAY_S:g}"
    if not _has_same_elements(carried, source):
        return "the elements have changed"
    return _too_far(carried, _prior_sigma(carried, source, settings), has_covariance=True)


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
        return _without_fixed(_mean(carried), carried.covariance.copy(), fresh)
    mean, covariance = _held_to_long_mean_motion(_mean(carried), carried, settings)
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


def _prior_sigma(carried: CarryOver, source: Propagator, settings: EstimatorSettings) -> Array:
    """A-priori sigmas (17,); 0: no fit may change that state."""
    sigma: Array = np.sqrt(np.diag(make_prior(source, settings, carried.at_tai_s).covariance))
    return sigma


def _too_far(carried: CarryOver, prior_sigma: Array, *, has_covariance: bool) -> str:
    """Which states, or sigmas of states, no fit from a prior with these sigmas leaves; empty where there are none."""
    limit = np.where(prior_sigma > 0.0, WIDEST_SIGMAS * prior_sigma, np.inf)
    is_off = np.abs(_mean(carried)) > limit
    if is_off[ORBIT].any():
        return f"its correction is more than {WIDEST_SIGMAS:g} sigma from the elements"
    if is_off[BIAS].any() or is_off[MOUNT].any():
        return f"its biases are more than {WIDEST_SIGMAS:g} of the [readings] bias_sigma, or of the sigmas in [mount]"
    if is_off[STATION].any():
        return f"its shift of the station is more than {WIDEST_SIGMAS:g} times [station] uncertainty_m"
    sigma = np.sqrt(np.diag(carried.covariance))
    if has_covariance and ((sigma[ORBIT] == 0.0).any() or (sigma > limit).any()):
        return "its covariance is not that of a fit"
    return ""


def _states(source: Propagator, at_tai_s: float) -> Array:
    r_m, v_m_s = source.corrected(Correction()).states_teme(np.array([source.epoch_tai_s, at_tai_s]))
    states: Array = np.hstack((r_m, v_m_s))
    return states


def _has_same_elements(carried: CarryOver, source: Propagator) -> bool:
    if (carried.elements_kind, carried.elements_epoch_tai_s) != (source.kind, source.epoch_tai_s):
        return False
    try:
        off = np.abs(_states(source, carried.at_tai_s) - carried.states)
    except OrbitError:
        return False
    return bool((off[:, :3] < SAME_M).all() and (off[:, 3:] < SAME_M_S).all())


def _mean(carried: CarryOver) -> Array:
    return states_of(carried.correction, carried.bias, carried.station_shift_enu_m)


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
    slow = list(_SLOW)
    noise[slow, slow] = _SLOW_SHARE_PER_DAY * passed_s / DAY_S * fresh_variance[slow]
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
