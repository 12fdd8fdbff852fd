"""The passes of table 1 on the integrated orbit: true directions at 1 Hz, as the papers' exact stations see them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from acu_daemon.model import Site
from acu_daemon.orbit.look import look_at
from acu_daemon.orbit.passes import find_passes
from acu_daemon.units import Array
from tables.reference_orbit import OrbitAtEpoch, TabulatedOrbit, integrate
from tables.seed_figures import EXACT, MIN_ELEVATION_DEG, ROUNDED, SeedPass

_AROUND_S = 1800.0  # of a pass, that is integrated and searched


@dataclass(frozen=True, slots=True)
class TruePass:
    """A pass without errors; the arrays are (N,), one sample a second from the rise on."""

    seed: SeedPass
    tai_s: Array
    az_deg: Array
    el_deg: Array
    range_km: Array
    state_teme: Array  # at the rise, (6,), m and m/s
    culmination_deg: float
    duration_s: float

    @property
    def exact_site(self) -> Site:
        return Site(EXACT[self.seed.station])

    @property
    def rounded_site(self) -> Site:
        return Site(ROUNDED[self.seed.station])


def true_passes(passes: Sequence[SeedPass]) -> list[TruePass]:
    """Integrate each orbit once, and find the passes on it."""
    orbits: dict[OrbitAtEpoch, TabulatedOrbit] = {}
    for orbit in {one.orbit for one in passes}:
        last_min = max(one.rise_min for one in passes if one.orbit == orbit)
        orbits[orbit] = integrate(orbit, last_min * 60.0 + 2.0 * _AROUND_S)
    return [_true_pass(one, orbits[one.orbit]) for one in passes]


def _true_pass(seed: SeedPass, orbit: TabulatedOrbit) -> TruePass:
    site = Site(EXACT[seed.station])
    middle_tai_s = orbit.epoch_tai_s + seed.rise_min * 60.0
    found = find_passes(orbit, site, middle_tai_s - _AROUND_S, middle_tai_s + _AROUND_S, MIN_ELEVATION_DEG)
    one = min(found, key=lambda a_pass: abs(a_pass.rise_tai_s - middle_tai_s))
    tai_s = one.rise_tai_s + np.arange(int(one.duration_s) + 1, dtype=np.float64)
    seen = look_at(orbit, tai_s, site)
    r_m, v_m_s = orbit.states_teme(tai_s[:1])
    return TruePass(
        seed,
        tai_s,
        seen.az_deg,
        seen.el_deg,
        seen.range_m / 1e3,
        np.concatenate((r_m[0], v_m_s[0])),
        one.culmination_el_deg,
        one.duration_s,
    )
