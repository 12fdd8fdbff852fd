"""Orbits made for tests: Brouwer means without short-period terms, seen from stations where they are wanted."""

import numpy as np

from acu_daemon.model import Site, Station
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.timescales import gmst_rad, tai_from_utc
from acu_daemon.units import Array

EPOCH_TAI_S = tai_from_utc("2018-12-25T01:40:00Z")


def circular(
    i_deg: float = 98.6, e: float = 0.0001, a_km: float = 7180.0, *, is_descending: bool = False
) -> BrouwerPropagator:
    """An orbit that passes its ascending node, or the other one, at longitude 0, at EPOCH_TAI_S."""
    half_turn = np.pi if is_descending else 0.0
    raan = float(gmst_rad(np.array([EPOCH_TAI_S]), 0.0)[0]) + half_turn
    elements = BrouwerElements("MADE", EPOCH_TAI_S, a_km * 1e3, e, np.radians(i_deg), raan, 0.0, half_turn)
    return BrouwerPropagator(elements, short_period=False)


def site(longitude_deg: float = 3.0, latitude_deg: float = 0.0) -> Site:
    return Site(Station("MADE", latitude_deg, longitude_deg, 100.0))


def visible(propagator: BrouwerPropagator, where: Site, step_s: float = 0.1, least_deg: float = 5.0) -> Array:
    """Times of the pass around the epoch."""
    tai_s = EPOCH_TAI_S + np.arange(-900.0, 900.0, step_s)
    return tai_s[look_at(propagator, tai_s, where).el_deg >= least_deg]
