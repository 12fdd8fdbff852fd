"""What a busy machine costs the beam: how far a satellite goes on while a register write is late."""

import numpy as np

from acu_daemon.report.pass_trace import Trace
from acu_daemon.report.wire import PERIOD_S, Writes
from acu_daemon.units import DEG

BEFORE_S = 2.0  # what was late so shortly before is still being caught up


def late_deg(writes: Writes, trace: Trace, from_tai_s: float, to_tai_s: float) -> float:
    """The satellite's way on the sky in the longest wait for a write from BEFORE_S before a time on, beyond the period.

    On a machine that keeps time it is next to nothing.
    """
    is_meant = (writes.tai_s >= from_tai_s - BEFORE_S) & (writes.tai_s <= to_tai_s)
    waits_s = np.diff([from_tai_s - BEFORE_S, *writes.tai_s[is_meant], to_tai_s])
    is_seen = np.isfinite(trace.sat_az_deg)
    az, el = trace.sat_az_deg[is_seen] * DEG, trace.sat_el_deg[is_seen] * DEG
    unit = np.stack((np.cos(el) * np.sin(az), np.cos(el) * np.cos(az), np.sin(el)))
    moved_deg = np.linalg.norm(np.diff(unit), axis=0) / DEG
    fastest_deg_s = float(np.max(moved_deg / np.diff(trace.tai_s[is_seen])))
    return fastest_deg_s * max(0.0, float(np.max(waits_s)) - PERIOD_S)
