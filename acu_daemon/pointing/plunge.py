"""The way over the top, for an elevation axis that reaches to 180 deg: the azimuth hardly moves.  Pure.

A plunged antenna points to the direction of azimuth a + 180 and elevation 180 - e, so a pass at culmination C goes on
beyond the zenith with the azimuth that it had before it.  Near culmination the path would have the azimuth swing a
quarter of a turn to and fro; a beam that goes straight over the zenith meanwhile is 90 deg - C off, and no more.  It is
taken where that is less than the error of the way round (pointing.keyhole).

The way leaves the path some seconds before culmination and is back on the plunged one as long after it: a cubic in
azimuth from place and rate to place and rate, the elevation at the nearest point of the antenna's meridian.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.model import AxisLimits, ZenithCrossing
from acu_daemon.units import Array

PLUNGED_DEG = 91.0  # an antenna that stands higher is beyond the zenith
RATE_SHARE, ACCELERATION_SHARE = 0.5, 0.3  # of the drive: more has it lag behind a way that gains nothing by it
LONGEST_HALF_S = 30.0
SURE_DEG = 0.005  # the shortest way that is no more than this worse than the best: it is on the path for longer


@dataclass(frozen=True, slots=True)
class Branches:
    """A path as it is, and as a plunged antenna has it, azimuths continuous from one to the other: degrees, (N,)."""

    az_deg: Array
    el_deg: Array
    az_rate_deg_s: Array
    el_rate_deg_s: Array
    plunged_az_deg: Array
    plunged_el_deg: Array
    step_s: float

    @property
    def top(self) -> int:
        """The sample that is nearest to the zenith."""
        return int(np.argmax(self.el_deg))


@dataclass(frozen=True, slots=True)
class Over:
    """The way over the top: azimuth and elevation with their rates, (N,), and its crossing; times from the start."""

    az_deg: Array
    el_deg: Array
    az_rate_deg_s: Array
    el_rate_deg_s: Array
    crossing: ZenithCrossing


def way_over(
    path: Branches, drive: AxisLimits, half_beam_deg: float, begun: tuple[float, float, float, float] | None = None
) -> Over | None:
    """The way over the top of a pass; None where the samples do not reach far enough to both sides of it.

    begun: of a way in hand, which is gone on with: its
    departure and return (s), and azimuth and rate at the departure.
    """
    if begun is not None:
        return _made(path, half_beam_deg, *begun)
    top = path.top
    halves = np.arange(round(1.0 / path.step_s), min(top, path.az_deg.size - 1 - top), max(1, round(0.5 / path.step_s)))
    found: list[Over] = []
    for half in halves[halves * path.step_s <= LONGEST_HALF_S].tolist():
        first, last = top - half, top + half
        by_deg = float(path.plunged_az_deg[last] - path.az_deg[first])
        rates = float(path.az_rate_deg_s[first]), float(path.az_rate_deg_s[last])
        if _can(by_deg, rates, 2.0 * half * path.step_s, drive):
            times = first * path.step_s, last * path.step_s
            one = _made(path, half_beam_deg, *times, float(path.az_deg[first]), rates[0])
            found += [] if one is None else [one]
    least_deg = min((one.crossing.largest_error_deg for one in found), default=0.0)
    return next((one for one in found if one.crossing.largest_error_deg < least_deg + SURE_DEG), None)


def _can(by: float, rates: tuple[float, float], span_s: float, drive: AxisLimits) -> bool:
    """Whether a drive follows the cubic that goes so far, from rate to rate, easily."""
    r0, r1 = rates
    most = max(abs(6.0 * by - (4.0 * r0 + 2.0 * r1) * span_s), abs(6.0 * by - (2.0 * r0 + 4.0 * r1) * span_s))
    middle_deg_s = 1.5 * by / span_s - (r0 + r1) / 4.0
    fastest_deg_s = max(abs(r0), abs(r1), abs(middle_deg_s))
    is_slow = fastest_deg_s <= RATE_SHARE * drive.max_rate_deg_s
    return is_slow and most / span_s**2 <= ACCELERATION_SHARE * drive.max_acceleration_deg_s2


def _made(
    path: Branches, half_beam_deg: float, from_s: float, to_s: float, from_az_deg: float, from_rate_deg_s: float
) -> Over | None:
    step_s, size = path.step_s, path.az_deg.size
    last = round(to_s / step_s)
    if not 0 <= last < size:
        return None
    time_s = step_s * np.arange(size)
    span_s = to_s - from_s
    u = np.clip((time_s - from_s) / span_s, 0.0, 1.0)
    by, d0, d1 = path.plunged_az_deg[last] - from_az_deg, from_rate_deg_s * span_s, path.az_rate_deg_s[last] * span_s
    a, b = d0 + d1 - 2.0 * by, 3.0 * by - 2.0 * d0 - d1
    is_way = (time_s > from_s + 1e-9) & (time_s < to_s - 1e-9)
    is_after = time_s >= to_s - 1e-9
    az = np.where(is_after, path.plunged_az_deg, path.az_deg)
    az = np.where(is_way, ((a * u + b) * u + d0) * u + from_az_deg, az)
    az_rate = np.where(is_way, ((3.0 * a * u + 2.0 * b) * u + d0) / span_s, path.az_rate_deg_s)
    missing, true_el = np.radians(az - path.az_deg), np.radians(path.el_deg)
    nearest = np.degrees(np.arctan2(np.sin(true_el), np.cos(true_el) * np.cos(missing)))
    nearest += u * (path.plunged_el_deg - (180.0 - path.el_deg))  # the encoders' own terms beyond the zenith
    el = np.where(is_way, nearest, np.where(is_after, path.plunged_el_deg, path.el_deg))
    el_rate = np.where(is_after, -path.el_rate_deg_s, path.el_rate_deg_s)
    el_rate = np.where(is_way, np.gradient(el, step_s), el_rate)
    off_deg = np.degrees(np.abs(np.arcsin(np.cos(true_el) * np.sin(missing))))
    off_deg = np.where(is_way, off_deg, 0.0)
    lost = np.flatnonzero(off_deg > half_beam_deg)
    crossing = ZenithCrossing(
        departure_tai_s=from_s,
        return_tai_s=to_s,
        departure_az_deg=from_az_deg,
        departure_rate_deg_s=from_rate_deg_s,
        peak_rate_deg_s=float(np.abs(path.az_rate_deg_s).max()),
        largest_error_deg=float(off_deg.max()),
        lost_s=step_s * lost.size,
        lost_from_tai_s=step_s * float(lost[0]) if lost.size else None,
        is_plunge=True,
    )
    return Over(az, el, az_rate, el_rate, crossing)
