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

    begun: of a way in hand, which is gone on with: its departure and return (s), azimuth and rate at the departure.
    """
    if begun is not None:
        return _made(path, half_beam_deg, *begun)
    top = path.top
    most = min(top, path.az_deg.size - 1 - top, round(LONGEST_HALF_S / path.step_s))
    halves = range(round(1.0 / path.step_s), most + 1, max(1, round(0.5 / path.step_s)))
    ways = {half: _largest_error_deg(path, top, half) for half in halves if _can(path, top, half, drive)}
    if not ways:
        return None
    least_deg = min(ways.values())
    half = next(half for half, error_deg in ways.items() if error_deg < least_deg + SURE_DEG)
    first, times = top - half, ((top - half) * path.step_s, (top + half) * path.step_s)
    return _made(path, half_beam_deg, *times, float(path.az_deg[first]), float(path.az_rate_deg_s[first]))


def _ends(path: Branches, top: int, half: int) -> tuple[float, float, float, float]:
    """Of a way that departs and returns so many samples before and after the top: span, how far, rates at its ends."""
    first, last = top - half, top + half
    by_deg = float(path.plunged_az_deg[last] - path.az_deg[first])
    return 2.0 * half * path.step_s, by_deg, float(path.az_rate_deg_s[first]), float(path.az_rate_deg_s[last])


def _can(path: Branches, top: int, half: int, drive: AxisLimits) -> bool:
    """Whether the drive follows the cubic from place and rate to place and rate easily."""
    span_s, by, r0, r1 = _ends(path, top, half)
    most = max(abs(6.0 * by - (4.0 * r0 + 2.0 * r1) * span_s), abs(6.0 * by - (2.0 * r0 + 4.0 * r1) * span_s))
    middle_deg_s = 1.5 * by / span_s - (r0 + r1) / 4.0
    is_slow = max(abs(r0), abs(r1), abs(middle_deg_s)) <= RATE_SHARE * drive.max_rate_deg_s
    return is_slow and most / span_s**2 <= ACCELERATION_SHARE * drive.max_acceleration_deg_s2


def _largest_error_deg(path: Branches, top: int, half: int) -> float:
    span_s, by_deg, r0, r1 = _ends(path, top, half)
    way = slice(top - half, top + half + 1)
    az = path.az_deg[top - half] + _cubic(np.arange(2 * half + 1) / (2.0 * half), by_deg, r0 * span_s, r1 * span_s)
    return float(_off_deg(az, path.az_deg[way], path.el_deg[way]).max())


def _cubic(u: Array, by: float, d0: float, d1: float) -> Array:
    """From 0 at u = 0 to by at u = 1, with these slopes there."""
    way: Array = (((d0 + d1 - 2.0 * by) * u + 3.0 * by - 2.0 * d0 - d1) * u + d0) * u
    return way


def _off_deg(antenna_az_deg: Array, az_deg: Array, el_deg: Array) -> Array:
    """How far a direction is off the nearest point of an antenna's meridian, which goes over the top."""
    off: Array = np.degrees(np.abs(np.arcsin(np.cos(np.radians(el_deg)) * np.sin(np.radians(antenna_az_deg - az_deg)))))
    return off


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
    by = float(path.plunged_az_deg[last]) - from_az_deg
    d0, d1 = from_rate_deg_s * span_s, float(path.az_rate_deg_s[last]) * span_s
    a, b = d0 + d1 - 2.0 * by, 3.0 * by - 2.0 * d0 - d1
    is_way = (time_s > from_s + 1e-9) & (time_s < to_s - 1e-9)
    is_after = time_s >= to_s - 1e-9
    az = np.where(is_after, path.plunged_az_deg, path.az_deg)
    az = np.where(is_way, from_az_deg + _cubic(u, by, d0, d1), az)
    az_rate = np.where(is_way, ((3.0 * a * u + 2.0 * b) * u + d0) / span_s, path.az_rate_deg_s)
    missing, true_el = np.radians(az - path.az_deg), np.radians(path.el_deg)
    nearest = np.degrees(np.arctan2(np.sin(true_el), np.cos(true_el) * np.cos(missing)))
    nearest += u * (path.plunged_el_deg - (180.0 - path.el_deg))  # the encoders' own terms beyond the zenith
    el = np.where(is_way, nearest, np.where(is_after, path.plunged_el_deg, path.el_deg))
    el_rate = np.where(is_after, -path.el_rate_deg_s, path.el_rate_deg_s)
    el_rate = np.where(is_way, np.gradient(el, step_s), el_rate)
    off_deg = np.where(is_way, _off_deg(az, path.az_deg, path.el_deg), 0.0)
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
