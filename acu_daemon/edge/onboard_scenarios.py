"""One made scenario through the four methods, for a campaign: rates, the bound, violations, processor time."""

import time
from dataclasses import dataclass, replace

import numpy as np

from acu_daemon.onboard.cone import Cone
from acu_daemon.onboard.free import free_profile
from acu_daemon.onboard.methods import make_profile
from acu_daemon.onboard.profile import METHODS, Profile, Task, off_pointing, peak_rate_deg_s
from acu_daemon.onboard.quintic import Path
from acu_daemon.onboard.scenarios import KINDS, make_scenario, scenario_task

STILL_DEG_S = 1e-3


@dataclass(frozen=True, slots=True)
class Run:
    """What is asked of one scenario.  The seed chooses its kind, too: every sixth is of the same."""

    seed: int
    margin_deg: float
    has_imaging: bool = False  # plan also for a quiet camera

    def __str__(self) -> str:
        return f"scenario of seed {self.seed}"


@dataclass(frozen=True, slots=True)
class ScenarioRow:
    """What came out: largest azimuth rates on the polynomials at 20 Hz; nan where there is no path."""

    seed: int
    kind: str
    culmination_deg: float
    single_deg_s: float
    three_deg_s: float
    search_deg_s: float
    free_deg_s: float
    bound_deg_s: float
    violations: int  # samples beyond the margin, of all four profiles
    seconds: float  # of the processor, for all four
    imaging_single_deg_s: float | None = None  # the largest azimuth rate while the camera works
    imaging_free_deg_s: float | None = None  # the same, planned imaging first
    imaging_still: bool | None = None  # both axes, planned imaging first


def run_scenario(run: Run) -> ScenarioRow:
    """Make the scenario and its profiles."""
    kind = KINDS[run.seed % len(KINDS)]
    scenario = make_scenario(kind, np.random.default_rng(run.seed))
    started_s = time.process_time()
    task = scenario_task(scenario, Cone(run.margin_deg))
    profiles = [make_profile(task, scenario.site.station, method) for method in METHODS]
    seconds = time.process_time() - started_s
    single, free = profiles[0], profiles[-1]
    rates = [np.nan if one is None else peak_rate_deg_s(one.azimuth, task.view) for one in profiles]
    row = ScenarioRow(
        seed=run.seed,
        kind=kind,
        culmination_deg=scenario.seen.culmination_el_deg,
        single_deg_s=rates[0],
        three_deg_s=rates[1],
        search_deg_s=rates[2],
        free_deg_s=rates[3],
        bound_deg_s=free.bound.rate_deg_s if free is not None and free.bound is not None else np.nan,
        violations=sum(_violations(task, one) for one in profiles if one is not None),
        seconds=seconds,
    )
    return _with_imaging(row, task, single) if run.has_imaging and task.imaging.any() and single is not None else row


def _violations(task: Task, profile: Profile) -> int:
    off = off_pointing(task, profile.gimbal(task.view.time_s), task.view)
    return int((off > task.margin_deg).sum())


def _with_imaging(row: ScenarioRow, task: Task, single: Profile) -> ScenarioRow:
    quiet = free_profile(task, "imaging", cap_deg_s=row.single_deg_s)
    if quiet is None:
        return row
    azimuth, elevation = (_peak_while_imaging(task, path) for path in (quiet.azimuth, quiet.elevation))
    return replace(
        row,
        imaging_single_deg_s=_peak_while_imaging(task, single.azimuth),
        imaging_free_deg_s=azimuth,
        imaging_still=max(azimuth, elevation) < STILL_DEG_S,
    )


def _peak_while_imaging(task: Task, path: Path) -> float:
    return float(np.abs(path.value(task.view.time_s[task.imaging], 1)).max())
