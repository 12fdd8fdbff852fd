#!/usr/bin/env python3
"""Compare the refraction of the antenna model with an independent integrator and with closed formulas.

What it does
  1. Integrates rays through the same air by another method: the ray equation d/ds (n dr/ds) = grad n in Cartesian
     coordinates, by an adaptive Runge-Kutta of order 8, then straight on to a satellite at its distance.
  2. Prints, for apparent elevations at sea level and at 3 km, the refraction of acu_daemon.pointing.refraction and its
     difference from that, and beside it: the closed formula of ITU-R P.834, and the constants that ERFA's refco fits
     for radio waves, both for a source at infinity.
  3. With --other-air: how far the model is from air of another profile (the simulator's), 8 % denser or thinner than
     told, as it is and with the scale of the refraction fitted from a lowest elevation up.
  4. With --speed: microseconds for 1000 points and for one.

Takes 5 seconds.

Exit status: 0 all differences are within 0.002 deg below 5 deg of elevation and 0.0005 deg above; 1 one is not.

Examples
  scripts/refraction_figures.py                 the table of docs/antenna-model.md
  scripts/refraction_figures.py --other-air     what a wrong profile and wrong weather cost
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
from acu_daemon.sim.shell_air import simulated_air
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


OTHER_AIR = (
    (0.0, Air(1013.0, 15.0, 60.0)),
    (0.0, Air(1008.0, 30.0, 75.0)),
    (0.0, Air(1020.0, -10.0, 60.0)),
    (3000.0, Air(701.0, -3.0, 50.0)),
)


def print_other_air() -> None:
    """Differences from Hopfield's air: worst from an elevation up, unscaled and with the scale fitted."""
    print("\n  km   deg C  denser   from el  scale  worst unscaled   fitted  fitted above 10 deg")
    for height_m, air in OTHER_AIR:
        station = Station("figures", LATITUDE_DEG, 0.0, height_m)
        refraction, radius_m = traced(refractivity(air), station), curvature_radius_m(station)
        for denser in (0.92, 1.0, 1.08):
            other = simulated_air(air.pressure_hpa, air.temperature_c, air.humidity_percent, height_m, denser)
            for lowest_deg in (1.0, 3.0, 5.0):
                el_deg = np.linspace(lowest_deg, 80.0, 300)
                range_m = np.array([range_on_ray_m(el, height_m, radius_m) for el in el_deg])
                there = np.array([other.apparent_el_deg(*pair) for pair in zip(el_deg, range_m, strict=True)])
                ours, _, by_scale = refraction.apparent_with_slope(el_deg, range_m)
                scale = 1.0 + float(by_scale @ (there - ours) / (by_scale @ by_scale))
                left = np.abs(there - refraction.apparent_el_deg(el_deg, range_m, scale))
                print(
                    f"{height_m / 1e3:4.0f}  {air.temperature_c:6.0f}  {denser:6.2f}  {lowest_deg:8.0f}  {scale:5.3f}"
                    f"  {np.abs(there - ours).max():14.4f}  {left.max():7.4f}  {left[el_deg > 10.0].max():19.5f}"
                )


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
    parser.add_argument("--other-air", action="store_true", help="compare with the simulator's air as well")
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
    if options.other_air:
        print_other_air()
    if options.speed:
        print_speed()
    return 0 if is_within else 1


if __name__ == "__main__":
    sys.exit(main())
