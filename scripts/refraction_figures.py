#!/usr/bin/env python3
"""Compare the refraction of the antenna model with an independent integrator and with closed formulas.

What it does
  1. Integrates rays through the same air by another method: the ray equation d/ds (n dr/ds) = grad n in Cartesian
     coordinates, by an adaptive Runge-Kutta of order 8, then straight on to a satellite at its distance.
  2. Prints, for apparent elevations at sea level and at 3 km, the refraction of acu_daemon.pointing.refraction and its
     difference from that, and beside it: the closed formula of ITU-R P.834, and the constants that ERFA's refco fits
     for radio waves, both for a source at infinity.
  3. With --speed: microseconds for 1000 points and for one.

Takes 5 seconds.

Exit status: 0 all differences are within 0.002 deg below 5 deg of elevation and 0.0005 deg above; 1 one is not.

Examples
  scripts/refraction_figures.py                 the table of docs/antenna-model.md
  scripts/refraction_figures.py --speed         and how long a call takes
"""

import argparse
import sys
import timeit
from collections.abc import Callable
from functools import partial

import erfa
import numpy as np
from scipy.integrate import solve_ivp

from acu_daemon.model import Station
from acu_daemon.pointing.air import Air, refractivity, standard_air
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.refraction import SCALE_HEIGHT_M, curvature_radius_m, traced
from acu_daemon.units import DEG

ELEVATIONS_DEG = (0.0, 1.0, 5.0, 10.0, 30.0)
HEIGHTS_M = (0.0, 3000.0)
SATELLITE_HEIGHT_M = 600e3
LATITUDE_DEG = 45.0
_AIR_TOP_M = 150e3


def asked_deg(el_deg: float) -> float:
    """Give the largest difference allowed at an apparent elevation."""
    return 0.002 if el_deg < 5.0 else 0.0005


def range_on_ray_m(el_deg: float, height_m: float, radius_m: float) -> float:
    """Distance of a satellite at SATELLITE_HEIGHT_M above sea level, seen at an elevation."""
    sine, up_m = np.sin(el_deg * DEG), SATELLITE_HEIGHT_M - height_m
    return float(np.sqrt((radius_m * sine) ** 2 + up_m * (2.0 * radius_m + up_m)) - radius_m * sine)


def integrated_geometric_el_deg(
    apparent_el_deg: float, range_m: float, profile_n: Callable[[float], float], radius_m: float
) -> float:
    """Follow a ray from the antenna through the air and on to a satellite; geometric elevation of that.

    profile_n: N-units at a height above the antenna (m); range_m from the antenna, or inf.
    """

    def rates(_: float, state: np.ndarray) -> list[float]:
        x_m, y_m, tx, ty = state
        r_m = np.hypot(x_m, y_m)
        n = 1.0 + 1e-6 * profile_n(r_m - radius_m)
        gradient = 1e-6 * (profile_n(r_m - radius_m + 1.0) - profile_n(r_m - radius_m - 1.0)) / 2.0
        return [tx / n, ty / n, gradient * x_m / r_m, gradient * y_m / r_m]

    def beyond_the_air(_: float, state: np.ndarray) -> float:
        return float(np.hypot(state[0], state[1]) - radius_m - _AIR_TOP_M)

    beyond_the_air.terminal = True  # type: ignore[attr-defined]
    n0, e = 1.0 + 1e-6 * profile_n(0.0), apparent_el_deg * DEG
    start = [0.0, radius_m, n0 * np.cos(e), n0 * np.sin(e)]
    run = solve_ivp(rates, (0.0, 5e6), start, "DOP853", events=beyond_the_air, rtol=1e-12, atol=1e-9, max_step=2e4)
    x_m, y_m, tx, ty = run.y[:, -1]
    if np.isinf(range_m):
        return float(np.arctan2(ty, tx) / DEG)
    size = np.hypot(tx, ty)
    up_m, along = y_m - radius_m, (x_m * tx + (y_m - radius_m) * ty) / size
    further_m = -along + np.sqrt(along * along + range_m * range_m - x_m * x_m - up_m * up_m)
    return float(np.arctan2(up_m + further_m * ty / size, x_m + further_m * tx / size) / DEG)


