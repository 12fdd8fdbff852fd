"""The carry-over's file: exact, whole at any time, never fatal; and who writes it during a pass, and when."""

import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from structlog.testing import capture_logs

from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.edge import carry_over_file as edge
from acu_daemon.edge.carry_over_file import FitKeeper, carry_over_path, read_carry_over, write_carry_over
from acu_daemon.edge.writer import Writer
from acu_daemon.model import AngleBias, Correction, FitResult, Station

ISS = "ISS (25544)"
ROOT = np.random.default_rng(1).normal(size=(17, 17)) * np.logspace(-9, 3, 17)[:, None]
CARRIED = CarryOver(
    at_tai_s=599012992.123456,
    estimator="full",
    station=Station("Cuiaba", -15.53, -56.07, 277.0),
    elements_kind="tle",
    elements_epoch_tai_s=598900000.1,
    states=np.random.default_rng(2).normal(size=(2, 6)) * 7e6,
    correction=Correction(1e-5, -2e-3, 3e-10, 1e-5, -1e-5, 1 / 3),
    bias=AngleBias(0.05, 0.001, -0.04, 0.0),
    station_shift_enu_m=(1.0, 2.0, -3.0),
    covariance=ROOT @ ROOT.T,
)
FIT = FitResult("full", Correction(), 599012992.0, 100, 0, 0.0, 0.0, 0.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return carry_over_path(tmp_path, 25544, "ISS")


def written(path: Path, **changes: Any) -> Path:
    write_carry_over(path, ISS, replace(CARRIED, **changes))
    return path


def test_a_satellite_has_its_file_by_number_or_by_name(tmp_path: Path) -> None:
    assert carry_over_path(tmp_path, 25544, "ISS").name == "carry-over-25544.json"
    assert carry_over_path(tmp_path, None, "SCD-1").name == "carry-over-SCD-1.json"
    assert carry_over_path(tmp_path, None, "../My Sat/2").parent == tmp_path


def test_what_is_read_is_what_was_written_to_the_last_bit(path: Path) -> None:
    read = read_carry_over(written(path), ISS)
    assert read == CARRIED
    assert read is not None
    assert (read.covariance == CARRIED.covariance).all()
    assert (read.states == CARRIED.states).all()


def test_a_file_from_before_the_mounts_terms_were_states_is_read(path: Path) -> None:
    said = json.loads(written(path).read_text())
    for name in ("npae_deg", "an_deg", "aw_deg", "tf_deg"):
        del said["bias"][name]
    said["covariance"] = [row[:13] for row in said["covariance"][:13]]
    path.write_text(json.dumps(said))
    read = read_carry_over(path, ISS)
    assert read is not None
    assert read.bias == CARRIED.bias
    assert (read.covariance[:13, :13] == CARRIED.covariance[:13, :13]).all()
    assert not read.covariance[13:].any()


def test_people_can_read_whose_it_is_and_when(path: Path) -> None:
    said = json.loads(written(path).read_text())
    assert (said["satellite"], said["station"]["name"]) == (ISS, "Cuiaba")
    assert said["utc"] == "2018-12-25T12:29:15.123Z"
    assert said["elements"]["epoch_utc"].startswith("2018-12-24T")


def test_no_file_is_no_complaint(path: Path) -> None:
    with capture_logs() as logs:
        assert read_carry_over(path, ISS) is None
    assert logs == []


def changed(key: str, value: Any) -> Callable[[dict[str, Any]], None]:
    def change(said: dict[str, Any]) -> None:
        *parents, last = key.split(".")
        for parent in parents:
            said = said[parent]
        said[last] = value

    return change


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (changed("version", 2), "expected a JSON object with version 1"),
        (changed("at_tai_s", "soon"), "'soon': expected a number"),
        (changed("at_tai_s", float("nan")), "nan: expected a number"),
        (changed("at_tai_s", 10**400), "not in the form in which it is written"),
        (changed("satellite", "OTHER"), "it is of 'OTHER', not of 'ISS (25544)'"),
        (changed("correction.delta_raan_rad", True), "True: expected a number"),
        (changed("correction.delta_x", 1.0), "expected delta_e_cos_argp, delta_e_sin_argp, delta_inclination_rad"),
        (changed("correction", {}), "expected delta_e_cos_argp, delta_e_sin_argp, delta_inclination_rad"),
        (changed("bias", 1.0), "expected an_deg, aw_deg, az_deg, az_sec_deg, el_cot_deg, el_deg, npae_deg, tf_deg"),
        (changed("station", None), "not in the form in which it is written"),
        (changed("station", {"name": "here"}), "expected height_m, latitude_deg, longitude_deg, name"),
        (changed("station_shift_enu_m", [1.0]), "expected 3 numbers"),
        (changed("elements", {}), "kind is missing"),
        (changed("covariance", [[1.0]]), "expected 17 x 17 numbers"),
        (changed("covariance", (-np.eye(13)).tolist()), "covariance: expected a symmetric matrix without negative"),
        (changed("covariance", np.tri(13).tolist()), "covariance: expected a symmetric matrix without negative"),
        (changed("covariance", np.diag([1.0] * 16 + [-1.0]).tolist()), "covariance: expected a symmetric matrix"),
        (changed("covariance", (np.eye(17) - np.eye(17, k=1) - np.eye(17, k=-1)).tolist()), "covariance: expected a"),
        (changed("covariance", [*[[1e308] * 17] * 16, [5e-324] * 17]), "covariance: expected a"),
    ],
)
def test_a_file_with_something_wrong_is_reported_and_not_used(
    path: Path, change: Callable[[dict[str, Any]], None], reason: str
) -> None:
    said = json.loads(written(path).read_text())
    change(said)
    path.write_text(json.dumps(said))
    assert reason in complaint(path)


