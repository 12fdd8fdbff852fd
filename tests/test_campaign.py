"""Campaigns: order, failures, progress, one process or several, and the same on a dask cluster."""

import io
import sys
from functools import partial
from importlib.util import find_spec

import numpy as np
import pytest

from acu_daemon.edge import campaign
from acu_daemon.edge.campaign import Failed, progress_bar, results_of, run_campaign
from acu_daemon.errors import CampaignError, OrbitError, UsageError

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="needs the extra `cluster` (dask)")


def noisy_sum(count: int, seed: np.random.SeedSequence) -> float:
    return float(np.random.default_rng(seed).normal(size=count).sum())


def reciprocal(value: int) -> float:
    if value == 3:
        raise OrbitError("decayed")
    return 1.0 / value


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_stand_in_the_order_of_the_items_however_many_processes_run(jobs: int) -> None:
    seeds = np.random.SeedSequence(7).spawn(6)
    work = partial(noisy_sum, 100)
    assert run_campaign(work, seeds, jobs=jobs) == [work(seed) for seed in seeds]


def test_a_failure_is_told_with_its_item_and_loses_no_other() -> None:
    outcomes = run_campaign(reciprocal, [1, 3, 0, 2], jobs=1, name_of=lambda one: f"seed {one}")
    assert (outcomes[0], outcomes[3]) == (1.0, 0.5)
    assert str(outcomes[1]) == "seed 3: decayed"  # an error of ours: its message
    assert isinstance(outcomes[2], Failed)
    assert "ZeroDivisionError" in outcomes[2].reason  # any other: all we know
    with pytest.raises(CampaignError, match=r"2 of 4 runs failed:\nseed 3: decayed\nseed 0: Traceback"):
        results_of(outcomes)
    assert results_of([1.0, 2.0]) == [1.0, 2.0]


def test_a_long_list_of_failures_is_cut() -> None:
    with pytest.raises(CampaignError, match=r"and 4 more$"):
        results_of([Failed(f"seed {n}", "decayed") for n in range(9)])


def test_progress_counts_every_item_once() -> None:
    seen: list[tuple[int, int]] = []
    run_campaign(reciprocal, [1, 2, 3], jobs=1, on_done=lambda *counts: seen.append(counts))
    assert seen == [(1, 3), (2, 3), (3, 3)]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_bar_is_drawn_on_a_terminal_and_nowhere_else(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []
    for stream in (Terminal(), io.StringIO()):
        monkeypatch.setattr(sys, "stderr", stream)
        with progress_bar("years") as on_done:
            run_campaign(reciprocal, [1, 2], jobs=1, on_done=on_done)
        drawn.append(stream.getvalue())
    assert "years" in drawn[0]
    assert "2/2" in drawn[0]
    assert drawn[1] == ""


@pytest.mark.parametrize("jobs", [0, -2])
def test_a_number_of_processes_that_is_none_is_refused(jobs: int) -> None:
    with pytest.raises(UsageError, match=f"--jobs {jobs}: expected 1 or more"):
        run_campaign(reciprocal, [1], jobs=jobs)


def test_without_dask_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'acu-daemon\[cluster\]'"):
        run_campaign(reciprocal, [1], dask="tcp://127.0.0.1:1")


@pytest.mark.long
@needs_dask
@pytest.mark.filterwarnings("ignore")  # dask's own, at the end of its cluster
def test_a_cluster_of_two_workers_gives_the_same_results_and_failures() -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, protocol="tcp") as cluster:
        outcomes = run_campaign(reciprocal, [1, 3, 2, 4], dask=cluster.scheduler_address)
    assert outcomes == [1.0, Failed("3", "decayed"), 0.5, 0.25]


@needs_dask
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_is_not_there_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "CONNECT_S", 0.2)
    with pytest.raises(UsageError, match=r"--dask tcp://127.0.0.1:1: no dask scheduler answers there"):
        run_campaign(reciprocal, [1], dask="tcp://127.0.0.1:1")
    with pytest.raises(UsageError, match="--dask nonsense://x"):
        run_campaign(reciprocal, [1], dask="nonsense://x")
