"""What has arrived on a link and waits for its reader, with the time of its arrival."""

import asyncio
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

    async def get(self) -> tuple[bytes, float]:
        """Wait for the next chunk.  LinkError: the line is dead."""
        while not self._chunks:
            if self._error is not None:
                raise type(self._error)(str(self._error))
            self._something_came.clear()
            await self._something_came.wait()
        return self._take()

    def clear(self) -> None:
        """Throw away what waits."""
        self._chunks.clear()
        self._waiting_count = 0

    def _take(self) -> tuple[bytes, float]:
        data, arrival_s = self._chunks.popleft()
        self._waiting_count -= len(data)
        return data, arrival_s
