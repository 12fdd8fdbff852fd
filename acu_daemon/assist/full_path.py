"""A satellite's path over a station and what each state moves of it, on a coarse grid, interpolated.  Pure."""

from dataclasses import dataclass, replace
from math import cos, radians

import numpy as np

from acu_daemon.assist.full_states import ORBIT_COUNT, STATE_COUNT, STEPS, correction_of, shift_of
from acu_daemon.model import Site
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, EARTH_EQUATORIAL_RADIUS_M, Array

NODE_STEP_S = 20.0  # cubics through positions and velocities 20 s apart are good to 5 mm
_SHIFT_M = 100.0
_LEAST_SIN_EL, _LEAST_COS_EL = 0.02, 0.01  # keep cot and sec of the elevation finite


def node_times(first_tai_s: float, last_tai_s: float) -> Array:
    """A grid that covers a span, at whole multiples of its step."""
    first, last = np.floor(first_tai_s / NODE_STEP_S), np.floor(last_tai_s / NODE_STEP_S) + 1.0
    nodes: Array = NODE_STEP_S * np.arange(first, last + 1.0)
    return nodes


@dataclass(frozen=True, slots=True)
class Curve:
    """Vectors (M, 3) and their rates at nodes, interpolated by cubic Hermite polynomials."""

    node_tai_s: Array
    value: Array  # (..., K, 3)
    rate: Array

    def at(self, tai_s: Array) -> Array:
        """Give (..., N, 3)."""
        step = self.node_tai_s[1] - self.node_tai_s[0]
        x = (tai_s - self.node_tai_s[0]) / step
        i = np.minimum(np.maximum(x.astype(np.int64), 0), self.node_tai_s.size - 2)  # np.clip takes 5 times as long
        u = (x - i)[:, None]
        v = 1.0 - u
        first, second = self.value.take(i, axis=-2), self.value.take(i + 1, axis=-2)
        first_rate, second_rate = self.rate.take(i, axis=-2), self.rate.take(i + 1, axis=-2)
        values: Array = (
            v * v * (1.0 + 2.0 * u) * first
            + u * u * (1.0 + 2.0 * v) * second
            + (u * v * v * step) * first_rate
            - (u * u * v * step) * second_rate
        )
        return values


def moved_site(site: Site, shift_enu_m: tuple[float, float, float]) -> Site:
    """The site with its station moved; vertical and north turn with it."""
    if shift_enu_m == (0.0, 0.0, 0.0):
        return site
    east_m, north_m, up_m = shift_enu_m
    station = site.station
    at_equator_deg = 1.0 / EARTH_EQUATORIAL_RADIUS_M / DEG
    moved = replace(
        station,
        latitude_deg=station.latitude_deg + north_m * at_equator_deg,
        longitude_deg=station.longitude_deg + east_m * at_equator_deg / max(cos(radians(station.latitude_deg)), 1e-3),
        height_m=station.height_m + up_m,
    )
    return replace(site, station=moved)


def path_itrs(source: Propagator, x: Array, site: Site, node_tai_s: Array) -> Curve:
    """Earth-fixed positions of the source as corrected by the states x."""
    r_m, v_m_s = source.corrected(correction_of(x)).states_teme(node_tai_s)
    return Curve(node_tai_s, *itrs_from_teme(r_m, v_m_s, node_tai_s, site.orientation))


