"""Whether the axes accelerate so much that autotrack lags: by the path, and by what readings show.  Pure."""

import numpy as np

from acu_daemon.assist.offsets import Flags, Offsets
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.units import Array

LIMIT_SHARE = 0.3  # of the drive's acceleration: beyond it autotrack lags
WINDOW_COUNT = 7  # readings of a parabola
LONGEST_WINDOW_S = 1.5
BEYOND_SIGMAS, LEAST_SIGMAS = 2.5, 4.5  # of the noise: over the limit, and over nothing
HUNTING_S = 2.0  # an axis that hunts turns round in between: it is not calm for so long after


class Calm:
    """Takes offsets from the path, oldest first.  Mutable; one owner."""

    def __init__(self, settings: EstimatorSettings) -> None:
        self._settings = settings
        self._newest = np.empty((0, 4))  # time, azimuth and elevation off the path, cos of the elevation
        self._hunting_until_tai_s = -np.inf

    def is_calm(self, seen: Offsets, *, has_path: bool) -> Flags:
        """Say of each reading whether both axes are calm.  has_path: the path is a fit's."""
        azimuth, elevation = self._settings.azimuth, self._settings.elevation
        if azimuth is None or elevation is None:
            return np.ones(seen.tai_s.size, dtype=np.bool_)
        limits_deg_s2 = LIMIT_SHARE * azimuth.max_acceleration_deg_s2, LIMIT_SHARE * elevation.max_acceleration_deg_s2
        calm: Flags = (np.abs(seen.az_deg_s2) <= limits_deg_s2[0]) & (np.abs(seen.el_deg_s2) <= limits_deg_s2[1])
        if has_path:
            for k in np.flatnonzero(seen.is_near):
                row = (seen.tai_s[k], seen.right_deg[k] / seen.cos_el[k], seen.up_deg[k], seen.cos_el[k])
                self._newest = np.vstack((self._newest[1 - WINDOW_COUNT :], row))
                path_deg_s2 = float(seen.az_deg_s2[k]), float(seen.el_deg_s2[k])
                if self._hunts(path_deg_s2, limits_deg_s2):
                    self._hunting_until_tai_s = seen.tai_s[k] + HUNTING_S
                calm[k] &= seen.tai_s[k] > self._hunting_until_tai_s
        return calm

    def _hunts(self, path_deg_s2: tuple[float, float], limits_deg_s2: tuple[float, float]) -> bool:
        """Whether a parabola through the newest readings is bent by more than noise and the limit allow."""
        t: Array = self._newest[:, 0] - self._newest[-1, 0]
        if t.size < WINDOW_COUNT or -t[0] > LONGEST_WINDOW_S:
            return False
        bend = 2.0 * np.linalg.pinv(np.vander(t, 3))[0]
        per_deg = float(np.linalg.norm(bend))
        cos_el = float(np.min(self._newest[:, 3]))
        settings = self._settings
        sigmas_deg_s2 = settings.sigma_azimuth_deg / cos_el * per_deg, settings.sigma_elevation_deg * per_deg
        measured_deg_s2 = bend @ self._newest[:, 1:3]
        for measured, path, sigma, limit in zip(
            measured_deg_s2, path_deg_s2, sigmas_deg_s2, limits_deg_s2, strict=True
        ):
            if abs(measured) > LEAST_SIGMAS * sigma and abs(measured + path) > limit + BEYOND_SIGMAS * sigma:
                return True
        return False
