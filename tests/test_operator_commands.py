"""P1 with real processes: `acu-daemon arm`, `disarm` and `status` move, stop and show a running daemon's antenna."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command_line import Done, acu_daemon
from script_modules import load

pass_rig = load("pass_rig")
pytestmark = pytest.mark.realtime

PATIENCE_S = 60.0


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.05)


def say(rig: Any, word: str, *more: str) -> Done:
    return acu_daemon(word, *more, "--state", rig.directory / "state", "--rehearsal")


def seen(rig: Any) -> dict[str, Any]:
    done = say(rig, "status", "--json")
    assert done.code == 0, done.err
    snapshot: dict[str, Any] = json.loads(done.out)
    return snapshot


def test_p1_a_person_arms_and_disarms_the_running_daemon(tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as (rig,):
        station = rig.config / "station.toml"
        station.write_text(station.read_text() + '\n[safety]\narm = "manual"\n')
        rig.start_acu()
        rig.start_daemon()
        wait_until(lambda: rig.state == "IDLE")
        assert (seen(rig)["arming"], seen(rig)["write_count"]) == ("disarmed", 0)
        assert say(rig, "arm").code == 0
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        assert seen(rig)["arming"] == "armed"
        assert say(rig, "disarm").code == 0
        wait_until(lambda: seen(rig)["state"] == "IDLE")
        count = seen(rig)["write_count"]
        assert count > 0
        time.sleep(0.5)
        assert seen(rig)["write_count"] == count
        refused = acu_daemon("clear", "--state", rig.directory / "state")
        assert refused.code == 1
        assert "--rehearsal" in refused.err


def start_again(rig: Any) -> None:
    """SIGKILL was before."""
    rig.start_daemon()
    wait_until(lambda: rig.events("acu.identified"))


def test_p1_what_a_person_does_while_the_daemon_is_dead_and_a_disarm_outlive_it(tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as (rig,):
        rig.start_acu()
        rig.start_daemon()
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        rig.daemon.kill()
        rig.daemon.wait()
        stopped = acu_daemon("safe-stop", "--config", rig.config)
        assert stopped.code == 0, stopped.err
        start_again(rig)
        wait_until(lambda: seen(rig)["disarmed_by"] == "another hand that stopped the antenna")
        assert say(rig, "arm").code == 0
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        assert say(rig, "disarm").code == 0
        wait_until(lambda: seen(rig)["arming"] == "disarmed")
        wait_until((rig.kept / "disarmed").exists)
        rig.daemon.kill()
        rig.daemon.wait()
        (rig.kept / "run.json").write_bytes(b"{")
        start_again(rig)
        assert (seen(rig)["arming"], seen(rig)["disarmed_by"], seen(rig)["write_count"]) == ("disarmed", "a person", 0)
