"""One exchange after another: deadlines, late replies, the link kept alive."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Star

from acu_daemon.acu.commands import AcuMode, Command, PointAndPoll, PointAt, Poll, ReadCommanded, SelectMode, Stop
from acu_daemon.acu.replies import AcuStatus, Done, Refused, Reply
from acu_daemon.daemon.port import FIRST_POLL_S, AcuPort, Answer
from acu_daemon.daemon.stopping import DEADLINE_S, stop_antenna
from acu_daemon.drivers.sa3842.codec import CommandDecoder, encode_reply
from acu_daemon.drivers.sa3842.messages import RegisterContents, Status, WriteAndPoll
from acu_daemon.drivers.sa3842.sa3842_driver import SA3842, Sa3842Driver
from acu_daemon.edge.clock import LoopClock
from acu_daemon.errors import LinkError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.memory import MemoryLink
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Scenario
from acu_daemon.sim.virtual import VirtualTimeLoop, run_virtual

BAUD_9600_S = 10 / 9600
WIRE_S = 45 * BAUD_9600_S  # a WRITE AND STATUS there and back

Story = Callable[[AcuPort, MemoryLink, LoopClock], Awaitable[None]]


def play(story: Story, *, latency_s: float = 0.010, byte_time_s: float = 0.0, is_kept: bool = True) -> None:
    """Tell a story of a port and a link in virtual time."""

    async def main() -> None:
        clock = LoopClock(START_TAI_S)
        scenario = Scenario(acu=AcuChoice(reply_latency_s=latency_s))
        acu = FakeAcu(AcuParts(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S, scenario))
        link = MemoryLink(acu, clock, byte_time_s)
        port = AcuPort(link, clock, Sa3842Driver(), 0.1, 0.010)
        async with asyncio.TaskGroup() as group:
            if is_kept:
                keeper = group.create_task(port.keep())
                await asyncio.sleep(0.2)
                await story(port, link, clock)
                keeper.cancel()
            else:
                await link.open()
                await story(port, link, clock)

    run_virtual(main())


def test_an_exchange_brings_the_reply_and_the_times_of_its_write_and_its_first_byte() -> None:
    async def story(port: AcuPort, _link: MemoryLink, clock: LoopClock) -> None:
        began = clock.tai_s()
        answer = await port.exchange(Poll())
        assert isinstance(answer.reply, AcuStatus)
        assert answer.started_tai_s == began
        assert answer.first_byte_tai_s == pytest.approx(began + 0.010, abs=1e-6)

    play(story)


def test_a_reply_that_does_not_come_fails_at_the_deadline_and_the_next_command_must_be_a_poll() -> None:
    async def story(port: AcuPort, link: MemoryLink, clock: LoopClock) -> None:
        link.is_cut = True
        began = clock.monotonic_s()
        answer = await port.exchange(PointAndPoll(0.0, 45.0))
        assert answer.reply is None
        assert clock.monotonic_s() - began == pytest.approx(SA3842.reply_deadline_s, abs=1e-6)
        assert port.must_poll
        link.is_cut = False
        with pytest.raises(RuntimeError, match="Poll"):
            await port.exchange(SelectMode(AcuMode.REMOTE))
        assert isinstance((await port.exchange(Poll())).reply, AcuStatus)
        assert not port.must_poll
        assert port.failed_exchange_count == 1

    play(story)


def test_a_late_reply_is_not_taken_for_the_next_one() -> None:
    async def story(port: AcuPort, _link: MemoryLink, _clock: LoopClock) -> None:
        assert (await port.exchange(PointAndPoll(10.0, 45.0))).reply is None  # its reply comes after 120 ms
        await asyncio.sleep(0.025)
        assert (await port.exchange(Poll())).reply is None
        assert port.discarded_count >= 1

    play(story, latency_s=0.120, is_kept=False)


def test_p8_a_reply_that_came_in_time_counts_though_the_loop_looked_after_the_deadline() -> None:
    async def story(port: AcuPort, _link: MemoryLink, clock: LoopClock) -> None:
        began_s = clock.monotonic_s()
        asyncio.get_running_loop().call_later(0.005, stand_still, 0.200)
        answer = await port.exchange(Poll())  # answered after 10 ms
        assert isinstance(answer.reply, AcuStatus)
        assert clock.monotonic_s() - began_s > SA3842.reply_deadline_s
        assert (port.failed_exchange_count, port.must_poll) == (0, False)

    play(story)


def stand_still(seconds: float) -> None:
    """The process gets no processor for so long."""
    loop = asyncio.get_running_loop()
    assert isinstance(loop, VirtualTimeLoop)
    loop._now_s += seconds


def test_a_refusal_is_an_answer() -> None:
    async def story(port: AcuPort, _link: MemoryLink, _clock: LoopClock) -> None:
        assert (await port.exchange(Stop())).reply == Done()
        assert (await port.exchange(PointAt(0.0, 120.0))).reply == Refused()

    play(story)


def test_p2_a_silent_link_is_dropped_and_opened_again() -> None:
    async def story(port: AcuPort, link: MemoryLink, _clock: LoopClock) -> None:
        link.is_cut = True
        await port.exchange(Poll())
        port.drop_if_silent()
        assert port.is_up
        await asyncio.sleep(0.6)
        port.drop_if_silent()
        assert not port.is_up
        link.is_cut = False
        await asyncio.sleep(1.5)
        assert port.is_up
        assert port.connect_count == 2

    play(story)


def test_p2_the_silence_counts_from_the_command_that_went_unanswered_and_none_that_was_not_sent() -> None:
    async def story(port: AcuPort, link: MemoryLink, _clock: LoopClock) -> None:
        await port.exchange(Poll())
        await asyncio.sleep(30.0)
        assert port.silence_s == 0.0
        link.is_cut = True
        await port.exchange(Poll())
        await asyncio.sleep(0.3)
        assert port.silence_s == pytest.approx(SA3842.reply_deadline_s + 0.3 + 0.1, abs=1e-6)
        link.is_cut = False
        await asyncio.sleep(0.3)
        await port.exchange(Poll())
        assert port.silence_s == 0.0

    play(story)


def test_a_connection_that_was_lost_is_closed_before_the_next_one_is_opened() -> None:
    """An ACU with one client at a time would refuse the next one, and what is unsent would still go out."""

    async def story(port: AcuPort, link: MemoryLink, _clock: LoopClock) -> None:
        done: list[str] = []
        open_it, close_it = link.open, link.close

        async def noted_open() -> None:
            done.append("open")
            await open_it()

        async def noted_close() -> None:
            done.append("close")
            await close_it()

        link.open, link.close = noted_open, noted_close
        for _ in range(3):
            link.is_cut = True
            await port.exchange(Poll())
            await asyncio.sleep(0.5)
            port.drop_if_silent()
            link.is_cut = False
            await asyncio.sleep(0.2)
            await port.wait_until_up()
        assert done == ["close", "open"] * 3

    play(story)


@pytest.mark.parametrize("refused_count", [0, 1, 3])
def test_p6_a_stop_is_done_when_it_is_acknowledged_and_a_refusal_is_none(refused_count: int) -> None:
    async def story(port: AcuPort, _link: MemoryLink, _clock: LoopClock) -> None:
        answered = port.exchange
        answers: list[Reply | None] = []

        async def exchange(command: Command) -> Answer:
            answer = await answered(command)
            if isinstance(command, Stop):
                answer = replace(answer, reply=Refused() if len(answers) < refused_count else answer.reply)
                answers.append(answer.reply)
            return answer

        port.exchange = exchange  # type: ignore[method-assign]
        assert await stop_antenna(port, DEADLINE_S, clears_watchdog=False)
        assert [type(one) for one in answers] == [Refused] * refused_count + [Done]

    play(story)


def test_p3_an_acu_that_another_client_holds_is_asked_again_each_second_and_the_reason_is_kept() -> None:
    async def story(port: AcuPort, link: MemoryLink, _clock: LoopClock) -> None:
        link.is_refused = True
        link.hang_up()
        await port.exchange(Poll())
        await asyncio.sleep(8.0)
        assert not port.is_up
        assert "another client" in port.problem
        link.is_refused = False
        await asyncio.sleep(1.1)
        assert port.is_up

    play(story)


def test_p3_the_pauses_between_attempts_double_up_to_a_second_and_begin_anew_once_the_acu_has_answered() -> None:
    begun_s: list[float] = []

    async def story(port: AcuPort, link: MemoryLink, clock: LoopClock) -> None:
        async def refused() -> None:
            begun_s.append(clock.monotonic_s())
            raise LinkError("nobody there")

        opens = link.open
        for _ in range(2):
            begun_s.clear()
            link.open = refused  # type: ignore[method-assign]
            link.hang_up()
            await port.exchange(Poll())
            await asyncio.sleep(5.0)
            pauses_s = [b - a for a, b in zip(begun_s, begun_s[1:], strict=False)]
            assert pauses_s[:6] == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.0, 1.0])
            link.open = opens  # type: ignore[method-assign]
            await port.wait_until_up()

    play(story)


def test_a_link_counts_as_up_only_when_the_acu_answered_on_it() -> None:
    async def main() -> None:
        clock = LoopClock(START_TAI_S)
        acu = FakeAcu(AcuParts(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S, Scenario()))
        link = MemoryLink(acu, clock)
        link.is_cut = True
        port = AcuPort(link, clock, Sa3842Driver(), 0.1, 0.010)
        async with asyncio.TaskGroup() as group:
            keeper = group.create_task(port.keep())
            await asyncio.sleep(3.0)
            assert not port.is_up
            assert "no ACU answers" in port.problem
            keeper.cancel()

    run_virtual(main())


class Dead(MemoryLink):
    """Cannot even be written to."""

    def write(self, data: bytes) -> None:
        raise LinkError("the adapter was pulled out")


def test_a_link_that_breaks_in_mid_write_is_no_exception_but_a_failed_exchange() -> None:
    async def main() -> None:
        clock = LoopClock(START_TAI_S)
        link = Dead(FakeAcu(AcuParts(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S, Scenario())), clock)
        port = AcuPort(link, clock, Sa3842Driver(), 0.1, 0.010)
        await link.open()
        assert (await port.exchange(Poll())).reply is None
        assert port.problem == "the adapter was pulled out"

    run_virtual(main())


@pytest.mark.parametrize(("latency_s", "has_room"), [(0.002, True), (0.010, True), (0.020, False)])
def test_at_9600_baud_there_is_room_for_a_second_exchange_only_while_the_acu_is_quick(
    latency_s: float, has_room: bool
) -> None:
    """docs/protocol.md, Timing: both exchanges take 71.7, 87.7 and 107.7 ms at 2, 10 and 20 ms latency."""

    async def story(port: AcuPort, _link: MemoryLink, clock: LoopClock) -> None:
        began = clock.monotonic_s()
        assert (await port.exchange(PointAndPoll(10.0, 45.0))).reply is not None
        assert clock.monotonic_s() - began == pytest.approx(WIRE_S + latency_s, abs=1e-3)
        assert port.has_room is has_room

    play(story, latency_s=latency_s, byte_time_s=BAUD_9600_S)


def test_the_idle_gap_is_ten_bits_of_the_wire_and_nothing_on_tcp() -> None:
    async def slow(port: AcuPort, _link: MemoryLink, clock: LoopClock) -> None:
        began = clock.monotonic_s()
        await port.idle_gap()
        assert clock.monotonic_s() - began == pytest.approx(BAUD_9600_S)

    async def quick(port: AcuPort, _link: MemoryLink, clock: LoopClock) -> None:
        began = clock.monotonic_s()
        await port.idle_gap()
        assert clock.monotonic_s() == began

    play(slow, byte_time_s=BAUD_9600_S)
    play(quick)


def test_waiting_for_a_link_ends_when_it_is_up() -> None:
    async def story(port: AcuPort, link: MemoryLink, _clock: LoopClock) -> None:
        link.hang_up()
        await port.exchange(Poll())
        assert not port.is_up
        async with asyncio.timeout(1.0):
            await port.wait_until_up()

    play(story)


def test_an_open_link_is_asked_for_more_than_half_a_second_before_it_is_closed() -> None:
    """Three lost polls took a quarter of a second, and a second of pause after them."""

    async def story(port: AcuPort, link: MemoryLink, clock: LoopClock) -> None:
        link.is_cut = True
        await port.exchange(Poll())
        await asyncio.sleep(0.5)
        port.drop_if_silent()
        opened_s: list[float] = []
        opens = link.open

        async def noted() -> None:
            opened_s.append(clock.monotonic_s())
            await opens()

        link.open = noted  # type: ignore[method-assign]
        await asyncio.sleep(0.3)
        link.is_cut = False
        await port.wait_until_up()
        assert len(opened_s) == 1
        assert clock.monotonic_s() - opened_s[0] < FIRST_POLL_S + SA3842.reply_deadline_s

    play(story)


def test_a_safe_stop_outlives_a_link_that_breaks_in_the_middle_of_it() -> None:
    async def story(port: AcuPort, link: MemoryLink, _clock: LoopClock) -> None:
        write = link.write

        def broken(data: bytes) -> None:
            if port.connect_count == 1 and port.attempt_count == 1:
                raise LinkError("the other side reset the connection")
            write(data)

        link.write = broken  # type: ignore[method-assign]
        assert await stop_antenna(port, DEADLINE_S, clears_watchdog=False)
        assert port.connect_count == 2

    play(story)


def test_every_write_of_the_cycle_gives_the_tilt_back_as_it_was_read_last() -> None:
    driver = Sa3842Driver()
    for tilt_code in (0, 1, 0x7FFF, 0x8000, 0xFFFF, 0x1234):
        driver.begin(ReadCommanded(), 0.0)
        assert driver.receive(encode_reply(0x33, RegisterContents(10.0, 20.0, tilt_code, 7)), 0.01) is not None
        for _ in range(2):
            events = CommandDecoder().feed(driver.begin(PointAndPoll(30.0, 40.0), 1.0), 1.0)
            assert [event.command.tilt_code for event in events if isinstance(event.command, WriteAndPoll)] == [
                tilt_code
            ]
            assert driver.receive(encode_reply(0x41, Status(30.0, 40.0, AcuMode.STANDBY)), 1.01) is not None
