"""The newest text that another program keeps in a file or sends in UDP datagrams.  What it says is the caller's affair.

Datagrams are only kept as they come, the newest of each sender; whoever asks pays for reading them.
"""

import asyncio
import socket
from pathlib import Path
from typing import Any

LARGEST_BYTES = 10_000
MOST_SENDERS = 16


class NewestText:
    """Owned by the loop.  udp: ADDRESS:PORT of this machine; None: nobody sends, or keeps a file."""

    def __init__(self, udp: str | None, file: Path | None) -> None:
        self._udp, self._file = udp, file
        self._transport: asyncio.DatagramTransport | None = None
        self._datagrams: dict[str, bytes] = {}

    async def open(self) -> str:
        """Listen for datagrams, where asked; returns why that cannot be, empty: it is done."""
        if self._udp is None:
            return ""
        host, _, port = self._udp.rpartition(":")
        try:
            self._transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(
                lambda: _Newest(self), local_addr=(host.strip("[]"), int(port))
            )
        except (OSError, socket.gaierror, UnicodeError) as error:
            return getattr(error, "strerror", None) or str(error)
        return ""

    def close(self) -> None:
        if self._transport is not None:
            self._transport.close()

    def take(self, datagram: bytes, sender: str = "") -> None:
        """Keep a datagram."""
        if sender in self._datagrams or len(self._datagrams) < MOST_SENDERS:
            self._datagrams[sender] = datagram

    def newest(self) -> tuple[list[tuple[str, bytes]], str]:
        """What came since this was asked last, with its source, `udp` or `file`; and why the file cannot be read."""
        datagrams, self._datagrams = self._datagrams, {}
        found = [("udp", datagram) for datagram in datagrams.values()]
        problem = ""
        if self._file is not None:
            try:
                if self._file.exists() and not self._file.is_file():  # a pipe would keep its reader waiting
                    problem = f"{self._file}: expected a file"
                else:
                    with self._file.open("rb") as file:
                        found.append(("file", file.read(LARGEST_BYTES)))
            except OSError as error:
                problem = f"{self._file}: {error.strerror}"
        return found, problem


class _Newest(asyncio.DatagramProtocol):
    def __init__(self, reader: NewestText) -> None:
        self._reader = reader

    def datagram_received(self, data: bytes, address: Any) -> None:
        self._reader.take(data[:LARGEST_BYTES], str(address[0]))
