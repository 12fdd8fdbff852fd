"""The figures of docs/groundtrack.md that no command of acu-daemon prints: model against brahe and NRLMSISE-00,
polynomials, navigators, and our controller over seeds.

    .venv/bin/python scripts/groundtrack_figures.py                    all, some ten minutes of one core
    .venv/bin/python scripts/groundtrack_figures.py --part navigator   one of them

It needs the extras `accuracy` (brahe) and `dev` (pymsis).
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import degrees

import numpy as np
from tables.console import say

from acu_daemon.edge.campaign import progress_bar, results_of, run_campaign
from acu_daemon.edge.flux_file import load_flux
from acu_daemon.edge.tesserals import Forces, integrate, ripple_of
from acu_daemon.groundtrack.atmosphere import Activity, density_table, exospheric_k, semi_annual
from acu_daemon.groundtrack.control_loop import BLOCK_STEPS
from acu_daemon.groundtrack.environment import EPOCH_TAI_S, Spacecraft, even_steps, free_motion, node_rad
from acu_daemon.groundtrack.gps import FIX_S, FIXES, NO_STEERING, GpsReceiver, Ripple, TrueOrbit, displaced
from acu_daemon.groundtrack.lunisolar import sun
from acu_daemon.groundtrack.mean_elements import MeanElements, mean_of, states_of
from acu_daemon.groundtrack.navigator import Navigator, NavigatorSetup, drift_of
from acu_daemon.groundtrack.paper_navigator import PaperNavigator, offsets_of
from acu_daemon.groundtrack.polynomials import fit_polynomials
from acu_daemon.groundtrack.simulate import Case, CaseOutcome, World, drag_less_lunisolar_m, make_world, simulate
from acu_daemon.orbit.timescales import gmst_rad
from acu_daemon.units import DAY_S, DEG, Array

CRAFT = Spacecraft()
NODE_RAD = node_rad(CRAFT, EPOCH_TAI_S)
INPE_A_M, INPE_I_DEG = 7_148_865.0, 98.504
SETTLED_DAYS = 10.0
BLOCK = BLOCK_STEPS * FIXES


def reference() -> None:
    """Orbit against INPE's, rates against brahe's zonals."""
    orbit = CRAFT.reference
    say(
        f"a {orbit.a_m:.1f} m ({orbit.a_m - INPE_A_M:+.1f} of INPE's), i {degrees(orbit.i_rad):.4f} deg "
        f"({degrees(orbit.i_rad) - INPE_I_DEG:+.4f}), dDdot/da {orbit.drift_m_day_per_m:.4f} m/day per m"
    )
    times_s = even_steps(0.0, 360.0, 5 * 240)
    for degree in (4, 6, 20):
        seen = [_by_brahe(Forces(degree, 0), delta_m, times_s) for delta_m in (0.0, 100.0)]
        slopes = [[np.polyfit(times_s, one, 1)[0] for one in (*pair, orbit.drift_m(*pair))] for pair in seen]
        per_m = (slopes[1][2] - slopes[0][2]) / 100.0 * DAY_S
        say(
            f"brahe, zonals to {degree}: node rate {slopes[0][0] / orbit.raan_rate_rad_s:+.1e} relative, "
            f"dDdot/da {per_m:.4f}"
        )


def year() -> None:
    """A year without drag against brahe 20 x 20 with Sun and Moon."""
    times_s = even_steps(0.0, 2400.0, 365 * 36)
    d_m = CRAFT.reference.drift_m(*_by_brahe(Forces(20, 20, True), 0.0, times_s))
    left = d_m - free_motion(CRAFT, 365.0, None, step_s=2400.0).d_m[: times_s.size]
    parabola = np.polyfit(times_s, left, 2)
    say(
        f"drag-free year: acceleration {2.0 * parabola[0] * DAY_S**2:+.4f} m/day2 off, residual "
        f"{np.std(left - np.polyval(parabola, times_s)):.1f} m rms"
    )


def density() -> None:
    """Jacchia 1971 against NRLMSISE-00 on the orbit, Kp 3 (ap 15), means over a revolution and a year."""
    import pymsis

    around = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    incl = CRAFT.reference.i_rad
    latitude = np.arcsin(np.sin(incl) * np.sin(around))
    hour = (CRAFT.node_hour - 12.0) * 15.0 * DEG + np.arctan2(np.cos(incl) * np.sin(around), np.cos(around))
    height_km = CRAFT.reference.a_m / 1e3 - 6378.137 + 21.385 * np.sin(latitude) ** 2
    for flux in (65.0, 80.0, 100.0, 130.0, 160.0, 200.0, 230.0, 260.0, 300.0):
        ours, theirs = [], []
        for day in range(0, 360, 30):
            tai_s = EPOCH_TAI_S + day * DAY_S
            x, y, z = sun(np.array([tai_s])).direction[0]
            exospheric = exospheric_k(
                Activity(np.array(flux), np.array(flux), np.array(3.0)), hour, latitude, np.arcsin(z)
            )
            swing = semi_annual(height_km, np.array(day / 365.2422))
            ours.append(np.mean(10.0 ** (density_table().log10_at(exospheric, height_km) + swing)))
            longitude = np.degrees(np.arctan2(y, x) + hour - gmst_rad(np.array([tai_s]), 0.0)[0])
            fluxes = np.full(around.size, flux)
            dates = np.full(around.size, np.datetime64("2010-01-01") + day)
            found = pymsis.calculate(
                dates, longitude, np.degrees(latitude), height_km, fluxes, fluxes, np.full((24, 7), 15.0), version=0
            )
            theirs.append(np.mean(found[..., 0]))
        say(
            f"F10.7 {flux:.0f}: {np.mean(ours):.3e} kg/m3, {100.0 * (np.mean(ours) / np.mean(theirs) - 1.0):+.0f} % "
            "of NRLMSISE-00's"
        )


def polynomials() -> None:
    """Largest relative error of polynomials of the acceleration and of its logarithm, every Kp."""
    for lowest in (65.0, 0.0):
        for is_logarithm in (False, True):
            errors = {
                degree: fit_polynomials(CRAFT, degree, is_logarithm=is_logarithm, lowest=lowest)[1]
                for degree in (3, 4, 8)
            }
            what = "logarithm" if is_logarithm else "acceleration"
            shown = ", ".join(f"degree {degree} {100.0 * error:.1f} %" for degree, error in errors.items())
            say(f"polynomial of the {what}, {lowest:g} to 300 sfu: {shown}")


def navigator(days: float = 6.0) -> None:
    """Raw fixes, the paper's navigator, ours: position in three dimensions, and D; the truth has tesserals to 20."""
    tables = {degree: _ripple(degree) for degree in (20, 12)}
    free = free_motion(CRAFT, days, load_flux("moderate"), has_semi_annual=True)
    orbit, receiver = TrueOrbit(free, NODE_RAD, tables[20]), GpsReceiver(days, np.random.default_rng(1))
    times_s = even_steps(FIX_S, FIX_S, int(days * DAY_S / FIX_S))
    r_m, v_m_s = orbit.states(times_s, NO_STEERING)
    fixes_m = r_m + receiver.errors_m(times_s)
    at = slice(FIXES - 1, None, FIXES)
    true_d_m = orbit.drift_m(times_s[at], NO_STEERING)
    known = NavigatorSetup(CRAFT.reference, NODE_RAD, tables[12])
    raw = np.hstack([fixes_m, v_m_s + receiver.velocity_errors_m_s(times_s)])[at]
    _say_navigator(
        "raw fixes", fixes_m[at] - r_m[at], drift_of(CRAFT.reference, offsets_of(known, times_s[at], raw)), true_d_m
    )
    for label, one in (
        ("paper's, J2", PaperNavigator(known)),
        ("paper's, J2, without the systematic error", PaperNavigator(known, has_bias=False)),
    ):
        started = time.process_time()
        estimates = one.observe(0.0, fixes_m)
        label += f" ({(time.process_time() - started) / days * 365.0:.0f} s of one core for a year)"
        _say_navigator(label, (one.states[:, :3] - r_m)[at], drift_of(CRAFT.reference, estimates), true_d_m)
    for label, setup in (("ours, table to 12 x 12", known), ("ours, no table", replace(known, ripple=None))):
        started = time.process_time()
        one_of_ours = Navigator(setup)
        estimates = np.vstack(
            [
                one_of_ours.observe(float(times_s[k] - FIX_S), fixes_m[k : k + BLOCK])
                for k in range(0, len(fixes_m), BLOCK)
            ]
        )
        label += f" ({(time.process_time() - started) / days * 365.0:.0f} s)"
        _say_navigator(
            label, _positions(setup, times_s[at], estimates) - r_m[at], drift_of(CRAFT.reference, estimates), true_d_m
        )


