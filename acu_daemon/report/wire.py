"""What the daemon wrote to the registers, judged from the wire log and the trace of a fake ACU."""

import csv
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from acu_daemon.model import AxisLimits, sky_angle_deg
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.report.pass_trace import Trace
from acu_daemon.units import Array, wrap_180

HALF_SERVO_TICK_S = 0.010  # a write waits for half a servo tick on average
PERIOD_S = 0.100  # of the writes; one that comes soon after a late one was still meant for its own tick
LONG_GAP_S = 0.120
SETTLE_S = 10.0  # registers count this long after autotrack began
FOLLOWS_DEG = 0.01  # an ideal drive that is nearer to the path than this can follow it


@dataclass(frozen=True, slots=True)
class Writes:
    """Accepted register writes: arrays are (N,); tai_s is when each was applied, is_followed 1 where it moves."""

    tai_s: Array
    az_deg: Array
    el_deg: Array
    mode: list[str]
    is_followed: Array


def read_writes(path: Path) -> Writes:
    """Read the CSV that `fake-acu --wire-log` writes."""
    with path.open(encoding="ascii", newline="") as file:
        rows = list(csv.DictReader(file))
    return Writes(
        tai_s=np.array([tai_from_utc(row["utc"]) for row in rows]),
        az_deg=np.array([float(row["az_deg"]) for row in rows]),
        el_deg=np.array([float(row["el_deg"]) for row in rows]),
        mode=[row["mode"] for row in rows],
        is_followed=np.array([float(row["followed"]) for row in rows]),
    )


@dataclass(frozen=True, slots=True)
class WriteFigures:
    """Rhythm and aim of the writes."""

    write_count: int
    writes_per_s: float
    share_of_short_gaps: float  # up to LONG_GAP_S
    longest_gap_s: float
    rate_share: float  # fastest motion of followed registers, as a share of the axis' limit
    autotrack_max_deg: float  # registers against the satellite at the moment they take effect, while autotracking
    autotrack_p99_deg: float


def measure_writes(
    writes: Writes, trace: Trace, azimuth: AxisLimits, elevation: AxisLimits, angle_step_deg: float
) -> WriteFigures:
    """Sum up the writes of a pass; the ACU carries angles in steps.  ValueError: there are none to judge."""
    gaps_s = np.diff(writes.tai_s)
    aim_deg = _autotrack_errors_deg(writes, trace)
    if gaps_s.size == 0 or aim_deg.size == 0:
        raise ValueError("too few register writes, or none during autotrack")
    return WriteFigures(
        write_count=writes.tai_s.size,
        writes_per_s=float(gaps_s.size / gaps_s.sum()),
        share_of_short_gaps=float(np.mean(gaps_s <= LONG_GAP_S)),
        longest_gap_s=float(gaps_s.max()),
        rate_share=_rate_share(writes, azimuth, elevation, angle_step_deg),
        autotrack_max_deg=float(aim_deg.max()),
        autotrack_p99_deg=float(np.percentile(aim_deg, 99)),
    )


def _rate_share(writes: Writes, azimuth: AxisLimits, elevation: AxisLimits, step_deg: float) -> float:
    """Between two writes that are both followed, less what rounding can add."""
    fastest = 0.0
    for i, k in pairwise(range(writes.tai_s.size)):
        if not (writes.is_followed[i] and writes.is_followed[k]):
            continue
        gap_s = max(float(writes.tai_s[k] - writes.tai_s[i]), PERIOD_S)
        for moved_deg, limits in (
            (wrap_180(float(writes.az_deg[k] - writes.az_deg[i])), azimuth),
            (float(writes.el_deg[k] - writes.el_deg[i]), elevation),
        ):
            fastest = max(fastest, (abs(moved_deg) - step_deg) / gap_s / limits.max_rate_deg_s)
    return fastest


def _autotrack_errors_deg(writes: Writes, trace: Trace) -> Array:
    """Angle on the sky between registers and satellite as each write takes effect, from SETTLE_S of autotrack on."""
    is_judged = np.array([mode == "AUTOTRACK" for mode in writes.mode])
    if not is_judged.any():
        return np.array([])
    is_judged &= writes.tai_s >= writes.tai_s[is_judged][0] + SETTLE_S
    sat_az_deg, sat_el_deg = satellite_at(trace, writes.tai_s + HALF_SERVO_TICK_S)
    is_judged &= np.isfinite(sat_az_deg)
    columns = (writes.az_deg, writes.el_deg, sat_az_deg, sat_el_deg)
    return np.array([sky_angle_deg(*aim) for aim in zip(*(c[is_judged].tolist() for c in columns), strict=True)])


