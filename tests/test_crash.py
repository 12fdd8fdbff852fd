"""P4 and P9 with real processes: SIGKILL of the daemon in a loss, death and hang of the fit process in autotrack.

Half of the kills come while every core is busy.  The daemon stands as far ahead of that as its unit says, where that is
permitted, and loads bytecode, as where it is installed.  The figures are printed (pytest -rP).  Asserted is what no
machine's speed changes: the way back takes no longer than the daemon was away.
"""

import itertools
import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest
from late_writes import late_deg
from script_modules import load

from acu_daemon.model import sky_angle_deg
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.pass_trace import read_trace
from acu_daemon.report.wire import HALF_SERVO_TICK_S, read_writes, satellite_at

pass_rig, process_load = load("pass_rig"), load("process_load")
pytestmark = pytest.mark.realtime

LOSS_S = (30.0, 92.0)  # from the scene's start
FIRST_KILL_S, APART_S = {"tcp": 34.0, "pty": 41.0}, 14.0
LOADS = ("quiet", "quiet", "busy", "busy")  # of the machine, at each kill
BUSY_S = (61.0, 88.0)
RESTART_S = 0.1  # as the unit's RestartSec
CORRECT_DEG = 0.1
STAYS_S = 2.0  # a machine that stands still for a second later on is no part of the restart
ASKED_S = 3.0
STANDSTILL_S = 2.0  # of a busy machine, on the way back
HUNG_TICK_COUNT = 50  # while a fit process that hangs is waited for
PATIENCE_S = 60.0


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.02)


