#!/usr/bin/env python3
"""What a pass leaves to the next one: real passes of one satellite, elements of the first one's time for both.

    .venv/bin/python scripts/figures_carry_over.py                 the table (under a minute)
    .venv/bin/python scripts/figures_carry_over.py --along-s 12    the same with elements that many seconds wrong
    .venv/bin/python scripts/figures_carry_over.py --vacuum        without air
    .venv/bin/python scripts/figures_carry_over.py --json FILE     the figures as JSON too

The first pass is read at 1 Hz with 0.03 deg noise and fitted by `full`; its fit, aged, begins the second pass, days
later and over another station, so that only the orbit's part is carried.  Both are seen in the simulator's air, the
refractivity of each drawn within +-10 % of what is told.  Angles on the sky between prediction and
truth, deg, medians over the runs: at AOS before any reading, worst over the pass without any reading, worst over the
rest after 30 s of lock.
"""

import argparse
import json
import sys
from dataclasses import asdict, dataclass, replace

import numpy as np
from real_pass import pass_names
from tables.air import seen_in_air, with_scale
from tables.outputs import output_file
from tables.seed_001 import sky_angles_deg
from tables.skies import Sky, readings_of, real_elements, real_sky
from tables.workers import run_script

from acu_daemon.assist.estimators.full.aged_prior import aged_prior, first_fit
from acu_daemon.assist.estimators.full.carry_over import CarryOver, carry_over_of, why_not
from acu_daemon.assist.estimators.full.estimated_states import ORBIT, STATE_COUNT
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.mount_model import encoder_look, sigma_deg
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.model import AngleBias, FitResult, Readings, Site
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.units import DAY_S, Array

NOISE_DEG = 0.03
LOCK_S = 30
SETTINGS = EstimatorSettings(NOISE_DEG, NOISE_DEG)


@dataclass(frozen=True)
class Row:
    """One pair of passes; angles in degrees."""

    first: str
    second: str
    elements_age_days: float  # at the first pass
    between_days: float
    first_aos_deg: float
    plain_aos_deg: float
    carried_aos_deg: float
    carried_sigma_deg: float  # what the daemon says at AOS, the other station's biases included
    orbit_sigma_deg: float  # the orbit's part of it
    plain_worst_deg: float
    carried_worst_deg: float
    plain_after_lock_deg: float
    carried_after_lock_deg: float


def source_of(name: str, along_s: float) -> Sgp4Propagator:
    """The element set an operator had at a pass, made wrong along the track."""
    along_rad = along_s * real_elements(name).elements.mean_motion_rad_s
    return real_elements(name, np.degrees(along_rad))


def errors_deg(source: Sgp4Propagator, real: Sky, fit: FitResult | None) -> Array:
    """Prediction against truth over a pass; without a fit the elements' own."""
    corrected = source if fit is None else source.corrected(fit.correction)
    seen = encoder_look(corrected, real.tai_s, real.site, fit)
    return sky_angles_deg(seen.az_deg, seen.el_deg, real.az_deg, real.el_deg)


def fitted(source: Sgp4Propagator, site: Site, readings: Readings, carried: CarryOver | None = None) -> FitResult:
    """The fit of `full`."""
    estimator = FullEstimator(source, site, with_scale(SETTINGS, site), carried)
    estimator.add(readings)
    fit = estimator.fit()
    if fit is None or estimator.notes:
        raise ValueError(f"{site.station.name}: no fit, or one without what was carried over: {estimator.notes}")
    return fit


def orbit_alone(fit: FitResult) -> FitResult:
    """The same, with the covariance of the orbit's six corrections only."""
    covariance = np.zeros((STATE_COUNT, STATE_COUNT))
    if fit.covariance is not None:
        covariance[ORBIT, ORBIT] = fit.covariance[ORBIT, ORBIT]
    return replace(fit, covariance=covariance)


def start_sigma_deg(source: Sgp4Propagator, second: Sky, fit: FitResult) -> float:
    """1 sigma of the prediction at AOS."""
    sigma = sigma_deg(source.corrected(fit.correction), second.tai_s[:2], second.site, fit)
    return float("nan") if sigma is None else float(sigma[0])


