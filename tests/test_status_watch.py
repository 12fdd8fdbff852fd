"""The status that is redrawn in place: how long nobody has answered, and what is old is grey and says so."""

import io
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from rich.console import Console
from test_live_line import SEEN

from acu_daemon.cli import status_watch
from acu_daemon.cli.status_watch import EVERY_S, picture, watch_status
from acu_daemon.daemon.overview import OLD_S
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.errors import AcuDaemonError, UsageError


def drawn(seen: Snapshot, silent_s: float) -> str:
    console = Console(file=io.StringIO(), width=120, record=True)
    console.print(picture(seen, silent_s))
    return console.export_text()


def test_beyond_a_second_without_an_answer_it_says_so_first() -> None:
    assert "NO ANSWER" not in drawn(SEEN, OLD_S)
    old = drawn(SEEN, OLD_S + 61.0).splitlines()
    assert old[0].startswith("NO ANSWER from the daemon for 1:0")
    assert old[1:] == drawn(SEEN, 0.0).splitlines()


def test_alarms_stand_between_the_verdict_and_the_rows() -> None:
    lines = drawn(replace(SEEN, latch="azimuth stands still"), 0.0).splitlines()
    assert any(line.startswith("ALARM  latched: azimuth stands still") for line in lines[1:3])


class Screen:
    """A terminal of which is remembered for how long nobody had answered at each drawing; sleeping moves the clock."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, answers: list[bool]) -> None:
        self.now_s, self.silent_s, self.answers = 1000.0, list[float](), answers
        monkeypatch.setattr(status_watch, "Live", lambda *_, **__: self)
        monkeypatch.setattr(status_watch, "picture", self._picture)
        monkeypatch.setattr("acu_daemon.cli.status_watch.time.monotonic", lambda: self.now_s)
        monkeypatch.setattr("acu_daemon.cli.status_watch.time.sleep", self._sleep)
        monkeypatch.setattr("sys.stdout.isatty", lambda: True)

    def __enter__(self) -> "Screen":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def update(self, _drawn: object, *, refresh: bool) -> None:
        assert refresh

    def _picture(self, _seen: Snapshot, silent_s: float) -> None:
        self.silent_s.append(silent_s)

    def _sleep(self, seconds: float) -> None:
        self.now_s += seconds
        if not self.answers:
            raise KeyboardInterrupt

    def ask(self) -> Snapshot:
        if not self.answers.pop(0):
            raise AcuDaemonError("nobody listens")
        return SEEN


def test_the_age_counts_from_the_last_answer_until_ctrl_c_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen(monkeypatch, [True, True, False, False, False, True])
    watch_status(screen.ask)
    assert screen.silent_s == [0.0, 0.0, EVERY_S, 2.0 * EVERY_S, 3.0 * EVERY_S, 0.0]


def test_who_is_not_there_at_the_start_is_told_and_no_terminal_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen(monkeypatch, [False])
    with pytest.raises(AcuDaemonError, match="nobody listens"):
        watch_status(screen.ask)
    monkeypatch.setattr("sys.stdout.isatty", lambda: False)
    with pytest.raises(UsageError, match="--json"):
        watch_status(screen.ask)


def ages(seen: Snapshot) -> Callable[[str], Any]:
    return lambda name: status_watch._is_stale(name, seen)


@pytest.mark.parametrize(
    ("changes", "is_stale"),
    [
        ({}, False),
        ({"reading_age_s": OLD_S}, False),
        ({"reading_age_s": OLD_S + 0.01}, True),
        ({"reading_age_s": None}, True),
        ({"is_link_up": False}, True),
    ],
)
def test_rows_of_an_antenna_that_is_not_measured_are_grey(changes: dict[str, Any], is_stale: bool) -> None:
    of = ages(replace(SEEN, **changes))
    assert [of(name) for name in ("antenna", "path", "signal")] == [is_stale] * 3
    assert not of("satellite")
