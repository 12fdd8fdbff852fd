"""What one pass leaves to the next of the same satellite, and whether the next may use it.  Pure.

The orbit's corrections hold wherever the satellite is seen from; the angle biases and the station's place are kept too
where the next pass is seen by the same station.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import (
    BIAS,
    MOUNT,
    ORBIT,
    STATE_COUNT,
    STATION,
    make_prior,
    states_of,
)
from acu_daemon.assist.estimators.full.prior_inflation import WIDTHS
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.errors import OrbitError
from acu_daemon.model import AngleBias, Correction, FitResult, Site, Station
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S, Array

LEAST_READINGS = 30
LONGEST_S = 10.0 * DAY_S  # after that, new elements' own uncertainty is as good
WIDEST_SIGMAS = 5.0  # what is beyond this many a-priori sigmas was no orbit's, but another signal's or a damaged file's
SAME_M, SAME_M_S = 1.0, 1e-3


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
    widest = WIDTHS[-1].covariance(make_prior(source, settings, carried.at_tai_s).covariance)
    return _too_far(carried, np.sqrt(np.diag(widest)), has_covariance=has_covariance)


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


def _prior_sigma(carried: CarryOver, source: Propagator, settings: EstimatorSettings) -> Array:
    """A-priori sigmas (17,); 0: no fit may change that state."""
    sigma: Array = np.sqrt(np.diag(make_prior(source, settings, carried.at_tai_s).covariance))
    return sigma


def _too_far(carried: CarryOver, prior_sigma: Array, *, has_covariance: bool) -> str:
    """Which states, or sigmas of states, no fit from a prior with these sigmas leaves; empty where there are none."""
    limit = np.where(prior_sigma > 0.0, WIDEST_SIGMAS * prior_sigma, np.inf)
    is_off = np.abs(mean_of(carried)) > limit
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


def mean_of(carried: CarryOver) -> Array:
    return states_of(carried.correction, carried.bias, carried.station_shift_enu_m)
