"""Recordings as files: exact text, what is kept, what is removed, and a disk that does not want them."""

import asyncio
import errno
import gzip
import json
import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fault_tapes import path_of
from flights import DEMO_TAI_S, RISING_ANTENNA, RISING_TAI_S, climb, demo_target
from made_oems import kvn, states
from structlog.testing import capture_logs
from test_station import START, configured

from acu_daemon.assist.mount_memory.pedestal_memory import first_memory
from acu_daemon.assist.session.refit import GateVerdict, RefitReply
from acu_daemon.cli import pass_tape
from acu_daemon.cli.pass_tape import begin_tape, note_hooks
from acu_daemon.cli.replay_wire import replay_pass
from acu_daemon.cli.report_after import report_after
from acu_daemon.cli.virtual_station import run_days
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.tick_input import Request, StowBy, StowWish
from acu_daemon.edge import tape_file
from acu_daemon.edge.hooks import Hook, HookResult
from acu_daemon.edge.kept_tapes import KeepRules, remove_old, tape_name
from acu_daemon.edge.stored_orbit import orbit_json, orbit_of
from acu_daemon.edge.tape import Record
from acu_daemon.edge.tape_file import SUFFIX, TapeFile, read_tape
from acu_daemon.edge.tape_text import FitAnswer, TapeReader, TapeWriter
from acu_daemon.edge.writer import Writer
from acu_daemon.model import AngleBias, Correction, EarthOrientation, FitResult, Model
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.oem import parse_oem

NOW = RISING_TAI_S


class AtOnce:
    """A writer whose jobs are done at once, or not at all."""

    problem = ""

    def __init__(self, takes: bool = True) -> None:
        self.takes = takes

    def put(self, job: Any) -> bool:
        if self.takes:
            job()
        return self.takes


def tape(path: Path, writer: Any = None, **more: Any) -> TapeFile:
    return TapeFile(path, {"of": "a test"}, writer or AtOnce(), **more)


def ticks(count: int) -> list[Record]:
    return [one for k in range(count) for one in (("T", NOW + 0.1 * k, 0.0, True, (), None), ("H",))]


# Text


RECORDS: list[Record] = [
    ("T", NOW, 0.0, True, (), None),
    ("T", NOW + 0.1, float("inf"), False, (Request.DISARM, StowWish(StowBy.WIND, is_wanted=False)), None),
    ("T", NOW + 0.2000001, 0.3333333333333333, True, (), SignalSample(NOW + 0.15, 7.25, None)),
    ("D", "1"),
    ("Q", 12345.678901234),
    ("X", 12345.678901235, NOW + 0.30000001, b"\x00\xff", b"abc"),
    ("R", 1e-7, b""),
    ("R", 12345.678901239, b"\r\n"),
    ("N", 12346.0),
    ("G",),
    ("H",),
    ("P", -344484096.123456),
    ("S", NOW + 1.0),
    ("B", NOW + 1.0, None),
    ("B", NOW + 1.1, 15.0),
    ("A", NOW + 1.2),
    ("U", NOW),
    ("Z", NOW + 1.3, True, 'it died: "x"\nand more'),
    ("L", "no valid reply for 0.5 s"),
    ("C", ""),
    ("I", "hook", {"status": None, "said": "ä\n"}),
    ("E", {}),
]


def test_every_record_is_read_as_it_was_noted_to_the_last_bit() -> None:
    writer = TapeWriter()
    lines = [writer.line(one) for one in RECORDS]
    assert all(line.count("\n") == 1 for line in lines)
    assert list(TapeReader().records([line[:-1] for line in lines])) == RECORDS


