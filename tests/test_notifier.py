"""What systemd is told: over its own kind of socket, as long as the daemon lives, whatever became of one line."""

import contextlib
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from acu_daemon.edge.systemd import Notifier


@contextlib.contextmanager
def listening(address: str) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as heard:
        heard.bind(address)
        heard.setblocking(False)
        yield heard


def lines_of(heard: socket.socket) -> list[str]:
    found = []
    with contextlib.suppress(BlockingIOError):
        while True:
            found.append(heard.recv(65536).decode())
    return found


@pytest.fixture
def notifier(tmp_path: Path) -> Iterator[Notifier]:
    made = Notifier({"NOTIFY_SOCKET": str(tmp_path / "notify")})
    yield made
    made.close()


def test_each_word_arrives_as_it_is(notifier: Notifier, tmp_path: Path) -> None:
    with listening(str(tmp_path / "notify")) as heard:
        notifier("READY=1\nSTATUS=über Cuiabá")
        notifier("WATCHDOG=1")
        assert lines_of(heard) == ["READY=1\nSTATUS=über Cuiabá", "WATCHDOG=1"]


def test_an_abstract_name_is_one() -> None:
    name = f"acu-daemon-test-{id(object())}"
    made = Notifier({"NOTIFY_SOCKET": f"@{name}"})
    with listening(f"\0{name}") as heard:
        made("READY=1")
        assert lines_of(heard) == ["READY=1"]
    made.close()


def test_after_lines_that_a_full_queue_refused_the_next_ones_arrive(notifier: Notifier, tmp_path: Path) -> None:
    with listening(str(tmp_path / "notify")) as heard:
        for count in range(2000):
            notifier(f"STATUS={count} {'x' * 1000}")
        taken = lines_of(heard)
        assert 0 < len(taken) < 2000
        notifier("WATCHDOG=1")
        assert lines_of(heard) == ["WATCHDOG=1"]


def test_a_systemd_that_comes_later_is_told_from_then_on(notifier: Notifier, tmp_path: Path) -> None:
    notifier("READY=1")
    with listening(str(tmp_path / "notify")) as heard:
        notifier("WATCHDOG=1")
        assert lines_of(heard) == ["WATCHDOG=1"]


def test_without_a_socket_nobody_is_told() -> None:
    made = Notifier({})
    made("READY=1")
    made.close()
    assert made._socket is None
