"""D from a station's own recordings: made ones of a simulated satellite, whose truth is known."""

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from command_line import acu_daemon
from config_files import STATION, from_file, write
from groundtrack_world import CRAFT, NODE_RAD, world
from made_element_sets import element_set, omm_text

from acu_daemon.groundtrack.environment import EPOCH_TAI_S, free_motion
from acu_daemon.groundtrack.gps import NO_STEERING, TrueOrbit
from acu_daemon.model import EarthOrientation, Station
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.look import look
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.units import DAY_S, Array

DAYS = 7.0
NOISE_DEG, BIAS_AZ_DEG, BIAS_EL_DEG = 0.03, 0.02, -0.02
LOWEST_DEG, HIGHEST_DEG = 15.0, 75.0
SIGMAS = 4.0
STATION_PLACE = Station("Cuiaba", -15.53, -56.07, 277.0)


@lru_cache
def orbit() -> TrueOrbit:
    return TrueOrbit(free_motion(CRAFT, DAYS + 60.0, world().flux), NODE_RAD)


@lru_cache
def passes() -> list[tuple[Array, Array, Array]]:
    """Time since the start, azimuth and elevation, degrees, every 5 s of a pass a day."""
    found = []
    for day in range(int(DAYS)):
        times_s = day * DAY_S + np.arange(0.0, DAY_S, 5.0)
        r_m, v_m_s = orbit().states(times_s, NO_STEERING)
        seen = look(*itrs_from_teme(r_m, v_m_s, EPOCH_TAI_S + times_s, EarthOrientation()), STATION_PLACE)
        is_up = seen.el_deg > LOWEST_DEG
        starts = np.flatnonzero(is_up & ~np.roll(is_up, 1))
        for start in starts:
            end = int(start + np.argmin(is_up[start:]))
            if end > start + 50 and seen.el_deg[start:end].max() < HIGHEST_DEG:
                found.append((times_s[start:end], seen.az_deg[start:end], seen.el_deg[start:end]))
                break
    return found


def recorded(directory: Path) -> Path:
    rng = np.random.default_rng(8)
    recordings = directory / "recordings"
    recordings.mkdir()
    for times_s, az_deg, el_deg in passes():
        noise = rng.normal(0.0, NOISE_DEG, (2, times_s.size))
        az = (az_deg + BIAS_AZ_DEG + noise[0] / np.cos(np.radians(el_deg))) % 360.0
        el = el_deg + BIAS_EL_DEG + noise[1]
        rows = [f"{utc_text(EPOCH_TAI_S + t, 6)},{a:.5f},{e:.5f},1" for t, a, e in zip(times_s, az, el, strict=True)]
        name = utc_text(EPOCH_TAI_S + times_s[0], 0).replace(":", "")
        (recordings / f"{name}.csv").write_text("\n".join(["utc,az_deg,el_deg,locked", *rows]) + "\n")
    return recordings


def configured(directory: Path) -> Path:
    config = write(directory / "config", STATION, made=from_file("MADE", "omm", "made.json"))
    sets = [element_set(orbit(), NO_STEERING, day * DAY_S + 1000.0) for day in (0.0, 6.0)]
    (config / "satellites" / "made.json").write_text(omm_text(sets))
    return config


