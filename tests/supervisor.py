"""A small systemd for tests: runs the unit file itself, with readiness, watchdog, restarts and the two kinds of end."""

import contextlib
import math
import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from script_modules import load

process_load = load("process_load")
UNIT = Path(__file__).resolve().parents[1] / "config" / "systemd" / "acu-daemon@.service"
UNITS_S = {"ms": 1e-3, "s": 1.0, "": 1.0, "min": 60.0}
PATIENCE_S = 60.0
CLEAN_SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM, signal.SIGPIPE)  # an end by one of them is a success


def read_unit(path: Path = UNIT) -> dict[str, list[str]]:
    """Every directive of every section, with its values in order."""
    directives: dict[str, list[str]] = {}
    for line in path.read_text().splitlines():
        if "=" in line and not line.startswith("#"):
            key, value = line.split("=", 1)
            directives.setdefault(key, []).append(value)
    return directives


class Supervisor:
    """Does with the unit's [Service] what systemd does, as far as the daemon can tell the difference."""

    def __init__(
        self, directory: Path, instance: str, environment: Mapping[str, str], more: list[str], **overrides: str
    ) -> None:
        self._unit = read_unit()
        self._unit |= {key: [value] for key, value in overrides.items()}
        self._more = more
        self._runtime = directory / "runtime"
        self._log = (directory / "journal").open("ab")
        self.journal = directory / "journal"
        self._state = directory / "state"
        self._state.mkdir()
        self._runtime.mkdir()
        self._notify_path = directory / "notify"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(self._notify_path))
        self._socket.settimeout(0.05)
        self._environment = {
            **os.environ,
            "PATH": f"{Path(sys.executable).parent}:/usr/bin:/bin",
            **self._defaults(instance),
            **environment,
            "NOTIFY_SOCKET": str(self._notify_path),
            "WATCHDOG_USEC": str(round(self._seconds("WatchdogSec") * 1e6)),
            "STATE_DIRECTORY": str(self._state),
            "RUNTIME_DIRECTORY": str(self._runtime),
        }
        self._is_stopping = threading.Event()
        self.process: subprocess.Popen[bytes] | None = None
        self.starts_s: list[float] = []
        self.results: list[str] = []
        self.statuses: list[str] = []
        self.ready_count = 0
        self.post_codes: list[int] = []
        self._thread = threading.Thread(target=self._run)

    def _defaults(self, instance: str) -> dict[str, str]:
        words = " ".join(self._unit["Environment"]).replace("%i", instance).split()
        return dict(word.split("=", 1) for word in words)

    def _seconds(self, key: str) -> float:
        match = re.fullmatch(r"([\d.]+)([a-z]*)", self._unit[key][-1])
        assert match is not None, key
        return float(match[1]) * UNITS_S[match[2]]

    def _command(self, key: str) -> list[str]:
        words = shlex.split(self._unit[key][-1])
        return [re.sub(r"\$\{(\w+)\}", lambda name: self._environment[name[1]], word) for word in words]

    def start(self) -> None:
        self._thread.start()

    def _run(self) -> None:
        while not self._is_stopping.is_set():
            for left in self._runtime.iterdir():
                left.unlink()
            command = [*self._command("ExecStart"), *self._more]
            self.process = subprocess.Popen(
                command, env=self._environment, stdout=self._log, stderr=self._log, start_new_session=True
            )
            if not process_load.try_nice(self.process.pid, int(self._unit["Nice"][-1])):
                self._log.write(b"supervisor: the unit's niceness is not permitted to this user\n")
            self.starts_s.append(time.monotonic())
            result = self._watch(self.process)
            if result == "success" and not self._is_stopping.is_set():
                self._call("ExecStop", {})
            self.results.append(result)
            status = str(self.process.returncode)
            code = "killed" if self.process.returncode < 0 else "exited"
            self._call("ExecStopPost", {"SERVICE_RESULT": result, "EXIT_CODE": code, "EXIT_STATUS": status})
            if status in self._unit["RestartPreventExitStatus"]:
                return
            self._is_stopping.wait(self._seconds("RestartSec"))

    def _watch(self, process: "subprocess.Popen[bytes]") -> str:
        """Until the process has ended; its $SERVICE_RESULT."""
        is_ready, fed_s, result = False, time.monotonic(), ""
        while process.poll() is None:
            with contextlib.suppress(TimeoutError):
                text = self._socket.recv(4096).decode()
                is_ready |= text == "READY=1"
                self.ready_count += text == "READY=1"
                if text == "WATCHDOG=1":
                    fed_s = time.monotonic()
                if text == "STOPPING=1":
                    fed_s = math.inf
                if text.startswith("STATUS="):
                    self.statuses.append(text.removeprefix("STATUS="))
            if self._is_stopping.is_set() and not result:
                result = self._end(process, is_ready=is_ready)
            elif is_ready and not result and time.monotonic() - fed_s > self._seconds("WatchdogSec"):
                result = "watchdog"
                process.send_signal(signal.SIGABRT)
                self._kill_after(process, "TimeoutAbortSec")
        if not result or result == "success":
            is_clean = process.returncode == 0 or -process.returncode in CLEAN_SIGNALS
            result = "success" if is_clean else "exit-code" if process.returncode > 0 else "signal"
        return result

    def _end(self, process: "subprocess.Popen[bytes]", *, is_ready: bool) -> str:
        if is_ready:  # what has not started is not asked to stop, but killed
            self._call("ExecStop", {})
        process.terminate()
        return "timeout" if self._kill_after(process, "TimeoutStopSec") else "success"

    def _kill_after(self, process: "subprocess.Popen[bytes]", key: str) -> bool:
        try:
            process.wait(self._seconds(key))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return True
        return False

    def _call(self, key: str, environment: Mapping[str, str]) -> None:
        done = subprocess.run(
            self._command(key), env=self._environment | environment, stdout=self._log, stderr=self._log, check=False
        )
        if key == "ExecStopPost":
            self.post_codes.append(done.returncode)

    def stop(self) -> None:
        """A final stop, as `systemctl stop` asks for it."""
        self._is_stopping.set()
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive(), "the service does not end"

    def __enter__(self) -> "Supervisor":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._is_stopping.set()
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
        self._thread.join(PATIENCE_S)
        self._socket.close()
        self._log.close()
