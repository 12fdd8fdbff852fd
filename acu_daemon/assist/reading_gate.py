"""Which readings are fit to be used: the dwell after acquisition, and plain reasons to leave a reading out.  Pure.

What only an orbit can tell is in assist.screening.track_gate.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import cos, radians, sqrt

import numpy as np

from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import Reading, Readings
from acu_daemon.units import wrap_180

DWELL = "not acquired for the dwell time yet"
OUT_OF_STEP = "perhaps the reply to an earlier command: the line is out of step"
ABOVE_MAX_ELEVATION = "above the highest elevation for fits"
TOO_FAST = "faster than the axis can move"
OUTLIER = "far from the prediction of the fit"
ACCELERATION = "the axis accelerates near its limit"
SIDE_LOBE = "side lobe"
WRONG_TARGET = "wrong target: it moves unlike the satellite"
OFF_PATH = "off the predicted path"
BELIED = "belied by newer readings"

_RATE_MARGIN = 1.1  # an encoder's time tag jitters
_SIGMA_COUNT = 6.0


@dataclass(frozen=True, slots=True)
class Rejected:
    """A reading that was not used, and why."""

    tai_s: float
    reason: str


MAX_GAP_S = 6.0  # a longer gap between readings breaks the acquisition: nobody saw what happened


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


class ReadingGate:
    """Leaves out what no fit should see, before any orbit is involved.  Mutable; one owner.

    A reading that jumped is compared with the last good one, so a jump is believed once the axis could have made it.
    """

    def __init__(self, settings: EstimatorSettings) -> None:
        self._max_elevation_deg = settings.max_fit_elevation_deg
        self._noise_az_deg = _SIGMA_COUNT * sqrt(2.0) * settings.sigma_azimuth_deg
        self._noise_el_deg = _SIGMA_COUNT * sqrt(2.0) * settings.sigma_elevation_deg
        self._azimuth, self._elevation = settings.azimuth, settings.elevation
        self._last: tuple[float, float, float] | None = None

    def split(self, readings: Readings) -> tuple[Readings, list[Rejected]]:
        """Part readings into those to use and those left out, oldest first."""
        keep: list[int] = []
        rejected: list[Rejected] = []
        rows = zip(readings.tai_s.tolist(), readings.az_deg.tolist(), readings.el_deg.tolist(), strict=True)
        for k, row in enumerate(rows):
            if self._is_too_fast(*row):
                rejected.append(Rejected(row[0], TOO_FAST))
                continue
            self._last = row
            if self._max_elevation_deg < row[2] < 180.0 - self._max_elevation_deg:
                rejected.append(Rejected(row[0], ABOVE_MAX_ELEVATION))
            else:
                keep.append(k)
        return readings.part(np.array(keep, dtype=np.int64)), rejected

    def _is_too_fast(self, tai_s: float, az_deg: float, el_deg: float) -> bool:
        if self._last is None or self._azimuth is None or self._elevation is None:
            return False
        dt_s = tai_s - self._last[0]
        cos_el = max(min(abs(cos(radians(el_deg))), abs(cos(radians(self._last[2])))), 1e-3)
        far_az = self._azimuth.max_rate_deg_s * _RATE_MARGIN * dt_s + self._noise_az_deg / cos_el
        far_el = self._elevation.max_rate_deg_s * _RATE_MARGIN * dt_s + self._noise_el_deg
        return abs(wrap_180(az_deg - self._last[1])) > far_az or abs(el_deg - self._last[2]) > far_el
