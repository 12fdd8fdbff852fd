"""Whether the path asks an axis to accelerate so much that autotrack lags.  Pure."""

import numpy as np

from acu_daemon.assist.offsets import Flags, Offsets
from acu_daemon.assist.settings import EstimatorSettings

LIMIT_SHARE = 0.3  # of the drive's acceleration: beyond it autotrack lags


def is_calm(seen: Offsets, settings: EstimatorSettings) -> Flags:
    """Say of each reading whether the path leaves both axes calm; all are where nobody knows the drives."""
    if settings.azimuth is None or settings.elevation is None:
        return np.ones(seen.tai_s.size, dtype=np.bool_)
    calm: Flags = (np.abs(seen.az_deg_s2) <= LIMIT_SHARE * settings.azimuth.max_acceleration_deg_s2) & (
        np.abs(seen.el_deg_s2) <= LIMIT_SHARE * settings.elevation.max_acceleration_deg_s2
    )
    return calm