@pytest.mark.parametrize("is_symmetric", [True, False])
def test_a_fit_is_read_as_it_was_noted_to_the_last_bit(is_symmetric: bool) -> None:
    random = np.random.default_rng(1)
    root = random.standard_normal((17, 17)) * 1e-9
    root[13:] = 0.0
    covariance = root @ root.T
    if not is_symmetric:
        covariance[2, 1] = np.nextafter(covariance[1, 2], 1.0)
        covariance[3, 1] = -0.0
    fit = FitResult(
        "full", Correction(1 / 3, -2e-7), NOW, 10, 2, 0.1, -0.0, 1e-300, AngleBias(0.1), (1.0, 2.0, 3.0), covariance
    )
    gate = GateVerdict("off the path", {"outlier": 3}, 1)
    given: Any = RefitReply(fit, None, ("a note",), Model.NEW_FIT, gate)  # type: ignore[arg-type]
    line = TapeWriter().line(("F", given))
    ((letter, read),) = TapeReader().records([line[:-1]])
    assert isinstance(read, FitAnswer)
    assert (letter, read.fit, read.notes, read.model, read.gate) == ("F", fit, ("a note",), Model.NEW_FIT, gate)
    assert read.fit is not None
    assert read.fit.covariance is not None
    assert read.fit.covariance.tobytes() == covariance.tobytes()


# Files


def test_records_reach_the_file_within_a_second_of_their_tick(tmp_path: Path) -> None:
    path = tmp_path / f"a{SUFFIX}"
    kept = tape(path)
    for record in ticks(25):
        kept.note(record)
    found = [one for one in read_tape(path).records() if one[0] == "T"]
    assert len(found) >= 20
    for k in range(12):  # no reply comes: a tick hands over
        kept.note(("T", NOW + 2.5 + 0.1 * k, 1.0, True, (), None))
    assert len([one for one in read_tape(path).records() if one[0] == "T"]) >= 29
    kept.close()
    read = read_tape(path)
    assert (read.is_whole, read.head["of"], len(read.lines)) == (True, "a test", 62)


def test_a_recording_never_goes_over_another(tmp_path: Path) -> None:
    first, second = (tape(tmp_path / f"a{SUFFIX}") for _ in range(2))
    assert [first.path.name, second.path.name] == [f"a{SUFFIX}", f"a-2{SUFFIX}"]


def full(_fd: int, _data: bytes) -> int:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_on_a_full_disk_the_recording_waits_for_room_which_is_an_alarm_until_it_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{SUFFIX}"
    kept, given = tape(path), ticks(60)
    with capture_logs() as logs:
        monkeypatch.setattr(os, "write", full)
        for record in given[:60]:
            kept.note(record)
        assert kept.problem == f"a{SUFFIX}: No space left on device"
        monkeypatch.undo()
        for record in given[60:]:
            kept.note(record)
        assert kept.problem == ""
    kept.close()
    assert [one["event"] for one in logs] == ["tape.not_saved", "tape.saved_again"]
    read = read_tape(path)
    assert (read.is_whole, len(list(read.records()))) == (True, len(given))


def test_a_recording_that_no_disk_takes_ends_and_is_an_alarm_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tape_file, "MOST_UNSAVED_BYTES", 200)
    (tmp_path / "file").write_text("")
    ended = [
        tape(tmp_path / "file" / f"a{SUFFIX}"),
        tape(tmp_path / f"b{SUFFIX}", AtOnce(takes=False)),
        tape(tmp_path / f"c{SUFFIX}", largest_bytes=10),
    ]
    for kept in ended:
        for record in ticks(60):
            kept.note(record)
        kept.close()
    assert [kept.problem.partition(": ")[2] for kept in ended] == [
        "File exists",
        "the disk does not keep up",
        "it has 0 MB",
    ]


@pytest.mark.parametrize("record", [("I", "hook", {"lasted_s": float("nan")}), ("?", 1), ("X", NOW)])
def test_what_cannot_be_written_ends_the_recording_without_a_gap_and_is_an_alarm(
    tmp_path: Path, record: Record
) -> None:
    kept = tape(tmp_path / f"a{SUFFIX}")
    for one in [*ticks(20), record, *ticks(20)]:
        kept.note(one)
    kept.close()
    assert kept.problem.startswith(f"a{SUFFIX}: ")
    read = list(read_tape(kept.path).records())
    assert 10 < len(read) < 40
    assert read == ticks(20)[: len(read)]


