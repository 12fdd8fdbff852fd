"""Where state lives, that a rehearsal keeps its own, and the snapshot that never stops a tick."""

import json
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from acu_daemon.edge.state import EVERY_TICKS, SNAPSHOT, SnapshotFile, state_directory
from acu_daemon.edge.writer import Writer
from acu_daemon.errors import UsageError


@pytest.fixture(autouse=True)
def no_surroundings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("STATE_DIRECTORY", "XDG_STATE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))


def test_what_is_asked_for_comes_first_then_systemd_then_the_home(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert state_directory(None, is_rehearsal=False) == tmp_path / "home" / ".local" / "state" / "acu-daemon"
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "xdg"))
    assert state_directory(None, is_rehearsal=False) == tmp_path / "xdg" / "acu-daemon"
    monkeypatch.setenv("STATE_DIRECTORY", f"{tmp_path}/systemd/acu:{tmp_path}/second")
    assert state_directory(None, is_rehearsal=False) == tmp_path / "systemd" / "acu"
    asked = state_directory(tmp_path / "asked", is_rehearsal=False)
    assert asked == tmp_path / "asked"
    assert asked.is_dir()
    assert not (tmp_path / "second").exists()


def test_a_relative_state_home_is_ignored_as_its_specification_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", "here")
    assert state_directory(None, is_rehearsal=False) == tmp_path / "home" / ".local" / "state" / "acu-daemon"


@pytest.mark.parametrize("asked", ["x/state", ".", "x/..", "x/"])
def test_a_rehearsal_has_a_folder_of_its_own_beside_the_real_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asked: str
) -> None:
    (tmp_path / "work" / "x").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "work")
    real = state_directory(Path(asked), is_rehearsal=False)
    rehearsal = state_directory(Path(asked), is_rehearsal=True)
    assert real == Path(asked).resolve()
    assert (rehearsal.parent, rehearsal.name) == (real.parent, f"{real.name}-rehearsal")
    assert rehearsal.is_dir()


def test_a_rehearsal_does_not_make_the_real_folder(tmp_path: Path) -> None:
    state_directory(tmp_path / "state", is_rehearsal=True)
    assert [path.name for path in tmp_path.iterdir()] == ["state-rehearsal"]


def test_a_folder_that_cannot_be_made_is_told_with_what_to_do(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(UsageError, match=r"^state directory .*/file: File exists; choose another with --state DIR$"):
        state_directory(file, is_rehearsal=False)
    with pytest.raises(UsageError, match=r"/file/below: Not a directory; choose another"):
        state_directory(file / "below", is_rehearsal=False)


def test_a_user_without_a_home_is_told_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    with pytest.raises(UsageError, match=r"choose one with --state DIR$"):
        state_directory(None, is_rehearsal=False)


@dataclass(frozen=True)
class Seen:
    tick: int
    az_deg: float | None = None


def test_a_snapshot_is_written_once_in_ten_ticks_and_whole(tmp_path: Path) -> None:
    writer = Writer("files")
    snapshots = SnapshotFile(tmp_path, writer)
    seen = []
    for tick in range(1, 35):
        snapshots.write(Seen(tick))
        while writer.waiting_count or (tick >= EVERY_TICKS and not (tmp_path / SNAPSHOT).exists()):
            time.sleep(0.001)
        if tick % EVERY_TICKS == EVERY_TICKS - 1 and tick > EVERY_TICKS:
            seen.append(json.loads((tmp_path / SNAPSHOT).read_text())["tick"])
    assert writer.close()
    assert seen == [EVERY_TICKS, 2 * EVERY_TICKS]
    assert json.loads((tmp_path / SNAPSHOT).read_text()) == {"tick": 3 * EVERY_TICKS, "az_deg": None}
    assert [path.name for path in tmp_path.iterdir()] == [SNAPSHOT]


def test_a_snapshot_that_cannot_be_written_is_counted_and_stops_nothing(tmp_path: Path) -> None:
    writer = Writer("files")
    snapshots = SnapshotFile(tmp_path / "gone", writer)
    for tick in range(3 * EVERY_TICKS):
        snapshots.write(Seen(tick))
        while writer.waiting_count:
            time.sleep(0.001)
    assert writer.close()
    assert 1 <= snapshots.failed_count <= 3


def test_a_folder_where_everybody_may_write_is_refused_with_what_to_do(tmp_path: Path) -> None:
    made = tmp_path / "state"
    made.mkdir()
    made.chmod(0o770)  # a group's is fine
    assert state_directory(made, is_rehearsal=False) == made
    made.chmod(0o1777)
    with pytest.raises(UsageError, match=rf"^{made}: everybody may write there; close it: chmod o-w {made}$"):
        state_directory(made, is_rehearsal=False)
    below = made / "mine"  # as below a sticky /tmp
    assert state_directory(below, is_rehearsal=False) == below
    assert below.stat().st_mode & 0o777 == 0o750