def ours(seeds: int, jobs: int | None) -> None:
    """Our controller, 2 % execution error, tesserals, our navigator; then with air 10 % off its model, and storms."""
    tables = (_ripple(20), _ripple(12))
    worlds = {name: make_world(load_flux(name), *tables) for name in ("moderate", "critical", "critical-physical")}
    for profile, band_m, sigma in (
        ("moderate", 3900.0, 0.0),
        ("critical", 3900.0, 0.0),
        ("moderate", 100.0, 0.0),
        ("critical", 100.0, 0.0),
        ("critical-physical", 3900.0, 0.0),
        ("moderate", 3900.0, 0.1),
        ("critical", 3900.0, 0.1),
    ):
        cases = [Case(profile, band_m, seed=seed + 1, density_sigma=sigma) for seed in range(seeds)]
        with progress_bar(f"{profile} {band_m:g}") as on_done:
            outcomes = results_of(run_campaign(partial(_simulate, worlds), cases, jobs=jobs, on_done=on_done))
        say(f"{profile} +-{band_m:g} m{', air 10 % off' if sigma else ''}: {_summary(outcomes)}")


def _simulate(worlds: dict[str, World], case: Case) -> CaseOutcome:
    return simulate(worlds[case.profile], case)


def _summary(outcomes: list[CaseOutcome]) -> str:
    counts = [len(one.flown.manoeuvres) for one in outcomes]
    late = [one.flown.d_m[one.flown.times_s > SETTLED_DAYS * DAY_S] for one in outcomes]
    balance = [float(one.flown.sizes_m.sum()) / drag_less_lunisolar_m(one.free) - 1.0 for one in outcomes]
    return (
        f"count {min(counts)} to {max(counts)} (bound {outcomes[0].bound_count:.1f}), D all year "
        f"{min(one.flown.d_m.min() for one in outcomes):.0f} to {max(one.flown.d_m.max() for one in outcomes):.0f} m, "
        f"after day 10 {min(one.min() for one in late):.0f} to {max(one.max() for one in late):.0f} m, sum against "
        f"drag less Sun and Moon {100.0 * min(balance):+.1f} to {100.0 * max(balance):+.1f} %"
    )


