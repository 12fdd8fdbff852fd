"""The real commands as processes of their own, on the real clock, over TCP and a paced pseudo terminal.

Asserts what happened and counts, never speed: the machine may be busy.
"""

import contextlib
import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from command_line import acu_daemon
from late_writes import late_deg
from real_acu import real_acu
from script_modules import load

from acu_daemon.acu.commands import Identify, Poll
from acu_daemon.drivers.sa3842.messages import ReadRegisters
from acu_daemon.report.pass_trace import read_trace
from acu_daemon.report.wire import read_writes

pass_rig = load("pass_rig")
pytestmark = pytest.mark.realtime

PATIENCE_S = 60.0  # a hang fails the test; a slow machine does not
MAX_ERROR_DEG = 0.1
HELD_S = 10.0  # of which the last two seconds are judged: the way there is longer on a busy machine
ANSI = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
ON_A_TERMINAL = (sys.executable, "-c", "import os, sys; os.login_tty(0); os.execv(sys.argv[1], sys.argv[1:])")


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Any]:
    """A rig over TCP under two minutes of the demo's satellite; nothing is started yet."""
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as made:
        yield made[0]


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.05)


def silence(rig: Any) -> None:
    """No signal at all for the next simulated ACU."""
    scenario = rig.config / "scenario.toml"
    scenario.write_text(scenario.read_text() + '[[loss]]\ncause = "silence-zone"\nstart_s = 0.0\nduration_s = 1000.0\n')


def last_mode(rig: Any) -> str:
    """Mode of the simulated ACU at its end."""
    rig.stop()
    mode: str = read_trace(rig.trace).mode[-1]
    return mode


def test_sigterm_stops_the_antenna_and_the_recording_can_be_replayed(rig: Any, tmp_path: Path) -> None:
    recording, replayed = tmp_path / "readings.csv", tmp_path / "replayed.csv"
    rig.start_acu()
    rig.start_daemon("--record", str(recording))
    wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
    wait_until(lambda: len(recording.read_text().splitlines()) > 20)
    rig.daemon.send_signal(signal.SIGTERM)
    assert rig.daemon.wait(PATIENCE_S) == 0
    (done,) = rig.events("run.done")
    assert (done["reason"], done["is_stopped"], done["refusal_count"]) == ("SIGTERM", True, 0)
    assert rig.errors.read_text() == ""
    assert last_mode(rig) == "STANDBY"

    replay = acu_daemon(
        "replay", "--config", rig.config, "--satellite", rig.scene.satellite, "--readings", recording, "--out", replayed
    )
    assert replay.code == 0, replay.err
    assert len(replayed.read_text().splitlines()) == len(recording.read_text().splitlines()) > 20


def test_what_a_run_leaves_begins_the_next_one_in_the_rehearsals_own_folder(rig: Any) -> None:
    rig.start_acu()
    for is_first in (True, False):
        rig.start_daemon()
        wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
        assert len(rig.events("carry_over.used")) == (0 if is_first else 1)
        kept = rig.kept / "carry-over-99901.json"
        wait_until(kept.exists)
        rig.daemon.send_signal(signal.SIGTERM)
        assert rig.daemon.wait(PATIENCE_S) == 0
        assert not rig.events("fit.note")
        kept.with_name("run.json").unlink()  # else the second one is a restart in the same pass
    assert rig.events("carry_over.used")[0]["of"] == "orbit and biases"
    assert not (rig.directory / "state").exists()


def test_a_pipe_gets_json_lines_that_all_say_rehearsal(rig: Any) -> None:
    rig.start_acu()
    rig.start_daemon("--duration", "4")
    assert rig.daemon.wait(PATIENCE_S) in (0, 1)
    entries = [json.loads(line) for line in rig.log.read_text().splitlines()]
    assert all(entry["REHEARSAL"] is True for entry in entries)
    assert {"run.start", "link.open", "acu.identified", "run.done"} <= {entry["event"] for entry in entries}


@contextlib.contextmanager
def on_a_terminal(arguments: list[str]) -> Iterator[tuple[int, "subprocess.Popen[bytes]"]]:
    """A process with a controlling terminal of its own; yields the terminal's other end."""
    master, slave = os.openpty()
    process = subprocess.Popen([*ON_A_TERMINAL, *arguments], stdin=slave, stdout=slave, stderr=slave)
    os.close(slave)
    try:
        yield master, process
    finally:
        process.kill()
        process.wait()
        os.close(master)


def read_terminal(master: int, until: str) -> str:
    """What the terminal shows until a text comes, or until the process has gone."""
    shown = ""
    end_s = time.monotonic() + PATIENCE_S
    while until not in shown:
        assert time.monotonic() < end_s, shown
        if not select.select([master], [], [], 0.5)[0]:
            continue
        try:
            shown += os.read(master, 65536).decode()
        except OSError:  # EIO: nobody holds the terminal any more
            break
    return shown


