"""Which daemon of ours holds the ACU: of the own state directories, of services, of antennas beneath them."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from test_live_line import SEEN

from acu_daemon.cli import own_daemon
from acu_daemon.cli.own_daemon import find_daemon
from acu_daemon.edge.control_socket import SOCKET
from acu_daemon.errors import AcuDaemonError, NoDaemonError

ACU = "serial:///dev/ttyS0?baud=9600"


class House:
    """State directories of a user and of services, and what the daemons in them answer."""

    def __init__(self, base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.own, self.services = base / "own", base / "services"
        self.answers: dict[Path, str | Exception] = {}
        self.asked: list[Path] = []
        monkeypatch.setattr(own_daemon, "SERVICES", self.services)
        monkeypatch.setattr(own_daemon, "state_path", lambda given, is_rehearsal: given or self._own(is_rehearsal))
        monkeypatch.setattr(own_daemon, "ask", self._ask)

    def _own(self, is_rehearsal: bool) -> Path:
        return self.own / "rehearsal" if is_rehearsal else self.own

    def _ask(self, directory: Path, line: str) -> str:
        assert line == "status"
        self.asked.append(directory)
        answer = self.answers.get(directory, NoDaemonError(f"nobody listens at {directory}"))
        if isinstance(answer, Exception):
            raise answer
        return answer

    def daemon(self, directory: Path, acu: str) -> Path:
        directory.mkdir(parents=True, exist_ok=True)
        (directory / SOCKET).touch()
        self.answers[directory] = json.dumps(asdict(replace(SEEN, acu=acu)))
        return directory


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> House:
    return House(tmp_path, monkeypatch)


@pytest.mark.parametrize("where", ["own", "own/rehearsal", "own/dish", "services", "services/scd", "services/scd/dish"])
def test_the_daemon_that_holds_the_acu_is_found_wherever_it_keeps_its_state(house: House, where: str) -> None:
    other = house.daemon(house.services / "other", "tcp://elsewhere")
    mine = house.daemon(house.own.parent / where, ACU)
    found = find_daemon(ACU, None)
    assert found is not None
    assert (found.directory, found.seen and found.seen.acu) == (mine, ACU)
    assert find_daemon("tcp://elsewhere", None).directory == other  # type: ignore[union-attr]
    assert find_daemon("tcp://nowhere", None) is None


def test_with_a_state_directory_of_its_own_no_service_is_asked(house: House, tmp_path: Path) -> None:
    house.daemon(house.services / "scd", ACU)
    assert find_daemon(ACU, tmp_path / "given") is None
    assert set(house.asked) == {tmp_path / "given"}


def test_one_that_is_there_and_does_not_say_counts_where_no_other_does(house: House) -> None:
    silent = house.daemon(house.own, ACU)
    house.answers[silent] = AcuDaemonError(f"the daemon of {silent} does not answer")
    found = find_daemon(ACU, None)
    assert found is not None
    assert (found.directory, found.seen) == (silent, None)
    mine = house.daemon(house.services / "scd", ACU)
    assert find_daemon(ACU, None).directory == mine  # type: ignore[union-attr]