def aged(directory: Path, name: str, days: float, size: int = 1000) -> None:
    path = directory / (name if "." in name else f"{name}{SUFFIX}")
    path.write_bytes(bytes(size))
    os.utime(path, (1e9 - 86400 * days, 1e9 - 86400 * days))


def test_old_recordings_and_the_oldest_of_too_many_are_removed_and_told(tmp_path: Path) -> None:
    for name, days, size in (("a", 40.0, 1000), ("b", 3.0, 500_000), ("c", 2.0, 400_000), ("d", 1.0, 400_000)):
        aged(tmp_path, name, days, size)
    (tmp_path / "a.html").write_text("stays")
    (tmp_path / "a.tdm").write_text("goes")
    with capture_logs() as logs:
        gone = remove_old(tmp_path, KeepRules(30.0, 1.0, 400.0), 1e9)
    assert [path.name[0] for path in gone] == ["a", "b"]
    assert (logs[0]["event"], logs[0]["count"], logs[0]["reason"]) == (
        "tape.removed",
        2,
        "older than 30 d, more than 1 MB",
    )
    assert sorted(path.name[0] for path in tmp_path.iterdir()) == ["a", "c", "d"]
    assert remove_old(tmp_path / "nowhere", KeepRules(30.0, 1.0, 400.0)) == []


