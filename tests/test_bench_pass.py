"""The bench of a pass: a minute of one on the real clock, over TCP and a paced pseudo terminal at once."""

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from late_writes import late_deg
from script_modules import load

from acu_daemon.report.pass_trace import read_trace
from acu_daemon.report.wire import read_writes

bench_pass, pass_rig = load("bench_pass"), load("pass_rig")
pytestmark = pytest.mark.realtime

WINDOW_S = 60.0
MAX_ERROR_DEG = 0.1
LEAST_WRITES_PER_S = 6.0  # of ten ticks: a reply that a busy machine brings too late costs the next one its write


def late_while_tracking_deg(rig: Any) -> float:
    trace, writes = read_trace(rig.trace), read_writes(rig.wire_log)
    first = int(np.flatnonzero(trace.is_acquired)[0])
    return late_deg(writes, trace, float(trace.tai_s[first]), float(writes.tai_s[-1]))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator["Future[dict[str, tuple[Any, float]]]"]:
    """A window of a pass on both links at once: its figures, and what late writes may have cost the beam, degrees."""
    name = pass_rig.DEFAULT_PASS if pass_rig.pass_names() else None
    scene = pass_rig.make_scene(tmp_path_factory.mktemp("scene"), name, WINDOW_S)
    directory = tmp_path_factory.mktemp("bench")

    def run() -> dict[str, tuple[Any, float]]:
        ended = pass_rig.run_pass(scene, pass_rig.LINKS, directory, lambda _: None)
        return {rig.link: (bench_pass.measure(rig), late_while_tracking_deg(rig)) for rig in ended}

    with ThreadPoolExecutor(1) as pool:
        yield pool.submit(run)


@pytest.mark.parametrize("link", ["tcp", "pty"])
def test_a_pass_with_a_loss_is_tracked_over_both_links(
    bench: "Future[dict[str, tuple[Any, float]]]", link: str
) -> None:
    result, late = bench.result()[link]
    assert result.exit_status == 0
    assert result.losses.loss_s == pytest.approx(WINDOW_S * 0.35, abs=0.5)
    assert result.losses.beam_error_median_deg <= MAX_ERROR_DEG
    assert result.losses.beam_error_max_deg <= MAX_ERROR_DEG + late
    assert result.losses.relock_s <= 3.0
    assert result.writes.autotrack_max_deg <= MAX_ERROR_DEG + late
    assert result.writes.rate_share <= 1.0
    ticked_share = result.tick_count / (result.tick_count + result.skipped_tick_count)
    assert LEAST_WRITES_PER_S * ticked_share <= result.writes.writes_per_s <= 10.2
    assert (result.refusal_count, result.refit_failed_count) == (0, 0)
    assert result.refit_count > 10
