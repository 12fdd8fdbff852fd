"""Virtual time: an asyncio loop whose clock jumps to the next timer when nothing else is left to do.

No threads, no sockets, no signals: a fifteen-minute pass takes seconds and runs the same, bit for bit, every time.
"""

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class StandstillError(RuntimeError):
    """Every task waits, and no timer will ever wake one."""


class _Jump:
    """Stands where a loop's selector stands; instead of waiting it moves the loop's clock to the next timer."""

    def __init__(self, loop: "VirtualTimeLoop") -> None:
        self._loop = loop

    def select(self, timeout_s: float | None) -> list[Any]:
        if timeout_s is None:
            raise StandstillError("every task waits for something that no timer brings: virtual time stands still")
        if timeout_s > 0:
            self._loop.jump()
        return []


class VirtualTimeLoop(asyncio.BaseEventLoop):
    """An event loop on virtual time, beginning at start_s."""

    _scheduled: list[asyncio.TimerHandle]

    def __init__(self, start_s: float = 0.0) -> None:
        super().__init__()
        self._now_s = start_s
        self._selector = _Jump(self)

    def time(self) -> float:
        """Virtual seconds."""
        return self._now_s

    def jump(self) -> None:
        """Move the clock to the next timer."""
        self._now_s = max(self._now_s, self._scheduled[0].when())

    def _process_events(self, event_list: list[Any]) -> None:
        """There are none: nothing reads or writes a file here."""

    def _write_to_self(self) -> None:
        """Nothing to wake: select never sleeps."""


def run_virtual(main: Coroutine[Any, Any, T], start_s: float = 0.0) -> T:
    """Run a coroutine in virtual time and return its result.  StandstillError: it would wait for ever."""
    with asyncio.Runner(loop_factory=lambda: VirtualTimeLoop(start_s)) as runner:
        return runner.run(main)