def test_d_is_true_within_its_sigma_and_the_next_manoeuvre_has_a_date(tmp_path: Path) -> None:
    recordings, config = recorded(tmp_path), configured(tmp_path)
    (recordings / "notes.csv").write_text("what,when\n")
    png, csv = tmp_path / "d.png", tmp_path / "d.csv"
    done = acu_daemon(
        "groundtrack", "from-passes", recordings, "--config", config, "--satellite", "made", "--json",
        "--limit-m", 6000, "--flux", "moderate", "--ballistic", CRAFT.ballistic_m2_kg, "--cycle", "373/26",
        "--plot", png, "--csv", csv,
    )  # fmt: skip
    assert done.code == 0, done.err
    assert "notes.csv" in done.err
    found = json.loads(done.out)
    assert len(found["d"]) >= len(passes()) - 1 >= 5
    seen, sigma = (np.array([one[key] for one in found["d"]]) for key in ("d_m", "sigma_m"))
    times_s = np.array([tai_from_utc(one["utc"]) for one in found["d"]]) - EPOCH_TAI_S
    left = seen - orbit().drift_m(times_s, NO_STEERING)
    left -= np.average(left, weights=1.0 / sigma**2)
    assert np.all(np.abs(left) < SIGMAS * sigma)
    assert np.sqrt(np.mean((left / sigma) ** 2)) < 1.5
    assert found["manoeuvres"] == []
    assert found["drag_factor"] == pytest.approx(1.0, abs=SIGMAS * found["drag_factor_sigma"])
    ahead_s = np.arange(0.0, 40.0 * DAY_S, 3600.0)
    true_m = orbit().drift_m(ahead_s, NO_STEERING) - np.median(orbit().drift_m(times_s, NO_STEERING))
    reached_s = float(ahead_s[np.argmax(true_m >= 6000.0)])
    said_s = tai_from_utc(found["next_manoeuvre_utc"]) - EPOCH_TAI_S
    assert said_s == pytest.approx(reached_s, abs=DAY_S * max(1.0, SIGMAS * found["next_manoeuvre_sigma_days"]))
    assert png.stat().st_size > 10_000
    assert csv.read_text().startswith("utc,d_m,sigma_m\n")


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({}, "no recording"),
        ({"a.csv": "utc,az_deg,el_deg,locked\n2010-01-01T00:00:00Z,1.0,20.0,1\n"}, "1 locked readings are too few"),
        ({"a.csv": "x,y\n1,2\n"}, "left out:"),
    ],
)
def test_recordings_without_a_pass_are_told(tmp_path: Path, files: dict[str, str], said: str) -> None:
    (tmp_path / "r").mkdir()
    for name, text in files.items():
        (tmp_path / "r" / name).write_text(text)
    config = write(tmp_path / "config")
    done = acu_daemon("groundtrack", "from-passes", tmp_path / "r", "--config", config, "--satellite", "scd")
    assert done.code == 2
    assert said in done.err


def test_passes_of_another_satellite_are_left_out_with_a_word(tmp_path: Path) -> None:
    config = configured(tmp_path)
    (tmp_path / "other").mkdir()
    times_s, az_deg, el_deg = passes()[0]
    backwards = zip(times_s, az_deg[::-1], el_deg[::-1], strict=True)
    rows = [f"{utc_text(EPOCH_TAI_S + t, 6)},{a % 360.0:.5f},{e:.5f},1" for t, a, e in backwards]
    (tmp_path / "other" / "a.csv").write_text("\n".join(["utc,az_deg,el_deg,locked", *rows]) + "\n")
    done = acu_daemon("groundtrack", "from-passes", tmp_path / "other", "--config", config, "--satellite", "made")
    assert done.code == 2
    assert "a.csv, pass of 2010-01-01" in done.err
    assert "left out:" in done.err
    assert "0 element sets or passes are too few" in done.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--flux", "20"), "expected sfu, 50 to 400"),
        (("--flux", "none.csv"), "neither a file nor one of"),
        (("--limit-m", "nan"), "Invalid value for '--limit-m'"),
    ],
)
def test_a_flux_or_a_limit_that_is_none_is_refused(tmp_path: Path, options: tuple[str, ...], said: str) -> None:
    config = write(tmp_path / "config")
    done = acu_daemon("groundtrack", "from-passes", tmp_path, "--config", config, "--satellite", "scd", *options)
    assert done.code == 2
    assert said in done.err


def test_a_directory_that_is_not_there_is_told(tmp_path: Path) -> None:
    config = write(tmp_path / "config")
    done = acu_daemon("groundtrack", "from-passes", tmp_path / "none", "--config", config, "--satellite", "scd")
    assert done.code == 2
    assert "there is no such directory" in done.err
