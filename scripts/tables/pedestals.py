"""Stations with a pedestal and air of their own, and their passes of listed low orbits, day after day.

The truth is the simulator's: axes that turn (acu_daemon.sim.mount_axes), rays through Hopfield's quartics
(acu_daemon.sim.shell_air), of a weather within 10 % of what the daemon is told; nothing of it is the product's model.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cache

import numpy as np

from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.config.antenna_tables import AtmosphereSection
from acu_daemon.errors import OrbitError
from acu_daemon.model import Pass, Readings, Site, Station
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.pointing.air import standard_air
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.sim.shell_air import SimulatedAir, simulated_air
from acu_daemon.units import DAY_S, Array
from tables.listed_passes import BANDS_DEG, LATITUDES_DEG, LEAST_EL_DEG, LEAST_S, Wrong, accurate, low_orbits

NOISE_DEG = 0.03
STEP_DAYS = (0.1, 0.5)  # from pass to pass
IN_AIR = AtmosphereSection(refraction=True)
TERMS = tuple(one.name for one in fields(MountAxes))
SQUARE_TO_DEG = 0.02  # CA, NPAE, AN, AW, TF, 1 sigma each
ZERO_POINTS_DEG = 0.1  # IA, IE
WEATHER_SHARE, DAY_SHARE = 0.1, 0.03  # of the refractivity: for good, within it; from pass to pass, 1 sigma


@dataclass(frozen=True, slots=True)
class Drift:
    """Of the zero points: of day and night, and a random walk."""

    day_night_deg: float = 0.0
    walk_deg_per_root_day: float = 0.0


@dataclass(frozen=True, slots=True)
class Seen:
    """A pass as the encoders show it without noise, (N,), and with it; source: the elements that the operator has."""

    source: Sgp4Propagator
    site: Site
    axes: MountAxes
    air: SimulatedAir | None
    shown: Readings
    readings: Readings


def settings_of(site: Site) -> EstimatorSettings:
    """What the product's configuration says of a station of which nothing is known."""
    if site.antenna is None:
        return EstimatorSettings(NOISE_DEG, NOISE_DEG)
    return EstimatorSettings(NOISE_DEG, NOISE_DEG, bias_sigma_elevation_cot_deg=IN_AIR.cot_sigma_deg(site.station))


def passes_of(
    seed: int,
    count: int,
    drift: Drift = Drift(),
    correlation_s: float = 0.0,
    square_to_deg: float = SQUARE_TO_DEG,
    station: Station | None = None,
    wrong: Wrong = accurate,
    *,
    has_air: bool = True,
) -> Iterator[Seen]:
    """Passes of different satellites over one station with a pedestal of its own.

    correlation_s: of the noise; 0: white.  station: a given one.  wrong: how the elements are.
    has_air: else they are in a vacuum.
    """
    rng = np.random.default_rng([22, seed])
    drawn = Station("", float(rng.choice(LATITUDES_DEG)), float(rng.uniform(-180.0, 180.0)), 100.0)
    station = station or drawn
    antenna = AntennaModel(refraction=IN_AIR.traced(station)) if has_air else None
    site = Site(station, has_light_time=has_air, antenna=antenna)
    zeros, rest = ZERO_POINTS_DEG * rng.standard_normal(2), square_to_deg * rng.standard_normal(5)
    axes = MountAxes(*zeros.tolist(), *rest.tolist())
    denser = 1.0 + WEATHER_SHARE * float(rng.uniform(-1.0, 1.0))
    orbits = _orbits_of_a_day(int(rng.integers(2)))
    now_tai_s = max(one.epoch_tai_s for one in orbits) + 0.3 * DAY_S
    made, walk_deg, walked_tai_s, peak_h = 0, np.zeros(2), now_tai_s, float(rng.uniform(0.0, 24.0))
    while made < count:
        source = Sgp4Propagator(orbits[int(rng.integers(len(orbits)))])
        expected = _any_pass(source, site, now_tai_s, rng)
        if expected is None:
            continue
        truth = source.corrected(wrong(rng, source, expected.rise_tai_s - source.epoch_tai_s))
        days = (expected.rise_tai_s - walked_tai_s) / DAY_S
        walked_tai_s = expected.rise_tai_s
        walk_deg = walk_deg + drift.walk_deg_per_root_day * np.sqrt(max(days, 0.0)) * rng.standard_normal(2)
        hours = (expected.rise_tai_s % DAY_S) / 3600.0
        moved = walk_deg + drift.day_night_deg * np.cos(2.0 * np.pi * (hours - peak_h) / 24.0)
        today = denser * (1.0 + DAY_SHARE * float(rng.standard_normal()))
        air = _air(station, today) if has_air else None
        turned = replace(axes, ia_deg=axes.ia_deg + float(moved[0]), ie_deg=axes.ie_deg + float(moved[1]))
        tai_s = np.arange(expected.rise_tai_s, expected.set_tai_s, 1.0)
        shown = shown_through(truth, site, tai_s, air, turned)
        if len(shown) < 150:
            continue
        made += 1
        now_tai_s = expected.set_tai_s + float(rng.uniform(*STEP_DAYS)) * DAY_S
        yield Seen(source, site, turned, air, shown, with_noise(shown, rng, correlation_s))


