"""SIMULATION of the ACU's end of a line: what arrives is executed after the reply latency, at the pace of the wire.

Runs on the timers of the running loop, real or virtual; knows nothing of sockets.
"""

import asyncio
from collections.abc import Callable

from acu_daemon.drivers.sa3842.codec import CommandDecoder, CommandEvent
from acu_daemon.edge.clock import Clock
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.frame_faults import FaultyWire


class AcuLine:
    """One line to a FakeAcu.  `send` takes a reply's first byte, then pieces of at most piece_byte_count bytes.

    byte_time_s is 10/baud, or 0 for a line without a pace of its own; gap_s is the pause that drops a frame.
    board: the faults of its frames.
    """

    def __init__(
        self,
        acu: FakeAcu,
        clock: Clock,
        send: Callable[[bytes], None],
        *,
        gap_s: float,
        byte_time_s: float = 0.0,
        piece_byte_count: int = 1,
        board: FaultBoard | None = None,
    ) -> None:
        self._acu = acu
        self._clock = clock
        self._send = send
        self._byte_time_s = byte_time_s
        self._piece_byte_count = piece_byte_count
        self._wire = None if board is None else FaultyWire(board, self._pace, self._on_wire)
        self._decoder = CommandDecoder(acu.address, gap_s)
        self._loop = asyncio.get_running_loop()
        self._input_free_s = self._output_free_s = self._loop.time()
        self._is_open = True

    def close(self) -> None:
        """What is still on its way arrives nowhere."""
        self._is_open = False

    def receive(self, data: bytes) -> None:
        """Take bytes that the host has written now."""
        if self._wire is None:
            self._on_wire(data)
        else:
            self._wire.from_host(data)

    def _on_wire(self, data: bytes) -> None:
        start_s = max(self._loop.time(), self._input_free_s)
        self._input_free_s = start_s + len(data) * self._byte_time_s
        self._loop.call_at(self._input_free_s, self._arrive, data, start_s)

    def _arrive(self, data: bytes, start_s: float) -> None:
        for i in range(len(data)):
            arrival_s = start_s + (i + 1) * self._byte_time_s
            for event in self._decoder.feed(data[i : i + 1], arrival_s):
                self._loop.call_later(self._acu.reply_latency_s, self._execute, event)

    def _execute(self, event: CommandEvent) -> None:
        if not self._is_open or not self._acu.is_powered:
            return
        reply = self._acu.execute(event, self._clock.tai_s())
        if self._wire is None:
            self._pace(reply)
        else:
            self._wire.from_acu(reply)

    def _pace(self, reply: bytes) -> None:
        if not self._is_open:
            return
        if self._byte_time_s == 0.0:
            self._send(reply)
            return
        start_s = max(self._loop.time(), self._output_free_s)
        self._output_free_s = start_s + len(reply) * self._byte_time_s
        first, step = 0, 1
        while first < len(reply):
            piece = reply[first : first + step]
            first, step = first + len(piece), self._piece_byte_count
            self._loop.call_at(start_s + first * self._byte_time_s, self._deliver, piece)

    def _deliver(self, piece: bytes) -> None:
        if self._is_open:
            self._send(piece)
