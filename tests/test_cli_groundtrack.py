"""`groundtrack simulate` and `reproduce`: what they write, and what they say to wrong use."""

import contextlib
import json
import os
import pty
import subprocess
import sys
from datetime import date, timedelta
from pathlib import Path

import pytest
from command_line import acu_daemon

from acu_daemon.edge.flux_file import PROFILES, load_flux
from acu_daemon.groundtrack.environment import EPOCH_TAI_S, even_steps
from acu_daemon.units import DAY_S

KEYS = (
    "profile", "band_m", "controller", "seed", "manoeuvre_count", "sum_m", "largest_m", "smallest_m", "d_min_m",
    "d_max_m", "bound_count", "manoeuvres",
)  # fmt: skip
QUICK = ("--navigator", "perfect", "--days", 40)


def simulate(*options: object) -> str:
    done = acu_daemon("groundtrack", "simulate", *QUICK, *options)
    assert done.code == 0, done.err
    return done.out


def test_a_run_is_written_as_an_object_with_its_manoeuvres(tmp_path: Path) -> None:
    found = json.loads(simulate("--json", "--seed", 3, "--plot", tmp_path / "run.png"))
    assert tuple(found) == KEYS
    assert (found["profile"], found["band_m"], found["controller"], found["seed"]) == ("moderate", 3900.0, "ours", 3)
    sizes = [one["delta_a_m"] for one in found["manoeuvres"]]
    assert found["manoeuvre_count"] == len(sizes) == 1
    assert found["sum_m"] == pytest.approx(sum(sizes), abs=1e-3)
    assert found["manoeuvres"][0]["utc"].startswith("2010-01-")
    assert -4000.0 < found["d_min_m"] < 0.0 < found["d_max_m"] < 4000.0
    assert (tmp_path / "run.png").stat().st_size > 10_000


@pytest.mark.long
def test_several_runs_are_a_list_and_a_table_and_the_same_however_many_processes_run() -> None:
    found = json.loads(simulate("--json", "--runs", 2, "--jobs", 1, "--seed", 3))
    assert [one["seed"] for one in found] == [3, 4]
    assert found[0] == json.loads(simulate("--json", "--seed", 3))
    assert found == json.loads(simulate("--json", "--runs", 2, "--jobs", 2, "--seed", 3))
    table = simulate("--runs", 2, "--jobs", 1, "--seed", 3).splitlines()
    assert len(table) == 3
    assert table[0].startswith("SIMULATION")


def test_a_year_without_a_manoeuvre_has_no_largest_one() -> None:
    found = json.loads(simulate("--json", "--days", 5))
    assert (found["manoeuvre_count"], found["largest_m"], found["smallest_m"]) == (0, None, None)
    assert "-" in simulate("--days", 5)


def test_the_papers_controller_storms_and_departing_air_can_be_asked_for() -> None:
    plain, stormy, paper, departing = (
        json.loads(simulate("--json", *options))
        for options in ((), ("--storms", 8), ("--controller", "paper"), ("--density-error", 0.1))
    )
    assert paper["controller"] == "paper"
    assert len({one["sum_m"] for one in (plain, stormy, paper, departing)}) == 4


def test_the_table_of_the_paper_stands_beside_ours(tmp_path: Path) -> None:
    done = acu_daemon("groundtrack", "reproduce", "--days", 1, "--no-tesserals", "--jobs", 1, "--out", tmp_path / "out")
    assert done.code == 0, done.err
    assert done.out.startswith("SIMULATION")
    for text in ("the paper", "right acceleration", "FITTED to its count", "our controller", "Galski et al. 2001"):
        assert text in done.out
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == [f"figure-{name}.png" for name in ("02", "03", "04-05", "06", "07", "08-09", "10", "11")]


