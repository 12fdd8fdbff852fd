"""The daemon on Hamlib's own rotctld with its dummy rotator, over TCP, on the real clock."""

import contextlib
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import config_files
import pytest
from command_line import acu_daemon
from test_rotator_flights import STATION

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(shutil.which("rotctld") is None, reason="needs rotctld: apt-get install libhamlib-utils"),
]
PATIENCE_S = 60.0
AT = "1989-02-01T01:59:00Z"  # SCD-1 rises over Cuiaba, in the west


@contextlib.contextmanager
def rotctld(port: int, model: int = 1) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(["rotctld", "-m", str(model), "-T", "127.0.0.1", "-t", str(port)])
    try:
        for _ in range(600):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
                break
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(0.1)
        yield process
    finally:
        process.kill()
        process.wait(PATIENCE_S)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


def asked(port: int, line: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", port), PATIENCE_S) as one:
        one.sendall(line)
        return one.recv(1000)


def brought_near(port: int) -> bytes:
    """The dummy turns at its own pace to where the pass is soon after its rise."""
    asked(port, b"P -80 8\n")
    for _ in range(600):
        said = asked(port, b"p\n")
        if abs(float(said.split()[0]) + 80.0) < 1.0:
            return said
        threading.Event().wait(0.2)
    raise AssertionError("the dummy rotator does not move")


def station(tmp_path: Path, port: int, changed: str = STATION) -> Path:
    return config_files.write(tmp_path, changed.replace("4533", str(port)).replace("max_deg = 450", "max_deg = 180"))


def run(config: Path, seconds: float) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "acu_daemon", "run", "--config", str(config), "--satellite", "scd"]
    command += ["--at", AT, "--duration", str(seconds), "--state", str(config / "state")]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def test_a_rehearsal_leads_hamlibs_dummy_along_the_path_and_stops_it(tmp_path: Path) -> None:
    port = free_port()
    config = station(tmp_path, port)
    with rotctld(port):
        checked = acu_daemon("check", "--config", config, "--satellite", "scd", "--at", AT)
        assert "Hamlib's dummy rotator SIMULATION" in checked.out
        before = brought_near(port)
        out, _ = run(config, 60.0).communicate(timeout=4 * PATIENCE_S)
        assert "PROGRAM" in out
        assert "stop.done" in out
        assert asked(port, b"p\n") != before


def test_a_rotctld_that_dies_is_told_and_the_pass_goes_on_when_it_is_back(tmp_path: Path) -> None:
    port = free_port()
    config = station(tmp_path, port)
    with contextlib.ExitStack() as ends:
        first = ends.enter_context(rotctld(port))
        brought_near(port)
        daemon = run(config, 60.0)
        ends.callback(daemon.kill)
        assert daemon.stdout is not None
        lines = []
        for line in daemon.stdout:
            lines.append(line)
            if "acu.identified" in line and first.poll() is None:
                first.kill()
                first.wait(PATIENCE_S)
            if "link.lost" in line or "link.closed" in line:
                ends.enter_context(rotctld(port))
                brought_near(port)
                break
        rest, _ = daemon.communicate(timeout=4 * PATIENCE_S)
        assert "link.lost" in "".join(lines)
        assert "link.open" in rest
        assert "PROGRAM" in rest
        assert daemon.returncode in (0, 1)
