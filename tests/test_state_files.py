"""Where state lives, that a rehearsal keeps its own, and the snapshot that never stops a tick."""

import errno
import json
import re
from dataclasses import dataclass
from pathlib import Path

import pytest
from drained import drain
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.edge.acu_place import file_name
from acu_daemon.edge.state_directory import (
    EVERY_TICKS,
    SNAPSHOT,
    SnapshotFile,
    StateOwner,
    antenna_directory,
    choice_text,
    older_folders,
    state_directory,
    with_choice,
)
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


URL = "tcp://127.0.0.1:3842"
CUIABA = StateOwner.of("Cuiaba", URL, "1")


def test_each_antenna_has_a_folder_of_its_own_that_says_whose_it_is(tmp_path: Path) -> None:
    others = [
        StateOwner.of("Alcantara", URL, "1"),
        StateOwner.of("Cuiaba", "tcp://127.0.0.1:3843", "1"),
        StateOwner.of("Cuiaba", URL, "2"),
        StateOwner.of("Cuiaba ", URL, "1"),
        StateOwner.of("cuiaba", URL, "1"),
        StateOwner.of("Cuiab\u00e1", URL, "1"),
        StateOwner.of("../Cuiaba", URL, "1"),
        StateOwner.of("Cuiaba@tcp", URL, "1"),
        StateOwner.of("", URL, "1"),
        StateOwner.of("x" * 300, URL, "1"),
        StateOwner.of("x" * 301, URL, "1"),
    ]
    folders = [antenna_directory(tmp_path, one) for one in (CUIABA, *others)]
    assert len(set(folders)) == len(folders)
    assert {folder.parent for folder in folders} == {tmp_path}
    assert folders[0].name.startswith("Cuiaba-")
    assert "@tcp-127.0.0.1-3842-1-" in folders[0].name
    assert all(folder.stat().st_mode & 0o777 == 0o750 and folder.name.count("@") == 1 for folder in folders)
    for same in ("tcp://localhost:3842", f"{URL}?baud=9600"):
        assert antenna_directory(tmp_path, StateOwner.of("Cuiaba", same, "1")) == folders[0]


@given(st.text(max_size=80), st.text(max_size=80))
def test_no_two_names_share_a_file_and_every_one_is_a_plain_word(one: str, other: str) -> None:
    assert (file_name(one) == file_name(other)) == (one == other)
    assert re.fullmatch(r"[\w.-]{8,60}", file_name(one), re.ASCII)
    assert not file_name(one).startswith((".", "-"))


def test_what_an_earlier_version_kept_and_older_names_of_the_antenna_are_found_and_no_others(tmp_path: Path) -> None:
    renamed = antenna_directory(tmp_path, StateOwner.of("Cuiaba old", URL, "1"))
    moved = antenna_directory(tmp_path, StateOwner.of("Cuiaba", "serial:///dev/ttyS0", "1"))
    antenna_directory(tmp_path, StateOwner.of("Natal", "serial:///dev/ttyS1", "1"))
    antenna_directory(tmp_path, CUIABA)
    (tmp_path / "some@file").touch()
    assert older_folders(tmp_path, CUIABA) == (tmp_path, *sorted([renamed, moved]))
    assert older_folders(tmp_path / "nowhere", CUIABA) == (tmp_path / "nowhere",)


def test_on_a_full_disk_without_the_folder_the_directory_itself_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "mkdir", full)
    assert antenna_directory(tmp_path, CUIABA) == tmp_path


def test_advice_is_a_command_that_finds_the_daemon_from_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    choice = choice_text(Path("my config"), Path("x"), is_rehearsal=True)
    assert choice == f"--config '{tmp_path}/my config' --state {tmp_path}/x --rehearsal"
    assert choice_text(Path("c"), None, is_rehearsal=False) == f"--config {tmp_path}/c"
    monkeypatch.setenv("STATE_DIRECTORY", f"{tmp_path}/systemd:{tmp_path}/second")  # which no person's shell has
    assert choice_text(None, None, is_rehearsal=False) == f"--state {tmp_path}/systemd"
    text = "look, then `acu-daemon clear`; `acu-daemon run` starts"
    assert with_choice(text, "--state '\\1'") == "look, then `acu-daemon clear --state '\\1'`; `acu-daemon run` starts"
    assert with_choice(text, "") == text


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
        drain(writer)
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
        drain(writer)
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
