"""Passes of a satellite over a site: rise, culmination and set, none missed, grazing ones included."""

from collections.abc import Callable
from dataclasses import replace
from math import ceil, log, log2, pi

import numpy as np
import numpy.typing as npt

from acu_daemon.model import Horizon, Pass, Site
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.propagator import Propagator, spans_tai_s
from acu_daemon.units import MU_M3_S2, Array

_STEPS_PER_REVOLUTION = 60.0
_FINEST_SHARE = 0.02  # of that step, however eccentric the orbit
_GOLDEN = (5.0**0.5 - 1.0) / 2.0
_RESOLUTION_S = 1e-3
SKYLINE_STEP_S, MOST_SKYLINE_STEPS = 1.0, 20000
_REVOLUTIONS_BEYOND = 3.0

_Height = Callable[[Array], Array]  # times (N,) to degrees above the lowest elevation (N,)


def find_passes(
    propagator: Propagator, site: Site, start_tai_s: float, end_tai_s: float, min_elevation_deg: float
) -> list[Pass]:
    """Find every pass that touches the span, in order; rise and set to 1 ms, on the inner side of the crossing.

    Elevations are apparent: those in the air of the site's antenna, if it has any.  Where the site has a skyline, a
    pass begins and ends by it too, and holds the times in between at which it is behind it; a pass that never comes
    over it is none.

    A pass in progress at the start (end) has its true rise (set), looked for up to three revolutions outside the
    span.  A satellite that does not rise (set) within those has a pass that begins at the start (ends at the end) of
    the span; one that never comes up has none.

    A source that has answers within spans only is searched there only; a pass cut by the end of such a span begins or
    ends there.

    Method:  elevations on a grid of a sixtieth of a revolution (finer for eccentric orbits), every local extremum
             refined by golden section, then every crossing between neighbouring nodes by bisection.
    Raises:  OrbitError: the propagator has no answer for a time in the search.
    """

    found: list[Pass] = []
    for first_tai_s, last_tai_s in spans_tai_s(propagator):
        start, end = max(start_tai_s, first_tai_s), min(end_tai_s, last_tai_s)
        if start <= end:
            found += _within(propagator, site, start, end, min_elevation_deg, first_tai_s, last_tai_s)
    if site.skyline is None:
        return found
    seen = (_over_skyline(propagator, site, site.skyline, one) for one in found)
    return [one for one in seen if one is not None and one.set_tai_s >= start_tai_s and one.rise_tai_s <= end_tai_s]


def _over_skyline(propagator: Propagator, site: Site, skyline: Horizon, one: Pass) -> Pass | None:
    """What the skyline leaves of a pass; hills that are crossed within SKYLINE_STEP_S are not seen."""

    def height(tai_s: Array) -> Array:
        seen = apparent_at(propagator, tai_s, site)
        return seen.el_deg - skyline.heights_deg(seen.az_deg)

    count = max(2, ceil(min(one.duration_s / SKYLINE_STEP_S, MOST_SKYLINE_STEPS)) + 1)
    nodes = np.linspace(one.rise_tai_s, one.set_tai_s, count)
    is_free = height(nodes) >= 0.0
    if not is_free.any():
        return None
    step_s = float(nodes[1] - nodes[0])
    comes = _crossings(height, nodes, ~is_free[:-1] & is_free[1:], step_s, is_rising=True).tolist()
    goes = _crossings(height, nodes, is_free[:-1] & ~is_free[1:], step_s, is_rising=False).tolist()
    rise_tai_s = one.rise_tai_s if is_free[0] else comes.pop(0)
    set_tai_s = one.set_tai_s if is_free[-1] else goes.pop()
    inner = np.array([one.culmination_tai_s] if rise_tai_s < one.culmination_tai_s < set_tai_s else [])
    return replace(
        _pass(propagator, site, rise_tai_s, set_tai_s, inner), hidden_tai_s=tuple(zip(goes, comes, strict=True))
    )


