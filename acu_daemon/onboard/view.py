"""A pass as the antenna's gimbal sees it: for any point of the Earth, its direction at every sample.

Song et al. 2016, eq 1: the direction is the vector from satellite to ground in the Earth-fixed frame, turned to the
inertial frame, to LVLH and to the body; the mount turns it on to the gimbal.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from acu_daemon.model import EarthOrientation, Station
from acu_daemon.onboard.attitude import Attitude
from acu_daemon.onboard.gimbal_frames import Gimbal, gimbal_angles, lvlh_from_inertial
from acu_daemon.orbit.frames import itrs_from_teme, station_itrs_m, teme_from_itrs
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DEG, Array

FINE_S = 0.05  # checks: 20 Hz; the peak of a pass near the axis lasts a second
PER_PLAN_STEP = 5  # plans are made at every fifth of those, 0.25 s


@dataclass(frozen=True)
class PassView:
    """Even samples of a pass, at most FINE_S apart; their count is a multiple of PER_PLAN_STEP plus one."""

    tai_s: Array  # (N,)
    satellite_itrs_m: Array  # (N, 3)
    gimbal_from_itrs: Array  # (N, 3, 3)

    @cached_property
    def time_s(self) -> Array:
        """Seconds since the first sample, (N,)."""
        since_s: Array = self.tai_s - self.tai_s[0]
        return since_s

    @property
    def step_s(self) -> float:
        return float(self.time_s[-1]) / (self.time_s.size - 1)

    @cached_property
    def plan(self) -> "PassView":
        """Every fifth sample."""
        every = slice(None, None, PER_PLAN_STEP)
        return PassView(self.tai_s[every], self.satellite_itrs_m[every], self.gimbal_from_itrs[every])

    def vectors_m(self, ground_itrs_m: Array) -> Array:
        """From the satellite to a point (3,) of the Earth, in the gimbal's frame, (N, 3)."""
        turned: Array = np.einsum("nij,nj->ni", self.gimbal_from_itrs, ground_itrs_m - self.satellite_itrs_m)
        return turned

    def unit(self, ground_itrs_m: Array) -> Array:
        """The same as unit vectors."""
        p = self.vectors_m(ground_itrs_m)
        unit: Array = p / np.linalg.norm(p, axis=1)[:, None]
        return unit

    def gimbal(self, ground_itrs_m: Array) -> Gimbal:
        """The gimbal's angles that point an aligned beam at a point (3,) of the Earth."""
        return gimbal_angles(self.vectors_m(ground_itrs_m))

    def az_rates_deg_s(self, grounds_itrs_m: Array) -> Array:
        """Azimuth rates (N, K) of aligned pointing at points (K, 3), by central differences of the vectors."""
        x, y = (
            self.gimbal_from_itrs[:, k] @ grounds_itrs_m.T
            - np.einsum("nj,nj->n", self.gimbal_from_itrs[:, k], self.satellite_itrs_m)[:, None]
            for k in (0, 1)
        )
        x_rate, y_rate = (np.gradient(one, self.step_s, axis=0) for one in (x, y))
        rates: Array = (x * y_rate - y * x_rate) / np.maximum(x * x + y * y, 1e-9) / DEG
        return rates


def gimbal_from_itrs(
    propagator: Propagator, attitude: Attitude, mount: Array, orientation: EarthOrientation, tai_s: Array
) -> tuple[Array, Array]:
    """Satellite positions (N, 3), ITRS, and the rotations (N, 3, 3) of eq 1, the mount's included.

    Raises:  OrbitError: orbit or attitude have no answer for one of the times.
    """
    r_teme_m, v_teme_m_s = propagator.states_teme(tai_s)
    lvlh = lvlh_from_inertial(r_teme_m, v_teme_m_s)
    body = attitude.body_from_lvlh(tai_s, lvlh)
    earth = np.stack([teme_from_itrs(axis, tai_s, orientation) for axis in np.eye(3)], axis=2)
    r_itrs_m, _ = itrs_from_teme(r_teme_m, v_teme_m_s, tai_s, orientation)
    return r_itrs_m, mount @ body @ lvlh @ earth


def view_pass(
    propagator: Propagator,
    attitude: Attitude,
    mount: Array,
    orientation: EarthOrientation,
    start_tai_s: float,
    end_tai_s: float,
) -> PassView:
    """Sample a pass from the first whole second after its start, as long as it lasts.

    Raises:  OrbitError: orbit or attitude have no answer for one of the times.
    """
    first_tai_s = np.ceil(start_tai_s)
    steps = PER_PLAN_STEP * int((end_tai_s - first_tai_s) / (FINE_S * PER_PLAN_STEP))
    tai_s = first_tai_s + FINE_S * np.arange(steps + 1)
    return PassView(tai_s, *gimbal_from_itrs(propagator, attitude, mount, orientation, tai_s))


def off_pointing_deg(view: PassView, station_itrs_m: Array, grounds_itrs_m: Array) -> Array:
    """Angles (N, K) at the satellite between the station and points (K, 3) of the Earth."""
    to_station = station_itrs_m - view.satellite_itrs_m
    to_points = grounds_itrs_m[None] - view.satellite_itrs_m[:, None]
    cross = np.linalg.norm(np.cross(to_station[:, None], to_points), axis=2)
    angles: Array = np.arctan2(cross, np.einsum("nj,nkj->nk", to_station, to_points)) / DEG
    return angles


def ground_points_itrs_m(station: Station, bearings_deg: Array, distances_m: Array) -> Array:
    """Points (K, 3) at distances along bearings from the station, on a sphere of its radius, at its height.

    Bearings are clockwise from true north.  Distances are arcs.
    """
    centre_m = station_itrs_m(station)
    up = centre_m / np.linalg.norm(centre_m)
    east = np.cross([0.0, 0.0, 1.0], up)
    east /= np.linalg.norm(east)
    north = np.cross(up, east)
    bearing = bearings_deg * DEG
    along = np.cos(bearing)[:, None] * north + np.sin(bearing)[:, None] * east
    arc = distances_m / np.linalg.norm(centre_m)
    points: Array = np.linalg.norm(centre_m) * (np.cos(arc)[:, None] * up + np.sin(arc)[:, None] * along)
    return points
