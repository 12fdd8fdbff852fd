"""P8 with real processes: logs that nobody takes; and who may read and write the files of the real command."""

import contextlib
import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from script_modules import load
from test_disk_processes import MOST_SKIPPED_SHARE, scene_without_losses
from test_fault_processes import PATIENCE_S, wait_until

from acu_daemon.edge.control_socket import SOCKET
from acu_daemon.edge.run_state import RUN_STATE
from acu_daemon.report.pass_trace import read_trace

pass_rig = load("pass_rig")
pytestmark = pytest.mark.realtime

STOP_S = 10.0  # as the unit's TimeoutStopSec
LINES_UNREAD_S = 6.0


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return scene_without_losses(tmp_path_factory.mktemp("scene"))


@dataclass
class Unread:
    """A daemon whose log, and whose complaints, go into a pipe that nobody reads."""

    rig: Any
    is_closed: bool
    ticks: tuple[int, int] = (0, 0)
    skipped_count: int = 0
    stop_s: float = 0.0
    status: int = -1
    modes: dict[str, int] = field(default_factory=dict)
    folders: set[str] = field(default_factory=set)

    @property
    def state(self) -> Path:
        place: Path = self.rig.kept
        return place

    def seen(self) -> dict[str, Any]:
        try:
            seen: dict[str, Any] = json.loads((self.state / "snapshot.json").read_text())
        except FileNotFoundError:
            return {"state": "starting"}
        return seen

    def play(self) -> "Unread":
        self.rig.start_acu()
        reader, pipe = os.pipe()
        if self.is_closed:
            os.close(reader)
        else:
            fill_pipe(pipe)
        arguments = [*self.rig.arguments("run"), "--state", str(self.rig.directory / "state"), "--log-level", "debug"]
        arguments += ["--record", str(self.rig.directory / "readings.csv")]
        self.rig.daemon = subprocess.Popen(arguments, stdout=pipe, stderr=pipe, umask=0)
        os.close(pipe)
        wait_until(lambda: self.seen()["state"] == "AUTOTRACK/FITTED", "tracking")
        before = self.seen()
        time.sleep(LINES_UNREAD_S)
        after = self.seen()
        self.ticks = (before["tick_count"], after["tick_count"])
        self.skipped_count = after["skipped_tick_count"] - before["skipped_tick_count"]
        paths = [self.state, self.rig.directory / "readings.csv", *self.state.rglob("*")]
        for path in paths:
            with contextlib.suppress(FileNotFoundError):  # one that was just put in its place under another name
                self.modes[path.name] = path.stat().st_mode & 0o777
        self.folders = {path.name for path in paths if path.is_dir()}
        began_s = time.monotonic()
        self.rig.daemon.send_signal(signal.SIGTERM)
        self.status = self.rig.daemon.wait(PATIENCE_S)
        self.stop_s = time.monotonic() - began_s
        if not self.is_closed:
            os.close(reader)
        self.rig.stop()
        return self


def fill_pipe(pipe: int) -> None:
    """To the brim, as a reader that stands still leaves it."""
    os.set_blocking(pipe, False)
    try:
        for size in (4096, 1):
            while True:
                os.write(pipe, b"\n" * size)
    except BlockingIOError:
        os.set_blocking(pipe, True)


@pytest.fixture(scope="module")
def unread(scene: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, "Future[Unread]"]]:
    """A pipe that is full, and one whose reader has gone, at once."""
    directory = tmp_path_factory.mktemp("unread")
    with (
        pass_rig.rigs(scene, ["tcp"], directory / "1") as (full,),
        pass_rig.rigs(scene, ["tcp"], directory / "2") as (closed,),
        ThreadPoolExecutor(2) as pool,
    ):
        yield {
            "full": pool.submit(Unread(full, is_closed=False).play),
            "closed": pool.submit(Unread(closed, is_closed=True).play),
        }


@pytest.mark.parametrize("pipe", ["full", "closed"])
def test_p8_a_log_that_nobody_takes_holds_up_neither_the_ticks_nor_the_stop(
    unread: dict[str, "Future[Unread]"], pipe: str
) -> None:
    played = unread[pipe].result()
    before, after = played.ticks
    print(f"{pipe}: {after - before} ticks in {LINES_UNREAD_S:g} s, {played.skipped_count} skipped", end="; ")
    print(f"SIGTERM to the end {played.stop_s:.1f} s")
    assert after - before > LINES_UNREAD_S
    assert played.skipped_count <= MOST_SKIPPED_SHARE * (after - before)
    assert played.status == 0
    assert played.stop_s < STOP_S
    assert read_trace(played.rig.trace).mode[-1] == "STANDBY"


def test_whatever_the_umask_others_may_neither_read_nor_write(unread: dict[str, "Future[Unread]"]) -> None:
    seen = unread["full"].result()
    modes = dict(seen.modes)
    assert seen.state.name in seen.folders
    assert {modes.pop(name) for name in seen.folders} == {0o750}
    assert modes.pop(SOCKET) == 0o660
    assert {RUN_STATE, "snapshot.json", "readings.csv"} <= set(modes)
    assert set(modes.values()) == {0o640}


@pytest.mark.parametrize("place", ["config", "config/station.toml", "state-rehearsal"])
def test_where_everybody_may_write_the_command_refuses_to_start(scene: Any, tmp_path: Path, place: str) -> None:
    rig = pass_rig.Rig("tcp", scene, tmp_path / "rig", time.monotonic())
    (rig.directory / "state-rehearsal").mkdir()
    (rig.directory / place).chmod(0o777)
    asked = [*rig.arguments("run"), "--state", str(rig.directory / "state")]
    ended = subprocess.run(asked, capture_output=True, text=True, timeout=PATIENCE_S)
    assert ended.returncode == 2
    assert f"{rig.directory / place}: everybody may write" in ended.stderr
    assert list((rig.directory / "state-rehearsal").iterdir()) == []
