"""The foreground: every 0.1 s poll the ACU, store the reading, write the command registers.  Never waits for a fit."""

import asyncio
import math
from collections.abc import Callable
from typing import Any

import structlog

from acu_daemon.acu.commands import (
    READS,
    Command,
    FreeTurnChoice,
    PointAndPoll,
    PointAt,
    Poll,
    SelectBackup,
    SelectMode,
    SetWatchdog,
    Stop,
    Stow,
    command_text,
)
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, FaultReport, Refused
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.safety.arming import owes_stop
from acu_daemon.control.safety.interlock import question
from acu_daemon.control.safety.stow import stow_command
from acu_daemon.control.state import StartStage, Watchdog
from acu_daemon.control.tick_input import Arrival, Asking, Request, SlaveWish, StowBy, StowWish
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.clock_watch import ClockWatch
from acu_daemon.daemon.decider import Decider
from acu_daemon.daemon.line_watch import LineWatch
from acu_daemon.daemon.motion import Motion
from acu_daemon.daemon.port import AcuPort, Answer
from acu_daemon.daemon.stop_times import StopTimes
from acu_daemon.daemon.stopping import DEADLINE_S, stop_antenna
from acu_daemon.daemon.tally import Tally
from acu_daemon.daemon.tick_lateness import Lateness
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.tape import Note, no_note
from acu_daemon.model import Reading

DOUBT_EVERY_S = 1.0
LATE_SHARE = 0.5  # of the period: after a tick that began later than this the next one is skipped
FIRST_SHARE = 0.2  # of the period, at least, before the first tick
HURRY_SHARE = 0.9  # of the period: the next tick comes on time
LOOK_TICKS = 10  # from look to look at clock and line
REST_S = 1.0  # from poll to poll between passes
AWAKE_S = 2.0  # after a person's word or a reply that did not come it polls as in a pass for so long
TOLD = (SelectMode, SelectBackup, FreeTurnChoice, SetWatchdog, PointAt, Stow)  # commands that the log tells
OPERATORS = (StowWish(StowBy.OPERATOR), StowWish(StowBy.OPERATOR, is_wanted=False))
BLIND_S = 1.0  # without a status other replies keep the link no longer than this: they say nothing of the antenna


