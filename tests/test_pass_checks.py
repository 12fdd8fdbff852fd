"""The checks before a pass: when they are made, what a no-go puts off, and that it is of its own pass alone."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from acu_daemon.cli.pass_checks import AGAIN_S, PassChecks
from acu_daemon.schedule.book import Entry, PassState

RISE, SET = 10_000.0, 10_600.0
STEP_S = 0.01


def entry(number: int, rise_tai_s: float = RISE) -> Entry:
    set_tai_s = rise_tai_s + SET - RISE
    return Entry("A", rise_tai_s, rise_tai_s + 300.0, set_tai_s, 40.0, 5, PassState.PLANNED, "", number=number)


class Desk:
    """Checks whose answer is at hand; remembers when they were asked and what was told."""

    def __init__(self) -> None:
        self.answer: Callable[[], list[str]] = list
        self.asked_tai_s: list[float] = []
        self.told: list[tuple[int, str]] = []
        self.checks = PassChecks(self._check, self._beside, lambda one, why: self.told.append((one.number, why)))

    def _check(self, _satellite: str, tai_s: float) -> list[str]:
        self.asked_tai_s.append(tai_s)
        return self.answer()

    @staticmethod
    async def _beside(work: Callable[..., Any], *given: Any) -> Any:
        return work(*given)

    async def look(self, one: Entry, now_tai_s: float) -> bool:
        """Look, and once more when it is done; whether a check was made."""
        before_count = len(self.asked_tai_s)
        self.checks.look(one, now_tai_s)
        await asyncio.sleep(0.0)
        await asyncio.sleep(0.0)
        if len(self.asked_tai_s) > before_count:
            assert not self.checks.may_begin(now_tai_s)  # not before what it found is taken
            self.checks.look(one, now_tai_s)
        return len(self.asked_tai_s) > before_count


async def test_a_pass_is_checked_once_five_minutes_and_once_one_minute_before_its_rise() -> None:
    desk, one = Desk(), entry(1)
    assert desk.checks.said_of(one) is None
    checked_s = [
        before_s
        for before_s in (4000.0, 300.0 + STEP_S, 300.0, 299.0, 60.0 + STEP_S, 60.0, 59.0, 0.0, -300.0)
        if await desk.look(one, RISE - before_s)
    ]
    assert checked_s == [300.0, 60.0]
    assert (desk.checks.said_of(one), desk.told) == ("", [])


@pytest.mark.parametrize("before_s", [60.0, 30.0, -100.0])
async def test_one_that_is_found_late_is_checked_once(before_s: float) -> None:
    desk = Desk()
    assert await desk.look(entry(1), RISE - before_s)
    assert not await desk.look(entry(1), RISE - before_s + 1.0)


async def test_a_no_go_is_told_and_tried_again_after_15_s_until_there_is_none() -> None:
    desk, one = Desk(), entry(1)
    desk.answer = lambda: ["the door is open", "no wind"]
    assert await desk.look(one, RISE - 60.0)
    assert desk.told == [(1, "the door is open; no wind")]
    assert desk.checks.said_of(one) == "the door is open; no wind"
    assert not desk.checks.refuse(one, RISE - 60.0)
    for since_s, may_begin in [(AGAIN_S - STEP_S, False), (AGAIN_S, True)]:
        assert desk.checks.may_begin(RISE - 60.0 + since_s) == may_begin
        desk.answer = list
        assert await desk.look(one, RISE - 60.0 + since_s) == may_begin
    assert (desk.checks.said_of(one), len(desk.told)) == ("", 1)
    assert not await desk.look(one, RISE + 200.0)


async def test_what_clears_after_the_rise_lets_the_rest_of_the_pass_begin() -> None:
    desk, one = Desk(), entry(1)
    desk.answer = lambda: ["the door is open"]
    checked_tai_s = RISE - 60.0
    assert await desk.look(one, checked_tai_s)
    for _ in range(6):
        desk.checks.refuse(one, checked_tai_s)
        assert not await desk.look(one, checked_tai_s + AGAIN_S - STEP_S)
        checked_tai_s += AGAIN_S
        assert await desk.look(one, checked_tai_s)
    assert checked_tai_s > RISE
    desk.answer = list
    desk.checks.refuse(one, checked_tai_s)
    assert await desk.look(one, checked_tai_s + AGAIN_S)
    assert (desk.checks.no_go, desk.checks.may_begin(checked_tai_s + AGAIN_S)) == ("", True)


async def test_a_no_go_is_of_its_own_pass_alone() -> None:
    desk, one, other = Desk(), entry(1), entry(2, RISE + 4000.0)
    desk.answer = lambda: ["the door is open"]
    assert await desk.look(one, RISE - 60.0)
    assert desk.checks.said_of(other) is None
    desk.checks.refuse(one, RISE - 60.0)
    assert not await desk.look(other, RISE + 1000.0)
    assert desk.checks.no_go == ""
    assert await desk.look(other, RISE + 4000.0 - 300.0)


@pytest.mark.parametrize(("at_s", "is_over"), [(299.0, False), (300.0, False), (301.0, True)])
def test_a_pass_that_is_put_off_has_failed_when_half_of_it_is_gone(at_s: float, is_over: bool) -> None:
    desk = Desk()
    assert desk.checks.refuse(entry(1), RISE + at_s) == is_over
    assert not desk.checks.may_begin(RISE + at_s)
    desk.checks.forget()  # it has begun all the same
    assert desk.checks.may_begin(RISE + at_s)


async def test_a_check_that_fails_itself_and_files_that_are_refused_are_no_goes() -> None:
    desk, one = Desk(), entry(1)

    def fail() -> list[str]:
        raise OSError("no such device")

    desk.answer = fail
    assert await desk.look(one, RISE - 60.0)
    assert desk.checks.no_go == "the check failed: OSError: no such device"
    desk.checks.cannot_begin(one, "station.toml: no such key")
    assert desk.told == [(1, "the check failed: OSError: no such device"), (1, "station.toml: no such key")]
    assert desk.checks.no_go == "station.toml: no such key"


async def test_what_is_under_way_ends_with_the_station() -> None:
    desk = Desk()
    desk.checks.look(entry(1), RISE - 60.0)
    desk.checks.close()
    await asyncio.sleep(0.0)
    await asyncio.sleep(0.0)
    assert desk.asked_tai_s == []
