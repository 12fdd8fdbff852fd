"""One exchange after another with the ACU, and the connection kept alive beside them; its driver knows the bytes."""

import asyncio
import contextlib
import math
from array import array
from dataclasses import dataclass
from typing import Any

import structlog

from acu_daemon.acu.commands import Command, PointAndPoll, PointAt, Poll
from acu_daemon.acu.driver import AcuDriver
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, Refused, Reply
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.link import Link, open_once
from acu_daemon.edge.tape import Note, no_note
from acu_daemon.errors import LinkError

CYCLE_SHARE = 0.95  # of the period, for a write and an exchange beside it
FIRST_BACK_OFF_S = 0.1
FIRST_POLL_S = 0.6  # so long an open link is asked for its first answer: all four questions, and the poll once more
FIRST_TRIES = 1.5  # deadlines, where those are long
LAST_BACK_OFF_S = 1.0  # a pass is short: more than a second of waiting costs more than an attempt
SHORTEST_WAIT_S = 0.001
LATENCY_COUNT = 100
LATE_STEP_MS = 50


@dataclass(frozen=True, slots=True)
class Answer:
    """What one exchange brought: the reply, or None at the deadline; when its write started, when the reply did.

    is_sure: the reply is to this command, and to none before it that had no answer in time.
    """

    reply: Reply | None
    started_tai_s: float
    first_byte_tai_s: float | None
    is_sure: bool = True


