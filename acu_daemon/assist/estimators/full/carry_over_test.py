"""Tests what an earlier pass left: innovations of the readings against its covariance.  Pure.

Theory: docs/estimation.md, Carry-over.
"""

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import STATION, Prior
from acu_daemon.assist.estimators.full.normal_points import Sights, residuals
from acu_daemon.assist.estimators.full.path_partials import (
    covariance_on_sky,
    node_times,
    orbit_partials_itrs,
    site_of,
    sky_partials,
)
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array

WIDEST_SIGMAS = 5.0
REJECTED_S = 60.0  # as long as every reading lies beyond
LEAST_READINGS = 10  # so many of them
LONGEST_GAP_S = 10.0  # a minute with a longer gap between two readings is no minute of readings


class CarryOverTest:
    """Rejects a prior when a minute of readings lies beyond its sigmas.  Mutable; one owner."""

    def __init__(self, source: Propagator, site: Site, settings: EstimatorSettings, prior: Prior) -> None:
        self._source = source
        self._site = site
        self._settings = settings
        self._prior = prior
        self._beyond: list[float] = []  # times of the newest readings without one inside between them

    def rejects(self, seen: Sights) -> bool:
        """Take new readings, oldest first; say whether a minute of them rejects the prior.

        Raises:  OrbitError: the source has no answer for one of their times.
        """
        for tai_s, sigmas in zip(seen.tai_s.tolist(), self.sigmas(seen).tolist(), strict=True):
            is_gap = bool(self._beyond) and tai_s - self._beyond[-1] > LONGEST_GAP_S
            if sigmas <= WIDEST_SIGMAS or is_gap:
                self._beyond = []
            if sigmas > WIDEST_SIGMAS:
                self._beyond.append(tai_s)
            if len(self._beyond) >= LEAST_READINGS and tai_s - self._beyond[0] >= REJECTED_S:
                return True
        return False

    def sigmas(self, seen: Sights) -> Array:
        """How far each reading is from the prior's direction, in sigmas of both together, (N,)."""
        prior = self._prior
        nodes, here = node_times(float(seen.tai_s[0]), float(seen.tai_s[-1])), site_of(self._site, prior.mean)
        path, partials = orbit_partials_itrs(self._source, prior.mean, self._site, nodes)
        left = residuals(path, here, prior.mean, self._settings, seen)
        noise = np.square(left.noise_rad / left.noise_scale[:, None])
        has_shift = bool(prior.covariance[STATION, STATION].any())
        h = sky_partials(path.at(seen.tai_s), partials.at(seen.tai_s), here, has_shift, seen.sense)
        across, both, upward = covariance_on_sky(prior.covariance, h)
        across, upward = across + noise[0], upward + noise[1]
        x, y = left.off_rad
        sigmas: Array = np.sqrt((x * x * upward - 2.0 * both * x * y + y * y * across) / (across * upward - both**2))
        return sigmas