def _by_brahe(forces: Forces, delta_a_m: float, times_s: Array) -> tuple[Array, Array]:
    """Offsets of node and alpha from the reference orbit."""
    orbit = CRAFT.reference
    start = MeanElements(
        *(np.array([one]) for one in (orbit.a_m + delta_a_m, 0.0, orbit.e, orbit.i_rad, NODE_RAD, 0.0))
    )
    mean = mean_of(*integrate(forces, EPOCH_TAI_S, np.hstack(states_of(start))[0], times_s))
    node = np.unwrap(mean.raan_rad) - NODE_RAD - orbit.raan_rate_rad_s * times_s
    return node, np.unwrap(mean.alpha_rad - orbit.alpha_rate_rad_s * times_s)


def _ripple(degree: int) -> Ripple:
    return ripple_of(CRAFT.reference, EPOCH_TAI_S, NODE_RAD, degree)


def _positions(setup: NavigatorSetup, times_s: Array, estimates: Array) -> Array:
    orbit = setup.reference
    base = (orbit.a_m, 0.0, orbit.e, orbit.i_rad, NODE_RAD + orbit.raan_rate_rad_s * times_s)
    columns = [estimates[:, k] + one for k, one in enumerate((*base, orbit.alpha_rate_rad_s * times_s))]
    elements = MeanElements(*columns)
    r_m, _ = states_of(elements)
    return r_m if setup.ripple is None else r_m + displaced(elements, setup.ripple.at(times_s))


def _say_navigator(label: str, off_m: Array, d_m: Array, true_d_m: Array) -> None:
    settled = slice(d_m.size // 6, None)
    position = np.sqrt(np.mean(np.sum(off_m[settled] ** 2, axis=1)))
    say(
        f"{label}: {position:.1f} m in three dimensions, D {np.sqrt(np.mean((d_m - true_d_m)[settled] ** 2)):.1f} m rms"
    )


PARTS: dict[str, Callable[[], None]] = {
    "reference": reference,
    "year": year,
    "density": density,
    "polynomials": polynomials,
    "navigator": navigator,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", choices=[*PARTS, "ours"])
    parser.add_argument("--seeds", type=int, default=8, help="of our controller")
    parser.add_argument("--jobs", type=int)
    asked = parser.parse_args()
    for name in [asked.part] if asked.part else [*PARTS, "ours"]:
        say(f"== {name}")
        if name == "ours":
            ours(asked.seeds, asked.jobs)
        else:
            PARTS[name]()


if __name__ == "__main__":
    main()
