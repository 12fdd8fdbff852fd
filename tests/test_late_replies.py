"""Replies that come behind their deadline: never the next one's, never fitted, and told (docs/protocol.md)."""

import asyncio
from collections.abc import Iterator
from itertools import cycle

import numpy as np
import pytest
from fake_sky import START_TAI_S
from flights import RISING_TAI_S, climb, events_named, seconds_to_state, state_at
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.acu.commands import Identify, PointAndPoll, Poll, ReadFaults
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.assist.session.refit import RefitReply, RefitRequest
from acu_daemon.cli.virtual_pass import Flight
from acu_daemon.daemon.port import AcuPort, Answer
from acu_daemon.drivers.sa3842.codec import CMD_OF, DEFAULT_ADDRESS, CommandDecoder, encode_reply
from acu_daemon.drivers.sa3842.messages import Command, Identity, ReadRegisters, WriteAndPoll
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.drivers.sa3842.status_block import decode_status
from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.edge.clock import LoopClock
from acu_daemon.edge.fit import InlineFitRunner
from acu_daemon.sim.virtual import run_virtual

T = RISING_TAI_S
LATE_FROM_S, LATE_TO_S = 14.0, 24.0
TAGGED_DEG = 0.012  # two LSB, and what the path bends between rows of the trace; a tenth of a second is 0.04
QUESTIONS = (Poll, Identify, ReadRegisters, ReadFaults)
LATE_S = 0.5

# The port on a line of its own


class Clocked:
    """A link to an ACU whose elevation code is the number of the command; each reply has a delay of its own."""

    description = "a line with delays"
    byte_time_s = 0.0

    def __init__(self, clock: LoopClock, delays_s: Iterator[float], *, in_order: bool) -> None:
        self._clock, self._delays_s, self._in_order = clock, delays_s, in_order
        self._decoder, self._arrivals = CommandDecoder(DEFAULT_ADDRESS, np.inf), Arrivals()
        self._free_s = 0.0
        self.commands: list[tuple[float, Command]] = []
        self.failed: dict[int, float] = {}  # commands without an answer in time, and when they were given up

    async def open(self) -> None: ...

    async def close(self) -> None: ...

    def write(self, data: bytes) -> None:
        now_s = self._clock.monotonic_s()
        for event in self._decoder.feed(data, now_s):
            assert event.command is not None
            number = len(self.commands)
            self.commands.append((now_s, event.command))
            standing = decode_status("0000" + f"{number:04X}" + "0" * 15)
            reply = standing if event.cmd in (0x31, 0x41) else Identity("3842", "S1")
            due_s = now_s + next(self._delays_s)
            if self._in_order:
                due_s = self._free_s = max(due_s, self._free_s)
            frame = encode_reply(event.cmd, reply) if event.cmd in (0x30, 0x31, 0x41) else b""
            asyncio.get_running_loop().call_at(due_s, self._arrive, frame)

    def _arrive(self, frame: bytes) -> None:
        if frame:
            self._arrivals.put(frame, self._clock.monotonic_s())

    async def read(self, until_s: float = np.inf) -> tuple[bytes, float]:
        return await self._arrivals.get(until_s)

    def drain_input(self) -> bytes:
        return self._arrivals.take_all()


def dialogue(delays_s: list[float], *, in_order: bool) -> tuple[list[tuple[int, Answer]], Clocked]:
    """Thirty ticks of a host; each sure status with the number of its command."""
    answers: list[tuple[int, Answer]] = []

    async def main() -> Clocked:
        clock = LoopClock(START_TAI_S)
        link = Clocked(clock, cycle(delays_s), in_order=in_order)
        port = AcuPort(link, clock, Sa3842Driver(), 0.1, 0.010)
        for tick in range(30):
            await clock.sleep_until(START_TAI_S + 0.1 * tick)
            command = port.question() if port.must_poll else PointAndPoll(0.0, 0.0)
            if command is not None:
                number = len(link.commands)
                answer = await port.exchange(command)
                if answer.reply is None:
                    link.failed[number] = clock.monotonic_s()
                if isinstance(answer.reply, AcuStatus) and answer.is_sure:
                    answers.append((number, answer))
        return link

    return answers, run_virtual(main())


def number_of(status: AcuStatus) -> int:
    return round(status.el_deg / 360.0 * 65536)


DELAYS_S = st.lists(st.sampled_from([0.005, 0.02, 0.085, 0.091, 0.11, 0.13, 0.15, 0.205, 0.31, 0.45]), min_size=1)


@given(DELAYS_S)
def test_no_sure_status_is_an_older_ones_whatever_the_delays_of_a_line_that_keeps_order(delays_s: list[float]) -> None:
    answers, _ = dialogue(delays_s, in_order=True)
    for number, answer in answers:
        assert isinstance(answer.reply, AcuStatus)
        assert number_of(answer.reply) == number


