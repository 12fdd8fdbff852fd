"""Which axis cannot follow a path, from when to when: told before a pass, not found in it.  Pure."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from acu_daemon.model import AxisLimits, ZenithCrossing
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.wrap import ROUNDING_DEG, turns_of
from acu_daemon.units import Array

AxisName = Literal["azimuth", "elevation"]


@dataclass(frozen=True, slots=True)
class OutOfReach:
    """A time in which an axis cannot be on the path; why: for people."""

    axis: AxisName
    from_tai_s: float
    to_tai_s: float
    why: str

    @property
    def duration_s(self) -> float:
        return self.to_tai_s - self.from_tai_s

    def __str__(self) -> str:
        span = f"{utc_text(self.from_tai_s, 0)} to {utc_text(self.to_tai_s, 0)}"
        return f"{self.why} for {self.duration_s:.0f} s, {span}; the other axis follows"


def zenith_text(crossing: ZenithCrossing) -> str:
    """What a crossing of the zenith is expected to cost, for people."""
    begin = f"{utc_text(crossing.departure_tai_s, 0)} to {utc_text(crossing.return_tai_s, 0)}"
    way = f"past the zenith {begin}: at most {crossing.largest_error_deg:.2f} deg off"
    if crossing.lost_from_tai_s is None:
        return f"{way}, within the beam"
    return f"{way}, out of the beam for {crossing.lost_s:.1f} s from {utc_text(crossing.lost_from_tai_s, 0)} on"


def out_of_reach(
    tai_s: Array, az_deg: Array, el_deg: Array, azimuth: AxisLimits, elevation: AxisLimits
) -> tuple[OutOfReach, ...]:
    """Find the times in which a path cannot be followed, in order; as fine as its samples.

    tai_s, az_deg, el_deg: (N,), azimuth continuous and on the turn that was chosen.  Where that turn ends and another
    one has the bearing, the azimuth is on its way there for as long as its drive needs.
    """
    is_out = (az_deg < azimuth.min_deg - ROUNDING_DEG) | (az_deg > azimuth.max_deg + ROUNDING_DEG)
    is_lost = is_out.copy()
    is_lost[is_out] = [not turns_of(az, azimuth) for az in az_deg[is_out].tolist()]
    range_text = f"{azimuth.min_deg:g} to {azimuth.max_deg:g} deg"
    found = [
        *_spans("azimuth", tai_s, is_lost, f"azimuth outside {range_text} on every turn"),
        *_spans("elevation", tai_s, el_deg > elevation.max_deg, f"elevation above {elevation.max_deg:g} deg"),
        *_spans("elevation", tai_s, el_deg < elevation.min_deg, f"elevation below {elevation.min_deg:g} deg"),
    ]
    leaving = np.flatnonzero(is_out[1:] & ~is_lost[1:] & ~is_out[:-1])
    if leaving.size:
        first = int(leaving[0]) + 1
        way_deg = min(abs(turn - float(az_deg[first])) for turn in turns_of(float(az_deg[first]), azimuth))
        begin_tai_s, end_tai_s = float(tai_s[first]), float(tai_s[-1])
        back_tai_s = min(begin_tai_s + way_deg / azimuth.max_rate_deg_s, end_tai_s)
        found.append(OutOfReach("azimuth", begin_tai_s, back_tai_s, "azimuth on its way round to another turn"))
    return tuple(sorted(found, key=lambda one: one.from_tai_s))


def _spans(axis: AxisName, tai_s: Array, is_beyond: npt.NDArray[np.bool_], why: str) -> Iterator[OutOfReach]:
    edges = np.flatnonzero(np.diff(np.concatenate(([0], is_beyond.astype(np.int8), [0]))))
    for first, after in edges.reshape(-1, 2).tolist():
        yield OutOfReach(axis, float(tai_s[first]), float(tai_s[min(after, tai_s.size - 1)]), why)
