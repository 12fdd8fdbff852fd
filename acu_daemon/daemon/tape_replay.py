"""A tape through the daemon's decision code: the same inputs in the same order, and what it decides from them.

Driver, decision, plan and buffer are the daemon's own; the tape stands for link, clock and, unless the fits are to be
computed again, for the fit process.  What is compared is what the antenna would have got: the bytes of each command.
"""

import contextlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

from acu_daemon.acu.commands import Command, PointAndPoll, PointAt, Poll, SetWatchdog, Stop, command_text
from acu_daemon.acu.replies import Done, Reply
from acu_daemon.assist.session.refit import RefitReply, RefitRequest, Refitter, before_fit, predict_from
from acu_daemon.control.hear import Heard
from acu_daemon.control.orders import Orders
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.safety.arming import begin_run
from acu_daemon.control.tick_input import Arrival, Asking, PassPlan
from acu_daemon.control.tracking.pass_plan import planned_pass
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.buffer_keeper import BufferKeeper
from acu_daemon.daemon.decider import Decider
from acu_daemon.daemon.service import PassJob, plan_request
from acu_daemon.daemon.stopping import is_left_alone
from acu_daemon.edge.tape import Record
from acu_daemon.edge.tape_text import FitAnswer
from acu_daemon.errors import OrbitError
from acu_daemon.model import Model, Readings


@dataclass(frozen=True, slots=True)
class Difference:
    """Where a replay first decides otherwise than the daemon did."""

    tick: int
    tai_s: float
    recorded: str
    replayed: str

    def __str__(self) -> str:
        return f"tick {self.tick}: recorded {self.recorded}, replayed {self.replayed}"


class Watcher(Protocol):
    """Who looks on while a tape is replayed, such as a report."""

    def ticked(self, area: CommonArea, now_tai_s: float, orders: Orders) -> None:
        """A tick was decided."""

    def heard(self, heard: Heard, arrival: Arrival, latency_s: float) -> None:
        """A reply was taken in; latency_s: from the begin of its exchange to its last byte."""

    def fitted(self, request: RefitRequest, reply: RefitReply) -> None:
        """A fit has answered."""

    def told(self, record: Record, now_tai_s: float) -> None:
        """A record that decides nothing: the line, the clock, a hook."""