def p834_deg(apparent_el_deg: float, height_m: float) -> float:
    """Refraction by ITU-R P.834, its formula for apparent elevations in the reference atmosphere of N 315."""
    h, e = height_m / 1e3, apparent_el_deg
    across = 1.314 + 0.6437 * e + 0.02869 * e * e + h * (0.2305 + 0.09428 * e + 0.01096 * e * e) + 0.008583 * h * h
    return 1.0 / across


def erfa_deg(apparent_el_deg: float, air: Air) -> float:
    """Refraction A tan z + B tan^3 z with ERFA's constants for radio waves; no use near the horizon."""
    a, b = erfa.refco(air.pressure_hpa, air.temperature_c, air.humidity_percent / 100.0, 1e5)
    tangent = 1.0 / np.tan(apparent_el_deg * DEG)
    return float((a * tangent + b * tangent**3) / DEG)


def print_speed() -> None:
    """Microseconds of a call, the least of seven runs."""
    refraction = traced(320.0, Station("bench", LATITUDE_DEG, 0.0, 0.0))
    model = AntennaModel(Mount(0.1, 0.05, 0.03, 0.02, 0.01, -0.02, 0.03), refraction)
    for count in (1000, 1):
        el_deg, range_m = np.linspace(2.0, 90.0, count), np.full(count, 1e6)
        ways = [partial(way, el_deg, range_m) for way in (refraction.apparent_el_deg, refraction.geometric_el_deg)]
        whole = (model.encoders_deg, model.geometric_deg, model.with_partials)
        ways += [partial(way, 2.0 * el_deg, el_deg, range_m) for way in whole]
        for way in ways:
            least_s = min(timeit.repeat(way, number=20, repeat=7)) / 20
            print(f"{way.func.__qualname__:>28} of {count:4d}: {1e6 * least_s:7.1f} us")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--speed", action="store_true", help="time the calls as well")
    options = parser.parse_args(arguments)
    is_within = True
    print("  km      N  apparent  refraction  less integrated  inf less sat  P.834 N315 less ours  ERFA less ours, deg")
    for height_m in HEIGHTS_M:
        station = Station("figures", LATITUDE_DEG, 0.0, height_m)
        air = standard_air(station)
        surface_n, radius_m = refractivity(air), curvature_radius_m(station)
        refraction = traced(surface_n, station)
        in_p834 = traced(315.0 * np.exp(-height_m / SCALE_HEIGHT_M), station)
        for el_deg in ELEVATIONS_DEG:
            range_m = range_on_ray_m(el_deg, height_m, radius_m)
            ours_deg = el_deg - float(refraction.geometric_el_deg(el_deg, range_m))
            far_deg = el_deg - float(refraction.geometric_el_deg(el_deg, np.inf))
            theirs_deg = el_deg - integrated_geometric_el_deg(
                el_deg, range_m, lambda up_m, n=surface_n: n * np.exp(-up_m / SCALE_HEIGHT_M), radius_m
            )
            is_within &= abs(ours_deg - theirs_deg) <= asked_deg(el_deg)
            p834 = p834_deg(el_deg, height_m) - (el_deg - float(in_p834.geometric_el_deg(el_deg, np.inf)))
            by_erfa = f"{erfa_deg(el_deg, air) - far_deg:+.4f}" if el_deg >= 5.0 else "-"
            print(
                f"{height_m / 1e3:4.0f}  {surface_n:5.1f}  {el_deg:8.0f}  {ours_deg:10.4f}"
                f"  {ours_deg - theirs_deg:+15.1e}  {far_deg - ours_deg:12.4f}  {p834:+20.4f}  {by_erfa:>14}"
            )
    if options.speed:
        print_speed()
    return 0 if is_within else 1


if __name__ == "__main__":
    sys.exit(main())
