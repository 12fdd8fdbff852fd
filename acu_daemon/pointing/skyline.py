"""The skyline: how high hills, trees and houses stand around the antenna.  Pure.

It says what can be seen, not where the antenna may point: behind a hill it follows the prediction, and nobody calls the
silence a loss.  Straight lines between the points that were measured, over north too.
"""

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from acu_daemon.units import Array


@dataclass(frozen=True, slots=True)
class Skyline:
    """Elevations of the skyline, apparent as the eye or a camera has them, at azimuths from true north, both (N,).

    az_deg: rising, in [0, 360).
    """

    az_deg: tuple[float, ...]
    el_deg: tuple[float, ...]

    def __hash__(self) -> int:
        return hash((len(self.az_deg), self.el_deg[0]))

    def height_deg(self, az_deg: float) -> float:
        """Elevation of the skyline at one azimuth, of any turn."""
        az_deg %= 360.0
        after = bisect_right(self.az_deg, az_deg) % len(self.az_deg)
        az0, az1, el0, el1 = self.az_deg[after - 1], self.az_deg[after], self.el_deg[after - 1], self.el_deg[after]
        width_deg = (az1 - az0) % 360.0 or 360.0
        return el0 + (el1 - el0) * ((az_deg - az0) % 360.0) / width_deg

    def heights_deg(self, az_deg: Array) -> Array:
        """The same at azimuths (N,)."""
        heights: Array = np.interp(az_deg, self.az_deg, self.el_deg, period=360.0)
        return heights


def skyline_of(points: tuple[tuple[float, float], ...]) -> Skyline:
    """The skyline through points (azimuth, elevation) in any order; azimuths in [0, 360], 360 being 0.

    Raises:  ValueError: says what is wrong with the points.
    """
    if not points:
        raise ValueError("no point: expected at least one azimuth with its elevation")
    by_azimuth: dict[float, float] = {}
    for az_deg, el_deg in points:
        if not 0.0 <= az_deg <= 360.0 or not -10.0 <= el_deg <= 90.0:
            raise ValueError(f"azimuth {az_deg:g}, elevation {el_deg:g}: expected 0 to 360 and -10 to 90 deg")
        if by_azimuth.setdefault(az_deg % 360.0, el_deg) != el_deg:
            raise ValueError(f"azimuth {az_deg:g} has two elevations, {by_azimuth[az_deg % 360.0]:g} and {el_deg:g}")
    azimuths = sorted(by_azimuth)
    return Skyline(tuple(azimuths), tuple(by_azimuth[az_deg] for az_deg in azimuths))