def test_a_terminal_shows_readable_lines_and_a_live_line_and_control_c_stops_safely(rig: Any, tmp_path: Path) -> None:
    rig.start_acu()
    with on_a_terminal([*rig.arguments("run"), "--state", str(tmp_path / "state")]) as (master, process):
        shown = read_terminal(master, until="state=AUTOTRACK/FITTED")
        shown += read_terminal(master, until="ON path")
        os.write(master, b"\x03")
        shown += read_terminal(master, until="\0")
        assert process.wait(PATIENCE_S) == 0
    assert last_mode(rig) == "STANDBY"
    assert "\r\x1b[K" in shown
    lines = [line for line in re.split(r"[\r\n]+", ANSI.sub("", shown)) if line.strip("^C ")]
    assert [line for line in lines if "REHEARSAL" not in line] == []
    drawn = [line for line in lines if line.startswith("TRACKING") and "ON path" in line]
    assert drawn
    assert max(len(line.removesuffix("^C")) for line in drawn) < 80  # the live line keeps to the terminal
    assert any("run.done" in line and "reason=SIGINT" in line for line in lines)
    assert not any(line.startswith("{") for line in lines)
    assert "Traceback" not in shown


def test_without_an_acu_the_run_ends_with_status_3_and_says_what_to_check(rig: Any) -> None:
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))  # nobody listens there
        url = f"tcp://127.0.0.1:{held.getsockname()[1]}"
        station = rig.config / "station.toml"
        station.write_text(station.read_text().replace("tcp://127.0.0.1:3842", url))
        rig.start_daemon()
        assert rig.daemon.wait(PATIENCE_S) == 3
    assert rig.errors.read_text() == (
        f"acu-daemon: no good poll within 10 s: nobody listens at {url}: "
        "check the port, and that the ACU or the simulator is on\n"
    )


def test_in_two_terminals_either_side_is_stopped_and_started_in_mid_rehearsal_with_no_numbers_to_copy(rig: Any) -> None:
    words = rig.arguments

    def without_numbers(command: str) -> list[str]:
        return [word for word in words(command) if word != "--at-monotonic" and word != f"{rig.at_monotonic_s:.6f}"]

    rig.arguments = without_numbers
    scenario = rig.config / "scenario.toml"  # well inside the beam: it is joined late, where the satellite is fast
    scenario.write_text(scenario.read_text().replace("along_track_s = 0.9", "along_track_s = 0.3"))
    rig.start_acu()
    time.sleep(HELD_S)  # as a person takes to the second terminal
    rig.start_daemon()
    wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
    (told,) = rig.events("rehearsal.clock")
    assert f"that of the simulator (process {rig.acu.pid}), now " in told["clock"]
    rig.acu.kill()
    rig.acu.wait()
    rig.acu.stdout.close()
    wait_until(lambda: rig.state == "LINK-LOST")
    rig.start_acu()
    assert f"that of the daemon (process {rig.daemon.pid}), now " in (rig.directory / "acu.err").read_text()
    wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
    rig.daemon.kill()
    rig.daemon.wait()
    rig.start_daemon()
    wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
    assert rig.events("run.resumed")  # the same rehearsal
    rig.daemon.send_signal(signal.SIGTERM)
    assert rig.daemon.wait(PATIENCE_S) == 0
    (done,) = rig.events("run.done")
    assert done["has_acquired"]
    assert not rig.events("fit.note")  # no blame on the elements: their satellite is where the simulator has it


def test_an_acu_that_dies_and_comes_back_is_steered_on_without_a_signal(rig: Any) -> None:
    rig.start_acu()
    rig.start_daemon()
    wait_until(lambda: rig.state == "AUTOTRACK/FITTED")
    time.sleep(5.0)  # readings to fit
    rig.acu.kill()
    rig.acu.wait()
    rig.acu.stdout.close()
    wait_until(lambda: rig.state == "LINK-LOST")
    silence(rig)
    rig.start_acu()
    wait_until(lambda: rig.state == "HOLD/FITTED")
    time.sleep(HELD_S)
    rig.daemon.send_signal(signal.SIGTERM)
    assert rig.daemon.wait(PATIENCE_S) == 0
    assert len(rig.events("link.open")) >= 2  # more on a machine that stood still
    rig.stop()
    trace = read_trace(rig.trace)
    assert trace.is_acquired.sum() == 0
    followed = [i for i, mode in enumerate(trace.mode) if mode == "ACQUIRE"]
    assert len(followed) > 20
    on_the_path = slice(followed[-20], followed[-1])  # two seconds; before them it was on its way there
    late = late_deg(read_writes(rig.wire_log), trace, *trace.tai_s[[followed[-20], followed[-1]]])
    assert trace.error_deg[on_the_path].max() <= MAX_ERROR_DEG + late


def test_a_satellite_that_was_never_acquired_ends_with_status_1(rig: Any) -> None:
    silence(rig)
    rig.start_acu()
    rig.start_daemon("--duration", "8")
    assert rig.daemon.wait(PATIENCE_S) == 1
    (done,) = rig.events("run.done")
    assert (done["reason"], done["has_acquired"], done["is_stopped"]) == ("duration over", False, True)
    assert last_mode(rig) == "STANDBY"


def test_a_rehearsal_writes_nothing_to_an_acu_that_says_it_is_a_real_one(rig: Any) -> None:
    with real_acu() as (url, asked):
        station = rig.config / "station.toml"
        station.write_text(station.read_text().replace("tcp://127.0.0.1:3842", url))
        rig.start_daemon()
        assert rig.daemon.wait(PATIENCE_S) == 2
    assert {type(command) for command in asked} <= {Identify, Poll, ReadRegisters}
    assert Identify() in asked
    assert "the ACU is a real one (SA-3842 10): a rehearsal (--at) runs only on a simulated ACU" in (
        rig.errors.read_text()
    )
