"""Where beams meet the ground: the WGS84 ellipsoid, seen from the station."""

import numpy as np

from acu_daemon.model import Station
from acu_daemon.onboard.gimbal_frames import Gimbal, beam_direction
from acu_daemon.onboard.profile import Task
from acu_daemon.orbit.frames import enu_from_itrs, station_itrs_m
from acu_daemon.units import DEG, EARTH_EQUATORIAL_RADIUS_M, EARTH_FLATTENING, Array

_RING = 73


def track_east_north_m(task: Task, gimbal: Gimbal, station: Station) -> Array:
    """East and north (N, 2) of the station where the beam meets the ellipsoid; nan where it misses it."""
    view = task.view
    beam = np.einsum("nij,ni->nj", view.gimbal_from_itrs, beam_direction(gimbal, task.cone.boresight))
    return _east_north_m(view.satellite_itrs_m, beam, station)


def footprint_east_north_m(task: Task, sample: int, station: Station) -> Array:
    """The margin's outline on the ground at one sample, a closed ring (K, 2); nan where it lies beyond the horizon."""
    satellite = task.view.satellite_itrs_m[sample]
    axis = station_itrs_m(station) - satellite
    axis /= np.linalg.norm(axis)
    side = np.cross(axis, satellite)
    side /= np.linalg.norm(side)
    up = np.cross(side, axis)
    angle = np.linspace(0.0, 360.0, _RING) * DEG
    around = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up
    ring = np.cos(task.margin_deg * DEG) * axis + np.sin(task.margin_deg * DEG) * around
    return _east_north_m(np.broadcast_to(satellite, ring.shape), ring, station)


def _east_north_m(from_m: Array, direction: Array, station: Station) -> Array:
    """Meet rays (N, 3) with the ellipsoid, made a sphere by stretching the polar axis."""
    stretch = np.array([1.0, 1.0, 1.0 / (1.0 - EARTH_FLATTENING)]) / EARTH_EQUATORIAL_RADIUS_M
    a, b = from_m * stretch, direction * stretch
    bb, ab, aa = (np.sum(one * other, axis=1) for one, other in ((b, b), (a, b), (a, a)))
    root = ab * ab - bb * (aa - 1.0)
    share = np.where(root >= 0.0, (-ab - np.sqrt(np.maximum(root, 0.0))) / bb, np.nan)
    met = from_m + share[:, None] * direction
    enu: Array = (met - station_itrs_m(station)) @ enu_from_itrs(station).T
    return enu[:, :2]
