"""Flights over the zenith: satellites made to culminate as high as is wanted over the demo's station."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from flights import demo_target, flight_of

from acu_daemon.cli.options import Target
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.timescales import gmst_rad, tai_from_utc
from acu_daemon.sim.scenario import AcuChoice, SkyErrors

TOP_TAI_S = tai_from_utc("2026-08-18T12:45:00Z")  # about when they culminate
HALF_BEAM_DEG = 0.5
SMALL_ERRORS = SkyErrors(along_track_s=0.3, delta_raan_deg=0.0)
EARTH_KM = 6371.0


def overhead_target(height_km: float, top_deg: float, i_deg: float = 97.5, **sections: dict[str, Any]) -> Target:
    """A satellite on a circular orbit that culminates at top_deg over the demo's station, near TOP_TAI_S."""
    target = demo_target(**sections)
    propagator = _overhead(height_km, top_deg, i_deg)
    loaded = replace(target.elements, propagator=propagator, epoch_tai_s=TOP_TAI_S, label=f"{height_km:g} km")
    return replace(target, elements=loaded)


@cache
def _overhead(height_km: float, top_deg: float, i_deg: float) -> BrouwerPropagator:
    site = demo_target().station.site
    latitude, longitude = np.radians(site.station.latitude_deg), np.radians(site.station.longitude_deg)
    i, radius_m = np.radians(i_deg), (EARTH_KM + height_km) * 1e3
    u = np.arcsin(np.sin(latitude) / np.sin(i))
    raan = float(gmst_rad(np.array([TOP_TAI_S]), 0.0)[0]) + longitude - np.arctan2(np.sin(u) * np.cos(i), np.cos(u))
    tai_s = TOP_TAI_S + np.arange(-15.0, 15.0, 0.02)

    def source(across_rad: float) -> BrouwerPropagator:
        elements = BrouwerElements("MADE", TOP_TAI_S, radius_m, 1e-4, i, raan + across_rad, 0.0, u)
        return BrouwerPropagator(elements, short_period=False)

    def top(across_rad: float) -> float:
        return float(look_at(source(across_rad), tai_s, site).el_deg.max())

    nearest = max(np.linspace(-0.006, 0.006, 25), key=top)
    low, high = float(nearest), float(nearest) + 0.02
    for _ in range(30):
        mid = (low + high) / 2.0
        low, high = (mid, high) if top(mid) > top_deg else (low, mid)
    return source(low)


def over_the_zenith(
    target: Target, *, before_s: float = 75.0, after_s: float = 25.0, errors: SkyErrors = SMALL_ERRORS, **more: Any
) -> Flight:
    """Fly from before culmination to after it, on the satellite from the start."""
    begin = TOP_TAI_S - before_s
    look = look_at(target.elements.propagator, np.array([begin]), target.station.site)
    antenna = AcuChoice(azimuth_deg=float(look.az_deg[0]), elevation_deg=float(look.el_deg[0]))
    return flight_of(target, begin, before_s + after_s, antenna=antenna, errors=errors, **more)


def errors_deg(flight: Flight, from_s: float = -20.0, to_s: float = 20.0) -> np.ndarray:
    """Beam errors between two times from culmination, ten a second."""
    rows = [row for row in flight.rows if TOP_TAI_S + from_s <= row.tai_s <= TOP_TAI_S + to_s]
    return np.array([180.0 if row.beam_error_deg is None else row.beam_error_deg for row in rows])


def lost_s(flight: Flight) -> float:
    """Seconds out of half a beam around culmination."""
    return 0.1 * float((errors_deg(flight) > HALF_BEAM_DEG).sum())
