"""The addresses of a host's name, looked up beside the loop: a name server that hangs holds up neither loop nor end."""

import asyncio
import contextlib
import ipaddress
import socket
import threading

PATIENCE_S = 0.5  # then the addresses known from before are used: with the network its name server was lost too


class HostName:
    """One lookup at a time, in a thread that no exit waits for, as it would for one of the loop's own.

    An address needs neither lookup nor thread.
    """

    def __init__(self, host: str) -> None:
        self._host = host
        self._known: list[str] = []
        with contextlib.suppress(ValueError):
            self._known = [str(ipaddress.ip_address(host))]
        self._is_address = bool(self._known)
        self._lookup: asyncio.Future[list[str] | OSError] | None = None

    async def addresses(self) -> list[str]:
        """The addresses, the best one first.  OSError: none is known."""
        if self._is_address:
            return self._known
        lookup = self._lookup or self._begin()
        if lookup is None:
            return self._known
        await asyncio.wait({lookup}, timeout=PATIENCE_S if self._known else None)
        if lookup.done():
            found, self._lookup = lookup.result(), None
            if isinstance(found, list):
                self._known = found
            elif not self._known:
                raise found
        return self._known

    def _begin(self) -> "asyncio.Future[list[str] | OSError] | None":
        """Begin a lookup.  None: the system denies a thread for it, and addresses are known.  OSError: none are."""
        lookup: asyncio.Future[list[str] | OSError] = asyncio.get_running_loop().create_future()
        try:
            threading.Thread(target=self._look_up, args=(lookup,), name="host name", daemon=True).start()
        except RuntimeError as error:
            if self._known:
                return None
            raise OSError(f"{self._host!r} cannot be looked up: {error}") from None
        self._lookup = lookup
        return lookup

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
