"""What commands share: exit status of every kind of failure, help, version, and the clock that --at asks for."""

import os
import shlex
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_line import acu_daemon
from config_files import BROUWER, replaced, write

from acu_daemon import PROCESS_START_S, __version__
from acu_daemon.cli import app, coming_passes
from acu_daemon.cli.options import coming_pass, load_target, make_clock, parse_utc
from acu_daemon.errors import ConfigError, ElementsError, LinkError, NoAcuError, OrbitError, UsageError
from acu_daemon.orbit.timescales import tai_from_utc

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = ("run", "fake-acu", "demo", "passes", "check", "replay", "arm", "disarm", "clear", "status")


@pytest.mark.parametrize(("is_stopped", "code"), [(True, 0), (False, 1)])
def test_a_safe_stop_tells_by_its_status_whether_it_was_acknowledged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_stopped: bool, code: int
) -> None:
    async def stop(_station: object) -> bool:
        return is_stopped

    monkeypatch.setattr("acu_daemon.cli.safe_stop._stop", stop)
    assert acu_daemon("safe-stop", "--config", write(tmp_path)).code == code


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (UsageError("x"), 2),
        (ConfigError("x"), 2),
        (ElementsError("x"), 2),
        (NoAcuError("x"), 3),
        (OrbitError("x"), 1),
        (LinkError("x"), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_every_kind_of_failure_has_its_exit_status(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: int
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(coming_passes, "load_station", fail)
    done = acu_daemon("passes", "--config", write(tmp_path), "--satellite", "scd")
    assert done.code == code
    assert "Traceback" not in done.err
    if code != 130:
        assert done.err == "acu-daemon: x\n"


def test_an_error_of_ours_ends_with_status_4_and_all_we_know(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise KeyError("surprise")

    monkeypatch.setattr(coming_passes, "load_target", fail)
    done = acu_daemon("passes", "--config", write(tmp_path), "--satellite", "scd")
    assert done.code == app.EXIT_INTERNAL == 4
    assert "KeyError: 'surprise'" in done.err
    assert done.err.endswith("acu-daemon: internal error; please report the lines above\n")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_that_names_its_options(command: str) -> None:
    done = acu_daemon(command, "--help")
    assert done.code == 0
    assert "Usage: " in done.out
    assert command in acu_daemon("--help").out


def test_a_group_runs_its_command_with_only_that_module_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    group = app.Group("Of the sky.", {"coming": ("coming_passes", "command"), "lost": ("no_such_module", "command")})
    monkeypatch.setitem(app.GROUPS, "sky", group)
    done = acu_daemon("sky", "coming", "--help")
    assert done.code == 0
    assert "Usage: acu-daemon sky coming" in done.out
    assert acu_daemon("sky", "coming", "--fast").code == 2
    monkeypatch.setitem(app.GROUPS, "sky", app.Group(group.help, {"coming": ("coming_passes", "command")}))
    for text in (acu_daemon("sky", "--help").out, acu_daemon("sky").err):
        assert "Of the sky." in text
        assert "coming" in text
    assert acu_daemon("sky", "going").code == 2
    assert "sky" in acu_daemon("--help").out


def first_steps() -> list[list[str]]:
    """The commands that the help prints, as they stand there."""
    text = acu_daemon("-h").out
    lines = text.split("First steps")[1].split("`acu-daemon status")[0].splitlines()
    return [shlex.split(line.rstrip(" &")) for line in lines if line.strip().startswith("acu-daemon ")]


def test_the_help_tells_the_first_steps_and_the_exit_statuses() -> None:
    assert [step[1] for step in first_steps()] == ["demo", "passes", "fake-acu", "check", "run"]
    assert "Exit status:" in acu_daemon("-h").out


@pytest.mark.long
def test_the_first_steps_work_as_printed_with_the_configuration_that_is_shipped(tmp_path: Path) -> None:
    """But for the port, which others may use, and the end of the run; they said that elements of 1989 are too old."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    shutil.copytree(ROOT / "config", tmp_path / "config")
    station = tmp_path / "config" / "station.toml"
    station.write_text(replaced(station.read_text(), "127.0.0.1:3842", f"127.0.0.1:{port}"))
    _, passes_step, simulator, check_step, run_step = first_steps()
    environment = os.environ | {"XDG_STATE_HOME": str(tmp_path / "state")}

    def started(step: list[str], *more: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "acu_daemon", *step[1:], *more]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, cwd=tmp_path, env=environment)

    def done(step: list[str], *more: str) -> tuple[int, str, str]:
        with started(step, *more) as process:
            out, errors = process.communicate()
        return process.returncode, out, errors

    code, table, errors = done(passes_step)
    assert (code, errors) == (0, "")
    assert "1989-02-01 01:58:42" in table
    with started(simulator) as fake:
        try:
            assert fake.stdout is not None
            assert any("listening" in line for line in fake.stdout)
            code, checked, _ = done(check_step)
            assert code == 0, checked
            assert "SIMULATION" in checked
            _, log, errors = done(run_step, "--duration", "2.5")
            assert '"acu.identified"' in log, errors
            assert '"reason": "duration over"' in log
        finally:
            fake.terminate()


def test_the_version_is_shown() -> None:
    done = acu_daemon("--version")
    assert (done.code, done.out) == (0, f"acu-daemon {__version__}\n")


@pytest.mark.parametrize("arguments", [("fly",), ("passes", "--fast"), ("passes",)])
def test_wrong_use_of_the_command_line_ends_with_status_2(arguments: tuple[str, ...]) -> None:
    assert acu_daemon(*arguments).code == 2


def test_a_rehearsal_holds_its_time_at_the_start_of_the_process() -> None:
    clock = make_clock("2016-12-31T23:59:60Z", None)
    assert clock.is_rehearsal
    lower = time.monotonic() - PROCESS_START_S
    elapsed = clock.tai_s() - tai_from_utc("2016-12-31T23:59:60Z")
    assert lower - 1e-6 <= elapsed <= time.monotonic() - PROCESS_START_S + 1e-6


def test_a_rehearsal_holds_its_time_at_the_instant_that_is_given() -> None:
    before = time.monotonic()
    clock = make_clock("2026-08-18T12:00:00.5Z", before - 100.0)
    elapsed = clock.tai_s() - tai_from_utc("2026-08-18T12:00:00.5Z")
    assert 100.0 - 1e-6 <= elapsed <= time.monotonic() - before + 100.0 + 1e-6


def test_without_a_rehearsal_the_clock_is_the_systems() -> None:
    assert not make_clock(None, None).is_rehearsal


@pytest.mark.parametrize(
    ("at", "at_monotonic_s", "said"),
    [
        (None, 5.0, "--at-monotonic needs --at"),
        ("2026-08-18", None, "--at '2026-08-18': "),
        ("2026-08-18T12:00:00", None, "expected UTC as YYYY-MM-DDThh:mm:ss"),
        ("2026-08-18T12:00:00Z", float("nan"), "--at-monotonic nan: expected seconds of CLOCK_MONOTONIC"),
        ("2026-08-18T12:00:00Z", float("inf"), "--at-monotonic inf: expected seconds of CLOCK_MONOTONIC"),
    ],
)
def test_a_rehearsal_that_is_not_understood_is_wrong_use(
    at: str | None, at_monotonic_s: float | None, said: str
) -> None:
    with pytest.raises(UsageError) as error:
        make_clock(at, at_monotonic_s)
    assert said in str(error.value)


def test_a_time_of_the_command_line_names_its_option() -> None:
    with pytest.raises(UsageError, match=r"^--from 'noon': 'noon': expected UTC as"):
        parse_utc("--from", "noon")


def test_elements_that_must_not_be_used_stop_a_pass_but_not_a_look(tmp_path: Path) -> None:
    write(tmp_path)
    now = tai_from_utc("1990-01-01T00:00:00Z")
    with pytest.raises(ElementsError, match="days old, the limit is 30 days"):
        load_target(tmp_path, "scd", now)
    assert load_target(tmp_path, "scd", now, is_strict=False).elements.errors


def test_the_pass_in_progress_comes_first_then_the_next_one(tmp_path: Path) -> None:
    write(tmp_path)
    now = tai_from_utc("1989-02-01T00:00:00Z")
    target = load_target(tmp_path, "scd", now)
    first = coming_pass(target, now)
    assert coming_pass(target, first.culmination_tai_s).rise_tai_s == pytest.approx(first.rise_tai_s, abs=0.01)
    assert coming_pass(target, first.set_tai_s + 1.0).rise_tai_s > first.set_tai_s


def test_a_satellite_that_does_not_rise_is_told_with_station_and_time(tmp_path: Path) -> None:
    write(tmp_path, scd=replaced(BROUWER, "inclination_deg = 23.82", "inclination_deg = 0.5"))
    station = tmp_path / "station.toml"
    station.write_text(replaced(station.read_text(), "latitude_deg = -15.53", "latitude_deg = 80.0"))
    now = tai_from_utc("1989-02-01T00:00:00Z")
    with pytest.raises(UsageError) as error:
        coming_pass(load_target(tmp_path, "scd", now), now)
    assert str(error.value) == "no pass of SCD-1 over station above 5 deg within 3 days of 1989-02-01T00:00:00Z"
