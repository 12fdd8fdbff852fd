"""A file of an operator's working directory is never executed, whatever library has its name."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from config_files import write
from structlog.testing import capture_logs
from test_fit_process import PATIENT_S, request, setup

from acu_daemon.edge.fit import FitDiedError, ProcessFitRunner
from acu_daemon.model import Readings

pytestmark = pytest.mark.realtime
NAMES = ("sgp4", "numpy", "structlog", "typer", "pydantic", "serial", "signal", "typing", "json", "pickle", "struct")
SCRIPT = "import sys\nfrom acu_daemon.__main__ import main\nsys.exit(main())\n"


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """A directory with modules that leave a mark when they are executed."""
    directory = tmp_path / "here"
    directory.mkdir()
    for name in NAMES:
        (directory / f"{name}.py").write_text(f"open({str(directory / 'executed')!r}, 'a').write('{name} ')\n")
    return directory


def passes(here: Path, *command: str, **environment: str) -> str:
    """What `passes` says when it is started there."""
    start = ["passes", "--config", str(write(here / "config")), "--from", "1989-02-01T00:00:00Z"]
    done = subprocess.run(
        [*command, *start], cwd=here, env=environment, capture_output=True, text=True, timeout=PATIENT_S
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.mark.parametrize("environment", [{}, {"PYTHONPATH": f":{Path(__file__).parent}"}])
def test_the_command_loads_nothing_of_the_working_directory(here: Path, environment: dict[str, str]) -> None:
    assert "scd" in passes(here, sys.executable, "-m", "acu_daemon", **environment)
    assert not (here / "executed").exists()


def test_the_command_loads_nothing_of_its_scripts_directory(here: Path) -> None:
    (here / "acu-daemon").write_text(SCRIPT)
    link = here.parent / "acu-daemon"
    link.symlink_to(here / "acu-daemon")
    for script in (here / "acu-daemon", link):
        assert "scd" in passes(here, sys.executable, str(script))
    assert not (here / "executed").exists()


async def test_the_fit_process_loads_nothing_of_the_working_directory(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(here)
    runner = ProcessFitRunner(setup(), PATIENT_S)
    reply = await runner.refit(request(0))
    await runner.close()
    assert reply.fit is not None
    assert not (here / "executed").exists()


async def test_why_a_fit_process_died_is_told_by_its_last_words_in_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "numpy").mkdir()
    (tmp_path / "numpy" / "__init__.py").write_text("raise ImportError('this library is broken')\n")
    monkeypatch.syspath_prepend(tmp_path)
    runner = ProcessFitRunner(setup(), PATIENT_S)
    with capture_logs() as lines, pytest.raises(FitDiedError) as error:
        await runner.refit(replace(request(0), readings=Readings(np.empty(0), np.empty(0), np.empty(0))))
    assert str(error.value) == "the fit process died (exit status 1): ImportError: this library is broken"
    said = [line["text"] for line in lines if line["event"] == "fit.process_said"]
    assert said[0] == "Traceback (most recent call last):"
    assert said[-1] == "ImportError: this library is broken"
