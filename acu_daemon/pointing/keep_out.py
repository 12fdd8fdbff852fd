"""What the beam keeps out of: boxes of azimuth and elevation, and a disc about the sun.  Pure, and one at a time.

Directions are those of the beam in air, from true north.  Clearances are degrees on the sky, negative inside.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import asin, atan2, cos, degrees, hypot, radians, sin, sqrt
from typing import Literal, Protocol

import numpy as np

from acu_daemon.model import Site
from acu_daemon.orbit.sun import sun_direction_deg
from acu_daemon.units import DEG

Vector = tuple[float, float, float]
Policy = Literal["avoid", "warn", "off"]
NODE_S = 60.0  # the sun between two of these: a chord of 0.25 deg, 0.0002 deg off its arc
WHOLE_TURN_DEG = 360.0
STEEPEST_DEG = 85.0  # above it a margin on the sky is no longer made of azimuth


class Zone(Protocol):
    """What the beam keeps out of, at one instant."""

    @property
    def name(self) -> str: ...

    def clearance_deg(self, az_deg: float, el_deg: float) -> float: ...

    def box_deg(self, margin_deg: float) -> tuple[float, float, float, float]:
        """Middle and half width in azimuth (180 or more: all of it), lowest and highest elevation, with a margin."""


@dataclass(frozen=True, slots=True)
class KeepOut:
    """A box: clockwise from one azimuth to the other, between two elevations; the same azimuths twice: all around."""

    name: str
    az_from_deg: float
    az_to_deg: float
    el_from_deg: float = -90.0
    el_to_deg: float = 90.0

    @property
    def half_width_deg(self) -> float:
        return ((self.az_to_deg - self.az_from_deg) % WHOLE_TURN_DEG or WHOLE_TURN_DEG) / 2.0

    def clearance_deg(self, az_deg: float, el_deg: float) -> float:
        half_deg = self.half_width_deg
        over_deg = max(self.el_from_deg - el_deg, el_deg - self.el_to_deg)
        if half_deg >= 180.0:
            return over_deg
        beside_deg = abs((az_deg - self.az_from_deg - half_deg + 180.0) % 360.0 - 180.0) - half_deg
        beside_deg *= cos(el_deg * DEG)
        if beside_deg > 0.0 and over_deg > 0.0:
            return hypot(beside_deg, over_deg)
        return max(beside_deg, over_deg)

    def box_deg(self, margin_deg: float) -> tuple[float, float, float, float]:
        low_deg, high_deg = self.el_from_deg - margin_deg, self.el_to_deg + margin_deg
        steepest_deg = min(max(abs(low_deg), abs(high_deg)), STEEPEST_DEG)
        half_deg = self.half_width_deg + margin_deg / cos(radians(steepest_deg))
        return self.az_from_deg + self.half_width_deg, half_deg, low_deg, high_deg


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc about a direction."""

    name: str
    az_deg: float
    el_deg: float
    radius_deg: float

    def clearance_deg(self, az_deg: float, el_deg: float) -> float:
        a, h, el = az_deg * DEG, el_deg * DEG, self.el_deg * DEG
        d_az, d_el = sin((a - self.az_deg * DEG) / 2.0), sin((h - el) / 2.0)
        return 2.0 * asin(min(1.0, sqrt(d_el * d_el + cos(h) * cos(el) * d_az * d_az))) / DEG - self.radius_deg

    def box_deg(self, margin_deg: float) -> tuple[float, float, float, float]:
        """The greatest azimuth beside a disc is where sin(width) = sin(radius) / cos(elevation)."""
        radius_deg = self.radius_deg + margin_deg
        share = sin(radians(min(radius_deg, 90.0))) / max(cos(radians(self.el_deg)), 1e-9)
        half_deg = degrees(asin(share)) if share < 1.0 else 180.0
        return self.az_deg, half_deg, self.el_deg - radius_deg, self.el_deg + radius_deg

    def at(self, angle_deg: float, margin_deg: float) -> tuple[float, float]:
        """The direction so far outside its rim, at a position angle about its middle (0 up, 90 to the right)."""
        far, el, angle = radians(self.radius_deg + margin_deg), radians(self.el_deg), radians(angle_deg)
        right, up = sin(far) * sin(angle), sin(far) * cos(angle)
        forward = cos(el) * cos(far) - sin(el) * up
        high = sin(el) * cos(far) + cos(el) * up
        return self.az_deg + degrees(atan2(right, forward)), degrees(asin(min(1.0, max(-1.0, high))))

    def angle_deg(self, az_deg: float, el_deg: float) -> float:
        """The position angle of a direction about its middle."""
        d_az, el0, el = radians(az_deg - self.az_deg), radians(self.el_deg), radians(el_deg)
        return degrees(atan2(cos(el) * sin(d_az), sin(el) * cos(el0) - cos(el) * sin(el0) * cos(d_az)))


@dataclass(frozen=True, slots=True, eq=False)
class Sun:
    """The sun as a site sees it, apparent in the air of its antenna, and what is kept clear of it.

    One object for one site: it is looked up by identity, ten times a second.
    """

    site: Site
    radius_deg: float
    policy: Policy = "avoid"

    def direction_deg(self, tai_s: float) -> tuple[float, float]:
        """Azimuth and apparent elevation at an instant."""
        x, y, z = self._toward(tai_s)
        return atan2(x, y) / DEG, atan2(z, sqrt(x * x + y * y)) / DEG

    def at(self, tai_s: float) -> Disc:
        """What is kept clear of it at an instant."""
        return _disc(self, tai_s)

    def angle_deg(self, az_deg: float, el_deg: float, tai_s: float) -> float:
        """Between the sun's middle and a direction."""
        x, y, z = self._toward(tai_s)
        a, h = az_deg * DEG, el_deg * DEG
        flat = cos(h)
        x, y, z = x - flat * sin(a), y - flat * cos(a), z - sin(h)
        return 2.0 * asin(min(1.0, sqrt(x * x + y * y + z * z) / 2.0)) / DEG

    def _toward(self, tai_s: float) -> tuple[float, float, float]:
        """East, north, up: nearly a unit vector."""
        node = tai_s // NODE_S
        share = tai_s / NODE_S - node
        (x0, y0, z0), (x1, y1, z1) = _nodes(self, int(node))
        return x0 + (x1 - x0) * share, y0 + (y1 - y0) * share, z0 + (z1 - z0) * share


@lru_cache(maxsize=4)
def _disc(sun: Sun, tai_s: float) -> Disc:
    """All that a tick asks is of one instant."""
    return Disc("the sun", *sun.direction_deg(tai_s), sun.radius_deg)


@lru_cache(maxsize=4096)
def _nodes(sun: Sun, node: int) -> tuple[Vector, Vector]:
    """East, north, up at a node of time and at the next one."""
    az_deg, el_deg = sun_direction_deg(NODE_S * np.array([node, node + 1.0]), sun.site)
    if sun.site.antenna is not None:
        el_deg = sun.site.antenna.apparent_el_deg(el_deg, np.inf)
    az, el = az_deg * DEG, el_deg * DEG
    toward = np.stack([np.cos(el) * np.sin(az), np.cos(el) * np.cos(az), np.sin(el)], axis=-1)
    (x0, y0, z0), (x1, y1, z1) = toward.tolist()
    return (x0, y0, z0), (x1, y1, z1)