def test_old_reports_are_removed_and_nothing_that_is_none(tmp_path: Path) -> None:
    old, other = "20260818T124411Z-DEMO-1", ["index.html", "index.json", "mine.json", "20260818T124411Z-DEMO-1.txt"]
    for name in (f"{old}.html", f"{old}.json", *other):
        aged(tmp_path, name, 500.0)
    aged(tmp_path, "20280818T124411Z-DEMO-1.html", 300.0)
    aged(tmp_path, f"{old}.station.json", 500.0)
    with capture_logs() as logs:
        assert remove_old(tmp_path, KeepRules(1000.0, 1.0, 400.0), 1e9) == []
    assert [(one["event"], one["file_count"]) for one in logs] == [("report.removed", 2)]
    stay = [*other, "20280818T124411Z-DEMO-1.html", f"{old}.station.json"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(stay)


@pytest.mark.parametrize(("name", "part"), [("SCD-1", "SCD-1"), ("../x y", "x-y"), ("ü", "satellite")])
def test_a_satellite_name_is_a_part_of_a_file_name(name: str, part: str) -> None:
    assert tape_name(DEMO_TAI_S, name) == f"20260818T124411Z-{part}{SUFFIX}"


# The head


def test_an_ephemeris_is_recorded_with_every_state() -> None:
    segments, _ = parse_oem(kvn(states()), "made.oem")
    source = EphemerisPropagator(Ephemeris(segments, EarthOrientation(0.1, 0.2, 0.3)))
    back = orbit_of(json.loads(json.dumps(orbit_json(source))), EarthOrientation(0.1, 0.2, 0.3))
    start, end = source.spans_tai_s[0]
    times = np.linspace(start, end, 20)
    one = Correction(1e-4, 1e-4, 1e-9)
    for a, b in zip(source.corrected(one).states_teme(times), back.corrected(one).states_teme(times), strict=True):
        assert a.tobytes() == b.tobytes()
    assert (back.kind, back.epoch_tai_s) == (source.kind, source.epoch_tai_s)


def test_a_pass_with_a_memory_of_the_mount_is_replayed(tmp_path: Path) -> None:
    path, target = tmp_path / f"m{SUFFIX}", demo_target()
    memory = first_memory(estimator_settings(target.station, target.satellite), NOW)
    climb(12.0, target, tape=path, memory=replace(memory, pass_count=3), antenna=RISING_ANTENNA)
    assert replay_pass(path, fits_anew=True).difference is None


# The runs


def test_a_station_that_wants_none_has_no_recording(tmp_path: Path) -> None:
    job: Any = type("Job", (), {"coming": object()})()
    link: Any = None
    off = demo_target(recording={"passes": False})
    assert begin_tape(tmp_path, off, job, link, NOW, Writer("w")) is None


def test_a_head_that_cannot_be_written_costs_the_recording_and_no_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job: Any = SimpleNamespace(coming=SimpleNamespace(rise_tai_s=NOW), satellite="S")
    link: Any = None
    monkeypatch.setattr(pass_tape, "head_of", lambda *_: {"byte_time_s": float("inf")})
    with capture_logs() as logs:
        assert begin_tape(tmp_path, demo_target(), job, link, NOW, Writer("w")) is None
    assert [one["event"] for one in logs] == ["tape.ended"]


def test_a_station_records_each_pass_with_its_schedule_and_has_the_report_made(tmp_path: Path) -> None:
    made: list[Path] = []

    async def report(kept: TapeFile, _files: Writer, _config: Path) -> None:
        made.append(kept.path)

    config, state = configured(tmp_path / "config"), tmp_path / "state"
    state.mkdir()
    run_days(config, state, START + 200.0, START + 230.0, report=report)
    found = sorted(state.glob(f"passes/*{SUFFIX}"))
    assert found == sorted(made)
    assert [path.name.partition("-")[2] for path in found] == [f"SCD-1{SUFFIX}"]
    done = replay_pass(found[0])
    assert (done.difference, done.replay.is_ended, done.is_whole) == (None, True, True)
    facts = [record for record in read_tape(found[0]).records() if record[0] == "I"]
    assert (facts[0][1], facts[0][2]["satellite"], facts[0][2]["priority"]) == ("schedule", "scd", 7)


def test_how_hooks_ended_is_in_the_recording() -> None:
    noted: list[Record] = []
    kept: Any = type("Kept", (), {"note": staticmethod(noted.append)})()
    note_hooks(kept, [HookResult(Hook.AT_LOSS, -9, 1.23456, "x" * 999 + "\n", "killed")])
    ((letter, name, what),) = noted
    assert (letter, name, what["hook"], what["status"], what["lasted_s"]) == ("I", "hook", "at_loss", -9, 1.23)
    assert (len(what["said"]), what["problem"]) == (300, "killed")


async def told_by_report(path: Path, longest_s: float = 60.0) -> list[Any]:
    files = Writer("files")
    kept = TapeFile(path, {"of": "a test"}, files)
    kept.close()
    if path.exists() and path.stat().st_size == 0:
        raise AssertionError
    with capture_logs() as logs:
        await report_after(kept, files, path.parent, longest_s)
    files.close()
    return [one for one in logs if one["event"].startswith("report.")]


async def test_a_report_that_cannot_be_made_is_told_and_ends_nothing(tmp_path: Path) -> None:
    (failed,) = await told_by_report(tmp_path / f"none{SUFFIX}")
    assert failed["event"] == "report.failed"
    assert "the head of the tape cannot be used" in failed["reason"]
    (late,) = await told_by_report(tmp_path / f"late{SUFFIX}", 0.01)
    assert "not made within" in late["reason"]


@pytest.mark.long
async def test_a_report_is_made_in_a_process_of_its_own(tmp_path: Path) -> None:
    files = Writer("files")
    kept: Any = type("Kept", (), {"path": tmp_path / f"latch{SUFFIX}"})()
    kept.path.write_bytes(path_of("latch").read_bytes())
    with capture_logs() as logs:
        await asyncio.wait_for(report_after(kept, files, tmp_path), 90.0)
    files.close()
    assert [(one["event"], one["file"]) for one in logs] == [("report.made", str(tmp_path / "latch.html"))]
    names = sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(("latch", "index")))
    assert names == ["index.html", "index.json", "latch.html", "latch.json", "latch.omm", f"latch{SUFFIX}", "latch.tdm"]


def test_a_head_that_was_changed_is_refused_with_its_reason(tmp_path: Path) -> None:
    with gzip.open(path_of("latch"), "rt") as file:
        first, _, rest = file.read().partition("\n")
    path = tmp_path / f"head{SUFFIX}"
    with gzip.open(path, "wt") as file:
        file.write(json.dumps({**json.loads(first), "orbit": {"sgp4": {}}}) + "\n" + rest)
    with pytest.raises(Exception, match="the head of the tape cannot be used"):
        replay_pass(path)
