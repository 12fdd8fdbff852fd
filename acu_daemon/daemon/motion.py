"""How fast the antenna really moves: the newest second of readings against the second before it.

Averages, since the difference of two readings is mostly noise: at 10 Hz and 0.02 deg of noise the speed is known to
0.013 deg/s.
"""

from collections import deque
from math import cos, hypot, radians

from acu_daemon.model import Reading
from acu_daemon.units import wrap_180

HALF_S = 1.0
LEAST_COUNT = 3  # readings in each half


class Motion:
    """Holds two seconds of readings."""

    def __init__(self) -> None:
        self._readings: deque[Reading] = deque()

    def add(self, reading: Reading) -> None:
        """Take the newest one; what is older than two seconds before it is forgotten."""
        self._readings.append(reading)
        while reading.tai_s - self._readings[0].tai_s >= 2 * HALF_S:
            self._readings.popleft()

    def speed_deg_s(self, now_tai_s: float) -> float | None:
        """On the sky; None where there are too few readings of the last two seconds."""
        ages = [(now_tai_s - one.tai_s, one) for one in self._readings]
        new = [one for age_s, one in ages if age_s < HALF_S]
        old = [one for age_s, one in ages if HALF_S <= age_s < 2 * HALF_S]
        if min(len(new), len(old)) < LEAST_COUNT:
            return None
        zero_deg = old[0].az_deg
        (az0, el0, t0), (az1, el1, t1) = (_middle(part, zero_deg) for part in (old, new))
        return hypot((az1 - az0) * cos(radians(el1)), el1 - el0) / (t1 - t0)


def _middle(readings: list[Reading], zero_deg: float) -> tuple[float, float, float]:
    count = len(readings)
    az_deg = sum(wrap_180(one.az_deg - zero_deg) for one in readings) / count
    return az_deg, sum(one.el_deg for one in readings) / count, sum(one.tai_s for one in readings) / count