@given(st.integers(0, 12), st.floats(0.0, 0.55))
def test_no_sure_status_is_an_older_ones_where_one_late_reply_is_overtaken(at: int, late_s: float) -> None:
    delays_s = [0.010] * 30
    delays_s[at] = late_s
    answers, _ = dialogue(delays_s, in_order=False)
    assert len(answers) >= 22
    for number, answer in answers:
        assert isinstance(answer.reply, AcuStatus)
        assert number_of(answer.reply) == number


@given(DELAYS_S, st.booleans())
def test_after_a_failed_exchange_nothing_is_asked_whose_late_reply_may_still_come(
    delays_s: list[float], in_order: bool
) -> None:
    _, link = dialogue(delays_s, in_order=in_order)
    assert len(link.commands) >= 30 * 5 // 7
    given_up_s: dict[int, float] = {}
    for i, (begun_s, command) in enumerate(link.commands):
        if i - 1 in link.failed:
            assert isinstance(command, QUESTIONS)
            assert begun_s - given_up_s.get(CMD_OF[type(command)], -np.inf) >= LATE_S
        if i in link.failed:
            given_up_s[CMD_OF[type(command)]] = link.failed[i]


def test_a_line_110_to_150_ms_late_poll_after_poll_gives_no_answer_at_all() -> None:
    """Each reply came in the place of the next one's, and was tagged a tenth of a second late."""
    answers, link = dialogue([0.11, 0.13, 0.15, 0.12, 0.14], in_order=True)
    assert answers == []
    asked = [type(command) for _, command in link.commands[:6]]
    assert asked == [WriteAndPoll, Poll, Identify, ReadRegisters, ReadFaults, Poll]


# The daemon


class Noting(InlineFitRunner):
    """Notes the readings it is given."""

    given: list[tuple[float, float, float]]

    async def refit(self, request: RefitRequest) -> RefitReply:
        readings = request.readings
        self.given += zip(readings.tai_s, readings.az_deg, readings.el_deg, strict=True)
        return await super().refit(request)


def fly_late(*faults: str) -> tuple[Flight, list[tuple[float, float, float]]]:
    """A climb on a line that is late for ten seconds, with the readings that were fitted."""
    Noting.given = []
    span = f"start_s={LATE_FROM_S} duration_s={LATE_TO_S - LATE_FROM_S}"
    flight = climb(40.0, noise_deg=0.0, faults=[f"{fault} {span}" for fault in faults], make_runner=Noting)
    return flight, Noting.given


def off_deg(flight: Flight, readings: list[tuple[float, float, float]]) -> list[float]:
    """How far readings are from where the encoders were at their time, on either axis."""
    tai_s = np.array([row.tai_s for row in flight.rows])
    off = []
    for at_tai_s, az_deg, el_deg in readings:
        really_az_deg = np.interp(at_tai_s, tai_s, [row.encoder_az_deg for row in flight.rows])
        really_el_deg = np.interp(at_tai_s, tai_s, [row.encoder_el_deg for row in flight.rows])
        off.append(max(abs((az_deg - really_az_deg + 180.0) % 360.0 - 180.0), abs(el_deg - really_el_deg)))
    return off


CONSTANT = ("latency value=0.1 on=reply", "jitter value=0.04 seed=3 on=reply")  # beside the 10 ms of the ACU


@pytest.mark.long
def test_replies_110_to_150_ms_late_are_never_fitted_and_the_operator_is_told_how_late_they_are() -> None:
    flight, readings = fly_late(*CONSTANT)
    assert max(off_deg(flight, readings)) < TAGGED_DEG
    assert not [at for at, *_ in readings if T + LATE_FROM_S + 0.01 < at < T + LATE_TO_S - 0.2]
    assert seconds_to_state(flight, "LINK-LOST", T + LATE_FROM_S) < 0.7
    [lost] = [event["reason"] for event in events_named(flight, "link.lost")]
    assert "up to 150 ms after the command, 90 are allowed" in lost
    assert len(events_named(flight, "link.closed")) <= 3
    assert seconds_to_state(flight, "AUTOTRACK/FITTED", T + LATE_TO_S) < 2.5
    assert state_at(flight, T + 40.0) == "AUTOTRACK/FITTED"


@pytest.mark.long
@pytest.mark.parametrize("late_s", [0.11, 0.15, 0.25, 0.45])
@pytest.mark.parametrize("seed", [1, 2])
def test_replies_late_now_and_then_cost_a_write_each_and_no_reading_is_tagged_wrong(late_s: float, seed: int) -> None:
    flight, readings = fly_late(f"late-reply value={late_s} probability=0.15 seed={seed}")
    assert max(off_deg(flight, readings)) < TAGGED_DEG
    assert "LINK-LOST" not in flight.states()
    fitted = [at for at, *_ in readings if T + LATE_FROM_S < at < T + LATE_TO_S]
    assert len(fitted) > 40  # of a hundred
    [poor] = events_named(flight, "link.poor")
    assert poor["failed"] > 0
    writes = [at for at, command in flight.commands if isinstance(command, WriteAndPoll)]
    assert sum(T + LATE_FROM_S < at < T + LATE_TO_S for at in writes) > 60
