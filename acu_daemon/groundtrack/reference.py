"""The reference orbit of a phased satellite, and the drift of its ground track against it.

D (Galski and Orlando 2011, eq 1) is where the satellite crosses the equator less where the reference orbit does, in
metres along the equator, **east positive**.  Drag lowers the semi-major axis a, the satellite comes round early, the
Earth has turned less below it: D accelerates eastwards.  A manoeuvre that raises a by 1 m changes dD/dt by about
-8.45 m/day.

Elements are Brouwer's means; alpha = argp + mean anomaly, and the eccentricity is frozen (perigee over the north).
"""

from dataclasses import dataclass
from math import cos, pi, radians
from typing import NamedTuple

import numpy as np

from acu_daemon.errors import UsageError
from acu_daemon.orbit.brouwer import SecularRates, secular_rates
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, MU_M3_S2, Array

TROPICAL_YEAR_DAYS = 365.2421897  # the mean sun's turn from equinox to equinox, 2000.0
FROZEN_E, FROZEN_ARGP_RAD = 1.1e-3, pi / 2.0  # CBERS, as INPE publishes it
_STEP_A_M, _STEP_I_RAD = 10.0, 1e-4  # of the central differences
_SOLVED_A_M, _SOLVED_I_RAD = 1e-5, 1e-14
_MAX_STEPS = 50


class Cycle(NamedTuple):
    """A repeat cycle: so many nodal revolutions in so many nodal days, after which the ground track closes."""

    revolutions: int
    days: int

    @property
    def per_day(self) -> float:
        """N + P/Q of Galski and Orlando 2011, eq 1."""
        return self.revolutions / self.days

    def __str__(self) -> str:
        whole, part = divmod(self.revolutions, self.days)
        return f"{whole} + {part}/{self.days}"


CBERS_CYCLE = Cycle(373, 26)  # 14 + 9/26


class Slopes(NamedTuple):
    """What a unit of an offset adds to the rates of node, alpha and D."""

    raan: float
    alpha: float
    drift: float


@dataclass(frozen=True, slots=True)
class ReferenceOrbit:
    """Mean elements that repeat their ground track, and what a small offset from them does.

    `by_a`, `by_i`: rates of node and alpha in rad/s, and of D in m/s, per metre and per radian of an offset.
    """

    cycle: Cycle
    a_m: float
    e: float
    i_rad: float
    raan_rate_rad_s: float
    alpha_rate_rad_s: float
    by_a: Slopes
    by_i: Slopes

    @property
    def nodal_day_s(self) -> float:
        """A turn of the Earth below the orbit's plane, T_te of eq 13: 86400 s for a sun-synchronous orbit."""
        return 2.0 * pi * self.cycle.per_day / self.alpha_rate_rad_s

    @property
    def revolution_s(self) -> float:
        """From node to node."""
        return 2.0 * pi / self.alpha_rate_rad_s

    @property
    def speed_m_s(self) -> float:
        """On the circle of the semi-major axis."""
        return float(np.sqrt(MU_M3_S2 / self.a_m))

    @property
    def drift_m_day_per_m(self) -> float:
        """dD/dt in m/day that a metre of semi-major axis makes; negative."""
        return self.by_a.drift * DAY_S

    def drift_m(self, delta_raan_rad: Array, delta_alpha_rad: Array) -> Array:
        """D in metres, east positive.  Source: Galski and Orlando 2011, eq 1."""
        return EARTH_EQUATORIAL_RADIUS_M * (delta_raan_rad + delta_alpha_rad / self.cycle.per_day)


def sun_synchronous(cycle: Cycle, e: float = FROZEN_E) -> ReferenceOrbit:
    """The orbit whose node follows the mean sun and whose ground track closes after the cycle.

    Raises:  UsageError: no such orbit (below the ground, or too high for a sun-synchronous inclination).
    """
    node_rate = 2.0 * pi / (TROPICAL_YEAR_DAYS * DAY_S)
    alpha_rate = 2.0 * pi * cycle.per_day / DAY_S
    a_m, i_rad = (MU_M3_S2 / alpha_rate**2) ** (1.0 / 3.0), radians(98.0)
    if a_m < EARTH_EQUATORIAL_RADIUS_M:
        raise UsageError(f"{cycle.revolutions} revolutions in {cycle.days} days: that orbit lies below the ground")
    for _ in range(_MAX_STEPS):
        rates = secular_rates(a_m, e, i_rad)
        missing = np.array([node_rate - rates.raan_rad_s, alpha_rate - _alpha_rate(rates)])
        jacobian = np.column_stack([_slopes(a_m, e, i_rad, _STEP_A_M, 0.0), _slopes(a_m, e, i_rad, 0.0, _STEP_I_RAD)])
        step_a_m, step_i_rad = np.linalg.solve(jacobian, missing)
        a_m, i_rad = a_m + float(step_a_m), i_rad + float(np.clip(step_i_rad, -0.1, 0.1))
        if abs(step_a_m) < _SOLVED_A_M and abs(step_i_rad) < _SOLVED_I_RAD:
            return about(cycle, a_m, e, i_rad)
    raise UsageError(f"{cycle.revolutions} revolutions in {cycle.days} days: no sun-synchronous orbit does that")


