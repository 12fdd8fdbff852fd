"""What all estimators share: the reading gate, the count of readings, and the figures of a fit.  Pure."""

from abc import ABC, abstractmethod
from dataclasses import replace

import numpy as np

from acu_daemon.assist.estimators.known_bias import without_bias
from acu_daemon.assist.reading_gate import Rejected, below_highest
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.assist.spaced_times import spaced
from acu_daemon.model import AngleBias, Correction, FitResult, Readings, Site, plunged_bias, sky_angle_deg
from acu_daemon.orbit.frames import station_itrs_m, teme_from_itrs
from acu_daemon.orbit.look import LIGHT_M_S, look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, MU_M3_S2, Array

_NEWEST_COUNT = 30  # readings that the residual is taken over
_RANGE_STEP_S = 10.0  # a range is interpolated to a kilometre: 3e-6 deg at 5 deg of elevation


class BaseEstimator(ABC):
    """Takes readings, oldest first, and corrects raan and mean anomaly of a source.  Mutable; one owner.

    `rejected` has every reading left out, with its reason; `notes` what people should be told, until somebody takes it.
    """

    name: str

    def __init__(self, propagator: Propagator, site: Site, settings: EstimatorSettings) -> None:
        self._source = propagator
        self._is_late, self._site = site.has_light_time, replace(site, has_light_time=False)
        self._settings = settings
        self.rejected: list[Rejected] = []
        self.notes: list[str] = []
        self.used_count = 0
        self._newest: list[tuple[float, float, float]] = []

    @abstractmethod
    def _use(self, readings: Readings) -> list[str | None]:
        """Take in readings; give a reason for each that was left out."""

    @abstractmethod
    def _correction(self) -> Correction | None:
        """Give the present correction, None before the first one."""

    def add(self, readings: Readings) -> None:
        """Take new readings only, oldest first, encoder angles.

        Raises:  OrbitError: the source has no answer for one of their times.
        """
        kept, rejected = below_highest(readings, self._settings)
        self.rejected += rejected
        if len(kept) == 0:
            return
        kept = self._geometric(kept)
        reasons = self._use(kept)
        rows = zip(kept.tai_s.tolist(), kept.az_deg.tolist(), kept.el_deg.tolist(), strict=True)
        used = []
        for row, reason in zip(rows, reasons, strict=True):
            if reason is None:
                used.append(row)
            else:
                self.rejected.append(Rejected(row[0], reason))
        self.used_count += len(used)
        self._newest = (self._newest + used)[-_NEWEST_COUNT:]

    def _geometric(self, readings: Readings) -> Readings:
        """Readings without air and mount, of the instant at which the signal left the satellite.

        How far away it is, which matters little, the source says.  What the axes turn meanwhile, 4e-5 deg on a low
        orbit, is left out.
        """
        was_plunged = readings.el_deg > 90.0
        if not bool(was_plunged.any()):
            return self._without(readings, self._settings.known_bias)
        bias = self._settings.known_bias
        here, beyond = self._without(readings, bias), self._without(readings, plunged_bias(bias))
        az_deg, el_deg = (
            np.where(was_plunged, getattr(beyond, name), getattr(here, name)) for name in ("az_deg", "el_deg")
        )
        return replace(here, az_deg=az_deg, el_deg=el_deg, was_plunged=was_plunged)

    def _without(self, readings: Readings, bias: AngleBias) -> Readings:
        antenna, is_plunged = self._site.antenna, readings.el_deg > 90.0
        if antenna is None and bool(is_plunged.any()):
            az_deg = np.where(is_plunged, readings.az_deg + 180.0, readings.az_deg) % 360.0
            el_deg = np.where(is_plunged, 180.0 - readings.el_deg, readings.el_deg)
            readings = replace(readings, az_deg=az_deg, el_deg=el_deg)
        if antenna is None and bias == AngleBias() and not self._is_late:
            return readings
        few = spaced(readings.tai_s, _RANGE_STEP_S)
        range_m = np.interp(readings.tai_s, few, look_at(self._source, few, self._site).range_m)
        if antenna is not None:
            az_deg, el_deg = antenna.geometric_deg(readings.az_deg, readings.el_deg, range_m)
            readings = replace(readings, az_deg=az_deg % 360.0, el_deg=el_deg)
        if self._is_late:
            readings = replace(readings, tai_s=readings.tai_s - range_m / LIGHT_M_S)
        return without_bias(readings, bias, self._site, range_m)

    def fit(self) -> FitResult | None:
        """Give the fit to all readings so far; None while there are too few."""
        correction = self._correction()
        if correction is None or not self._newest:
            return None
        corrected = self._source.corrected(correction)
        tai_s, az_deg, el_deg = np.array(self._newest).T
        seen = look_at(corrected, tai_s, self._site)
        pairs = zip(az_deg, el_deg, seen.az_deg, seen.el_deg, strict=True)
        residuals = np.array([sky_angle_deg(*(float(x) for x in pair)) for pair in pairs])
        along_s, across_deg = for_people(corrected, correction, float(tai_s[-1]), self._site)
        return FitResult(
            estimator=self.name,
            correction=correction,
            at_tai_s=float(tai_s[-1]),
            reading_count=self.used_count,
            rejected_count=len(self.rejected),
            residual_rms_deg=float(np.sqrt(np.mean(residuals**2))),
            along_s=along_s,
            across_deg=across_deg,
            bias=self._settings.known_bias,
        )


