"""How far a satellite must be from its elements for readings of it: what an orbit that fits them costs.  Pure.

Elements are days old, from before a manoeuvre, or looked at by a wrong clock: late or early by minutes at most, the
other elements changed by what a manoeuvre can do.  What takes more is another satellite, however well it fits then.
"""

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from acu_daemon.assist.estimators.estimator_base import mean_motion_rad_s
from acu_daemon.assist.estimators.full.estimated_states import ORBIT, make_prior, states_of
from acu_daemon.assist.screening.offsets import angles_deg
from acu_daemon.assist.screening.orbit_test import fitted
from acu_daemon.assist.screening_limits import (
    BEFORE_S,
    ENOUGH,
    LEAST_COUNT,
    MANOEUVRE_M_S,
    MOST_ALONG_S,
    MOST_MANOEUVRES,
    NEAR_SHARE,
    ORBITAL_M_S,
    SEARCH_S,
    STEP_S,
)
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings
from acu_daemon.errors import OrbitError
from acu_daemon.model import Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, EARTH_RATE_RAD_S

ANOMALY = 1  # of the orbit's states


@dataclass(frozen=True, slots=True)
class Needed:
    """What it takes to fit readings.

    along_s: seconds late (+).  manoeuvres: the change of the other elements, root mean square over them, in what a
    manoeuvre of MANOEUVRE_M_S makes.  near_share: of the readings lies near the orbit that fits them.
    """

    along_s: float
    manoeuvres: float
    near_share: float


def needed(source: Propagator, site: Site, settings: EstimatorSettings, readings: Readings) -> Needed | None:
    """Fit locked readings, oldest first, and say what it took; None where they are too few to tell.

    Raises: OrbitError: the source has no answer for one of the times.
    """
    if len(readings) < LEAST_COUNT or float(np.ptp(readings.tai_s)) < BEFORE_S:
        return None
    few = readings.part(np.unique(np.linspace(0, len(readings) - 1, ENOUGH).astype(int)))
    along_s = _nearest_along_s(source, site, few)
    sigmas = _of_a_manoeuvre(float(mean_motion_rad_s(*source.states_teme(few.tai_s[:1]))[0]))
    wide = replace(settings, orbit_sigmas=sigmas, station_sigma_m=0.0)
    try:
        found = fitted(source, site, wide, _earlier(few, along_s))
    except (OrbitError, np.linalg.LinAlgError):
        return Needed(along_s, np.inf, 0.0)
    if found is None:
        return None
    fit, seen = found
    x = states_of(fit.correction, fit.bias, fit.station_shift_enu_m)[ORBIT]
    late_s = along_s + fit.along_s
    turned_rad = -EARTH_RATE_RAD_S * late_s  # the Earth, meanwhile: no change of the node
    x[0] -= np.clip(x[0], min(0.0, turned_rad), max(0.0, turned_rad))
    of_one = x / np.sqrt(np.diag(make_prior(source, wide, fit.at_tai_s).covariance)[ORBIT])
    others = np.delete(of_one, ANOMALY)
    return Needed(late_s, sqrt(float(np.mean(others**2))), float(np.mean(seen.is_near)))


def why_not_this_satellite(source: Propagator, site: Site, settings: EstimatorSettings, locked: Readings) -> str:
    """Why locked readings are probably not of the satellite whose elements these are; "": they may well be.

    Raises: OrbitError: the source has no answer for one of the times.
    """
    takes = needed(source, site, settings, locked)
    if takes is None:
        return ""
    if takes.near_share < NEAR_SHARE or not np.isfinite(takes.manoeuvres):
        return "no orbit near the elements goes through the locked readings"
    if abs(takes.along_s) <= MOST_ALONG_S and takes.manoeuvres <= MOST_MANOEUVRES:
        return ""
    when = "late" if takes.along_s >= 0 else "early"
    return (
        f"to fit the locked readings it has to be {abs(takes.along_s):.0f} s {when}"
        f" on an orbit that {takes.manoeuvres * MANOEUVRE_M_S:.0f} m/s of manoeuvre make of the elements"
    )


def _earlier(readings: Readings, late_s: float) -> Readings:
    """Readings as a clock that is late by late_s has them, or, but for the Earth's turn, of a satellite that late."""
    return replace(readings, tai_s=readings.tai_s - late_s)


def _nearest_along_s(source: Propagator, site: Site, readings: Readings) -> float:
    """How late the satellite is where its path comes nearest to the readings."""
    late_s = np.arange(-SEARCH_S, SEARCH_S + STEP_S, STEP_S)
    off_deg = [float(np.median(angles_deg(source, site, None, _earlier(readings, one)))) for one in late_s.tolist()]
    return float(late_s[int(np.argmin(off_deg))])


def _of_a_manoeuvre(rate_rad_s: float) -> ElementSigmas:
    """What a manoeuvre changes: the rate by 3 dv/v, the e-vector by 2 dv/v, the plane by dv/v (Gauss)."""
    share = MANOEUVRE_M_S / ORBITAL_M_S
    return ElementSigmas(
        raan_deg=share / DEG,
        mean_anomaly_deg=STEP_S * rate_rad_s / DEG,
        mean_motion_rad_min=3.0 * share * rate_rad_s * 60.0,
        mean_motion_per_day_rad_min=0.0,
        e_vector=2.0 * share,
        inclination_deg=share / DEG,
    )
