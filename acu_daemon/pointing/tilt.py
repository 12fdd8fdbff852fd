"""A motorised tilt under the pedestal: it leans the azimuth axis, so that a pass over the zenith is not over its own.

    direction in the pedestal = the direction turned back by the tilt: T(-t), with T(t) the turn that leans what points
    up by t towards one azimuth

The tilt stands still during a pass.  It is chosen for one that the azimuth drive could not follow otherwise: the least
that keeps the pass off the pedestal's own zenith, or that comes nearest to it.  A tilt counts by its share across the
track: nearly all of it where the axis leans to the east or west and the orbit is polar.  Pure.
"""

from dataclasses import dataclass
from math import asin, atan2, ceil, cos, degrees, floor, radians, sin

import numpy as np
import numpy.typing as npt

from acu_daemon.model import AxisLimits
from acu_daemon.units import DEG, Array, wrap_180_array

STEP_DEG = 0.5  # from tilt to tilt that is tried
DRIVE_SHARE = 0.9  # of the azimuth drive: what a pass may ask of it, so that autotrack follows
SET_DEG = 0.05  # an axis that stands so near to what it was told is there


@dataclass(frozen=True, slots=True)
class TiltAxis:
    """The axis: its limits and drive, and the azimuth towards which a positive tilt leans."""

    limits: AxisLimits
    towards_deg: float


@dataclass(frozen=True, slots=True)
class Tilt:
    """How the azimuth axis leans during a pass; angles in degrees, arrays () or (N,)."""

    angle_deg: float
    towards_deg: float

    def to_pedestal(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike) -> tuple[Array, Array]:
        """Azimuth and elevation about the leaning axis; the azimuth within 180 deg of az_deg."""
        return self._turned(az_deg, el_deg, -self.angle_deg)

    def from_pedestal(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike) -> tuple[Array, Array]:
        """Back to the ground's angles, the elevation at most 90 deg."""
        return self._turned(az_deg, el_deg, self.angle_deg)

    def beam_deg(self, az_deg: float, el_deg: float) -> tuple[float, float]:
        """from_pedestal for one direction, quickly."""
        a, h, t = radians(az_deg - self.towards_deg), radians(el_deg), radians(self.angle_deg)
        forward, right, up = cos(h) * cos(a), cos(h) * sin(a), sin(h)
        forward, up = forward * cos(t) + up * sin(t), up * cos(t) - forward * sin(t)
        return self.towards_deg + degrees(atan2(right, forward)), degrees(asin(max(-1.0, min(1.0, up))))

    def rates_to_pedestal(
        self, az_deg: Array, el_deg: Array, az_rate_deg_s: npt.ArrayLike, el_rate_deg_s: npt.ArrayLike
    ) -> tuple[Array, Array]:
        """Rates about the leaning axes; at its zenith the azimuth's is bounded."""
        a, h, t = (az_deg - self.towards_deg) * DEG, el_deg * DEG, -self.angle_deg * DEG
        az_rate, el_rate = np.asarray(az_rate_deg_s), np.asarray(el_rate_deg_s)
        forward, right, up = np.cos(h) * np.cos(a), np.cos(h) * np.sin(a), np.sin(h)
        d_forward = -right * az_rate - np.sin(h) * np.cos(a) * el_rate
        d_right = forward * az_rate - np.sin(h) * np.sin(a) * el_rate
        d_up = np.cos(h) * el_rate
        forward, up = forward * np.cos(t) + up * np.sin(t), up * np.cos(t) - forward * np.sin(t)
        d_forward, d_up = d_forward * np.cos(t) + d_up * np.sin(t), d_up * np.cos(t) - d_forward * np.sin(t)
        flat2 = np.maximum(forward**2 + right**2, 1e-12)
        return (forward * d_right - right * d_forward) / flat2, d_up / np.sqrt(np.maximum(1.0 - up**2, 1e-12))

    def _turned(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike, by_deg: float) -> tuple[Array, Array]:
        az, h, t = np.asarray(az_deg, dtype=np.float64), np.radians(el_deg), by_deg * DEG
        a = (az - self.towards_deg) * DEG
        forward, right, up = np.cos(h) * np.cos(a), np.cos(h) * np.sin(a), np.sin(h)
        forward, up = forward * np.cos(t) + up * np.sin(t), up * np.cos(t) - forward * np.sin(t)
        turned = self.towards_deg + np.arctan2(right, forward) / DEG
        return az + wrap_180_array(turned - az), np.arcsin(np.clip(up, -1.0, 1.0)) / DEG


def choose_tilt(
    axis: TiltAxis, az_deg: Array, el_deg: Array, step_s: float, azimuth: AxisLimits, elevation: AxisLimits
) -> float:
    """The least tilt with which the drives follow a pass, or the one with which they miss least of it.

    az_deg, el_deg: (N,), directions of the pass at even steps, apparent.  What lies beyond the elevation's limits is
    missed as what the azimuth is too slow for.
    """
    first, last = ceil(axis.limits.min_deg / STEP_DEG - 1e-9), floor(axis.limits.max_deg / STEP_DEG + 1e-9)
    tilts = sorted((STEP_DEG * k for k in range(first, last + 1)), key=lambda one: (abs(one), one))

    def missed(angle_deg: float) -> int:
        az, el = Tilt(angle_deg, axis.towards_deg).to_pedestal(az_deg, el_deg)
        rate = np.diff(np.degrees(np.unwrap(np.radians(az)))) / step_s
        acceleration = np.diff(rate) / step_s
        is_slow = np.abs(rate[1:]) <= DRIVE_SHARE * azimuth.max_rate_deg_s
        is_slow &= np.abs(acceleration) <= DRIVE_SHARE * azimuth.max_acceleration_deg_s2
        is_reached = (el >= elevation.min_deg) & (el <= elevation.max_deg)
        return int(np.count_nonzero(~is_slow) + np.count_nonzero(~is_reached))

    return min(tilts, key=missed, default=0.0)
