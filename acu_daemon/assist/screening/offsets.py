"""Readings against a predicted path: how far off, and how far off may be.  Pure."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.mount_model import encoder_look, sigma_deg
from acu_daemon.assist.screening_limits import LEAST_DRIFT_S, NEAR_BEAMS, NEAR_SIGMAS
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Readings, Site
from acu_daemon.orbit.look import Look, look_along, look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array, wrap_180_array

Flags = npt.NDArray[np.bool_]

LEAST_COS_EL = 1e-3


@dataclass(frozen=True, slots=True)
class Offsets:
    """Readings minus a path, every array (N,): degrees on the sky, right (azimuth rising) and up positive.

    near_deg: how far off is still near, by the noise and, unless all are near without it, the path's own sigma.
    """

    tai_s: Array
    right_deg: Array
    up_deg: Array
    near_deg: Array

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
        if t.size < 2 or float(np.ptp(t)) < LEAST_DRIFT_S:
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
    propagator = propagator_of(source, fit)
    right_deg, up_deg = _beside(propagator, site, fit, readings, look_along)
    noise_deg = max(settings.sigma_azimuth_deg, settings.sigma_elevation_deg)
    least_deg = NEAR_BEAMS * settings.beamwidth_deg
    near_deg = np.full(len(readings), max(least_deg, NEAR_SIGMAS * noise_deg))
    seen = Offsets(readings.tai_s, right_deg, up_deg, near_deg)
    if bool(seen.is_near.all()):
        return seen
    of_path_deg = sigma_deg(propagator, readings.tai_s, site, fit)
    if of_path_deg is None:
        return seen
    return replace(seen, near_deg=np.maximum(least_deg, NEAR_SIGMAS * np.hypot(noise_deg, of_path_deg)))


def angles_deg(source: Propagator, site: Site, fit: FitResult | None, readings: Readings) -> Array:
    """Angles on the sky (N,) between readings and the path of a fit, or of the source itself.

    Raises:  OrbitError: the source has no answer for one of the times.
    """
    angle: Array = np.hypot(*_beside(propagator_of(source, fit), site, fit, readings, look_at))
    return angle


def propagator_of(source: Propagator, fit: FitResult | None) -> Propagator:
    """The source as a fit corrects it."""
    return source if fit is None else source.corrected(fit.correction)


def _beside(
    propagator: Propagator, site: Site, fit: FitResult | None, readings: Readings, look: Callable[..., Look]
) -> tuple[Array, Array]:
    """Readings minus path, right and up; those of a plunged antenna are compared with the path as it has that."""
    what = (propagator, readings.tai_s, site, fit, look)
    is_plunged = readings.el_deg > 90.0
    right_deg, up_deg = _on_the_sky(readings, encoder_look(*what))
    if not bool(is_plunged.any()):
        return right_deg, up_deg
    beyond_right_deg, beyond_up_deg = _on_the_sky(readings, encoder_look(*what, is_plunged=True))
    return np.where(is_plunged, beyond_right_deg, right_deg), np.where(is_plunged, -beyond_up_deg, up_deg)


def _on_the_sky(readings: Readings, path: Look) -> tuple[Array, Array]:
    """Readings minus path, right and up."""
    cos_el = np.maximum(np.abs(np.cos(np.radians(path.el_deg))), LEAST_COS_EL)
    return wrap_180_array(readings.az_deg - path.az_deg) * cos_el, readings.el_deg - path.el_deg
