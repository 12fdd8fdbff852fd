"""The control channel of a running daemon: who may ask, what is answered, and what is said when nobody is there."""

import asyncio
import contextlib
import errno
import os
import shlex
import socket
import stat
from pathlib import Path

import pytest
import structlog
from command_line import acu_daemon
from config_files import STATION, write

from acu_daemon.edge.control_socket import LONGEST_LINE, MOST_AT_ONCE, SOCKET, ControlSocket, ask
from acu_daemon.edge.state_directory import StateOwner, antenna_directory
from acu_daemon.errors import AcuDaemonError, UsageError


def answer(line: str, who: str) -> str:
    assert who == f"uid {os.getuid()} on this machine"
    return {"status": 'ok {"state": "IDLE"}', "arm": "error this daemon runs with --shadow"}.get(line, f"ok {line}")


async def asked(directory: Path, line: str) -> str:
    return await asyncio.to_thread(ask, directory, line)


async def test_a_line_is_answered_by_a_line(tmp_path: Path) -> None:
    channel = ControlSocket(tmp_path, answer)
    await channel.open()
    assert await asked(tmp_path, "status") == '{"state": "IDLE"}'
    with pytest.raises(AcuDaemonError, match="runs with --shadow"):
        await asked(tmp_path, "arm")
    await channel.close()
    assert not (tmp_path / SOCKET).exists()


async def test_the_socket_is_for_its_owner_and_group_whatever_the_umask(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        channel = ControlSocket(tmp_path, answer)
        await channel.open()
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / SOCKET).stat().st_mode) == 0o660
    await channel.close()