class AcuPort:
    """The ACU as the foreground sees it.  Owned by the foreground; `keep` runs as its own task."""

    def __init__(
        self,
        link: Link,
        clock: Clock,
        driver: AcuDriver,
        period_s: float,
        device_delay_s: float,
        note: Note = no_note,
    ) -> None:
        self._link = link
        self._note = note
        self._clock = clock
        self._driver = driver
        self._deadline_s = driver.capabilities.reply_deadline_s
        self._period_s = period_s
        self._latencies_s = array("d", [device_delay_s] * LATENCY_COUNT)  # of the newest exchanges, in no order
        self._latency_count = 0
        both_count = driver.wire_bytes(PointAndPoll(0.0, 0.0)) + 1 + driver.extra_bytes + 1  # with an idle byte each
        self._both_s = both_count * link.byte_time_s
        self._log: Any = structlog.get_logger("link")
        self._reopen = asyncio.Event()
        self._up = asyncio.Event()
        self._first: Answer | None = None
        self._broken = ""  # why the present connection is
        self.problem = ""
        self.no_contact = ""  # why what answers does not reach the antenna
        self.last_reply_s = clock.monotonic_s()
        self._unanswered_s: float | None = None  # start of the first exchange since then that brought no reply
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
        return self._driver.must_poll

    @property
    def silence_s(self) -> float:
        """Seconds since the last valid reply; counted from the command that went unanswered where few are sent."""
        if self._unanswered_s is None:
            return 0.0
        return self._clock.monotonic_s() - max(self.last_reply_s, self._unanswered_s - self._period_s)

    @property
    def discarded_count(self) -> int:
        return self._driver.discarded_count

    @property
    def garbled_count(self) -> int:
        return self._driver.garbled_count

    @property
    def late_count(self) -> int:
        """Replies that came, but after their deadline."""
        return self._driver.late_count

    @property
    def lateness(self) -> str:
        """How late the newest late reply was, for people, in steps so that they are not told of each one."""
        late_ms = LATE_STEP_MS * math.ceil(1e3 * self._driver.late_s / LATE_STEP_MS)
        return f"up to {late_ms} ms after the command, {1e3 * self._deadline_s:.0f} are allowed"

    @property
    def has_room(self) -> bool:
        """Whether the computed cycle leaves room for a second exchange beside the write."""
        return self.both_s <= CYCLE_SHARE * self._period_s

    @property
    def both_s(self) -> float:
        """Computed time of a write and the longest exchange beside it."""
        return self._both_s + 2 * max(self._latencies_s)

    async def exchange(self, command: Command) -> Answer:
        """Send a command and wait for its reply until the deadline; a dead link is reported and reopened by `keep`.

        An ACU that cannot do both in one exchange is told the angles first, and asked for its status when it has them.
        """
        if isinstance(command, PointAndPoll) and not self._driver.capabilities.has_combined_write:
            answer = await self._exchange(PointAt(command.az_deg, command.el_deg))
            if not isinstance(answer.reply, Done):
                return answer
            await self.idle_gap()
            command = Poll()
        return await self._exchange(command)

    async def _exchange(self, command: Command) -> Answer:
        started_s, started_tai_s = self._clock.monotonic_s(), self._clock.tai_s()
        first_byte_s: float | None = None
        reply: Reply | None = None
        try:
            if unread := self._link.drain_input():
                self._driver.receive(unread, started_s)
            frame = self._driver.begin(command, started_s)
            self._note(("X", started_s, started_tai_s, unread, frame))
            wire_s = self._driver.wire_bytes(command) * self._link.byte_time_s
            if frame:
                self._link.write(frame)
            else:
                reply = self._driver.receive(b"", started_s)
            until_s = asyncio.get_running_loop().time() + self._deadline_s
            with contextlib.suppress(TimeoutError):
                while reply is None:
                    data, arrival_s = await self._link.read(until_s)
                    self._note(("R", arrival_s, data))
                    first_byte_s = arrival_s if first_byte_s is None else first_byte_s
                    reply = self._driver.receive(data, arrival_s)
        except LinkError as error:
            self.problem = self._broken = str(error)
            self._drop(str(error))
        if reply is None:
            self._fail()
            self.failed_exchange_count += 1
            self._unanswered_s = started_s if self._unanswered_s is None else self._unanswered_s
            return Answer(None, started_tai_s, None)
        ended_s = self._clock.monotonic_s()
        self.no_contact = reply.why if isinstance(reply, Refused) and reply.has_no_contact else ""
        is_free_text = isinstance(reply, AcuIdentity) and not reply.is_known  # it may be garble
        if frame and not is_free_text and not self.no_contact:
            self.last_reply_s, self._unanswered_s = ended_s, None
        elif frame and self._unanswered_s is None:
            self._unanswered_s = started_s
        self._latencies_s[self._latency_count % LATENCY_COUNT] = max(0.0, ended_s - started_s - wire_s)
        self._latency_count += 1
        first_byte_tai_s = None if first_byte_s is None else started_tai_s + first_byte_s - started_s
        return Answer(reply, started_tai_s, first_byte_tai_s, self._driver.is_sure)

    def _fail(self) -> None:
        now_s = self._clock.monotonic_s()
        self._driver.fail(now_s)
        self._note(("N", now_s))

    def question(self) -> Command | None:
        """A poll, or what may stand in its place; None: nothing may yet."""
        now_s = self._clock.monotonic_s()
        self._note(("Q", now_s))
        return self._driver.question(now_s)

    async def ask(self) -> Answer | None:
        """Poll, or do what must come before that: another question, or a pause until one may be asked; then None."""
        question = self.question()
        if question is None:
            await asyncio.sleep(self._driver.free_s - self._clock.monotonic_s() + SHORTEST_WAIT_S)
            return None
        answer = await self.exchange(question)
        await self.idle_gap()
        return answer if isinstance(question, Poll) else None

    async def status(self) -> AcuStatus:
        """Ask until a status has come, over as many connections as it takes; whoever calls sets the deadline."""
        while True:
            await self.wait_until_up()
            self.drop_if_silent()
            answer = await self.ask() if self.is_up else None
            if answer is not None and isinstance(answer.reply, AcuStatus):
                return answer.reply

    async def reply_to(self, command: Command) -> Reply:
        """Send a command until it is answered, be it by a refusal; whoever calls sets the deadline."""
        while True:
            if self.must_poll or not self.is_up:
                await self.status()
            answer = await self.exchange(command)
            await self.idle_gap()
            if answer.reply is not None:
                return answer.reply

    async def idle_gap(self) -> None:
        """Leave 10 idle bit times before the next command."""
        if self._link.byte_time_s > 0:
            await asyncio.sleep(self._link.byte_time_s)

    def drop_if_silent(self) -> None:
        """Close and reopen a link without a valid reply for long, so that no unsent write arrives as a burst."""
        if self.is_up and self.silence_s > self._driver.capabilities.silence_s:
            late = f"; they come {self.lateness}" if self._driver.late_at_s > self.last_reply_s else ""
            why = f": {self.no_contact}" if self.no_contact else late
            self._drop(f"no valid reply for {self.silence_s:.1f} s{why}")

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
                opened_s = self._clock.monotonic_s()
                try:
                    await self.open()
                except LinkError as error:
                    if str(error) != reported:
                        reported = str(error)
                        self._log.warning("link.closed", link=self._link.description, reason=reported)
                    self.attempt_count += 1
                    await self._close()
                    await asyncio.sleep(pause_s)
                    is_there = self._driver.late_at_s > opened_s
                    pause_s = FIRST_BACK_OFF_S if is_there else min(2 * pause_s, LAST_BACK_OFF_S)
                    continue
                pause_s, reported = FIRST_BACK_OFF_S, ""
                self._log.info("link.open", link=self._link.description)
                self._note(("L", ""))
                await self._reopen.wait()
                self._log.warning("link.lost", link=self._link.description, reason=self.problem)
                self._note(("L", self.problem))
                await self._close()
        finally:
            self._up.clear()
            await self._link.close()

    async def _close(self) -> None:
        await self._link.close()
        self._driver.forget()
        self._note(("G",))

    async def open(self, *, tries_all: bool = False) -> None:
        """Open the link once.  It counts as up when the ACU has answered a poll on it.  LinkError: it has not.

        tries_all: at every address of its name, where nobody will try again.
        """
        try:
            await (open_once(self._link) if tries_all else self._link.open())
            self._first = await self._first_poll()
        except LinkError as error:
            self.problem = str(error)
            raise
        self.problem = ""
        self.connect_count += 1
        self._reopen.clear()
        self._up.set()

    async def _first_poll(self) -> Answer:
        self._broken, late_count = "", self._driver.late_count
        end_s = asyncio.get_running_loop().time() + max(FIRST_POLL_S, FIRST_TRIES * self._deadline_s)
        while asyncio.get_running_loop().time() < end_s:
            answer = await self.ask()
            if answer is not None and answer.reply is not None and not self.no_contact:
                return answer
            if self._broken:
                raise LinkError(self._broken)
        if self.no_contact:
            raise LinkError(f"{self._link.description} is open, but the antenna does not answer it: {self.no_contact}")
        if self._driver.late_count > late_count:
            raise LinkError(f"{self._link.description} is open, but all replies come too late: {self.lateness}")
        raise LinkError(f"{self._link.description} is open, but no ACU answers: check address and baud rate")

    def take_first(self) -> Answer | None:
        """Give the answer that showed the link to be up, once."""
        first, self._first = self._first, None
        return first if self.is_up else None

    def abandon(self) -> None:
        """Give up an exchange whose waiter was cancelled, so that the next one starts clean."""
        if self._driver.is_outstanding:
            self._fail()
