"""Readings against a predicted path: how far off, how far off may be, how the path accelerates.  Pure."""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.encoder import encoder_look, sigma_deg
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array, wrap_180_array

Flags = npt.NDArray[np.bool_]

NEAR_BEAMS = 0.2
NEAR_SIGMAS = 6.0
HALF_STEP_S = 0.25  # of the difference of rates that gives a path's acceleration
LEAST_COS_EL = 1e-3
LEAST_SPAN_S = 0.5  # a drift is taken over


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

    @property
    def is_near(self) -> Flags:
        near: Flags = self.angle_deg <= self.near_deg
        return near

    def drift_deg_s(self, newest_s: float) -> tuple[float, float]:
        """How fast the offset of the newest readings changes, right and up; 0 where they are too few to tell."""
        newest = self.tai_s >= self.tai_s[-1] - newest_s
        t = self.tai_s[newest] - self.tai_s[newest].mean()
        if t.size < 2 or float(np.ptp(t)) < LEAST_SPAN_S:
            return 0.0, 0.0
        return float(t @ self.right_deg[newest] / (t @ t)), float(t @ self.up_deg[newest] / (t @ t))

    def part(self, which: slice) -> "Offsets":
        """The offsets that a slice picks."""
        return Offsets(*(getattr(self, item.name)[which] for item in fields(self)))


def offsets(
    source: Propagator, site: Site, fit: FitResult | None, readings: Readings, settings: EstimatorSettings
) -> Offsets:
    """Compare readings (N > 0, oldest first) with the path of a fit, or of the source itself.

    Raises:  OrbitError: the source has no answer for one of the times.
    """
    propagator = _propagator(source, fit)
    t, count = readings.tai_s, len(readings)
    seen = encoder_look(propagator, np.concatenate((t, t - HALF_STEP_S, t + HALF_STEP_S)), site, fit)
    cos_el, right_deg, up_deg = _on_the_sky(readings, seen.az_deg[:count], seen.el_deg[:count])
    of_path_deg = sigma_deg(propagator, t, site, fit)
    noise_deg = max(settings.sigma_azimuth_deg, settings.sigma_elevation_deg)
    spread_deg = noise_deg if of_path_deg is None else np.hypot(noise_deg, of_path_deg)
    return Offsets(
        tai_s=t,
        right_deg=right_deg,
        up_deg=up_deg,
        cos_el=cos_el,
        near_deg=np.maximum(NEAR_BEAMS * settings.beamwidth_deg, NEAR_SIGMAS * spread_deg) * np.ones(count),
        az_deg_s2=(seen.az_rate_deg_s[2 * count :] - seen.az_rate_deg_s[count : 2 * count]) / (2 * HALF_STEP_S),
        el_deg_s2=(seen.el_rate_deg_s[2 * count :] - seen.el_rate_deg_s[count : 2 * count]) / (2 * HALF_STEP_S),
    )


def angles_deg(source: Propagator, site: Site, fit: FitResult | None, readings: Readings) -> Array:
    """Angles on the sky (N,) between readings and the path of a fit, or of the source itself.

    Raises:  OrbitError: the source has no answer for one of the times.
    """
    seen = encoder_look(_propagator(source, fit), readings.tai_s, site, fit)
    _, right_deg, up_deg = _on_the_sky(readings, seen.az_deg, seen.el_deg)
    angle: Array = np.hypot(right_deg, up_deg)
    return angle


def _propagator(source: Propagator, fit: FitResult | None) -> Propagator:
    return source if fit is None else source.corrected(fit.correction)


def _on_the_sky(readings: Readings, az_deg: Array, el_deg: Array) -> tuple[Array, Array, Array]:
    """Cosine of the path's elevation; readings minus path, right and up."""
    cos_el = np.maximum(np.cos(np.radians(el_deg)), LEAST_COS_EL)
    return cos_el, wrap_180_array(readings.az_deg - az_deg) * cos_el, readings.el_deg - el_deg
