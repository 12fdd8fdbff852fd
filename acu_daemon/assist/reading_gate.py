"""Which readings are fit to be used: the dwell after acquisition, and plain reasons to leave a reading out.  Pure.

What only an orbit can tell is in assist.screening.track_gate.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from acu_daemon.assist.screening_limits import MAX_GAP_S
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Reading, Readings

DWELL = "not acquired for the dwell time yet"
OUT_OF_STEP = "perhaps the reply to an earlier command: the line is out of step"
ABOVE_MAX_ELEVATION = "above the highest elevation for fits"
OUTLIER = "far from the prediction of the fit"
ACCELERATION = "the axis accelerates near its limit"
CORRELATED = "the axis hunts, or is drawn off the path slowly"
SIDE_LOBE = "side lobe"
WRONG_TARGET = "wrong target: it moves unlike the satellite"
OFF_PATH = "off the predicted path"
BELIED = "belied by newer readings"


@dataclass(frozen=True, slots=True)
class Rejected:
    """A reading that was not used, and why."""

    tai_s: float
    reason: str


def acquired_since_tai_s(since_tai_s: float | None, last_tai_s: float | None, reading: Reading) -> float | None:
    """Since when readings have been acquired without a break, this one included; None: it is not.

    since_tai_s, last_tai_s: the same before this reading, and the time of the last acquired one.
    """
    if not reading.is_locked:
        return None
    is_new = since_tai_s is None or last_tai_s is None or reading.tai_s - last_tai_s > MAX_GAP_S
    return reading.tai_s if is_new else since_tai_s


class Dwell:
    """Lets readings through that have been acquired for at least the dwell time without a break: locked ones.

    Mutable; one owner.
    """

    def __init__(self, lock_dwell_s: float) -> None:
        self._dwell_s = lock_dwell_s
        self._since_tai_s: float | None = None
        self._last_tai_s: float | None = None
        self.rejected_count = 0  # acquired, but not for long enough

    def is_locked(self, reading: Reading) -> bool:
        """Take the next reading, oldest first, and say whether it counts as locked."""
        since_tai_s = self._since_tai_s = acquired_since_tai_s(self._since_tai_s, self._last_tai_s, reading)
        self._last_tai_s = None if since_tai_s is None else reading.tai_s
        if since_tai_s is None:
            return False
        is_long_enough = reading.tai_s - since_tai_s >= self._dwell_s - 1e-6
        self.rejected_count += not is_long_enough
        return is_long_enough


def locked_readings(readings: Iterable[Reading], dwell: Dwell) -> Readings:
    """Keep the locked ones, oldest first, in the form that estimators take."""
    return Readings.of([reading for reading in readings if dwell.is_locked(reading)])


def below_highest(readings: Readings, settings: EstimatorSettings) -> tuple[Readings, list[Rejected]]:
    """Part readings into those below the highest elevation for fits and those left out, oldest first."""
    most_deg = settings.max_fit_elevation_deg
    is_high = (readings.el_deg > most_deg) & (readings.el_deg < 180.0 - most_deg)
    if not is_high.any():
        return readings, []
    rejected = [Rejected(tai_s, ABOVE_MAX_ELEVATION) for tai_s in readings.tai_s[is_high].tolist()]
    return readings.part(~is_high), rejected
