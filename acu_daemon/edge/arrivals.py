"""What has arrived on a link and waits for its reader, with the time of its arrival."""

import asyncio
import math
from collections import deque

from acu_daemon.errors import LinkError

MAX_WAITING_BYTES = 1024  # a reply has 40 and a host reads at every tick; more is a babbling line: the oldest go first


class Arrivals:
    """Chunks of bytes with their arrival times; filled by a callback of the loop, read by one task."""

    def __init__(self) -> None:
        self._chunks: deque[tuple[bytes, float]] = deque()
        self._waiting_count = 0  # bytes
        self._error: LinkError | None = None
        self._something_came = asyncio.Event()
        self.has_had_any = False

    def put(self, data: bytes, arrival_s: float) -> None:
        """Take a chunk."""
        self.has_had_any = True
        newest = data[-MAX_WAITING_BYTES:]
        self._chunks.append((newest, arrival_s))
        self._waiting_count += len(newest)
        while self._waiting_count > MAX_WAITING_BYTES:
            self._take()
        self._something_came.set()

    def fail(self, error: LinkError) -> None:
        """The line is dead: what waits can still be read, then every read raises this error."""
        if self._error is None:
            self._error = error
            self._something_came.set()

    async def get(self, until_s: float = math.inf) -> tuple[bytes, float]:
        """Wait for the next chunk.  LinkError: the line is dead.  TimeoutError: none has come until then, loop time.

        A loop that comes late finds a chunk and the deadline side by side, and takes the chunk.
        """
        loop = asyncio.get_running_loop()
        while not self._chunks:
            if self._error is not None:
                raise type(self._error)(str(self._error))
            if loop.time() >= until_s:
                raise TimeoutError
            self._something_came.clear()
            timer = loop.call_at(until_s, self._something_came.set) if until_s < math.inf else None
            try:
                await self._something_came.wait()
            finally:
                if timer is not None:
                    timer.cancel()
        return self._take()

    def take_all(self) -> bytes:
        """What waits, at once."""
        if not self._chunks:
            return b""
        data = b"".join(chunk for chunk, _ in self._chunks)
        self._chunks.clear()
        self._waiting_count = 0
        return data

    def _take(self) -> tuple[bytes, float]:
        data, arrival_s = self._chunks.popleft()
        self._waiting_count -= len(data)
        return data, arrival_s
