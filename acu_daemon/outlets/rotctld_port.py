"""A port that programs for rotators speak to: they read where the antenna points, and lead it by the write lease.

Reading is free.  P and K need the lease, which a person gives to a program's address; connecting gives none.  S always
stops.  Who does not read has its answers dropped; who floods the port or says nothing makes room for others.
"""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import structlog

from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.outlets.rotctld_lines import (
    INVALID,
    IO_ERROR,
    LONGEST_LINE_BYTES,
    NOT_IMPLEMENTED,
    OK,
    REJECTED,
    Command,
    RotctlVerb,
    dumped_state,
    reply_of,
    understood_line,
)

MOST_CLIENTS = 16
MOST_UNREAD_BYTES = 4096
MOST_LINES = 50  # of one piece: more is a flood
OLD_S = 2.0  # an older reading is none
STOP_AGAIN_S = 1.0


@dataclass(frozen=True, slots=True)
class PlaceShown:
    """Where the antenna was measured, and how long ago; state: what steers, in a word."""

    az_deg: float
    el_deg: float
    age_s: float
    state: str = ""


class AntennaBeside(Protocol):
    """What the port sees of the daemon, and asks of it."""

    def place(self) -> PlaceShown | None:
        """Where the antenna is; None: nobody knows."""

    def limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Least and most of azimuth, over all turns, and of elevation."""

    def park_deg(self) -> tuple[float, float] | None:
        """Where it is parked; None: nowhere."""

    def lead(self, az_deg: float | None, el_deg: float | None, lasts_s: float, by: str) -> str:
        """Lead the antenna; returns why not, empty: it is.  None: let it stand."""

    def stop(self, who: str) -> None:
        """STOP, at once."""


def key_of(address: str) -> str:
    """The lease's key of a program: its address, so that it may connect anew for each command."""
    return f"rotctl {address}"


