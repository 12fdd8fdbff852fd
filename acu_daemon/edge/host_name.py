"""The addresses of a host's name, looked up beside the loop: a name server that hangs holds up neither loop nor end."""

import asyncio
import contextlib
import socket
import threading

PATIENCE_S = 0.5  # then the addresses known from before are used: with the network its name server was lost too


class HostName:
    """One lookup at a time, in a thread that no exit waits for, as it would for one of the loop's own."""

    def __init__(self, host: str) -> None:
        self._host = host
        self._known: list[str] = []
        self._lookup: asyncio.Future[list[str] | OSError] | None = None

    async def addresses(self) -> list[str]:
        """The addresses, the best one first.  OSError: none is known."""
        if self._lookup is None:
            self._lookup = asyncio.get_running_loop().create_future()
            threading.Thread(target=self._look_up, args=(self._lookup,), name="host name", daemon=True).start()
        await asyncio.wait({self._lookup}, timeout=PATIENCE_S if self._known else None)
        if self._lookup.done():
            found, self._lookup = self._lookup.result(), None
            if isinstance(found, list):
                self._known = found
            elif not self._known:
                raise found
        return self._known

    def _look_up(self, lookup: "asyncio.Future[list[str] | OSError]") -> None:
        found: list[str] | OSError
        try:
            infos = socket.getaddrinfo(self._host, None, type=socket.SOCK_STREAM)
            found = list(dict.fromkeys(str(info[4][0]) for info in infos))
        except OSError as error:
            found = error
        except UnicodeError:
            found = OSError(f"{self._host!r} is no name of a host")
        with contextlib.suppress(RuntimeError):  # the loop has ended
            lookup.get_loop().call_soon_threadsafe(lookup.set_result, found)
