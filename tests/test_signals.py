"""Signals: a safe stop from the first instant on, what was ignored stays ignored, and nothing else kills."""

import asyncio
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from config_files import write
from script_modules import load

from acu_daemon.edge.signals import STOPS, STRAYS, take_signals

pass_rig = load("pass_rig")
PATIENCE_S = 60.0
UNSHARE = ("unshare", "--pid", "--fork", "--kill-child")


@contextlib.contextmanager
def ignoring(*numbers: int) -> Iterator[None]:
    """What is started meanwhile inherits it, as from nohup."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def wait_until(is_so: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end_s, "it never came true"
        time.sleep(0.01)


def is_caught(pid: int, number: int) -> bool:
    """Whether a process has a handler for a signal: proc(5)."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return bool(int(status["SigCgt"], 16) >> (number - 1) & 1)


async def take(number: int) -> tuple[list[str], list[str], list[str]]:
    """Send this process a signal; what was stopped, told, and ignored from the first."""
    loop, stopped, told = asyncio.get_running_loop(), [], []
    before = {one: signal.getsignal(one) for one in (*STOPS, *STRAYS)}
    try:
        ignored = take_signals(loop, stopped.append, told.append)
        os.kill(os.getpid(), number)
        for _ in range(10):
            await asyncio.sleep(0)
    finally:
        for one, handler in before.items():
            loop.remove_signal_handler(one)
            signal.signal(one, handler)
    return stopped, told, ignored


@pytest.mark.parametrize("number", STOPS)
async def test_a_stop_stops_and_one_that_was_ignored_stays_ignored(number: int) -> None:
    name = signal.Signals(number).name
    assert await take(number) == ([name], [], [])
    with ignoring(number):
        assert await take(number) == ([], [], [name])


@pytest.mark.parametrize(
    ("number", "name"),
    [
        (signal.SIGUSR1, "SIGUSR1"),
        (signal.SIGUSR2, "SIGUSR2"),
        (signal.SIGPWR, "SIGPWR"),
        (signal.SIGVTALRM, "SIGVTALRM"),
        (signal.SIGRTMIN + 3, "SIGRTMIN+3"),
    ],
)
async def test_a_signal_that_means_nothing_is_told_and_ends_nothing(number: int, name: str) -> None:
    assert await take(number) == ([], [name], [])


def test_every_signal_that_kills_by_default_is_a_stop_or_ends_nothing() -> None:
    harmless = {"CHLD", "URG", "WINCH", "CONT", "STOP", "TSTP", "TTIN", "TTOU"}  # by default: signal(7)
    python_ignores, errors = {"PIPE", "XFSZ"}, {"SEGV", "BUS", "FPE", "ILL", "ABRT", "TRAP", "SYS"}
    others = {signal.Signals(number).name for number in signal.valid_signals() - {*STOPS, *STRAYS}}
    assert others == {f"SIG{name}" for name in harmless | python_ignores | errors | {"KILL"}}


def test_the_start_is_guarded_before_anything_that_takes_long_is_loaded() -> None:
    code = "import acu_daemon.__main__, acu_daemon.edge.signals, sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not {"asyncio", "numpy", "typer", "structlog", "pydantic", "pathlib"} & set(done.stdout.split())


@pytest.fixture
def stuck(tmp_path: Path) -> list[str]:
    """A daemon's command line that stays in its start: nobody ever writes its station.toml."""
    config = write(tmp_path)
    (config / "station.toml").unlink()
    os.mkfifo(config / "station.toml")
    state = str(tmp_path / "state")
    return [*pass_rig.ACU_DAEMON, "run", "--config", str(config), "--satellite", "scd", "--state", state]


@pytest.mark.realtime
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_stop_in_the_start_ends_it_by_that_signal(stuck: list[str], number: int) -> None:
    with subprocess.Popen(stuck) as daemon:
        wait_until(lambda: is_caught(daemon.pid, number))
        daemon.send_signal(signal.SIGUSR1)
        daemon.send_signal(number)
        assert daemon.wait(PATIENCE_S) == -number


@pytest.mark.realtime
def test_a_stop_in_the_start_is_not_lost_by_the_first_process_of_a_container(stuck: list[str]) -> None:
    if shutil.which("unshare") is None or subprocess.run([*UNSHARE, "true"], capture_output=True).returncode:
        pytest.skip("a PID namespace of its own is not permitted here (unshare --pid)")
    with subprocess.Popen([*UNSHARE, *stuck]) as outer:
        children = Path(f"/proc/{outer.pid}/task/{outer.pid}/children")
        wait_until(lambda: children.read_text().split() != [])
        first = int(children.read_text().split()[0])
        wait_until(lambda: is_caught(first, signal.SIGTERM))
        os.kill(first, signal.SIGTERM)
        assert outer.wait(PATIENCE_S) == 128 + signal.SIGTERM


@pytest.mark.realtime
def test_under_nohup_a_closed_terminal_and_stray_signals_end_nothing_and_sigterm_stops_safely(tmp_path: Path) -> None:
    scene = pass_rig.make_scene(tmp_path / "scene", None, 120.0)
    strays = [signal.SIGUSR1, signal.SIGUSR2, signal.SIGALRM, signal.SIGIO, signal.SIGRTMIN]
    with pass_rig.rigs(scene, ["tcp"], tmp_path) as (rig,):
        rig.start_acu()
        with ignoring(signal.SIGHUP):
            rig.start_daemon()
        wait_until(lambda: rig.state.startswith("AUTOTRACK"))
        for number in (signal.SIGHUP, *strays):
            rig.daemon.send_signal(number)
        wait_until(lambda: len(rig.events("signal.ignored")) == len(strays))
        assert rig.daemon.poll() is None
        rig.daemon.send_signal(signal.SIGTERM)
        assert rig.daemon.wait(PATIENCE_S) == 0
        (ignored,), (done,) = rig.events("signals.ignored"), rig.events("run.done")
    assert ignored["signals"] == ["SIGHUP"]
    assert (done["reason"], done["is_stopped"]) == ("SIGTERM", True)
