"""The service as systemd runs it: the unit file's own commands under a small supervisor, real processes."""

import itertools
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from script_modules import load
from supervisor import UNIT, Supervisor, read_unit

from acu_daemon.cli.safe_stop import why_not
from acu_daemon.edge import hook_rights
from acu_daemon.report.pass_trace import read_trace

pass_rig = load("pass_rig")
realtime = pytest.mark.realtime
PATIENCE_S = 60.0
HANGS = """
import sys, time
from acu_daemon.daemon.foreground import Foreground
from acu_daemon.cli import main
tick = Foreground._tick
async def hang(self):
    if self.tick_count == 30:
        a_loop_that_hangs()
    await tick(self)
def a_loop_that_hangs():
    time.sleep(1000)
Foreground._tick = hang
sys.argv[0] = "acu-daemon"
main()
"""


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Any]:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as made:
        scenario = made[0].config / "scenario.toml"  # elements so good that the signal is acquired wherever it begins
        text = scenario.read_text().split("[[loss]]")[0]
        scenario.write_text(text.replace("along_track_s = 0.9", "along_track_s = 0.3"))
        made[0].start_acu()
        yield made[0]


def service(rig: Any, directory: Path, **overrides: str) -> Supervisor:
    """The unit, rehearsing on the rig's simulated ACU."""
    environment = {"ACU_CONFIG": str(rig.config)}
    clock = rig.arguments("run")[-4:]
    return Supervisor(directory, rig.scene.satellite, environment, clock, **overrides)


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.05)


def last_mode(rig: Any) -> str:
    """How the antenna was left."""
    rig.stop()
    return read_trace(rig.trace).mode[-1]


# the unit file


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not installed")
    path = tmp_path / "acu-daemon@station.service"
    path.write_text(UNIT.read_text())
    return path


def test_systemd_finds_nothing_wrong_with_the_unit(unit: Path) -> None:
    done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_unit_is_exposed_by_no_more_than_1_5(unit: Path) -> None:
    asked = ["systemd-analyze", "security", "--offline=true", "--threshold=15", unit]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_the_rigs_of_other_tests_and_benches_run_the_daemon_as_far_ahead_as_the_unit() -> None:
    assert read_unit()["Nice"] == [str(pass_rig.DAEMON_NICENESS)]


def test_the_unit_restarts_for_ever_but_not_after_a_refused_configuration() -> None:
    directives = read_unit()
    assert directives["Restart"] == ["always"]
    assert directives["StartLimitIntervalSec"] == ["0"]
    assert directives["RestartPreventExitStatus"] == ["2"]


STATION = UNIT.parent / "acu-daemon@station.service.d" / "station.conf"
AS_USER = UNIT.parent / "drop-ins" / "hooks-user.conf"
DROP_INS = sorted((UNIT.parent / "drop-ins").glob("*.conf"))


def test_the_station_is_the_unit_without_a_satellite_and_reads_its_files_again_when_it_is_told() -> None:
    directives, unit = read_unit(STATION), read_unit()
    assert directives["ExecStart"] == ["", unit["ExecStart"][0].removesuffix(" --satellite ${ACU_SATELLITE}")]
    assert directives["ExecReload"] == ["/usr/bin/kill -HUP $MAINPID"]


@pytest.mark.parametrize("drop_in", [STATION, *DROP_INS], ids=lambda path: path.name)
def test_a_drop_in_is_well_formed_and_loosens_only_what_it_says(unit: Path, drop_in: Path) -> None:
    folder = unit.with_name(f"{unit.name}.d")
    folder.mkdir()
    shutil.copy(drop_in, folder)
    done = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    allowed = {"ReadWritePaths", "DeviceAllow", "RestrictAddressFamilies", "IPAddressAllow"}
    told = {"Description", "ExecStart", "ExecReload"}
    switches = {"CapabilityBoundingSet", "AmbientCapabilities", "SystemCallFilter"}
    loosened = {STATION: told, AS_USER: switches}.get(drop_in, allowed)
    assert set(read_unit(drop_in)) <= loosened


def test_hooks_of_another_user_cost_the_rights_to_become_one_and_to_end_it_and_no_other() -> None:
    directives = read_unit(AS_USER)
    needed = [" ".join(hook_rights.NEEDED)]
    assert (directives["CapabilityBoundingSet"], directives["AmbientCapabilities"]) == (needed, needed)
    assert directives["SystemCallFilter"] == ["@setuid capset"]


# when the antenna is stopped from outside


def test_a_crash_between_two_runs_is_no_reason_to_stop_the_antenna(tmp_path: Path) -> None:
    assert "started again" in why_not({"SERVICE_RESULT": "signal", "RUNTIME_DIRECTORY": str(tmp_path)})
    assert "by itself" in why_not({"SERVICE_RESULT": "success", "RUNTIME_DIRECTORY": str(tmp_path)})


def test_p4_a_daemon_that_is_not_started_again_leaves_its_antenna_stopped(tmp_path: Path) -> None:
    assert why_not({"SERVICE_RESULT": "exit-code", "EXIT_STATUS": "2", "RUNTIME_DIRECTORY": str(tmp_path)}) == ""
    assert why_not({"SERVICE_RESULT": "exit-code", "EXIT_STATUS": "4", "RUNTIME_DIRECTORY": str(tmp_path)}) != ""


