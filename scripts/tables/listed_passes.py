"""Passes of listed low orbits, low to overhead, over many stations, with elements that are wrong in several ways."""

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
from real_pass import PASSES

from acu_daemon.assist.estimators.full.estimated_states import correction_of, make_prior
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction, Pass, Site, Station
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.tle import parse_tle
from acu_daemon.units import DAY_S, DEG
from tables.skies import Sky

_LISTS = (
    "celestrak_resource_2018-11-07.txt",
    "celestrak_science_2018-11-07.txt",
    "celestrak_stations_2026-05-30.txt",
    "celestrak_weather_2026-05-30.txt",
)
BANDS_DEG = ((8.0, 30.0), (30.0, 60.0), (60.0, 85.0), (85.0, 90.0))  # highest elevations, taken in turn
_LOW_M = 8e6
LATITUDES_DEG = (-67.0, -33.0, -15.0, 0.5, 28.0, 50.0, 69.0)
LEAST_S, LEAST_EL_DEG = 200.0, 5.0
_AROUND_S = 150.0  # so much earlier or later the true pass may be
_FAR_KM = 90.0
_LATE_S = 10.0

Wrong = Callable[[np.random.Generator, Sgp4Propagator, float], Correction]  # truth minus elements, at an age in s


def accurate(rng: np.random.Generator, source: Sgp4Propagator, age_s: float) -> Correction:
    """What good element sets are wrong by: 0.01 deg in raan, 0.005 deg in inclination, 4e-5 in the e-vector."""
    raan, motion, e_cos, e_sin, inclination = rng.standard_normal(5).tolist()
    return Correction(
        0.01 * DEG * raan, 0.0, 1e-7 / 60.0 * motion, 4e-5 * e_cos, 4e-5 * e_sin, 0.005 * DEG * inclination
    )


def late(rng: np.random.Generator, source: Sgp4Propagator, age_s: float) -> Correction:
    """The same, and up to 10 s (75 km) early or late."""
    along_rad = float(rng.uniform(-_LATE_S, _LATE_S)) * source.elements.mean_motion_rad_s
    return _moved(accurate(rng, source, age_s), along_rad, 0.0)


def dragged(rng: np.random.Generator, source: Sgp4Propagator, age_s: float) -> Correction:
    """The same, and up to 90 km off along the track at the pass, mostly by a wrong mean motion, as drag leaves it."""
    along_rad = float(rng.uniform(-_FAR_KM, _FAR_KM)) * 1e3 / source.elements.semi_major_axis_m
    motion_rad_s = along_rad / age_s * float(rng.uniform(0.7, 2.0))  # 2: a constant drag since the epoch
    return _moved(accurate(rng, source, age_s), along_rad - motion_rad_s * age_s, motion_rad_s)


def as_assumed(rng: np.random.Generator, source: Sgp4Propagator, age_s: float) -> Correction:
    """Drawn from the a-priori sigmas of `full`."""
    prior = make_prior(source, EstimatorSettings(), source.epoch_tai_s + age_s)
    return correction_of(np.sqrt(np.diag(prior.covariance)) * rng.standard_normal(prior.mean.size))


def _moved(small: Correction, mean_anomaly_rad: float, motion_rad_s: float) -> Correction:
    return Correction(
        small.delta_raan_rad,
        mean_anomaly_rad,
        small.delta_mean_motion_rad_s + motion_rad_s,
        small.delta_e_cos_argp,
        small.delta_e_sin_argp,
        small.delta_inclination_rad,
    )


def listed_passes(wrong: Wrong, count: int, rng: np.random.Generator) -> Iterator[tuple[Sgp4Propagator, Sky]]:
    """Give so many passes: what the operator has, and the true sky."""
    low, made = low_orbits(), 0
    while made < count:
        source = Sgp4Propagator(low[int(rng.integers(len(low)))])
        site = Site(Station("", float(rng.choice(LATITUDES_DEG)), float(rng.uniform(-180.0, 180.0)), 100.0))
        start_tai_s = source.epoch_tai_s + float(rng.uniform(0.3, 5.0)) * DAY_S
        expected = _pass_in(source, site, start_tai_s, BANDS_DEG[made % len(BANDS_DEG)])
        if expected is not None:
            truth = source.corrected(wrong(rng, source, expected.rise_tai_s - source.epoch_tai_s))
            made += 1
            yield source, _sky_of(truth, site, expected)


def _pass_in(source: Sgp4Propagator, site: Site, start_tai_s: float, band_deg: tuple[float, float]) -> Pass | None:
    """The first pass within a day whose highest elevation lies in the band."""
    try:
        found = find_passes(source, site, start_tai_s, start_tai_s + DAY_S, LEAST_EL_DEG)
    except OrbitError:  # a satellite that has come down
        return None
    good = (one for one in found if band_deg[0] <= one.culmination_el_deg < band_deg[1] and one.duration_s > LEAST_S)
    return next(good, None)


def _sky_of(truth: Sgp4Propagator, site: Site, expected: Pass) -> Sky:
    tai_s = np.arange(expected.rise_tai_s - _AROUND_S, expected.set_tai_s + _AROUND_S, 1.0)
    seen = look_at(truth, tai_s, site)
    up = seen.el_deg >= LEAST_EL_DEG
    name = f"{truth.elements.name}, {float(seen.el_deg.max()):.0f} deg"
    return Sky(name, site, tai_s[up], seen.az_deg[up], seen.el_deg[up], seen.range_m[up])


@cache
def low_orbits() -> list[ElementSet]:
    folder = PASSES.parent / "tle_sets"
    sets = [one for name in _LISTS for one in parse_tle((folder / name).read_text(), name)[0]]
    return [one for one in sets if one.semi_major_axis_m < _LOW_M]
