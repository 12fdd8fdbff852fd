"""P6 with real processes: an earlier version's latch holds a `run` until it is cleared, an old rehearsal's does not."""

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from command_line import acu_daemon
from config_files import BROUWER, STATION, replaced, write
from real_acu import real_acu
from script_modules import load

from acu_daemon.acu.commands import Identify, Poll, ReadFaults, Stop
from acu_daemon.drivers.sa3842.messages import ReadParameter, ReadRegisters
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.latch import LATCH
from acu_daemon.orbit.timescales import utc_text

pass_rig = load("pass_rig")
pytestmark = pytest.mark.realtime

PATIENCE_S = 60.0
TEXT = "elevation stands still away from its command"
KEPT = f"{TEXT}\n2018-12-25T01:40:00.000Z\n"


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.05)


def shown(state: Path, *more: str) -> dict[str, Any]:
    """What the running daemon says of itself; nothing before it answers."""
    done = acu_daemon("status", "--json", "--state", state, *more)
    snapshot: dict[str, Any] = json.loads(done.out) if done.code == 0 else {}
    return snapshot


def test_p6_a_latch_in_the_plain_folder_of_an_earlier_version_holds_a_real_run_until_it_is_cleared(
    tmp_path: Path,
) -> None:
    state = tmp_path / "state"
    state.mkdir()
    (state / LATCH).write_text(KEPT)
    epoch = utc_text(SystemClock().tai_s() - 3600.0, 0)
    satellite = re.sub(r"epoch_utc = .*", f"epoch_utc = {epoch}", BROUWER)
    with real_acu() as (url, asked):
        config = write(tmp_path / "config", replaced(STATION, "tcp://127.0.0.1:3842", url), scd=satellite)
        words = ["run", "--config", str(config), "--satellite", "scd", "--state", str(state)]
        with (tmp_path / "log").open("w") as log:
            daemon = subprocess.Popen([sys.executable, "-m", "acu_daemon", *words], stdout=log, stderr=log)
        try:
            wait_until(lambda: shown(state).get("latch") == TEXT)
            wait_until(lambda: shown(state).get("state") == "FAULT")
            harmless = (Identify, Poll, ReadFaults, ReadParameter, ReadRegisters, Stop)
            assert [one for one in asked if not isinstance(one, harmless)] == []
            assert (state / LATCH).exists()
            cleared = acu_daemon("clear", "--state", state)
            assert cleared.code == 0, cleared.err
            wait_until(lambda: shown(state).get("latch") == "" and shown(state)["state"] != "FAULT")
            wait_until(lambda: not list(state.rglob(LATCH)))
        finally:
            daemon.kill()
            daemon.wait()


def test_a_second_rehearsal_begins_without_the_latch_of_the_first_one(tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as (rig,):
        rig.start_acu()
        rig.start_daemon()
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        rig.daemon.kill()
        rig.daemon.wait()
        (rig.kept / LATCH).write_text(KEPT)
        rig.start_daemon()  # the same rehearsal: it holds
        wait_until(lambda: rig.state == "FAULT")
        rig.daemon.kill()
        rig.daemon.wait()
        rig.acu.kill()
        rig.acu.wait()
        rig.acu.stdout.close()
        words = rig.arguments
        back_s = time.monotonic() - rig.at_monotonic_s  # it begins anew at the scene's start
        another_at = utc_text(scene.start_tai_s - back_s, 6)

        def of_another(command: str) -> list[str]:
            given = words(command)
            at = given.index("--at")
            return [*given[: at + 1], another_at, *given[at + 2 :]]

        rig.arguments = of_another
        assert (rig.kept / LATCH).exists()
        rig.start_acu()
        rig.start_daemon()
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        wait_until(lambda: not (rig.kept / LATCH).exists())
