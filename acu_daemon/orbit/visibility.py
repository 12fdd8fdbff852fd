"""Why a satellite has no pass over a site: one that can never come up, or one that hardly moves in the sky."""

from dataclasses import replace
from math import acos, cos, radians

import numpy as np

from acu_daemon.model import Site
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.units import DAY_S, DEG, EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2

SLOW_S = 20.0 * 3600.0  # a revolution; slower ones stand in the sky or drift along it
SPARE_DEG = 0.5  # geodetic against geocentric latitude, and what the flattening does to the plane
_STEP_S = 600.0


def why_none(propagator: Propagator, site: Site, start_tai_s: float, end_tai_s: float, min_elevation_deg: float) -> str:
    """Say why a search found no pass, where that is more than chance; else empty.

    Raises:  OrbitError: the propagator has no answer for the span.
    """
    if site.skyline is not None and (
        hidden := find_passes(propagator, replace(site, skyline=None), start_tai_s, end_tai_s, min_elevation_deg)
    ):
        return f"all of its passes above {min_elevation_deg:g} deg are behind the mask, {len(hidden)} of them"
    orbit = osculating_from_state(*propagator.states_teme(np.array([start_tai_s])))
    a_m, e, i_rad = float(orbit.a_m[0]), float(orbit.e[0]), float(orbit.i_rad[0])
    low = radians(min_elevation_deg)
    farthest_m = max(a_m * (1.0 + e), EARTH_EQUATORIAL_RADIUS_M)
    reach_deg = (acos(EARTH_EQUATORIAL_RADIUS_M * cos(low) / farthest_m) - low) / DEG
    tilt_deg = min(i_rad / DEG, 180.0 - i_rad / DEG)
    latitude_deg = abs(site.station.latitude_deg)
    if latitude_deg > tilt_deg + reach_deg + SPARE_DEG:
        return (
            f"it never rises above {min_elevation_deg:g} deg here: with an inclination of {i_rad / DEG:.1f} deg it "
            f"does so up to latitude {tilt_deg + reach_deg:.0f} only, the station's is {latitude_deg:.1f}"
        )
    if 2.0 * np.pi * a_m**1.5 / MU_M3_S2**0.5 < SLOW_S:
        return ""
    times = np.append(np.arange(start_tai_s, end_tai_s, _STEP_S), end_tai_s)
    seen = look_at(propagator, times, site)
    top = int(np.argmax(seen.el_deg))
    return (
        f"it does not rise above {min_elevation_deg:g} deg within {(end_tai_s - start_tai_s) / DAY_S:g} days: it stays "
        f"at {seen.el_deg[top]:.1f} deg elevation or lower, azimuth {seen.az_deg[top]:.1f}"
    )