class RotctldPort:
    """Owned by the loop."""

    def __init__(
        self, antenna: AntennaBeside, lease: WriteLease, now_s: Callable[[], float], *, may_anyone_stop: bool = True
    ) -> None:
        """may_anyone_stop: S stops the antenna whoever says it; else only who has the lease stops anything by it."""
        self._antenna, self._lease, self._now_s = antenna, lease, now_s
        self._may_anyone_stop = may_anyone_stop
        self._server: asyncio.Server | None = None
        self._clients: list[_Client] = []
        self._stopped_s: dict[str, float] = {}
        self._leading = ""  # the key whose word the antenna follows
        self._log: Any = structlog.get_logger("rotctld")
        self.address = ""

    async def open(self, host: str, port: int) -> None:
        """Listen; where that cannot be, it is told, and no reason not to track."""
        try:
            loop = asyncio.get_running_loop()
            self._server = await loop.create_server(lambda: _Client(self), host, port, backlog=MOST_CLIENTS)
        except OSError as error:
            self._log.error("rotctld.not_open", address=f"{host}:{port}", reason=error.strerror or str(error))
            return
        bound = self._server.sockets[0].getsockname()
        self.address = f"{bound[0]}:{bound[1]}"
        self._log.info("rotctld.open", address=self.address)

    async def close(self) -> None:
        if self._server is not None:
            self._server.close()
        for client in list(self._clients):
            client.drop()

    def look(self) -> None:
        """Look after a tick whether the program that leads the antenna has the lease still."""
        held = self._lease.held
        if self._leading and (held is None or held.claim.key != self._leading):
            self._leading = ""
            self._antenna.lead(None, None, 0.0, "")

    # Clients

    def came(self, client: "_Client") -> None:
        """A client has connected; the one that has been silent the longest goes where there are too many."""
        self._clients.append(client)
        if len(self._clients) > MOST_CLIENTS:
            min(self._clients, key=lambda one: one.heard_s).drop()

    def went(self, client: "_Client") -> None:
        if client in self._clients:
            self._clients.remove(client)

    @property
    def now_s(self) -> float:
        return self._now_s()

    def answer(self, line: bytes, peer: str) -> bytes | None:
        """What a line is answered, empty: nothing is; None: the client goes."""
        command = understood_line(line)
        match command.verb:
            case RotctlVerb.NOTHING:
                return b""
            case RotctlVerb.QUIT:
                return None
            case RotctlVerb.GET_POSITION | RotctlVerb.EASYCOMM_GET:
                return self._position(command)
            case RotctlVerb.SET_POSITION:
                return reply_of(command, self._lead(command.values, peer))
            case RotctlVerb.EASYCOMM_SET:
                self._lead(command.values, peer)
                return b""
            case RotctlVerb.PARK:
                park = self._antenna.park_deg()
                return reply_of(command, NOT_IMPLEMENTED if park is None else self._lead(park, peer))
            case RotctlVerb.STOP:
                self._stop(peer)
                return reply_of(command, OK)
            case RotctlVerb.EASYCOMM_STOP:
                self._stop(peer)
                return b""
            case RotctlVerb.DUMP_STATE:
                return dumped_state(*self._antenna.limits())
            case RotctlVerb.GET_INFO:
                return reply_of(command, OK, (("Info", "acu-daemon"),))
            case RotctlVerb.STATUS:
                place = self._antenna.place()
                return reply_of(command, OK, (("Status", place.state if place is not None else "not known"),))
            case RotctlVerb.DUMP_CAPS:
                return self._caps(command)
            case RotctlVerb.NOT_THERE:
                return reply_of(command, NOT_IMPLEMENTED)
        return b"" if command.name == "easycomm" else reply_of(command, INVALID)

    def _position(self, command: Command) -> bytes:
        place = self._antenna.place()
        is_known = place is not None and place.age_s <= OLD_S
        if command.verb is RotctlVerb.EASYCOMM_GET:
            return f"AZ{place.az_deg:.1f} EL{place.el_deg:.1f}\n".encode() if place is not None and is_known else b""
        if place is None or not is_known:
            return reply_of(command, IO_ERROR)
        return reply_of(command, OK, (("Azimuth", f"{place.az_deg:.2f}"), ("Elevation", f"{place.el_deg:.2f}")))

    def _caps(self, command: Command) -> bytes:
        (least_az, most_az), (least_el, most_el) = self._antenna.limits()
        values = (
            *(("Model name", "acu-daemon"), ("Rot type", "Az-El")),
            *(("Min Azimuth", f"{least_az:.2f}"), ("Max Azimuth", f"{most_az:.2f}")),
            *(("Min Elevation", f"{least_el:.2f}"), ("Max Elevation", f"{most_el:.2f}")),
        )
        plain = Command(command.verb, (), command.name, command.mark or "\n")
        return reply_of(plain, OK, values)

    def _lead(self, values: tuple[float, ...], peer: str) -> int:
        """Lead the antenna to angles; azimuth is a bearing, of which the limits choose the turn."""
        az_deg, el_deg = values
        key = key_of(peer)
        if not self._lease.use(key):
            return REJECTED
        (_, _), (least_el, most_el) = self._antenna.limits()
        if not -180.0 <= az_deg <= 540.0 or not least_el <= el_deg <= most_el:
            return INVALID
        held = self._lease.held
        by = peer if held is None else held.claim.reason or peer
        why = self._antenna.lead(az_deg, el_deg, self._lease.left_s(), by)
        if why:
            self._log.info("rotctld.refused", peer=peer, reason=why)
            return REJECTED
        self._leading = key
        return OK

    def _stop(self, peer: str) -> None:
        """Who has the lease has the antenna stand, and keeps it; all others stop it altogether, where they may."""
        key = key_of(peer)
        held = self._lease.held if self._lease.use(key) else None
        if held is not None:
            if not self._antenna.lead(None, None, self._lease.left_s(), held.claim.reason or peer):
                self._leading = key
        elif self._may_anyone_stop and self._now_s() - self._stopped_s.get(peer, float("-inf")) >= STOP_AGAIN_S:
            self._stopped_s = {peer: self._now_s()}
            self._antenna.stop(f"rotctl from {peer}")


class _Client(asyncio.Protocol):
    """One connection."""

    def __init__(self, port: RotctldPort) -> None:
        self._port = port
        self._transport: asyncio.Transport | None = None
        self._peer = ""
        self._rest = b""
        self.heard_s = port.now_s

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport if isinstance(transport, asyncio.Transport) else None
        self._peer = str(transport.get_extra_info("peername", ("",))[0])
        self._port.came(self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._port.went(self)

    def data_received(self, data: bytes) -> None:
        self.heard_s = self._port.now_s
        *lines, self._rest = (self._rest + data).split(b"\n")
        if max(map(len, (*lines, self._rest))) > LONGEST_LINE_BYTES or len(lines) > MOST_LINES:
            self.drop()  # a line that is cut would be another command
            return
        for line in lines:
            answer = self._port.answer(line, self._peer)
            if answer is None:
                self.drop()
                return
            if answer and self._transport is not None and self._transport.get_write_buffer_size() < MOST_UNREAD_BYTES:
                self._transport.write(answer)

    def drop(self) -> None:
        """Close the connection."""
        self._port.went(self)
        if self._transport is not None and self._transport.get_write_buffer_size():
            self._transport.abort()  # it does not read
        elif self._transport is not None:
            self._transport.close()
