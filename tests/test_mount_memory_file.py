"""mount.json: whole or thrown away with a word, a pass counted once; the commands that show, make and forget it."""

import json
import os
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command_line import acu_daemon
from config_files import STATION as STATION_FILE
from config_files import replaced, write
from flights import demo_target
from made_pedestals import CROOKED, HERE, SETTINGS, estimate_of, passes, read, remembered
from structlog.testing import capture_logs

import acu_daemon.cli as cli
from acu_daemon.assist.mount_memory.pedestal_memory import aged, first_memory
from acu_daemon.assist.mount_memory.update import updated
from acu_daemon.cli.options import antenna_of
from acu_daemon.config.load import load_station
from acu_daemon.config.to_settings import pedestal_text
from acu_daemon.edge.mount_memory_file import (
    MOUNT,
    MountFile,
    MountKeeper,
    PassRow,
    from_json,
    mount_files,
    open_mount_file,
    read_mount_file,
    to_json,
    write_mount_file,
)
from acu_daemon.edge.recording_whose import ElementsUsed, Whose, save_whose
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DEG

THIS = "here; azimuth -270 to 270"
ROW = PassRow("2018-12-25T02:00:00Z", "MADE", 0.08, -0.06, 0.01, 0.01)


class Now:
    """Writes at once, in the place of the thread."""

    def put(self, job: Callable[[], None]) -> bool:
        job()
        return True


@pytest.fixture(scope="module")
def kept() -> MountFile:
    """After three passes, with a fourth in progress."""
    memory, _ = remembered(CROOKED, 3)
    one = passes(CROOKED, 4)[-1]
    newest = estimate_of(one, read(one, 3), memory)
    return MountFile(THIS, memory, (ROW,), "MADE", float(one.readings.tai_s[0]), newest)


def test_what_is_written_is_read_again(tmp_path: Path, kept: MountFile) -> None:
    write_mount_file(tmp_path / MOUNT, kept)
    with capture_logs() as logs:
        again = read_mount_file(tmp_path / MOUNT, THIS)
    assert logs == []
    assert again is not None
    assert again.memory.mount.mean == pytest.approx(kept.memory.mount.mean, rel=1e-12)
    assert again.memory.const.covariance == pytest.approx(kept.memory.const.covariance, rel=1e-12)
    assert again.memory.still.covariance == pytest.approx(kept.memory.still.covariance, rel=1e-12)
    evidence = kept.memory.evidence, kept.memory.still_evidence
    assert (again.memory.pass_count, again.memory.evidence, again.memory.still_evidence) == (3, *evidence)
    assert len(again.memory.doubts) == len(kept.memory.doubts)
    assert again.newest is not None
    assert kept.newest is not None
    assert again.newest.mount.mean == pytest.approx(kept.newest.mount.mean, rel=1e-12)
    assert again.newest.noise == kept.newest.noise
    assert again.rows == (ROW,)


def test_a_file_from_before_still_zero_points_were_weighed_has_those_of_the_mean_of_a_day(
    tmp_path: Path, kept: MountFile
) -> None:
    said = json.loads(json.dumps(to_json(kept)))
    del said["memory"]["still"], said["memory"]["still_evidence"]
    (tmp_path / MOUNT).write_text(json.dumps(said))
    again = read_mount_file(tmp_path / MOUNT, THIS)
    assert again is not None
    assert again.memory.still.terms.mean == pytest.approx(kept.memory.mount.terms.mean, rel=1e-12)
    assert not again.memory.still.covariance[8:].any()
    assert not again.memory.is_still


def test_a_file_from_before_day_and_night_were_kept_is_taken_over_with_none_known(
    tmp_path: Path, kept: MountFile
) -> None:
    said = json.loads(json.dumps(to_json(kept)))
    said["version"] = 1
    del said["day_and_night"], said["memory"]["still"], said["memory"]["still_evidence"]
    for name in ("const", "mount"):
        old = said["memory"][name]
        old["mean_deg"] = old["mean_deg"][:8]
        old["covariance_deg2"] = [row[:8] for row in old["covariance_deg2"][:8]]
    (tmp_path / MOUNT).write_text(json.dumps(said))
    with capture_logs() as logs:
        again = read_mount_file(tmp_path / MOUNT, THIS)
    assert logs == []
    assert again is not None
    assert again.memory.mount.terms.mean == pytest.approx(kept.memory.mount.terms.mean, rel=1e-12)
    assert again.memory.mount.terms.covariance == pytest.approx(kept.memory.mount.terms.covariance, rel=1e-12)
    assert not again.memory.mount.mean[8:].any()
    later = aged(again.memory, SETTINGS, again.memory.at_tai_s)
    assert (later.mount.covariance[8:, 8:] == first_memory(SETTINGS, 0.0).mount.covariance[8:, 8:]).all()


