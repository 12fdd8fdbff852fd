"""Whether the path asks an axis to accelerate so much that autotrack lags.  Pure."""

import numpy as np

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.screening.offsets import Flags, propagator_of
from acu_daemon.assist.screening_limits import ACCELERATION_SHARE
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import FitResult, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array

HALF_STEP_S = 0.25  # of the difference of rates that gives a path's acceleration


def is_low_acceleration(
    source: Propagator, site: Site, fit: FitResult | None, tai_s: Array, settings: EstimatorSettings
) -> Flags:
    """Say of each time (N,) whether both axes accelerate little on the path; all do where the drives are not known.

    Raises:  OrbitError: the source has no answer for one of the times.
    """
    count = tai_s.size
    if settings.azimuth is None or settings.elevation is None:
        return np.ones(count, dtype=np.bool_)
    around = np.concatenate((tai_s - HALF_STEP_S, tai_s + HALF_STEP_S))
    path = encoder_look(propagator_of(source, fit), around, site, fit)
    is_low = np.ones(count, dtype=np.bool_)
    for rate_deg_s, axis in ((path.az_rate_deg_s, settings.azimuth), (path.el_rate_deg_s, settings.elevation)):
        acceleration_deg_s2 = (rate_deg_s[count:] - rate_deg_s[:count]) / (2.0 * HALF_STEP_S)
        is_low &= np.abs(acceleration_deg_s2) <= ACCELERATION_SHARE * axis.max_acceleration_deg_s2
    return is_low