class Foreground:
    """Owns the ACU, the control state and the counts; one task runs it."""

    def __init__(
        self,
        area: CommonArea,
        port: AcuPort,
        clock: Clock,
        config: ControlConfig,
        *,
        after_tick: Callable[[], None],
        on_reading: Callable[[Reading], None] | None = None,
        signal: Callable[[float], SignalSample | None] | None = None,
        note: Note = no_note,
        tally: Tally | None = None,
    ) -> None:
        """signal: what a receiver beside the ACU has said since it was asked last, by TAI; None: there is none."""
        self._area = area
        self._note = note
        self._decider = Decider(area, config, note)
        self._port = port
        self._clock = clock
        self._config = config
        self._after_tick = after_tick
        self._on_reading = on_reading
        self._signal = signal
        self._tally = Tally() if tally is None else tally
        self._doubt_again_s = -math.inf
        self._requests: tuple[Asking, ...] = ()
        self._connect_count = 0
        self._awake_until_s = -math.inf
        self._status_s = -math.inf  # when the newest status came, believed or not, or was refused
        self._log: Any = structlog.get_logger("tick")
        self.identity: AcuIdentity | None = None
        self.acu_faults = ""  # as the ACU named them last
        self.tick_count = 0
        self.write_count = 0
        self.answered_count = 0  # ordered exchanges that were answered: the work that the watchdog asks for
        self.skipped_tick_count = 0
        self.line_watch = LineWatch(port, area)
        self.clock_watch = ClockWatch(clock, config.clock_alarm_deg)
        self.lateness = Lateness()
        self.motion = Motion()
        self.stop_times = StopTimes()
        self._asked = asyncio.Event()  # a person has said a word: a rest ends

    async def run(self) -> None:
        """Tick at the tenths of UTC seconds; a late tick is counted and skipped, never sent in a burst."""
        period_s, log = self._config.period_s, self._log.bind()
        due_tai_s = (math.ceil(self._clock.tai_s() / period_s + FIRST_SHARE) - 1) * period_s
        ticks, is_rest = 1, False
        while True:
            if is_rest:
                due_tai_s = await self._rest(due_tai_s, ticks)
            else:
                due_tai_s = round(due_tai_s / period_s + ticks) * period_s
                await self._clock.sleep_until(due_tai_s)
            late_s = self._clock.tai_s() - due_tai_s
            self.lateness.add(late_s)
            self._tally.lateness.add(late_s)
            self.tick_count += 1
            await self._tick()
            await self._hurry(due_tai_s)
            if ticks >= LOOK_TICKS or self.tick_count % LOOK_TICKS == 0:
                self.clock_watch.look(self._area.sky.prediction)
                self.line_watch.look()
            self._after_tick()
            missed = max(0, math.floor((self._clock.tai_s() - due_tai_s) / period_s))
            if round(late_s, 3) > (missed + LATE_SHARE) * period_s:
                missed += 1  # two writes that near to each other would be a burst
            if self._config.acu.reply_deadline_s <= period_s:  # else it is polled as fast as it answers
                self.skipped_tick_count += missed
            is_rest = self._may_rest()
            ticks = max(1 + missed, round(REST_S / period_s)) if is_rest else 1 + missed
            log.debug("tick", late_ms=1e3 * late_s, skipped=missed, status=self._area.state.intake.status)

    async def _rest(self, from_tai_s: float, ticks: int) -> float:
        """Sleep over so many ticks, until a person says a word: a STOP shall not wait.  Returns the due one, TAI s."""
        period_s = self._config.period_s
        due_tai_s = round(from_tai_s / period_s + ticks) * period_s
        self._asked.clear()
        sleeping = asyncio.ensure_future(self._clock.sleep_until(due_tai_s))
        asked = asyncio.ensure_future(self._asked.wait())
        try:
            await asyncio.wait((sleeping, asked), return_when=asyncio.FIRST_COMPLETED)
            if sleeping.done():
                return due_tai_s
        finally:
            for waiting in (sleeping, asked):
                waiting.cancel()
            await asyncio.gather(sleeping, asked, return_exceptions=True)
        next_tai_s = math.ceil(self._clock.tai_s() / period_s + FIRST_SHARE) * period_s
        if next_tai_s < due_tai_s:
            due_tai_s = next_tai_s
        await self._clock.sleep_until(due_tai_s)
        return due_tai_s

    def _may_rest(self) -> bool:
        """Whether there is nothing to do but to see, once in a while, that the antenna still stands."""
        state, now_s = self._area.state, self._clock.monotonic_s()
        if not self._config.is_resting:
            return False
        is_known = self._decider.seen.status is not None and state.startup.stage >= StartStage.REGISTERS_KNOWN
        has_business = question(state) is not None or stow_command(state, self._clock.tai_s(), self._config) is not None
        if not is_known or self._requests or state.arming.is_stop_due or has_business:
            self._awake_until_s = now_s + AWAKE_S
        return now_s >= self._awake_until_s

    async def _hurry(self, due_tai_s: float) -> None:
        """While the start's exchanges are answered, the next one follows in the same tick if it fits."""
        end_tai_s, begun_tai_s = due_tai_s + HURRY_SHARE * self._config.period_s, due_tai_s
        while (
            self._area.state.startup.stage is not StartStage.READY
            and self._has_news()
            and self._port.is_up
            and not self._port.must_poll
            and self._clock.tai_s() + self._next_s(begun_tai_s) < end_tai_s
        ):
            begun_tai_s = self._clock.tai_s()
            self._after_tick()  # a refused rehearsal ends before the first write
            await self._port.idle_gap()
            await self._tick()

    def _has_news(self) -> bool:
        """Whether the start can go on: its last question is answered, or the first status of all has come."""
        if self._decider.seen.extra is None:
            return self._decider.seen.status is not None and self._area.state.intake.status is None
        return not isinstance(self._decider.seen.extra.reply, Refused | None)

    def _next_s(self, begun_tai_s: float) -> float:
        """How long the next decision's exchanges take: one of the start's alone as long as the last, else the most."""
        state = self._area.state
        is_alone = state.intake.is_place_sure and StartStage.NEW < state.startup.stage < StartStage.PRESENT_WRITTEN
        return self._clock.tai_s() - begun_tai_s if is_alone else self._port.both_s

    async def _tick(self) -> None:
        port, area = self._port, self._area
        port.drop_if_silent()
        first = port.take_first()
        if first is not None and isinstance(first.reply, AcuStatus):
            self._status_s = self._clock.monotonic_s()
            self._hear(Poll(), first)
        requests, self._requests = self._requests, ()
        silence_s, must_poll, has_room = self._silence_s(), port.must_poll, port.has_room
        now_tai_s = self._clock.tai_s()
        signal = None if self._signal is None else self._signal(now_tai_s)
        orders = self._decider.decide(now_tai_s, silence_s, requests, signal, must_poll=must_poll, has_room=has_room)
        self._report(orders.events)
        for event in orders.events:
            self._tally.told(event, now_tai_s)
        if not port.is_up:
            return
        is_answered = await (self._question() if must_poll else self._do(orders.first, "1"))
        is_starting = area.state.startup.stage is not StartStage.READY
        is_progress = not must_poll or is_starting  # no poll in the place of a write
        self.answered_count += is_answered and is_progress
        if orders.extra is not None and port.is_up and not port.must_poll:
            await port.idle_gap()
            await self._do(orders.extra, "2")

    def ask(self, request: Asking) -> None:
        """Take a person's request, or a program's; the next tick obeys.  Of a program's only the newest counts."""
        waiting = self._requests
        if isinstance(request, SlaveWish):
            waiting = tuple(one for one in waiting if not isinstance(one, SlaveWish))
        elif request in waiting:
            return
        self._requests = (*waiting, request)
        self._asked.set()

    @property
    def unheard(self) -> tuple[Asking, ...]:
        """What people have asked and no tick has obeyed: the run is over, and the next one's first tick obeys."""
        return tuple(one for one in self._requests if isinstance(one, Request) or one in OPERATORS)

    def _silence_s(self) -> float:
        """On another connection, however soon it came, everything is read again before it is commanded."""
        before, self._connect_count = self._connect_count, self._port.connect_count
        is_another = before != self._connect_count and self._area.state.startup.stage is not StartStage.NEW
        rest_s = REST_S if self._config.is_resting else 0.0
        is_blind = self._clock.monotonic_s() - self._status_s > max(BLIND_S, self._config.acu.silence_s) + rest_s
        return self._port.silence_s if self._port.is_up and not is_another and not is_blind else math.inf

    async def _do(self, command: Command, order: str = "") -> bool:
        """One exchange; what it brings is gathered for the next decision.  A refusal is followed by a poll at once.

        order: which of the tick's it is, for the tape.  True: a reply came, be it a refusal.
        """
        if order:
            self._note(("D", order))
        answer = await self._port.exchange(command)
        self._count(command, answer)
        if isinstance(command, Stop):
            self.stop_times = self.stop_times.after(answer.started_tai_s, answer.first_byte_tai_s, answer.reply)
        if isinstance(command, PointAndPoll | Poll) and answer.reply is not None and not self._port.no_contact:
            self._status_s = self._clock.monotonic_s()
        if isinstance(command, PointAndPoll) and isinstance(answer.reply, AcuStatus):
            self.write_count += 1
            self._tally.wrote(answer.started_tai_s)
        self._hear(command, answer)
        if isinstance(answer.reply, Refused) and not self._port.no_contact:
            await self._poll_after_nak(command, answer.reply.why)
        return answer.reply is not None

    def _count(self, command: Command, answer: Answer) -> None:
        took_s = self._clock.tai_s() - answer.started_tai_s
        self._tally.exchanged(None if answer.reply is None else took_s)
        if not isinstance(command, READS):
            self._tally.count("commands")
            if isinstance(answer.reply, Refused):
                self._tally.count("refused", "acu")

    async def _question(self) -> bool:
        """After a failed exchange: poll, or ask what stands in for it, whose answer nobody waits for."""
        question = self._port.question()
        if question is None:
            return False
        if isinstance(question, Poll):
            return await self._do(question)
        return (await self._port.exchange(question)).reply is not None

    async def _poll_after_nak(self, refused: Command, why: str) -> None:
        self._log.warning("acu.nak", command=command_text(refused), **({"reason": why} if why else {}))
        await self._port.idle_gap()
        self._note(("D", "n"))
        answer = await self._port.exchange(Poll())
        if isinstance(answer.reply, AcuStatus):
            self._hear(Poll(), answer)

    def _hear(self, command: Command, answer: Answer) -> None:
        """Gather a reply for the next decision, and hand its reading on."""
        arrival = Arrival(command, answer.reply, answer.started_tai_s, answer.first_byte_tai_s, answer.is_sure)
        extra_before = self._decider.seen.extra
        heard = self._decider.hear(arrival)
        if heard.seen.extra is not extra_before:
            self._report_extra(command, answer)
        if heard.doubt and isinstance(answer.reply, AcuStatus):
            self._report_doubt(answer.reply, heard.doubt)
        if heard.reading is None:
            return
        self.motion.add(heard.reading)
        self._tally.count("readings")
        if self._on_reading is not None and answer.is_sure:
            self._on_reading(heard.reading)

    def _report_doubt(self, status: AcuStatus, reason: str) -> None:
        """Say it once a second at most: a bad line garbles often."""
        now_s = self._clock.monotonic_s()
        if now_s >= self._doubt_again_s:
            self._doubt_again_s = now_s + DOUBT_EVERY_S
            count = self._area.state.plausibility.doubted_count
            self._log.warning("acu.doubted", reason=reason, mode=status.mode.name, count=count)

    def _report(self, events: tuple[Event, ...]) -> None:
        for event in events:
            (self._log.warning if event.is_warning else self._log.info)(event.name, **event.fields)

    def _report_extra(self, command: Command, answer: Answer) -> None:
        if isinstance(answer.reply, AcuIdentity):
            self.identity = answer.reply
            self._log.info("acu.identified", identity=str(answer.reply), is_simulation=answer.reply.is_simulated)
        elif isinstance(answer.reply, FaultReport):
            self.acu_faults = ", ".join(answer.reply.texts)
            self._log.warning("acu.faults", faults=answer.reply.texts)
        elif isinstance(command, TOLD) and isinstance(answer.reply, Done):
            self._log.info("acu.command", command=command_text(command))

    @property
    def owes_stop(self) -> bool:
        """Whether the antenna obeys us, or who was killed before us, or a STOP for it was not acknowledged yet."""
        return owes_stop(self._area.state, self._config, has_written=self.write_count > 0)

    async def safe_stop(self) -> bool:
        """Stop the antenna.  True: stopped, or left to somebody else; False: not acknowledged."""
        is_there = self._area.state.startup.watchdog is not Watchdog.REFUSED
        clears_watchdog = self._config.register_watchdog_s > 0.0 and is_there
        return await stop_antenna(self._port, DEADLINE_S, clears_watchdog=clears_watchdog)
