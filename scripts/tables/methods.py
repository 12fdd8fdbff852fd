"""The methods that the tables compare: an estimator, its settings, and what it makes of the corrupted state."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from acu_daemon.assist.settings import PAPER, EstimatorSettings, StateSigmas
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import Array
from tables.errors_put_in import taken_as_mean, turned_to_mean


@dataclass(frozen=True, slots=True)
class Method:
    """One column of a table."""

    estimator: str  # as `make_estimator` knows it
    settings: EstimatorSettings
    source: Callable[[Array, float], Propagator]  # from a state (6,) and its time


# Kuga and Carrara 1988, 5.3; every reading is used, as the papers have no gate.
_AS_PUBLISHED = EstimatorSettings(0.1, 0.1, max_fit_elevation_deg=90.0, beamwidth_deg=20.0, kalman=PAPER)
# What an operator knows: the noise, how good the elements are (5.3) and that the station is rounded.
_TODAY_PLAIN = EstimatorSettings(
    0.06,
    0.05,
    max_fit_elevation_deg=90.0,
    sigma_elevation_cot_deg=0.01,
    orbit_sigmas=StateSigmas(3e3, 3.0),
    station_sigma_m=6e3,
)
# ... and the shape of the encoders' bias (eqs 24, 25): a constant part, and one with 1 / cos h and cot h.
_TODAY = replace(
    _TODAY_PLAIN,
    bias_sigma_azimuth_deg=0.1,
    bias_sigma_azimuth_sec_deg=0.01,
    bias_sigma_elevation_deg=0.1,
    bias_sigma_elevation_cot_deg=0.01,
)

METHODS = {
    "full": Method("full", _TODAY, turned_to_mean),
    "full-default-bias": Method("full", _TODAY_PLAIN, turned_to_mean),
    "full-as-mean": Method("full", _TODAY, taken_as_mean),
    "deterministic": Method("deterministic", _AS_PUBLISHED, taken_as_mean),
    "kalman": Method("kalman", _AS_PUBLISHED, taken_as_mean),
    "circular": Method("circular", _AS_PUBLISHED, taken_as_mean),
}
IN_TABLE = ("full", "deterministic", "kalman")