@pytest.mark.realtime
@pytest.mark.parametrize("runs", [1, 2])
def test_on_a_terminal_the_command_draws_its_bar(runs: int) -> None:
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "acu_daemon", "groundtrack", "simulate", *map(str, QUICK), "--runs", str(runs)]
    with subprocess.Popen([*command, "--jobs", "1"], stdout=subprocess.PIPE, stderr=theirs, text=True) as process:
        os.close(theirs)
        drawn = b""
        with contextlib.suppress(OSError):  # which ends what a pseudo terminal gives
            while got := os.read(ours, 4096):
                drawn += got
        assert process.stdout is not None
        assert process.stdout.read().startswith("SIMULATION")
    os.close(ours)
    assert process.returncode == 0
    assert ("SIMULATION, runs" if runs > 1 else "SIMULATION, days") in drawn.decode()


@pytest.mark.parametrize("name", PROFILES)
def test_the_profiles_cover_the_year_with_what_the_forecast_looks_at(name: str) -> None:
    flux = load_flux(name)
    assert flux.start_tai_s <= EPOCH_TAI_S - 41.0 * DAY_S
    assert flux.end_tai_s >= EPOCH_TAI_S + (365.0 + 120.0) * DAY_S
    assert flux.f107.max() <= 300.0


def test_the_moderate_profile_is_that_of_the_paper() -> None:
    year = load_flux("moderate").at(even_steps(EPOCH_TAI_S + 0.5 * DAY_S, DAY_S, 365)).f107
    assert year.max() == pytest.approx(165.0, abs=1.0)
    assert year.min() == pytest.approx(115.0, abs=1.5)


def made_profile(
    path: Path, *, days: int = 600, skip: int | None = None, flux: str = "120", first: date = date(2009, 11, 1)
) -> Path:
    rows = [f"{first + timedelta(days=day)},{flux},2.0" for day in range(days) if day != skip]
    path.write_text("\n".join(["date,f107_sfu,kp", *rows]) + "\n")
    return path


def test_a_profile_of_ones_own_is_taken(tmp_path: Path) -> None:
    path = made_profile(tmp_path / "mine.csv")
    assert json.loads(simulate("--json", "--profile", path))["profile"] == str(path)


def test_a_profile_of_other_years_begins_with_its_first_day(tmp_path: Path) -> None:
    found = json.loads(simulate("--json", "--profile", made_profile(tmp_path / "later.csv", first=date(2024, 3, 1))))
    assert found["manoeuvres"][0]["utc"].startswith("2024-")


def test_fluxes_outside_the_fit_are_warned_of(tmp_path: Path) -> None:
    done = acu_daemon("groundtrack", "simulate", *QUICK, "--profile", made_profile(tmp_path / "hot.csv", flux="350"))
    assert done.code == 0
    assert "on 40 of 40 days the flux" in done.err
    assert "outside 0 to 300" in done.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--profile", "nowhere"), "neither a file nor one of moderate, critical"),
        (("--controller", "theirs"), "--controller theirs: expected one of"),
        (("--band-m", "0"), "expected half the band's width"),
        (("--days", "9999"), "the days the profile moderate covers"),
        (("--plot", "/nowhere/x.png"), "there is no directory"),
        (("--runs", "2", "--dask", "nonsense://x"), "--dask nonsense://x"),
    ],
)
def test_wrong_use_is_told(options: tuple[str, ...], said: str) -> None:
    done = acu_daemon("groundtrack", "simulate", "--navigator", "perfect", *options)
    assert done.code == 2
    assert said in done.err


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"skip": 200}, "does not follow 2010-05-19; a flux is needed for every day"),
        ({"flux": "high"}, "line 2: expected date,f107_sfu,kp"),
        ({"flux": "1200"}, "a flux of 1200 sfu"),
        ({"days": 0}, "no days below the header"),
    ],
)
def test_a_profile_that_is_none_is_told_with_its_line(tmp_path: Path, change: dict[str, object], said: str) -> None:
    path = made_profile(tmp_path / "bad.csv", **change)  # type: ignore[arg-type]
    done = acu_daemon("groundtrack", "simulate", *QUICK, "--profile", path)
    assert done.code == 2
    assert said in done.err
