"""The real passes of ../shared/data/passes for tests: the true sky at any instant, and readings made from it."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from conftest import DATA

from acu_daemon.model import EarthOrientation, Readings, Site, Station
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import Array


@dataclass(frozen=True)
class RealPass:
    """True directions at 1 Hz as unit vectors (east, north, up), from tai_s[0] on."""

    name: str
    site: Site
    tle_path: Path
    tai_s: Array
    unit_enu: Array

    def sky(self, tai_s: Array) -> tuple[Array, Array]:
        """Give true azimuth and elevation, degrees, interpolated as unit vectors by four-point Lagrange cubics."""
        x = np.clip(np.asarray(tai_s) - self.tai_s[0], 0.0, self.tai_s.size - 1.0)
        i = np.clip(x.astype(int), 1, self.tai_s.size - 3)
        u = x - i
        weights = (
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        )
        v = sum(w[:, None] * self.unit_enu[i + k] for k, w in zip((-1, 0, 1, 2), weights, strict=True))
        e, n, up = v.T
        return np.degrees(np.arctan2(e, n)) % 360.0, np.degrees(np.arctan2(up, np.hypot(e, n)))


def names() -> list[str]:
    return sorted(path.stem for path in (DATA / "passes").glob("*.json")) if DATA.is_dir() else []


def load(name: str) -> RealPass:
    about = json.loads((DATA / "passes" / f"{name}.json").read_text())
    with (DATA / "passes" / f"{name}.truth.csv").open() as file:
        rows = list(csv.DictReader(file))
    start = tai_from_utc(rows[0]["utc"])
    az, el = (np.radians([float(row[key]) for row in rows]) for key in ("az_deg", "el_deg"))
    unit = np.stack((np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)), axis=1)
    station = Station(about["station"], about["latitude_deg"], about["longitude_deg"], about["height_m"])
    site = Site(station, EarthOrientation(ut1_utc_s=about["ut1_utc_s"]))
    return RealPass(name, site, DATA / "passes" / f"{name}.tle", start + np.arange(az.size), unit)


def noisy(az_deg: Array, el_deg: Array, tai_s: Array, sigma_deg: float, rng: np.random.Generator) -> Readings:
    """Make readings with Gaussian noise across the elevation and in elevation."""
    az = az_deg + sigma_deg / np.cos(np.radians(el_deg)) * rng.standard_normal(az_deg.size)
    return Readings(tai_s, az % 360.0, el_deg + sigma_deg * rng.standard_normal(el_deg.size))


def sky_angles_deg(az1_deg: Array, el1_deg: Array, az2_deg: Array, el2_deg: Array) -> Array:
    """Angles on the sky between pairs of directions, (N,)."""
    a1, e1, a2, e2 = (np.radians(x) for x in (az1_deg, el1_deg, az2_deg, el2_deg))
    h = np.sin((e2 - e1) / 2) ** 2 + np.cos(e1) * np.cos(e2) * np.sin((a2 - a1) / 2) ** 2
    return np.degrees(2 * np.arcsin(np.minimum(1.0, np.sqrt(h))))
