"""One exchange after another with the ACU, and the connection kept alive beside them (ICD sections 1 and 6)."""

import asyncio
import contextlib
from array import array
from dataclasses import dataclass
from typing import Any

import structlog

from acu_daemon.edge.clock import Clock
from acu_daemon.edge.link import Link
from acu_daemon.errors import LinkError
from acu_daemon.protocol.exchange import HostExchange
from acu_daemon.protocol.messages import Command, Poll, Reply, WriteAndPoll
from acu_daemon.protocol.sa3842 import exchange_bytes, reply_bytes

EXCHANGE_DEADLINE_S = 0.090  # a reply is complete within this of the start of the write, ICD section 1
CYCLE_SHARE = 0.95  # an exchange goes beside the write only if both fit into this share of the period, ICD section 6
FIRST_BACK_OFF_S = 0.1
LAST_BACK_OFF_S = 1.0  # a pass is short: more than a second of waiting costs more than an attempt
LATENCY_COUNT = 100
LONGEST_EXTRA = 18  # bytes of the longest housekeeping exchange that goes beside a write, ICD section 6


@dataclass(frozen=True, slots=True)
class Answer:
    """What one exchange brought: the reply, or None at the deadline; when its write started, when the reply did."""

    reply: Reply | None
    started_tai_s: float
    first_byte_tai_s: float | None


class AcuPort:
    """The ACU as the foreground sees it.  Owned by the foreground; `keep` runs as its own task."""

    def __init__(self, link: Link, clock: Clock, address: int, period_s: float, device_delay_s: float) -> None:
        self._link = link
        self._clock = clock
        self._address = address
        self._exchange = HostExchange(address)
        self._period_s = period_s
        self._latencies_s = array("d", [device_delay_s] * LATENCY_COUNT)  # of the newest exchanges, in no order
        self._latency_count = 0
        self._both_count = sum(exchange_bytes(WriteAndPoll(0.0, 0.0))) + 1 + LONGEST_EXTRA + 1  # with an idle byte each
        self._log: Any = structlog.get_logger("link")
        self._reopen = asyncio.Event()
        self._up = asyncio.Event()
        self._first: Answer | None = None
        self.problem = ""
        self.last_reply_s = clock.monotonic_s()
        self.connect_count = 0
        self.attempt_count = 0  # to open the link, begun or failed
        self.failed_exchange_count = 0

    @property
    def is_up(self) -> bool:
        return self._up.is_set()

    async def wait_until_up(self) -> None:
        await self._up.wait()

    @property
    def must_poll(self) -> bool:
        return self._exchange.must_poll

    @property
    def silence_s(self) -> float:
        """Seconds since the last valid reply."""
        return self._clock.monotonic_s() - self.last_reply_s

    @property
    def discarded_count(self) -> int:
        return self._exchange.discarded_count

    @property
    def garbled_count(self) -> int:
        return self._exchange.garbled_count

    @property
    def has_room(self) -> bool:
        """Whether the computed cycle leaves room for a second exchange beside the write (ICD section 6)."""
        return self.both_s <= CYCLE_SHARE * self._period_s

    @property
    def both_s(self) -> float:
        """Computed time of a write and the longest exchange beside it."""
        return self._both_count * self._link.byte_time_s + 2 * max(self._latencies_s)

    async def exchange(self, command: Command) -> Answer:
        """Send a command and wait for its reply until the deadline; a dead link is reported and reopened by `keep`."""
        started_s, started_tai_s = self._clock.monotonic_s(), self._clock.tai_s()
        first_byte_s: float | None = None
        reply: Reply | None = None
        try:
            self._link.drain_input()
            frame = self._exchange.begin(command)
            wire_s = (len(frame) + reply_bytes(command)) * self._link.byte_time_s
            self._link.write(frame)
            until_s = asyncio.get_running_loop().time() + EXCHANGE_DEADLINE_S
            with contextlib.suppress(TimeoutError):
                while reply is None:
                    data, arrival_s = await self._link.read(until_s)
                    first_byte_s = arrival_s if first_byte_s is None else first_byte_s
                    reply = self._exchange.receive(data)
        except LinkError as error:
            self.problem = str(error)
            self._drop(str(error))
        if reply is None:
            self._exchange.fail()
            self.failed_exchange_count += 1
            return Answer(None, started_tai_s, None)
        self.last_reply_s = self._clock.monotonic_s()
        self._latencies_s[self._latency_count % LATENCY_COUNT] = max(0.0, self.last_reply_s - started_s - wire_s)
        self._latency_count += 1
        first_byte_tai_s = None if first_byte_s is None else started_tai_s + first_byte_s - started_s
        return Answer(reply, started_tai_s, first_byte_tai_s)

    async def idle_gap(self) -> None:
        """Leave 10 idle bit times before the next command (ICD section 1)."""
        if self._link.byte_time_s > 0:
            await asyncio.sleep(self._link.byte_time_s)

    def drop_if_silent(self, limit_s: float) -> None:
        """Close and reopen a link without a valid reply for this long, so that no unsent write arrives as a burst."""
        if self.is_up and self.silence_s > limit_s:
            self._drop(f"no valid reply for {self.silence_s:.1f} s")

    def _drop(self, problem: str) -> None:
        if self.is_up:
            self._up.clear()
            self.problem = problem
            self._reopen.set()

    async def keep(self) -> None:
        """Open the link, and open it again whenever it was dropped, with a growing pause, for ever."""
        pause_s = FIRST_BACK_OFF_S
        reported = ""
        try:
            while True:
                self.attempt_count += 1
                try:
                    await self._link.open()
                    first = await self._first_poll()
                except LinkError as error:
                    if str(error) != reported:
                        reported = str(error)
                        self._log.warning("link.closed", link=self._link.description, reason=reported)
                    self.problem = str(error)
                    self.attempt_count += 1
                    await self._link.close()
                    await asyncio.sleep(pause_s)
                    pause_s = min(2 * pause_s, LAST_BACK_OFF_S)
                    continue
                pause_s, reported = FIRST_BACK_OFF_S, ""
                self.connect_count += 1
                self._log.info("link.open", link=self._link.description)
                self._reopen.clear()
                self._first = first
                self._up.set()
                await self._reopen.wait()
                self._log.warning("link.lost", link=self._link.description, reason=self.problem)
                await self._link.close()
        finally:
            self._up.clear()
            await self._link.close()

    async def _first_poll(self) -> Answer:
        """A link counts as up when the ACU has answered on it once."""
        self._exchange, self.problem = HostExchange(self._address), ""
        for _ in range(3):
            answer = await self.exchange(Poll())
            if answer.reply is not None:
                return answer
            if self.problem:
                raise LinkError(self.problem)
        raise LinkError(f"{self._link.description} is open, but no ACU answers a poll")

    def take_first(self) -> Answer | None:
        """Give the answer that showed the link to be up, once."""
        first, self._first = self._first, None
        return first if self.is_up else None

    def abandon(self) -> None:
        """Give up an exchange whose waiter was cancelled, so that the next one starts clean."""
        if self._exchange.is_outstanding:
            self._exchange.fail()
