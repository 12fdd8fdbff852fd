#!/usr/bin/env python3
"""What the memory of the mount is worth: predictions after short locks, by how many passes the station remembers.

    .venv/bin/python scripts/memory_figures.py              listed orbits, no drift (100 stations: 15 minutes a core)
    .venv/bin/python scripts/memory_figures.py --drift      a day-night drift of 0.02 deg and 0.005 deg per root day
    .venv/bin/python scripts/memory_figures.py --correlated noise that is correlated over 3 s
    .venv/bin/python scripts/memory_figures.py --square     a mount that is square: IA, IE and the air only
    .venv/bin/python scripts/memory_figures.py --assumed    elements as wrong as their a-priori sigmas say: the ellipses
    .venv/bin/python scripts/memory_figures.py --assumed-correlated
    .venv/bin/python scripts/memory_figures.py --rezeroed   an encoder re-zeroed by 0.1 and 0.2 deg after ten passes
    .venv/bin/python scripts/memory_figures.py --real       the real passes, five listed ones remembered
    .venv/bin/python scripts/memory_figures.py --seed-001   losses after 10 s of lock, five listed passes remembered
    .venv/bin/python scripts/memory_figures.py --stations 20 --first 0   fewer stations, from this number on

Every station has a pedestal (IA, IE 0.1 deg, the other terms 0.02, 1 sigma) and air of its own, the simulator's, not
the product's; it is read at 1 Hz with 0.03 deg noise.  Worst angle of the rest of a pass after 10 s and 60 s of lock
and after half of it, deg, medians; beside them those of a fit that knows the mount's terms exactly.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from real_pass import pass_names, truth_path
from tables.console import progress, say
from tables.landsat import LandsatPass, landsat_passes
from tables.listed_passes import as_assumed
from tables.outputs import output_file
from tables.pedestals import Drift, Seen, passes_of, rezeroed_by, settings_of, shown_by, with_noise
from tables.seed_001 import FULL_10_S, LIMIT_DEG, sky_angles_deg
from tables.skies import real_elements, real_sky
from tables.trials import distance2
from tables.workers import run_script

from acu_daemon.assist.estimators.full.full_estimator import TRUSTED_AGAIN, FullEstimator
from acu_daemon.assist.estimators.full.pedestal_prior import PEDESTAL_TERMS, RF, PedestalPrior
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, first_memory, prior_of
from acu_daemon.assist.mount_memory.update import Updated, updated
from acu_daemon.assist.mount_memory.whole_pass import estimate_pass
from acu_daemon.assist.mount_model import encoder_look, sky_covariance
from acu_daemon.edge.campaign import results_of, run_campaign
from acu_daemon.model import FitResult, Station
from acu_daemon.orbit.brouwer import BrouwerPropagator
from acu_daemon.orbit.look import look_at
from acu_daemon.sim.sky import read_truth
from acu_daemon.units import DAY_S, DEG, wrap_180_array

COUNTS = (0, 1, 2, 5, 10, 20)
LOCKS_S = (10, 60)
DRIFT = Drift(0.02, 0.005)
CORRELATED_S = 3.0
REMEMBERED = 10  # passes before an encoder is re-zeroed
AFTER = 4  # passes that follow
LOOK_S = 10
STEP_S = 0.3 * DAY_S  # from the last pass remembered to one of another year
CASES: dict[str, dict[str, object]] = {
    "no drift": {},
    "drift": {"drift": DRIFT},
    "correlated": {"correlation_s": CORRELATED_S},
    "square": {"square_to_deg": 0.0},
    "assumed": {"wrong": as_assumed},
    "assumed-correlated": {"wrong": as_assumed, "correlation_s": CORRELATED_S},
}


@dataclass(frozen=True, slots=True)
class Trial:
    """Of one pass: worst angles by lock, with the memory and with the terms known; how often in the 2-sigma ellipse."""

    count: int
    memory_deg: dict[str, float]
    known_deg: dict[str, float]
    inside: dict[str, float]
    terms_off_deg: list[float]  # of PEDESTAL_TERMS
    has_mount: bool
    note: str
    is_alarm: bool  # in the pass, or after it


def fit_of(seen: Seen, used: int, prior: PedestalPrior | None) -> tuple[FitResult, FullEstimator]:
    """Fit the first readings of a pass."""
    estimator = FullEstimator(seen.source, seen.site, settings_of(seen.site), may_widen=True, pedestal=prior)
    estimator.add(seen.readings.part(slice(used)))
    fit = estimator.fit()
    if fit is None:
        raise ValueError(f"no fit from {used} readings")
    return fit, estimator


def judged(seen: Seen, used: int, prior: PedestalPrior | None) -> tuple[float, float, bool]:
    """Worst angle of the rest, share of it inside the 2-sigma ellipses, whether a re-zeroed encoder was suspected."""
    fit, estimator = fit_of(seen, used, prior)
    rest = seen.shown.part(slice(used, None))
    corrected = seen.source.corrected(fit.correction)
    shown = encoder_look(corrected, rest.tai_s, seen.site, fit)
    worst_deg = float(sky_angles_deg(shown.az_deg, shown.el_deg, rest.az_deg, rest.el_deg).max())
    across = wrap_180_array(shown.az_deg - rest.az_deg) * np.cos(np.radians(rest.el_deg)) * DEG
    covariance = sky_covariance(corrected, rest.tai_s, seen.site, fit)
    inside = float(np.mean(distance2(across, (shown.el_deg - rest.el_deg) * DEG, *covariance) < 4.0))
    return worst_deg, inside, bool(estimator.pedestal_notes)


def known(seen: Seen) -> PedestalPrior:
    """The mount's terms as they are, the air as it is told."""
    mean = np.radians([getattr(seen.axes, f"{name.lower()}_deg", 0.0) for name in PEDESTAL_TERMS])
    covariance = np.zeros((len(mean), len(mean)))
    covariance[RF, RF] = (settings_of(seen.site).bias_sigma_elevation_cot_deg * DEG) ** 2
    return PedestalPrior(mean, covariance)


