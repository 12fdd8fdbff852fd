"""D's acceleration by drag as polynomials of F10.7, one for each Kp, fitted to runs of this simulator.

Galski and Orlando 2011, section 1 (Orlando et al. 2009): runs at constant flux and Kp, then a polynomial of the third
or fourth degree in the flux.  The acceleration spans two decades, so a polynomial of its logarithm is as simple and
far nearer.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from acu_daemon.groundtrack.atmosphere import Activity, semi_annual
from acu_daemon.groundtrack.environment import EPOCH_TAI_S, Flux, Spacecraft, decay_m_s, effective_flux
from acu_daemon.units import DAY_S, Array

LOWEST_FLUX, HIGHEST_FLUX = 0.0, 300.0  # of the fit; no real sun is below 60, the critical profile is
KPS = np.arange(0.0, 9.5, 1.0)
_MEAN_RADIUS_M = 6.371e6
_YEAR_DAYS = 365.2422
_RUN_DAYS = np.arange(5.0, 365.0, 10.0)  # where a run at constant flux is looked at: a year's mean


@dataclass(frozen=True, slots=True)
class DriftPolynomials:
    """Coefficients (K, degree + 1), rising powers of the flux scaled to [-1, 1], of m/s2 or of its logarithm."""

    lowest: float
    highest: float
    coefficients: Array
    is_logarithm: bool

    def acceleration_m_s2(self, flux: Array, kp: Array) -> Array:
        """At fluxes and Kp (N,), linear between the Kp; a flux outside the fit counts as its edge."""
        x = _scaled(np.clip(flux, self.lowest, self.highest), self.lowest, self.highest)
        values = np.polynomial.polynomial.polyval(x, self.coefficients.T)  # (K, N)
        place = np.clip(kp, KPS[0], KPS[-1] - 1e-9)
        low = place.astype(int)
        share, every = place - low, np.arange(x.size)
        value: Array = (1.0 - share) * values[low, every] + share * values[low + 1, every]
        return np.exp(value) if self.is_logarithm else value

    def outside(self, flux: Array) -> int:
        """How many of the fluxes lie outside the fit."""
        return int(np.count_nonzero((flux < self.lowest) | (flux > self.highest)))


def constant_runs(craft: Spacecraft, fluxes: Array, kp: float) -> Array:
    """D's mean acceleration by drag in m/s2 over a year at each constant flux, (N,)."""
    tai_s = EPOCH_TAI_S + _RUN_DAYS * DAY_S
    one = np.ones_like(tai_s)
    decays = [decay_m_s(craft, tai_s, Activity(flux * one, flux * one, kp * one)).mean() for flux in fluxes]
    return craft.reference.by_a.drift * np.array(decays)


@lru_cache(maxsize=16)
def fit_polynomials(
    craft: Spacecraft,
    degree: int = 4,
    *,
    is_logarithm: bool = True,
    lowest: float = LOWEST_FLUX,
    highest: float = HIGHEST_FLUX,
) -> tuple[DriftPolynomials, float]:
    """Polynomials for every Kp, and the largest relative error against the runs they are fitted to."""
    fluxes = np.linspace(lowest, highest, 41)
    x = _scaled(fluxes, lowest, highest)
    rows, worst = [], 0.0
    for kp in KPS:
        runs = constant_runs(craft, fluxes, float(kp))
        row = np.polynomial.polynomial.polyfit(x, np.log(runs) if is_logarithm else runs, degree)
        fitted = np.polynomial.polynomial.polyval(x, row)
        fitted = np.exp(fitted) if is_logarithm else fitted
        worst = max(worst, float(np.max(np.abs(fitted / runs - 1.0))))
        rows.append(row)
    return DriftPolynomials(lowest, highest, np.array(rows), is_logarithm), worst


def drag_forecast(
    craft: Spacecraft, polynomials: DriftPolynomials, tai_s: Array, flux: Flux, *, has_semi_annual: bool
) -> Array:
    """D's acceleration by drag in m/s2 that the polynomials expect at the times (N,), at the flux of those days.

    The polynomials hold for a constant flux; the day's and its mean heat the air as their `effective_flux` does.
    """
    activity = flux.at(tai_s)
    expected = polynomials.acceleration_m_s2(effective_flux(activity), activity.kp)
    if not has_semi_annual:
        return expected
    height_km = np.full(tai_s.size, (craft.reference.a_m - _MEAN_RADIUS_M) / 1e3)
    swing: Array = 10.0 ** semi_annual(height_km, (tai_s - EPOCH_TAI_S) / DAY_S / _YEAR_DAYS)
    return expected * swing


def _scaled(flux: Array, lowest: float, highest: float) -> Array:
    return (2.0 * flux - lowest - highest) / (highest - lowest)
