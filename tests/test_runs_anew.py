"""One run after another: with the memory of the one before, until one has ended for good or somebody stops."""

from collections.abc import Callable

import pytest

from acu_daemon.daemon.operator_requests import ENDS, STATUS
from acu_daemon.daemon.runs import Runs
from acu_daemon.errors import UsageError


class Run:
    """A run that ends as it is told beforehand."""

    def __init__(self, memory: object, anew_reason: str = "", meanwhile: Callable[[], None] | None = None) -> None:
        self.began_with, self.anew_reason, self.meanwhile = memory, anew_reason, meanwhile
        self.memory = object()
        self.unheard: tuple[str, ...] = ()
        self.is_over, self.is_stopped_after_all = False, False
        self.asked: list[str] = []
        self.stops: list[str] = []

    async def run(self) -> "Run":
        if self.meanwhile is not None:
            self.meanwhile()
        self.is_over = True
        return self

    def stop(self, reason: str) -> None:
        self.stops.append(reason)

    def ask(self, asking: str) -> None:
        self.asked.append(asking)

    def answer(self, line: str, who: str = "") -> str:
        return f"ok {line} of {who}"

    async def stop_after_all(self) -> None:
        self.is_stopped_after_all = True


class Daemon:
    """The runs that are begun one after the other."""

    def __init__(self, *anew_reasons: str) -> None:
        self.left, self.begun = list(anew_reasons), list[Run]()
        self.meanwhile: Callable[[], None] | None = None
        self.runs = Runs(self._begin)  # type: ignore[arg-type]

    def _begin(self, memory: object) -> Run:
        reason = self.left.pop(0)
        if reason == "too old":
            raise UsageError("the elements are too old")
        self.begun.append(Run(memory, reason, lambda: self.meanwhile and self.meanwhile()))
        return self.begun[-1]


async def test_each_run_has_the_memory_of_the_one_before_and_the_last_ones_outcome_counts() -> None:
    daemon = Daemon("the clock was set", "better elements", "")
    assert await daemon.runs.run() is daemon.begun[2]
    first, second, third = daemon.begun
    assert (first.began_with, second.began_with, third.began_with) == (None, first.memory, second.memory)
    assert daemon.runs.service is third


async def test_what_nobody_has_obeyed_is_asked_of_the_next_run() -> None:
    daemon = Daemon("the clock was set", "")
    daemon.begun[0].unheard = ("STOP", "NUDGE")
    await daemon.runs.run()
    assert daemon.begun[1].asked == ["STOP", "NUDGE"]


async def test_a_stop_that_comes_while_a_run_ends_to_begin_anew_ends_it_for_good() -> None:
    daemon = Daemon("the clock was set", "")
    daemon.meanwhile = lambda: daemon.runs.stop("SIGTERM")
    assert await daemon.runs.run() is daemon.begun[0]
    assert (len(daemon.begun), daemon.begun[0].stops) == (1, ["SIGTERM"])
    assert daemon.runs.answer("hold") == ENDS
    assert daemon.runs.answer(STATUS, "Ann").startswith("ok")


async def test_between_two_runs_a_word_is_for_the_next_and_after_the_last_it_is_refused() -> None:
    daemon = Daemon("the clock was set", "")
    daemon.begun[0].is_over = True
    assert daemon.runs.answer("hold", "Ann") == "ok hold of Ann"
    await daemon.runs.run()
    assert daemon.runs.answer("hold") == ENDS


async def test_where_the_next_run_cannot_begin_the_antenna_is_stopped() -> None:
    daemon = Daemon("the clock was set", "too old")
    with pytest.raises(UsageError, match="too old"):
        await daemon.runs.run()
    assert daemon.begun[0].is_stopped_after_all
