"""`latency-test`: what it sends, what it says, and what it leaves; counts and structure, never speed."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from config_files import STATION, write
from real_acu import real_acu

from acu_daemon.acu.commands import Identify, Poll
from acu_daemon.cli.latency_test import _link, fits, histogram
from acu_daemon.config.load import load_station
from acu_daemon.daemon.latency_trial import Trial
from acu_daemon.daemon.tick_lateness import Lateness
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.edge.link import make_link

realtime = pytest.mark.realtime
PATIENCE_S = 60.0
AS_FIFO = (
    sys.executable,
    "-c",
    "import os, sys; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10)); os.execv(sys.argv[1], sys.argv[1:])",
)


def test_percentiles_are_of_the_newest_ticks() -> None:
    lateness = Lateness()
    assert lateness.figures().max_ms == 0.0
    for late_ms in range(40_000):
        lateness.add(late_ms / 1e3)
    figures = lateness.figures(101)
    assert (figures.p50_ms, figures.p99_ms, figures.max_ms) == pytest.approx((39_949.0, 39_998.0, 39_999.0))
    assert lateness.newest_ms().size == 36_000
    assert lateness.newest_ms()[0] == pytest.approx(4_000.0)


@pytest.mark.parametrize(("latency_ms", "one_ms", "both_ms"), [(2, 49.9, 71.7), (10, 57.9, 87.7), (20, 67.9, 107.7)])
def test_what_fits_at_9600_baud_is_the_icds_table(latency_ms: int, one_ms: float, both_ms: float) -> None:
    finding = fits(make_link("tcp://127.0.0.1:1?baud=9600"), Sa3842Driver(), 0.1, latency_ms / 1e3, "measured")
    assert finding.verdict == "GO"
    assert f"a command and its status {one_ms:.1f} of 95 ms" in finding.detail
    assert f"{both_ms:.1f} ms" in finding.detail
    assert ("does not fit" in finding.detail) == (both_ms > 95.0)


def test_a_line_whose_replies_all_come_too_late_is_no_go(tmp_path: Path) -> None:
    station = load_station(write(tmp_path))
    late = Trial(link_problem="open, but all replies come too late: up to 150 ms", late="up to 150 ms")
    dead = Trial(link_problem="nobody listens")
    link = make_link(station.acu.url)
    assert [next(_link(trial, station, link)).verdict for trial in (late, dead)] == ["NO-GO", "SKIP"]


def test_a_line_too_slow_for_a_write_each_period_is_no_go() -> None:
    finding = fits(make_link("tcp://127.0.0.1:1?baud=4800"), Sa3842Driver(), 0.1, 0.010, "measured")
    assert finding.verdict == "NO-GO"
    assert "use a higher baud rate or a longer period" in finding.detail


def test_a_histogram_counts_every_value_and_leaves_empty_ends_out() -> None:
    shown = histogram("late", np.array([0.15, 0.15, 0.3, 7.0, 250.0])).splitlines()
    assert shown[0] == "late"
    assert [int(line[17:25].split()[0]) for line in shown[1:]] == [2, 1, 0, 0, 0, 1, 0, 0, 0, 1]


@realtime
def test_without_a_configuration_the_machine_alone_is_measured(tmp_path: Path) -> None:
    figures, picture = tmp_path / "figures.json", tmp_path / "late.png"
    tested = acu_daemon("latency-test", "--duration", "2", "--json", figures, "--plot", picture)
    assert tested.code in (0, 1), tested.err
    said = {line.split()[1]: line.split()[0] for line in tested.out.splitlines()[:5]}
    assert list(said) == ["scheduling", "clock", "ticks", "fit", "link"]
    assert said["link"] == "SKIP"
    assert "no --config" in tested.out
    assert (tested.code == 1) == ("NO-GO" in said.values())
    read = json.loads(figures.read_text())
    assert read["tick_count"] <= 21
    assert read["tick_count"] + read["skipped_tick_count"] >= 20
    assert len(read["lateness_ms"]) == read["tick_count"]
    assert min(read["lateness_ms"]) >= 0.0
    assert (said["fit"] == "NO-GO") == (not read["refit_ms"])
    assert read["round_trip_ms"] == []
    assert picture.read_bytes().startswith(b"\x89PNG")


@realtime
def test_the_acu_is_polled_and_told_nothing_else(tmp_path: Path) -> None:
    with real_acu() as (url, asked):
        (tmp_path / "station.toml").write_text(STATION.replace("tcp://127.0.0.1:3842", url))
        figures = tmp_path / "figures.json"
        tested = acu_daemon("latency-test", "--duration", "2", "--config", tmp_path, "--json", figures)
    assert tested.code in (0, 1), tested.err
    assert Poll() in asked
    assert set(asked) <= {Poll(), Identify()}  # that one after a reply that came too late
    assert len(asked) >= json.loads(figures.read_text())["tick_count"] > 0
    assert "polls lost" in tested.out
    assert "a command and its status" in tested.out


@realtime
def test_without_an_acu_the_link_is_skipped_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "station.toml").write_text(STATION.replace("3842", "1"))
    tested = acu_daemon("latency-test", "--duration", "1", "--config", tmp_path)
    assert "SKIP   link         nobody listens at tcp://127.0.0.1:1" in tested.out
    assert "as configured" in tested.out


def test_a_duration_of_nothing_is_wrong_use() -> None:
    assert acu_daemon("latency-test", "--duration", "0").code == 2


@realtime
def test_the_fit_and_the_threads_do_not_inherit_real_time_priority(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "acu_daemon", "latency-test", "--duration", "3"]
    with subprocess.Popen([*AS_FIFO, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as tested:
        seen: dict[str, int] = {}
        end_s = time.monotonic() + PATIENCE_S
        while tested.poll() is None and time.monotonic() < end_s:
            seen |= others_policies(tested.pid)
            time.sleep(0.05)
        out, err = tested.stdout.read() if tested.stdout else "", tested.stderr.read() if tested.stderr else ""
    if "PermissionError" in err:
        pytest.skip("this user may not use SCHED_FIFO")
    assert "SCHED_FIFO 10" in out, err
    assert seen, "no child was seen"
    assert set(seen.values()) == {os.SCHED_OTHER}


def others_policies(pid: int) -> dict[str, int]:
    """Scheduling of the processes that a process has started, and of its threads but the first."""
    seen = {}
    for task in Path(f"/proc/{pid}/task").glob("*"):
        try:
            threads = [] if task.name == str(pid) else [task.name]
            others = (task / "children").read_text().split() + threads
            seen |= {other: os.sched_getscheduler(int(other)) for other in others}
        except OSError:  # ended meanwhile
            continue
    return seen
