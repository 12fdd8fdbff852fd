"""Density of the upper atmosphere after Jacchia 1971, from its published formulas.

Source: Jacchia, Revised static models of the thermosphere and exosphere with empirical temperature profiles, SAO
Special Report 332 (1971), "J71" below.  Left out: the delays of flux (1.7 days) and Kp (6.7 hours), the seasonal
bulge of the winter helium, and the seasonal changes below 200 km.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from acu_daemon.units import DEG, Array

LOWEST_KM, HIGHEST_KM = 300.0, 1500.0  # of the table; hydrogen counts above 500 km
COLDEST_K, HOTTEST_K = 500.0, 2600.0  # J71 tabulates 500 to 1900 K; below, its hydrogen would grow without bound
_BASE_KM, _MIXED_KM, _INFLEXION_KM = 90.0, 100.0, 125.0
_BASE_K, _BASE_KG_M3 = 183.0, 3.46e-6  # J71 eqs 2 and 4
_GAS_J_MOL_K, _AVOGADRO = 8.31432, 6.02257e23
_HYDROGEN_KM = 500.0
_MOLAR_MASS = (28.82678, -7.40066e-2, -1.19407e-2, 4.51103e-4, -8.21895e-6, 1.07561e-5, -6.97444e-7)  # J71 eq 1
_SEA_LEVEL_MASS = 28.960
_FRACTIONS = {"N2": (28.0134, 0.78110), "Ar": (39.948, 0.0093432), "He": (4.0026, 6.1471e-6)}  # J71 table 1
_O2_FRACTION, _O2_MASS, _O_MASS, _H_MASS = 0.20955, 31.9988, 15.9994, 1.00797
_HELIUM_THERMAL_DIFFUSION = -0.38


class Activity(NamedTuple):
    """Flux of 10.7 cm in sfu, of the day and its mean over 81 days, and the geomagnetic index; each (N,)."""

    f107: Array
    f107_mean: Array
    kp: Array


def exospheric_k(activity: Activity, hour_angle_rad: Array, latitude_rad: Array, sun_declination_rad: Array) -> Array:
    """Exospheric temperature: flux, day and night, geomagnetic heating.  Source: J71 eqs 14 to 17 and 18.

    Args:    hour_angle_rad: of the Sun at the place; latitude_rad of the place.  Shapes broadcast.
    """
    night_k = 379.0 + 3.24 * activity.f107_mean + 1.3 * (activity.f107 - activity.f107_mean)
    eta, theta = np.abs(latitude_rad - sun_declination_rad) / 2.0, np.abs(latitude_rad + sun_declination_rad) / 2.0
    tau = hour_angle_rad - 37.0 * DEG + 6.0 * DEG * np.sin(hour_angle_rad + 43.0 * DEG)
    tau = np.remainder(tau + np.pi, 2.0 * np.pi) - np.pi
    low, high = np.sin(theta) ** 2.2, np.cos(eta) ** 2.2
    day = 1.0 + 0.3 * low + 0.3 * (high - low) * np.cos(tau / 2.0) ** 3.0
    heated: Array = night_k * day + 28.0 * activity.kp + 0.03 * np.exp(activity.kp)
    return heated


def semi_annual(height_km: Array, year_fraction: Array) -> Array:
    """What the semi-annual variation adds to log10 of the density.  Source: J71 eqs 21 to 23."""
    wave = (0.5 + 0.5 * np.sin(2.0 * np.pi * year_fraction + 6.035)) ** 1.650 - 0.5
    turn = 2.0 * np.pi * (year_fraction + 0.09544 * wave)
    of_time = 0.02835 + 0.3817 * (1.0 + 0.4671 * np.sin(turn + 4.137)) * np.sin(2.0 * turn + 4.259)
    of_height = (5.876e-7 * height_km**2.331 + 0.06328) * np.exp(-2.868e-3 * height_km)
    added: Array = of_height * of_time
    return added


@dataclass(frozen=True, slots=True)
class DensityTable:
    """log10 of the density in kg/m3 over even steps of exospheric temperature and height, (T, H)."""

    temperatures_k: Array
    heights_km: Array
    log10_kg_m3: Array

    def log10_at(self, exospheric_k: Array, height_km: Array) -> Array:
        """Bilinear, of the shape of the arguments; beyond the table its edge holds."""
        t_step, h_step = self.temperatures_k[1] - self.temperatures_k[0], self.heights_km[1] - self.heights_km[0]
        x = np.clip((exospheric_k - self.temperatures_k[0]) / t_step, 0.0, self.temperatures_k.size - 1.000001)
        y = np.clip((height_km - self.heights_km[0]) / h_step, 0.0, self.heights_km.size - 1.000001)
        i, j = x.astype(int), y.astype(int)
        u, v = x - i, y - j
        table = self.log10_kg_m3
        value: Array = (1.0 - u) * ((1.0 - v) * table[i, j] + v * table[i, j + 1]) + u * (
            (1.0 - v) * table[i + 1, j] + v * table[i + 1, j + 1]
        )
        return value


@lru_cache(maxsize=1)
def density_table() -> DensityTable:
    """The static model, integrated once: barometric up to 100 km, diffusive above.  Source: J71 eqs 1 to 12."""
    temperatures = np.arange(COLDEST_K, HOTTEST_K + 1.0, 20.0)
    heights = np.arange(LOWEST_KM, HIGHEST_KM + 1.0, 10.0)
    z = np.concatenate([np.arange(_BASE_KM, 200.0, 0.25), np.arange(200.0, HIGHEST_KM + 1.0, 2.0)])
    t = np.array([_temperature_k(one, z) for one in temperatures])
    g_over_t = 9.80665 / (1.0 + z / 6356.766) ** 2 / t  # (T, Z)
    # from 90 to 100 km the air is mixed
    low = z <= _MIXED_KM
    mass = np.polynomial.polynomial.polyval(z[low] - _BASE_KM, _MOLAR_MASS)
    fall = _integral(mass * 1e-3 * g_over_t[:, low] / _GAS_J_MOL_K, z[low] * 1e3)[:, -1]
    at_mixed = np.argmax(z >= _MIXED_KM)
    rho = _BASE_KG_M3 * mass[-1] / mass[0] * _BASE_K / t[:, at_mixed] * np.exp(-fall)
    total = _AVOGADRO * rho / (mass[-1] * 1e-3)  # molecules in m3
    ratio = mass[-1] / _SEA_LEVEL_MASS
    parts = [(m, share * ratio * total, 0.0) for m, share in _FRACTIONS.values()]
    parts[2] = (*parts[2][:2], _HELIUM_THERMAL_DIFFUSION)
    parts += [(_O_MASS, 2.0 * total * (1.0 - ratio), 0.0)]
    parts += [(_O2_MASS, total * (ratio * (1.0 + _O2_FRACTION) - 1.0), 0.0)]
    above, t_above = z[at_mixed:], t[:, at_mixed:]
    per_mass = _integral(1e-3 * g_over_t[:, at_mixed:] / _GAS_J_MOL_K, above * 1e3)
    density = np.zeros_like(t_above)
    for mass_g, start, diffusion in parts:
        number = start[:, None] * (t_above[:, :1] / t_above) ** (1.0 + diffusion) * np.exp(-mass_g * per_mass)
        density += number * mass_g * 1e-3 / _AVOGADRO
    density += _hydrogen(temperatures, above, t_above, per_mass)
    rows = [np.interp(heights, above, np.log10(row)) for row in density]
    return DensityTable(temperatures, heights, np.array(rows))


def _temperature_k(exospheric_k: float, z: Array) -> Array:
    """J71 eqs 9 to 12."""
    inflexion_k = 371.6678 + 0.0518806 * exospheric_k - 294.3505 * np.exp(-0.00216222 * exospheric_k)
    rise = inflexion_k - _BASE_K
    slope = 1.90 * rise / (_INFLEXION_KM - _BASE_KM)
    x = (z - _INFLEXION_KM) / (_INFLEXION_KM - _BASE_KM)
    below = inflexion_k + rise * (1.90 * x - 1.7 * x**3 - 0.8 * x**4)
    a = 2.0 / np.pi * (exospheric_k - inflexion_k)
    over = np.maximum(z - _INFLEXION_KM, 0.0)
    above = inflexion_k + a * np.arctan(slope / a * over * (1.0 + 4.5e-6 * over**2.5))
    temperature: Array = np.where(z < _INFLEXION_KM, below, above)
    return temperature


def _hydrogen(exospheric_k: Array, z: Array, t: Array, per_mass: Array) -> Array:
    """kg/m3, from its number at 500 km on.  Source: J71 eq 8."""
    at = int(np.argmax(z >= _HYDROGEN_KM))
    log_t = np.log10(exospheric_k)
    start = 10.0 ** (73.13 - 39.40 * log_t + 5.5 * log_t**2) * 1e6
    number = start[:, None] * t[:, at : at + 1] / t * np.exp(-_H_MASS * (per_mass - per_mass[:, at : at + 1]))
    number[:, :at] = 0.0
    mass: Array = number * _H_MASS * 1e-3 / _AVOGADRO
    return mass


def _integral(values: Array, x: Array) -> Array:
    """Running integral by trapezoids along the last axis, from zero."""
    steps = 0.5 * (values[..., 1:] + values[..., :-1]) * np.diff(x)
    zero = np.zeros((*values.shape[:-1], 1))
    running: Array = np.concatenate([zero, np.cumsum(steps, axis=-1)], axis=-1)
    return running
