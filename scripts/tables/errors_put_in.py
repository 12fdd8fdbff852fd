"""The papers' errors: noise and bias of readings (Kuga and Carrara 1990, eqs 22-25), corrupted elements (section 5)."""

from dataclasses import dataclass

import numpy as np

from acu_daemon.model import Readings
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.units import Array
from tables.true_pass import TruePass

CORRUPTION = np.array([3e3, 3e3, 3e3, 3.0, 3.0, 3.0])  # m and m/s in each component


def azimuth_model_deg(el_deg: Array, range_km: Array) -> Array:
    """Sigma of the noise, and the bias alike, in azimuth (eqs 22 and 24), (N,)."""
    model: Array = 0.05 + (0.01 + 1e-6 * range_km) / np.cos(np.radians(el_deg))
    return model


def elevation_model_deg(el_deg: Array) -> Array:
    """Bias in elevation (eq 25), (N,), and sigma of its noise too: eq 23 as printed has C3 rho sin h, some degrees."""
    el = np.radians(el_deg)
    model: Array = 0.05 + 0.001 / np.sin(el) + 0.01 / np.tan(el)
    return model


@dataclass(frozen=True, slots=True)
class Errors:
    """One run's random part: standard normal numbers (N,) for each angle, and the signs of the six components."""

    azimuth: Array
    elevation: Array
    signs: Array


def draw_errors(rng: np.random.Generator, count: int) -> Errors:
    """Draw the errors of one run of a pass with so many samples."""
    return Errors(rng.standard_normal(count), rng.standard_normal(count), rng.choice((-1.0, 1.0), 6))


def readings_with(errors: Errors, true_pass: TruePass) -> Readings:
    """What the encoders of the exact station read."""
    az_deg = azimuth_model_deg(true_pass.el_deg, true_pass.range_km) * (1.0 + errors.azimuth)
    el_deg = elevation_model_deg(true_pass.el_deg) * (1.0 + errors.elevation)
    return Readings(true_pass.tai_s, (true_pass.az_deg + az_deg) % 360.0, true_pass.el_deg + el_deg)


def corrupted_state(errors: Errors, true_pass: TruePass) -> Array:
    """True state at the rise, 3 km and 3 m/s off in each component, (6,)."""
    state: Array = true_pass.state_teme + errors.signs * CORRUPTION
    return state


def taken_as_mean(state_teme: Array, tai_s: float) -> BrouwerPropagator:
    """Elements of a state used as if they were means, secular motion only, as Kuga and Carrara 1988, 5.3, do."""
    return BrouwerPropagator(_elements(state_teme, tai_s), short_period=False)


def turned_to_mean(state_teme: Array, tai_s: float) -> BrouwerPropagator:
    """Mean elements that, with the short-period terms, give the state.

    Fixed-point iteration: what the short-period terms add is taken off the state, in Cartesian components.
    """
    at, mean_state = np.array([tai_s]), state_teme
    for _ in range(20):
        source = BrouwerPropagator(_elements(mean_state, tai_s), short_period=True)
        missing = state_teme - np.concatenate(source.states_teme(at), axis=1)[0]
        mean_state = mean_state + missing
        if np.abs(missing[:3]).max() < 1e-3:
            break
    return source


def _elements(state_teme: Array, tai_s: float) -> BrouwerElements:
    orbit = osculating_from_state(state_teme[None, :3], state_teme[None, 3:])
    values = (orbit.a_m, orbit.e, orbit.i_rad, orbit.raan_rad, orbit.argp_rad, orbit.mean_anomaly_rad)
    return BrouwerElements("corrupted", tai_s, *(float(value[0]) for value in values))
