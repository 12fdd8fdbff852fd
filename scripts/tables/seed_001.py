"""Aguirre and Medeiros 1988, 2.4: a loss at every elevation of a Landsat-4-like pass, and what prediction is worth."""

from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.assist.estimators.estimator import make_estimator
from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings
from acu_daemon.model import Readings
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.units import DEG, Array
from tables.air import with_scale
from tables.landsat import LandsatPass

LIMIT_DEG = 0.1  # Aguirre and Medeiros 1988, 2.4.1
OVERHEAD_DEG = 80.0
_EVERY_READING = 90.0  # degrees: 2.6d, no fits above 80, came later


@dataclass(frozen=True, slots=True)
class Experiment:
    """How a method is tried: what it reads before the loss, and how wrong its elements are."""

    name: str
    estimator: str
    settings: EstimatorSettings
    lock_s: float
    rate_hz: float
    noise_deg: float
    is_circular: bool  # the source has no eccentricity and no short-period terms
    d_a_km: float = 0.0
    d_i_deg: float = 0.0
    d_raan_deg: float = 0.0
    d_mean_anomaly_deg: float = 0.0


_NOISE_DEG = 0.05
_PUBLISHED = EstimatorSettings(_NOISE_DEG, _NOISE_DEG, _EVERY_READING, inversion_count=3)
_TODAY = EstimatorSettings(_NOISE_DEG, _NOISE_DEG, _EVERY_READING, orbit_sigmas=ElementSigmas())
_TODAY_CALIBRATED = replace(
    _TODAY, bias_sigma_azimuth_deg=0.01, bias_sigma_azimuth_sec_deg=0.0, bias_sigma_elevation_deg=0.01
)
J2_DISTANCE_KM = 4.4  # by so much the mean distance of this orbit is above its mean semi-major axis
AS_PUBLISHED = Experiment("circular, sphere of the mean a", "circular", _PUBLISHED, 3.0, 1.0, 0.0, True)
AS_DAEMON = Experiment("circular, sphere from the source", "circular", _TODAY, 3.0, 1.0, 0.0, False)
FULL_10_S = Experiment("full", "full", _TODAY, 10.0, 10.0, _NOISE_DEG, False)


def with_old_elements(experiment: Experiment) -> Experiment:
    """Elements some days old: mean anomaly 0.4 deg (7 s) and raan 0.01 deg off, and two days' drifts of 2.4.3."""
    name = f"{experiment.name}, old elements"
    return replace(experiment, name=name, d_a_km=0.1, d_i_deg=0.002, d_raan_deg=0.01, d_mean_anomaly_deg=0.4)


EXPERIMENTS = (
    AS_PUBLISHED,
    replace(AS_PUBLISHED, name="circular, sphere of the mean distance", d_a_km=J2_DISTANCE_KM),
    with_old_elements(AS_DAEMON),
    replace(
        with_old_elements(AS_DAEMON),
        name="circular, sphere from the source, old elements, 0.05° noise",
        lock_s=10.0,
        rate_hz=10.0,
        noise_deg=_NOISE_DEG,
    ),
    replace(FULL_10_S, name="full, 10 s lock, 0.05° noise"),
    replace(with_old_elements(FULL_10_S), name="full, 10 s lock, 0.05° noise, old elements"),
    replace(with_old_elements(FULL_10_S), name="full, the same, encoders good to 0.01°", settings=_TODAY_CALIBRATED),
)
SENSITIVE = (AS_PUBLISHED, AS_DAEMON, FULL_10_S)
A_ERRORS_KM = (0.0, 0.05, 0.2, 1.0, 2.5, 5.0)  # Aguirre and Medeiros 1988, 2.4.3: 0.05 km a day, to 100 times that
I_ERRORS_DEG = (0.0, 0.001, 0.01, 0.03, 0.1)


@dataclass(frozen=True, slots=True)
class LossTrial:
    """One loss: where, and the error each second after it, an angle on the sky."""

    el_deg: float
    is_rising: bool
    culmination_deg: float
    error_deg: Array

    @property
    def worst_deg(self) -> float:
        return float(self.error_deg.max())

    @property
    def seconds_within(self) -> float:
        """Seconds until the error exceeds the limit; infinite if it does not during the pass."""
        beyond = np.flatnonzero(self.error_deg > LIMIT_DEG)
        return float(beyond[0]) if beyond.size else np.inf


