"""D of a satellite from a station's own recording of one pass: the fit's orbit, taken to its ascending node.  Pure."""

from typing import NamedTuple

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import ORBIT, STEPS, correction_of
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.groundtrack.history import Crossing, MeanOrbit, crossing_near
from acu_daemon.groundtrack.mean_elements import mean_of
from acu_daemon.model import FitResult, Readings
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

_POINTS = 60  # on a revolution, for its mean elements
_BUFFER_S = 1.0
_WORST_SIGMAS = 5.0  # of the residuals


class SeenPass(NamedTuple):
    """The node nearest to a pass as its fit has it, D's 1 sigma there, and the mean orbit."""

    crossing: Crossing
    sigma_m: float
    mean: MeanOrbit
    reading_count: int
    residual_rms_deg: float


def seen_pass(setup: RefitSetup, readings: Readings) -> SeenPass | str:
    """Fit a pass and take the orbit to its node; a text where there is no fit that can be trusted.

    setup: with the estimator `full`, which has a covariance.
    Raises:  OrbitError: the elements have no answer for a time.
    """
    end_s = float(readings.tai_s[-1])
    reply = Refitter(setup).refit(RefitRequest(readings, end_s, _BUFFER_S, end_s, 180.0))
    fit = reply.fit
    if fit is None or fit.covariance is None:
        return "no fit: the readings do not determine the orbit better than the elements"
    noise_deg = max(setup.settings.sigma_azimuth_deg, setup.settings.sigma_elevation_deg)
    if fit.residual_rms_deg > _WORST_SIGMAS * noise_deg:
        return f"the readings are {fit.residual_rms_deg:.2f} deg rms off the fit: are they of another satellite?"
    if fit.rejected_count > fit.reading_count:
        return f"{fit.rejected_count} of {len(readings)} readings do not fit the others: are they of another satellite?"
    middle_s = float(readings.tai_s[len(readings) // 2])
    source = setup.propagator.corrected(fit.correction)
    mean, revolution_s = _mean_orbit(source, middle_s)
    crossing = crossing_near(source, middle_s, revolution_s)
    sigma_m = _sigma_m(setup.propagator, fit, crossing, revolution_s)
    return SeenPass(crossing, sigma_m, mean, fit.reading_count, fit.residual_rms_deg)


def _mean_orbit(source: Propagator, tai_s: float) -> tuple[MeanOrbit, float]:
    """Mean elements over a revolution about a time, whatever the source; and the revolution's length."""
    first = mean_of(*source.states_teme(np.array([tai_s])))
    revolution_s = 2.0 * np.pi / float(np.sqrt(MU_M3_S2 / first.a_m[0] ** 3))
    times_s = tai_s + (np.arange(_POINTS) / _POINTS - 0.5) * revolution_s
    mean = mean_of(*source.states_teme(times_s))
    e = float(np.hypot(mean.ex.mean(), mean.ey.mean()))
    return MeanOrbit(float(mean.a_m.mean()), e, float(mean.i_rad.mean())), revolution_s


def _sigma_m(source: Propagator, fit: FitResult, crossing: Crossing, revolution_s: float) -> float:
    """1 sigma of the node's longitude along the equator, from the fit's covariance by differences."""
    states = np.array(
        [
            fit.correction.delta_raan_rad,
            fit.correction.delta_mean_anomaly_rad,
            fit.correction.delta_mean_motion_rad_s,
            fit.correction.delta_e_cos_argp,
            fit.correction.delta_e_sin_argp,
            fit.correction.delta_inclination_rad,
        ]
    )
    slopes = []
    for k, step in enumerate(STEPS):
        moved: Array = states.copy()
        moved[k] += step
        other = crossing_near(source.corrected(correction_of(moved)), crossing.tai_s, revolution_s)
        turn = np.remainder(other.longitude_rad - crossing.longitude_rad + np.pi, 2.0 * np.pi) - np.pi
        slopes.append(turn / step)
    gradient = np.array(slopes) * EARTH_EQUATORIAL_RADIUS_M
    covariance = np.zeros((len(STEPS), len(STEPS))) if fit.covariance is None else fit.covariance[ORBIT, ORBIT]
    return float(np.sqrt(gradient @ covariance @ gradient))
