"""The ACU's bytes over a serial line: RS-232 or RS-422, or a pseudo terminal."""

import asyncio
import contextlib
import errno
import fcntl
import math
import os
import select
import termios
from collections.abc import Callable
from pathlib import Path

import serial

from acu_daemon.edge.arrivals import Arrivals
from acu_daemon.errors import LinkError, LinkRefusedError

READ_BYTES = 4096
PSEUDO_TERMINALS = "/dev/pts"  # they have neither parity nor 7 bits; the frames are 7-bit clean and need neither
CHARACTER_FORMATS = {"8N1": (serial.EIGHTBITS, serial.PARITY_NONE), "7E1": (serial.SEVENBITS, serial.PARITY_EVEN)}


class SerialLink:
    """A serial port, held exclusively; can be opened again after close().

    The lock keeps those out who ask for it, TIOCEXCL (tty_ioctl(4)) whoever opens the port from then on, but for root.
    """

    def __init__(self, path: str, baud: int, character_format: str, monotonic: Callable[[], float]) -> None:
        self._path, self._baud, self._format = path, baud, character_format
        self._monotonic = monotonic
        self.byte_time_s = 10.0 / baud
        self.description = f"serial://{path}?baud={baud}&format={character_format}"
        self._port: serial.Serial | None = None
        self._arrivals = Arrivals()
        self._unsent = b""
        self._is_drained = False  # in this turn of the loop: what it was woken for may be gone

    async def open(self) -> None:
        """Open the port exclusively.  LinkRefusedError: another program holds it; LinkError: there is no such port."""
        try:
            port = self._make_port()
        except OSError as error:  # also when it is unplugged just now
            raise self._open_error(error) from None
        except termios.error as error:
            raise LinkError(f"{self._path} cannot do {self._baud} baud {self._format}: {error.args[-1]}") from None
        self._port, self._arrivals, self._unsent = port, Arrivals(), b""
        asyncio.get_running_loop().add_reader(port.fileno(), self._on_readable)

    def _make_port(self) -> serial.Serial:
        bytesize, parity = CHARACTER_FORMATS["8N1" if _is_pseudo_terminal(self._path) else self._format]
        port = serial.Serial(self._path, self._baud, bytesize, parity, timeout=0, write_timeout=0, exclusive=True)
        try:
            with contextlib.suppress(ValueError):  # of pyserial: the driver has no such mode, as of a pseudo terminal
                port.set_low_latency_mode(True)  # an FTDI adapter otherwise adds 16 ms to every reply
            os.set_blocking(port.fileno(), False)
            fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
            port.reset_input_buffer()
        except BaseException:
            with contextlib.suppress(OSError):  # whoever keeps the port open, as a simulator does, keeps this too
                fcntl.ioctl(port.fileno(), termios.TIOCNXCL)
            port.close()
            raise
        return port

    def _open_error(self, error: OSError) -> LinkError:
        if error.errno in (errno.EAGAIN, errno.EBUSY):
            return LinkRefusedError(f"{self._path} is held by another program{self._who()}; stop it first")
        hint = {
            errno.ENOENT: "no such device; is the adapter plugged in?",
            errno.EACCES: "no permission; the user must be in the device's group, usually dialout",
        }.get(error.errno or 0, str(error))
        return LinkError(f"{self._path} cannot be opened: {hint}")

    def write(self, data: bytes) -> None:
        """Send; never waits, what the port does not take at once follows.  LinkError: the port is gone."""
        port = self._opened()
        self._unsent += data
        self._send_more(port)

    def _send_more(self, port: serial.Serial) -> None:
        loop = asyncio.get_running_loop()
        try:
            sent_count = os.write(port.fileno(), self._unsent)
        except BlockingIOError:
            sent_count = 0
        except OSError as error:
            loop.remove_writer(port.fileno())
            self._unsent = b""
            self._hang_up(error)
            return
        self._unsent = self._unsent[sent_count:]
        if self._unsent:
            loop.add_writer(port.fileno(), self._send_more, port)
        else:
            loop.remove_writer(port.fileno())

    async def read(self, until_s: float = math.inf) -> tuple[bytes, float]:
        """Wait for the next bytes and their arrival time.

        LinkError: the line hung up.  TimeoutError: nothing has come until then, on the loop's clock.
        """
        self._opened()
        return await self._arrivals.get(until_s)

    def drain_input(self) -> bytes:
        """Take what has arrived and was not read; what the port still holds is thrown away.  LinkError: not open."""
        port = self._opened()
        data = self._arrivals.take_all()
        with contextlib.suppress(OSError, termios.error):
            port.reset_input_buffer()
        if not self._is_drained:
            self._is_drained = True
            asyncio.get_running_loop().call_soon(self._end_drain)
        return data

    def _end_drain(self) -> None:
        self._is_drained = False

    async def close(self) -> None:
        """Close at once; what has not gone out never does."""
        port, self._port = self._port, None
        if port is None:
            return
        loop = asyncio.get_running_loop()
        loop.remove_reader(port.fileno())
        loop.remove_writer(port.fileno())
        with contextlib.suppress(OSError, termios.error):
            port.reset_output_buffer()
        with contextlib.suppress(OSError, termios.error):
            fcntl.ioctl(port.fileno(), termios.TIOCNXCL)  # it would outlive us while anybody else has the port open
        with contextlib.suppress(OSError, termios.error):
            port.close()

    def _on_readable(self) -> None:
        port = self._opened()
        try:
            data = os.read(port.fileno(), READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._hang_up(error)
            return
        if data:
            self._arrivals.put(data, self._monotonic())
        elif _is_hung_up(port.fileno()):
            self._hang_up(None)
        elif not self._is_drained:
            self._end(LinkRefusedError(f"{self._path}: another program reads this line{self._who()}; stop it first"))

    def _hang_up(self, error: OSError | None) -> None:
        reason = f" ({error.strerror})" if error else ""
        self._end(LinkError(f"{self._path} hung up{reason}: is the adapter still plugged in?"))

    def _end(self, error: LinkError) -> None:
        asyncio.get_running_loop().remove_reader(self._opened().fileno())
        self._arrivals.fail(error)

    def _who(self) -> str:
        """Which other processes have the port open, as far as this user may know."""
        named = ", ".join(f"{name}, process {pid}" for pid, name in others_with(Path(self._path)))
        return f" ({named})" if named else ""

    def _opened(self) -> serial.Serial:
        if self._port is None:
            raise LinkError(f"{self.description} is not open")
        return self._port


def _is_pseudo_terminal(path: str) -> bool:
    return Path(path).resolve().is_relative_to(PSEUDO_TERMINALS)


def _is_hung_up(descriptor: int) -> bool:
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return any(events & (select.POLLHUP | select.POLLERR | select.POLLNVAL) for _, events in poll.poll(0))


def others_with(path: Path) -> list[tuple[int, str]]:
    """Number and name of the other processes that have a file open, of those that this user may look into: proc(5)."""
    real, found = os.path.realpath(path), []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError), os.scandir(process / "fd") as files:  # another user's, or ended meanwhile
            is_open = any(os.readlink(one) == real for one in files)  # noqa: PTH115  a link such as pipe:[1] is no path
            if is_open and int(process.name) != os.getpid():
                found.append((int(process.name), (process / "comm").read_text(errors="replace").strip()))
    return found
