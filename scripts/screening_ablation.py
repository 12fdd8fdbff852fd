#!/usr/bin/env python3
"""What each check of the screening is worth: bad minutes, first locks and good readings, with one check off at a time.

    .venv/bin/python scripts/screening_ablation.py                   the table (an hour of one core)
    .venv/bin/python scripts/screening_ablation.py --check strain    the checks with that word in their name
    .venv/bin/python scripts/screening_ablation.py --case hunting    the cases with that word in their name
    .venv/bin/python scripts/screening_ablation.py --place 2 3 4 5   other passes, real and made

Bad minutes are those of gate_figures.py.  First locks are a minute of something else before 20 s of the satellite;
short locks are 8 and 15 s of the satellite before a bad minute.  Good readings are the satellite's own all the time:
elements that are off, noise that grows or goes on for seconds, a loss with encoders that are off.  Passes are real, and
made from an element set as wrong as good ones are, all in the simulator's air.  Change: the largest angle between the
prediction of the next 300 s and that from the good readings alone.  Seen: bad minutes in which a reason is said for
four fifths of the time from 5 s on.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any
from unittest.mock import patch

import numpy as np
from gate_figures import (
    AFTER_S,
    AHEAD_S,
    AZIMUTH,
    BAD_S,
    BEGIN_S,
    KINDS,
    LOBE_DB,
    LOCK_S,
    NOISE_DEG,
    PASSES,
    Kind,
    Place,
    apart_deg,
    drift,
    locks,
    minutes,
    settings_of,
    steady,
)
from tables.air import DRAWN, told_air
from tables.console import say
from tables.listed_passes import accurate, listed_passes
from tables.workers import run_script

from acu_daemon.assist import screening_limits as limits
from acu_daemon.assist.estimators.full.full_estimator import FullEstimator
from acu_daemon.assist.screening import orbit_test, track_gate
from acu_daemon.assist.screening.offsets import Offsets
from acu_daemon.assist.screening.orbit_test import OrbitTest
from acu_daemon.assist.screening.track_gate import TrackGate
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup, Refitter
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge.campaign import results_of, run_campaign
from acu_daemon.model import Correction, FitResult, Readings
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.air import standard_air
from acu_daemon.sim.apparent_sky import ApparentSky, make_air
from acu_daemon.sim.sky import DirectionTable
from acu_daemon.units import DEG, Array

ASKED_DEG = 0.05
REASON_FROM_S, REASON_SHARE = 5.0, 0.8
LONG_S = 500.0
ALL_ON, HIGHEST, DWELL = "(all on)", "highest elevation", "dwell"

GROUPS = ("bad minute", "first lock", "short lock", "good")

Off = Callable[[], list[AbstractContextManager[Any]]]


def set_to(where: object, **values: object) -> Off:
    """Switches a check off by other values of a module or class."""
    return lambda: [patch.object(where, name, value) for name, value in values.items()]


def _all_near(*given: Any) -> Offsets:
    seen = orbit_test.offsets(*given)
    return replace(seen, near_deg=np.full(seen.tai_s.size, np.inf))


def _all_low(*given: Any) -> Array:
    tai_s: Array = given[3]
    return np.ones(tai_s.size, dtype=np.bool_)


_verdict = OrbitTest.verdict


def _none_with_kept(test: OrbitTest, before: Readings | None, asked: Readings) -> Offsets | None:
    return None if before is not None else _verdict(test, before, asked)


def _any_first(test: OrbitTest, before: Readings | None, asked: Readings) -> Offsets | None:
    if before is not None:
        return _verdict(test, before, asked)
    return Offsets(asked.tai_s, np.zeros(len(asked)), np.zeros(len(asked)), np.ones(len(asked)))


CHECKS: dict[str, Off] = {
    ALL_ON: list,
    DWELL: list,  # by the readings offered
    HIGHEST: list,  # by the settings
    "path acceleration": set_to(track_gate, is_low_acceleration=_all_low),
    "off the path": set_to(track_gate, offsets=_all_near),
    "correlated offsets": set_to(TrackGate, _is_correlated=lambda *_: False),
    "taking back": set_to(TrackGate, _take_back=lambda *_: False),
    "a jump takes nothing back": set_to(limits, JUMP_BEAMS=np.inf),
    "young fits go whole": set_to(limits, YOUNG_S=12.0),
    "orbit test with those kept": set_to(OrbitTest, verdict=_none_with_kept),
    "those kept stay near": set_to(orbit_test, BEFORE_S=0.0),
    "orbit test of the first": set_to(OrbitTest, verdict=_any_first),
    "longer trials": set_to(limits, TRIAL_S=(0.0, 0.0)),
    "reset": set_to(TrackGate, _resets=lambda *_: False),
    "reset at once, 6 dB up": set_to(limits, HIGH_DB=np.inf),
    "late reset, 3 dB down": set_to(limits, LOW_DB=np.inf),
    "strain": set_to(TrackGate, _are_kept_strained=lambda *_: False),
}


@dataclass(frozen=True)
class Case:
    """Readings, and the seconds since those in question began; at_s: when the prediction is looked at."""

    group: str
    name: str
    readings: Readings
    t: Array
    settings: EstimatorSettings
    source: Propagator
    at_s: float
    is_bad: bool = True  # those in question, for BAD_S
    dwell_s: float = 0.0

    @property
    def is_good(self) -> Array:
        good: Array = ~((self.t >= 0.0) & (self.t < BAD_S)) if self.is_bad else np.ones(self.t.size, dtype=np.bool_)
        return good


@dataclass(frozen=True)
class Figures:
    """Of one case with one check off; shares of readings."""

    group: str
    name: str
    check: str
    change_deg: float
    is_seen: bool
    left_out: float  # of the bad ones
    good_lost: float


@cache
def place_of(number: int) -> Place:
    """Even: a real pass of those there are; odd: one made."""
    if number % 2 == 0:
        return Place.of(PASSES[number // 2 % len(PASSES)])
    drawn = listed_passes(accurate, 40, np.random.default_rng(7))
    long = [one for one in drawn if one[1].tai_s[-1] - one[1].tai_s[0] > LONG_S]
    source, sky = long[number]
    air = make_air(standard_air(sky.site.station), DRAWN, sky.site.station.height_m, number)
    table = DirectionTable(sky.tai_s, sky.az_deg, sky.el_deg, sky.range_m)
    shown = ApparentSky(table, air, is_late=sky.site.has_light_time)
    return Place(source, told_air(sky.site), shown, table.start_tai_s, table.end_tai_s)


def bad_minutes(place: Place, hz: float) -> Iterator[Case]:
    for name, kind in KINDS.items():
        readings, t = minutes(place, hz, kind, 1, BEGIN_S)
        settings = settings_of(kind, place, float(readings.tai_s[0]) + LOCK_S)
        yield Case("bad minute", name, readings, t, settings, place.source, BAD_S, dwell_s=kind.dwell_s)


FIRST_LOCKS = {
    "first lock: side lobe up": Kind("", steady(0.3, 1.4)),
    "first lock: side lobe, AGC": Kind("", steady(1.0, -0.8), LOBE_DB),
    "first lock: another satellite": Kind("", drift(-0.25, 0.1, 0.5)),
    "first lock: another, slower": Kind("", drift(0.04, -0.03, 0.5)),
    "first lock: encoder 5 deg off": Kind("", steady(5.0, 0.0)),
}


def first_locks(place: Place, hz: float) -> Iterator[Case]:
    for name, kind in FIRST_LOCKS.items():
        readings, t = minutes(place, hz, kind, 1, BEGIN_S)
        is_on = t >= 0.0
        at_s = BAD_S + AFTER_S
        yield Case("first lock", name, readings.part(is_on), t[is_on], place.settings, place.source, at_s)


SHORT_LOCKS_S = (8.0, 15.0)
AFTER_SHORT = ("side lobe along, no AGC", "side lobe with AGC", "drawn away, 0.05 deg/s", "another satellite")


def short_locks(place: Place, hz: float) -> Iterator[Case]:
    """A few good seconds before the bad minute."""
    for name in AFTER_SHORT:
        readings, t = minutes(place, hz, KINDS[name], 1, BEGIN_S)
        for lock_s in SHORT_LOCKS_S:
            is_on = t >= -lock_s
            on, label = readings.part(is_on), f"{lock_s:g} s of lock, then {name}"
            yield Case("short lock", label, on, t[is_on], place.settings, place.source, BAD_S + AFTER_S)


def good_readings(place: Place, hz: float) -> Iterator[Case]:
    readings, t = minutes(place, hz, Kind("", steady(0.0, 0.0)), 1, BEGIN_S)
    own = partial(Case, "good", settings=place.settings, is_bad=False)
    is_early = t < -20.0
    wrong = {
        "own: anomaly -2 deg": Correction(delta_mean_anomaly_rad=-2.0 * DEG),
        "own: node 0.06 deg": Correction(delta_raan_rad=0.06 * DEG),
    }
    for name, correction in wrong.items():
        source = place.source.corrected(correction)
        yield own(name=name, readings=readings.part(is_early), t=t[is_early] + LOCK_S, source=source, at_s=40.0)
    of_place = partial(own, source=place.source, at_s=BAD_S)
    rng = np.random.default_rng(101)
    noise_deg = NOISE_DEG * np.sqrt(3.0) * rng.standard_normal((2, t.size)) * (t >= 0.0)
    yield of_place(name="own: noise doubles", readings=moved(readings, *noise_deg), t=t)
    share = np.exp(-1.0 / hz / 3.0)
    slow_deg = 0.02 * np.sqrt(1.0 - share**2) * rng.standard_normal((2, t.size))
    for k in range(1, t.size):
        slow_deg[:, k] += share * slow_deg[:, k - 1]
    yield of_place(name="own: noise goes on for 3 s", readings=moved(readings, *slow_deg), t=t)
    is_seen = (t < -45.0) | (t > 20.0)
    off = moved(readings, np.full(t.size, 0.1), np.full(t.size, -0.1))
    yield of_place(name="own: 15 s, a loss, encoders off", readings=off.part(is_seen), t=t[is_seen])


def moved(readings: Readings, right_deg: Array, up_deg: Array) -> Readings:
    az_deg = readings.az_deg + right_deg / np.cos(np.radians(readings.el_deg))
    return Readings(readings.tai_s, az_deg % 360.0, readings.el_deg + up_deg, readings.agc_db)


def play(place: Place, case: Case) -> tuple[FitResult | None, list[str], dict[str, int]]:
    """Refits once a second: the fit at the moment looked at, the reasons said, and what was left out in the end."""
    refitter = Refitter(RefitSetup(case.source, place.site, "full", case.settings, AZIMUTH))
    fit, said, counts = None, [], {}
    second = np.floor(case.t + 1e-6)
    for k in np.unique(second):
        part = case.readings.part(second == k)
        reply = refitter.refit(RefitRequest(part, part.tai_s[-1], 1.0, part.tai_s[-1], 180.0))
        counts = reply.gate.counts
        fit = reply.fit if k < case.at_s else fit
        if REASON_FROM_S <= k < BAD_S:
            said.append(reply.gate.rejecting)
    return fit, said, counts


def reference(place: Place, case: Case) -> FitResult | None:
    """The fit to the good readings."""
    is_used = case.is_good & (case.t < case.at_s)
    if case.is_bad:
        return play(place, replace(case, readings=case.readings.part(is_used), t=case.t[is_used]))[0]
    estimator = FullEstimator(case.source, place.site, case.settings, may_widen=True)
    estimator.add(case.readings.part(is_used))
    return estimator.fit()


def offered(case: Case, check: str) -> Case:
    """The case as the dwell leaves it, or, without it, as acquired."""
    if not case.dwell_s:
        return case
    dwelt, acquired = locks(case.readings, case.t, case.dwell_s)
    used = acquired if check == DWELL else dwelt
    return replace(case, readings=used, t=used.tai_s - case.readings.tai_s[0] + case.t[0])


def figures(place: Place, whole: Case, check: str, right: FitResult | None) -> Figures:
    """One case with one check off.  right: the fit to the good readings."""
    case = offered(whole, check)
    if check == HIGHEST:
        case = replace(case, settings=replace(case.settings, max_fit_elevation_deg=91.0))
    with ExitStack() as off:
        for one in CHECKS[check]():
            off.enter_context(one)
        fit, said, counts = play(place, case)
    at_tai_s = float(whole.readings.tai_s[0] - whole.t[0] + whole.at_s)
    ahead_tai_s = np.arange(at_tai_s, min(at_tai_s + AHEAD_S, place.end_tai_s - 1.0), 5.0)
    left_count, bad_count = sum(counts.values()), int(np.count_nonzero(~case.is_good))
    return Figures(
        case.group,
        case.name,
        check,
        apart_deg(replace(place, source=case.source), fit, right, ahead_tai_s),
        bool(said) and float(np.mean([bool(one) for one in said])) >= REASON_SHARE,
        left_count / max(bad_count, 1),
        max(left_count - bad_count, 0) / max(np.count_nonzero(case.is_good), 1),
    )


@cache
def cases_of(number: int, hz: float) -> dict[str, Case]:
    place = place_of(number)
    made = (bad_minutes, first_locks, short_locks, good_readings)
    return {case.name: case for make in made for case in make(place, hz)}


def measured(job: tuple[int, float, str, tuple[str, ...]]) -> list[Figures]:
    """All checks of one case at one place."""
    number, hz, name, checks = job
    place, case = place_of(number), cases_of(number, hz)[name]
    right = reference(place, offered(case, ALL_ON))
    return [figures(place, case, check, right) for check in checks]


def row(check: str, found: list[Figures]) -> str:
    """A line of the table."""
    cells = []
    for group in GROUPS:
        change_deg = np.array([one.change_deg for one in found if one.group == group and one.check == check])
        beyond = f"{np.count_nonzero(change_deg > ASKED_DEG)} of {change_deg.size}"
        cells.append(
            f"{np.median(change_deg):.3f} / {change_deg.max():.3f}, {beyond}" if change_deg.size else "no case"
        )
    is_seen = [one.is_seen for one in found if one.group == "bad minute" and one.check == check]
    cells.insert(1, f"{sum(is_seen)} of {len(is_seen)}")
    return f"| {check} | " + " | ".join(cells) + " |"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--check", default=[""], nargs="+", metavar="WORD", help="the checks with such a word in their name"
    )
    parser.add_argument("--case", default="", metavar="WORD", help="the cases with that word in their name")
    parser.add_argument("--hz", type=float, nargs="+", default=[2.0], metavar="HZ", help="readings a second")
    parser.add_argument(
        "--place", type=int, nargs="+", default=[0, 1], metavar="N", help="even: real passes; odd: made"
    )
    asked = parser.parse_args()
    checks = tuple(dict.fromkeys([ALL_ON, *(one for one in CHECKS if any(word in one for word in asked.check))]))
    jobs = [
        (number, hz, name, checks)
        for hz in asked.hz
        for number in asked.place
        for name in cases_of(number, hz)
        if asked.case in name
    ]
    found = [one for some in results_of(run_campaign(measured, jobs)) for one in some]
    say(
        "| off | bad minute: median / worst, deg, beyond 0.05 | seen | first lock | short lock | good |\n"
        + "|---" * 6
        + "|"
    )
    for check in checks:
        say(row(check, found))
    return 0


if __name__ == "__main__":
    import screening_ablation  # by its name: the processes cannot load what is remembered of `__main__`

    run_script(screening_ablation.main)
