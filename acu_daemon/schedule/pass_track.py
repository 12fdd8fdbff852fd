"""A pass as the schedule sees it: where the antenna would point, when it is of use, on which turns it fits."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.model import AxisLimits, Pass, Site
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.wrap import equal_turns
from acu_daemon.schedule.rules import SatelliteRules
from acu_daemon.units import Array

STEP_S = 2.0
LONGEST_S = 43200.0  # of a pass that does not set: it is looked at again long before
KEYHOLE_MARGIN = 0.95  # of the drive's rate: a path that is faster leaves the beam for a while


@dataclass(frozen=True)
class PassTrack:
    """Times (N,) TAI s, encoder angles (N,) deg, azimuth continuous; is_useful (N,): over the mask,
    outside keep-out zones, and slow enough.
    """

    satellite: str
    coming: Pass
    rules: SatelliteRules
    tai_s: Array
    az_deg: Array
    el_deg: Array
    is_useful: npt.NDArray[np.bool_]

    @property
    def start_tai_s(self) -> float:
        """Of the reservation."""
        return self.coming.rise_tai_s - self.rules.margin_s

    @property
    def end_tai_s(self) -> float:
        return float(self.tai_s[-1]) + self.rules.margin_s

    def useful_s(self, from_tai_s: float, to_tai_s: float, offset_deg: float, azimuth: AxisLimits) -> float:
        """Useful seconds between two times for an antenna on a turn."""
        az_deg = self.az_deg + offset_deg
        is_good = self.is_useful & (az_deg >= azimuth.min_deg) & (az_deg <= azimuth.max_deg)
        both = is_good[1:] & is_good[:-1]
        up_to_s = np.concatenate([[0.0], np.cumsum(np.diff(self.tai_s) * both)])
        low, high = np.interp([from_tai_s, to_tai_s], self.tai_s, up_to_s)
        return float(high - low)

    def at(self, tai_s: float) -> tuple[float, float]:
        """Azimuth and elevation at a time, those of rise and set beyond them."""
        return float(np.interp(tai_s, self.tai_s, self.az_deg)), float(np.interp(tai_s, self.tai_s, self.el_deg))

    def turns_deg(self, from_tai_s: float, to_tai_s: float, azimuth: AxisLimits) -> tuple[float, ...]:
        """What may be added to the azimuth of this part: the turns that hold it best, equally good ones all."""
        part = (self.tai_s >= from_tai_s - STEP_S) & (self.tai_s <= to_tai_s + STEP_S)
        return tuple(turn.offset_deg for turn in equal_turns(self.az_deg[part], self.el_deg[part], azimuth))


def track_of(
    satellite: str,
    propagator: Propagator,
    site: Site,
    coming: Pass,
    rules: SatelliteRules,
    envelope: Envelope,
) -> PassTrack:
    """Sample a pass.  OrbitError: the propagator has no answer for a time of it."""
    set_tai_s = min(coming.set_tai_s, coming.rise_tai_s + LONGEST_S)
    count = max(2, round((set_tai_s - coming.rise_tai_s) / STEP_S) + 1)
    tai_s = np.linspace(coming.rise_tai_s, set_tai_s, count)
    look = encoder_look(propagator, tai_s, site, None)
    az_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    elevation = envelope.elevation
    is_slow = np.abs(np.gradient(az_deg, tai_s)) <= KEYHOLE_MARGIN * envelope.azimuth.max_rate_deg_s
    is_inside = (look.el_deg >= elevation.min_deg) & (look.el_deg <= elevation.max_deg)
    is_free = envelope.sees(az_deg, look.el_deg) & envelope.is_clear(az_deg, look.el_deg, tai_s)
    return PassTrack(satellite, coming, rules, tai_s, az_deg, look.el_deg, is_slow & is_inside & is_free)
