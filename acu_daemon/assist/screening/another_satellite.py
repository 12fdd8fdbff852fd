"""How far a satellite must be from its elements for readings of it: what an orbit that fits them costs.  Pure.

Elements are days old, from before a manoeuvre, or looked at by a wrong clock: late or early by minutes at most, the
other elements changed by what a manoeuvre can do.  What takes more is another satellite, however well it fits then.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import ORBIT, ORBIT_COUNT, states_of
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
from acu_daemon.model import Correction, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, EARTH_RATE_RAD_S, Array

NOT_CORRECTED = Correction()


@dataclass(frozen=True, slots=True)
class Needed:
    """What it takes to fit readings.

    along_s: seconds late (+).  manoeuvres: the change of the other elements, root mean square over them, in what a
    manoeuvre of MANOEUVRE_M_S makes.  near_share: of the readings lies near the orbit that fits them.
    """

    along_s: float
    manoeuvres: float
    near_share: float


@dataclass(frozen=True)
class _Ahead:
    """A source whose mean anomaly is ahead, beside what a correction adds; behind the `Propagator` protocol."""

    source: Propagator
    ahead_rad: float
    correction: Correction = NOT_CORRECTED

    @property
    def kind(self) -> str:
        return self.source.kind

    @property
    def epoch_tai_s(self) -> float:
        return self.source.epoch_tai_s

    @cached_property
    def _moved(self) -> Propagator:
        ahead_rad = self.correction.delta_mean_anomaly_rad + self.ahead_rad
        return self.source.corrected(replace(self.correction, delta_mean_anomaly_rad=ahead_rad))

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        return self._moved.states_teme(tai_s)

    def corrected(self, correction: Correction) -> "_Ahead":
        return replace(self, correction=correction)


def needed(source: Propagator, site: Site, settings: EstimatorSettings, readings: Readings) -> Needed | None:
    """Fit locked readings, oldest first, and say what it took; None where they are too few to tell.

    Raises: OrbitError: the source has no answer for one of the times.
    """
    if len(readings) < LEAST_COUNT or float(np.ptp(readings.tai_s)) < BEFORE_S:
        return None
    few = readings.part(np.unique(np.linspace(0, len(readings) - 1, ENOUGH).astype(int)))
    rate_rad_s = _rate_rad_s(source, float(few.tai_s[0]))
    along_s = _nearest_along_s(source, site, few, rate_rad_s)
    moved = _Ahead(source, -along_s * rate_rad_s)
    sigmas = _of_a_manoeuvre(rate_rad_s)
    wide = replace(settings, orbit_sigmas=sigmas, azimuth=None, elevation=None, station_sigma_m=0.0)
    try:
        found = fitted(moved, site, wide, few)
    except (OrbitError, np.linalg.LinAlgError):
        return Needed(along_s, np.inf, 0.0)
    if found is None:
        return None
    fit, seen = found
    x = states_of(fit.correction, fit.bias, fit.station_shift_enu_m)[ORBIT]
    late_s = along_s + fit.along_s
    of_clock_rad = EARTH_RATE_RAD_S * late_s
    x[0] -= np.clip(x[0], min(0.0, of_clock_rad), max(0.0, of_clock_rad))
    return Needed(late_s, _manoeuvres(x, sigmas), float(np.mean(seen.is_near)))


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


def _rate_rad_s(source: Propagator, tai_s: float) -> float:
    (r,), (v,) = source.states_teme(np.array([tai_s]))
    return float(np.linalg.norm(np.cross(r, v)) / (r @ r))


def _nearest_along_s(source: Propagator, site: Site, readings: Readings, rate_rad_s: float) -> float:
    """How late the satellite is where its path comes nearest to the readings."""
    late_s = np.arange(-SEARCH_S, SEARCH_S + STEP_S, STEP_S)
    off_deg = [
        float(np.median(angles_deg(_Ahead(source, -one * rate_rad_s), site, None, readings))) for one in late_s.tolist()
    ]
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


def _manoeuvres(x: Array, sigmas: ElementSigmas) -> float:
    of_one = np.array(
        [
            sigmas.raan_deg * DEG,
            np.inf,
            sigmas.mean_motion_rad_min / 60.0,
            sigmas.e_vector,
            sigmas.e_vector,
            sigmas.inclination_deg * DEG,
        ]
    )
    return sqrt(float(np.sum((x / of_one) ** 2)) / (ORBIT_COUNT - 1))