def for_people(propagator: Propagator, correction: Correction, tai_s: float, site: Site) -> tuple[float, float]:
    """Show a correction as seconds along the track and degrees across it.

    along_s: minus the correction of the mean anomaly over the mean motion: a satellite ahead of its elements is
    early (-), one behind them late (+).
    across_deg: how far the correction of raan moves the satellite out of its orbital plane at tai_s, as an angle on
    the sky of the station at that instant; right of the inertial motion, up being away from the Earth, is positive.
    """
    r_m, v_m_s = propagator.states_teme(np.array([tai_s]))
    right = right_of_track(r_m[0], v_m_s[0])
    shift_m = correction.delta_raan_rad * float(np.cross([0.0, 0.0, 1.0], r_m[0]) @ right)
    along_s = -correction.delta_mean_anomaly_rad / float(mean_motion_rad_s(r_m, v_m_s)[0])
    return along_s, on_the_sky_deg(shift_m, right, r_m[0], tai_s, site)


def right_of_track(r_m: Array, v_m_s: Array) -> Array:
    """Unit vector (3,) across an inertial motion, to the right of it, up being away from the Earth."""
    right = np.cross(v_m_s, r_m)
    unit: Array = right / np.linalg.norm(right)
    return unit


def on_the_sky_deg(shift_m: float, direction: Array, r_m: Array, tai_s: float, site: Site) -> float:
    """A shift along a unit vector, of a satellite at r_m (3,), TEME, as an angle on the sky of the station."""
    sight = r_m - teme_from_itrs(station_itrs_m(site.station), np.array([tai_s]), site.orientation)[0]
    range_m = float(np.linalg.norm(sight))
    foreshortening = float(np.sqrt(max(0.0, 1.0 - (float(direction @ sight) / range_m) ** 2)))
    return shift_m * foreshortening / range_m / DEG


def mean_motion_rad_s(r_m: Array, v_m_s: Array) -> Array:
    """Keplerian mean motion of inertial states (N, 3), (N,).  a: from vis-viva; Kuga and Carrara 1988, eq 4.12."""
    a_m = 1.0 / (2.0 / np.linalg.norm(r_m, axis=1) - np.sum(v_m_s**2, axis=1) / MU_M3_S2)
    n: Array = np.sqrt(MU_M3_S2 / a_m**3)
    return n