@dataclass
class Crashes:
    """What one link's rig went through."""

    rig: Any
    killed_tai_s: list[float] = field(default_factory=list)
    restarts: list[list[dict[str, Any]]] = field(default_factory=list)  # the log of each daemon
    errors: str = ""
    oldest_fit_s: float = 0.0
    early_trouble_count: int = 0  # of the last daemon's fits, before its fit process is hit
    is_ahead: bool = True
    done: dict[str, Any] = field(default_factory=dict)

    @property
    def tai_s(self) -> float:
        start: float = self.rig.scene.start_tai_s
        return start + time.monotonic() - float(self.rig.at_monotonic_s)

    def sleep_until(self, since_start_s: float) -> None:
        time.sleep(max(0.0, self.rig.scene.start_tai_s + since_start_s - self.tai_s))

    def start_daemon(self) -> None:
        self.rig.start_daemon()
        self.is_ahead &= self.rig.is_ahead

    def crash(self) -> None:
        """SIGKILL, and what systemd does then."""
        self.keep_log()
        self.killed_tai_s.append(self.tai_s)
        self.rig.daemon.kill()
        self.rig.daemon.wait()
        time.sleep(RESTART_S)
        self.start_daemon()

    def keep_log(self) -> None:
        whole = [line for line in self.rig.log.read_text().splitlines(keepends=True) if line.endswith("\n")]
        self.restarts.append([json.loads(line) for line in whole])
        self.errors += self.rig.errors.read_text()

    def snapshot(self) -> dict[str, Any]:
        path = self.rig.kept / "snapshot.json"
        seen: dict[str, Any] = json.loads(path.read_text())
        return seen

    @property
    def kept_state(self) -> str:
        """What the next daemon would read."""
        return str(json.loads((self.rig.kept / "run.json").read_text())["state"])

    def hit_fit_process(self, number: signal.Signals) -> None:
        """Kill or stop the fit process; wait until another one fits."""
        wait_until(lambda: len(children(self.rig.daemon.pid)) == 1)
        os.kill(children(self.rig.daemon.pid)[0], number)
        hit_tai_s = self.tai_s
        before = len(self.fit_troubles())
        wait_until(lambda: len(self.fit_troubles()) > before)
        self.oldest_fit_s = max(self.oldest_fit_s, self.snapshot()["fit_age_s"])
        wait_until(lambda: self.fitted_tai_s > hit_tai_s + 1.0)

    @property
    def fitted_tai_s(self) -> float:
        """Time of the newest reading that is fitted."""
        seen = self.snapshot()
        return float(seen["tai_s"] - seen["fit_age_s"])

    def fit_troubles(self) -> list[dict[str, Any]]:
        return [entry for name in ("fit.process_ended", "fit.failed") for entry in self.rig.events(name)]

    def run(self) -> "Crashes":
        rig = self.rig
        rig.start_acu()
        self.start_daemon()
        self.sleep_until(LOSS_S[0])
        wait_until(lambda: rig.state == "HOLD/FITTED")
        for number in range(len(LOADS)):
            self.sleep_until(FIRST_KILL_S[rig.link] + number * APART_S)
            wait_until(lambda: rig.state == self.kept_state == "HOLD/FITTED")  # a starved one is long on its way
            self.crash()
        self.sleep_until(LOSS_S[1])
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        time.sleep(3.0)
        wait_until(lambda: self.snapshot()["fit_age_s"] < 2.0)
        self.early_trouble_count = len(self.fit_troubles())
        self.hit_fit_process(signal.SIGKILL)
        self.hit_fit_process(signal.SIGSTOP)
        rig.daemon.send_signal(signal.SIGTERM)
        rig.daemon.wait(PATIENCE_S)
        self.keep_log()
        (self.done,) = rig.events("run.done")
        rig.stop()
        return self

    def seconds_to_writes(self) -> list[tuple[float, float]]:
        """For each crash: to the first register write, and to the first from which on all are right for STAYS_S.

        Followed registers come back no faster than the drive can, so the longer the start, the longer the way.
        """
        writes, trace = read_writes(rig_file(self.rig, "wire_log")), read_trace(rig_file(self.rig, "trace"))
        az_deg, el_deg = satellite_at(trace, writes.tai_s + HALF_SERVO_TICK_S)
        columns = (writes.az_deg, writes.el_deg, az_deg, el_deg)
        off_deg = np.array([sky_angle_deg(*row) for row in zip(*(c.tolist() for c in columns), strict=True)])
        ends = [*self.killed_tai_s[1:], self.rig.scene.start_tai_s + LOSS_S[1]]
        seconds = []
        for killed_tai_s, end_tai_s in zip(self.killed_tai_s, ends, strict=True):
            is_after = (writes.tai_s > killed_tai_s + RESTART_S) & (writes.tai_s < end_tai_s)
            wrong_tai_s = writes.tai_s[is_after & (off_deg > CORRECT_DEG)]
            right_tai_s = writes.tai_s[is_after & (off_deg <= CORRECT_DEG)]
            next_wrong_tai_s = np.append(wrong_tai_s, np.inf)[np.searchsorted(wrong_tai_s, right_tai_s)]
            stays = right_tai_s[next_wrong_tai_s - right_tai_s > STAYS_S]
            first_s = float(np.min(writes.tai_s[is_after], initial=np.inf) - killed_tai_s)
            seconds.append((first_s, float(stays[0] - killed_tai_s) if stays.size else float("inf")))
        return seconds

    def error_when_back_deg(self) -> tuple[float, float]:
        """The beam error as the signal comes back, and what of it a late write may have cost."""
        writes, trace = read_writes(rig_file(self.rig, "wire_log")), read_trace(rig_file(self.rig, "trace"))
        back_tai_s = self.rig.scene.start_tai_s + LOSS_S[1]
        back = int(np.flatnonzero(trace.tai_s >= back_tai_s)[0])
        return float(trace.error_deg[back]), late_deg(writes, trace, back_tai_s, back_tai_s)


def rig_file(rig: Any, name: str) -> Path:
    path: Path = getattr(rig, name)
    return path


def keep_busy(crashes: Crashes) -> None:
    """Keep every core busy while BUSY_S lasts."""
    crashes.sleep_until(BUSY_S[0])
    with process_load.busy_cores(os.cpu_count()):
        crashes.sleep_until(BUSY_S[1])