def test_a_daemon_that_a_stop_killed_while_it_started_has_stopped_nothing(tmp_path: Path) -> None:
    ended = {"SERVICE_RESULT": "success", "EXIT_CODE": "killed", "EXIT_STATUS": "TERM"}
    assert why_not({**ended, "RUNTIME_DIRECTORY": str(tmp_path)}) == ""


def test_a_final_stop_that_the_daemon_did_not_survive_is_one(tmp_path: Path) -> None:
    (tmp_path / "final").touch()
    assert why_not({"SERVICE_RESULT": "timeout", "RUNTIME_DIRECTORY": str(tmp_path)}) == ""
    assert why_not({"SERVICE_RESULT": "success", "RUNTIME_DIRECTORY": str(tmp_path)}) != ""


# P4, real processes


@realtime
def test_p4_a_killed_daemon_is_back_and_its_antenna_autotracked_all_the_while(rig: Any, tmp_path: Path) -> None:
    with service(rig, tmp_path) as running:
        wait_until(lambda: any("AUTOTRACK/FITTED" in status for status in running.statuses))
        before_count = len(running.statuses)
        assert running.process is not None
        killed_tai_s = rig.scene.start_tai_s + time.monotonic() - rig.at_monotonic_s
        running.process.kill()
        wait_until(lambda: any("AUTOTRACK/FITTED" in status for status in running.statuses[before_count:]))
        running.stop()
    assert running.results == ["signal", "success"]
    assert running.ready_count == 2
    assert all(status.startswith("REHEARSAL") for status in running.statuses)
    journal = running.journal.read_text()
    assert "a stop would end an autotrack" in journal
    assert "the daemon ended by itself: its STOP was acknowledged" in journal
    rig.stop()
    trace = read_trace(rig.trace)
    modes = [mode for tai_s, mode in zip(trace.tai_s, trace.mode, strict=True) if tai_s >= killed_tai_s]
    assert [mode for mode, _ in itertools.groupby(modes)] == ["AUTOTRACK", "STANDBY"]


@realtime
def test_p4_a_hung_loop_is_aborted_with_its_stack_and_started_again(rig: Any, tmp_path: Path) -> None:
    hanging = tmp_path / "hang.py"
    hanging.write_text(HANGS)
    start = f"/usr/bin/env python {hanging} run --config ${{ACU_CONFIG}} --satellite ${{ACU_SATELLITE}}"
    with service(rig, tmp_path, ExecStart=start) as running:
        wait_until(lambda: len(running.starts_s) > 1)
        running.stop()
    assert running.results[0] == "watchdog"
    assert "a_loop_that_hangs" in running.journal.read_text()


@realtime
def test_p4_a_final_stop_reaches_the_antenna_though_the_daemon_is_dead(rig: Any, tmp_path: Path) -> None:
    with service(rig, tmp_path, WatchdogSec="1000s", TimeoutStopSec="1s") as running:
        wait_until(lambda: any("AUTOTRACK" in status for status in running.statuses))
        assert running.process is not None
        running.process.send_signal(signal.SIGSTOP)
        running.stop()
    assert running.results == ["timeout"]
    assert running.post_codes == [0]
    assert last_mode(rig) == "STANDBY"


@realtime
def test_a_refused_configuration_is_not_started_again(rig: Any, tmp_path: Path) -> None:
    (rig.config / "station.toml").write_text("[station]\n")
    with service(rig, tmp_path) as running:
        wait_until(lambda: bool(running.results))
        time.sleep(1.0)
    assert running.results == ["exit-code"]
    assert len(running.starts_s) == 1


@realtime
def test_p4_a_daemon_killed_in_mid_pass_that_is_refused_its_next_start_leaves_its_antenna_stopped(
    rig: Any, tmp_path: Path
) -> None:
    """Nobody comes back: the service's own safe stop ends the autotrack."""
    with service(rig, tmp_path) as running:
        wait_until(lambda: any("AUTOTRACK" in status for status in running.statuses))
        (rig.config / "satellites" / f"{rig.scene.satellite}.toml").write_text("[satellite]\n")
        assert running.process is not None
        running.process.kill()
        wait_until(lambda: len(running.post_codes) == 2)
    assert running.results == ["signal", "exit-code"]
    assert running.post_codes == [0, 0]
    assert last_mode(rig) == "STANDBY"


@realtime
def test_p4_a_final_stop_while_the_daemon_starts_after_a_crash_reaches_the_antenna(rig: Any, tmp_path: Path) -> None:
    """It has written nothing, its predecessor has; what has not started yet is killed without ExecStop=."""
    with service(rig, tmp_path) as running:
        wait_until(lambda: any("AUTOTRACK" in status for status in running.statuses))
        assert running.process is not None
        running.process.kill()
        wait_until(lambda: len(running.starts_s) == 2)
        time.sleep(0.2)
        running.stop()
    assert running.results == ["signal", "success"]
    assert running.post_codes == [0, 0]
    assert last_mode(rig) == "STANDBY"


@realtime
def test_p4_the_watchdog_leaves_a_stop_alone_that_waits_for_the_link(rig: Any, tmp_path: Path) -> None:
    with service(rig, tmp_path) as running:
        wait_until(lambda: any("AUTOTRACK" in status for status in running.statuses))
        assert running.process is not None
        rig.acu.kill()
        running.process.terminate()  # an end of the daemon's own, such as after the pass
        wait_until(lambda: bool(running.results))
    assert running.results[0] == "exit-code"
    assert "stop.timeout" in running.journal.read_text()
