"""The states of the `full` estimator, their order, and what is known of them before any reading.  Pure.

docs/estimation.md, States, and docs/estimation.md, Prior, have the theory.

0-5    corrections of the mean elements at epoch, as in Correction: raan, mean anomaly, mean motion, e cos argp,
       e sin argp, inclination (rad, rad/s for the mean motion)
6-9    angle biases, as in AngleBias: azimuth, azimuth / cos(el), elevation, elevation x cot(el) (rad)
10-12  the station's true place minus the given one: east, north, up (m)
13-16  the mount's terms that are no angle biases of every antenna: NPAE, AN, AW, TF (rad), docs/antenna-model.md, Mount

States 6 and 8 are the mount's IA and IE, 7 its CA, 9 a scale of the refraction where there is air.
"""

from dataclasses import dataclass, field
from functools import cached_property
from math import hypot, radians

import numpy as np

from acu_daemon.assist.settings import ElementSigmas, EstimatorSettings, StateSigmas
from acu_daemon.model import AngleBias, Correction
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S, DEG, Array

ORBIT_COUNT = 6
STATE_COUNT = 17
ORBIT, BIAS, STATION, MOUNT = slice(0, 6), slice(6, 10), slice(10, 13), slice(13, 17)
MOUNT_TERMS = ("npae_deg", "an_deg", "aw_deg", "tf_deg")  # of pointing.mount, in the order of the states
EL_COT = 9
PLUNGED_STATES = [7, 8, 13]  # CA, IE, NPAE: they turn with the elevation axis, and show the other way when plunged
STEPS = (1e-5, 1e-5, 1e-10, 1e-5, 1e-5, 1e-5)  # for differences: some 70 m each; 60 m after a day for the mean motion

_UP_SHARE = 0.1  # coordinates are rounded in latitude and longitude; heights are known much better


@dataclass(frozen=True)
class Prior:
    """Mean (17,) and covariance (17, 17) of the states before the first reading."""

    mean: Array
    covariance: Array = field(repr=False)

    @cached_property
    def root(self) -> Array:
        """A root (17, M) of the covariance: covariance = root root^T, with M states that have a variance."""
        variance = np.diag(self.covariance)
        is_open = variance > 0.0
        sigma = np.sqrt(variance[is_open])
        values, vectors = np.linalg.eigh(self.covariance[np.ix_(is_open, is_open)] / np.outer(sigma, sigma))
        root = np.zeros((variance.size, sigma.size))
        root[is_open] = sigma[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
        return root


def correction_of(x: Array) -> Correction:
    """The orbit's part of the states."""
    return Correction(*x[ORBIT].tolist())


def bias_of(x: Array) -> AngleBias:
    """The biases among the states."""
    return AngleBias(*(x[BIAS] / DEG).tolist(), *(x[MOUNT] / DEG).tolist())


def shift_of(x: Array) -> tuple[float, float, float]:
    """The station's shift among the states, east, north and up, metres."""
    east_m, north_m, up_m = x[STATION].tolist()
    return east_m, north_m, up_m


def states_of(correction: Correction, bias: AngleBias, shift_enu_m: tuple[float, float, float]) -> Array:
    """The states that a fit found, (17,)."""
    orbit = [
        correction.delta_raan_rad,
        correction.delta_mean_anomaly_rad,
        correction.delta_mean_motion_rad_s,
        correction.delta_e_cos_argp,
        correction.delta_e_sin_argp,
        correction.delta_inclination_rad,
    ]
    biases = [bias.az_deg * DEG, bias.az_sec_deg * DEG, bias.el_deg * DEG, bias.el_cot_deg * DEG]
    mount = [getattr(bias, name) * DEG for name in MOUNT_TERMS]
    return np.array([*orbit, *biases, *shift_enu_m, *mount])


def make_prior(source: Propagator, settings: EstimatorSettings, at_tai_s: float) -> Prior:
    """What is known before the first reading, at at_tai_s; of the orbit, from kind and age unless the settings say."""
    covariance = np.zeros((STATE_COUNT, STATE_COUNT))
    sigmas = settings.sigmas_of(source.kind)
    if isinstance(sigmas, StateSigmas):
        covariance[ORBIT, ORBIT] = _orbit_covariance_of_state(source, sigmas)
    else:
        covariance[ORBIT, ORBIT] = _orbit_covariance(sigmas, abs(at_tai_s - source.epoch_tai_s))
    bias_deg = (
        settings.bias_sigma_azimuth_deg,
        settings.bias_sigma_azimuth_sec_deg,
        settings.bias_sigma_elevation_deg,
        settings.bias_sigma_elevation_cot_deg,
    )
    covariance[BIAS, BIAS] = np.diag(np.radians(bias_deg) ** 2)
    flat_m = settings.station_sigma_m
    covariance[STATION, STATION] = np.diag(np.square([flat_m, flat_m, _UP_SHARE * flat_m]))
    covariance[MOUNT, MOUNT] = np.diag(np.radians(settings.mount_sigmas_deg) ** 2)
    return Prior(np.zeros(STATE_COUNT), covariance)


def _orbit_covariance(sigmas: ElementSigmas, age_s: float) -> Array:
    days = age_s / DAY_S
    mean_motion_rad_s = hypot(sigmas.mean_motion_rad_min, sigmas.mean_motion_per_day_rad_min * days) / 60.0
    e_vector = hypot(sigmas.e_vector, sigmas.e_vector_per_day * days)
    return np.diag(
        np.square(
            [
                radians(sigmas.raan_deg),
                radians(sigmas.mean_anomaly_deg),
                mean_motion_rad_s,
                e_vector,
                e_vector,
                radians(sigmas.inclination_deg),
            ]
        )
    )


def _orbit_covariance_of_state(source: Propagator, sigmas: StateSigmas) -> Array:
    """Turn the same sigma of every component of position and velocity at epoch into elements.

    The wide limit on each element keeps node and mean anomaly apart where the state does not (an equatorial orbit).
    """
    at = np.array([source.epoch_tai_s])
    columns = []
    for k, step in enumerate(STEPS):
        x = np.zeros(STATE_COUNT)
        x[k] = step
        (r1, v1), (r0, v0) = (source.corrected(correction_of(s * x)).states_teme(at) for s in (1.0, -1.0))
        columns.append(np.concatenate(((r1 - r0)[0] / sigmas.position_m, (v1 - v0)[0] / sigmas.velocity_m_s)) / 2)
    scaled = np.array(columns).T  # by element in units of its step, in sigmas
    information = scaled.T @ scaled + np.diag((np.array(STEPS) / np.array([1.0, 1.0, 1e-4, 1.0, 1.0, 1.0])) ** 2)
    covariance: Array = np.linalg.inv(information) * np.outer(STEPS, STEPS)
    return covariance
