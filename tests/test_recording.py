"""Recorded readings: what is written can be read, and every bad line is told by its number."""

import errno
import json
import os
import resource
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from structlog.testing import capture_logs
from test_writer import stuck

from acu_daemon import __version__
from acu_daemon.edge import recording_whose
from acu_daemon.edge.recording import RecordingWriter, read_readings
from acu_daemon.edge.recording_whose import ElementsUsed, Whose, read_whose
from acu_daemon.edge.writer import Writer
from acu_daemon.errors import UsageError
from acu_daemon.model import Reading, Station
from acu_daemon.orbit.timescales import tai_from_utc

HEADER = "utc,az_deg,el_deg,locked"
GOOD = "2018-12-25T01:40:00.000000Z,10.00000,20.00000,1"


def file(directory: Path, *lines: str, header: str = HEADER, ends: str = "\n", encoding: str = "ascii") -> Path:
    path = directory / "readings.csv"
    path.write_bytes(ends.join([header, *lines, ""]).encode(encoding))
    return path


def refusal(path: Path) -> str:
    with pytest.raises(UsageError) as error:
        read_readings(path)
    return str(error.value).removeprefix(f"{path}")


times = st.lists(st.integers(1, 10**9), min_size=1, max_size=20).map(
    lambda steps: [5e8 + sum(steps[: n + 1]) * 1e-6 for n in range(len(steps))]
)


@given(times, st.floats(0, 360, exclude_max=True), st.floats(-90, 180), st.booleans())
def test_what_is_written_reads_back_to_half_a_microsecond_and_five_decimals(
    tmp_path_factory: pytest.TempPathFactory, tai_s: list[float], az_deg: float, el_deg: float, is_locked: bool
) -> None:
    path = tmp_path_factory.mktemp("recording") / "x.csv"
    with RecordingWriter(path) as recording:
        for time in tai_s:
            recording.add(Reading(time, az_deg, el_deg, is_locked))
    read = read_readings(path)
    assert [time for _, _, time in read] == pytest.approx(tai_s, rel=0, abs=0.6e-6)
    for _, reading, time in read:
        assert reading is not None
        assert (reading.tai_s, reading.is_locked) == (time, is_locked)
        assert abs((reading.az_deg - az_deg + 180.0) % 360.0 - 180.0) <= 0.6e-5
        assert reading.el_deg == pytest.approx(el_deg, rel=0, abs=0.6e-5)