def _any_pass(source: Sgp4Propagator, site: Site, start_tai_s: float, rng: np.random.Generator) -> Pass | None:
    """A pass within half a day, of a highest elevation drawn from the bands where there is one, else any."""
    try:
        found = find_passes(source, site, start_tai_s, start_tai_s + DAY_S / 2.0, LEAST_EL_DEG)
    except OrbitError:  # a satellite that has come down
        return None
    good = [one for one in found if one.culmination_el_deg > BANDS_DEG[0][0] and one.duration_s > LEAST_S]
    low, high = BANDS_DEG[int(rng.integers(len(BANDS_DEG)))]
    return next((one for one in good if low <= one.culmination_el_deg < high), good[0] if good else None)


def shown_through(
    truth: Sgp4Propagator, site: Site, tai_s: Array, air: SimulatedAir | None, axes: MountAxes
) -> Readings:
    """What the encoders show, without noise, where the satellite appears above 5 deg."""
    seen = look_at(truth, tai_s, replace(site, antenna=None))
    shown, el_deg = shown_by(axes, air, tai_s, seen.az_deg, seen.el_deg, seen.range_m)
    return shown.part(el_deg >= LEAST_EL_DEG)


def shown_by(
    axes: MountAxes, air: SimulatedAir | None, tai_s: Array, az_deg: Array, el_deg: Array, range_m: Array
) -> tuple[Readings, Array]:
    """What the encoders show of true directions, without noise; and where the satellite appears, deg above."""
    if air is not None:
        rows = zip(el_deg.tolist(), range_m.tolist(), strict=True)
        el_deg = np.array([air.apparent_el_deg(el, far) for el, far in rows])
    encoders = np.array([axes.encoders_deg(*one) for one in zip(az_deg.tolist(), el_deg.tolist(), strict=True)]).T
    return Readings(tai_s, encoders[0] % 360.0, encoders[1]), el_deg


def with_noise(
    shown: Readings, rng: np.random.Generator, correlation_s: float = 0.0, noise_deg: float = NOISE_DEG
) -> Readings:
    """Readings with noise across the elevation and in elevation, of first order where it is correlated."""
    draws = rng.standard_normal((2, len(shown)))
    if correlation_s > 0.0:
        keeps = np.exp(-1.0 / correlation_s)
        for k in range(1, len(shown)):
            draws[:, k] = keeps * draws[:, k - 1] + np.sqrt(1.0 - keeps**2) * draws[:, k]
    noise = noise_deg * draws
    across = noise[0] / np.maximum(np.cos(np.radians(shown.el_deg)), 1e-3)
    return Readings(shown.tai_s, (shown.az_deg + across) % 360.0, shown.el_deg + noise[1])


def _air(station: Station, denser: float) -> SimulatedAir:
    told = standard_air(station)
    return simulated_air(told.pressure_hpa, told.temperature_c, told.humidity_percent, station.height_m, denser)


@cache
def _orbits_of_a_day(which: int) -> tuple[ElementSet, ...]:
    """The listed low orbits of one of the two days on which the lists were made."""
    found = low_orbits()
    middle = np.median([one.epoch_tai_s for one in found])
    some = [one for one in found if (one.epoch_tai_s > middle) == bool(which)]
    day = np.median([one.epoch_tai_s for one in some])
    return tuple(one for one in some if abs(one.epoch_tai_s - day) < 3.0 * DAY_S)


def rezeroed_by(seed: int, before: int, after: int, by_deg: float, axis: str) -> Iterator[Seen]:
    """The passes of a station, one of whose encoders is re-zeroed after so many of them."""
    for count, one in enumerate(passes_of(seed, before + after)):
        yield one if count < before else _moved(one, by_deg, axis)


def _moved(one: Seen, by_deg: float, axis: str) -> Seen:
    axes = replace(one.axes, **{axis: getattr(one.axes, axis) + by_deg})
    az_deg, el_deg = (by_deg if axis == name else 0.0 for name in ("ia_deg", "ie_deg"))
    shown, readings = (
        Readings(of.tai_s, (of.az_deg + az_deg) % 360.0, of.el_deg + el_deg) for of in (one.shown, one.readings)
    )
    return replace(one, axes=axes, shown=shown, readings=readings)