def test_no_file_is_no_complaint(tmp_path: Path) -> None:
    with capture_logs() as logs:
        assert read_mount_file(tmp_path / MOUNT, THIS) is None
    assert logs == []


def test_the_memory_of_another_pedestal_is_thrown_away_and_said(tmp_path: Path, kept: MountFile) -> None:
    write_mount_file(tmp_path / MOUNT, kept)
    with capture_logs() as logs:
        assert read_mount_file(tmp_path / MOUNT, "here; azimuth -200 to 270") is None
    assert [one["event"] for one in logs] == ["mount.thrown_away"]


@pytest.mark.parametrize(
    ("table", "values"),
    [
        ("mount", {"ia_deg": 0.1}),
        ("mount", {"tf_sigma_deg": 0.01}),
        ("azimuth", {"max_deg": 260.0}),
        ("atmosphere", {"refraction": not demo_target().station.atmosphere.refraction}),
        ("station", {"latitude_deg": 1.0}),
    ],
)
def test_limits_mount_air_and_place_make_another_pedestal(table: str, values: dict[str, Any]) -> None:
    assert pedestal_text(demo_target(**{table: values}).station) != pedestal_text(demo_target().station)


def test_noise_weather_and_tracking_do_not() -> None:
    changed = demo_target(
        readings={"sigma_azimuth_deg": 0.04}, tracking={"horizon_s": 80.0}, atmosphere={"temperature_c": 3.0}
    )
    assert pedestal_text(changed.station) == pedestal_text(demo_target().station)


