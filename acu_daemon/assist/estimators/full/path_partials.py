"""A satellite's path over a station and what each state moves of it, on a coarse grid, interpolated.  Pure."""

from dataclasses import dataclass, replace
from math import cos, radians

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import (
    MOUNT,
    ORBIT_COUNT,
    PLUNGED_STATES,
    STATE_COUNT,
    STATION,
    STEPS,
    correction_of,
    shift_of,
)
from acu_daemon.model import Site
from acu_daemon.orbit.frames import enu_from_itrs, itrs_from_teme, station_itrs_m
from acu_daemon.orbit.propagator import Propagator, states_together
from acu_daemon.pointing.mount import axes_on_the_sky
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
    """Vectors and their rates at nodes, interpolated by cubic Hermite polynomials.

    Components first, here and in all that is computed of every reading: numpy is slow along an axis of three.
    """

    node_tai_s: Array
    cubics: Array  # (4, ..., 3, K - 1): coefficients between the nodes

    @staticmethod
    def through(node_tai_s: Array, value: Array, rate: Array) -> "Curve":
        """Take values and rates at even nodes, (..., 3, K)."""
        step = node_tai_s[1] - node_tai_s[0]
        first, rise = value[..., :-1], value[..., 1:] - value[..., :-1]
        start, end = step * rate[..., :-1], step * rate[..., 1:]
        return Curve(node_tai_s, np.array((first, start, 3.0 * rise - 2.0 * start - end, start + end - 2.0 * rise)))

    def at(self, tai_s: Array) -> Array:
        """Give (..., 3, N)."""
        x = (tai_s - self.node_tai_s[0]) / (self.node_tai_s[1] - self.node_tai_s[0])
        i = np.minimum(np.maximum(x.astype(np.int64), 0), self.node_tai_s.size - 2)  # np.clip takes 5 times as long
        u = x - i
        a, b, c, d = self.cubics.take(i, axis=-1)
        values: Array = a + u * (b + u * (c + u * d))
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
    r_itrs_m, v_itrs_m_s = itrs_from_teme(r_m, v_m_s, node_tai_s, site.orientation)
    return Curve.through(node_tai_s, r_itrs_m.T, v_itrs_m_s.T)


def orbit_partials_itrs(source: Propagator, x: Array, site: Site, node_tai_s: Array) -> tuple[Curve, Curve]:
    """The path of the states x, and what a unit of each of the six corrections moves, (6, 3, K), by differences.

    One-sided: the steps are so small that the curvature is a 1e-5th, which only the direction of a sweep sees.
    """
    moved = np.tile(x, (ORBIT_COUNT + 1, 1))
    moved[range(ORBIT_COUNT), range(ORBIT_COUNT)] += STEPS
    r_m, v_m_s = states_together(source, [correction_of(one) for one in moved], node_tai_s)
    steps = np.array(STEPS)[:, None, None]
    r_m[:-1], v_m_s[:-1] = (r_m[:-1] - r_m[-1]) / steps, (v_m_s[:-1] - v_m_s[-1]) / steps
    times = np.tile(node_tai_s, ORBIT_COUNT + 1)
    turned = itrs_from_teme(r_m.reshape(-1, 3), v_m_s.reshape(-1, 3), times, site.orientation)  # linear in both
    value, rate = (one.reshape(ORBIT_COUNT + 1, -1, 3).swapaxes(1, 2) for one in turned)
    path = Curve.through(node_tai_s, value[-1], rate[-1])
    return path, Curve.through(node_tai_s, value[:-1], rate[:-1])


def station_partials_enu(r_itrs_m: Array, site: Site) -> Array:
    """What a metre of each shift of the station moves in east, north and up, (3, 3, N)."""
    here = enu_m(r_itrs_m, site)
    moved = [enu_m(r_itrs_m, moved_site(site, shift)) for shift in _shifts()]
    return np.array([(there - here) / _SHIFT_M for there in moved])


def _shifts() -> list[tuple[float, float, float]]:
    return [(_SHIFT_M, 0.0, 0.0), (0.0, _SHIFT_M, 0.0), (0.0, 0.0, _SHIFT_M)]


def enu_m(r_itrs_m: Array, site: Site) -> Array:
    """Earth-fixed positions (3, N) as east, north, up of the station."""
    axes = enu_from_itrs(site.station)
    enu: Array = axes @ r_itrs_m - (axes @ station_itrs_m(site.station))[:, None]
    return enu


def sky_partials(r_itrs_m: Array, orbit_itrs: Array, site: Site, has_shift: bool, sense: Array | float = 1.0) -> Array:
    """What a unit of each state moves on the sky: (17, 2, N), across the elevation and in elevation, rad.

    sense: -1 for an antenna that is plunged, () or (N,).

    r_itrs_m: (3, N); orbit_itrs: (6, 3, N), the second of `orbit_partials_itrs`; site: moved by the states; has_shift:
    whether the station's place is in question.
    """
    east, north, up = enu_m(r_itrs_m, site)
    flat2 = east * east + north * north
    range_m = np.sqrt(flat2 + up * up)
    sin_el, cos_el = up / range_m, np.maximum(np.sqrt(flat2) / range_m, 1e-9)
    sin_az, cos_az = east / (range_m * cos_el), north / (range_m * cos_el)

    def turned(enu: Array) -> Array:  # (M, 3, N)
        across = cos_az * enu[:, 0] - sin_az * enu[:, 1]
        upward = cos_el * enu[:, 2] - sin_el * (sin_az * enu[:, 0] + cos_az * enu[:, 1])
        both: Array = np.stack((across, upward), axis=1) / range_m
        return both

    out = np.zeros((STATE_COUNT, 2, range_m.size))
    out[:ORBIT_COUNT] = turned(enu_from_itrs(site.station) @ orbit_itrs)
    out[6, 0] = cos_el
    out[7, 0] = 1.0
    out[8, 1] = 1.0
    out[9, 1] = low_shape(site, sin_el, cos_el, range_m)[0]
    if has_shift:
        out[STATION] = turned(station_partials_enu(r_itrs_m, site))
    out[MOUNT] = axes_on_the_sky(sin_az, cos_az, sin_el, cos_el)
    out[PLUNGED_STATES] *= sense
    return out


def covariance_on_sky(covariance: Array, partials: Array) -> tuple[Array, Array, Array]:
    """Covariance of directions, (N,) each, rad^2: across the elevation, both together, in elevation.

    covariance: (13, 13), of the states; partials: (13, 2, N), `sky_partials`.
    """
    moved = np.tensordot(covariance, partials, 1)
    across, upward = partials[:, 0], partials[:, 1]
    return (
        np.sum(across * moved[:, 0], axis=0),
        np.sum(across * moved[:, 1], axis=0),
        np.sum(upward * moved[:, 1], axis=0),
    )


def has_air(site: Site) -> bool:
    """Whether the biases' low part is shaped like refraction."""
    return site.antenna is not None and site.antenna.has_air


def low_shape(site: Site, sin_el: Array, cos_el: Array, range_m: Array) -> tuple[Array, Array]:
    """What a unit of the bias el_cot moves in elevation, and its derivative by that, 1 / deg: AngleBias."""
    if site.antenna is not None and has_air(site):
        return site.antenna.refraction_shape(np.arctan2(sin_el, cos_el) / DEG, range_m)
    cot = cot_el(sin_el, cos_el)
    return cot, -DEG * (1.0 + cot * cot)


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
