"""`acu-daemon elements`, and the daemon that fetches by itself: what people see, and that a tick waits for nothing."""

import asyncio
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command_line import acu_daemon
from config_files import STATION, replaced, write
from evolved_sets import PLAIN, later
from misbehaving_server import good, response, serving
from structlog.testing import capture_logs

from acu_daemon.cli import elements_commands
from acu_daemon.config.load import load_station
from acu_daemon.edge import elements_fetching
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.elements_fetcher import fetch_due
from acu_daemon.edge.elements_fetching import ElementsFetching
from acu_daemon.edge.elements_store import read_sets, record_of, sets_file
from acu_daemon.edge.fetch_policy import Came, FetchOutcome, FetchState
from acu_daemon.edge.fetch_state_file import group_file, read_fetch_state, write_fetch_state
from acu_daemon.orbit.element_set import ElementSet

URL = "https://example.org/group.json"
ISS = '[satellite]\nname = "ISS"\nnorad_id = 25544\n[elements]\nkind = "station"\n'


OF_THE_DAY = replace(PLAIN, epoch_tai_s=SystemClock().tai_s() - 5 * 86400.0)


def fresh(days: float = 0.2) -> ElementSet:
    """Elements of the present, so many days old."""
    return later(5.0 - days, OF_THE_DAY)


def body(*sets: ElementSet) -> bytes:
    return json.dumps([record_of(one, "x") for one in sets]).encode()


def config(directory: Path, url: str = URL, more: str = "") -> Path:
    return write(directory, STATION + f'[elements]\nsource = "{url}"\n{more}', iss=ISS)


class Answers:
    """In place of a server: these, one after another."""

    def __init__(self, *answers: tuple[FetchOutcome, bytes]) -> None:
        self.answers, self.count = list(answers), 0

    def __call__(self, *_: object) -> "Answers":
        return self

    async def ask(self, state: FetchState) -> tuple[FetchOutcome, bytes]:
        self.count += 1
        return self.answers.pop(0)


def answering(monkeypatch: pytest.MonkeyPatch, *answers: tuple[FetchOutcome, bytes]) -> Answers:
    made = Answers(*answers)
    monkeypatch.setattr(elements_commands, "_asker", lambda *_: made.ask)
    return made


GOOD = FetchOutcome(Came.GOOD)
GONE = FetchOutcome(Came.REFUSED, "HTTP 404 Not Found: 'No such group'")


def test_what_was_fetched_is_used_and_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config(tmp_path)
    before = acu_daemon("elements", "show", "--config", tmp_path)
    assert before.code == 1
    assert "never fetched yet; asked next as soon as anybody fetches" in before.out
    assert "NO-GO  iss: " in before.out
    asked = answering(monkeypatch, (GOOD, body(fresh())))
    fetched = acu_daemon("elements", "fetch", "--config", tmp_path)
    assert fetched.code == 0
    assert fetched.out.startswith(f"GO     fetched: url {URL}, epochs {{'ISS': ")
    again = acu_daemon("elements", "fetch", "--config", tmp_path)
    assert "nothing is due, or nothing is new:" in again.out
    assert asked.count == 1
    shown = acu_daemon("elements", "show", "--config", tmp_path)
    assert shown.code == 0
    assert f"GO     {URL}: last good answer 0.0 h ago; asked next at " in shown.out
    assert "GO     iss: ISS (25544), omm of " in shown.out
    assert acu_daemon("passes", "--config", tmp_path).code == 0


def test_a_source_that_stopped_is_told_everywhere_until_it_is_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config(tmp_path)
    asked = answering(monkeypatch, (GOOD, body(fresh(2.0))), (GONE, b""), (GOOD, body(fresh())))
    acu_daemon("elements", "fetch", "--config", tmp_path)
    state = read_fetch_state(tmp_path / "elements", URL)
    write_fetch_state(tmp_path / "elements", replace(state, next_tai_s=state.asked_tai_s, asked_tai_s=0.0))
    stopped = acu_daemon("elements", "fetch", "--config", tmp_path)
    assert stopped.code == 1
    assert "WARN   fetch_stopped: " in stopped.out
    for command in ("show", "fetch"):
        assert (
            "STOPPED: HTTP 404 Not Found: 'No such group'; nobody asks"
            in acu_daemon("elements", command, "--config", tmp_path).out
        )
    checked = acu_daemon("check", "--config", tmp_path).out
    assert "WARN   elements source        https://example.org/group.json: STOPPED: HTTP 404" in checked
    assert asked.count == 2
    write_fetch_state(tmp_path / "elements", replace(read_fetch_state(tmp_path / "elements", URL), asked_tai_s=0.0))
    resumed = acu_daemon("elements", "resume", "--config", tmp_path)
    assert resumed.out.startswith(f"{URL}: may be asked now; it was: HTTP 404 Not Found")
    assert acu_daemon("elements", "fetch", "--config", tmp_path).code == 0
    assert len(read_sets(sets_file(tmp_path / "elements", 25544), 25544)) == 2


