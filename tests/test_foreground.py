"""What the foreground does about a tick's orders and their answers, at a port that answers as it is told."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from fake_sky import START_TAI_S
from memories import remembering
from structlog.testing import capture_logs
from test_tick import CONFIG, ready, status

from acu_daemon.acu.commands import AcuMode, Command, Identify, PointAndPoll, Poll, ReadFaults, SelectMode
from acu_daemon.acu.replies import AcuIdentity, Done, Refused
from acu_daemon.control.orders import Event, Orders
from acu_daemon.control.state import ControlState, StartStage
from acu_daemon.control.tick_input import Exchange, Observation, Request, TickInput
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon import decider as module
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.foreground import BLIND_S, Foreground
from acu_daemon.daemon.port import Answer
from acu_daemon.edge.clock import LoopClock
from acu_daemon.model import Reading
from acu_daemon.sim.virtual import run_virtual

SEEN = status()
WRITE, KNOWN = PointAndPoll(100.0, 40.0), AcuIdentity("SA3842", True, False)
Story = Callable[["Desk"], Any]


@dataclass
class ScriptedPort:
    """Answers by command; unknown ones are not answered."""

    clock: LoopClock
    replies: dict[Command, Any] = field(default_factory=lambda: {WRITE: SEEN, Poll(): SEEN})
    is_up: bool = True
    must_poll: bool = False
    has_room: bool = True
    silence_s: float = 0.07
    connect_count: int = 0
    both_s: float = 0.02
    no_contact: str = ""
    first: Answer | None = None
    is_sure: bool = True
    takes_s: float = 0.01
    stands_in: Command | None = None
    done: list[Any] = field(default_factory=list)

    def drop_if_silent(self) -> None: ...

    def take_first(self) -> Answer | None:
        first, self.first = self.first, None
        return first

    def question(self) -> Command | None:
        return self.stands_in

    async def exchange(self, command: Command) -> Answer:
        self.done.append(command)
        started = self.clock.tai_s()
        await asyncio.sleep(self.takes_s)
        return Answer(self.replies.get(command), started, None, self.is_sure)

    async def idle_gap(self) -> None:
        self.done.append("gap")


class Desk:
    """A foreground whose decisions the test makes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.clock = LoopClock(START_TAI_S)
        self.port = ScriptedPort(self.clock)
        self.area = CommonArea(state=ready(TrackState.HOLD_FITTED, SEEN))
        self.readings: list[Reading] = []
        self.given: list[TickInput] = []
        self.began_s: list[float] = []
        self.orders = Orders(WRITE)
        monkeypatch.setattr(module, "tick", self._decide)
        port: Any = self.port
        self.foreground = Foreground(
            self.area, port, self.clock, CONFIG, after_tick=self._after, on_reading=self.readings.append
        )
        self.after_count = 0

    def _after(self) -> None:
        self.after_count += 1

    def _decide(self, state: ControlState, given: TickInput, _config: Any) -> tuple[ControlState, Orders]:
        self.given.append(given)
        self.began_s.append(self.clock.tai_s() - START_TAI_S)
        return state, self.orders

    async def tick(self) -> Observation:
        """What this tick sees."""
        await self.foreground._tick()
        return self.given[-1].seen


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> Callable[[Story], None]:
    """Tells a story of a desk in virtual time."""

    def tell(story: Story) -> None:
        async def main() -> None:
            await story(Desk(monkeypatch))

        run_virtual(main())

    return tell


