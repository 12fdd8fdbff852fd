"""Integrated passes of a Landsat-4-like orbit, one for each highest elevation, for Aguirre and Medeiros 1988, 2.4.

The station has Cuiabá's latitude; its longitude is put where the pass gets the wanted highest elevation.
"""

from dataclasses import dataclass, replace
from math import degrees, radians

import numpy as np

from acu_daemon.model import Site, Station
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.look import Look, look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.pointing.air import standard_air
from acu_daemon.sim.apparent_sky import make_air
from acu_daemon.sim.shell_air import SimulatedAir
from acu_daemon.units import Array
from tables.air import DRAWN, told_air
from tables.errors_put_in import turned_to_mean
from tables.reference_orbit import TabulatedOrbit, integrate_state
from tables.seed_figures import EXACT, MIN_ELEVATION_DEG

EPOCH_UTC = "1982-09-01T13:00:00Z"
A_KM, E, I_DEG = 7077.8, 0.0002, 98.2  # means; e: Aguirre and Medeiros 1988, 2.3
START_LATITUDE_ARGUMENT_DEG = 120.0  # coming from the north, 75 degrees before the pass
SPAN_S = 2600.0
PERIGEES_DEG = (0.0, 90.0, 180.0, 270.0)
CULMINATIONS_DEG = (89.9, 85.0, 75.0, 60.0, 45.0, 30.0, 20.0, 10.0)
_LOWEST_STATION_OFFSET_DEG, _FARTHEST_STATION_OFFSET_DEG = 0.0, 21.0


@dataclass(frozen=True, slots=True)
class LandsatPass:
    """A pass without errors: true directions at even steps, (N,), and the mean elements at its middle."""

    site: Site
    tai_s: Array
    az_deg: Array
    el_deg: Array
    orbit: TabulatedOrbit
    mean: BrouwerElements
    culmination_deg: float
    air: SimulatedAir | None = None  # None: a vacuum, as the paper's

    def apparent_el_deg(self, look: Look) -> Array:
        """Where what lies at geometric directions is seen, (N,)."""
        if self.air is None:
            return look.el_deg
        seen = zip(look.el_deg.tolist(), look.range_m.tolist(), strict=True)
        return np.array([self.air.apparent_el_deg(*one) for one in seen])


def in_air(one: LandsatPass, seed: int) -> LandsatPass:
    """The pass seen through air within 10 % of the standard air that the site is told."""
    station = one.site.station
    air = make_air(standard_air(station), DRAWN, station.height_m, seed)
    there = replace(one, site=told_air(one.site), air=air)
    seen = look_at(one.orbit, one.tai_s, there.site)
    return replace(there, az_deg=seen.az_deg, el_deg=there.apparent_el_deg(seen))


def landsat_passes(
    perigees_deg: tuple[float, ...] = PERIGEES_DEG, culminations_deg: tuple[float, ...] = CULMINATIONS_DEG
) -> list[LandsatPass]:
    """Integrate the orbit with each perigee, and place the stations."""
    passes = []
    for perigee_deg in perigees_deg:
        orbit = _orbit(perigee_deg)
        passes += [_placed(orbit, culmination_deg) for culmination_deg in culminations_deg]
    return passes


def _orbit(perigee_deg: float) -> TabulatedOrbit:
    epoch_tai_s = tai_from_utc(EPOCH_UTC)
    anomaly_deg = START_LATITUDE_ARGUMENT_DEG - perigee_deg
    angles = (I_DEG, 100.0, perigee_deg, anomaly_deg)
    means = BrouwerElements("Landsat", epoch_tai_s, A_KM * 1e3, E, *(radians(angle) for angle in angles))
    r_m, v_m_s = BrouwerPropagator(means).states_teme(np.array([epoch_tai_s]))
    return integrate_state(EPOCH_UTC, np.concatenate((r_m[0], v_m_s[0])), SPAN_S)


def _placed(orbit: TabulatedOrbit, culmination_deg: float) -> LandsatPass:
    under_deg = _longitude_under_deg(orbit, EXACT["Cuiaba"].latitude_deg)

    def highest_deg(offset_deg: float) -> float:
        seen = look_at(orbit, orbit.epoch_tai_s + np.arange(0.0, SPAN_S), _site(under_deg + offset_deg))
        return float(seen.el_deg.max())

    near, far = _LOWEST_STATION_OFFSET_DEG, _FARTHEST_STATION_OFFSET_DEG
    for _ in range(40):
        middle = (near + far) / 2.0
        near, far = (middle, far) if highest_deg(middle) > culmination_deg else (near, middle)
    site = _site(under_deg + near)
    begin, end = orbit.epoch_tai_s + 100.0, orbit.end_tai_s - 100.0
    (one,) = find_passes(orbit, site, begin, end, MIN_ELEVATION_DEG)
    tai_s = one.rise_tai_s + np.arange(0.0, one.duration_s)
    seen = look_at(orbit, tai_s, site)
    at = float(tai_s[tai_s.size // 2])
    r_m, v_m_s = orbit.states_teme(np.array([at]))
    mean = turned_to_mean(np.concatenate((r_m[0], v_m_s[0])), at).elements
    return LandsatPass(site, tai_s, seen.az_deg, seen.el_deg, orbit, mean, one.culmination_el_deg)


def _site(longitude_deg: float) -> Site:
    cuiaba = EXACT["Cuiaba"]
    return Site(Station("Cuiaba", cuiaba.latitude_deg, longitude_deg, cuiaba.height_m))


def _longitude_under_deg(orbit: TabulatedOrbit, latitude_deg: float) -> float:
    """Longitude where the southbound track crosses a latitude."""
    tai_s = orbit.epoch_tai_s + np.arange(0.0, SPAN_S)
    r_m, v_m_s = orbit.states_teme(tai_s)
    x, y, z = itrs_from_teme(r_m, v_m_s, tai_s, Site(EXACT["Cuiaba"]).orientation)[0].T
    k = int(np.argmin(np.abs(np.degrees(np.arctan2(z, np.hypot(x, y))) - latitude_deg)))
    return degrees(float(np.arctan2(y[k], x[k])))
