"""What a tracking-parameter file says of itself, computed again."""

from math import inf, isclose

import numpy as np

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.checks import Check
from acu_daemon.onboard.cone import azimuth_tube, windings
from acu_daemon.onboard.parameter_file import ParameterFile
from acu_daemon.onboard.profile import Task
from acu_daemon.onboard.view import FINE_S
from acu_daemon.units import Array

UNLIMITED = AxisLimits(-1e4, 1e4, inf, inf)  # an axis of any range and rate
_SAME = 1e-6  # relative, of figures written with nine digits
_BOUND_DEG = 1e-3  # of a certificate's bounds: the tube between two samples


def grid_s(found: ParameterFile) -> Array:
    """Times (N,) of the whole file at 20 Hz, since its start."""
    return np.arange(round(found.end_s / FINE_S) + 1, dtype=np.float64) * FINE_S


def check_peaks(found: ParameterFile) -> list[Check]:
    """The largest rates that the header states against those of the polynomials."""
    checks = []
    for key, path in (
        ("PEAK_AZIMUTH_RATE_DEG_S", found.profile.azimuth),
        ("PEAK_ELEVATION_RATE_DEG_S", found.profile.elevation),
    ):
        if (stated := found.number(key)) is not None:
            peak = float(np.abs(path.value(grid_s(found), 1)).max())
            checks.append(Check(key, peak, stated, "deg/s", isclose(peak, stated, rel_tol=_SAME, abs_tol=1e-8)))
    return checks


def check_certificate(found: ParameterFile, task: Task | None) -> list[Check]:
    """The certificate's arithmetic, and with the pass whether azimuth is bound as it says at its two instants."""
    bound = found.profile.bound
    if bound is None:
        return []
    apart_s = abs(bound.low_time_s - bound.high_time_s)
    rate = (bound.low_deg - bound.high_deg) / apart_s if apart_s else 0.0
    checks = [Check("certificate", rate, bound.rate_deg_s, "deg/s", isclose(rate, bound.rate_deg_s, rel_tol=1e-4))]
    if task is None or apart_s == 0.0:
        return checks
    view = task.view.plan
    station = task.station_gimbal(view)
    off_deg = inf
    for tube in windings(
        azimuth_tube(task.cone, view.time_s, station.az_deg, station.el_deg, is_outer=True), station.az_deg
    ):
        for turn_deg in (0.0, 360.0, -360.0, 720.0, -720.0):
            low = float(np.interp(bound.low_time_s, view.time_s, tube.lower_deg)) + turn_deg
            high = float(np.interp(bound.high_time_s, view.time_s, tube.upper_deg)) + turn_deg
            low, high = max(low, task.azimuth.min_deg), min(high, task.azimuth.max_deg)
            off_deg = min(off_deg, float(max(abs(low - bound.low_deg), abs(high - bound.high_deg))))
    return [*checks, Check("certificate's bounds", off_deg, _BOUND_DEG, "deg", off_deg <= _BOUND_DEG)]