def test_what_an_exchange_brings_is_seen_by_the_next_tick_and_by_no_other(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        desk.orders = Orders(WRITE, ReadFaults())
        desk.port.replies[ReadFaults()] = Done()
        assert await desk.tick() == Observation(silence_s=float("inf"))
        assert desk.port.done == [WRITE, "gap", ReadFaults()]
        desk.port.replies.clear()
        seen = await desk.tick()
        assert (seen.status, seen.extra, seen.silence_s) == (SEEN, Exchange(ReadFaults(), Done()), 0.07)
        assert seen.reading is not None
        assert (await desk.tick()).status is None

    told(story)


@pytest.mark.parametrize("state", ["up", "down", "must poll"])
def test_an_extra_exchange_goes_out_only_after_one_that_left_the_line_well(
    told: Callable[[Story], None], state: str
) -> None:
    async def story(desk: Desk) -> None:
        desk.orders = Orders(WRITE, ReadFaults())
        answer = desk.port.exchange

        async def exchange(command: Command) -> Answer:
            got = await answer(command)
            desk.port.is_up, desk.port.must_poll = state != "down", state == "must poll"
            return got

        desk.port.exchange = exchange  # type: ignore[method-assign]
        await desk.tick()
        assert (ReadFaults() in desk.port.done) == (state == "up")

    told(story)


def test_nothing_goes_out_on_a_link_that_is_down_and_its_silence_has_no_end(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        await desk.tick()
        desk.port.is_up = False
        desk.port.done.clear()
        assert (await desk.tick()).silence_s == float("inf")
        assert desk.port.done == []

    told(story)


@pytest.mark.parametrize("stage", list(StartStage))
def test_another_connection_is_a_silence_once_unless_the_start_has_only_begun(
    told: Callable[[Story], None], stage: StartStage
) -> None:
    async def story(desk: Desk) -> None:
        desk.area.state = remembering(desk.area.state, stage=stage)
        await desk.tick()
        assert (await desk.tick()).silence_s == 0.07
        desk.port.connect_count += 1
        assert (await desk.tick()).silence_s == (0.07 if stage is StartStage.NEW else float("inf"))
        assert (await desk.tick()).silence_s == 0.07

    told(story)


@pytest.mark.parametrize(
    ("command", "reply", "sees"),
    [
        (WRITE, SEEN, True),
        (WRITE, Refused(), True),
        (Poll(), SEEN, True),
        (WRITE, None, False),
        (ReadFaults(), Done(), False),
        (Identify(), Refused(), False),
    ],
)
def test_a_link_without_an_answer_to_a_poll_or_a_write_for_a_second_is_silent(
    told: Callable[[Story], None], command: Command, reply: Any, sees: bool
) -> None:
    async def story(desk: Desk) -> None:
        await desk.tick()
        desk.orders, desk.port.replies = Orders(command), {command: reply}
        for _ in range(8):
            await asyncio.sleep(BLIND_S / 4)
            await desk.tick()
        assert (desk.given[-1].seen.silence_s == 0.07) == sees

    told(story)


@pytest.mark.parametrize("is_starting", [False, True])
@pytest.mark.parametrize("must_poll", [False, True])
@pytest.mark.parametrize("is_answered", [False, True])
def test_what_was_ordered_and_answered_counts_but_no_poll_in_the_place_of_a_write(
    told: Callable[[Story], None], is_answered: bool, must_poll: bool, is_starting: bool
) -> None:
    async def story(desk: Desk) -> None:
        if is_starting:
            desk.area.state = remembering(desk.area.state, stage=StartStage.SECTOR_FREE)
        desk.port.must_poll, desk.port.stands_in = must_poll, Poll()
        if not is_answered:
            desk.port.replies = {}
        await desk.tick()
        assert desk.port.done[0] == (Poll() if must_poll else WRITE)
        assert desk.foreground.answered_count == (is_answered and (is_starting or not must_poll))
        assert desk.foreground.write_count == (is_answered and not must_poll)

    told(story)


def test_after_a_failed_exchange_what_stands_in_for_a_poll_is_asked_and_heard_by_nobody(
    told: Callable[[Story], None],
) -> None:
    async def story(desk: Desk) -> None:
        desk.port.must_poll = True
        await desk.tick()
        assert desk.port.done == []
        desk.port.stands_in, desk.port.replies = Identify(), {Identify(): KNOWN}
        await desk.tick()
        assert desk.port.done == [Identify()]
        assert (await desk.tick()).extra is None
        assert desk.foreground.identity is None

    told(story)


@pytest.mark.parametrize("command", [WRITE, SelectMode(AcuMode.REMOTE)])
def test_a_refusal_is_followed_by_a_poll_at_once_and_both_are_seen(
    told: Callable[[Story], None], command: Command
) -> None:
    async def story(desk: Desk) -> None:
        desk.orders, desk.port.replies[command] = Orders(command), Refused()
        await desk.tick()
        assert desk.port.done == [command, "gap", Poll()]
        seen = await desk.tick()
        assert seen.status == SEEN
        assert (seen.refused, seen.extra) == (
            (Refused(), None) if command == WRITE else (None, Exchange(command, Refused()))
        )
        assert desk.foreground.write_count == 0

    told(story)


def test_a_request_is_obeyed_by_one_tick_in_the_order_in_which_it_came(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        for request in (Request.DISARM, Request.ARM):
            desk.foreground.ask(request)
        assert (await desk.tick()).requests == (Request.DISARM, Request.ARM)
        assert (await desk.tick()).requests == ()

    told(story)


def test_the_line_and_the_link_are_told_to_the_tick(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        for must_poll, has_room in ((False, True), (True, False)):
            desk.port.must_poll, desk.port.has_room = must_poll, has_room
            seen = await desk.tick()
            assert (seen.must_poll, seen.has_room) == (must_poll, has_room)

    told(story)


def test_the_answer_that_showed_the_link_to_be_up_is_the_first_status(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        for reply, heard in ((Refused(), None), (SEEN, SEEN)):
            desk.foreground._seen = Observation()
            desk.port.replies = {}
            desk.port.first = Answer(reply, desk.clock.tai_s(), None)
            seen = await desk.tick()
            assert seen.status == heard
        assert seen.silence_s == 0.07

    told(story)


@pytest.mark.parametrize("is_sure", [False, True])
def test_a_reading_of_which_the_time_is_not_sure_is_neither_recorded_nor_fitted(
    told: Callable[[Story], None], is_sure: bool
) -> None:
    async def story(desk: Desk) -> None:
        desk.area.state = ready(TrackState.AUTOTRACK_FITTED, SEEN)
        desk.port.is_sure = is_sure
        for _ in range(25):
            await asyncio.sleep(0.09)
            await desk.tick()
        assert len(desk.readings) == (25 if is_sure else 0)
        assert len(desk.area.to_fit) == (15 if is_sure else 0)  # a second of dwell
        assert len(desk.foreground.motion._readings) == 20  # of two seconds

    told(story)


def test_a_doubt_about_the_status_is_told_once_a_second(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        await desk.tick()
        desk.port.replies[WRITE] = replace(SEEN, contradictions=("mode and control",))
        told_s = []
        for _ in range(35):
            await asyncio.sleep(0.09)
            with capture_logs() as logs:
                desk.area.state = replace(desk.area.state, plausibility=CommonArea().state.plausibility)
                await desk.tick()
            told_s += [desk.clock.tai_s() - START_TAI_S for log in logs if log["event"] == "acu.doubted"]
        assert len(told_s) == 4
        assert min(b - a for a, b in zip(told_s, told_s[1:], strict=False)) >= 1.0 - 1e-6

    told(story)


def test_facts_are_logged_at_their_level(told: Callable[[Story], None]) -> None:
    async def story(desk: Desk) -> None:
        desk.orders = Orders(WRITE, None, (Event("a", {"x": 1}), Event("b", is_warning=True)))
        with capture_logs() as logs:
            await desk.tick()
        assert [(log["event"], log["log_level"], log.get("x")) for log in logs] == [
            ("a", "info", 1),
            ("b", "warning", None),
        ]

    told(story)


@pytest.mark.parametrize(
    ("takes_s", "gap_s", "skipped"),
    [
        (0.03, 0.1, 0),
        (0.099, 0.1, 0),
        (0.101, 0.2, 1),
        (0.199, 0.2, 1),
        (0.25, 0.3, 2),
    ],
)
def test_a_tick_that_takes_longer_than_the_period_costs_the_ticks_it_covers_and_none_is_made_up_for(
    told: Callable[[Story], None], takes_s: float, gap_s: float, skipped: int
) -> None:
    async def story(desk: Desk) -> None:
        desk.port.takes_s = takes_s
        running = asyncio.ensure_future(desk.foreground.run())
        await asyncio.sleep(5 * gap_s + 0.05)
        running.cancel()
        gaps = [b - a for a, b in zip(desk.began_s, desk.began_s[1:], strict=False)]
        assert gaps[:4] == pytest.approx([gap_s] * 4, abs=1e-4)
        tenths = [(START_TAI_S + one) / 0.1 for one in desk.began_s]
        assert tenths == pytest.approx([round(one) for one in tenths], abs=2e-3)
        assert desk.foreground.skipped_tick_count == skipped * desk.after_count

    told(story)


@pytest.mark.parametrize(("late_s", "next_s"), [(0.045, 0.1), (0.055, 0.2), (0.145, 0.2), (0.155, 0.3)])
def test_after_a_tick_that_began_more_than_half_a_period_late_the_next_one_is_skipped(
    told: Callable[[Story], None], late_s: float, next_s: float
) -> None:
    async def story(desk: Desk) -> None:
        sleep_until, dues = desk.clock.sleep_until, []

        async def late(tai_s: float) -> None:
            dues.append(tai_s)
            await sleep_until(tai_s + (late_s if len(dues) == 3 else 0.0))

        desk.clock.sleep_until = late  # type: ignore[method-assign]
        running = asyncio.ensure_future(desk.foreground.run())
        await asyncio.sleep(1.0)
        running.cancel()
        assert dues[3] - dues[2] == pytest.approx(next_s, abs=1e-4)
        assert dues[4] - dues[3] == pytest.approx(0.1, abs=1e-4)

    told(story)


@pytest.mark.parametrize(
    ("reply", "hurries"), [(AcuIdentity("SA3842", True, False), True), (Refused(), False), (None, False)]
)
def test_the_exchanges_of_the_start_follow_each_other_in_a_tick_while_they_are_answered_and_fit(
    told: Callable[[Story], None], reply: Any, hurries: bool
) -> None:
    async def story(desk: Desk) -> None:
        desk.area.state = remembering(desk.area.state, stage=StartStage.IDENTIFIED)
        desk.orders, desk.port.replies = Orders(Identify()), {Identify(): reply}
        running = asyncio.ensure_future(desk.foreground.run())
        await asyncio.sleep(0.35)
        running.cancel()
        starts = [one - desk.began_s[0] for one in desk.began_s]
        in_first = [one for one in starts if one < 0.0999]
        assert len(in_first) > 1 if hurries else len(in_first) == 1
        assert max(in_first) + desk.port.takes_s <= 0.09 + 1e-6

    told(story)