class TapeReplay:
    """The daemon's decisions, made anew from a tape.  fits_anew: the fits too."""

    def __init__(self, job: PassJob, watcher: Watcher | None = None, *, fits_anew: bool = False) -> None:
        self._job, self._watcher = job, watcher
        self.area = CommonArea(state=begin_run(job.state, job.control))
        self._decider = Decider(self.area, job.control)
        self._buffer = BufferKeeper(
            self.area, job.refit, job.control, horizon_s=job.horizon_s, low_water_s=job.low_water_s
        )
        self._refitter = Refitter(job.refit) if fits_anew else None
        self._fits_anew = fits_anew
        self._given: list[Readings] = []
        self._asked: RefitRequest | None = None
        self._planned: PassPlan | None = None
        self._orders: Orders | None = None
        self._done = ""  # which of the orders were sent
        self._now_tai_s = 0.0
        self._meant: Command = Poll()  # what the decision takes the exchange for
        self._next: Command = Poll()  # what is sent
        self._sent: Command = Poll()
        self._answer: Arrival | None = None
        self._first_byte_tai_s: float | None = None
        self._started_s = self._ended_s = 0.0
        self.tick_count = self.command_count = self.fit_count = 0
        self.difference: Difference | None = None
        self.is_ended = False
        self._is_question = self._is_stopped = False  # in the safe stop

    def run(self, records: Iterable[Record]) -> Difference | None:
        """Replay until the recording's end or the first difference, which is returned.

        After the run's end come the commands of the safe stop (daemon.stopping), and facts for a report.
        """
        for record in records:
            if self.is_ended:
                self._mean_of_stop(record)
            self._take(record)
            if self.difference is not None:
                break
        return self.difference

    def _take(self, record: Record) -> None:
        match record:
            case ("T", *given):
                self._tick(*given)
            case ("D", which):
                self._order(which)
            case ("Q", now_s):
                self._mean(self._job.driver.question(now_s) or Poll())
            case ("X", started_s, started_tai_s, unread, frame):
                self._begin(started_s, started_tai_s, unread, frame)
            case ("R", arrival_s, data):
                self._receive(arrival_s, data)
            case ("N", now_s):
                self._job.driver.fail(now_s)
            case ("G",):
                self._job.driver.forget()
            case ("H",):
                self._hear()
            case _:
                self._take_sky(record)

    def _take_sky(self, record: Record) -> None:
        match record:
            case ("P", now_tai_s):
                self._plan(now_tai_s)
            case ("S", now_tai_s) if self._planned is not None:
                self._buffer.set_plan(self._planned, now_tai_s)
            case ("U", now_tai_s):
                self._buffer.resume(now_tai_s)
            case ("B", now_tai_s, low_water_s):
                self._buffer.fill(now_tai_s, low_water_s)
            case ("A", now_tai_s):
                self._asked = self._buffer.request(now_tai_s)
                if len(self._asked.readings):
                    self._given.append(self._asked.readings)
            case ("F", answer):
                self._fitted(answer)
            case ("Z", _, has_died, _):
                self._failed(has_died=has_died)
            case ("E", _):
                self.is_ended = True
        if self._watcher is not None:
            self._watcher.told(record, self._now_tai_s)

    def _plan(self, now_tai_s: float) -> None:
        job = self._job
        if job.coming is not None:
            asked = plan_request(job.refit, job.control, job.coming, self.area.state, now_tai_s)
            self._planned = planned_pass(job.refit.propagator, job.refit.site, asked).plan

    # The line

    def _tick(
        self,
        now_tai_s: float,
        silence_s: float,
        has_room: bool,
        requests: tuple[Asking, ...],
        signal: SignalSample | None,
    ) -> None:
        self._look_for_unsent()
        self.tick_count += 1
        self._now_tai_s, self._done = now_tai_s, ""
        must_poll = self._job.driver.must_poll
        self._orders = self._decider.decide(
            now_tai_s, silence_s, requests, signal, must_poll=must_poll, has_room=has_room
        )
        if self._watcher is not None:
            self._watcher.ticked(self.area, now_tai_s, self._orders)

    def _look_for_unsent(self) -> None:
        """The daemon sends what is ordered beside the first command wherever that was answered."""
        orders = self._orders
        if orders is not None and orders.extra is not None and self._done == "1" and not self._job.driver.must_poll:
            self._differ("no second command", command_text(orders.extra))

    def _order(self, which: str) -> None:
        orders, self._done = self._orders, self._done + which
        if which == "n":
            self._mean(Poll())
        elif which == "1" and orders is not None:
            self._mean(orders.first)
        elif which == "2" and orders is not None and orders.extra is not None:
            self._mean(orders.extra)
        else:
            self._differ("a second command", "none")

    def _mean_of_stop(self, record: Record) -> None:
        """What is no question is STOP, and once that is acknowledged or not called for the end of the watchdog."""
        if record[0] == "Q":
            self._is_question = True
        elif record[0] == "X":
            if not self._is_question:
                self._mean(SetWatchdog(0.0) if self._is_stopped else Stop())
            self._is_question = False

    def _mean(self, command: Command) -> None:
        self._meant = self._next = command
        if isinstance(command, PointAndPoll) and not self._job.driver.capabilities.has_combined_write:
            self._next = PointAt(command.az_deg, command.el_deg)

    def _begin(self, started_s: float, started_tai_s: float, unread: bytes, frame: bytes) -> None:
        driver = self._job.driver
        if unread:
            driver.receive(unread, started_s)
        self._sent, self._started_s, self._ended_s = self._next, started_s, started_s
        self._answer = Arrival(self._meant, None, started_tai_s)
        self._first_byte_tai_s = None
        self.command_count += 1
        try:
            replayed = driver.begin(self._sent, started_s)
        except RuntimeError as error:
            self._differ(frame.hex(), f"none: {error}")
            return
        if replayed != frame:
            self._differ(frame.hex(), f"{replayed.hex()} ({command_text(self._sent)})")
        if not frame:
            self._answered(driver.receive(b"", started_s))

    def _receive(self, arrival_s: float, data: bytes) -> None:
        if self._answer is None:
            return
        if self._first_byte_tai_s is None:
            self._first_byte_tai_s = self._answer.started_tai_s + arrival_s - self._started_s
        self._ended_s = arrival_s
        self._answered(self._job.driver.receive(data, arrival_s))

    def _answered(self, reply: Reply | None) -> None:
        if reply is None or self._answer is None:
            return
        is_sure = self._job.driver.is_sure
        self._answer = replace(self._answer, reply=reply, first_byte_tai_s=self._first_byte_tai_s, is_sure=is_sure)
        is_acknowledged = isinstance(self._sent, Stop) and reply == Done()
        self._is_stopped = self._is_stopped or (self.is_ended and (is_acknowledged or is_left_alone(reply)))
        if isinstance(self._sent, PointAt) and isinstance(self._meant, PointAndPoll) and isinstance(reply, Done):
            self._next = Poll()

    def _hear(self) -> None:
        if self._answer is None:
            return
        heard = self._decider.hear(self._answer)
        if self._watcher is not None:
            self._watcher.heard(heard, self._answer, self._ended_s - self._started_s)

    def _differ(self, recorded: str, replayed: str) -> None:
        if self.difference is None:
            self.difference = Difference(self.tick_count, self._now_tai_s, recorded, replayed)

    # The fit

    def _fitted(self, answer: FitAnswer) -> None:
        request = self._asked
        if request is None:
            return
        self.fit_count += 1
        try:
            reply = self._anew(request) if self._fits_anew else self._as_recorded(request, answer)
        except OrbitError as error:
            self._differ("a fit", f"none: {error}")
            return
        self._buffer.take(reply)
        if self._watcher is not None:
            self._watcher.fitted(request, reply)

    def _as_recorded(self, request: RefitRequest, answer: FitAnswer) -> RefitReply:
        setup = self._job.refit
        used = before_fit(setup, request.now_tai_s) if answer.model is Model.LAST_PASS else answer.fit
        prediction = predict_from(setup, used, request, answer.model)
        return RefitReply(answer.fit, prediction, answer.notes, answer.model, answer.gate)

    def _anew(self, request: RefitRequest) -> RefitReply:
        if self._refitter is None:  # another process, which is given the pass's readings again
            self._refitter = Refitter(self._job.refit)
            if self._given:
                request = replace(request, readings=Readings.joined(self._given))
        return self._refitter.refit(request)

    def _failed(self, *, has_died: bool) -> None:
        if not self._fits_anew:
            return
        if has_died:
            self._refitter = None
        elif self._refitter is not None and self._asked is not None:
            with contextlib.suppress(OrbitError):
                self._refitter.refit(self._asked)
