"""What the configuration and people say of the schedule: priorities, least worth, windows, words for single passes."""

from dataclasses import dataclass
from enum import StrEnum

from acu_daemon.control.tracking.approach import way_s
from acu_daemon.model import AxisLimits

SAME_PASS_S = 600.0  # two culminations of a satellite nearer than this are one pass, by other elements


@dataclass(frozen=True, slots=True)
class SatelliteRules:
    """One satellite's [schedule]: priority 0 (only where nothing else is) to 9; angles in degrees, times in seconds.

    margin_s: reserved before rise and after set.  may_be_cut: a part of a pass is worth having.  may_interrupt: a pass
    that is being tracked, of a lower priority, is given up for one of this satellite.
    """

    priority: int = 5
    min_culmination_deg: float = 0.0
    min_useful_s: float = 60.0
    margin_s: float = 0.0
    may_be_cut: bool = False
    may_interrupt: bool = False


@dataclass(frozen=True, slots=True)
class Window:
    """A time in which the station is not to track."""

    from_tai_s: float
    to_tai_s: float
    reason: str


class Wish(StrEnum):
    """What a person wants of a pass."""

    FORCE = "force"
    GO_ON = "go on"  # not a person's: the pass was on when the daemon was killed
    EXCLUDE = "exclude"
    NONE = "none"  # neither: an earlier word is withdrawn


@dataclass(frozen=True, slots=True)
class PassRequest:
    """A person's word about the pass of a satellite that is up at, or culminates nearest to, a time."""

    satellite: str
    at_tai_s: float
    wish: Wish

    def is_of(self, satellite: str, rise_tai_s: float, culmination_tai_s: float, set_tai_s: float) -> bool:
        """Whether it is about this pass."""
        is_up = rise_tai_s <= self.at_tai_s <= set_tai_s
        return satellite == self.satellite and (is_up or abs(culmination_tai_s - self.at_tai_s) < SAME_PASS_S)


@dataclass(frozen=True, slots=True)
class StationRules:
    """The station's [schedule] and its pedestal.

    pre_s, post_s: for the hooks, the modes and the settling before a pass, and after it; the slew comes on top.
    """

    azimuth: AxisLimits
    elevation: AxisLimits
    pre_s: float = 60.0
    post_s: float = 10.0
    windows: tuple[Window, ...] = ()
    requests: tuple[PassRequest, ...] = ()

    @property
    def longest_gap_s(self) -> float:
        """From a pass to another one, from any angle to any other."""
        return self.pre_s + self.post_s + self.slew_s(self._range(self.azimuth), self._range(self.elevation))

    def window_in_the_way(self, start_tai_s: float, end_tai_s: float) -> Window | None:
        """The first window that a pass of these times runs into, with what comes before and after it."""
        first_tai_s, last_tai_s = start_tai_s - self.pre_s, end_tai_s + self.post_s
        met = (one for one in self.windows if one.from_tai_s < last_tai_s and first_tai_s < one.to_tai_s)
        return next(met, None)

    def slew_s(self, az_deg: float, el_deg: float) -> float:
        """How long both axes need for so far a way, standing to standing."""
        return max(way_s(az_deg, self.azimuth), way_s(el_deg, self.elevation))

    @staticmethod
    def _range(axis: AxisLimits) -> float:
        return axis.max_deg - axis.min_deg
