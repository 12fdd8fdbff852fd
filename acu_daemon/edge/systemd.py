"""What systemd is told and asks: readiness, watchdog and one line of status (sd_notify(3), sd_watchdog_enabled(3))."""

import contextlib
import os
import socket
from collections.abc import Mapping


class Notifier:
    """Sends datagrams to $NOTIFY_SOCKET; without one, and where it cannot be reached, nothing happens."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address  # '@': an abstract name
        self._socket: socket.socket | None = None

    def _opened(self) -> socket.socket | None:
        """The socket; None: there is nobody to tell, or the system denies it, and the next line tries again."""
        if self._address and self._socket is None:
            with contextlib.suppress(OSError):
                self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
                self._socket.setblocking(False)
        return self._socket

    def __call__(self, text: str) -> None:
        """Send assignments such as "READY=1", one a line.  Never blocks, never fails."""
        with contextlib.suppress(OSError):
            if (opened := self._opened()) is not None:
                opened.sendto(text.encode("utf-8", "replace"), self._address)

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