@pytest.fixture(scope="module")
def crashes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, "Future[Crashes]"]]:
    """Both links at once, on one clock."""
    scene = pass_rig.make_scene(tmp_path_factory.mktemp("scene"), None, 150.0)
    scenario = scene.config / "scenario.toml"
    times = "".join(
        f"{name} = {utc_text(scene.start_tai_s + since_s)}\n"
        for name, since_s in zip(("from_utc", "to_utc"), LOSS_S, strict=True)
    )
    scenario.write_text(scenario.read_text().split("[[loss]]")[0] + f'[[loss]]\ncause = "receiver"\n{times}')
    with (
        pytest.MonkeyPatch.context() as environment,
        pass_rig.rigs(scene, pass_rig.LINKS, tmp_path_factory.mktemp("rigs")) as made,
        ThreadPoolExecutor(3) as pool,
    ):
        environment.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
        pool.submit(keep_busy, Crashes(made[0]))
        yield {rig.link: pool.submit(Crashes(rig).run) for rig in made}


@pytest.mark.parametrize("link", ["tcp", "pty"])
def test_p4_a_daemon_killed_in_a_loss_is_back_on_the_path_at_once(
    crashes: dict[str, "Future[Crashes]"], link: str
) -> None:
    crashed = crashes[link].result()
    seconds = crashed.seconds_to_writes()
    error_deg, late = crashed.error_when_back_deg()
    ahead = (
        f"at niceness {pass_rig.DAEMON_NICENESS}, as the unit says"
        if crashed.is_ahead
        else "at niceness 0: more is not permitted"
    )
    print(f"{link}, {ahead}: SIGKILL to correct register writes, s, asked {ASKED_S:g}:")
    for load_name in dict.fromkeys(LOADS):
        those = [one for (_, one), at in zip(seconds, LOADS, strict=True) if at == load_name]
        print(f"  {load_name}: {', '.join(f'{one:.2f}' for one in those)}; median {median(those):.2f}")
    print(f"  beam error when the signal is back {error_deg:.3f} deg")
    for first_s, correct_s in seconds:
        assert correct_s < np.inf
        assert correct_s <= 2 * first_s + STANDSTILL_S
    assert error_deg <= CORRECT_DEG + late
    assert crashed.errors == ""


@pytest.mark.parametrize("link", ["tcp", "pty"])
def test_p4_it_goes_back_to_its_state_and_to_its_fit(crashes: dict[str, "Future[Crashes]"], link: str) -> None:
    first, *others = crashes[link].result().restarts
    assert not [entry for entry in first if entry["event"] == "run.resumed"]
    for log in others:
        (resumed,) = [entry for entry in log if entry["event"] == "run.resumed"]
        assert resumed["state"] == "HOLD/FITTED"
        assert states_of(log)[:2] == ["IDLE", "HOLD/FITTED"]
        assert not {"fit.first", "fit.note", "run_state.unreadable"} & {entry["event"] for entry in log}
    assert states_of(others[-1])[2] == "AUTOTRACK/FITTED"


def states_of(log: list[dict[str, Any]]) -> list[str]:
    """What a daemon went through; on a machine that stood still it may have lost the link for a moment as well."""
    states = [entry["state"] for entry in log if entry["event"] == "state.changed" and entry["state"] != "LINK-LOST"]
    return [state for state, _ in itertools.groupby(states)]


@pytest.mark.parametrize("link", ["tcp", "pty"])
def test_p9_a_fit_process_that_dies_or_hangs_is_replaced_and_disturbs_no_tick(
    crashes: dict[str, "Future[Crashes]"], link: str
) -> None:
    crashed = crashes[link].result()
    log = crashed.restarts[-1]
    reasons = [entry["reason"] for entry in log if entry["event"] == "fit.failed"]
    assert "no answer within 5 s" in reasons[-1]
    ended_count = len([entry for entry in log if entry["event"] == "fit.process_ended"])
    assert ended_count + len(reasons) - crashed.early_trouble_count == 2
    assert crashed.oldest_fit_s > 4.0
    assert crashed.done["skipped_tick_count"] < HUNG_TICK_COUNT / 2
    assert crashed.done["reason"] == "SIGTERM"


def children(pid: int) -> list[int]:
    """Processes that a process has started."""
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
