"""Whatever writes a file or a stream: in pieces, with room that comes late, and with an error at each of its calls."""

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from test_tape_files import NOW, AtOnce, ticks

from acu_daemon.edge.recording import RecordingWriter, read_readings
from acu_daemon.edge.tape_file import SUFFIX, TapeFile, read_tape
from acu_daemon.edge.writer import remove_file, replace_file, write_text
from acu_daemon.model import Reading

REAL = {name: getattr(os, name) for name in ("write", "fsync", "fdatasync", "close", "rename", "replace", "unlink")}
DATA = bytes(range(256)) * 3


def in_pieces(most: int) -> Callable[[int, bytes], int]:
    return lambda fd, data: REAL["write"](fd, data[:most])


def kept_tape(path: Path) -> None:
    kept = TapeFile(path, {"of": "a test"}, AtOnce())
    for record in ticks(30):
        kept.note(record)
    kept.close()


def recorded(path: Path) -> None:
    with RecordingWriter(path, now_tai_s=NOW) as kept:
        for k in range(30):
            kept.add(Reading(NOW + k, 10.0 + k, 20.0, True))


@pytest.mark.parametrize("most", [1, 7, 100])
def test_what_a_disk_takes_in_pieces_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    monkeypatch.setattr(os, "write", in_pieces(most))
    kept_tape(tmp_path / f"a{SUFFIX}")
    recorded(tmp_path / "b.csv")
    with (tmp_path / "c").open("w", encoding="utf-8") as stream:
        write_text(stream, "äöü" * 50)
    monkeypatch.undo()
    read = read_tape(tmp_path / f"a{SUFFIX}")
    assert (read.is_whole, len(list(read.records()))) == (True, len(ticks(30)))
    assert len(read_readings(tmp_path / "b.csv")) == 30
    assert (tmp_path / "c").read_text(encoding="utf-8") == "äöü" * 50


@pytest.mark.parametrize("taken", range(12))
def test_a_disk_that_is_full_after_some_bytes_leaves_whole_lines_and_a_tape_that_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, taken: int
) -> None:
    room, tape, path = [100_000], TapeFile(tmp_path / f"a{SUFFIX}", {"of": "a test"}, AtOnce()), tmp_path / "b.csv"

    def write(fd: int, data: bytes) -> int:
        if not room[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        count = REAL["write"](fd, data[: room[0]])
        room[0] -= count
        return count

    monkeypatch.setattr(os, "write", write)
    given, kept_count = ticks(60), 0
    with RecordingWriter(path, now_tai_s=NOW) as kept:
        for k in range(9):
            room[0] = 5 * taken if k in (5, 6) else 100_000
            kept.add(Reading(NOW + k, 10.0, 20.0, True))
            kept_count += not kept.problem
        room[0] = 5 * taken
        for record in given:
            tape.note(record)
    room[0] = 100_000
    tape.close()
    read = read_tape(tmp_path / f"a{SUFFIX}")
    assert (read.is_whole, list(read.records()), tape.problem) == (True, given, "")
    assert kept_count == (9 if taken >= 10 else 7)  # of 49 bytes each
    assert len(read_readings(path)) == kept_count


# The order of what must be on the disk


class Calls:
    """What is asked of the system, in its order; the nth call fails."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, fails: int = -1) -> None:
        self.names: list[str] = []
        self._fails = fails
        for name in ("fsync", "close"):
            monkeypatch.setattr(os, name, self._of(name))
        for name in ("replace", "unlink"):
            real = getattr(Path, name)
            monkeypatch.setattr(Path, name, self._of(name, real))

    def _of(self, name: str, real: Any = None) -> Callable[..., Any]:
        def call(*args: Any, **more: Any) -> Any:
            self.names.append(name)
            done = (
                (real or REAL[name])(*args, **more) if name == "close" or len(self.names) - 1 != self._fails else None
            )
            if len(self.names) - 1 == self._fails:
                raise OSError(errno.EIO, "Input/output error")
            return done

        return call


@contextmanager
def calls(fails: int = -1) -> Iterator[list[str]]:
    with pytest.MonkeyPatch.context() as patch:
        yield Calls(patch, fails).names


def open_files() -> set[str]:
    return {one.name for one in Path("/proc/self/fd").iterdir()}


def test_a_file_is_on_the_disk_before_it_has_its_name_and_the_name_after(tmp_path: Path) -> None:
    with calls() as names:
        replace_file(tmp_path / "x", DATA)
    assert names == ["fsync", "replace", "fsync", "close"]
    assert (tmp_path / "x").read_bytes() == DATA
    with calls() as names:
        replace_file(tmp_path / "y", DATA, is_synced=False)
    assert names == ["replace"]
    with calls() as names:
        remove_file(tmp_path / "x")
        remove_file(tmp_path / "x")
    assert names == ["unlink", "fsync", "close"] * 2
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("fails", range(4))
def test_whichever_call_fails_the_file_is_the_old_or_the_new_one_whole_and_it_is_told(
    tmp_path: Path, fails: int
) -> None:
    path = tmp_path / "x"
    replace_file(path, b"old")
    before = open_files()
    with calls(fails), pytest.raises(OSError, match="Input/output error"):
        replace_file(path, DATA)
    assert path.read_bytes() == (b"old" if fails < 2 else DATA)
    assert list(tmp_path.iterdir()) == [path]
    assert open_files() == before


@pytest.mark.parametrize("fails", ["fsync", "fdatasync"])
def test_an_error_of_the_last_sync_closes_the_file_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    before = open_files()

    def failing(_: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(os, fails, failing)
    kept_tape(tmp_path / f"a{SUFFIX}")
    recorded(tmp_path / "b.csv")
    assert open_files() == before
    assert read_tape(tmp_path / f"a{SUFFIX}").is_whole