def changes(*keys: str | int, value: Any) -> Callable[[Any], None]:
    def change(said: Any) -> None:
        for key in keys[:-1]:
            said = said[key]
        said[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    "change",
    [
        changes("version", value=3),
        changes("terms", value=["IA"]),
        changes("memory", value=None),
        changes("memory", "passes", value=-1),
        changes("memory", "passes", value=1.5),
        changes("memory", "evidence", value=float("nan")),
        changes("memory", "still_evidence", value="much"),
        changes("memory", "still", value={}),
        changes("memory", "mount", "mean_deg", value=[0.0]),
        changes("memory", "mount", "mean_deg", 0, value=11.0),
        changes("memory", "mount", "covariance_deg2", 0, 0, value=-1.0),
        changes("memory", "mount", "covariance_deg2", 0, 1, value=1.0),
        changes("memory", "mount", "covariance_deg2", 0, 0, value=1e308),
        changes("memory", "noise", value=[1.0, 1.0]),
        changes("memory", "doubts", value=[{"gradient": [1.0], "information": [[1.0, 0.0], [0.0, 1.0]]}]),
        changes("newest", "readings", value="many"),
        changes("newest", "const", value={}),
        changes("passes", value=[{}]),
    ],
)
def test_a_file_that_is_not_whole_is_told_and_the_antenna_learnt_anew(
    tmp_path: Path, kept: MountFile, change: Callable[[Any], None]
) -> None:
    said = to_json(kept)
    said = json.loads(json.dumps(said))
    change(said)
    (tmp_path / MOUNT).write_text(json.dumps(said))
    with capture_logs() as logs:
        assert read_mount_file(tmp_path / MOUNT, THIS) is None
    assert [one["event"] for one in logs] == ["mount.unreadable"]
    (tmp_path / MOUNT).write_text(json.dumps(said)[: len(json.dumps(said)) // 2])
    with capture_logs() as logs:
        found = open_mount_file(tmp_path / MOUNT, THIS, SETTINGS, "MADE", 0.0, 0.0)
    assert found.memory.pass_count == 0
    assert [one["event"] for one in logs] == ["mount.unreadable"]


def test_the_same_pass_goes_on_with_what_was_known_before_it_and_another_begins_with_it(
    tmp_path: Path, kept: MountFile
) -> None:
    """A daemon that was killed in mid-pass must not count readings twice, nor lose them."""
    write_mount_file(tmp_path / MOUNT, kept)
    assert kept.newest is not None
    path = tmp_path / MOUNT
    with capture_logs() as logs:
        same = open_mount_file(path, THIS, SETTINGS, "MADE", kept.rise_tai_s + 20.0, kept.newest.at_tai_s)
        assert logs == []
        assert same.memory.pass_count == 3
        later = open_mount_file(path, THIS, SETTINGS, "MADE", kept.rise_tai_s + 5900.0, kept.newest.at_tai_s)
        other = open_mount_file(path, THIS, SETTINGS, "OTHER", kept.rise_tai_s + 20.0, kept.newest.at_tai_s)
    assert [one["event"] for one in logs] == ["mount.updated"] * 2
    after = updated(kept.memory, kept.newest, SETTINGS).memory
    for found in (later, other):
        assert found.memory.pass_count == 4
        assert found.memory.mount.mean == pytest.approx(after.mount.mean, rel=1e-9)
        assert found.newest is None
        assert [row.satellite for row in found.rows] == ["MADE", "MADE"]


def test_of_a_pass_that_is_gone_on_with_the_part_with_more_readings_is_kept(tmp_path: Path, kept: MountFile) -> None:
    files: Any = Now()
    keeper = MountKeeper(tmp_path / MOUNT, kept, files)
    assert kept.newest is not None
    keeper.offer(replace(kept.newest, reading_count=kept.newest.reading_count - 1))
    assert not (tmp_path / MOUNT).exists()
    keeper.offer(replace(kept.newest, reading_count=kept.newest.reading_count + 1))
    again = read_mount_file(tmp_path / MOUNT, THIS)
    assert again is not None
    assert again.newest is not None
    assert again.newest.reading_count == kept.newest.reading_count + 1


def test_a_disk_that_fails_is_told_once_and_tried_again(tmp_path: Path, kept: MountFile) -> None:
    files: Any = Now()
    folder = tmp_path / "later"
    keeper = MountKeeper(folder / MOUNT, kept, files)
    assert kept.newest is not None
    with capture_logs() as logs:
        keeper.offer(kept.newest)
        keeper.offer(kept.newest)
        assert "No such file" in keeper.problem
        folder.mkdir()
        keeper.offer(kept.newest)
    assert keeper.problem == ""
    assert [one["event"] for one in logs] == ["mount.not_saved", "mount.saved_again"]


def test_services_of_several_satellites_share_what_they_know_of_their_antenna(
    tmp_path: Path, kept: MountFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each has a state directory of its own, beside the others'."""
    folders = [tmp_path / name / "Here@acu" for name in ("noaa-20", "scd-1", "scd-1-rehearsal")]
    for k, folder in enumerate(folders):
        folder.mkdir(parents=True)
        write_mount_file(folder / MOUNT, kept)
        os.utime(folder / MOUNT, (k, k))
    assert mount_files(folders[0]) == [folders[0] / MOUNT]
    monkeypatch.setenv("STATE_DIRECTORY", str(folders[0].parent))
    assert mount_files(folders[0]) == [folders[1] / MOUNT, folders[0] / MOUNT]
    assert mount_files(folders[2]) == [folders[2] / MOUNT]


# The commands


@pytest.fixture
def state(tmp_path: Path, kept: MountFile) -> tuple[Path, Path]:
    """A station's configuration, and a state directory that remembers."""
    config = Path(cli.__file__).parent / "demo_config"
    station = demo_target().station
    folder = antenna_of(station).folder(tmp_path / "state")
    folder.mkdir(parents=True)
    write_mount_file(folder / MOUNT, replace(kept, pedestal=pedestal_text(station)))
    return config, tmp_path / "state"


def test_show_tells_terms_sigmas_passes_and_draws_the_drift(state: tuple[Path, Path], tmp_path: Path) -> None:
    config, directory = state
    picture = tmp_path / "drift.png"
    done = acu_daemon("mount", "show", "--config", config, "--state", directory, "--plot", picture)
    assert done.code == 0
    assert "4 passes are remembered" in done.out
    assert "told by the data" in done.out
    ia = next(line for line in done.out.splitlines() if line.startswith("IA"))
    assert float(ia.split()[1]) == pytest.approx(CROOKED.ia_deg, abs=0.05)
    assert done.out.splitlines()[-1].endswith("MADE")
    assert picture.stat().st_size > 5000
    said = json.loads(acu_daemon("mount", "show", "--config", config, "--state", directory, "--json").out)
    assert from_json(said).memory.pass_count == 4


def test_forget_takes_it_away_and_says_where_nothing_was(state: tuple[Path, Path]) -> None:
    config, directory = state
    assert "forgotten" in acu_daemon("mount", "forget", "--config", config, "--state", directory).out
    assert "nothing was remembered" in acu_daemon("mount", "forget", "--config", config, "--state", directory).out
    done = acu_daemon("mount", "show", "--config", config, "--state", directory)
    assert done.code == 1
    assert "nothing is remembered of this antenna" in done.err


def test_a_rehearsal_remembers_for_itself(state: tuple[Path, Path]) -> None:
    config, directory = state
    assert acu_daemon("mount", "show", "--config", config, "--state", directory, "--rehearsal").code == 1


ELEMENTS = """\
[satellite]
name = "MADE {k}"
[elements]
kind = "brouwer"
short_period = false
epoch_utc = 2018-12-25T01:40:00Z
semi_major_axis_km = {a_km}
eccentricity = {e}
inclination_deg = {i_deg}
raan_deg = {raan_deg}
arg_perigee_deg = {argp_deg}
mean_anomaly_deg = {m_deg}
[uncertainty]
position_km = 0.5
velocity_m_s = 0.5
"""


def recordings(folder: Path) -> tuple[Path, list[Path]]:
    """A configuration of the made satellites, and recordings of a pass of each."""
    text = replaced(STATION_FILE, "latitude_deg = -15.53", "latitude_deg = 20.0")
    text = replaced(text, "longitude_deg = -56.07", "longitude_deg = 5.0")
    text = (
        replaced(text, "height_m = 277.0", "height_m = 100.0")
        + "[mount]\nan_deg = 0.005\n[atmosphere]\nrefraction = false\n"
    )
    satellites, paths = {}, []
    for k, one in enumerate(passes(CROOKED, 4)):
        mean = one.source.elements
        satellites[f"made-{k}"] = ELEMENTS.format(
            k=k,
            a_km=mean.a_m / 1e3,
            e=mean.e,
            i_deg=mean.i_rad / DEG,
            raan_deg=mean.raan_rad / DEG,
            argp_deg=mean.argp_rad / DEG,
            m_deg=mean.mean_anomaly_rad / DEG,
        )
        readings, path = read(one, k), folder / f"{k}.csv"
        rows = zip(readings.tai_s.tolist(), readings.az_deg.tolist(), readings.el_deg.tolist(), strict=True)
        lines = [f"{utc_text(tai_s, 3)},{az:.4f},{el:.4f},1" for tai_s, az, el in rows]
        path.write_text("\n".join(["utc,az_deg,el_deg,locked", *lines]) + "\n")
        used = ElementsUsed("brouwer", "2018-12-25T01:40:00Z")
        save_whose(path, Whose(replace(HERE.station, name="MADE"), f"MADE {k}", None, used), "2018-12-25T01:40:00Z")
        paths.append(path)
    return write(folder / "config", text, **satellites), paths


def test_fit_says_what_to_put_into_the_configuration_and_changes_nothing(tmp_path: Path) -> None:
    config, paths = recordings(tmp_path)
    before = (config / "station.toml").read_bytes()
    picture = tmp_path / "fit.png"
    done = acu_daemon("mount", "fit", "--config", config, *reversed(paths), "--plot", picture)
    assert done.code == 0, done.err
    table = tomllib.loads(done.out[done.out.index("[mount]\n") :])["mount"]
    for name in ("ia", "ie", "an", "aw"):
        off_deg = table[f"{name}_deg"] - getattr(CROOKED, f"{name}_deg")
        assert abs(off_deg) < 4.0 * table[f"{name}_sigma_deg"]
    assert table["an_sigma_deg"] < 0.01
    rows = [line.split() for line in done.out.splitlines() if line.endswith(")") is False and "MADE" in line]
    assert len(rows) == 4
    assert all(float(after) <= float(was) for row in rows for was, after in (row[0:2], row[2:4]))
    assert picture.stat().st_size > 5000
    assert (config / "station.toml").read_bytes() == before


def test_fit_refuses_a_recording_that_does_not_say_whose_it_is(tmp_path: Path) -> None:
    config, paths = recordings(tmp_path)
    Path(f"{paths[0]}.json").unlink()
    done = acu_daemon("mount", "fit", "--config", config, paths[0])
    assert done.code == 2
    assert "--satellite" in done.err
    assert acu_daemon("mount", "fit", "--config", config, paths[0], "--satellite", "made-0").code == 0


def test_replay_heeds_a_memory_only_where_it_is_told_to(tmp_path: Path) -> None:
    config, paths = recordings(tmp_path)
    station = load_station(config)
    memory, _ = remembered(CROOKED, 3)
    file, short = tmp_path / MOUNT, tmp_path / "short.csv"
    write_mount_file(file, MountFile(pedestal_text(station), memory))
    short.write_text("".join(paths[3].read_text().splitlines(keepends=True)[:21]))

    def predicted(*more: object) -> str:
        out = tmp_path / "out.csv"
        done = acu_daemon(
            "replay", "--config", config, "--satellite", "made-3", "--readings", short, "--out", out, *more
        )
        assert done.code == 0, done.err
        return out.read_text()

    assert predicted() != predicted("--memory", file)
    write_mount_file(file, MountFile("another", memory))
    done = acu_daemon(
        *("replay", "--config", config, "--satellite", "made-3", "--readings", short),
        *("--out", tmp_path / "out.csv", "--memory", file),
    )
    assert done.code == 2
    assert "another pedestal" in done.err