def test_a_month_offline_is_a_warning_and_the_last_good_file_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config(tmp_path)
    answering(monkeypatch, (GOOD, body(fresh(0.1))))
    acu_daemon("elements", "fetch", "--config", tmp_path)
    store, month_s = tmp_path / "elements", 29 * 86400.0
    state = read_fetch_state(store, URL)
    late = state.good_tai_s + month_s
    kept = group_file(store, URL).read_bytes()

    async def offline(_: FetchState) -> tuple[FetchOutcome, bytes]:
        return FetchOutcome(Came.FAILED, "example.org: no such host, or no network"), b""

    wanted = elements_commands.wanted_satellites(tmp_path)
    told = asyncio.run(fetch_due(store, [URL], wanted, 8 * 3600.0, lambda: late, offline))
    assert [one.event for one in told] == ["elements.fetch_failed"]
    assert group_file(store, URL).read_bytes() == kept
    monkeypatch.setattr(SystemClock, "tai_s", lambda _: late)
    shown = acu_daemon("elements", "show", "--config", tmp_path)
    assert shown.code == 0
    assert "last good answer 29.0 days ago" in shown.out
    assert "WARN   iss: ISS (25544), omm of " in shown.out
    assert "fetch newer elements" in shown.out


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (URL, "ftp://example.org/x", "expected https://HOST/..., http://HOST/... or a directory"),
        (URL, "https://me:secret@example.org/x", "a name and a password do not belong into a URL"),
        (f'source = "{URL}"', "source = 4", "elements.source"),
        (f'source = "{URL}"', f'source = "{URL}"\nevery_h = 0.5', "elements.every_h = 0.5: expected at least 2"),
        (f'source = "{URL}"', f'source = "{URL}"\nlogin = "login.toml"', "login.toml: no such file"),
        (f'source = "{URL}"', f'source = "{URL}"\nca_file = "none.pem"', "none.pem: certificates in PEM were expected"),
        (f'source = "{URL}"', 'source = "given"', "[elements] source names no URL: there is nothing to fetch"),
    ],
)
def test_what_is_wrong_with_the_sources_is_told(tmp_path: Path, old: str, new: str, said: str) -> None:
    config(tmp_path)
    station = tmp_path / "station.toml"
    station.write_text(replaced(station.read_text(), old, new))
    done = acu_daemon("elements", "fetch", "--config", tmp_path)
    assert done.code == 2
    assert said in done.err


def test_a_password_that_others_may_read_is_refused(tmp_path: Path) -> None:
    config(tmp_path, more='login = "login.toml"\n')
    login = tmp_path / "login.toml"
    login.write_text('identity = "me"\npassword = "secret"\n')
    login.chmod(0o644)
    done = acu_daemon("elements", "fetch", "--config", tmp_path)
    assert (done.code, "chmod 600" in done.err) == (2, True)


def test_a_store_that_cannot_be_written_asks_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config(tmp_path)
    asked = answering(monkeypatch, (GOOD, body(fresh())))
    (tmp_path / "elements").write_text("a file where the store should be")
    done = acu_daemon("elements", "fetch", "--config", tmp_path)
    assert done.code == 1
    assert "nobody is asked where the answer cannot be kept" in done.err
    assert asked.count == 0


class Child:
    """In place of the process that fetches."""

    def __init__(self, said: bytes, code: int = 0, complaint: bytes = b"") -> None:
        self.said, self.returncode, self.complaint = said, code, complaint
        self.words: tuple[str, ...] = ()

    async def start(self, *words: str, **_: Any) -> "Child":
        self.words = words
        return self

    async def communicate(self, _: bytes | None = None) -> tuple[bytes, bytes]:
        return self.said, self.complaint


