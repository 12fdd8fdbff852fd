"""What a pass asks of the antenna and what a tracking profile is: two paths, and how they were judged."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from acu_daemon.model import AxisLimits
from acu_daemon.onboard.bound import Bound
from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.gimbal_frames import Gimbal, angles_between_deg, beam_direction, gimbal_angles
from acu_daemon.onboard.quintic import Path
from acu_daemon.onboard.view import PassView
from acu_daemon.units import Array

Method = Literal["single", "three", "search", "free"]
Objective = Literal["peak", "imaging"]
RATE_GUARD, ACCELERATION_GUARD = 0.999, 0.98  # of the drive's limits, in plans: between the samples paths bulge
METHODS: tuple[Method, ...] = ("single", "three", "search", "free")


@dataclass(frozen=True)
class Task:
    """A pass with its station and what the antenna has to keep to."""

    view: PassView
    station_itrs_m: Array
    cone: Cone
    azimuth: AxisLimits
    elevation: AxisLimits
    imaging: npt.NDArray[np.bool_] = field(repr=False)  # (N,): when the camera works, at the view's samples

    @property
    def margin_deg(self) -> float:
        return self.cone.margin_deg

    def station_gimbal(self, view: PassView) -> Gimbal:
        """The station's direction as angles of an aligned antenna, (N,)."""
        return gimbal_angles(view.vectors_m(self.station_itrs_m))


@dataclass(frozen=True)
class Profile:
    """The gimbal's angles over a pass, as polynomials; time counts from the view's first sample."""

    method: Method
    azimuth: Path
    elevation: Path
    bound: Bound | None = None  # of the free path's azimuth rate

    def gimbal(self, time_s: Array) -> Gimbal:
        return Gimbal(self.azimuth.value(time_s), self.elevation.value(time_s))


def within(tai_s: Array, spans_tai_s: Sequence[tuple[float, float]]) -> npt.NDArray[np.bool_]:
    """Which times (N,) lie in one of the spans."""
    inside = np.zeros(tai_s.size, dtype=bool)
    for start, end in spans_tai_s:
        inside |= (tai_s >= start) & (tai_s <= end)
    return inside


def off_pointing(task: Task, gimbal: Gimbal, view: PassView) -> Array:
    """Angles (N,), degrees, between the beam and the station."""
    return angles_between_deg(beam_direction(gimbal, task.cone.boresight), view.unit(task.station_itrs_m))


def peak_rate_deg_s(path: Path, view: PassView) -> float:
    """The largest rate at 20 Hz."""
    return float(np.abs(path.value(view.time_s, 1)).max())


def caps(limits: AxisLimits) -> tuple[float, float]:
    """Rate and acceleration that plans keep to."""
    return RATE_GUARD * limits.max_rate_deg_s, ACCELERATION_GUARD * limits.max_acceleration_deg_s2
