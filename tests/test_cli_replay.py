"""`acu-daemon replay`: the files as the design says, on a real pass, and every wrong use with exit status 2."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import real_passes
from command_line import Done, acu_daemon
from config_files import STATION, from_file, replaced, write
from conftest import DATA, needs_data
from real_passes import RealPass, noisy, sky_angles_deg

from acu_daemon.assist.estimators.estimator import ESTIMATORS
from acu_daemon.assist.session.estimator_comparison import compare
from acu_daemon.assist.session.replay_readings import Replayed
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.edge.recording import RecordingWriter
from acu_daemon.edge.recording_whose import ElementsUsed, Whose, save_whose
from acu_daemon.model import Reading
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S, Array

PASS = "sentinel-3a-CachoeiraPaulista-20181225T0140"
HEADER = "utc,az_deg,el_deg,locked"
NOISE_DEG = 0.03


def station_of(real: RealPass) -> str:
    station = real.site.station
    text = STATION
    for old, new in (
        ("latitude_deg = -15.53", f"latitude_deg = {station.latitude_deg}"),
        ("longitude_deg = -56.07", f"longitude_deg = {station.longitude_deg}"),
        ("height_m = 277.0", f"height_m = {float(station.height_m)}"),
    ):
        text = replaced(text, old, new)
    time = f"[time]\nut1_utc_s = {real.site.orientation.ut1_utc_s}\n"
    return f"{text}{time}[atmosphere]\nrefraction = false\n"  # the truth is geometric


@pytest.fixture
def real() -> RealPass:
    return real_passes.load(PASS)


@pytest.fixture
def config(tmp_path: Path, real: RealPass) -> Path:
    directory = write(tmp_path / "config", station_of(real), sat=from_file("SENTINEL-3A", "tle", "sat.tle"))
    (directory / "satellites" / "sat.tle").write_bytes((DATA / "passes" / f"{PASS}.tle").read_bytes())
    return directory


def recorded(
    path: Path, real: RealPass, share: float = 1.0, step_s: float = 5.0, lost_from: float = 0.6
) -> tuple[Path, tuple[Array, Array]]:
    """A recording of the begin of the pass, angles empty after the loss; and the true sky."""
    tai_s = np.arange(real.tai_s[0], real.tai_s[0] + share * (real.tai_s[-1] - real.tai_s[0]), step_s)
    sky = real.sky(tai_s)
    seen = noisy(*sky, tai_s, NOISE_DEG, np.random.default_rng(5))
    rows = [HEADER]
    for count, (time, az, el) in enumerate(zip(tai_s.tolist(), seen.az_deg, seen.el_deg, strict=True)):
        is_locked = count < lost_from * tai_s.size
        rows.append(f"{utc_text(time, 6)},{az:.5f},{el:.5f},1" if is_locked else f"{utc_text(time, 6)},,,0")
    path.write_text("\n".join(rows) + "\n")
    return path, sky


def replay(config: Path, readings: Path, out: Path, *more: str, satellite: str = "sat") -> Done:
    return acu_daemon(
        "replay", "--config", config, "--satellite", satellite, "--readings", readings, "--out", out, *more
    )


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.long
@needs_data
@pytest.mark.parametrize("estimator", [None, *sorted(ESTIMATORS)])
def test_a_real_pass_is_predicted_through_its_loss_in_the_format_of_the_design(
    tmp_path: Path, config: Path, real: RealPass, estimator: str | None
) -> None:
    readings, sky = recorded(tmp_path / "in.csv", real)
    out = tmp_path / "out.csv"
    done = replay(config, readings, out, *(["--estimator", estimator] if estimator else []))
    assert (done.code, done.out) == (0, "")
    assert done.err == "readings left out of the fit: 1 not acquired for the dwell time yet\n"
    text = out.read_bytes()
    assert text.startswith(b"utc,az_deg,el_deg,sigma_deg,source\n")
    assert text.endswith(b"\n")
    assert b"\r" not in text
    rows = rows_of(out)
    asked = rows_of(readings)
    assert [row["utc"] for row in rows] == [row["utc"] for row in asked]
    for row in rows:
        assert re.fullmatch(r"\d{1,3}\.\d{5}", row["az_deg"])
        assert re.fullmatch(r"-?\d{1,2}\.\d{5}", row["el_deg"])
        assert 0.0 <= float(row["az_deg"]) < 360.0
        assert (row["sigma_deg"] != "") == (estimator in (None, "full") and row["source"].endswith("FITTED"))
        assert row["source"] in list(TrackState)
    lost = np.array([row["locked"] == "0" for row in asked])
    az, el = (np.array([float(row[key]) for row in rows]) for key in ("az_deg", "el_deg"))
    assert sky_angles_deg(az, el, *sky)[lost].max() < 0.1
    assert {row["source"] for row, is_lost in zip(rows, lost, strict=True) if is_lost} == {"HOLD/FITTED"}


@pytest.mark.long
@needs_data
def test_all_estimators_are_compared_in_files_beside_the_named_one_a_table_and_a_picture(
    tmp_path: Path, config: Path, real: RealPass
) -> None:
    readings, (az_deg, el_deg) = recorded(tmp_path / "in.csv", real)
    lines = readings.read_text().splitlines()
    for k, line in enumerate(lines[1:]):
        if line.endswith(",,,0"):
            lines[k + 1] = line.replace(",,,0", f",{az_deg[k]:.5f},{el_deg[k]:.5f},0")
    readings.write_text("\n".join(lines) + "\n")
    done = replay(config, readings, tmp_path / "out.csv", "--estimator", "all")
    assert done.code == 0, done.err
    made = {path.name for path in tmp_path.glob("out*")}
    assert made == {"out.png", *(f"out-{name}.csv" for name in ESTIMATORS)}
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
    what, _, header, *table = done.out.splitlines()
    counts = [row.split(maxsplit=1) for row in table[len(ESTIMATORS) + 2 :]]
    assert counts == [[name, "1 not acquired for the dwell time yet"] for name in ESTIMATORS]
    table = table[: len(ESTIMATORS)]
    assert what.startswith(f"Prediction against {sum(line.endswith(',0') for line in lines)} readings without lock")
    assert header.split()[:4] == ["estimator", "median", "deg", "95"]
    assert [row.split()[0] for row in table] == list(ESTIMATORS)
    for row in table:
        median_deg, p95_deg, worst_deg = map(float, row.split()[1:4])
        assert median_deg <= p95_deg <= worst_deg < 0.1
        assert re.search(r" \d+\.\d{3} s (early|late), [+-]\d\.\d{4} deg across +\d+\.\d\d$", row)
    alone = tmp_path / "alone.csv"
    assert replay(config, readings, alone, "--estimator", "full").code == 0
    assert alone.read_bytes() == (tmp_path / "out-full.csv").read_bytes()


@needs_data
def test_a_single_estimator_has_its_picture_and_table_and_an_antenna_that_stopped_is_not_compared(
    tmp_path: Path, config: Path, real: RealPass
) -> None:
    readings, (az_deg, el_deg) = recorded(tmp_path / "in.csv", real)
    lines = readings.read_text().splitlines()
    lost = [k for k, line in enumerate(lines[1:]) if line.endswith(",,,0")]
    stop = lost[len(lost) // 2]  # followed up to here, then it stands still
    for k in lost:
        lines[k + 1] = lines[k + 1].replace(",,,0", f",{az_deg[min(k, stop)]:.5f},{el_deg[min(k, stop)]:.5f},0")
    readings.write_text("\n".join(lines) + "\n")
    picture = tmp_path / "one.png"
    done = replay(config, readings, tmp_path / "out.csv", "--estimator", "full", "--plot", str(picture))
    assert done.code == 0, done.err
    assert picture.read_bytes().startswith(b"\x89PNG")
    what, _, _, row, *_ = done.out.splitlines()
    stood = re.search(r"against (\d+) readings .*Not compared: (\d+) without lock while the antenna stood", what)
    assert stood is not None
    compared, left_out = map(int, stood.groups())
    assert compared + left_out == len(lost)
    assert left_out == pytest.approx(len(lost) - 1 - len(lost) // 2, abs=1)
    assert float(row.split()[3]) < 0.1


@pytest.mark.long
@needs_data
def test_the_readings_of_another_satellite_are_told_as_that_with_status_1(
    tmp_path: Path, config: Path, real: RealPass
) -> None:
    readings, _ = recorded(tmp_path / "in.csv", real, share=0.5)
    lines = (config / "satellites" / "sat.tle").read_text().splitlines()
    first, second = lines[-2:]
    node = f"{(float(second[17:25]) + 90.0) % 360.0:8.4f}"  # another plane
    second = second[:17] + node + second[25:68]
    digits = sum(int(one) if one.isdigit() else one == "-" for one in second)
    (config / "satellites" / "sat.tle").write_text("\n".join([*lines[:-2], first, f"{second}{digits % 10}"]) + "\n")
    done = replay(config, readings, tmp_path / "out.csv")
    assert done.code == 1, done.err
    assert "probably not this satellite, NORAD 41335: no orbit near the elements goes through" in done.err
    assert len(rows_of(tmp_path / "out.csv")) == len(rows_of(readings))


@needs_data
def test_a_recording_that_says_it_is_of_another_satellite_is_told_as_that(
    tmp_path: Path, config: Path, real: RealPass
) -> None:
    readings, _ = recorded(tmp_path / "in.csv", real, share=0.3)
    used = ElementsUsed("tle", "2018-12-25T00:00:00Z")
    mine = Whose(real.site.station, "SENTINEL-3A", None, used)
    save_whose(readings, mine, "2018-12-25T01:40:00Z")
    assert replay(config, readings, tmp_path / "out.csv").code == 0
    (tmp_path / "in.csv.json").unlink()
    save_whose(readings, replace(mine, satellite="NOAA-20"), "2018-12-25T01:40:00Z")
    done = replay(config, readings, tmp_path / "out.csv")
    assert done.code == 1
    assert "probably not this satellite" in done.err
    assert "in.csv is of NOAA-20 over" in done.err
    (tmp_path / "in.csv.json").unlink()
    elsewhere = replace(mine.station, name="ELSEWHERE", longitude_deg=mine.station.longitude_deg + 1.0)
    save_whose(readings, replace(mine, station=elsewhere), "2018-12-25T01:40:00Z")
    done = replay(config, readings, tmp_path / "out.csv")
    assert done.code == 1
    assert "in.csv is of SENTINEL-3A over ELSEWHERE" in done.err
    (tmp_path / "in.csv.json").write_text("{")
    done = replay(config, readings, tmp_path / "out.csv")
    assert done.code == 0
    assert "warning: whose the recording is cannot be read" in done.err


@needs_data
def test_a_second_run_writes_the_same_bytes(tmp_path: Path, config: Path, real: RealPass) -> None:
    readings, _ = recorded(tmp_path / "in.csv", real, share=0.3)
    for name in ("one", "two"):
        assert replay(config, readings, tmp_path / name).code == 0
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    assert {"AUTOTRACK/FITTED", "HOLD/FITTED"} <= {row["source"] for row in rows_of(tmp_path / "one")}


@needs_data
def test_windows_files_and_blank_lines_give_the_same_predictions(tmp_path: Path, config: Path, real: RealPass) -> None:
    readings, _ = recorded(tmp_path / "in.csv", real, share=0.3)
    other = tmp_path / "windows.csv"
    other.write_bytes(b"\xef\xbb\xbf" + readings.read_bytes().replace(b"\n", b"\r\n") + b"\r\n")
    replay(config, readings, tmp_path / "one")
    assert replay(config, other, tmp_path / "two").code == 0
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


@pytest.mark.long
@needs_data
def test_what_is_recorded_later_changes_no_earlier_line(tmp_path: Path, config: Path, real: RealPass) -> None:
    readings, _ = recorded(tmp_path / "in.csv", real, share=0.5)
    lines = readings.read_text().splitlines()
    cut = len(lines) // 2
    shifted = [re.sub(r",\d+\.", ",7.", line) if line.endswith("1") else line for line in lines[cut:]]
    assert shifted != lines[cut:]
    other = tmp_path / "other.csv"
    other.write_text("\n".join(lines[:cut] + shifted) + "\n")
    replay(config, readings, tmp_path / "one")
    replay(config, other, tmp_path / "two")
    one, two = ((tmp_path / name).read_text().splitlines() for name in ("one", "two"))
    assert one[: cut + 1] == two[: cut + 1]
    assert one != two


@pytest.mark.long
@needs_data
def test_what_the_daemon_records_can_be_replayed(tmp_path: Path, config: Path, real: RealPass) -> None:
    tai_s = np.arange(real.tai_s[0], real.tai_s[60], 0.1)
    az_deg, el_deg = real.sky(tai_s)
    path = tmp_path / "recorded.csv"
    with RecordingWriter(path) as recording:
        for row in zip(tai_s.tolist(), az_deg.tolist(), el_deg.tolist(), strict=True):
            recording.add(Reading(*row, is_locked=True))
    assert replay(config, path, tmp_path / "out.csv").code == 0
    assert len(rows_of(tmp_path / "out.csv")) == tai_s.size


@needs_data
def test_the_age_of_elements_counts_at_the_recording_and_old_ones_are_refused(
    tmp_path: Path, config: Path, real: RealPass
) -> None:
    path = tmp_path / "in.csv"
    path.write_text(f"{HEADER}\n{utc_text(float(real.tai_s[0]) + 60 * DAY_S)},,,0\n")
    done = replay(config, path, tmp_path / "out.csv")
    assert done.code == 2
    assert re.search(r"sat\.tle, line 1: .* days old, the limit is 30 days; fetch newer elements", done.err)
    assert not (tmp_path / "out.csv").exists()


@needs_data
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "in.csv, line 1: expected the header utc,az_deg,el_deg,locked, found ''"),
        (f"{HEADER}\n", "in.csv: no readings below the header"),
        ("utc,az,el,lock\n", "in.csv, line 1: expected the header"),
        (
            f"{HEADER}\n2018-12-25T01:40:00Z,1,2,1\n2018-12-25T01:40:00Z,1,2,1\n",
            "line 3: 2018-12-25T01:40:00Z is not la",
        ),
        (f"{HEADER}\n2018-12-25T01:40:00,1,2,1\n", "line 2: '2018-12-25T01:40:00': expected UTC"),
    ],
)
def test_a_recording_that_cannot_be_used_is_told_by_its_line(
    tmp_path: Path, config: Path, text: str, said: str
) -> None:
    path = tmp_path / "in.csv"
    path.write_text(text)
    done = replay(config, path, tmp_path / "out.csv")
    assert done.code == 2
    assert said in done.err
    assert "Traceback" not in done.err
    assert not (tmp_path / "out.csv").exists()


@needs_data
def test_wrong_use_ends_with_status_2_and_a_reason(tmp_path: Path, config: Path, real: RealPass) -> None:
    readings, _ = recorded(tmp_path / "in.csv", real, share=0.1)
    before = readings.read_bytes()
    for done, said in [
        (replay(config, tmp_path / "none.csv", tmp_path / "o"), "none.csv: cannot be read: No such file or directory"),
        (replay(config, readings, tmp_path / "no" / "o"), "no/o: there is no directory"),
        (replay(config, readings, tmp_path), "is a directory; give a file's name"),
        (replay(config, readings, readings), "is the recording itself"),
        (replay(config, readings, tmp_path / "o", "--estimator", "best"), "no estimator 'best': expected one of"),
        (replay(config, readings, tmp_path / "no" / "o", "--estimator", "all"), "no/o-circular: there is no directory"),
        (replay(config, readings, tmp_path / "o", satellite="moon"), "no such file; satellites in"),
        (replay(tmp_path / "nowhere", readings, tmp_path / "o"), "station.toml: no such file"),
        (acu_daemon("replay", "--config", config), "are needed, or --wire alone"),
    ]:
        assert done.code == 2, said
        assert said in done.err
    assert readings.read_bytes() == before


def test_the_whole_pass_is_compared_with_its_losses_and_the_gaps_of_a_stopped_daemon() -> None:
    lines: list[tuple[float, Reading | None]] = [
        (float(t), Reading(float(t), 10.0, 20.0, is_locked=not 4 <= t < 8)) for t in range(12)
    ]
    lines += [(60.0 + t, Reading(60.0 + t, 10.0, 20.0, is_locked=True)) for t in range(3)]
    results = [Replayed(10.0, 20.0, None, True, True, True) for _ in lines]
    seen = compare(lines, {"full": results}, 1.0)
    assert seen.losses_tai_s == [(4.0, 8.0)]
    assert seen.gaps_tai_s == [(11.0, 60.0)]
    assert seen.errors["full"].tai_s.tolist() == [4.0, 5.0, 6.0, 7.0]
    assert {1.0, 3.0, 10.0, 62.0} <= set(seen.tracked["full"].tai_s.tolist())
