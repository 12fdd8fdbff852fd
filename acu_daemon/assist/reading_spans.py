"""Stretches of readings in time.  Pure."""

import numpy as np

from acu_daemon.model import Readings


def tail_of(readings: Readings, newest_s: float) -> Readings:
    """The newest ones, over so many seconds."""
    return readings.part(readings.tai_s >= readings.tai_s[-1] - newest_s - 1e-6)


def span_s(readings: Readings) -> float:
    """From the first to the last one; 0 without any."""
    return float(readings.tai_s[-1] - readings.tai_s[0]) if len(readings) else 0.0


def seconds(readings: Readings) -> int:
    """Seconds in which there is a reading."""
    return int(np.unique(np.floor(readings.tai_s)).size)