class Hours(SystemClock):
    """A clock that somebody moves."""

    passed_s = 0.0

    def monotonic_s(self) -> float:
        return super().monotonic_s() + self.passed_s

    def tai_s(self) -> float:
        return super().tai_s() + self.passed_s


async def test_the_daemon_has_them_fetched_by_a_process_when_they_are_due_and_logs_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config(tmp_path)
    line = json.dumps({"event": "elements.fetch_stopped", "is_warning": True, "url": URL, "reason": "HTTP 404"})
    child = Child(f"{line}\nnot JSON\n".encode())
    monkeypatch.setattr(elements_fetching, "start_python", child.start)
    clock = Hours()
    fetching = ElementsFetching(tmp_path, load_station(tmp_path).elements, clock, is_rehearsal=False)
    with capture_logs() as logs:
        fetching.look()
        await asyncio.sleep(0)
        fetching.look()
        assert fetching.start_count == 1
        await asyncio.gather(*(one for one in asyncio.all_tasks() if one.get_name() == "elements-fetch"))
    assert child.words == ("acu_daemon", "elements", "fetch", "--events", "--config", str(tmp_path))
    [told] = logs
    assert (told["event"], told["log_level"], told["reason"]) == ("elements.fetch_stopped", "warning", "HTTP 404")
    state = FetchState(URL, stopped="HTTP 404", problem="HTTP 404")
    write_fetch_state(tmp_path, state)
    (tmp_path / "elements").mkdir()
    write_fetch_state(tmp_path / "elements", state)
    clock.passed_s = 3600.0
    fetching.look()
    assert fetching.start_count == 1
    assert "STOPPED: HTTP 404" in fetching.problem
    await fetching.close()


@pytest.mark.parametrize("why", ["rehearsal", "command", "no URL"])
async def test_the_daemon_asks_nobody_in_a_rehearsal_or_where_others_fetch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, why: str
) -> None:
    url, more = ("given", "") if why == "no URL" else (URL, 'fetch = "command"\n' if why == "command" else "")
    config(tmp_path, url, more)
    child = Child(b"")
    monkeypatch.setattr(elements_fetching, "start_python", child.start)
    section = load_station(tmp_path).elements
    fetching = ElementsFetching(tmp_path, section, SystemClock(), is_rehearsal=why == "rehearsal")
    fetching.look()
    await fetching.close()
    assert (fetching.start_count, child.words) == (0, ())


async def test_a_process_that_fails_or_cannot_start_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config(tmp_path)
    section = load_station(tmp_path).elements

    async def denied(*_: str, **__: Any) -> Child:
        raise OSError(11, os.strerror(11))

    failing = Child(b"", 1, b"Traceback\nacu-daemon: the store is full\n")
    clock = Hours()
    for start, said in ((denied, "no process for it"), (failing.start, "acu-daemon: the store is full")):
        monkeypatch.setattr(elements_fetching, "start_python", start)
        fetching = ElementsFetching(tmp_path, section, clock, is_rehearsal=False)
        with capture_logs() as logs:
            fetching.look()
            await asyncio.gather(*(one for one in asyncio.all_tasks() if one.get_name() == "elements-fetch"))
            clock.passed_s += 800.0
            await asyncio.sleep(0)
            fetching.look()
        assert fetching.start_count == 1
        [told] = logs
        assert said in told["reason"]


@pytest.mark.realtime
async def test_a_daemons_process_fetches_from_a_server_and_keeps_what_came(tmp_path: Path) -> None:
    async with serving(good(body(fresh()))) as server:
        config(tmp_path, server.url)
        section = load_station(tmp_path).elements
        fetching = ElementsFetching(tmp_path, section, SystemClock(), is_rehearsal=False)
        with capture_logs() as logs:
            fetching.look()
            await asyncio.gather(*(one for one in asyncio.all_tasks() if one.get_name() == "elements-fetch"))
        assert [one["event"] for one in logs] == ["elements.fetched"]
        assert len(read_sets(sets_file(tmp_path / "elements", 25544), 25544)) == 1
        server.answer = response("404 Not Found")
        fetching.look()
        assert fetching.start_count == 1
        assert fetching.problem == ""
        await fetching.close()
