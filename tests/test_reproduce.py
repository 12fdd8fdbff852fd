"""The reproduction of the papers' tables: reference orbit, errors put in, and one row of the table."""

import contextlib
import json
import os
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from tables.bound import bounds_deg
from tables.errors_put_in import (
    azimuth_model_deg,
    draw_errors,
    elevation_model_deg,
    readings_with,
    taken_as_mean,
    turned_to_mean,
)
from tables.methods import METHODS
from tables.reference_orbit import TabulatedOrbit, integrate
from tables.rows import Spread
from tables.seed_001 import sky_angles_deg
from tables.seed_figures import ORBIT, PASSES
from tables.simulate import largest_errors_deg
from tables.true_pass import TruePass, true_passes

from acu_daemon.errors import OrbitError

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "reproduce_tables.py"
needs_brahe = pytest.mark.skipif(
    find_spec("brahe") is None, reason="the reference orbit needs the extra `accuracy` (brahe)"
)


@pytest.fixture(scope="module")
def second_pass() -> TruePass:
    return true_passes(PASSES[:1])[0]


def test_a_table_of_an_orbit_is_right_between_its_steps() -> None:
    radius_m, rate_rad_s = 7.2e6, 1.0e-3
    angle = rate_rad_s * np.arange(0.0, 101.0, 10.0)
    zero = np.zeros_like(angle)
    r_m = radius_m * np.stack((np.cos(angle), np.sin(angle), zero), axis=1)
    v_m_s = radius_m * rate_rad_s * np.stack((-np.sin(angle), np.cos(angle), zero), axis=1)
    found_m, found_m_s = TabulatedOrbit(0.0, 10.0, r_m, v_m_s).states_teme(np.array([0.0, 33.0, 100.0]))
    at = rate_rad_s * np.array([0.0, 33.0, 100.0])
    assert found_m[:, 0] == pytest.approx(radius_m * np.cos(at), abs=2e-3)
    assert found_m_s[:, 1] == pytest.approx(radius_m * rate_rad_s * np.cos(at), abs=1e-3)


def test_a_table_of_an_orbit_has_no_answer_outside_itself() -> None:
    orbit = TabulatedOrbit(0.0, 10.0, np.ones((3, 3)), np.ones((3, 3)))
    with pytest.raises(OrbitError, match="not tabulated"):
        orbit.states_teme(np.array([20.1]))


def test_bias_and_noise_have_the_sizes_that_the_papers_print() -> None:
    el_deg, range_km = np.array([5.0, 15.9]), np.array([2300.0, 1500.0])  # pass 2: Kuga and Carrara 1990, table 2
    assert azimuth_model_deg(el_deg, range_km) == pytest.approx([0.06, 0.06], abs=0.005)
    assert elevation_model_deg(el_deg)[0] == pytest.approx(0.18, abs=0.005)


def test_means_turned_from_a_state_give_the_state_back() -> None:
    state = np.concatenate(ORBIT.state_teme())
    epoch = np.array([0.0])
    again = np.concatenate(turned_to_mean(state, 0.0).states_teme(epoch), axis=1)[0]
    assert again == pytest.approx(state, abs=1e-2)
    as_mean = np.concatenate(taken_as_mean(state, 0.0).states_teme(epoch), axis=1)[0]
    assert as_mean == pytest.approx(state, abs=1e-5)


def test_a_figure_of_the_papers_is_compared_to_the_decimals_they_print() -> None:
    spread = Spread(0.20, 0.104, 0.296)
    assert spread.holds(0.10)
    assert spread.holds(0.30)
    assert not spread.holds(0.31)


def test_the_angle_between_directions_near_the_zenith_is_small() -> None:
    angle = sky_angles_deg(*(np.array([value]) for value in (0.0, 89.9, 180.0, 89.9)))
    assert angle[0] == pytest.approx(0.2, abs=1e-9)


@needs_brahe
def test_the_table_of_the_reference_orbit_agrees_with_the_integrator_between_its_steps() -> None:
    coarse, fine = integrate(ORBIT, 600.0), integrate(ORBIT, 600.0, step_s=1.0)
    tai_s = coarse.epoch_tai_s + np.arange(0.0, 600.0, 7.0)
    assert np.abs(coarse.states_teme(tai_s)[0] - fine.states_teme(tai_s)[0]).max() < 0.02


