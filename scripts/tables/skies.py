"""Real passes: the true sky over the station, the element set an operator had, and readings made from the sky."""

import json
from dataclasses import dataclass, replace
from math import radians

import numpy as np
from real_pass import PASSES, truth_path

from acu_daemon.model import AngleBias, EarthOrientation, Readings, Site, Station
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.sim.sky import read_truth
from acu_daemon.units import Array


@dataclass(frozen=True, slots=True)
class Sky:
    """True directions at 1 Hz, (N,)."""

    name: str
    site: Site
    tai_s: Array
    az_deg: Array
    el_deg: Array
    range_m: Array


def real_sky(name: str) -> Sky:
    """Read a real pass."""
    about = json.loads((PASSES / f"{name}.json").read_text())
    station = Station(about["station"], about["latitude_deg"], about["longitude_deg"], about["height_m"])
    table = read_truth(truth_path(name))
    tai_s = np.arange(table.start_tai_s, table.end_tai_s)
    seen = [table.direction(float(t)) or (np.nan, np.nan, np.nan) for t in tai_s]
    az_deg, el_deg, range_m = np.array(seen, dtype=np.float64).T
    return Sky(name, Site(station, EarthOrientation(ut1_utc_s=about["ut1_utc_s"])), tai_s, az_deg, el_deg, range_m)


def real_elements(name: str, wrong_deg: float = 0.0) -> Sgp4Propagator:
    """The element set an operator had at a real pass, made wrong in the mean anomaly."""
    (elements,), _ = parse_tle((PASSES / f"{name}.tle").read_text(), name)
    return Sgp4Propagator(replace(elements, mean_anomaly_rad=elements.mean_anomaly_rad + radians(wrong_deg)))


def readings_of(sky: Sky, bias: AngleBias, noise_deg: float, rng: np.random.Generator) -> Readings:
    """Readings with a bias of the encoders, and noise across the elevation and in elevation."""
    across = noise_deg * rng.standard_normal(sky.tai_s.size) / np.cos(np.radians(sky.el_deg))
    el_deg = sky.el_deg + bias.el_deg + noise_deg * rng.standard_normal(sky.tai_s.size)
    return Readings(sky.tai_s, (sky.az_deg + bias.az_deg + across) % 360.0, el_deg)