def satellite_at(trace: Trace, tai_s: Array) -> tuple[Array, Array]:
    """True azimuth [0, 360) and elevation, degrees, (N,), between the rows of a trace; NaN where the sky has none."""
    az, el = np.radians(trace.sat_az_deg), np.radians(trace.sat_el_deg)
    east, north, up = (
        np.interp(tai_s, trace.tai_s, values, left=np.nan, right=np.nan)
        for values in (np.cos(el) * np.sin(az), np.cos(el) * np.cos(az), np.sin(el))
    )
    return np.degrees(np.arctan2(east, north)) % 360.0, np.degrees(np.arctan2(up, np.hypot(east, north)))


@dataclass(frozen=True, slots=True)
class LossFigures:
    """What happened while the scenario took the signal away, and just after."""

    loss_s: float
    beam_error_max_deg: float  # where the drive can follow
    beam_error_median_deg: float
    cannot_follow_s: float  # seconds of the losses in which not even an ideal drive is on the satellite
    relock_s: float  # longest time from the signal's return to autotrack


def measure_losses(trace: Trace, azimuth: AxisLimits, elevation: AxisLimits) -> LossFigures:
    """Sum up the losses after the first acquisition.  ValueError: never acquired, or no loss."""
    acquired = np.flatnonzero(trace.is_acquired > 0)
    if acquired.size == 0:
        raise ValueError("the signal was never acquired")
    step_s = float(np.median(np.diff(trace.tai_s)))
    is_lost = (trace.is_on_air == 0) & np.isfinite(trace.sat_az_deg)
    is_lost[: acquired[0]] = False
    is_followable = can_follow(trace, azimuth, elevation)
    errors_deg = trace.error_deg[is_lost & is_followable]
    if errors_deg.size == 0:
        raise ValueError("the pass had no loss of signal after it was acquired")
    return LossFigures(
        loss_s=float(is_lost.sum()) * step_s,
        beam_error_max_deg=float(errors_deg.max()),
        beam_error_median_deg=float(np.median(errors_deg)),
        cannot_follow_s=float((is_lost & ~is_followable).sum()) * step_s,
        relock_s=_relock_s(trace, is_lost),
    )


def _relock_s(trace: Trace, is_lost: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    """Infinite where a signal that is back was not acquired again."""
    longest_s = 0.0
    for back in np.flatnonzero(is_lost[:-1] & ~is_lost[1:] & (trace.is_on_air[1:] > 0)) + 1:
        again = [i for i in range(back, trace.tai_s.size) if trace.mode[i] == "AUTOTRACK" and trace.is_acquired[i]]
        longest_s = max(longest_s, float(trace.tai_s[again[0]] - trace.tai_s[back]) if again else np.inf)
    return longest_s


def can_follow(trace: Trace, azimuth: AxisLimits, elevation: AxisLimits) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Whether an ideal drive within the limits, which knows the path but not its future, is on the satellite; (N,)."""
    dt_s = float(np.median(np.diff(trace.tai_s)))
    is_seen = np.isfinite(trace.sat_az_deg)
    result = np.zeros(trace.tai_s.size, dtype=bool)
    az_deg = np.degrees(np.unwrap(np.radians(trace.sat_az_deg[is_seen])))
    el_deg = trace.sat_el_deg[is_seen]
    off_az_deg, off_el_deg = _drive_lag_deg(az_deg, dt_s, azimuth), _drive_lag_deg(el_deg, dt_s, elevation)
    result[is_seen] = np.hypot(off_az_deg * np.cos(np.radians(el_deg)), off_el_deg) < FOLLOWS_DEG
    return result


def _drive_lag_deg(path_deg: Array, dt_s: float, limits: AxisLimits) -> Array:
    if path_deg.size < 2:
        return np.zeros(path_deg.size)
    rates_deg_s = np.gradient(path_deg, dt_s)
    axis = AxisState(float(path_deg[0]), float(rates_deg_s[0]))
    off_deg = [0.0]
    for target_deg, rate_deg_s in zip(path_deg[1:], rates_deg_s[1:], strict=True):
        axis = step(axis, float(target_deg), float(rate_deg_s), dt_s, limits)
        off_deg.append(axis.position_deg - float(target_deg))
    return np.array(off_deg)
