"""SIMULATION: a link to a fake ACU in memory, with the wire's times and faults, for virtual time."""

import asyncio
import math

from acu_daemon.drivers.sa3842.frame import MAX_DATA_BYTES
from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.edge.clock import Clock
from acu_daemon.errors import LinkError, LinkRefusedError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import Fault, VerbName
from acu_daemon.sim.line import AcuLine

SERIAL_GAP_S = 0.010
HELD = "another client holds the ACU"


class MemoryLink:
    """A Link whose other end is a FakeAcu.  The ACU executes a command its reply latency after the last byte came.

    is_cut: nothing passes in either direction, as with a pulled cable; is_refused: open() finds the ACU held.
    board: faults of the frames and of the line.
    """

    description = "memory link to a SIMULATION"

    def __init__(self, acu: FakeAcu, clock: Clock, byte_time_s: float = 0.0, board: FaultBoard | None = None) -> None:
        self._acu = acu
        self._clock = clock
        self.byte_time_s = byte_time_s
        self._line: AcuLine | None = None
        self._arrivals = Arrivals()
        self._board = board
        self._unread: list[tuple[AcuLine, bytes]] = []
        self._is_dead = self._is_seated = False
        self._taken_until_s = 0.0
        self.is_cut = False
        self.is_refused = False
        if board is not None:
            board.listen(self._on_fault)

    def _on_fault(self, fault: Fault, is_on: bool) -> None:
        if fault.verb == "half-open":
            self._is_dead = self._line is not None
        elif fault.verb == "deaf" and not is_on:
            unread, self._unread = self._unread, []
            for line, data in unread:
                line.receive(data)
        elif fault.verb in ("reset", "second-client", "unplug") and is_on and self._line is not None:
            self.hang_up()

    def _suffers(self, *verbs: VerbName) -> bool:
        return self._board is not None and any(self._board.is_on(verb) for verb in verbs)

    async def open(self) -> None:
        """Open.  LinkRefusedError: is_refused."""
        if self.is_refused:
            raise LinkRefusedError(f"{self.description}: {HELD}")
        if self._suffers("refuse"):
            raise LinkRefusedError(f"nobody listens at {self.description}")
        if self._suffers("unplug"):
            raise LinkError(f"{self.description} cannot be opened: no such device; is the adapter plugged in?")
        self._arrivals, self._is_dead = Arrivals(), False
        self._line = AcuLine(
            self._acu,
            self._clock,
            self._deliver,
            gap_s=SERIAL_GAP_S,
            byte_time_s=self.byte_time_s,
            piece_byte_count=MAX_DATA_BYTES,
            board=self._board,
        )
        is_taken = asyncio.get_running_loop().time() < self._taken_until_s
        self._is_seated = not is_taken and not self._suffers("accept-then-close", "second-client")
        if not self._is_seated:
            self._line.close()
            self._arrivals.fail(LinkRefusedError(f"{self.description} was closed at once: {HELD}"))

    def hang_up(self) -> None:
        """The far side closes."""
        self._opened().close()
        self._arrivals.fail(LinkError(f"{self.description} was closed by the other side"))

    def write(self, data: bytes) -> None:
        """Send; the bytes arrive one byte time after the other."""
        line = self._opened()
        if self._suffers("deaf"):
            self._unread.append((line, data))
        elif not self.is_cut and not self._is_dead:
            line.receive(data)

    def _deliver(self, piece: bytes) -> None:
        if not self.is_cut and not self._is_dead:
            self._arrivals.put(piece, self._clock.monotonic_s())

    async def read(self, until_s: float = math.inf) -> tuple[bytes, float]:
        """Wait for the next bytes and their arrival time.

        LinkError: the far side closed.  TimeoutError: nothing has come until then, on the loop's clock.
        """
        self._opened()
        return await self._arrivals.get(until_s)

    def drain_input(self) -> bytes:
        """Take what has arrived and was not read."""
        self._opened()
        return self._arrivals.take_all()

    async def close(self) -> None:
        """Close."""
        line, self._line = self._line, None
        if line is not None:
            line.close()
            if self._is_seated and self._suffers("slow-close") and self._board is not None:
                self._taken_until_s = asyncio.get_running_loop().time() + self._board.amount("slow-close")

    def _opened(self) -> AcuLine:
        if self._line is None:
            raise LinkError(f"{self.description} is not open")
        return self._line
