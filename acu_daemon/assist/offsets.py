"""Readings against a predicted path: how far off, how far off may be, how an axis accelerates.  Pure."""

from dataclasses import dataclass
from math import hypot

import numpy as np

from acu_daemon.assist.encoder import encoder_look, sigma_deg
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array, wrap_180_array

NEAR_BEAMS = 0.2
NEAR_SIGMAS = 6.0
HALF_STEP_S = 0.25  # of the difference of rates that gives a path's acceleration
LEAST_COS_EL = 1e-3
WINDOW_S = 1.0  # over which an axis' own acceleration is measured
WINDOW_COUNT = 6
MEASURED_SIGMAS = 5.0


@dataclass(frozen=True, slots=True)
class Offsets:
    """Readings minus a path, every array (N,): degrees on the sky, right (azimuth rising) and up positive.

    near_deg: how far off is still near, by the noise and the path's own sigma.  The accelerations are the path's,
    deg/s^2 of the axes.
    """

    tai_s: Array
    right_deg: Array
    up_deg: Array
    cos_el: Array
    near_deg: Array
    az_deg_s2: Array
    el_deg_s2: Array

    @property
    def angle_deg(self) -> Array:
        angle: Array = np.hypot(self.right_deg, self.up_deg)
        return angle

    def drift_deg_s(self, newest_s: float) -> float:
        """How fast the offset of the newest readings changes; 0 where they are too few to tell."""
        newest = self.tai_s >= self.tai_s[-1] - newest_s
        t = self.tai_s[newest] - self.tai_s[-1]
        if t.size < 3 or float(np.ptp(t)) < WINDOW_S:
            return 0.0
        t = t - t.mean()
        right, up = (float(t @ y[newest] / (t @ t)) for y in (self.right_deg, self.up_deg))
        return hypot(right, up)


def offsets(
    source: Propagator, site: Site, fit: FitResult | None, readings: Readings, settings: EstimatorSettings
) -> Offsets:
    """Compare readings (N > 0, oldest first) with the path of a fit, or of the source itself.

    Raises:  OrbitError: the source has no answer for one of the times.
    """
    propagator = source if fit is None else source.corrected(fit.correction)
    t, count = readings.tai_s, len(readings)
    seen = encoder_look(propagator, np.concatenate((t, t - HALF_STEP_S, t + HALF_STEP_S)), site, fit)
    cos_el = np.maximum(np.cos(np.radians(seen.el_deg[:count])), LEAST_COS_EL)
    of_path_deg = sigma_deg(propagator, t, site, fit)
    noise_deg = max(settings.sigma_azimuth_deg, settings.sigma_elevation_deg)
    spread_deg = noise_deg if of_path_deg is None else np.hypot(noise_deg, of_path_deg)
    return Offsets(
        tai_s=t,
        right_deg=wrap_180_array(readings.az_deg - seen.az_deg[:count]) * cos_el,
        up_deg=readings.el_deg - seen.el_deg[:count],
        cos_el=cos_el,
        near_deg=np.maximum(NEAR_BEAMS * settings.beamwidth_deg, NEAR_SIGMAS * spread_deg) * np.ones(count),
        az_deg_s2=(seen.az_rate_deg_s[2 * count :] - seen.az_rate_deg_s[count : 2 * count]) / (2 * HALF_STEP_S),
        el_deg_s2=(seen.el_rate_deg_s[2 * count :] - seen.el_rate_deg_s[count : 2 * count]) / (2 * HALF_STEP_S),
    )


def excess_acceleration(tai_s: Array, off_deg: Array, noise_deg: float) -> Array:
    """Acceleration of readings against their path, deg/s^2, by a parabola through the last second of each, (N,).

    What noise alone can show is taken off; 0 where the readings are too few.
    """
    excess = np.zeros(tai_s.size)
    first = np.searchsorted(tai_s, tai_s - WINDOW_S - 1e-6)
    for k in range(tai_s.size):
        t = tai_s[first[k] : k + 1] - tai_s[k]
        if t.size < WINDOW_COUNT:
            continue
        design = np.vander(t, 3)
        inverse = np.linalg.pinv(design)
        measured = 2.0 * float(inverse[0] @ off_deg[first[k] : k + 1])
        sigma = 2.0 * noise_deg * float(np.linalg.norm(inverse[0]))
        excess[k] = np.sign(measured) * max(0.0, abs(measured) - MEASURED_SIGMAS * sigma)
    return excess