def test_a_recording_has_the_format_of_the_design(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    with RecordingWriter(path) as recording:
        recording.add(Reading(tai_from_utc("2016-12-31T23:59:60.5Z"), 359.5, 7.0, False))
        recording.add(Reading(tai_from_utc("2017-01-01T00:00:00Z"), 0.25, 7.000004, True))
    assert path.read_text() == (
        f"{HEADER}\n2016-12-31T23:59:60.500000Z,359.50000,7.00000,0\n2017-01-01T00:00:00.000000Z,0.25000,7.00000,1\n"
    )


def test_a_reading_not_later_than_the_one_before_as_written_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    with RecordingWriter(path) as recording:
        for time in (100.0, 100.0, 99.0, 100.0000002, 100.000001):
            recording.add(Reading(time, 1.0, 2.0, True))
    assert len(read_readings(path)) == 2


def test_where_the_clock_is_set_back_another_file_is_begun_beside(tmp_path: Path) -> None:
    path = tmp_path / "pass.csv"
    with RecordingWriter(path) as recording:
        for tai_s in (1000.0, 1000.1, 400.0, 400.1, 400.05, 400.2):
            recording.add(Reading(tai_s, 10.0, 20.0, True))
    times = [[tai_s for _, _, tai_s in read_readings(one)] for one in (path, tmp_path / "pass-2.csv")]
    assert times == [pytest.approx([1000.0, 1000.1]), pytest.approx([400.0, 400.1, 400.2])]


def test_lines_are_in_the_file_at_least_once_a_second_of_readings(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    with RecordingWriter(path) as recording:
        for tick in range(31):
            recording.add(Reading(100.0 + 0.1 * tick, 1.0, 2.0, True))
            assert path.read_text().count("\n") - 1 >= tick - 9


def record(path: Path, *seconds: float, **parts: Any) -> None:
    with RecordingWriter(path, **parts) as recording:
        for second in seconds:
            recording.add(Reading(second, 1.0, 2.0, True))


def seconds_in(path: Path) -> list[float]:
    return [tai_s for _, _, tai_s in read_readings(path)]


def test_p10_a_full_disk_is_told_once_and_stops_nothing() -> None:
    with capture_logs() as logs, RecordingWriter(Path("/dev/full")) as recording:
        for second in range(100, 120):
            recording.add(Reading(second, 1.0, 2.0, True))
        assert recording.problem == "full: No space left on device"
    assert [log["event"] for log in logs] == ["record.failed"]


@pytest.fixture
def full_at() -> Iterator[Callable[[int], None]]:
    """Files end at so many bytes, as on a full disk, or with -1 at their old limit."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (before[0] if size < 0 else size, before[1]))
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.long
def test_p10_a_recording_goes_on_with_whole_lines_when_there_is_space_again(
    tmp_path: Path, full_at: Callable[[int], None]
) -> None:
    path = tmp_path / "x.csv"
    with capture_logs() as logs, RecordingWriter(path) as recording:
        full_at(200_000)
        for tick in range(6000):
            recording.add(Reading(100.0 + tick, 1.0, 2.0, True))
            if tick == 5500:
                full_at(-1)
        assert recording.problem == ""
    full_at(-1)
    assert path.read_bytes().endswith(b"\n")
    seconds = seconds_in(path)
    assert seconds[0] == 100.0
    assert seconds[-1] == 6099.0
    lost = 6000 - len(seconds)
    assert [(log["event"], log.get("lost_count")) for log in logs] == [
        ("record.failed", None),
        ("record.resumed", lost),
    ]


def test_p10_a_restart_goes_on_in_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    record(path, 100.0, 101.0)
    record(path, 101.0, 102.0, now_tai_s=101.5)
    assert seconds_in(path) == [100.0, 101.0, 102.0]
    record(path)
    assert seconds_in(path) == [100.0, 101.0, 102.0]


@pytest.mark.parametrize("cut", range(1, 47))
def test_p10_a_line_that_a_loss_of_power_tore_is_left_out_by_reader_and_restart(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "x.csv"
    record(path, 100.0, 101.0)
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    said: list[str] = []
    is_lost = cut > 1  # the line's end alone is no loss
    assert [tai_s for _, _, tai_s in read_readings(path, said.append)] == ([100.0] if is_lost else [100.0, 101.0])
    assert said == ([f"{path}, line 3: torn, and left out"] if 1 < cut < 46 else [])
    with capture_logs() as logs:
        record(path, 102.0)
    assert seconds_in(path) == [100.0, 102.0]
    assert [log["event"] for log in logs] == (["record.torn"] if cut < 46 else [])


@pytest.mark.parametrize("size", range(len(HEADER) + 2))
def test_p10_a_recording_torn_in_its_header_begins_anew(tmp_path: Path, size: int) -> None:
    path = tmp_path / "x.csv"
    path.write_text(f"{HEADER}\n"[:size])
    record(path, 100.0)
    assert seconds_in(path) == [100.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("my thesis\n", "this file is no recording and is left alone: choose another, or move it away"),
        (f"{HEADER},more\n", "this file is no recording and is left alone: choose another, or move it away"),
        (f"{HEADER}\nx\n", "its last line is no reading (expected 4 fields, found 1): choose another"),
    ],
)
def test_a_foreign_file_is_not_overwritten(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(UsageError) as error:
        record(path, 100.0)
    assert str(error.value) == f"--record {path}: {said}"
    assert path.read_text() == text


def test_a_recording_that_ends_later_than_now_is_not_continued(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    record(path, 100.0)
    with pytest.raises(UsageError, match=r"its last reading, 2000-01-01T12:01:08Z, is later than now, .*:07Z, and"):
        record(path, 99.5, now_tai_s=99.0)
    assert seconds_in(path) == [100.0]


def test_beside_the_loop_every_line_is_in_the_file_once_the_writer_has_ended(tmp_path: Path) -> None:
    path, writer = tmp_path / "x.csv", Writer("files")
    record(path, *range(100, 200), writer=writer)
    assert writer.close(60.0)
    assert seconds_in(path) == list(range(100, 200))


def test_p10_a_disk_without_room_for_another_file_keeps_no_run_from_its_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.csv"

    def full(*_: Any) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    with capture_logs() as logs:
        with monkeypatch.context() as disk:
            disk.setattr(os, "open", full)
            recording = RecordingWriter(path)
            recording.add(Reading(100.0, 1.0, 2.0, True))
            assert recording.problem == "x.csv: No space left on device"
        recording.add(Reading(101.0, 1.0, 2.0, True))
        recording.close()
    assert seconds_in(path) == [101.0]
    assert [log["event"] for log in logs] == ["record.failed", "record.resumed"]


def test_p10_a_disk_that_does_not_keep_up_is_told_once(tmp_path: Path) -> None:
    path, writer = tmp_path / "x.csv", Writer("files", limit=5)
    job = stuck(writer)
    with capture_logs() as logs, RecordingWriter(path, writer) as recording:
        for second in range(100, 120):
            recording.add(Reading(second, 1.0, 2.0, True))
        assert recording.problem == "x.csv: the disk does not keep up"
        job.go.set()
    assert writer.close(60.0)
    assert logs[0]["event"] == "record.failed"
    assert seconds_in(path)[0] == 100.0


CUIABA = Station("Cuiaba", -15.53, -56.07, 277.0)
SCD = Whose(CUIABA, "SCD-1", 22490, ElementsUsed("tle", "1989-01-31T09:58:00.000Z", "scd.tle"))
NOAA = replace(SCD, satellite="NOAA-20", norad_id=43013)
ELSEWHERE = replace(SCD, station=replace(CUIABA, longitude_deg=-44.4))
FAR_S = 1e9


def told(*seconds: float, path: Path, whose: Whose, now_tai_s: float = FAR_S) -> str:
    """Record; returns what is said of a file that is not the one asked for."""
    with capture_logs() as logs:
        record(path, *seconds, whose=whose, now_tai_s=now_tai_s)
    return "; ".join(str(log["reason"]) for log in logs if log["event"] == "record.beside")


@pytest.mark.parametrize(
    ("change", "goes_on"),
    [
        ({"height_m": CUIABA.height_m + 19.0}, True),
        ({"height_m": CUIABA.height_m + 21.0}, False),
        ({"height_m": CUIABA.height_m - 21.0}, False),
        ({"latitude_deg": CUIABA.latitude_deg + 0.9e-4}, True),
        ({"latitude_deg": CUIABA.latitude_deg - 1.1e-4}, False),
        ({"longitude_deg": CUIABA.longitude_deg - 0.9e-4}, True),
        ({"longitude_deg": CUIABA.longitude_deg + 1.1e-4}, False),
        ({"longitude_deg": CUIABA.longitude_deg + 360.0}, True),
        ({"name": "the other mast"}, False),
    ],
)
def test_readings_of_two_stations_stand_in_one_file_only_where_both_are_one_place(change, goes_on: bool) -> None:
    assert SCD.may_go_on(replace(SCD, station=replace(CUIABA, **change))) is goes_on


def test_a_recording_says_beside_it_whose_it_is_and_is_gone_on_with(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    assert told(100.0, path=path, whose=SCD) == ""
    assert path.read_text().startswith(f"{HEADER}\n")
    said = json.loads((tmp_path / "x.csv.json").read_text())
    assert said["station"] == {"name": "Cuiaba", "latitude_deg": -15.53, "longitude_deg": -56.07, "height_m": 277.0}
    assert said["satellite"] == {"name": "SCD-1", "norad_id": 22490}
    assert said["elements"] == {"kind": "tle", "epoch_utc": "1989-01-31T09:58:00.000Z", "file": "scd.tle"}
    assert said["version"] == __version__
    newer = replace(SCD, elements=ElementsUsed("tle", "1989-02-01T09:58:00.000Z", "scd.tle"))
    for whose in (SCD, newer, newer):
        assert told(101.0, 102.0, path=path, whose=whose) == ""
    assert seconds_in(path) == [100.0, 101.0, 102.0]
    later = json.loads((tmp_path / "x.csv.json").read_text())["later"]
    assert [run["elements"]["epoch_utc"] for run in later] == ["1989-02-01T09:58:00.000Z"]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["x.csv", "x.csv.json"]


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (NOAA, "x.csv is of SCD-1 (22490) over Cuiaba"),
        (replace(SCD, satellite="SCD-2", norad_id=None), "x.csv is of SCD-1 (22490) over Cuiaba"),
        (ELSEWHERE, "x.csv is of SCD-1 (22490) over Cuiaba"),
        (replace(SCD, is_rehearsal=True), "x.csv is of SCD-1 (22490) over Cuiaba"),
    ],
)
def test_anothers_recording_is_left_alone_and_the_pass_goes_on_in_a_file_of_a_new_name(
    tmp_path: Path, other: Whose, said: str
) -> None:
    path = tmp_path / "x.csv"
    told(100.0, path=path, whose=SCD)
    before = path.read_bytes(), (tmp_path / "x.csv.json").read_bytes()
    assert told(200.0, path=path, whose=other) == said
    assert told(201.0, path=path, whose=other) == said  # a restart finds its own
    assert (path.read_bytes(), (tmp_path / "x.csv.json").read_bytes()) == before
    assert seconds_in(tmp_path / "x-2.csv") == [200.0, 201.0]
    assert read_whose(tmp_path / "x-2.csv") == other
    assert told(102.0, path=path, whose=SCD) == ""
    assert seconds_in(path) == [100.0, 102.0]


@pytest.mark.parametrize("text", [None, "", "{", "[]", '{"format": 1}', '{"format": 2}', "\0" * 100, "[" * 5000])
def test_a_recording_that_does_not_say_whose_it_is_is_left_alone_with_what_stands_beside_it(
    tmp_path: Path, text: str | None
) -> None:
    path, beside = tmp_path / "x.csv", tmp_path / "x.csv.json"
    record(path, 100.0)
    if text is not None:
        beside.write_text(text)
    assert "x.csv.json" in told(101.0, path=path, whose=SCD)
    assert seconds_in(path) == [100.0]
    assert (beside.read_text() if beside.exists() else None) == text
    assert seconds_in(tmp_path / "x-2.csv") == [101.0]


def test_the_json_of_a_recording_that_was_moved_away_is_not_overwritten_by_anothers(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    told(100.0, path=path, whose=SCD)
    path.rename(tmp_path / "moved.csv")
    assert "x.csv is of SCD-1" in told(101.0, path=path, whose=NOAA)
    assert read_whose(path) == SCD
    assert not path.exists()


def test_of_two_runs_at_once_each_has_a_file_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    with RecordingWriter(path, whose=SCD) as recording:
        recording.add(Reading(100.0, 1.0, 2.0, True))
        assert told(101.0, path=path, whose=SCD) == "another run records into x.csv"
        recording.add(Reading(102.0, 1.0, 2.0, True))
    assert (seconds_in(path), seconds_in(tmp_path / "x-2.csv")) == ([100.0, 102.0], [101.0])


def test_a_recording_that_ends_later_than_now_or_in_no_reading_is_left_alone_too(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    told(100.0, path=path, whose=SCD)
    assert "is later than now" in told(50.0, path=path, whose=SCD, now_tai_s=49.0)
    path.write_text(f"{HEADER}\nx\n")
    assert "is no reading" in told(51.0, path=path, whose=SCD, now_tai_s=50.9)
    assert seconds_in(tmp_path / "x-2.csv") == [50.0, 51.0]


def test_where_the_json_cannot_be_written_the_readings_are_and_it_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.csv"

    def full(*_: Any, **__: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with capture_logs() as logs:
        with monkeypatch.context() as disk:
            disk.setattr(recording_whose, "replace_file", full)
            recording = RecordingWriter(path, whose=SCD)
            for second in (100.0, 101.0):
                recording.add(Reading(second, 1.0, 2.0, True))
            assert "x.csv.json: " in recording.problem
        recording.add(Reading(102.0, 1.0, 2.0, True))
        assert recording.problem == ""
        recording.close()
    assert [log["event"] for log in logs] == ["record.whose_not_saved"]
    assert (seconds_in(path), read_whose(path)) == ([100.0, 101.0, 102.0], SCD)


def test_a_device_has_nothing_beside_it_and_a_foreign_file_is_refused_whoever_asks(tmp_path: Path) -> None:
    told(100.0, path=Path("/dev/null"), whose=SCD)
    assert not Path("/dev/null.json").exists()
    path = tmp_path / "x.csv"
    path.write_text("my thesis, which is longer than a header\n" * 3)
    with pytest.raises(UsageError, match="this file is no recording and is left alone"):
        record(path, 100.0, whose=SCD)
    assert [one.name for one in tmp_path.iterdir()] == ["x.csv"]


def test_a_recording_that_cannot_be_made_is_wrong_use(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"--record .*: No such file or directory"):
        RecordingWriter(tmp_path / "no" / "x.csv")
    with pytest.raises(UsageError, match=r"--record .*: Is a directory"):
        RecordingWriter(tmp_path)
    (tmp_path / "file").touch()
    for below in ("no/x.csv", "file/x.csv", "x" * 300):
        with pytest.raises(UsageError, match=r"--record "):
            RecordingWriter(tmp_path / below, whose=SCD)


def test_angles_may_be_empty_where_locked_is_0(tmp_path: Path) -> None:
    [(utc, reading, tai_s)] = read_readings(file(tmp_path, "2018-12-25T01:40:00Z,,,0"))
    assert (utc, reading, tai_s) == ("2018-12-25T01:40:00Z", None, tai_from_utc("2018-12-25T01:40:00Z"))


def test_azimuth_360_is_north(tmp_path: Path) -> None:
    [(_, reading, _)] = read_readings(file(tmp_path, "2018-12-25T01:40:00Z,360,5,1"))
    assert reading is not None
    assert reading.az_deg == 0.0


@pytest.mark.parametrize(("ends", "encoding"), [("\r\n", "ascii"), ("\n", "utf-8-sig"), ("\r\n", "utf-8-sig")])
def test_windows_line_ends_and_a_byte_order_mark_do_not_matter(tmp_path: Path, ends: str, encoding: str) -> None:
    read = read_readings(file(tmp_path, GOOD, "2018-12-25T01:40:01Z,,,0", ends=ends, encoding=encoding))
    assert [utc for utc, _, _ in read] == ["2018-12-25T01:40:00.000000Z", "2018-12-25T01:40:01Z"]


def test_a_leap_second_rises_like_any_other(tmp_path: Path) -> None:
    utc = ["2016-12-31T23:59:59Z", "2016-12-31T23:59:60Z", "2016-12-31T23:59:60.9Z", "2017-01-01T00:00:00Z"]
    read = read_readings(file(tmp_path, *(f"{text},1,2,1" for text in utc)))
    start = read[0][2]
    assert [time - start for _, _, time in read] == pytest.approx([0.0, 1.0, 1.9, 2.0])


def test_a_file_with_only_its_header_has_no_readings(tmp_path: Path) -> None:
    assert read_readings(file(tmp_path)) == []


@pytest.mark.parametrize("text", ["", "\n", "utc,az_deg,el_deg\n", "utc;az_deg;el_deg;locked\n", f"{GOOD}\n"])
def test_another_header_is_told(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    assert refusal(path) == f", line 1: expected the header {HEADER}, found {text.strip()[:60]!r}"


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("2018-12-25T01:40:01Z,1,2", "expected 4 fields, found 3"),
        ("2018-12-25T01:40:01Z,1,2,1,", "expected 4 fields, found 5"),
        ("2018-12-25T01:40:01,1,2,1", "'2018-12-25T01:40:01': expected UTC as YYYY-MM-DDThh:mm:ss[.fff]Z"),
        ("2018-12-25T23:59:60Z,1,2,1", "'2018-12-25T23:59:60Z': that day had no leap second"),
        ("2018-12-25T01:40:01Z,1,2,true", "locked = 'true': expected 0 or 1"),
        ("2018-12-25T01:40:01Z,1,2,", "locked = '': expected 0 or 1"),
        ("2018-12-25T01:40:01Z,,2,1", "az_deg = '': expected a number of degrees"),
        ("2018-12-25T01:40:01Z,1,x,0", "el_deg = 'x': expected a number of degrees"),
        ("2018-12-25T01:40:01Z,nan,2,1", "az_deg = nan: expected a finite number"),
        ("2018-12-25T01:40:01Z,1,inf,1", "el_deg = inf: expected a finite number"),
        ("2018-12-25T01:40:01Z,-1,2,1", "az_deg = -1: expected 0 to 360"),
        ("2018-12-25T01:40:01Z,1,181,1", "el_deg = 181: expected -90 to 180"),
        ('2018-12-25T01:40:01Z,"1,2,1', "az_deg = '\"1': expected a number of degrees"),
        (GOOD, "2018-12-25T01:40:00.000000Z is not later than the line before; times must rise"),
        ("2018-12-25T01:39:59Z,1,2,1", "2018-12-25T01:39:59Z is not later than the line before; times must rise"),
        ("2018-12-25T01:40:00Z,,,0", "2018-12-25T01:40:00Z is not later than the line before; times must rise"),
    ],
)
def test_a_bad_line_is_told_by_its_number(tmp_path: Path, line: str, said: str) -> None:
    later = "2018-12-25T02:00:00Z,1,2,1"
    assert refusal(file(tmp_path, GOOD, "", line, later)) == f", line 4: {said}"


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"^--readings .*: cannot be read: No such file or directory$"):
        read_readings(tmp_path / "x.csv")
    with pytest.raises(UsageError, match=r"^--readings .*: cannot be read: Is a directory$"):
        read_readings(tmp_path)
    with pytest.raises(UsageError, match=r"byte 0: expected a CSV file in plain text$"):
        read_readings(file(tmp_path, encoding="utf-16"))


@given(st.binary(max_size=300))
def test_whatever_a_file_holds_it_is_read_or_refused_with_a_line(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.mktemp("noise") / "x.csv"
    path.write_bytes(f"{HEADER}\n{GOOD}\n".encode() + data)
    try:
        assert read_readings(path)
    except UsageError as error:
        assert "line " in str(error) or "byte " in str(error)