@pytest.mark.parametrize("text", [b"", b"[]", b"null", b"{", b"\xff\xfe", b"[" * 100_000, b"9" * 5000])
def test_a_torn_or_foreign_file_is_reported_and_not_used(path: Path, text: bytes) -> None:
    path.write_bytes(text)
    assert complaint(path)


def test_every_cut_of_a_file_is_reported_and_not_used(path: Path) -> None:
    whole = written(path).read_bytes()
    for size in range(0, len(whole) - 1, 97):
        path.write_bytes(whole[:size])
        assert complaint(path)


def complaint(path: Path) -> str:
    with capture_logs() as logs:
        assert read_carry_over(path, ISS) is None
    (log,) = logs
    assert (log["event"], log["file"]) == ("carry_over.unreadable", str(path))
    return str(log["reason"])


def test_a_write_that_fails_leaves_the_old_file_and_nothing_beside_it(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(path)

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        written(path, estimator="other")
    assert read_carry_over(path, ISS) == CARRIED
    assert [one.name for one in path.parent.iterdir()] == [path.name]


# Who writes it during a pass


class Disk:
    """Notes who was saved, in which thread, instead of a real file."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.times: list[float] = []
        self.threads: set[int] = set()
        self.error: OSError | None = None
        self.failed_count = 0
        monkeypatch.setattr(edge, "write_carry_over", self._write)

    def _write(self, _path: Path, _satellite: str, carried: CarryOver) -> None:
        self.threads.add(threading.get_ident())
        if self.error is not None:
            self.failed_count += 1
            raise self.error
        self.times.append(carried.at_tai_s)


@pytest.fixture
def writer() -> Iterator[Writer]:
    made = Writer("files")
    yield made
    assert made.close()


def keeper(path: Path, writer: Writer) -> FitKeeper:
    return FitKeeper(
        path, "ISS", lambda fit: None if fit.reading_count < 30 else replace(CARRIED, at_tai_s=fit.at_tai_s), writer
    )


def test_a_fit_is_saved_at_once_then_each_period_and_the_last_one_at_the_end(
    path: Path, monkeypatch: pytest.MonkeyPatch, writer: Writer
) -> None:
    disk, kept = Disk(monkeypatch), keeper(path, writer)
    for second in range(25):
        kept.offer(replace(FIT, at_tai_s=float(second)))
        while len(disk.times) <= second // 10:
            time.sleep(0.001)
    assert disk.times == [0.0, 10.0, 20.0]
    kept.flush()
    kept.flush()
    assert writer.close()
    assert disk.times == [0.0, 10.0, 20.0, 24.0]
    assert threading.get_ident() not in disk.threads


def test_a_pass_without_a_fit_writes_nothing(path: Path, monkeypatch: pytest.MonkeyPatch, writer: Writer) -> None:
    disk, kept = Disk(monkeypatch), keeper(path, writer)
    kept.offer(replace(FIT, reading_count=1))
    kept.flush()
    assert writer.close()
    assert disk.times == []


def test_p10_a_full_disk_is_told_at_its_edges_and_the_newest_fit_is_saved_once_there_is_room(
    path: Path, monkeypatch: pytest.MonkeyPatch, writer: Writer
) -> None:
    disk, kept = Disk(monkeypatch), keeper(path, writer)
    disk.error = OSError(28, "No space left on device")
    with capture_logs() as told:
        for second in range(3):
            kept.offer(replace(FIT, at_tai_s=float(second)))
            while disk.failed_count <= second:
                time.sleep(0.001)
        while kept.problem != f"{path.name}: No space left on device":
            time.sleep(0.001)
        disk.error = None
        kept.flush()
        assert writer.close()
    assert [(one["event"], one["file"]) for one in told] == [
        ("carry_over.not_saved", str(path)),
        ("carry_over.saved_again", str(path)),
    ]
    assert (disk.times, kept.problem) == ([2.0], "")
