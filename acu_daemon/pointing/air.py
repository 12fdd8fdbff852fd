"""The air at the antenna and its refractivity at radio frequencies.  Pure.

Refractivity N = (n - 1) 1e6 of moist air does not depend on the frequency up to 100 GHz.  Sources: Recommendations
ITU-R P.453 (refractivity, vapour pressure) and P.835 (reference atmospheres by latitude and season).
"""

from dataclasses import dataclass
from math import exp
from typing import NamedTuple

from acu_daemon.model import Station

ZERO_CELSIUS_K = 273.15
_VAPOUR_HPA_M3_PER_G_K = 1.0 / 216.7  # e = rho T / 216.7, P.835


class _Season(NamedTuple):
    """By rising powers of the height in km, to 8.5 km; the vapour density is vapour_g_m3 exp(exponent)."""

    temperature_k: tuple[float, ...]
    pressure_hpa: tuple[float, ...]
    vapour_g_m3: float
    exponent: tuple[float, ...]


# P.835: tropics; mid-latitudes and subarctic, summer and winter; at the latitudes of the profiles they were fitted to
_TROPICS = _Season(
    (300.4222, -6.3533, 0.005886), (1012.0306, -109.0338, 3.6316), 19.6542, (0.0, -0.2313, -0.1122, 0.01351, -0.0005923)
)
_SEASONS = {
    15.0: (_TROPICS, _TROPICS),
    45.0: (
        _Season(
            (294.9838, -5.2159, -0.07109), (1012.8186, -111.5569, 3.8646), 14.3542, (0.0, -0.4174, -0.0229, 0.001007)
        ),
        _Season(
            (272.7241, -3.6217, -0.1759), (1018.8627, -124.2954, 4.8307), 3.4742, (0.0, -0.2697, -0.03604, 0.0004489)
        ),
    ),
    60.0: (
        _Season(
            (286.8374, -4.7805, -0.1402), (1008.0278, -113.2494, 3.9408), 8.988, (0.0, -0.3614, -0.005402, -0.001955)
        ),
        _Season(
            (257.4345, 2.3474, -1.5479, 0.08473),
            (1010.8828, -122.2411, 4.554),
            1.2319,
            (0.0, 0.07481, -0.0981, 0.00281),
        ),
    ),
}


@dataclass(frozen=True, slots=True)
class Air:
    """Weather at the antenna: total pressure at its height (not reduced to sea level), relative humidity over water."""

    pressure_hpa: float
    temperature_c: float
    humidity_percent: float


def refractivity(air: Air) -> float:
    """Give N of the air, in N-units: 77.6 P/T - 5.6 e/T + 3.75e5 e/T^2.  Source: P.453, with its vapour pressure e."""
    temperature_k = air.temperature_c + ZERO_CELSIUS_K
    vapour_hpa = air.humidity_percent / 100.0 * saturation_hpa(air)
    return (77.6 * air.pressure_hpa - 5.6 * vapour_hpa + 3.75e5 * vapour_hpa / temperature_k) / temperature_k


def saturation_hpa(air: Air) -> float:
    """Vapour pressure of saturated air over water, -40 to +50 deg C.  Source: P.453, its function e_s."""
    t_c = air.temperature_c
    enhancement = 1.0 + 1e-4 * (7.2 + air.pressure_hpa * (0.0320 + 5.9e-6 * t_c * t_c))
    return enhancement * 6.1121 * exp((18.678 - t_c / 234.5) * t_c / (t_c + 257.14))


def standard_air(station: Station) -> Air:
    """Give the year's mean air at a station's latitude and height, for one whose weather is not known.

    The mean of P.835's summer and winter, linear in latitude between 15, 45 and 60 deg, so that it has no steps.
    """
    height_km = station.height_m / 1e3
    means = {latitude_deg: _year_mean(seasons, height_km) for latitude_deg, seasons in _SEASONS.items()}
    latitude_deg = min(max(abs(station.latitude_deg), 15.0), 60.0)
    low, high = (15.0, 45.0) if latitude_deg < 45.0 else (45.0, 60.0)
    part = (latitude_deg - low) / (high - low)
    pressure_hpa, temperature_k, vapour_hpa = (
        (1.0 - part) * a + part * b for a, b in zip(means[low], means[high], strict=True)
    )
    dry = Air(pressure_hpa, temperature_k - ZERO_CELSIUS_K, 0.0)
    humidity_percent = min(100.0 * vapour_hpa / saturation_hpa(dry), 100.0)
    return Air(pressure_hpa, dry.temperature_c, humidity_percent)


def _year_mean(seasons: tuple[_Season, _Season], height_km: float) -> tuple[float, float, float]:
    """Pressure (hPa), temperature (K) and vapour pressure (hPa), mean of the seasons."""
    pressure_hpa = temperature_k = vapour_hpa = 0.0
    for season in seasons:
        season_k = _polynomial(season.temperature_k, height_km)
        density_g_m3 = season.vapour_g_m3 * exp(_polynomial(season.exponent, height_km))
        pressure_hpa += _polynomial(season.pressure_hpa, height_km) / 2.0
        temperature_k += season_k / 2.0
        vapour_hpa += density_g_m3 * season_k * _VAPOUR_HPA_M3_PER_G_K / 2.0
    return pressure_hpa, temperature_k, vapour_hpa


def _polynomial(coefficients: tuple[float, ...], x: float) -> float:
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value
