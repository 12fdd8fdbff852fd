"""SIMULATION: which faults are present now.  Runs on the timers of the running loop, real or virtual."""

import asyncio
from collections.abc import Callable, Container
from random import Random

from acu_daemon.sim.fault_verbs import VERBS, Direction, Fault, FaultError, VerbName, fault_text

BOTH_WAYS: tuple[VerbName, ...] = ("wrong-baud", "nak")
AGAIN_S = 1.0  # a fault of an instant that happens more than once, without duration_s

Listener = Callable[[Fault, bool], None]


class _Entry:
    """A planned or present fault."""

    def __init__(self, number: int, fault: Fault) -> None:
        self.number, self.fault = number, fault
        self.random = Random(f"{fault.seed} {fault.verb} {number}")
        self.is_on = False
        self.hit_count = 0
        self.round_count = 0
        self.timer: asyncio.TimerHandle | None = None


class FaultBoard:
    """Faults are added, begin, end and are cleared; whoever acts them out listens, or asks at each frame.

    known: the verbs that are acted out here; None: all.
    """

    def __init__(self, known: Container[VerbName] | None = None) -> None:
        self._known = known
        self._loop = asyncio.get_running_loop()
        self._entries: dict[int, _Entry] = {}
        self._listeners: list[Listener] = []
        self._next_number = 1
        self.touches_frames = False  # whether any fault of frames is present

    def listen(self, listener: Listener) -> None:
        """Be told of every fault that lasts, True when it begins and False when it ends, and of those of an instant."""
        self._listeners.append(listener)

    def add(self, fault: Fault) -> int:
        """Plan a fault, start_s from now; return its number.  FaultError: nobody here can act it out."""
        if self._known is not None and fault.verb not in self._known:
            raise FaultError(f"{fault.verb}: this program and this link cannot do that")
        entry = _Entry(self._next_number, fault)
        self._next_number += 1
        self._entries[entry.number] = entry
        entry.timer = self._loop.call_later(fault.start_s, self._begin, entry)
        return entry.number

    def clear(self, what: int | VerbName | None = None) -> int:
        """End faults: one by its number, those of a verb, or all; return how many."""
        chosen = [e for e in self._entries.values() if what is None or what in (e.number, e.fault.verb)]
        for entry in chosen:
            self._remove(entry)
        return len(chosen)

    def lines(self) -> list[str]:
        """Every fault that is planned or present, for people."""
        return [
            f"{e.number} {'on' if e.is_on else 'planned'} hits={e.hit_count} {fault_text(e.fault)}"
            for e in self._entries.values()
        ]

    def is_on(self, verb: VerbName) -> bool:
        """Whether a fault of this verb is present."""
        return any(entry.is_on and entry.fault.verb == verb for entry in self._entries.values())

    def amount(self, verb: VerbName) -> float:
        """Value of the present fault of a verb; 0: there is none."""
        present = (e.fault.amount for e in self._entries.values() if e.is_on and e.fault.verb == verb)
        return next(present, 0.0)

    def strike(self, verb: VerbName, on: Direction) -> tuple[Fault, Random] | None:
        """A frame passes in a direction: the fault of this verb that hits it, with its own random numbers, or None."""
        for entry in self._entries.values():
            fault = entry.fault
            is_meant = entry.is_on and fault.verb == verb and (fault.on == on or verb in BOTH_WAYS)
            if is_meant and entry.random.random() < fault.probability:
                entry.hit_count += 1
                if entry.hit_count == fault.count:
                    self._remove(entry)
                return fault, entry.random
        return None

    def _begin(self, entry: _Entry) -> None:
        fault, kind = entry.fault, VERBS[entry.fault.verb].kind
        entry.round_count += 1
        if kind == "each":
            entry.is_on = True
            if fault.duration_s is not None:
                entry.timer = self._loop.call_later(fault.duration_s, self._remove, entry)
            self._look()
            return
        if entry.random.random() < fault.probability:
            entry.hit_count += 1
            entry.is_on = kind == "lasts"
            self._tell(fault, True)
        if kind == "once":
            self._next_round(entry, AGAIN_S if fault.duration_s is None else fault.duration_s)
        elif fault.duration_s is not None:
            entry.timer = self._loop.call_later(fault.duration_s, self._end, entry)

    def _end(self, entry: _Entry) -> None:
        self._leave(entry)
        self._next_round(entry, entry.fault.duration_s or 0.0)

    def _next_round(self, entry: _Entry, pause_s: float) -> None:
        if entry.round_count < entry.fault.count:
            entry.timer = self._loop.call_later(pause_s, self._begin, entry)
        else:
            self._remove(entry)

    def _leave(self, entry: _Entry) -> None:
        if entry.is_on:
            entry.is_on = False
            if VERBS[entry.fault.verb].kind == "lasts":
                self._tell(entry.fault, False)

    def _remove(self, entry: _Entry) -> None:
        if entry.timer is not None:
            entry.timer.cancel()
        self._entries.pop(entry.number, None)
        self._leave(entry)
        self._look()

    def _look(self) -> None:
        self.touches_frames = any(e.is_on and VERBS[e.fault.verb].kind == "each" for e in self._entries.values())

    def _tell(self, fault: Fault, is_on: bool) -> None:
        for listener in self._listeners:
            listener(fault, is_on)
