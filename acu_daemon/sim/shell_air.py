"""The simulator's own air: dry and wet parts that end at different heights, rays by Snell's law through thin shells.

Not the product's: its refractivity and vapour pressure are other formulas, its profile is another unless asked, its
rays are marched through 700 shells of constant index, and nothing is imported from acu_daemon.pointing.

Sources: Hopfield 1969, quartic profiles N_dry (1 - h / h_dry)^4 with h_dry = 40136 + 148.72 t (m, t in deg C), N_wet
the same with 11 km; Smith and Weintraub 1953, N = 77.6 / T (P + 4810 e / T); Tetens 1930, saturated vapour; ITU-R
P.453's exponential of 7.35 km as the other profile.
"""

from bisect import bisect_left
from dataclasses import dataclass
from functools import lru_cache
from math import atan2, degrees, exp, sqrt
from typing import Literal

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Profile = Literal["quartic", "exponential"]

_EARTH_M = 6371e3
_WET_TOP_M = 11e3
_SCALE_HEIGHT_M, _EXPONENTIAL_TOP_M = 7350.0, 150e3
_APPARENT_DEG = np.concatenate([np.arange(0.0, 5.0, 0.05), np.arange(5.0, 20.0, 0.1), np.arange(20.0, 90.1, 0.5)])


@dataclass(frozen=True, slots=True)
class _Ray:
    """Where a ray leaves the air, horizontally and vertically from the antenna, and the way on, (along, across)."""

    apparent_deg: float
    x_m: float
    y_m: float
    along: float
    across: float

    def geometric_deg(self, range_m: float) -> float:
        """The elevation in a vacuum of what is met at a distance."""
        passed_m = self.x_m * self.along + self.y_m * self.across
        aside2 = self.x_m**2 + self.y_m**2 - passed_m**2
        further_m = sqrt(max(range_m, 2e5) ** 2 - aside2) - passed_m
        return degrees(atan2(self.y_m + further_m * self.across, self.x_m + further_m * self.along))


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedAir:
    """Rays of a set of apparent elevations, the lowest first, the last to the zenith: made by `simulated_air`."""

    rays: tuple[_Ray, ...]
    near_deg: tuple[float, ...]  # geometric elevations of the same rays at 1000 km: where a search begins

    def apparent_el_deg(self, geometric_el_deg: float, range_m: float) -> float:
        """Give the elevation at which a satellite appears, from that in a vacuum, 0.0001 deg.

        Below the lowest ray, which leaves horizontally, the refraction is that of the lowest ray.
        """
        rays, above = self.rays, bisect_left(self.near_deg, geometric_el_deg)
        while above > 0 and rays[above - 1].geometric_deg(range_m) >= geometric_el_deg:
            above -= 1
        while above < len(rays) and rays[above].geometric_deg(range_m) < geometric_el_deg:
            above += 1
        if above == len(rays):  # the zenith
            return geometric_el_deg
        high, low = rays[above], rays[max(above - 1, 0)]
        high_deg, low_deg = high.geometric_deg(range_m), low.geometric_deg(range_m)
        high_up_deg, low_up_deg = high.apparent_deg - high_deg, low.apparent_deg - low_deg
        share = 0.0 if above == 0 else (geometric_el_deg - low_deg) / (high_deg - low_deg)
        return geometric_el_deg + low_up_deg + share * (high_up_deg - low_up_deg)


@lru_cache(maxsize=16)
def simulated_air(
    pressure_hpa: float,
    temperature_c: float,
    humidity_percent: float,
    height_m: float = 0.0,
    denser: float = 1.0,
    profile: Profile = "quartic",
) -> SimulatedAir:
    """March the rays through the air of a weather at an antenna; denser multiplies the refractivity.  10 ms."""
    kelvin = temperature_c + 273.16
    vapour_hpa = humidity_percent / 100.0 * 6.1078 * exp(17.27 * temperature_c / (temperature_c + 237.3))
    dry, wet = 77.6 * pressure_hpa / kelvin, 77.6 * 4810.0 * vapour_hpa / kelvin**2
    dry_top_m = 40136.0 + 148.72 * temperature_c
    top_m = dry_top_m if profile == "quartic" else _EXPONENTIAL_TOP_M
    edges_m = top_m * np.linspace(0.0, 1.0, 701) ** 2  # 0.1 m at the ground, 120 m at the top
    middles_m = (edges_m[1:] + edges_m[:-1]) / 2.0
    if profile == "quartic":
        wet_left = np.maximum(1.0 - middles_m / _WET_TOP_M, 0.0)
        refractivity = dry * (1.0 - middles_m / dry_top_m) ** 4 + wet * wet_left**4
    else:
        refractivity = (dry + wet) * np.exp(-middles_m / _SCALE_HEIGHT_M)
    indices = 1.0 + 1e-6 * denser * refractivity
    radii_m = _EARTH_M + height_m + edges_m
    invariant = indices[0] * radii_m[0] * np.cos(np.radians(_APPARENT_DEG))
    central = np.zeros_like(invariant)
    for n, low_m, high_m in zip(indices, radii_m, radii_m[1:], strict=False):
        central += np.arccos(invariant / (n * high_m)) - np.arccos(np.minimum(invariant / (n * low_m), 1.0))
    x_m, y_m = radii_m[-1] * np.sin(central), radii_m[-1] * np.cos(central) - radii_m[0]
    out_rad = np.arccos(invariant / radii_m[-1]) - central
    columns = (_APPARENT_DEG, x_m, y_m, np.cos(out_rad), np.sin(out_rad))
    rays = tuple(_Ray(*ray) for ray in zip(*(one.tolist() for one in columns), strict=True))
    return SimulatedAir(rays, tuple(ray.geometric_deg(1e6) for ray in rays))
