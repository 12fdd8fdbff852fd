"""P6, P10: the latch stands in a file of its own, and a file that is there latches, whatever else is lost."""

import errno
from pathlib import Path

import pytest
from drained import drain
from structlog.testing import capture_logs
from test_run_state import written

import acu_daemon.edge.latch as latch_file
from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.latch import DISARMED, LATCH, LatchKeeper, read_latch
from acu_daemon.edge.run_state import read_run_state
from acu_daemon.edge.writer import Writer

TEXT = "elevation stands still away from its command"


class NoonClock(LoopClock):
    """A clock that stands."""

    def __init__(self) -> None:
        """No loop is needed."""

    def tai_s(self) -> float:
        return 32.0


def see(directory: Path, *latches: str, name: str = LATCH) -> None:
    """Ticks of a daemon that begins with what stands there."""
    writer = Writer("files")
    keeper = LatchKeeper(directory, writer, read_latch(directory, name), NoonClock(), name)
    for latch in latches:
        keeper.see(latch)
        drain(writer)
    assert writer.close(60.0)


def test_p6_a_latch_is_a_readable_file_and_gone_when_it_is_cleared(tmp_path: Path) -> None:
    see(tmp_path, "", TEXT, TEXT)
    assert (tmp_path / LATCH).read_text() == f"{TEXT}\n2000-01-01T12:00:00.000Z\n"
    with capture_logs() as logs:
        assert read_latch(tmp_path) == TEXT
    assert [(log["event"], log["since"]) for log in logs] == [("latch.kept", "2000-01-01T12:00:00.000Z")]
    see(tmp_path, TEXT, "")
    assert list(tmp_path.iterdir()) == []
    assert read_latch(tmp_path) == ""


@pytest.mark.parametrize("name", [LATCH, DISARMED])
@pytest.mark.parametrize("damage", [b"", b"{", b"\0" * 4096])
def test_p1_p6_a_latch_and_a_disarm_outlive_a_run_state_that_is_torn_or_gone(
    tmp_path: Path, damage: bytes, name: str
) -> None:
    see(tmp_path, TEXT, name=name)
    written(tmp_path).write_bytes(damage)
    assert read_run_state(tmp_path).fit is None
    assert read_latch(tmp_path, name) == TEXT


def test_p1_a_file_of_a_disarm_that_cannot_be_read_disarms_and_says_what_to_do(tmp_path: Path) -> None:
    (tmp_path / DISARMED).touch()
    with capture_logs() as logs:
        text = read_latch(tmp_path, DISARMED)
    assert [(log["event"], log["log_level"]) for log in logs] == [("disarmed.unreadable", "error")]
    assert "acu-daemon arm" in text
    see(tmp_path, text, "", name=DISARMED)
    assert not (tmp_path / DISARMED).exists()


@pytest.mark.parametrize("data", [b"", b"\n\n", b"a line", b"\xff\n\n", b"\0" * 50, b"a\n" * 9, b"x" * 5000, None])
def test_p6_a_file_that_cannot_be_read_latches_too_and_says_what_to_do(tmp_path: Path, data: bytes | None) -> None:
    (tmp_path / LATCH).mkdir() if data is None else (tmp_path / LATCH).write_bytes(data)
    with capture_logs() as logs:
        text = read_latch(tmp_path)
    assert [(log["event"], log["log_level"]) for log in logs] == [("latch.unreadable", "error")]
    assert "cannot be read" in text
    assert "acu-daemon clear" in text
    if data is not None:
        see(tmp_path, text, "")
        assert read_latch(tmp_path) == ""


def test_p6_p10_on_a_full_disk_an_empty_file_latches_and_the_text_follows_when_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as disk, capture_logs() as logs:
        disk.setattr(latch_file, "replace_file", full)
        see(tmp_path, TEXT, TEXT, TEXT)
    assert [log["event"] for log in logs] == ["latch.not_saved"]
    assert (tmp_path / LATCH).read_bytes() == b""
    assert "cannot be read" in read_latch(tmp_path)


def test_p6_p10_what_was_latched_on_a_full_disk_can_be_cleared_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(latch_file, "replace_file", full)
    see(tmp_path, TEXT, TEXT, "")
    assert list(tmp_path.iterdir()) == []
    assert read_latch(tmp_path) == ""


def test_p6_what_could_not_be_written_is_written_at_a_later_tick(tmp_path: Path) -> None:
    directory = tmp_path / "gone"
    writer = Writer("files")
    keeper = LatchKeeper(directory, writer, "", NoonClock())
    with capture_logs() as logs:
        for _ in range(3):
            keeper.see(TEXT)
            drain(writer)
        writer.put(directory.mkdir)
        keeper.see(TEXT)
        assert writer.close(60.0)
    assert [log["event"] for log in logs] == ["latch.not_saved", "latch.saved_again"]
    assert read_latch(directory) == TEXT


def see_with_older(directory: Path, older: list[Path], *latches: str, is_left_out: bool = False) -> None:
    writer = Writer("files")
    first = "" if is_left_out else read_latch(directory, LATCH, older)
    keeper = LatchKeeper(directory, writer, first, NoonClock(), LATCH, older, is_left_out=is_left_out)
    for latch in latches:
        keeper.see(latch)
        drain(writer)
    assert writer.close(60.0)


def test_p6_a_latch_under_an_older_name_of_the_antenna_holds_until_a_person_clears_it(tmp_path: Path) -> None:
    plain, renamed, own = tmp_path, tmp_path / "old@acu", tmp_path / "new@acu"
    for folder in (renamed, own):
        folder.mkdir()
    for older in ([plain], [renamed], [plain, renamed]):
        for folder in older:
            (folder / LATCH).write_text(f"{TEXT}\n2000-01-01T12:00:00.000Z\n")
        with capture_logs() as logs:
            assert read_latch(own, LATCH, [plain, renamed]) == TEXT
        assert logs[0]["file"] == str(older[0] / LATCH)
        see_with_older(own, [plain, renamed], TEXT, TEXT)
        assert all((folder / LATCH).exists() for folder in older)
        see_with_older(own, [plain, renamed], TEXT, "")
        assert not any((folder / LATCH).exists() for folder in (plain, renamed, own))
        assert read_latch(own, LATCH, [plain, renamed]) == ""


def test_a_latch_of_another_rehearsal_is_left_out_and_gone_with_the_first_tick(tmp_path: Path) -> None:
    (tmp_path / LATCH).write_text(f"{TEXT}\n2000-01-01T12:00:00.000Z\n")
    see_with_older(tmp_path, [], "", is_left_out=True)
    assert list(tmp_path.iterdir()) == []