def one_run(source: Sgp4Propagator, first: Sky, second: Sky, seed: int) -> tuple[float, ...]:
    """The figures of the second pass with one noise: sigmas, then AOS, worst and after the lock, plain and carried."""
    rng = np.random.default_rng(seed)
    carried = carry_over_of(
        fitted(source, first.site, readings_of(first, AngleBias(), NOISE_DEG, rng)), source, first.site
    )
    aos_tai_s = float(second.tai_s[0])
    settings = with_scale(SETTINGS, second.site)
    if carried is None or why_not(carried, source, settings, aos_tai_s):
        raise ValueError(f"{first.name}: nothing to carry over")
    start = first_fit(carried, aged_prior(carried, source, second.site, settings, aos_tai_s))
    sigmas = [start_sigma_deg(source, second, one) for one in (start, orbit_alone(start))]
    all_readings = readings_of(second, AngleBias(), NOISE_DEG, rng)
    few = all_readings.part(slice(LOCK_S))
    figures = sigmas
    for known, given in ((None, None), (start, carried)):
        error = errors_deg(source, second, known)
        after = errors_deg(source, second, fitted(source, second.site, few, given))[LOCK_S:]
        figures += [float(error[0]), float(error.max()), float(after.max())]
    return tuple(figures)


def pairs() -> list[tuple[str, str, str]]:
    """Pairs of passes of one satellite, and the one whose element set serves both: of the first's time or before."""
    names = sorted(pass_names(), key=lambda name: name.rsplit("-", 1)[1])
    by_satellite: dict[str, list[str]] = {}
    for name in names:
        by_satellite.setdefault(name.rsplit("-", 2)[0], []).append(name)
    found = []
    for passes in by_satellite.values():
        for i, first in enumerate(passes):
            found += [(first, second, elements) for second in passes[i + 1 :] for elements in passes[: i + 1]]
    return found


def row_of(
    first_name: str, second_name: str, elements: str, along_s: float, run_count: int, has_air: bool = True
) -> Row:
    """Medians over the runs."""
    source, first, second = source_of(elements, along_s), real_sky(first_name), real_sky(second_name)
    if has_air:
        first, second = (seen_in_air(sky, sum(sky.name.encode())) for sky in (first, second))
    runs = np.median([one_run(source, first, second, seed) for seed in range(run_count)], axis=0).tolist()
    sigma, orbit_sigma, plain_aos, plain_worst, plain_after, carried_aos, carried_worst, carried_after = runs
    return Row(
        first=first_name,
        second=second_name,
        elements_age_days=float(first.tai_s[0] - source.epoch_tai_s) / DAY_S,
        between_days=float(second.tai_s[0] - first.tai_s[0]) / DAY_S,
        first_aos_deg=float(errors_deg(source, first, None)[0]),
        plain_aos_deg=plain_aos,
        carried_aos_deg=carried_aos,
        carried_sigma_deg=sigma,
        orbit_sigma_deg=orbit_sigma,
        plain_worst_deg=plain_worst,
        carried_worst_deg=carried_worst,
        plain_after_lock_deg=plain_after,
        carried_after_lock_deg=carried_after,
    )


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--along-s", type=float, default=0.0, help="seconds that the elements are made wrong")
    parser.add_argument("--runs", type=int, default=10, help="runs with other noise; default 10")
    parser.add_argument("--vacuum", action="store_true", help="without air")
    parser.add_argument("--json", type=output_file, help="write the figures here")
    chosen = parser.parse_args()
    if not pairs():
        sys.exit("no real passes: ../shared/data/passes is not there")
    print(f"{'':62}{'at AOS, no reading':^43}{'worst, no reading':^18}{'after 30 s':^18}")
    print(
        f"{'first pass, second pass':44}{'age d':>8}{'after d':>10}"
        f"{'1st':>8}{'2nd':>8}{'carried':>9}{'sigma':>9}{'orbit':>9}{'2nd':>9}{'carried':>9}{'2nd':>9}{'carried':>9}"
    )
    rows = []
    for first, second, elements in pairs():
        row = row_of(first, second, elements, chosen.along_s, chosen.runs, not chosen.vacuum)
        rows.append(row)
        label = f"{first.rsplit('-', 1)[0]}, {second.rsplit('-', 2)[1]}"
        print(
            f"{label:44}{row.elements_age_days:8.2f}{row.between_days:10.2f}{row.first_aos_deg:8.4f}"
            f"{row.plain_aos_deg:8.4f}{row.carried_aos_deg:9.4f}{row.carried_sigma_deg:9.4f}{row.orbit_sigma_deg:9.4f}"
            f"{row.plain_worst_deg:9.4f}{row.carried_worst_deg:9.4f}{row.plain_after_lock_deg:9.4f}"
            f"{row.carried_after_lock_deg:9.4f}",
            flush=True,
        )
    if chosen.json:
        chosen.json.write_text(json.dumps({"along_s": chosen.along_s, "rows": [asdict(row) for row in rows]}, indent=1))
    return 0


if __name__ == "__main__":
    run_script(main)
