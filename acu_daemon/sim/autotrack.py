"""SIMULATION of the autotrack loop: drives the axes by the offset the receiver measures, and remembers the rates."""

from math import copysign, cos, radians

from acu_daemon.sim.pedestal import BRAKING_SHARE, STEP_S, Axis, approach_rate_deg_s
from acu_daemon.sim.receiver import Offset

CLOSING_GAIN_PER_S = 8.0
BANDWIDTH_RAD_S = 4.0  # of the filter; a path that accelerates is followed with an error of acceleration / bandwidth^2
_ANGLE_GAIN = 2.0 * BANDWIDTH_RAD_S * STEP_S
_RATE_GAIN_PER_S = BANDWIDTH_RAD_S**2 * STEP_S
_LEAST_COS_EL = 1e-3


class AxisTracker:
    """One axis: an alpha-beta filter on where the satellite stands, and the drive that closes in on it.

    The filter sees axis plus offset, so it does not wind up while the drive cannot follow.
    """

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self._angle_deg = 0.0
        self.rate_deg_s = 0.0

    def start(self, offset_deg: float) -> None:
        """Begin with the rate the axis has."""
        self._angle_deg = self._axis.angle_deg + offset_deg
        self.rate_deg_s = self._axis.rate_deg_s

    def drive(self, offset_deg: float) -> None:
        """Drive the axis by a measured offset in its own degrees."""
        axis = self._axis
        expected_deg = self._angle_deg + self.rate_deg_s * STEP_S
        surprise_deg = axis.angle_deg + offset_deg - expected_deg
        self._angle_deg = expected_deg + _ANGLE_GAIN * surprise_deg
        self.rate_deg_s += _RATE_GAIN_PER_S * surprise_deg
        braking_deg_s2 = BRAKING_SHARE * axis.limits.max_acceleration_deg_s2
        gap_deg = self._angle_deg - axis.angle_deg
        axis.drive_at(self.rate_deg_s + approach_rate_deg_s(gap_deg, CLOSING_GAIN_PER_S, braking_deg_s2))

    def coast(self) -> None:
        """Drive the axis at the remembered rate."""
        self._axis.drive_at(self.rate_deg_s)


class Autotrack:
    """Both axes of autotrack; an offset to the right asks the more of the azimuth the higher the beam looks."""

    def __init__(self, azimuth: Axis, elevation: Axis) -> None:
        self._elevation = elevation
        self._trackers = (AxisTracker(azimuth), AxisTracker(elevation))

    def start(self, measured: Offset) -> None:
        """Begin with the rates the axes have."""
        for tracker, offset_deg in zip(self._trackers, self._axis_offsets_deg(measured), strict=True):
            tracker.start(offset_deg)

    def drive(self, measured: Offset, lowest_el_deg: float) -> None:
        """Drive by the measured offset, the elevation not below its lowest."""
        azimuth_deg, elevation_deg = self._axis_offsets_deg(measured)
        self._trackers[0].drive(azimuth_deg)
        self._trackers[1].drive(max(elevation_deg, lowest_el_deg - self._elevation.angle_deg))

    def coast(self) -> None:
        """Rate memory: go on at the remembered rates."""
        for tracker in self._trackers:
            tracker.coast()

    def _axis_offsets_deg(self, measured: Offset) -> tuple[float, float]:
        cos_el = cos(radians(self._elevation.angle_deg))  # beyond the zenith the azimuth turns the beam the other way
        cos_el = copysign(max(abs(cos_el), _LEAST_COS_EL), cos_el)
        return measured.right_deg / cos_el, measured.up_deg