async def test_what_a_killed_daemon_left_is_replaced(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as dead:
        dead.bind(str(tmp_path / SOCKET))
    with pytest.raises(AcuDaemonError, match="no daemon runs"):
        ask(tmp_path, "status")
    channel = ControlSocket(tmp_path, answer)
    await channel.open()
    assert await asked(tmp_path, "disarm") == "disarm"
    await channel.close()


async def test_two_daemons_do_not_share_a_state_directory(tmp_path: Path) -> None:
    channel = ControlSocket(tmp_path, answer)
    await channel.open()
    with pytest.raises(UsageError, match="another daemon runs with this state directory"):
        await ControlSocket(tmp_path, answer).open()
    assert await asked(tmp_path, "clear") == "clear"
    await channel.close()


async def test_a_daemon_without_its_socket_has_the_directory_still(tmp_path: Path) -> None:
    """As in the instant in which two of them start, when neither listens yet."""
    channel = ControlSocket(tmp_path, answer)
    await channel.open()
    (tmp_path / SOCKET).unlink()
    with pytest.raises(UsageError, match="another daemon runs with this state directory"):
        await ControlSocket(tmp_path, answer).open()
    await channel.close()
    await channel.open()
    await channel.close()


async def test_a_crowd_is_let_in_a_few_at_a_time_and_answered(tmp_path: Path) -> None:
    """So that a tick that falls due meanwhile waits for a few of them and not for all."""
    channel = ControlSocket(tmp_path, answer)
    await channel.open()
    crowd = [socket.socket(socket.AF_UNIX) for _ in range(50)]
    let_in_count = 0
    for one in crowd:
        one.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            one.connect(str(tmp_path / SOCKET))
            let_in_count += 1
    assert let_in_count <= MOST_AT_ONCE + 1
    assert await asyncio.gather(*[asked(tmp_path, "disarm") for _ in range(50)]) == ["disarm"] * 50
    for one in crowd:
        one.close()
    await asyncio.sleep(0.01)
    await channel.close()


@pytest.mark.parametrize("why", [errno.EROFS, errno.ENOSPC])
async def test_p4_where_the_disk_fails_the_daemon_goes_on_without_and_stays_the_only_one(
    why: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(why, os.strerror(why))

    channel, second = ControlSocket(tmp_path, answer), ControlSocket(tmp_path, answer)
    monkeypatch.setattr(socket.socket, "bind", fail)
    with structlog.testing.capture_logs() as log:
        await channel.open()
    (told,) = log
    assert (told["event"], told["reason"]) == ("control.no_socket", os.strerror(why))
    monkeypatch.undo()
    with pytest.raises(UsageError, match="another daemon runs with this state directory"):
        await second.open()
    await channel.close()
    await channel.close()
    await second.open()
    assert await asked(tmp_path, "clear") == "clear"
    await second.close()


async def test_a_socket_that_may_not_be_made_for_another_reason_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    channel, second = ControlSocket(tmp_path, answer), ControlSocket(tmp_path, answer)
    monkeypatch.setattr(socket.socket, "bind", refuse)
    with pytest.raises(UsageError, match="cannot be made: Permission denied; choose another place with --state DIR"):
        await channel.open()
    monkeypatch.undo()
    await second.open()  # the lock is free again
    await second.close()


async def test_a_path_too_long_for_an_address_works_too(tmp_path: Path) -> None:
    deep = tmp_path / ("d" * 60) / ("e" * 60)
    deep.mkdir(parents=True)
    channel = ControlSocket(deep, answer)
    await channel.open()
    assert await asked(deep, "clear") == "clear"
    await channel.close()


async def test_a_client_that_talks_without_end_or_not_at_all_disturbs_nobody(tmp_path: Path) -> None:
    channel = ControlSocket(tmp_path, answer)
    await channel.open()
    _, silent = await asyncio.open_unix_connection(str(tmp_path / SOCKET))
    reader, endless = await asyncio.open_unix_connection(str(tmp_path / SOCKET))
    endless.write(b"x" * (4 * LONGEST_LINE))
    assert await reader.readline() == b"error the line is too long\n"
    assert await asked(tmp_path, "disarm") == "disarm"
    for writer in (silent, endless):
        writer.close()
        await writer.wait_closed()
    await asyncio.sleep(0.01)
    await channel.close()


@pytest.mark.parametrize("word", ["arm", "disarm", "clear", "status"])
def test_without_a_daemon_every_word_says_what_to_do(word: str, tmp_path: Path) -> None:
    done = acu_daemon(word, "--state", tmp_path / "nowhere")
    assert done.code == 1
    assert "no daemon runs with this state directory" in done.err
    assert "--rehearsal" in done.err
    assert not (tmp_path / "nowhere").exists()


def commands_in(text: str) -> list[list[str]]:
    """The commands that are advised, each on a line of its own."""
    lines = [line.removeprefix("acu-daemon: ") for line in text.splitlines()]
    return [shlex.split(line) for line in lines if line.startswith("  acu-daemon ")]


async def test_of_several_daemons_each_is_listed_with_a_command_that_reaches_it(tmp_path: Path) -> None:
    state, urls = tmp_path / "state", {"one": "tcp://127.0.0.1:3842", "two": "serial:///dev/ttyS0"}
    state.mkdir()
    folders = {name: antenna_directory(state, StateOwner.of(name, url, "1")) for name, url in urls.items()}
    station = f'[station]\nname = "two"\n{STATION.split("[station]")[1]}'.replace(urls["one"], urls["two"])
    config = write(tmp_path / "config", station)
    one = ControlSocket(folders["one"], lambda _line, _who: "ok one")
    two = ControlSocket(folders["two"], lambda _line, _who: "ok two; look, then `acu-daemon clear`")
    for word in ("arm", "disarm", "clear"):
        await one.open()
        alone = await asyncio.to_thread(acu_daemon, word, "--state", state)
        assert (alone.code, alone.out) == (0, "one\n")
        assert (
            f"no daemon of {config} runs"
            in (await asyncio.to_thread(acu_daemon, word, "--state", state, "--config", config)).err
        )
        await two.open()
        which = await asyncio.to_thread(acu_daemon, word, "--state", state)
        assert which.code == 1
        commands = commands_in(which.err)
        answers = [(await asyncio.to_thread(acu_daemon, *command[1:])).out[:3] for command in commands]
        assert answers == ["one", "two"]
        chosen = await asyncio.to_thread(acu_daemon, word, "--state", state, "--config", config)
        assert chosen.out == f"two; look, then `acu-daemon clear --config {config} --state {state}`\n"
        await one.close()
        await two.close()


async def test_where_only_a_rehearsal_runs_the_command_for_it_is_told_and_works(tmp_path: Path) -> None:
    folder = tmp_path / "state-rehearsal" / "a@b"
    folder.mkdir(parents=True)
    channel = ControlSocket(folder, answer)
    await channel.open()
    done = await asyncio.to_thread(acu_daemon, "clear", "--state", tmp_path / "state")
    assert done.code == 1
    (command,) = commands_in(done.err)
    assert command[-1] == "--rehearsal"
    assert (await asyncio.to_thread(acu_daemon, *command[1:])).out == "clear\n"
    await channel.close()


def test_no_permission_says_whose_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    with pytest.raises(AcuDaemonError, match="not permitted; be root"):
        ask(tmp_path, "arm")