def remembered(seen: Seen, memory: PedestalMemory) -> Updated:
    """The memory after a pass that was read whole."""
    settings = settings_of(seen.site)
    whole = FullEstimator(seen.source, seen.site, settings)
    whole.add(seen.readings)
    sights = whole.seen
    estimate = None if sights is None else estimate_pass(seen.source, seen.site, settings, memory, sights)
    return Updated(memory, "too short") if estimate is None else updated(memory, estimate, settings)


def station(case: str, counts: tuple[int, ...], seed: int) -> list[Trial]:
    """Passes of a station, each tried with what the station remembers then, after so many."""
    memory, trials = None, []
    for count, seen in enumerate(passes_of(seed, max(counts) + 1, **CASES[case])):  # type: ignore[arg-type]
        start_tai_s = float(seen.readings.tai_s[0])
        memory = memory or first_memory(settings_of(seen.site), start_tai_s)
        prior = prior_of(memory, settings_of(seen.site), start_tai_s)
        is_tried = count in counts
        locks = {**{f"{one} s": one for one in LOCKS_S}, "half": len(seen.readings) // 2} if is_tried else {}
        ours = {name: judged(seen, used, prior) for name, used in locks.items()}
        sure = {name: judged(seen, used, known(seen))[0] for name, used in locks.items()}
        after = remembered(seen, memory)
        memory = after.memory
        truth = np.array([getattr(seen.axes, f"{name.lower()}_deg", 0.0) for name in PEDESTAL_TERMS])
        trials.append(
            Trial(
                count,
                {name: one[0] for name, one in ours.items()},
                sure,
                {name: one[1] for name, one in ours.items()},
                (memory.chosen.at(start_tai_s).mean / DEG - truth).tolist(),
                memory.has_mount,
                after.why_not or after.note,
                after.shift_deg is not None or any(one[2] for one in ours.values()),
            )
        )
    return trials


def rezeroed(by_deg: float, axis: str, seed: int) -> dict[str, float]:
    """An encoder is re-zeroed after ten passes: when the pass finds it, and how good the passes after it are."""
    memory, found_s, worst = None, np.inf, []
    passes_before_reset = np.inf
    for count, seen in enumerate(rezeroed_by(seed, REMEMBERED, AFTER, by_deg, axis)):
        settings, start_tai_s = settings_of(seen.site), float(seen.readings.tai_s[0])
        memory = memory or first_memory(settings, start_tai_s)
        prior = prior_of(memory, settings, start_tai_s)
        if count == REMEMBERED:
            estimator = FullEstimator(seen.source, seen.site, settings, may_widen=True, pedestal=prior)
            for begin in range(0, len(seen.readings), LOOK_S):
                estimator.add(seen.readings.part(slice(begin, begin + LOOK_S)))
                estimator.fit()
                if estimator.pedestal_notes and estimator.pedestal_notes[-1] != TRUSTED_AGAIN:
                    found_s = begin + LOOK_S
                    break
        if count > REMEMBERED:
            worst.append((judged(seen, 60, prior)[0], judged(seen, 60, known(seen))[0]))
        after = remembered(seen, memory)
        memory = after.memory
        if after.shift_deg is not None and count >= REMEMBERED:
            passes_before_reset = min(passes_before_reset, count - REMEMBERED + 1)
    return {
        "found_s": float(found_s),
        "reset_after_passes": float(passes_before_reset),
        "next_deg": worst[0][0],
        "next_known_deg": worst[0][1],
        "last_deg": worst[-1][0],
        "last_known_deg": worst[-1][1],
    }


def real(seed: int, name: str) -> dict[str, float]:
    """A real pass after five listed ones over the same station: worst angles with the memory, and known."""
    sky, elements = real_sky(name), real_elements(name)
    truth = read_truth(truth_path(name))
    range_m = np.array([(truth.direction(float(t)) or (0.0, 0.0, 1e6))[2] for t in sky.tai_s])
    memory, last = _five(seed, sky.site.station)
    shown, _ = shown_by(last.axes, last.air, sky.tai_s, sky.az_deg, sky.el_deg, range_m)
    site = replace(last.site, orientation=sky.site.orientation)
    rng = np.random.default_rng([seed, sum(name.encode())])
    seen = Seen(elements, site, last.axes, last.air, shown, with_noise(shown, rng))
    start_tai_s = float(sky.tai_s[0])
    memory = replace(memory, at_tai_s=start_tai_s - STEP_S)
    prior = prior_of(memory, settings_of(site), start_tai_s)
    found = {}
    for label, used in {**{f"{one} s": one for one in LOCKS_S}, "half": sky.tai_s.size // 2}.items():
        found[label], found[f"{label} known"] = (judged(seen, used, one)[0] for one in (prior, known(seen)))
        found[f"{label} none"] = judged(seen, used, None)[0]
    return found


def _five(seed: int, station: Station | None = None, *, has_air: bool = True) -> tuple[PedestalMemory, Seen]:
    """What a station remembers after five passes, and the last of them."""
    memory = None
    for seen in passes_of(seed, 5, station=station, has_air=has_air):
        memory = memory or first_memory(settings_of(seen.site), float(seen.readings.tai_s[0]))
        memory = remembered(seen, memory).memory
    if memory is None:
        raise ValueError("no passes")
    return memory, seen


def lost(seed: int, a_pass: LandsatPass) -> tuple[int, int, int]:
    """Aguirre and Medeiros 1988, 2.4, after five passes: losses each 30 s after 10 s of lock; beyond 0.1 deg later.

    Returns: losses; those after which the error exceeds 0.1 deg, with the memory, and without.
    """
    memory, last = _five(seed, a_pass.site.station, has_air=False)
    experiment = replace(FULL_10_S, settings=replace(FULL_10_S.settings, max_fit_elevation_deg=90.0))
    source = BrouwerPropagator(a_pass.mean)
    start_tai_s = float(a_pass.tai_s[0])
    prior = prior_of(replace(memory, at_tai_s=start_tai_s - STEP_S), experiment.settings, start_tai_s)
    truth, _ = shown_by(last.axes, None, a_pass.tai_s, a_pass.az_deg, a_pass.el_deg, np.full(a_pass.tai_s.size, 1e6))
    rng = np.random.default_rng([seed, 1])
    counts = [0, 0, 0]
    for k in range(10, a_pass.tai_s.size - 1, 30):
        tai_s = float(a_pass.tai_s[k]) - np.arange(100, 0, -1) / 10.0
        seen = look_at(a_pass.orbit, tai_s, a_pass.site)
        shown, _ = shown_by(last.axes, None, tai_s, seen.az_deg, seen.el_deg, seen.range_m)
        readings = with_noise(shown, rng, noise_deg=experiment.noise_deg)
        counts[0] += 1
        for which, one in enumerate((prior, None), start=1):
            estimator = FullEstimator(source, a_pass.site, experiment.settings, may_widen=True, pedestal=one)
            estimator.add(readings)
            fit = estimator.fit()
            corrected = source if fit is None else source.corrected(fit.correction)
            after = encoder_look(corrected, a_pass.tai_s[k:], a_pass.site, fit)
            off_deg = sky_angles_deg(after.az_deg, after.el_deg, truth.az_deg[k:], truth.el_deg[k:])
            counts[which] += bool((off_deg > LIMIT_DEG).any())
    return counts[0], counts[1], counts[2]


def table(trials: list[list[Trial]]) -> Iterator[str]:
    """The figures of a case."""
    yield "| N | 10 s | known | ratio | 60 s | known | ratio | half | known | in 2 sigma, 10 s, 60 s, half | mount |"
    yield "|---" * 11 + "|"
    for count in sorted({one.count for some in trials for one in some if one.memory_deg}):
        of = [one for some in trials for one in some if one.count == count and one.memory_deg]
        cells = [f"| {count}"]
        for name in ("10 s", "60 s", "half"):
            ours, sure = (np.median([getattr(one, kind)[name] for one in of]) for kind in ("memory_deg", "known_deg"))
            cells += [f"{ours:.4f}", f"{sure:.4f}"] + ([] if name == "half" else [f"{ours / sure:.2f}"])
        cells.append(" / ".join(f"{np.mean([one.inside[name] for one in of]):.0%}" for name in of[0].inside))
        yield " | ".join([*cells, f"{np.mean([one.has_mount for one in of]):.0%} |"])
    last = [some[-1] for some in trials]
    off = np.sqrt(np.mean(np.square([one.terms_off_deg for one in last]), axis=0))
    yield f"\nterms after {last[0].count + 1} passes, rms deg: " + ", ".join(
        f"{name} {one:.4f}" for name, one in zip(PEDESTAL_TERMS, off, strict=True)
    )
    every = [one for some in trials for one in some]
    left = [one.note for one in every if one.note]
    yield f"{len(every)} passes of {len(trials)} stations; alarms {sum(one.is_alarm for one in every)}"
    for text in sorted({"".join(c for c in one if not c.isdigit()) for one in left}):
        yield f"  {sum(text == ''.join(c for c in one if not c.isdigit()) for one in left)} x {text}"


def main() -> int:
    """Print the figures that were asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stations", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first station")
    parser.add_argument("--passes", type=int, default=max(COUNTS), help="passes remembered at most")
    for name in (*CASES, "rezeroed", "real", "seed-001"):
        if name != "no drift":
            parser.add_argument(f"--{name}", action="store_true")
    parser.add_argument("--json", type=output_file, metavar="FILE", help="write every trial here")
    parser.add_argument("--jobs", type=int, default=None)
    asked = parser.parse_args()
    seeds = list(range(asked.first, asked.first + asked.stations))
    run = partial(run_campaign, jobs=asked.jobs, on_done=progress)
    if asked.rezeroed:
        for by_deg in (0.2, 0.1):
            for axis in ("ie_deg", "ia_deg"):
                found = results_of(run(partial(rezeroed, by_deg, axis), seeds))
                say(f"{axis} by {by_deg:g}: " + told(found))
        return 0
    if asked.real:
        jobs = [(seed, name) for seed in seeds for name in pass_names()]
        some = results_of(run(_real, jobs))
        for label in some[0]:
            values = [one[label] for one in some]
            say(f"real, {label}: {np.median(values):.4f}, 95 % {np.quantile(values, 0.95):.4f} ({len(values)} passes)")
        return 0
    if asked.seed_001:
        landsat = landsat_passes((0.0, 180.0), (85.0, 60.0, 30.0))
        losses = np.sum(results_of(run(_lost, [(seed, one) for seed in seeds for one in landsat])), axis=0)
        ours, without = losses[1:] / losses[0]
        say(f"{losses[0]} losses: beyond {LIMIT_DEG} deg {ours:.2%}, without a memory {without:.1%}")
        return 0
    case = next((name for name in CASES if name != "no drift" and getattr(asked, name.replace("-", "_"))), "no drift")
    counts = tuple(one for one in COUNTS if one <= asked.passes)
    trials = results_of(run(partial(station, case, counts), seeds))
    say(f"{case}\n" + "\n".join(table(trials)))
    if asked.json:
        asked.json.write_text(json.dumps([[vars_of(one) for one in some] for some in trials]) + "\n")
    return 0


def _real(job: tuple[int, str]) -> dict[str, float]:
    return real(*job)


def _lost(job: tuple[int, LandsatPass]) -> tuple[int, int, int]:
    return lost(*job)


def told(found: list[dict[str, float]]) -> str:
    """When it was found, and how good the next passes were, medians."""
    found_s, reset = (np.array([one[name] for one in found]) for name in ("found_s", "reset_after_passes"))
    parts = [f"{np.mean(found_s <= limit):.0%} by {limit} s" for limit in (60, 120, 180)]
    parts.append(f"{np.mean(np.isfinite(found_s)):.0%} in the pass")
    parts += [f"{np.mean(reset <= n):.0%} re-zeroed after {n} passes" for n in (1, 2, 3)]
    for name in ("next", "last"):
        ours, sure = (np.median([one[f"{name}{kind}"] for one in found]) for kind in ("_deg", "_known_deg"))
        parts.append(f"{name} pass after it {ours:.3f} (known {sure:.3f})")
    return ", ".join(parts) + f" ({len(found)} stations)"


def vars_of(one: Trial) -> dict[str, object]:
    return {name: getattr(one, name) for name in Trial.__dataclass_fields__}


if __name__ == "__main__":
    run_script(main)
