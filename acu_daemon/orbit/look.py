"""Look angles with their rates, without refraction; on request with light time and the station's aberration.

The signal that arrives at t left the satellite at t - range / c: up to 0.0015 deg back along a low orbit.  Aberration
by the station's own motion adds to the inertial direction what the station moved meanwhile, so that both together are
the direction from station to satellite at t - range / c, in the inertial frame (planetary aberration; first order in
v / c, 1e-9 deg).  In Earth-fixed axes: the look of then, turned by what the Earth turned since, 4e-5 deg on a low orbit
and 0.0005 deg at 36000 km.  What it adds is Skyfield's to 4e-8 deg (tests/test_look.py).
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from acu_daemon.model import Site, Station
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, EARTH_RATE_RAD_S, Array

NODE_S, LEAST_NODES = 20.0, 8  # the orbit between: to 1 mm, as near as the times themselves are rounded
WORTH_COUNT = 16  # times for a node: fewer are faster without
LIGHT_M_S = 299792458.0
_POINT_GAP = 1e-30  # at a point its own value outweighs all others
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
    return station_itrs_m(station), enu_from_itrs(station)


def look(r_itrs_m: Array, v_itrs_m_s: Array, station: Station) -> Look:
    """Turn Earth-fixed states (N, 3) into look angles and rates.

    Source:  Kuga and Carrara 1990, eqs 1-3, turned to east-north-up; the rates are their time derivatives.
    """
    origin_m, axes = _origin_and_axes(station)
    east, north, up = axes @ (r_itrs_m - origin_m).T  # rows that lie whole in memory
    east_rate, north_rate, up_rate = axes @ v_itrs_m_s.T
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


def signal_states(r_itrs_m: Array, v_itrs_m_s: Array, station: Station) -> tuple[Array, Array]:
    """Turn Earth-fixed states (N, 3) into those that the signal now arriving comes from, seen with aberration.

    The velocity is what it was, 2e-5 of it short: the rate of the light time itself.
    """
    origin_m, _ = _origin_and_axes(station)
    late_s = np.linalg.norm(r_itrs_m - origin_m, axis=-1) / LIGHT_M_S
    way_m = r_itrs_m - late_s[:, None] * v_itrs_m_s - origin_m  # the bend of the orbit meanwhile is below 1 mm
    turned = EARTH_RATE_RAD_S * late_s
    way_m[:, 0], way_m[:, 1] = way_m[:, 0] + turned * way_m[:, 1], way_m[:, 1] - turned * way_m[:, 0]
    return origin_m + way_m, v_itrs_m_s


def _seen(r_itrs_m: Array, v_itrs_m_s: Array, site: Site) -> Look:
    if site.has_light_time:
        r_itrs_m, v_itrs_m_s = signal_states(r_itrs_m, v_itrs_m_s, site.station)
    return look(r_itrs_m, v_itrs_m_s, site.station)


def look_at(propagator: Propagator, tai_s: Array, site: Site) -> Look:
    """Look angles of a satellite at the times (N,), seen from a site.

    Raises:  OrbitError: the propagator has no answer for one of the times.
    """
    r_teme_m, v_teme_m_s = propagator.states_teme(tai_s)
    return _seen(*itrs_from_teme(r_teme_m, v_teme_m_s, tai_s, site.orientation), site)


def apparent_at(propagator: Propagator, tai_s: Array, site: Site) -> Look:
    """The same in the air over the site's antenna: where the satellite appears; the rates stay those in a vacuum.

    Raises:  OrbitError: the propagator has no answer for one of the times.
    """
    seen = look_at(propagator, tai_s, site)
    if site.antenna is None:
        return seen
    return replace(seen, el_deg=site.antenna.apparent_el_deg(seen.el_deg, seen.range_m))


def look_along(propagator: Propagator, tai_s: Array, site: Site) -> Look:
    """The same at rising times (N,) that lie close: the orbit is computed at a few instants and interpolated between.

    Raises:  OrbitError: the propagator has no answer for one of the times.
    """
    node_count = LEAST_NODES + int((tai_s[-1] - tai_s[0]) / NODE_S)
    if tai_s.size < WORTH_COUNT * node_count:
        return look_at(propagator, tai_s, site)
    middle_s, half_s = (tai_s[-1] + tai_s[0]) / 2.0, (tai_s[-1] - tai_s[0]) / 2.0
    points = -np.cos(np.linspace(0.0, np.pi, node_count))
    nodes = np.clip(middle_s + half_s * points, tai_s[0], tai_s[-1])
    shares = _interpolation((tai_s - middle_s) / half_s, points)
    r_m, v_m_s = itrs_from_teme(*propagator.states_teme(nodes), nodes, site.orientation)
    return _seen(shares @ r_m, shares @ v_m_s, site)


def _interpolation(x: Array, points: Array) -> Array:
    """Weights (N, K) of values at Chebyshev points (K,), ends included, for the polynomial through them at x (N,).

    Source:  Berrut and Trefethen, Barycentric Lagrange Interpolation, SIAM Review 46 (2004), eq 4.2 and section 5.
    """
    weights = np.where(np.arange(points.size) % 2, -1.0, 1.0)
    weights[[0, -1]] /= 2.0
    gap = x[:, None] - points
    terms = weights / np.where(gap == 0.0, _POINT_GAP, gap)
    shares: Array = terms / terms.sum(axis=1, keepdims=True)
    return shares