def _within(
    propagator: Propagator,
    site: Site,
    start_tai_s: float,
    end_tai_s: float,
    min_elevation_deg: float,
    first_tai_s: float,
    last_tai_s: float,
) -> list[Pass]:
    """The passes that touch start to end; no time before the first or after the last one is asked for."""

    def height(tai_s: Array) -> Array:
        return apparent_at(propagator, tai_s, site).el_deg - min_elevation_deg

    revolution_s, step_s = _revolution_and_step_s(propagator, start_tai_s)
    is_up_first, is_up_last = height(np.array([start_tai_s, end_tai_s])) >= 0.0
    beyond_s = _REVOLUTIONS_BEYOND * revolution_s
    low_s = start_tai_s - (beyond_s if is_up_first else step_s)
    high_s = end_tai_s + (beyond_s if is_up_last else step_s)
    nodes = _nodes(height, max(low_s, first_tai_s), min(high_s, last_tai_s), step_s)
    heights = height(nodes)
    is_up = heights >= 0.0
    rises = _crossings(height, nodes, ~is_up[:-1] & is_up[1:], step_s, is_rising=True)
    sets = _crossings(height, nodes, is_up[:-1] & ~is_up[1:], step_s, is_rising=False)
    if is_up[0]:
        rises = np.concatenate([[start_tai_s if low_s >= first_tai_s else first_tai_s], rises])
    if is_up[-1]:
        sets = np.concatenate([sets, [end_tai_s if high_s <= last_tai_s else last_tai_s]])
    return [
        _pass(propagator, site, rise, setting, nodes[(nodes > rise) & (nodes < setting)])
        for rise, setting in zip(rises.tolist(), sets.tolist(), strict=True)
        if rise <= end_tai_s and setting >= start_tai_s
    ]


def _revolution_and_step_s(propagator: Propagator, tai_s: float) -> tuple[float, float]:
    orbit = osculating_from_state(*propagator.states_teme(np.array([tai_s])))
    revolution_s = 2.0 * pi * float(orbit.a_m[0]) ** 1.5 / MU_M3_S2**0.5
    share = max((1.0 - float(orbit.e[0])) ** 1.5, _FINEST_SHARE)
    return revolution_s, revolution_s / _STEPS_PER_REVOLUTION * share


def _nodes(height: _Height, low_s: float, high_s: float, step_s: float) -> Array:
    """Times between which the elevation rises or falls only: an even grid and every local extremum, sorted."""
    grid = np.linspace(low_s, high_s, ceil((high_s - low_s) / step_s) + 1)
    up = np.diff(height(grid)) > 0.0
    turns = np.flatnonzero(up[:-1] != up[1:]) + 1
    sign = np.where(up[turns - 1], 1.0, -1.0)
    return np.sort(np.concatenate([grid, _highest(lambda t: sign * height(t), grid[turns - 1], grid[turns + 1])]))


def _highest(value: _Height, low: Array, high: Array) -> Array:
    """Where each function of a batch is highest between `low` and `high` (N,), by golden section."""
    if low.size == 0:
        return low
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a, at_b = value(a), value(b)
    for _ in range(ceil(log(_RESOLUTION_S / float(np.max(high - low))) / log(_GOLDEN))):
        is_left = at_a > at_b
        low, high = np.where(is_left, low, a), np.where(is_left, b, high)
        new = np.where(is_left, high - _GOLDEN * (high - low), low + _GOLDEN * (high - low))
        at_new = value(new)
        a, b = np.where(is_left, new, b), np.where(is_left, a, new)
        at_a, at_b = np.where(is_left, at_new, at_b), np.where(is_left, at_a, at_new)
    best: Array = (low + high) / 2.0
    return best


def _crossings(
    height: _Height, nodes: Array, is_crossing: npt.NDArray[np.bool_], step_s: float, *, is_rising: bool
) -> Array:
    """When the elevation crosses the lowest one between the marked nodes and their next ones; the side that is up."""
    before, after = nodes[:-1][is_crossing], nodes[1:][is_crossing]
    down, up = (before, after) if is_rising else (after, before)
    for _ in range(ceil(log2(step_s / _RESOLUTION_S)) + 1 if down.size else 0):
        middle = (down + up) / 2.0
        is_up = height(middle) >= 0.0
        down, up = np.where(is_up, down, middle), np.where(is_up, middle, up)
    return up


def _pass(propagator: Propagator, site: Site, rise_tai_s: float, set_tai_s: float, inner: Array) -> Pass:
    times = np.concatenate([[rise_tai_s], inner, [set_tai_s]])
    seen = apparent_at(propagator, times, site)
    top = int(np.argmax(seen.el_deg))
    return Pass(
        rise_tai_s=float(rise_tai_s),
        culmination_tai_s=float(times[top]),
        set_tai_s=float(set_tai_s),
        rise_az_deg=float(seen.az_deg[0]),
        culmination_el_deg=float(seen.el_deg[top]),
        culmination_az_deg=float(seen.az_deg[top]),
        set_az_deg=float(seen.az_deg[-1]),
    )