def loss_trials(a_pass: LandsatPass, experiment: Experiment, step_s: int, rng: np.random.Generator) -> list[LossTrial]:
    """Lose the signal every step_s seconds of a pass, from the end of the first lock on."""
    source = _source(a_pass.mean, experiment)
    trials = []
    for k in range(int(np.ceil(experiment.lock_s)), a_pass.tai_s.size - 1, step_s):
        loss_tai_s = float(a_pass.tai_s[k])
        settings = with_scale(experiment.settings, a_pass.site)
        estimator = make_estimator(experiment.estimator, source, a_pass.site, settings)
        estimator.add(_readings(a_pass, experiment, loss_tai_s, rng))
        fit = estimator.fit()
        corrected = source if fit is None else source.corrected(fit.correction)
        seen = encoder_look(corrected, a_pass.tai_s[k:], a_pass.site, fit)
        error_deg = sky_angles_deg(seen.az_deg, seen.el_deg, a_pass.az_deg[k:], a_pass.el_deg[k:])
        is_rising = bool(a_pass.el_deg[k] < a_pass.el_deg[k + 1])
        trials.append(LossTrial(float(a_pass.el_deg[k]), is_rising, a_pass.culmination_deg, error_deg))
    return trials


def _source(mean: BrouwerElements, experiment: Experiment) -> BrouwerPropagator:
    elements = replace(
        mean,
        a_m=mean.a_m + experiment.d_a_km * 1e3,
        i_rad=mean.i_rad + experiment.d_i_deg * DEG,
        raan_rad=mean.raan_rad + experiment.d_raan_deg * DEG,
        mean_anomaly_rad=mean.mean_anomaly_rad + experiment.d_mean_anomaly_deg * DEG,
    )
    if not experiment.is_circular:
        return BrouwerPropagator(elements)
    latitude_argument_rad = elements.argp_rad + elements.mean_anomaly_rad
    circular = replace(elements, e=0.0, argp_rad=0.0, mean_anomaly_rad=latitude_argument_rad)
    return BrouwerPropagator(circular, short_period=False)


def _readings(a_pass: LandsatPass, experiment: Experiment, end_tai_s: float, rng: np.random.Generator) -> Readings:
    count = round(experiment.lock_s * experiment.rate_hz)
    tai_s = end_tai_s - np.arange(count, 0, -1) / experiment.rate_hz
    seen = look_at(a_pass.orbit, tai_s, a_pass.site)
    across, upward = experiment.noise_deg * rng.standard_normal((2, count))
    az_deg = (seen.az_deg + across / np.cos(np.radians(seen.el_deg))) % 360.0
    return Readings(tai_s, az_deg, a_pass.apparent_el_deg(seen) + upward)


def sky_angles_deg(az1_deg: Array, el1_deg: Array, az2_deg: Array, el2_deg: Array) -> Array:
    """Angles on the sky between directions, (N,), well conditioned for small ones (haversine)."""
    d_az, d_el, el1, el2 = (np.radians(x) for x in (az2_deg - az1_deg, el2_deg - el1_deg, el1_deg, el2_deg))
    h = np.sin(d_el / 2.0) ** 2 + np.cos(el1) * np.cos(el2) * np.sin(d_az / 2.0) ** 2
    angle: Array = np.degrees(2.0 * np.arcsin(np.sqrt(np.minimum(1.0, h))))
    return angle


@dataclass(frozen=True, slots=True)
class Verdict:
    """The worst of many losses."""

    trial_count: int
    seconds_within: float  # the shortest
    seconds_within_overhead: float  # the shortest after a loss above 80 deg
    worst_at_10_s_overhead_deg: float
    worst_deg: float
    beyond_count: int  # losses after which the limit is exceeded before the set


def verdict(trials: list[LossTrial]) -> Verdict:
    """Sum up losses."""
    overhead = [one for one in trials if one.el_deg > OVERHEAD_DEG]
    return Verdict(
        len(trials),
        min(one.seconds_within for one in trials),
        min((one.seconds_within for one in overhead), default=np.inf),
        max((float(one.error_deg[:11].max()) for one in overhead), default=0.0),
        max(one.worst_deg for one in trials),
        sum(bool(np.isfinite(one.seconds_within)) for one in trials),
    )


def where_beyond(trials: list[LossTrial], edges_deg: tuple[float, ...]) -> list[tuple[str, int, int, float]]:
    """For each band of the elevation at the loss, rising: name, losses that leave the limit, all of them, the worst."""
    rows = []
    for low, high in zip(edges_deg, edges_deg[1:], strict=False):
        band = [one for one in trials if one.is_rising and low <= one.el_deg < high]
        beyond = sum(bool(np.isfinite(one.seconds_within)) for one in band)
        rows.append((f"{low:g}-{high:g}°", beyond, len(band), max((one.worst_deg for one in band), default=0.0)))
    setting = [one for one in trials if not one.is_rising]
    beyond = sum(bool(np.isfinite(one.seconds_within)) for one in setting)
    rows.append(("setting", beyond, len(setting), max((one.worst_deg for one in setting), default=0.0)))
    return rows
