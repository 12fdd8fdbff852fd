"""Where the gimbal may point so that the station stays within the margin: a tube of azimuth, and elevations in it.

Turn the station's direction p by -azimuth about the gimbal's axis: p' = (x', y', z').  Elevation turns the beam in the
plane x' z', so of all elevations the best one leaves the angle |asin y' - cross| between beam and station; `cross` is
the boresight's offset in azimuth.  Hence azimuth is allowed where that is within the margin m,

    sin(cross - m) <= sin(el0) sin(az0 - az) <= sin(cross + m),

whatever the elevation: the search for a path in the cone is one-dimensional and exact.  Where the axis itself lies
inside the cone, every azimuth is allowed.  With azimuth chosen, the elevations within the margin are an interval,

    A cos el + B sin el >= cos m - b_y y',   A = x' b_x + z' b_z,  B = x' b_z - z' b_x,  b the beam in the antenna.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.onboard.gimbal_frames import boresight_vector
from acu_daemon.onboard.quintic import Indices
from acu_daemon.units import DEG, Array

_EDGE_STEPS = 121


@dataclass(frozen=True, slots=True)
class Cone:
    """What keeps the contact: the half cone at the satellite, the boresight's offsets, and elevation's range."""

    margin_deg: float
    boresight_elevation_deg: float = 0.0
    boresight_cross_deg: float = 0.0
    el_min_deg: float = 0.0
    el_max_deg: float = 110.0

    @property
    def boresight(self) -> Array:
        return boresight_vector(self.boresight_elevation_deg, self.boresight_cross_deg)


@dataclass(frozen=True, slots=True)
class Tube:
    """Allowed azimuths at times (N,): lower and upper bounds, infinite where there is none; one winding."""

    time_s: Array
    lower_deg: Array
    upper_deg: Array


def azimuth_tube(cone: Cone, time_s: Array, az0_deg: Array, el0_deg: Array, *, is_outer: bool = False) -> Tube:
    """Make the tube around continuous station angles (N,), on the winding that these take.

    Where elevation's range cuts it the edge is searched in steps: inside the true one, or with is_outer outside.
    """
    sin_el = np.maximum(np.sin(el0_deg * DEG), 1e-12)
    cross, m = cone.boresight_cross_deg, cone.margin_deg
    low, high = (np.arcsin(np.clip(np.sin((cross + s * m) * DEG) / sin_el, -1.0, 1.0)) / DEG for s in (-1.0, 1.0))
    is_free = axis_is_inside(cone, el0_deg)
    tube = Tube(time_s, np.where(is_free, -np.inf, az0_deg - high), np.where(is_free, np.inf, az0_deg - low))
    reach_deg = m + abs(cross) + abs(cone.boresight_elevation_deg)
    is_near = (el0_deg - reach_deg < cone.el_min_deg) | (el0_deg + reach_deg > cone.el_max_deg)
    cut = np.flatnonzero(is_near & ~is_free)
    return _in_elevation_range(cone, tube, az0_deg, el0_deg, cut, outwards=int(is_outer)) if cut.size else tube


def _in_elevation_range(cone: Cone, tube: Tube, az0_deg: Array, el0_deg: Array, cut: Indices, outwards: int) -> Tube:
    """Keep, at the samples `cut`, the azimuths that have an elevation in range: the run of them around the widest."""
    lower, upper = tube.lower_deg.copy(), tube.upper_deg.copy()
    shares = np.linspace(0.0, 1.0, _EDGE_STEPS)
    for k in cut:
        tried = lower[k] + shares * (upper[k] - lower[k])
        p = np.broadcast_to(_direction(az0_deg[k], el0_deg[k]), (tried.size, 3))
        low, high = elevation_interval(cone, p, tried)
        room = high - low
        if room.max() < 0.0:
            upper[k] = lower[k] - 1.0
            continue
        best = int(np.argmax(room))
        bad = np.flatnonzero(room < 0.0)
        first = int(bad[bad < best].max(initial=-1)) + 1 - outwards
        last = int(bad[bad > best].min(initial=tried.size)) - 1 + outwards
        lower[k], upper[k] = tried[max(first, 0)], tried[min(last, tried.size - 1)]
    return Tube(tube.time_s, lower, upper)


def _direction(az_deg: float, el_deg: float) -> Array:
    az, el = az_deg * DEG, el_deg * DEG
    return np.array([np.cos(az) * np.sin(el), np.sin(az) * np.sin(el), np.cos(el)])


def axis_is_inside(cone: Cone, el0_deg: Array) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Where every azimuth has an elevation within margin and range."""
    nearest_deg = max(0.0, cone.el_min_deg + cone.boresight_elevation_deg) + abs(cone.boresight_cross_deg)
    inside: np.ndarray[tuple[int], np.dtype[np.bool_]] = el0_deg + nearest_deg <= cone.margin_deg
    return inside


def elevation_interval(cone: Cone, p: Array, az_deg: Array) -> tuple[Array, Array]:
    """Lowest and highest elevations (N,) within margin and range; lowest above highest where there are none.

    p: unit vectors (N, 3) to the station in the gimbal's frame.
    """
    c, s = np.cos(az_deg * DEG), np.sin(az_deg * DEG)
    x, y, z = c * p[:, 0] + s * p[:, 1], c * p[:, 1] - s * p[:, 0], p[:, 2]
    b = cone.boresight
    along, up = x * b[0] + z * b[2], x * b[2] - z * b[0]
    ratio = (np.cos(cone.margin_deg * DEG) - b[1] * y) / np.maximum(np.hypot(along, up), 1e-12)
    middle = np.arctan2(up, along) / DEG
    half = np.where(ratio <= 1.0, np.arccos(np.clip(ratio, -1.0, 1.0)) / DEG, -1.0)
    return np.maximum(middle - half, cone.el_min_deg), np.minimum(middle + half, cone.el_max_deg)


def windings(tube: Tube, az0_deg: Array) -> list[Tube]:
    """The tube, and those that pass the axis on the other side in each interval where it lies inside the cone."""
    is_free = np.isinf(tube.upper_deg)
    ends = np.flatnonzero(is_free[:-1] & ~is_free[1:]) + 1
    found = [tube]
    for end in ends:
        before = np.flatnonzero(~is_free[:end])
        if before.size == 0:
            continue
        turn_deg = -360.0 if az0_deg[end] > az0_deg[before[-1]] else 360.0
        shift = np.where(np.arange(az0_deg.size) >= end, turn_deg, 0.0)
        found += [Tube(one.time_s, one.lower_deg + shift, one.upper_deg + shift) for one in found]
    return found
