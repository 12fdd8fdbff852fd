"""The tick bench: that it measures what it says, and how its tables judge; never how fast anything was."""

import json
import os
import time
from dataclasses import replace
from pathlib import Path

import pytest
from script_modules import load

bench_tick, tick_rig, process_load = load("bench_tick"), load("tick_rig"), load("process_load")

RESOLUTION_S = 2 / os.sysconf("SC_CLK_TCK")  # of two figures, user and system
QUIET = tick_rig.Ticks(
    condition="idle",
    antennas=1,
    seconds=600.0,
    is_permitted=True,
    tick_count=6000,
    skipped_tick_count=0,
    p50_ms=0.1,
    p99_ms=0.4,
    max_ms=1.1,
    cpu_percent=2.5,
    fit_cpu_percent=0.9,
    acu_cpu_percent=1.1,
    memory_mb=80.0,
    status_count=0,
    limit_name="cyclictest",
    limit_p50_ms=0.08,
    limit_p99_ms=0.2,
    limit_max_ms=2.8,
)


def missed(**changes: object) -> list[str]:
    rows = bench_tick.asked_rows([replace(QUIET, **changes)])
    return [name for name, *_, is_met in rows if not is_met]


def test_each_asked_figure_is_judged_by_itself() -> None:
    assert missed() == []
    assert missed(p99_ms=1.2) == ["idle: late 99 %, ms"]
    assert missed(skipped_tick_count=1) == ["idle: ticks skipped"]
    assert missed(memory_mb=90.2, cpu_percent=3.1) == [
        "idle: processor with the fit, % of a core",
        "idle: memory with the fit, MB",
    ]
    assert missed(condition="loaded", p99_ms=4.9) == []


def test_what_is_not_permitted_is_said_and_not_judged() -> None:
    refused = replace(QUIET, condition="fifo", is_permitted=False, p99_ms=9.0)
    assert bench_tick.asked_rows([refused]) == []
    assert "not permitted" in bench_tick.conditions_table([refused])


def test_the_tables_are_markdown_with_the_ratio_to_the_machines_limit() -> None:
    lines = bench_tick.conditions_table([QUIET]).splitlines()
    assert len({line.count("|") for line in lines}) == 1
    assert "| 2.0 | 0 of 6000 | 2.50 (0.90) | 80 |" in lines[2]
    scale = bench_tick.scale_table([replace(QUIET, antennas=10, cpu_percent=25.0)]).splitlines()
    assert len({line.count("|") for line in scale}) == 1
    assert "| 25.0 | 2.50 | 1.1 | 80 |" in scale[2]


def test_cyclictests_histogram_is_read() -> None:
    said = "# Histogram\n000040 000050\n000041 000000\n000090 000049\n002800 000001\n"
    assert process_load.cyclictest_ms(said + "# Total: 000000100\n# Max Latencies: 02800\n") == (0.04, 0.09, 2.8)


def test_memory_and_processor_time_of_a_process_are_read() -> None:
    pid = os.getpid()
    before_s = os.times()
    read_s = process_load.cpu_s(pid)
    after_s = os.times()
    assert before_s.user + before_s.system - RESOLUTION_S <= read_s <= after_s.user + after_s.system + RESOLUTION_S
    alone_mb = process_load.memory_mb([pid])
    assert alone_mb > 10.0
    assert process_load.memory_mb([pid, pid]) < 2 * alone_mb


@pytest.mark.realtime
@pytest.mark.parametrize(("name", "antennas"), [("polled", 1), ("fifo", 2)])
def test_a_few_seconds_of_a_locked_daemon_are_measured(tmp_path: Path, name: str, antennas: int) -> None:
    began_s = time.monotonic()
    ticks = tick_rig.run_condition(tmp_path, tick_rig.CONDITIONS[name], antennas, 3.0, lambda _: None)
    most_count = 10 * antennas * (time.monotonic() - began_s)
    assert 10 * antennas <= ticks.tick_count + ticks.skipped_tick_count <= most_count
    assert 0.0 <= ticks.p50_ms <= ticks.p99_ms <= ticks.max_ms
    assert ticks.cpu_percent >= ticks.fit_cpu_percent >= 0.0  # a process may use less than the clock's resolution
    assert (ticks.status_count > 0) == (name == "polled")
    assert 0.0 <= ticks.limit_p50_ms <= ticks.limit_p99_ms <= ticks.limit_max_ms
    assert ticks.memory_mb > 0.0
    lines = [json.loads(line) for log in tmp_path.glob("*/daemon.jsonl") for line in log.read_text().splitlines()]
    starts = [line for line in lines if line["event"] == "run.start"]
    expected = "SCHED_FIFO 30" if name == "fifo" and ticks.is_permitted else "SCHED_OTHER"
    assert [start["scheduling"] for start in starts] == antennas * [expected]
