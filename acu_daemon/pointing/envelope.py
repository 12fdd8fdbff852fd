"""The envelope: where the antenna may point and what its axes can do, one object that every mover asks.  Pure.

Soft limits, rates and accelerations of the axes, in the encoder frame; keep-out zones and the sun, which the beam keeps
out of; and the skyline, which says what can be seen and forbids nothing.  An elevation axis that reaches beyond 90 deg
plunges: there the beam points to the other side, and zones and skyline are asked about that direction.

Angles are those of the encoders, azimuth continuous.  Without zones and sun nothing is computed beside the limits.
"""

from dataclasses import dataclass, field
from math import inf

import numpy as np
import numpy.typing as npt

from acu_daemon.model import AxisLimits
from acu_daemon.pointing.keep_out import KeepOut, Sun, Zone
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.skyline import Skyline
from acu_daemon.pointing.tilt import Tilt
from acu_daemon.pointing.wrap import ROUNDING_DEG
from acu_daemon.units import Array

Truth = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Envelope:
    """Everything that bounds where the antenna is moved."""

    azimuth: AxisLimits
    elevation: AxisLimits
    keep_outs: tuple[KeepOut, ...] = ()
    sun: Sun | None = None  # None: nobody cares
    skyline: Skyline | None = None
    mount: Mount | None = None  # None: the encoders show the beam's direction
    stow_deg: tuple[float, float] | None = None  # where the ACU's own stow position is; None: not known
    tilt: Tilt | None = None  # of the pedestal, during a pass
    has_zones: bool = field(init=False)  # whether the beam keeps out of anything

    def __post_init__(self) -> None:
        is_avoided = self.sun is not None and self.sun.policy == "avoid"
        object.__setattr__(self, "has_zones", bool(self.keep_outs) or is_avoided)

    def zones_at(self, tai_s: float) -> tuple[Zone, ...]:
        """What the beam keeps out of at an instant."""
        if self.sun is None or self.sun.policy != "avoid":
            return self.keep_outs
        return (*self.keep_outs, self.sun.at(tai_s))

    def beam_deg(self, az_deg: float, el_deg: float) -> tuple[float, float]:
        """Direction of the beam, to 0.01 deg: azimuth of any turn from true north, elevation in air of -90 to 90."""
        if self.mount is not None:
            az_deg, el_deg = self.mount.beam_near(az_deg, el_deg)
        az_deg, el_deg = (az_deg + 180.0, 180.0 - el_deg) if el_deg > 90.0 else (az_deg, el_deg)
        return (az_deg, el_deg) if self.tilt is None else self.tilt.beam_deg(az_deg, el_deg)

    def is_bent(self, *el_deg: float) -> bool:
        """Whether a way between such elevations is none on the sky that way_round knows: plunged, or leaning."""
        return self.tilt is not None or max(el_deg) > 90.0

    # One direction, or (N,) of them at (N,) times

    def allows(
        self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike, tai_s: npt.ArrayLike, margin_deg: float = 0.0
    ) -> Truth:
        """Whether the antenna may point there: within the limits of both axes, outside every zone by a margin.

        Args:    az_deg, el_deg: encoders', azimuth continuous; tai_s.  Each () or (N,).
        Returns: () or (N,).
        """
        rooms: Truth = self.rooms_deg(az_deg, el_deg, tai_s) >= margin_deg - ROUNDING_DEG
        return rooms

    def rooms_deg(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike, tai_s: npt.ArrayLike) -> Array:
        """Degrees to the nearest bound, negative beyond it: of the axes to their limits, on the sky to a zone.

        Arguments and shape as `allows`.
        """
        rooms: Array = np.vectorize(self.room_deg, otypes=[np.float64])(az_deg, el_deg, tai_s)
        return rooms

    def is_clear(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike, tai_s: npt.ArrayLike) -> Truth:
        """Whether the beam is outside all zones there, on whatever turn; () or (N,)."""
        if not self.has_zones:
            return np.ones(np.broadcast(az_deg, el_deg, tai_s).shape, dtype=np.bool_)
        clear: Truth = np.vectorize(self.clearance_deg, otypes=[np.float64])(az_deg, el_deg, tai_s) >= 0.0
        return clear

    def sees(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike) -> Truth:
        """Whether the sky is free there, above the skyline; () or (N,)."""
        if self.skyline is None:
            return np.ones(np.broadcast(az_deg, el_deg).shape, dtype=np.bool_)
        heights: Truth = np.vectorize(self.over_skyline_deg, otypes=[np.float64])(az_deg, el_deg) >= 0.0
        return heights

    # One direction, as a tick asks

    def room_deg(self, az_deg: float, el_deg: float, tai_s: float) -> float:
        """The same for one direction."""
        azimuth, elevation = self.azimuth, self.elevation
        to_limit_deg = min(
            az_deg - azimuth.min_deg,
            azimuth.max_deg - az_deg,
            el_deg - elevation.min_deg,
            elevation.max_deg - el_deg,
        )
        return min(to_limit_deg, self.clearance_deg(az_deg, el_deg, tai_s))

    def clearance_deg(self, az_deg: float, el_deg: float, tai_s: float) -> float:
        """Degrees on the sky to the nearest zone, negative inside; infinite where there is none."""
        if not self.has_zones:
            return inf
        beam = self.beam_deg(az_deg, el_deg)
        return min(zone.clearance_deg(*beam) for zone in self.zones_at(tai_s))

    def over_skyline_deg(self, az_deg: float, el_deg: float) -> float:
        """How far above the skyline; infinite where there is none."""
        if self.skyline is None:
            return inf
        az_deg, el_deg = self.beam_deg(az_deg, el_deg)
        return el_deg - self.skyline.height_deg(az_deg)

    def zone_at(self, az_deg: float, el_deg: float, tai_s: float, margin_deg: float = 0.0) -> Zone | None:
        """The zone that holds a direction, or comes nearer than a margin."""
        if not self.has_zones:
            return None
        beam = self.beam_deg(az_deg, el_deg)
        return next((zone for zone in self.zones_at(tai_s) if zone.clearance_deg(*beam) < margin_deg), None)

    def why_not(self, az_deg: float, el_deg: float, tai_s: float, slack_deg: float = 0.0) -> str:
        """Why the antenna must not be sent there; empty: it may.  slack_deg: beyond a limit, for what is rounded."""
        azimuth, elevation = self.azimuth, self.elevation
        is_within = azimuth.min_deg - slack_deg <= az_deg <= azimuth.max_deg + slack_deg
        if not is_within or not elevation.min_deg - slack_deg <= el_deg <= elevation.max_deg + slack_deg:
            return self.beyond_limits(az_deg, el_deg, slack_deg)
        if not self.has_zones or (zone := self.zone_at(az_deg, el_deg, tai_s)) is None:
            return ""
        return f"within the keep-out of {zone.name}"

    def beyond_limits(self, az_deg: float, el_deg: float, slack_deg: float = 0.0) -> str:
        """Which axis does not reach a place, and its limits; empty: both do."""
        for name, angle_deg, limits in (("azimuth", az_deg, self.azimuth), ("elevation", el_deg, self.elevation)):
            if not limits.min_deg - slack_deg <= angle_deg <= limits.max_deg + slack_deg:
                return f"{name} outside {limits.min_deg:g} to {limits.max_deg:g} deg"
        return ""
