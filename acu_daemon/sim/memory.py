"""SIMULATION: a link to a fake ACU in memory, with the wire's times, for virtual time."""

import asyncio

from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.edge.clock import Clock
from acu_daemon.errors import LinkError, LinkRefusedError
from acu_daemon.protocol.sa3842 import CommandDecoder, CommandEvent
from acu_daemon.sim.acu import FakeAcu


class MemoryLink:
    """A Link whose other end is a FakeAcu.  The ACU executes a command its reply latency after the last byte came.

    is_cut: nothing passes in either direction, as with a pulled cable; is_refused: open() finds the ACU held.
    """

    description = "memory link to a SIMULATION"

    def __init__(self, acu: FakeAcu, clock: Clock, byte_time_s: float = 0.0) -> None:
        self._acu = acu
        self._clock = clock
        self.byte_time_s = byte_time_s
        self._decoder = CommandDecoder(acu.address)
        self._arrivals: Arrivals | None = None
        self.is_cut = False
        self.is_refused = False

    async def open(self) -> None:
        """Open.  LinkRefusedError: is_refused."""
        if self.is_refused:
            raise LinkRefusedError(f"{self.description}: another client holds the ACU")
        self._arrivals = Arrivals()
        self._decoder = CommandDecoder(self._acu.address)

    def hang_up(self) -> None:
        """The far side closes."""
        self._opened().fail(LinkError(f"{self.description} was closed by the other side"))

    def write(self, data: bytes) -> None:
        """Send; the bytes arrive one byte time after the other."""
        self._opened()
        if not self.is_cut:
            asyncio.get_running_loop().call_later(len(data) * self.byte_time_s, self._arrive, data)

    def _arrive(self, data: bytes) -> None:
        for event in self._decoder.feed(data, self._clock.monotonic_s()):
            asyncio.get_running_loop().call_later(self._acu.reply_latency_s, self._execute, event)

    def _execute(self, event: CommandEvent) -> None:
        reply = self._acu.execute(event, self._clock.tai_s())
        if self.is_cut or self._arrivals is None:
            return
        loop, arrivals = asyncio.get_running_loop(), self._arrivals
        pieces = (reply[:1], reply[1:]) if self.byte_time_s else (reply,)
        arrived_count = 0
        for piece in pieces:
            arrived_count += len(piece)
            loop.call_later(arrived_count * self.byte_time_s, self._deliver, arrivals, piece)

    def _deliver(self, arrivals: Arrivals, piece: bytes) -> None:
        arrivals.put(piece, self._clock.monotonic_s())

    async def read(self) -> tuple[bytes, float]:
        """Wait for the next bytes and their arrival time.  LinkError: the far side closed."""
        return await self._opened().get()

    def drain_input(self) -> None:
        """Throw away what has arrived and was not read."""
        self._opened().clear()

    async def close(self) -> None:
        """Close."""
        self._arrivals = None

    def _opened(self) -> Arrivals:
        if self._arrivals is None:
            raise LinkError(f"{self.description} is not open")
        return self._arrivals
