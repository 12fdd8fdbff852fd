"""A small world for ground-track tests: no tesserals, short runs; and orbits by brahe seen as D."""

from functools import lru_cache

import numpy as np

from acu_daemon.edge.flux_file import load_flux
from acu_daemon.groundtrack.environment import EPOCH_TAI_S, Spacecraft, node_rad
from acu_daemon.groundtrack.mean_elements import MeanElements, mean_of, states_of
from acu_daemon.groundtrack.simulate import World, make_world
from acu_daemon.units import Array

CRAFT = Spacecraft()
NODE_RAD = node_rad(CRAFT, EPOCH_TAI_S)


@lru_cache
def world(profile: str = "moderate") -> World:
    return make_world(load_flux(profile))


def start_state(delta_a_m: float = 0.0, delta_i_rad: float = 0.0) -> Array:
    """Osculating state (6,) of the reference orbit at the start, with offsets of its mean elements."""
    reference = CRAFT.reference
    start = (reference.a_m + delta_a_m, 0.0, reference.e, reference.i_rad + delta_i_rad, NODE_RAD, 0.0)
    state: Array = np.hstack(states_of(MeanElements(*(np.array([one]) for one in start))))[0]
    return state


def node_and_alpha(times_s: Array, r_m: Array, v_m_s: Array) -> tuple[Array, Array]:
    """Offsets of node and alpha from the reference orbit, radians, (N,)."""
    reference, mean = CRAFT.reference, mean_of(r_m, v_m_s)
    node = np.unwrap(mean.raan_rad) - NODE_RAD - reference.raan_rate_rad_s * times_s
    return node, np.unwrap(mean.alpha_rad - reference.alpha_rate_rad_s * times_s)