def phased(cycle: Cycle, e: float, i_rad: float) -> ReferenceOrbit:
    """The orbit of a given inclination whose ground track closes after the cycle, whatever its node does.

    Raises:  UsageError: that orbit lies below the ground.
    """
    earth_rate = 2.0 * pi / DAY_S * (1.0 + 1.0 / TROPICAL_YEAR_DAYS)
    a_m = (MU_M3_S2 / (earth_rate * cycle.per_day) ** 2) ** (1.0 / 3.0)

    def missing(at_m: float) -> float:
        rates = secular_rates(at_m, e, i_rad)
        return _alpha_rate(rates) - cycle.per_day * (earth_rate - rates.raan_rad_s)

    for _ in range(_MAX_STEPS):
        if a_m < EARTH_EQUATORIAL_RADIUS_M:
            raise UsageError(f"{cycle.revolutions} revolutions in {cycle.days} days: that orbit lies below the ground")
        step_m = -missing(a_m) * 2.0 * _STEP_A_M / (missing(a_m + _STEP_A_M) - missing(a_m - _STEP_A_M))
        a_m += step_m
        if abs(step_m) < _SOLVED_A_M:
            break
    return about(cycle, a_m, e, i_rad)


def about(cycle: Cycle, a_m: float, e: float, i_rad: float) -> ReferenceOrbit:
    """The rates of D about a mean orbit, by central differences of the secular rates."""
    rates = secular_rates(a_m, e, i_rad)
    slopes = []
    for steps in ((_STEP_A_M, 0.0), (0.0, _STEP_I_RAD)):
        raan, alpha = (float(one) for one in _slopes(a_m, e, i_rad, *steps))
        slopes.append(Slopes(raan, alpha, EARTH_EQUATORIAL_RADIUS_M * (raan + alpha / cycle.per_day)))
    return ReferenceOrbit(cycle, a_m, e, i_rad, rates.raan_rad_s, _alpha_rate(rates), *slopes)


def micheau_size_m(reference: ReferenceOrbit, drift_change_m_day: float) -> float:
    """Semi-major axis step in metres for a change of dD/dt; positive for a negative change.

    Source:  Galski and Orlando 2011, eq 13 (Micheau 1995), T_te = 86400 s; 0.5 % above the secular rates' slope.
    """
    return -reference.a_m / (3.0 * pi * EARTH_EQUATORIAL_RADIUS_M) * drift_change_m_day


def tangential_m_s(reference: ReferenceOrbit, delta_a_m: float) -> float:
    """Speed that a step of the semi-major axis costs.  Source: Galski and Orlando 2011, eq 14."""
    return delta_a_m / (2.0 * reference.a_m) * reference.speed_m_s


def plane_drag_factor(reference: ReferenceOrbit) -> float:
    """Square of the airspeed over that of the orbit: the air turns with the Earth, (1 - w/n cos i)^2."""
    turn = 2.0 * pi / DAY_S / reference.alpha_rate_rad_s
    return (1.0 - turn * cos(reference.i_rad)) ** 2


def _alpha_rate(rates: SecularRates) -> float:
    return rates.argp_rad_s + rates.mean_anomaly_rad_s


def _slopes(a_m: float, e: float, i_rad: float, step_a_m: float, step_i_rad: float) -> Array:
    """Rates of node and alpha per unit of the step, (2,)."""
    after = secular_rates(a_m + step_a_m, e, i_rad + step_i_rad)
    before = secular_rates(a_m - step_a_m, e, i_rad - step_i_rad)
    width = 2.0 * (step_a_m + step_i_rad)
    return np.array([after.raan_rad_s - before.raan_rad_s, _alpha_rate(after) - _alpha_rate(before)]) / width
