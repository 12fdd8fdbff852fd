"""SIMULATION of a serial adapter: a pseudo terminal behind a symbolic link, that can be pulled out and put back."""

import asyncio
import contextlib
import fcntl
import os
import socket
import termios
import tty
from collections.abc import AsyncIterator, Iterator
from hashlib import sha256
from pathlib import Path

from acu_daemon.errors import UsageError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import Fault, VerbName
from acu_daemon.sim.server import MakePeer, Peer

READ_BYTES = 4096
FREE_S = 0.5  # how soon a port that a killed client held for itself can be opened again
_TIOCGEXCL = 0x80045440  # tty_ioctl(4); not in termios
PTY_FAULTS: frozenset[VerbName] = frozenset({"cut", "deaf", "reset", "unplug"})


@contextlib.asynccontextmanager
async def serve_pty(make_peer: MakePeer, board: FaultBoard, link: Path, baud: int) -> AsyncIterator[str]:
    """Serve on a pseudo terminal found at a symbolic link; yields the URL.

    UsageError: the link cannot be made, or somebody else serves there.  One that a dead process left is replaced.
    """
    with _claim(link):
        jack = _Jack(make_peer, board, link)
        jack.plug_in()
        board.listen(jack.on_fault)
        try:
            yield f"serial://{jack.path}?baud={baud}"
        finally:
            jack.unplug()


@contextlib.contextmanager
def _claim(link: Path) -> Iterator[None]:
    """Own the place of a link while this process lives, by an abstract socket of its name."""
    place = link.parent.resolve() / link.name
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        try:
            claim.bind(f"\0acu-daemon/pty/{sha256(os.fsencode(place)).hexdigest()}")
        except OSError:
            raise UsageError(f"--pty {link} is served already; end who serves it, or choose another name") from None
        yield


class _Jack:
    """A pseudo terminal in the place of a serial adapter, that can be pulled out and put back."""

    def __init__(self, make_peer: MakePeer, board: FaultBoard, link: Path) -> None:
        self._make_peer, self._board, self._link = make_peer, board, link
        self._loop = asyncio.get_running_loop()
        self._master = self._slave = -1
        self._device = ""
        self._peer: Peer | None = None
        self._freeing: asyncio.TimerHandle | None = None

    @property
    def path(self) -> Path:
        """The link, which stays while the device behind it changes."""
        return self._link.absolute()

    def plug_in(self) -> None:
        """Open a terminal and put the link to it; we hold both ends, so that the line outlives its clients."""
        if self._link.exists() and not (self._link.is_symlink() and str(self._link.readlink()).startswith("/dev/pts/")):
            raise UsageError(f"--pty {self._link} exists and is no link to a pseudo terminal; choose another name")
        self._open()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        try:
            self._link.unlink(missing_ok=True)
            self._link.symlink_to(self._device)
        except OSError as error:
            self._close()
            raise UsageError(f"--pty {self._link} cannot be made: {error.strerror}") from None
        self._peer = self._make_peer(self._send, self._replug)
        self._listen()
        self._free()

    def _free(self) -> None:
        """Let others in once a client that kept them out (TIOCEXCL) has died: an adapter does so at its last close.

        Both of its locks are taken together, so that one without the other is a dead client's.
        """
        self._freeing = self._loop.call_later(FREE_S, self._free)
        if int.from_bytes(fcntl.ioctl(self._slave, _TIOCGEXCL, bytes(4)), "little"):
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(self._slave, fcntl.LOCK_EX | fcntl.LOCK_NB)
                fcntl.ioctl(self._slave, termios.TIOCNXCL)
                fcntl.flock(self._slave, fcntl.LOCK_UN)

    def _open(self) -> None:
        """Open a terminal whose name is not that of the last one: an adapter comes back under another name."""
        self._master, self._slave = os.openpty()
        if os.ttyname(self._slave) == self._device:
            same = self._master, self._slave
            self._master, self._slave = os.openpty()
            for descriptor in same:
                os.close(descriptor)
        self._device = os.ttyname(self._slave)

    def unplug(self) -> None:
        """Close the terminal: its client gets EIO; the link goes."""
        if self._master < 0:
            return
        self._loop.remove_reader(self._master)
        if self._freeing is not None:
            self._freeing.cancel()
        if self._peer is not None:
            self._peer.close()
        self._link.unlink(missing_ok=True)
        self._close()

    def _close(self) -> None:
        os.close(self._slave)
        os.close(self._master)
        self._master = self._slave = -1

    def _replug(self) -> None:
        self.unplug()
        self.plug_in()

    def _listen(self) -> None:
        if not self._board.is_on("deaf"):
            self._loop.add_reader(self._master, self._read)

    def _read(self) -> None:
        data = os.read(self._master, READ_BYTES)
        if self._peer is not None:
            self._peer.receive(data)

    def _send(self, piece: bytes) -> None:
        if self._master >= 0:
            with contextlib.suppress(BlockingIOError):  # nobody reads: lost, as on a wire
                os.write(self._master, piece)

    def on_fault(self, fault: Fault, is_on: bool) -> None:
        match fault.verb:
            case "unplug" if is_on:
                self.unplug()
            case "unplug":
                self.plug_in()
            case "reset" if self._master >= 0:
                self._replug()
            case "deaf" if self._master >= 0:
                if is_on:
                    self._loop.remove_reader(self._master)
                else:
                    self._listen()
