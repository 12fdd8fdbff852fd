"""The writer's thread: what it does is done in order, what it cannot take is counted, and nobody waits for it."""

import json
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import structlog
from structlog.testing import capture_logs

import acu_daemon.edge.writer as edge
from acu_daemon.edge.logs import configure_logs, tell_dropped
from acu_daemon.edge.writer import LIVE_LIMIT, Latest, QueuedStream, Writer, replace_file

PIPE_BYTES = 65536
PATIENT_S = 60.0


@pytest.fixture(autouse=True)
def _own_configuration() -> Iterator[None]:
    before = structlog.get_config()
    yield
    structlog.configure(**before)


class Stuck:
    """A job that does not end until it is let go."""

    def __init__(self) -> None:
        self.begun, self.go = threading.Event(), threading.Event()

    def __call__(self) -> None:
        self.begun.set()
        self.go.wait()


def stuck(writer: Writer) -> Stuck:
    """Have the writer stand in a job."""
    job = Stuck()
    writer.put(job)
    job.begun.wait()
    return job


def test_jobs_are_done_in_order_and_all_of_them_before_it_ends() -> None:
    done: list[int] = []
    writer = Writer("test")
    for number in range(500):
        assert writer.put(lambda number=number: done.append(number))  # type: ignore[misc]
    assert writer.close(PATIENT_S)
    assert done == list(range(500))


def test_a_full_queue_drops_and_counts_and_says_so_once_it_is_empty_again() -> None:
    told: list[int] = []
    writer = Writer("test", limit=3, on_drained=told.append)
    job = stuck(writer)
    assert [writer.put(lambda: None) for _ in range(10)] == [True] * 3 + [False] * 7
    assert told == []
    job.go.set()
    assert writer.close(PATIENT_S)
    assert told == [writer.dropped_count] == [7]


def test_a_stuck_writer_holds_nobody_up_for_longer_than_it_is_given() -> None:
    writer = Writer("test")
    job = stuck(writer)
    assert not writer.close(0.01)
    assert not writer.put(lambda: None)
    job.go.set()
    assert writer.close(PATIENT_S)


def test_p10_a_disk_that_does_not_answer_is_told_while_it_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edge, "STUCK_S", -1.0)
    writer = Writer("test")
    assert writer.problem == ""
    job = stuck(writer)
    assert writer.problem == "the disk has not answered for 0 s"
    job.go.set()
    assert writer.close(PATIENT_S)
    assert writer.problem == ""


def test_what_comes_after_the_end_is_done_at_once() -> None:
    writer, done = Writer("test"), [1]
    assert writer.close(PATIENT_S)
    assert writer.put(done.clear)
    assert done == []


def test_a_job_that_fails_does_not_end_the_others() -> None:
    done: list[int] = []
    writer = Writer("test")
    with capture_logs() as logs:
        writer.put(lambda: done.append(1 // 0))
        writer.put(lambda: done.append(1))
        assert writer.close(PATIENT_S)
    assert done == [1]
    assert [(log["event"], log["reason"][:17]) for log in logs] == [("writer.failed", "ZeroDivisionError")]


def test_of_values_that_come_faster_than_they_are_saved_only_the_newest_counts() -> None:
    saved: list[int] = []
    writer = Writer("test")
    job = stuck(writer)
    latest = Latest(writer, saved.append)
    for value in range(100):
        latest.offer(value)
    assert writer.waiting_count == 1
    job.go.set()
    assert writer.close(PATIENT_S)
    assert saved == [99]


def test_a_value_offered_after_one_that_was_saved_at_once_is_saved_too() -> None:
    """P10: the thread may have done its job before `put` is back."""
    saved: list[int] = []
    writer = Writer("test")
    assert writer.close(PATIENT_S)  # from now on a job is done within `put`
    latest = Latest(writer, saved.append)
    for value in range(3):
        latest.offer(value)
    assert saved == [0, 1, 2]


def test_a_live_line_is_left_out_while_others_wait(tmp_path: Path) -> None:
    writer = Writer("test")
    with (tmp_path / "drawn").open("w") as file:
        job = stuck(writer)
        stream = QueuedStream(file, writer)
        for number in range(2 * LIVE_LIMIT):
            stream.write(f"{number} ")
            stream.flush()
        job.go.set()
        assert writer.close(PATIENT_S)
    assert len((tmp_path / "drawn").read_text().split()) == LIVE_LIMIT


def entries_of(text: bytes) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith(b"\n")]


def test_p8_a_log_that_nobody_reads_stops_nobody_and_its_missing_lines_are_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reader, fd = os.pipe()
    writer = Writer("log", limit=100, on_drained=tell_dropped)
    with os.fdopen(fd, "w") as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        configure_logs(lambda: 0.0, tags={}, is_terminal=False, writer=writer)
        log = structlog.get_logger("test")
        offered = 2 * PIPE_BYTES // 100 + 200
        for number in range(offered):
            log.info("line", number=f"{number:060d}")
        lost = writer.dropped_count
        assert lost > 0
        text = b""
        while sum(entry.get("count", 0) for entry in entries_of(text)) < lost:
            text += os.read(reader, PIPE_BYTES)
        assert writer.close(PATIENT_S)
    numbers = [int(entry["number"]) for entry in entries_of(text) if entry["event"] == "line"]
    assert numbers == sorted(numbers)
    assert len(numbers) == offered - lost
    os.close(reader)


def test_p10_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x"
    replace_file(path, b"old")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        replace_file(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_p10_what_a_killed_process_left_unfinished_is_taken_up_again(tmp_path: Path) -> None:
    """However many were killed on a full disk: their pieces would fill it further."""
    path = tmp_path / "x"
    (tmp_path / ".x.new").write_bytes(b"a piece of something long")
    replace_file(path, b"whole")
    assert path.read_bytes() == b"whole"
    assert list(tmp_path.iterdir()) == [path]


def test_without_a_thread_jobs_are_done_at_once_and_that_is_told_until_there_is_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def denied(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    done: list[int] = []
    with monkeypatch.context() as system:
        system.setattr(threading.Thread, "start", denied)
        writer = Writer("files")
        assert writer.put(lambda: done.append(1))
        assert done == [1]
        assert writer.problem == "the system denies a thread: the loop itself waits for the disk"
        never = Writer("log")
        assert never.put(lambda: 1 / 0)
        assert never.close()
    assert writer.put(lambda: done.append(threading.get_ident()))
    assert writer.problem == ""
    assert writer.close()
    assert done[1] != threading.get_ident()
