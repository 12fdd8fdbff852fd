"""SIMULATION: a link to a fake ACU in memory, with the wire's times, for virtual time."""

from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.edge.clock import Clock
from acu_daemon.errors import LinkError, LinkRefusedError
from acu_daemon.protocol.frame import MAX_DATA_BYTES
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.line import AcuLine

SERIAL_GAP_S = 0.010


class MemoryLink:
    """A Link whose other end is a FakeAcu.  The ACU executes a command its reply latency after the last byte came.

    is_cut: nothing passes in either direction, as with a pulled cable; is_refused: open() finds the ACU held.
    """

    description = "memory link to a SIMULATION"

    def __init__(self, acu: FakeAcu, clock: Clock, byte_time_s: float = 0.0) -> None:
        self._acu = acu
        self._clock = clock
        self.byte_time_s = byte_time_s
        self._line: AcuLine | None = None
        self._arrivals = Arrivals()
        self.is_cut = False
        self.is_refused = False

    async def open(self) -> None:
        """Open.  LinkRefusedError: is_refused."""
        if self.is_refused:
            raise LinkRefusedError(f"{self.description}: another client holds the ACU")
        self._arrivals = Arrivals()
        self._line = AcuLine(
            self._acu,
            self._clock,
            self._deliver,
            gap_s=SERIAL_GAP_S,
            byte_time_s=self.byte_time_s,
            piece_byte_count=MAX_DATA_BYTES,
        )

    def hang_up(self) -> None:
        """The far side closes."""
        self._opened().close()
        self._arrivals.fail(LinkError(f"{self.description} was closed by the other side"))

    def write(self, data: bytes) -> None:
        """Send; the bytes arrive one byte time after the other."""
        line = self._opened()
        if not self.is_cut:
            line.receive(data)

    def _deliver(self, piece: bytes) -> None:
        if not self.is_cut:
            self._arrivals.put(piece, self._clock.monotonic_s())

    async def read(self) -> tuple[bytes, float]:
        """Wait for the next bytes and their arrival time.  LinkError: the far side closed."""
        self._opened()
        return await self._arrivals.get()

    def drain_input(self) -> None:
        """Throw away what has arrived and was not read."""
        self._opened()
        self._arrivals.clear()

    async def close(self) -> None:
        """Close."""
        line, self._line = self._line, None
        if line is not None:
            line.close()

    def _opened(self) -> AcuLine:
        if self._line is None:
            raise LinkError(f"{self.description} is not open")
        return self._line
