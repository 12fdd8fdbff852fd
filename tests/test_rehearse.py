"""`acu-daemon rehearse`, and `run --acu`: what is planned and refused; one flight is flown by real processes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from config_files import BROUWER, STATION, replaced, write

from acu_daemon.assist.mount_model import encoder_look
from acu_daemon.cli import rehearse
from acu_daemon.cli.options import Target, coming_pass, load_target
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.report.pass_trace import figures_table, measure, read_trace, until
from acu_daemon.sim.scenario import read_scenario

NOW = tai_from_utc("1989-02-01T00:00:00Z")
PATIENCE_S = 120.0


def scd(directory: Path) -> Target:
    return load_target(write(directory), "scd", NOW)


def test_a_rehearsal_is_of_the_next_pass_from_before_its_rise_to_its_set(tmp_path: Path) -> None:
    target = scd(tmp_path)
    coming = coming_pass(target, NOW)
    flown = rehearse._planned(target, NOW, 30.0, None, 0, tmp_path)
    assert flown.start_tai_s == pytest.approx(coming.rise_tai_s - 30.0)
    assert flown.end_tai_s == pytest.approx(coming.set_tai_s)
    later = rehearse._planned(target, NOW, -60.0, 90.0, 2, tmp_path)
    assert later.coming.rise_tai_s > coming.set_tai_s + 3600.0
    assert later.start_tai_s == pytest.approx(later.coming.rise_tai_s + 60.0)
    assert later.seconds == pytest.approx(90.0)


@pytest.mark.parametrize(("before_s", "duration_s"), [(-3000.0, None), (30.0, 31.0), (1e9, None), (float("nan"), 20.0)])
def test_a_rehearsal_with_nothing_to_fly_is_refused(tmp_path: Path, before_s: float, duration_s: float | None) -> None:
    with pytest.raises(UsageError, match=r"^--before"):
        rehearse._planned(scd(tmp_path), NOW, before_s, duration_s, 0, tmp_path)


def test_the_scenario_of_a_rehearsal_loses_the_signal_twice_within_it_and_can_be_given_back(tmp_path: Path) -> None:
    flown = rehearse._planned(scd(tmp_path), NOW, 20.0, None, 0, tmp_path / "out")
    written = rehearse._scenario(flown, None, has_losses=True)
    read = read_scenario(written)
    windows = [loss.window_tai_s(flown.start_tai_s) for loss in read.losses]
    assert [loss.cause for loss in read.losses] == ["receiver", "silence-zone"]
    assert flown.coming.rise_tai_s < windows[0][0] < windows[0][1] < windows[1][0] < windows[1][1] < flown.end_tai_s
    assert read.sky.along_track_s == rehearse.ALONG_TRACK_S
    assert read.acu.azimuth_deg % 360.0 == pytest.approx(flown.coming.rise_az_deg % 360.0, abs=0.1)
    assert rehearse._scenario(flown, written, has_losses=True) == written
    assert read_scenario(rehearse._scenario(flown, None, has_losses=False)).losses == ()


@pytest.mark.parametrize(
    ("az_deg", "low_deg", "high_deg", "stands_deg"),
    [
        (100.0, -270.0, 270.0, 100.0),
        (300.0, -270.0, 270.0, -60.0),
        (355.0, 0.0, 450.0, 355.0),
        (2.0, 10.0, 350.0, 10.0),
    ],
)
def test_the_antenna_of_a_rehearsal_stands_at_the_rise_within_its_limits_with_room_either_way(
    az_deg: float, low_deg: float, high_deg: float, stands_deg: float
) -> None:
    limits = rehearse.AxisLimits(low_deg, high_deg, 1.0, 1.0)
    assert rehearse._held(rehearse._in_the_middle(az_deg, limits), limits) == pytest.approx(stands_deg)


def test_another_acu_is_for_a_rehearsal_or_is_said_to_move_the_same_antenna(tmp_path: Path) -> None:
    refused = acu_daemon("run", "--config", write(tmp_path), "--satellite", "scd", "--acu", "tcp://127.0.0.1:9")
    assert refused.code == 2
    assert "--same-antenna" in refused.err
    assert "--at" in refused.err


def test_an_acu_that_is_not_simulated_here_is_said(tmp_path: Path) -> None:
    epoch = utc_text(rehearse.SystemClock().tai_s(), 0)
    station = replaced(STATION, "[acu]\n", '[acu]\ndialect = "rotctl"\n') + '[receiver]\nsignal = "none"\n'
    config = write(tmp_path, station, scd=replaced(BROUWER, "1989-01-31T09:58:00Z", epoch))
    done = acu_daemon("rehearse", "--config", config, "--satellite", "scd")
    assert done.code == 2
    assert 'dialect = "rotctl"' in done.err


@pytest.mark.parametrize("skip", range(8))
def test_the_antenna_of_a_rehearsal_stands_on_a_turn_that_holds_the_pass(tmp_path: Path, skip: int) -> None:
    flown = rehearse._planned(scd(tmp_path), NOW, 2.0, None, skip, tmp_path)
    az_deg, el_deg = rehearse._first_direction(flown)
    assert flown.target.station.acu.azimuth.limits() == rehearse.AxisLimits(-270.0, 270.0, 20.0, 10.0)
    look = encoder_look(
        flown.target.elements.propagator,
        np.arange(flown.coming.rise_tai_s, flown.coming.set_tai_s, 1.0),
        flown.target.station.site,
        None,
    )
    path_deg = np.degrees(np.unwrap(np.radians(look.az_deg)))
    path_deg += az_deg - path_deg[0]
    assert (az_deg - float(look.az_deg[0])) % 360.0 == pytest.approx(0.0, abs=1e-6)
    assert el_deg == pytest.approx(float(look.el_deg[0]))
    assert path_deg.min() >= -270.0
    assert path_deg.max() <= 270.0


@pytest.mark.realtime
def test_a_pass_of_tonight_is_rehearsed_with_one_command_and_the_stations_own_acu_is_let_alone(tmp_path: Path) -> None:
    epoch = utc_text(rehearse.SystemClock().tai_s(), 0)
    config = write(tmp_path / "config", scd=replaced(BROUWER, "1989-01-31T09:58:00Z", epoch))
    command = [sys.executable, "-m", "acu_daemon", "rehearse", "--config", str(config), "--satellite", "scd"]
    done = subprocess.run(
        [*command, "--before", "2", "--duration", "13", "--out", str(tmp_path / "out"), "--web", "127.0.0.1:0"],
        env=os.environ | {"XDG_STATE_HOME": str(tmp_path / "state")},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("REHEARSAL on a SIMULATION: SCD-1")
    assert '"page.open"' in done.stdout
    assert re.search(r"on the satellite at the end +yes", done.stdout)
    assert '"signal is lost"' in done.stdout or "the signal is lost" in done.stdout
    out = tmp_path / "out" / "scd"
    assert {path.name for path in out.iterdir()} > {"trace.csv", "readings.csv", "rehearsal.png", "scenario.toml"}
    trace = read_trace(out / "trace.csv")
    assert measure(until(trace, float(trace.tai_s[-20])), 1.0).seconds < measure(trace, 1.0).seconds
    assert figures_table({"this": measure(trace, 1.0)})[0].startswith("SIMULATION")


def test_a_rehearsal_that_was_ended_early_says_so_and_claims_nothing_of_losses_that_it_did_not_fly(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flown = rehearse._planned(scd(tmp_path), NOW, 0.0, None, 0, tmp_path)
    head = "utc,boresight_az_deg,boresight_el_deg,satellite_az_deg,satellite_el_deg,beam_error_deg,mode,acquired,signal"
    rows = [
        f"{utc_text(flown.start_tai_s + 0.1 * k, 3)},10,{5 + 0.01 * k},10,{5 + 0.01 * k},0.01,AUTOTRACK,1,1"
        for k in range(80)
    ]
    (tmp_path / "trace.csv").write_text("\n".join([head, *rows]) + "\n")
    assert rehearse._report(flown, tmp_path / "scenario.toml")
    told = capsys.readouterr().out
    assert "Ended early, after 0:08 of " in told
    assert "throughout." in told
    (tmp_path / "trace.csv").write_text("\n".join([head, *(row.replace(",1,1", ",0,1") for row in rows)]) + "\n")
    assert not rehearse._report(flown, tmp_path / "scenario.toml")
    assert "never acquired" in capsys.readouterr().out
