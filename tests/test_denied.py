"""Whatever the system denies ends in clear words and status 2, or is tried again; never in a traceback."""

import errno
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from config_files import STATION, replaced, write
from script_modules import load
from unprivileged import NOBODY, as_nobody, without_rights

from acu_daemon.edge.denied import denied

pass_rig = load("pass_rig")
PATIENCE_S = 60.0
HERE = Path(__file__).parent
COMMANDS_IN_ONE_PROCESS = f"""
import dataclasses, json, sys
sys.path.insert(0, {str(HERE)!r})
from command_line import acu_daemon
print(json.dumps([dataclasses.asdict(acu_daemon(*arguments)) for arguments in json.load(sys.stdin)]))
"""


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (PermissionError(errno.EACCES, "Permission denied", "/x/y"), "/x/y: Permission denied"),
        (OSError(errno.EMFILE, "Too many open files"), "too few open files are allowed (ulimit -n): allow more"),
        (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "too few processes and threads"),
        (RuntimeError("can't start new thread"), "a thread: too few processes and threads"),
        (MemoryError(), "there is no memory left"),
        (ExceptionGroup("", [OSError(errno.ENOMEM, "Cannot allocate memory")]), "there is no memory left"),
        (ImportError("libx.so: failed to map segment"), "cannot be loaded (libx.so: failed to map segment)"),
    ],
)
def test_what_is_denied_is_told_with_what_to_do(error: Exception, words: str) -> None:
    assert words in denied(error)


@pytest.mark.parametrize("error", [RuntimeError("of ours"), KeyError("x"), ExceptionGroup("", [TypeError("x")])])
def test_an_error_of_ours_is_no_denial(error: Exception) -> None:
    assert denied(error) == ""


def closed_to_all(path: Path) -> Path:
    """A file or directory that nobody but root may read, write or enter."""
    path.chmod(0o000)
    return path


def denials(tmp_path: Path) -> list[tuple[list[object], int, str]]:
    """Commands, each with the status and the words it is to end with."""
    good = write(tmp_path / "good", replaced(STATION, "tcp://127.0.0.1:3842", "tcp://127.0.0.1:1"))
    locked = closed_to_all(write(tmp_path / "locked"))
    closed_to_all(write(tmp_path / "list") / "satellites")
    closed_to_all(write(tmp_path / "file") / "station.toml")
    closed_to_all(write(tmp_path / "one") / "satellites" / "scd.toml")
    shut = tmp_path / "shut"
    shut.mkdir()
    closed_to_all(shut)
    readings = tmp_path / "readings.csv"
    readings.write_text("utc,az_deg,el_deg,locked\n")
    run = ["run", "--config", good, "--satellite", "scd", "--at", "1989-02-01T01:58:30Z"]
    fake = ["fake-acu", "--config", good, "--satellite", "scd", "--listen", "127.0.0.1:0"]
    replay = ["replay", "--config", good, "--satellite", "scd", "--readings"]
    state = ["--state", tmp_path / "state"]
    return [
        (["passes", "--config", locked], 2, "is not readable"),
        (["passes", "--config", tmp_path / "list"], 2, "satellites: cannot be read: Permission denied"),
        (["passes", "--config", tmp_path / "file"], 2, "station.toml: cannot be read: Permission denied"),
        (["passes", "--config", tmp_path / "one"], 2, "scd.toml: cannot be read: Permission denied"),
        (["passes", "--config", good, "--satellite", "x" * 300], 2, "no such file; satellites in"),
        ([*fake[:2], locked, *fake[3:]], 2, "is not readable"),
        (["check", "--config", locked], 2, "is not readable"),
        (["check", "--config", tmp_path / "list"], 2, "satellites: cannot be read: Permission denied"),
        ([*run, "--state", shut / "state"], 2, "Permission denied; choose another with --state DIR"),
        ([*run, *state, "--record", shut / "r.csv"], 2, f"--record {shut}/r.csv: Permission denied"),
        ([*fake, "--trace", shut / "t.csv"], 2, f"--trace {shut}/t.csv: Permission denied"),
        ([*fake, "--wire-log", shut / "w.csv"], 2, f"--wire-log {shut}/w.csv: Permission denied"),
        ([*fake, "--scenario", shut / "s.toml"], 2, "Permission denied"),
        ([*fake, "--truth", shut / "t.csv"], 2, "Permission denied"),
        ([*fake[:-2], "--pty", shut / "acu"], 2, "Permission denied"),
        ([*fake[:-1], "127.0.0.1:1"], 2, "cannot listen on tcp://127.0.0.1:1"),
        ([*fake, "--control", "127.0.0.1:1"], 2, "--control: cannot listen on 127.0.0.1:1"),
        ([*replay, shut / "r.csv", "--out", tmp_path / "o.csv"], 2, "Permission denied"),
        ([*replay, readings, "--out", shut / "o.csv"], 2, "Permission denied"),
        (["demo", "--out", shut / "demo"], 2, "Permission denied"),
        (["arm", "--state", shut / "state"], 1, "not permitted"),
    ]


@pytest.mark.realtime
def test_files_directories_and_sockets_that_are_denied(tmp_path: Path) -> None:
    rows = denials(tmp_path)
    done = subprocess.run(
        [*without_rights(), sys.executable, "-c", COMMANDS_IN_ONE_PROCESS],
        input=json.dumps([[str(word) for word in arguments] for arguments, _, _ in rows]),
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE_S,
        check=True,
    )
    unlike = []
    for (arguments, code, words), ended in zip(rows, json.loads(done.stdout), strict=True):
        said = ended["out"] + ended["err"]
        if (ended["code"], words in said, "Traceback" in said) != (code, True, False):
            unlike.append((arguments, ended))
    assert not unlike


