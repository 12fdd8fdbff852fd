"""The Dockerfile's own install step in a clean virtual environment, and the commands that come out of it.

No container engine is needed: its COPY and RUN lines are read and done here.
"""

import json
import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from acu_daemon import __version__

pytestmark = pytest.mark.realtime

PROJECT = Path(__file__).resolve().parents[1]
PATIENCE_S = 240.0


def instructions(keyword: str) -> list[str]:
    """Arguments of every instruction of that keyword; the Dockerfile continues no line."""
    lines = (PROJECT / "Dockerfile").read_text().splitlines()
    return [line.partition(" ")[2] for line in lines if line.startswith(keyword + " ")]


@dataclass(frozen=True)
class Installed:
    """A virtual environment with the package in it."""

    scripts: Path
    elsewhere: Path

    def run(self, *command: object) -> "subprocess.CompletedProcess[str]":
        """Run one of its commands, far from the sources."""
        name, *arguments = map(str, command)
        kept = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
        environment = kept | {"STATE_DIRECTORY": str(self.elsewhere)}
        return subprocess.run(
            [self.scripts / name, *arguments],
            cwd=self.elsewhere,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """What the image holds after its install step."""
    copy, venv = tmp_path_factory.mktemp("image"), tmp_path_factory.mktemp("venv")
    for line in instructions("COPY"):
        *sources, target = line.split()
        for source in sources:
            if (PROJECT / source).is_dir():
                shutil.copytree(PROJECT / source, copy / target, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(PROJECT / source, copy / target)
    subprocess.run([sys.executable, "-m", "venv", venv], check=True, timeout=PATIENCE_S)
    (step,) = (line for line in instructions("RUN") if line.startswith("pip install "))
    done = subprocess.run(
        [venv / "bin" / "pip", *shlex.split(step)[1:]],
        cwd=copy,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    shutil.rmtree(copy)  # nothing may lean on the sources any more
    return Installed(venv / "bin", tmp_path_factory.mktemp("elsewhere"))


def test_the_entry_point_works_where_only_the_package_is_installed(installed: Installed) -> None:
    assert installed.run("acu-daemon", "--version").stdout == f"acu-daemon {__version__}\n"
    told = installed.run("acu-daemon", "--help")
    assert told.returncode == 0
    assert "First steps" in told.stdout


def test_the_shipped_configuration_gives_passes(installed: Installed) -> None:
    asked = ("passes", "--config", PROJECT / "config", "--from", "1989-01-31T15:00:00Z", "--days", "1", "--json")
    listed = installed.run("acu-daemon", *asked)
    assert listed.returncode == 0, listed.stderr
    assert len(json.loads(listed.stdout)) > 0


def test_the_files_of_the_demo_are_installed(installed: Installed) -> None:
    script = "from importlib import resources; print(resources.files('acu_daemon.cli') / 'demo_config')"
    config = Path(installed.run("python", "-c", script).stdout.strip())
    assert PROJECT not in config.parents
    listed = installed.run("acu-daemon", "passes", "--config", config, "--from", "2026-08-18T12:00:00Z", "--days", "1")
    assert listed.returncode == 0, listed.stderr
    assert (config / "scenario.toml").is_file()


def test_a_new_station_gets_the_commented_file_that_is_shipped(installed: Installed) -> None:
    place = ("--name", "X", "--latitude", "1", "--longitude", "2", "--height", "3", "--acu", "serial:///dev/nowhere")
    axes = ("--azimuth", "0,360,1,1", "--elevation", "0,90,1,1")
    done = installed.run("acu-daemon", "init", installed.elsewhere / "station", *place, *axes)
    assert done.returncode == 0, done.stderr
    assert "# soft limits and drive limits" in (installed.elsewhere / "station" / "station.toml").read_text()


def test_the_profiles_of_the_sun_are_installed(installed: Installed) -> None:
    done = installed.run("acu-daemon", "groundtrack", "simulate", "--days", "2", "--navigator", "perfect", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["profile"] == "moderate"


def test_the_image_is_slim_and_its_daemon_is_not_root() -> None:
    (base,) = instructions("FROM")
    assert base.startswith("python:3.11-slim")
    (user,) = instructions("USER")
    assert user not in ("root", "0")
    assert any(line.startswith("useradd ") and line.endswith(f" {user}") for line in instructions("RUN"))


def test_the_health_check_is_a_command_that_exists_and_finds_no_daemon_here(installed: Installed) -> None:
    (health,) = instructions("HEALTHCHECK")
    done = installed.run(*json.loads(health.partition("CMD ")[2]))
    assert done.returncode == 1, done.stdout + done.stderr
    assert "NO-GO" in done.stdout


def test_the_image_starts_the_installed_entry_point(installed: Installed) -> None:
    (entry,), (default,) = instructions("ENTRYPOINT"), instructions("CMD")
    *init, command = json.loads(entry)
    assert init == ["tini", "--"]  # a first process without handlers loses every signal
    assert any("apt-get install" in line and "tini" in line.split() for line in instructions("RUN"))
    assert installed.run(command, *json.loads(default)).returncode == 0
