"""SGP4 mean elements of a corrected orbit at another epoch: those that give the same states around it.

A fit corrects the elements at their own epoch, days before the pass.  Who takes the fitted orbit as elements judges
them by their age, so it is written with the epoch of the pass: the mean elements that SGP4 has there, bettered by least
squares until its states are the fitted ones for a revolution around the epoch.
"""

from dataclasses import replace
from math import pi

import numpy as np

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction
from acu_daemon.orbit.correction import corrected_ellipse
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.units import Array

STEPS = (1e-5, 1e-5, 1e-10, 1e-5, 1e-5, 1e-5)  # for differences, of the correction's states in their order
MOST_TURNS = 12
ENOUGH_M = 1e-3  # the last improvement
_POINTS = 61
_HALF_TURN = 0.5


def at_epoch(source: Sgp4Propagator, epoch_tai_s: float) -> tuple[ElementSet, float]:
    """The elements at another epoch, and the greatest distance of their orbit from the source's, metres.

    Raises:  OrbitError: the source has no states there, or no elements give them.
    """
    half_s = _HALF_TURN * 2.0 * pi / source.elements.mean_motion_rad_s
    start, end = source.spans_tai_s[0]
    times = np.linspace(max(epoch_tai_s - half_s, start), min(epoch_tai_s + half_s, end), _POINTS)
    wanted_m, _ = source.states_teme(times)
    elements = _osculating(source, epoch_tai_s)
    off_m = np.inf
    for _ in range(MOST_TURNS):
        made = Sgp4Propagator(elements)
        residual = (wanted_m - made.states_teme(times)[0]).ravel()
        before_m, off_m = off_m, float(np.abs(residual).max())
        if abs(before_m - off_m) < ENOUGH_M:
            break
        columns = [_difference(made, k, times) for k in range(len(STEPS))]
        jacobian = np.array(columns).T
        scale = np.linalg.norm(jacobian, axis=0)
        step = np.linalg.lstsq(jacobian / scale, residual, rcond=None)[0] / scale
        elements = applied(elements, Correction(*(step * np.array(STEPS)).tolist()))
    if not np.isfinite(off_m):
        raise OrbitError(f"{source.elements.label}: no mean elements at another epoch")
    return elements, off_m


def applied(elements: ElementSet, correction: Correction) -> ElementSet:
    """The elements with a correction in them."""
    ellipse = corrected_ellipse(elements.eccentricity, elements.argp_rad, elements.mean_anomaly_rad, correction)
    return replace(
        elements,
        mean_motion_rad_s=elements.mean_motion_rad_s + correction.delta_mean_motion_rad_s,
        eccentricity=ellipse.e,
        inclination_rad=elements.inclination_rad + correction.delta_inclination_rad,
        raan_rad=(elements.raan_rad + correction.delta_raan_rad) % (2.0 * pi),
        argp_rad=ellipse.argp_rad % (2.0 * pi),
        mean_anomaly_rad=ellipse.mean_anomaly_rad % (2.0 * pi),
    )


def _osculating(source: Sgp4Propagator, epoch_tai_s: float) -> ElementSet:
    """A beginning: the osculating elements, which are the mean ones to some kilometres, with the mean motion kept."""
    r_m, v_m_s = source.states_teme(np.array([epoch_tai_s]))
    now = osculating_from_state(r_m, v_m_s)
    corrected = applied(source.elements, source.correction)
    return replace(
        corrected,
        kind="omm",
        epoch_tai_s=epoch_tai_s,
        eccentricity=float(now.e[0]),
        inclination_rad=float(now.i_rad[0]),
        raan_rad=float(now.raan_rad[0]) % (2.0 * pi),
        argp_rad=float(now.argp_rad[0]) % (2.0 * pi),
        mean_anomaly_rad=float(now.mean_anomaly_rad[0]) % (2.0 * pi),
    )


def _difference(made: Sgp4Propagator, state: int, times: Array) -> Array:
    """What a step of a state moves the positions, metres by step, (3 N,)."""
    step = np.zeros(len(STEPS))
    step[state] = STEPS[state]
    (up, _), (down, _) = (
        made.corrected(Correction(*(sign * step).tolist())).states_teme(times) for sign in (1.0, -1.0)
    )
    moved: Array = (up - down).ravel() / 2.0
    return moved