def shell(arguments: str, directory: Path, before: str = "") -> "subprocess.CompletedProcess[str]":
    """The command with redirections and limits of a shell."""
    line = f'{before} exec "{sys.executable}" -m acu_daemon {arguments}'
    return subprocess.run(["sh", "-c", line], cwd=directory, env={}, capture_output=True, text=True, timeout=PATIENCE_S)


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("redirected", "code", "said"),
    [
        (">&-", 0, ""),
        ("2>&-", 0, "scd"),
        ("<&-", 0, "scd"),
        (">&- 2>&- <&-", 0, ""),
        (">/dev/full", 2, "acu-daemon: the system denies what this needs: standard output: No space left on device\n"),
        (">/dev/full 2>/dev/full", 2, ""),
    ],
)
def test_a_stream_that_is_closed_or_full(tmp_path: Path, redirected: str, code: int, said: str) -> None:
    write(tmp_path)
    done = shell(f"passes --config . --from 1989-02-01T00:00:00Z {redirected}", tmp_path)
    assert done.returncode == code
    assert said in done.stdout + done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("environment", "shown"),
    [
        ({"PYTHONIOENCODING": "iso-8859-1"}, "Łódź 成都".encode("iso-8859-1", "backslashreplace")),
        ({"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}, b"station.toml"),
        ({"LC_ALL": "C"}, "Łódź 成都".encode()),
    ],
)
def test_no_name_of_a_station_is_too_much_for_a_locale(
    tmp_path: Path, environment: dict[str, str], shown: bytes
) -> None:
    text = replaced(STATION, "[station]", '[station]\nname = "Łódź 成都"')
    write(tmp_path, replaced(text, "tcp://127.0.0.1:3842", "tcp://127.0.0.1:1"))
    command = [sys.executable, "-m", "acu_daemon", "check", "--config", "."]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, timeout=PATIENCE_S)
    assert (done.returncode, done.stderr) == (1, b"")
    assert shown in done.stdout.splitlines()[0], done.stdout


@pytest.fixture
def open_path() -> Iterator[Path]:
    """A directory that every user may look into, which tmp_path is not."""
    with tempfile.TemporaryDirectory() as directory:
        Path(directory).chmod(0o755)
        yield Path(directory)


@pytest.mark.realtime
@pytest.mark.parametrize("command", ["check --config .", "safe-stop --config .", "latency-test --duration 1"])
def test_a_command_that_is_denied_files_says_so_and_leaves_nothing_half_made(open_path: Path, command: str) -> None:
    write(open_path, replaced(STATION, "tcp://127.0.0.1:3842", "tcp://127.0.0.1:1"))
    done = shell(command, open_path, before="ulimit -n 5;")  # of fewer Python itself dies
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("acu-daemon: the system denies what this needs: ")
    assert len(done.stderr.splitlines()) == 1, done.stderr


def limited(limit: str, rig: Any) -> "subprocess.Popen[bytes]":
    """A daemon of a user's, with a limit of prlimit(1)."""
    if shutil.which("prlimit") is None:
        pytest.skip("there is no prlimit here")
    home = rig.directory / "home"
    home.mkdir()
    if os.geteuid() == 0:
        os.chown(home, NOBODY, NOBODY)
    command = [*as_nobody(), "prlimit", limit, *rig.arguments("run"), "--state", str(home / "state")]
    with rig.log.open("w") as log, rig.errors.open("w") as errors:
        return subprocess.Popen(command, stdout=log, stderr=errors)


@pytest.mark.realtime
@pytest.mark.parametrize(
    ("limit", "reason"), [("--nproc=0", "Resource temporarily unavailable"), ("--nofile=11", "Too many open files")]
)
def test_without_threads_processes_or_files_the_daemon_steers_by_the_elements_and_stops_safely(
    open_path: Path, limit: str, reason: str
) -> None:
    scene = pass_rig.make_scene(open_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], open_path) as (rig,):
        rig.start_acu()
        with limited(limit, rig) as daemon:
            end_s = time.monotonic() + PATIENCE_S
            while not (rig.state.startswith("AUTOTRACK") and rig.events("fit.failed")):
                assert time.monotonic() < end_s, rig.log.read_text() + rig.errors.read_text()
                time.sleep(0.05)
            daemon.terminate()
            assert daemon.wait(PATIENCE_S) == 0
        assert rig.events("fit.failed")[0]["reason"] == f"the fit process cannot be started: {reason}"
        assert rig.events("run.done")[0]["is_stopped"]
        assert rig.errors.read_text() == ""


@pytest.mark.realtime
@pytest.mark.parametrize("limit", ["--nofile=6", "--as=60000000"])
def test_a_start_that_is_denied_files_or_memory_says_so(open_path: Path, limit: str) -> None:
    scene = pass_rig.make_scene(open_path / "scene", None, 120.0)
    with pass_rig.rigs(scene, ["tcp"], open_path) as (rig,), limited(limit, rig) as daemon:
        assert daemon.wait(PATIENCE_S) == 2
        assert "ulimit" in rig.errors.read_text()
        assert "Traceback" not in rig.errors.read_text()
