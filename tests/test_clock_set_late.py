"""A clock that is set after the start is obeyed before the pass, not in it; one that cannot be right is waited for."""

from collections.abc import Callable
from math import inf
from pathlib import Path

import pytest
import structlog
from flights import DEMO_TAI_S
from waiting import Story, tell

import acu_daemon.cli as cli
from acu_daemon.acu.commands import Stop
from acu_daemon.cli.clock_wait import wait_for_clock
from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.daemon.service import Service
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.clock_sense import before_elements, before_release
from acu_daemon.errors import UsageError
from acu_daemon.orbit.timescales import tai_from_utc

DEMO = Path(cli.__file__).parent / "demo_config"
RISE_TAI_S = coming_pass(load_target(DEMO, "demo-1", DEMO_TAI_S), DEMO_TAI_S).rise_tai_s


@pytest.mark.long
@pytest.mark.parametrize("slow_s", [600.0, -400.0, 0.7], ids=["600 s slow", "400 s fast", "0.7 s slow"])
def test_p7_a_clock_that_is_set_8_s_after_the_start_is_obeyed_at_once_and_the_coming_pass_is_made(
    slow_s: float, tmp_path: Path
) -> None:
    """The step was held for one that nobody may obey, and the rise awaited ten minutes late."""
    actions = [(8.0, lambda story: story.step(slow_s))]
    told = tell(Story(DEMO, RISE_TAI_S - 60.0, 120.0, slow_s=slow_s, actions=actions), tmp_path / "state")
    assert [event["reason"] for event in told.named("run.anew")] == ["clock"]
    assert told.jobs[-1].job.coming.rise_tai_s == pytest.approx(RISE_TAI_S, abs=0.1)
    assert (told.snapshots[-1].state, told.snapshots[-1].clock_alarm) == ("AUTOTRACK/FITTED", "")
    assert told.outcome is not None
    assert (told.outcome.has_acquired, told.outcome.is_stopped) == (True, True)
    assert told.commands.count(Stop()) == 1  # at the end, and not between the two runs


@pytest.mark.long
def test_p7_a_step_while_the_pass_is_tracked_is_not_obeyed(tmp_path: Path) -> None:
    actions = [(40.0, lambda story: story.step(600.0))]
    told = tell(Story(DEMO, RISE_TAI_S - 5.0, 60.0, actions=actions), tmp_path / "state")
    assert told.named("run.anew") == []
    assert told.snapshots[-1].state == "AUTOTRACK/FITTED"
    assert "not obeyed while a pass is tracked" in told.snapshots[-1].clock_alarm


def test_what_people_told_the_daemon_before_the_clock_was_set_holds_after_it(tmp_path: Path) -> None:
    def disarm(story: Story) -> None:
        assert story.runs is not None
        assert story.runs.answer("disarm").startswith("ok ")

    actions = [(5.0, disarm), (8.0, lambda story: story.step(60.0))]
    told = tell(Story(DEMO, RISE_TAI_S - 400.0, 20.0, slow_s=60.0, actions=actions), tmp_path / "state")
    assert len(told.jobs) == 2
    assert (told.snapshots[-1].arming, told.snapshots[-1].disarmed_by) == ("disarmed", "a person")


def between_runs(monkeypatch: pytest.MonkeyPatch, do: Callable[[], None]) -> None:
    """Have something done after the last tick of each run, before the next one is there."""
    end = Service._end

    async def after_the_last_tick(service: Service) -> bool:
        do()
        return await end(service)

    monkeypatch.setattr(Service, "_end", after_the_last_tick)


def test_what_people_say_between_two_runs_is_for_the_next_and_after_the_last_it_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers: list[str] = []
    told = Story(DEMO, RISE_TAI_S - 400.0, 20.0, slow_s=60.0, actions=[(8.0, lambda story: story.step(60.0))])
    between_runs(monkeypatch, lambda: answers.append(told.runs.answer("disarm") if told.runs else ""))
    tell(told, tmp_path / "state")
    assert len(told.jobs) == 2
    assert [answer.split(" ")[0] for answer in answers] == ["ok", "error"]
    assert (told.snapshots[-1].arming, told.snapshots[-1].disarmed_by) == ("disarmed", "a person")


