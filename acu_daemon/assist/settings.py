"""The settings of the estimators.  Pure."""

from dataclasses import dataclass
from math import inf

from acu_daemon.model import AxisLimits


@dataclass(frozen=True, slots=True)
class KalmanTuning:
    """Initial covariance and process noise of the Kalman filter (seed 002, 5.3), 1 sigma, degrees.

    The walks are per square root of a second of data.  Process noise is added to a state only while its sigma is below
    the floor.
    """

    sigma_raan_deg: float
    sigma_mean_anomaly_deg: float
    walk_raan_deg: float
    walk_mean_anomaly_deg: float
    floor_deg: float = inf


SEED = KalmanTuning(1.0, 2.0, 0.01, 0.01, 0.05)  # seed 002, 5.3, with its 1 Hz readings
DAEMON = KalmanTuning(0.2, 2.0, 5e-5, 2e-4)  # measured over a population of orbits: docs/decisions


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """What an estimator must know beside orbit and site.

    Noise is 1 sigma, across the elevation (azimuth x cos(el)) and in elevation.  Without axis limits no reading counts
    as too fast.  inversion_count: consecutive inversions that `circular` averages, 3 to 8 (seed 001, 2.6c).
    """

    sigma_azimuth_deg: float = 0.05
    sigma_elevation_deg: float = 0.05
    max_fit_elevation_deg: float = 80.0
    beamwidth_deg: float = 1.0
    azimuth: AxisLimits | None = None
    elevation: AxisLimits | None = None
    inversion_count: int = 8
    kalman: KalmanTuning = DAEMON
