"""Look angles with their rates: geometric, without refraction, light time or aberration."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from acu_daemon.model import Site, Station
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.hermite import HermiteTable
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array

NODE_S = 30.0  # between the states of a stretch of path; what is interpolated between is good to 0.1 m
_ZENITH_M2 = 1e-12  # keeps azimuth and its rate finite (0) exactly overhead, where neither exists


@dataclass(frozen=True, slots=True)
class Look:
    """Directions and rates as a station sees them; every array is (N,)."""

    az_deg: Array  # [0, 360) clockwise from true north
    el_deg: Array
    range_m: Array
    az_rate_deg_s: Array
    el_rate_deg_s: Array


@lru_cache(maxsize=64)
def _origin_and_axes(station: Station) -> tuple[Array, Array]:
    return station_itrs_m(station), enu_from_itrs(station).T.copy()


def look(r_itrs_m: Array, v_itrs_m_s: Array, station: Station) -> Look:
    """Turn Earth-fixed states (N, 3) into look angles and rates.

    Source:  seed 000, eqs 1-3, turned to east-north-up; the rates are their time derivatives.
    """
    origin_m, axes = _origin_and_axes(station)
    east, north, up = ((r_itrs_m - origin_m) @ axes).T
    east_rate, north_rate, up_rate = (v_itrs_m_s @ axes).T
    flat2 = np.maximum(east * east + north * north, _ZENITH_M2)
    flat = np.sqrt(flat2)
    range2 = flat2 + up * up
    flat_rate = (east * east_rate + north * north_rate) / flat
    return Look(
        az_deg=np.arctan2(east, north) / DEG % 360.0 % 360.0,  # the second: -1e-15 % 360 is 360
        el_deg=np.arctan2(up, flat) / DEG,
        range_m=np.sqrt(range2),
        az_rate_deg_s=(north * east_rate - east * north_rate) / flat2 / DEG,
        el_rate_deg_s=(flat * up_rate - up * flat_rate) / range2 / DEG,
    )


def look_at(propagator: Propagator, tai_s: Array, site: Site) -> Look:
    """Look angles of a satellite at the times (N,), seen from a site.

    Raises:  OrbitError: the propagator has no answer for one of the times.
    """
    r_teme_m, v_teme_m_s = propagator.states_teme(tai_s)
    return look(*itrs_from_teme(r_teme_m, v_teme_m_s, tai_s, site.orientation), site.station)


def look_along(propagator: Propagator, tai_s: Array, site: Site) -> Look:
    """The same at rising times (N,) that lie close: the orbit is computed at a few of them and interpolated between.

    Raises:  OrbitError: the propagator has no answer for one of the times.
    """
    nodes = np.linspace(tai_s[0], tai_s[-1], max(4, 2 + int((tai_s[-1] - tai_s[0]) / NODE_S)))
    if nodes.size >= tai_s.size:
        return look_at(propagator, tai_s, site)
    table = HermiteTable(nodes, *itrs_from_teme(*propagator.states_teme(nodes), nodes, site.orientation))
    return look(*table.states(tai_s), site.station)
