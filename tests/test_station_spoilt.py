"""What fails beside the loop, or in the file of the schedule, costs no more than itself: the station goes on."""

import asyncio
import sqlite3
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from test_metrics import seen_of
from test_station import HORN, HORN_S, PARK, START, night
from test_station_stow import says

from acu_daemon.acu.commands import AcuMode
from acu_daemon.cli import schedule_keeper
from acu_daemon.cli.pass_course import PassCourse
from acu_daemon.cli.station_move import Horn
from acu_daemon.cli.virtual_station import StationAccess
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.hooks import Hook, Hooks
from acu_daemon.edge.schedule_file import NAME
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.schedule.book import PassState


def spoilt(*_: object) -> Any:
    raise ZeroDivisionError("division by zero")


def test_a_plan_and_a_phantom_pass_that_fail_are_told_and_the_pass_is_tracked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(access: StationAccess) -> None:
        monkeypatch.setattr(schedule_keeper, "station_plan", lambda *_, **__: spoilt())
        access.runs.day.ask_reload()

    monkeypatch.setattr("acu_daemon.cli.phantom_check.fly_phantom", spoilt)
    found = night(tmp_path, minutes=5.6, has_phantom=True, script=[(START + 5.0, fail)])
    why = "ZeroDivisionError: division by zero"
    assert [one["reason"] for one in found.days.named("schedule.kept")] == [why]
    assert {one["reason"] for one in found.days.named("phantom.not_flown")} == {why}
    assert found.of("scd").state is PassState.DONE


@pytest.mark.long
def test_a_check_that_fails_itself_is_a_no_go(tmp_path: Path) -> None:
    found = night(tmp_path, minutes=5.0, check=spoilt)
    reason = "not begun: the check failed: ZeroDivisionError: division by zero"
    assert (found.of("scd").state, found.of("scd").reason) == (PassState.FAILED, reason)


@pytest.mark.long
def test_peoples_words_that_cannot_be_read_any_more_hold_as_they_were_and_it_is_an_alarm(tmp_path: Path) -> None:
    answers: list[str] = []

    def spoil(_access: StationAccess) -> None:
        with closing(sqlite3.connect(tmp_path / "state" / NAME)) as file:
            file.execute("drop table requests")

    script = [
        (START + 1.0, says("skip", answers)),
        (START + 5.0, spoil),
        (START + 20.0, says("status", answers)),
    ]
    found = night(tmp_path, minutes=4.0, script=script)
    assert len(found.days.named("schedule.not_read")) == 1
    assert "no such table: requests" in answers[1]
    assert found.of("scd").reason == "excluded by a person"


def test_an_alarm_whose_figures_change_is_told_to_the_hook_once() -> None:
    told: list[Any] = []
    hooks: Any = SimpleNamespace(call=lambda _hook, about: told.append(about["alarms"]), take_results=list)
    keeper: Any = None
    course = PassCourse(keeper, hooks, lambda _entry: {})
    for text in ("silent for 9 s", "silent for 10 s", "", "silent for 1 s"):
        course.see(seen_of(signal_alarm=text))
    assert told == [["silent for 9 s"], ["silent for 1 s"]]


@pytest.mark.long
def test_a_rest_that_ends_for_another_reason_while_the_horn_is_heard_moves_nothing(tmp_path: Path) -> None:
    heard: list[float] = []

    def listen(access: StationAccess) -> None:
        def called(hook: Hook, _about: object) -> None:
            if hook is Hook.BEFORE_MOVE:
                heard.append(access.runs._setup.clock.tai_s())
                if len(heard) == 2:  # before it parks
                    asyncio.get_running_loop().call_later(1.0, access.runs.answer, "skip", "a person")

        access.runs.day.hooks.call = called  # type: ignore[method-assign]

    answers: list[str] = []
    skip = says(f"skip satellite=behind at={utc_text(START + 340.0)}", answers)
    found = night(tmp_path, PARK + HORN, minutes=6.3, script=[(START, listen), (START + 1.0, skip)])
    moves = [
        now.tai_s
        for before, now in pairwise(found.days.rows)
        if (before.mode, now.mode) == (AcuMode.STANDBY, AcuMode.REMOTE)
    ]
    assert [one["answer"].split(" ")[0] for one in found.days.named("operator.asked")] == ["ok", "ok"]
    assert [begun - at >= HORN_S for at, begun in zip(heard, moves, strict=True)] == [True, True]


class Sounded:
    """A horn's hook, and the clock beside it."""

    def __init__(self) -> None:
        self.now_tai_s = START
        self.count = 0

    def tai_s(self) -> float:
        return self.now_tai_s

    def call(self, *_: object) -> None:
        self.count += 1


def test_a_move_that_was_put_off_after_the_horn_is_warned_of_anew() -> None:
    sounded: Any = Sounded()
    clock: Clock = sounded
    hooks: Hooks = sounded
    horn = Horn(hooks, clock)

    def heard(after_s: float) -> tuple[bool, int]:
        sounded.now_tai_s += after_s
        return horn.is_heard({}, 3.0, is_wanted=True), sounded.count

    assert [heard(0.0), heard(1.0), heard(1.0), heard(1.0)] == [(False, 1), (False, 1), (False, 1), (True, 1)]
    assert [heard(3600.0), heard(1.0)] == [(False, 2), (False, 2)]  # a no-go lasted for an hour
    assert heard(-500.0) == (False, 3)  # the clock was set
    horn.forget()
    assert heard(1.0) == (False, 4)


def test_a_warning_of_a_quarter_of_a_minute_that_is_asked_for_each_second_is_one() -> None:
    sounded: Any = Sounded()
    horn = Horn(sounded, sounded)
    heard = []
    for _ in range(17):
        heard.append(horn.is_heard({}, 15.0, is_wanted=True))
        sounded.now_tai_s += 1.0
    assert heard == [False] * 15 + [True, True]
    assert sounded.count == 1