@pytest.mark.long
@needs_brahe
def test_the_second_pass_has_the_geometry_of_the_papers(second_pass: TruePass) -> None:
    assert second_pass.duration_s == pytest.approx(450.0, abs=5.0)  # Kuga and Carrara 1990, table 1: 7:30
    assert second_pass.culmination_deg == pytest.approx(15.9, abs=0.1)


@needs_brahe
def test_readings_of_a_run_have_the_bias_and_the_noise_of_the_model(second_pass: TruePass) -> None:
    runs = [draw_errors(np.random.default_rng(k), second_pass.tai_s.size) for k in range(50)]
    off = np.array([readings_with(errors, second_pass).el_deg - second_pass.el_deg for errors in runs])
    model = elevation_model_deg(second_pass.el_deg)
    assert np.mean(off / model) == pytest.approx(1.0, abs=0.03)
    assert np.std(off / model) == pytest.approx(1.0, abs=0.03)


@needs_brahe
def test_more_readings_lower_the_bound_and_the_papers_methods_stay_above_it(second_pass: TruePass) -> None:
    bounds = bounds_deg(second_pass, np.random.default_rng(0))
    assert bounds == sorted(bounds, reverse=True)
    runs = [draw_errors(np.random.default_rng(k), second_pass.tai_s.size) for k in range(9)]
    for name in ("deterministic", "kalman"):
        eps_deg = np.median([largest_errors_deg(second_pass, METHODS[name], errors) for errors in runs], axis=0)
        assert np.all(eps_deg > bounds)


@pytest.mark.long
@needs_brahe
def test_the_command_writes_the_rows_as_json(tmp_path: Path) -> None:
    out = tmp_path / "rows.json"
    command = [sys.executable, str(SCRIPT), "--runs", "2", "--only", "alcantara 2", "--json", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = json.loads(out.read_text())["rows"]
    assert [row["used_s"] for row in rows] == [60, 210, 360]
    assert set(rows[0]) == {
        *("station", "pass", "used_s", "seed_deterministic_deg", "seed_kalman_deg", "bound_deg", "methods")
    }
    assert set(rows[0]["methods"]) == {"full", "deterministic", "kalman"}
    assert set(rows[0]["methods"]["full"]) == {"median_deg", "p05_deg", "p95_deg"}
    assert "[####" in done.stderr


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--methods", "oracle"), "no method 'oracle'"),
        (("--seed", "-1"), "--seed must be 0 or more"),
        (("--json", "DIR"), "DIR is a directory; give a file's name"),
        (("--json", "DIR/no/rows.json"), "DIR/no/rows.json: there is no directory DIR/no; make it first"),
        (("--plot", "DIR/rows.abc"), "DIR/rows.abc: expected a name that ends in .png, .svg, .pdf or the like"),
        (("--plot", "DIR/no/rows.png"), "there is no directory DIR/no; make it first"),
        (("--figures", "DIR/file/figures"), "DIR/file/figures cannot be made a directory: Not a directory"),
    ],
)
def test_what_the_command_cannot_do_is_told_before_it_computes(
    tmp_path: Path, arguments: tuple[str, ...], said: str
) -> None:
    (tmp_path / "file").touch()
    command = [sys.executable, str(SCRIPT), *(text.replace("DIR", str(tmp_path)) for text in arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert said in done.stderr.replace(str(tmp_path), "DIR")


INTERRUPTIBLE = """
import signal
import time
from acu_daemon.edge.campaign import run_campaign
from tables.workers import run_script

signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell's background jobs ignore

def main():
    print("begun", flush=True)
    run_campaign(time.sleep, [60.0] * 9, jobs=2)
    return 0

run_script(main)
"""


def test_ctrl_c_ends_a_computation_with_all_its_processes_and_one_line() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTIBLE],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(SCRIPT.parent)},
        start_new_session=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        for _ in range(5):  # Python misses a signal that comes in the instant before it waits
            os.killpg(process.pid, signal.SIGINT)  # as a terminal does
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(10.0)
                break
        _, said = process.communicate(timeout=10.0)
    assert (process.returncode, said) == (130, "interrupted\n")