def orbit_partials_itrs(source: Propagator, x: Array, site: Site, node_tai_s: Array) -> tuple[Curve, Curve]:
    """The path of the states x, and what a unit of each of the six corrections moves, (6, K, 3), by differences.

    One-sided: the steps are so small that the curvature is a 1e-5th, which only the direction of a sweep sees.
    """
    r_m, v_m_s = np.empty((2, ORBIT_COUNT + 1, node_tai_s.size, 3))
    r_m[-1], v_m_s[-1] = source.corrected(correction_of(x)).states_teme(node_tai_s)
    for k, step in enumerate(STEPS):
        moved = x.copy()
        moved[k] += step
        r1_m, v1_m_s = source.corrected(correction_of(moved)).states_teme(node_tai_s)
        r_m[k], v_m_s[k] = (r1_m - r_m[-1]) / step, (v1_m_s - v_m_s[-1]) / step
    times = np.tile(node_tai_s, ORBIT_COUNT + 1)
    turned = itrs_from_teme(r_m.reshape(-1, 3), v_m_s.reshape(-1, 3), times, site.orientation)  # linear in both
    value, rate = (one.reshape(ORBIT_COUNT + 1, -1, 3) for one in turned)
    return Curve(node_tai_s, value[-1], rate[-1]), Curve(node_tai_s, value[:-1], rate[:-1])


def station_partials_enu(r_itrs_m: Array, site: Site) -> Array:
    """What a metre of each shift of the station moves in east, north and up, (3, N, 3)."""
    here = enu_m(r_itrs_m, site)
    moved = [enu_m(r_itrs_m, moved_site(site, shift)) for shift in _shifts()]
    return np.array([(there - here) / _SHIFT_M for there in moved])


def _shifts() -> list[tuple[float, float, float]]:
    return [(_SHIFT_M, 0.0, 0.0), (0.0, _SHIFT_M, 0.0), (0.0, 0.0, _SHIFT_M)]


def enu_m(r_itrs_m: Array, site: Site) -> Array:
    """Earth-fixed positions (N, 3) as east, north, up of the station."""
    enu: Array = (r_itrs_m - station_itrs_m(site.station)) @ enu_from_itrs(site.station).T
    return enu


def sky_partials(r_itrs_m: Array, orbit_itrs: Array, site: Site, has_shift: bool) -> Array:
    """What a unit of each state moves on the sky: (13, N, 2), across the elevation and in elevation, rad.

    r_itrs_m: (N, 3); orbit_itrs: (6, N, 3), the second of `orbit_partials_itrs`; site: moved by the states; has_shift:
    whether the station's place is in question.
    """
    enu = enu_m(r_itrs_m, site)
    range_m = np.linalg.norm(enu, axis=1)
    sin_el = enu[:, 2] / range_m
    cos_el = np.maximum(np.hypot(enu[:, 0], enu[:, 1]) / range_m, 1e-9)
    sin_az, cos_az = enu[:, 0] / (range_m * cos_el), enu[:, 1] / (range_m * cos_el)
    zero = np.zeros_like(range_m)
    across = np.stack((cos_az, -sin_az, zero), axis=1) / range_m[:, None]
    upward = np.stack((-sin_az * sin_el, -cos_az * sin_el, cos_el), axis=1) / range_m[:, None]
    out = np.zeros((STATE_COUNT, range_m.size, 2))
    moved = orbit_itrs @ enu_from_itrs(site.station).T
    out[:ORBIT_COUNT, :, 0], out[:ORBIT_COUNT, :, 1] = (moved * across).sum(-1), (moved * upward).sum(-1)
    out[6, :, 0] = cos_el
    out[7, :, 0] = 1.0
    out[8, :, 1] = 1.0
    out[9, :, 1] = cot_el(sin_el, cos_el)
    if has_shift:
        moved = station_partials_enu(r_itrs_m, site)
        out[10:, :, 0], out[10:, :, 1] = (moved * across).sum(-1), (moved * upward).sum(-1)
    return out


def cot_el(sin_el: Array, cos_el: Array) -> Array:
    """Cotangent of the elevation, finite at and below the horizon."""
    cot: Array = cos_el / np.maximum(sin_el, _LEAST_SIN_EL)
    return cot


def sec_el(cos_el: Array) -> Array:
    """1 / cos of the elevation, finite at the zenith."""
    sec: Array = 1.0 / np.maximum(cos_el, _LEAST_COS_EL)
    return sec


def site_of(site: Site, x: Array) -> Site:
    """The site as the states x have it."""
    return moved_site(site, shift_of(x))