@pytest.mark.long
def test_a_stop_that_comes_while_a_run_begins_anew_ends_it(tmp_path: Path) -> None:
    def stop(story: Story) -> None:
        assert story.runs is not None
        story.runs.stop("SIGTERM")

    for at_s in (8.9, 9.0, 9.05, 9.2):
        actions = [(8.0, lambda story: story.step(60.0)), (at_s, stop)]
        told = tell(Story(DEMO, RISE_TAI_S - 400.0, 60.0, slow_s=60.0, actions=actions), tmp_path / "state")
        assert told.outcome is not None
        assert (told.outcome.reason, told.outcome.is_stopped) == ("SIGTERM", True)
        assert told.snapshots[-1].tai_s < RISE_TAI_S - 380.0


def test_where_nothing_can_be_tracked_by_the_clock_that_was_set_the_antenna_is_stopped_and_the_reason_told(
    tmp_path: Path,
) -> None:
    actions = [(8.0, lambda story: story.step(60.0))]
    story = Story(DEMO, RISE_TAI_S - 400.0, 20.0, slow_s=60.0, actions=actions, is_refused_anew=True)
    with pytest.raises(UsageError, match="no pass"):
        tell(story, tmp_path / "state")
    assert story.commands.count(Stop()) == 1
    assert len(story.named("stop.done")) == 1


class Booted(SystemClock):
    """A machine without a battery for its clock; `utc` is what it says, look after look."""

    def __init__(self, *utc: str) -> None:
        self.is_rehearsal, self._utc = False, list(utc)

    def tai_s(self) -> float:
        return tai_from_utc(self._utc[0])

    def obey(self) -> None:
        if len(self._utc) > 1:
            self._utc.pop(0)


@pytest.fixture
def slept(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    seen: list[float] = []
    monkeypatch.setattr("acu_daemon.cli.clock_wait.time.sleep", seen.append)
    return seen


def test_a_boot_in_1970_is_told_and_waited_for(slept: list[float]) -> None:
    """It ended with "fetch newer elements", status 2, after which the service is not started again."""
    clock = Booted("1970-01-01T00:01:00Z", "1970-01-01T00:01:01Z", "1970-01-01T00:01:02Z", "2027-01-01T12:00:00Z")
    with structlog.testing.capture_logs() as logs:
        assert wait_for_clock(DEMO, "demo-1", clock, inf)
    assert len(slept) == 3
    assert [log["event"] for log in logs] == ["clock.wrong", "clock.set"]
    assert "1970-01-01T00:01:00Z, before this program was made" in logs[0]["reason"]


def test_a_clock_that_says_a_time_before_all_elements_is_waited_for_where_nothing_synchronises_it(
    slept: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("acu_daemon.cli.clock_wait.is_clock_synchronised", lambda: len(slept) > 1)
    monkeypatch.setattr("acu_daemon.cli.clock_wait.before_release", lambda _now_tai_s: "")
    with structlog.testing.capture_logs() as logs:
        assert wait_for_clock(DEMO, "demo-1", Booted("2026-06-01T00:00:00Z"), inf)
    assert len(slept) == 2
    assert "all elements of DEMO-1" in logs[0]["reason"]


def test_a_duration_ends_the_wait_too(slept: list[float]) -> None:
    assert not wait_for_clock(DEMO, "demo-1", Booted("1970-01-01T00:01:00Z"), -inf)
    assert slept == []


def test_a_rehearsal_has_a_clock_of_its_own(slept: list[float]) -> None:
    assert wait_for_clock(DEMO, "demo-1", SystemClock(tai_from_utc("1989-02-01T00:00:00Z")), inf)
    assert slept == []


@pytest.mark.parametrize(
    ("is_synchronised", "before_epoch_days", "is_wrong"),
    [(False, 100.0, True), (None, 100.0, False), (True, 100.0, False), (False, 0.5, False), (False, -3.0, False)],
)
def test_an_unsynchronised_clock_that_all_elements_are_ahead_of_cannot_be_right(
    is_synchronised: bool | None, before_epoch_days: float, is_wrong: bool
) -> None:
    elements = load_target(DEMO, "demo-1", DEMO_TAI_S).elements
    said = before_elements(elements, elements.epoch_tai_s - before_epoch_days * 86400.0, is_synchronised)
    assert bool(said) == is_wrong


def test_the_day_of_the_release_has_come() -> None:
    assert before_release(tai_from_utc("2026-10-31T23:59:59Z"))
    assert before_release(SystemClock().tai_s()) == ""
