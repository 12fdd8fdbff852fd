"""The control channel of a running daemon: a Unix socket in its state directory, one line in, one line out.

The daemon answers `ok ...` or `error ...`.  Whoever may write to the socket may command: its owner and its group.
"""

import asyncio
import contextlib
import errno
import fcntl
import os
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.edge.denied import denied
from acu_daemon.errors import AcuDaemonError, NoDaemonError, UsageError

SOCKET = "control.sock"
MODE = 0o660
LONGEST_LINE = 256  # bytes
PATIENCE_S = 2.0  # with a client that says nothing, or does not read
MOST_CLIENTS = 8
MOST_AT_ONCE = 2  # clients let in by one turn of the loop: a hundred, asyncio's own measure, would make a tick late
ANSWER_S = 3.0
AGAIN_S = 0.01
NO_LOCK = -1
DISK_FAILS = (errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO)
SYSTEM_FAILS = (errno.EMFILE, errno.ENFILE, errno.ENOMEM, errno.ENOBUFS)


class ControlSocket:
    """Listens while the daemon runs; `answer` turns a line into the reply, at once."""

    def __init__(self, directory: Path, answer: Callable[[str, str], str]) -> None:
        """answer: of a line and of whose it is."""
        self._directory = directory
        self._answer = answer
        self._server: asyncio.Server | None = None
        self._lock = NO_LOCK
        self._client_count = 0

    async def open(self) -> None:
        """Begin to listen; where the disk or the system fails, go on without: the antenna matters more.

        UsageError: another daemon runs with this state directory, or no socket may be made in it.
        """
        self._lock = _lock(self._directory)
        path = self._directory / SOCKET
        try:
            listener = _listen(self._directory)
        except OSError as error:
            if error.errno not in (*DISK_FAILS, *SYSTEM_FAILS):
                await self.close()
                advice = "choose another place with --state DIR"
                raise UsageError(f"{path}: cannot be made: {error.strerror}; {advice}") from None
            log: Any = structlog.get_logger("control")
            what = "mend the disk" if error.errno in DISK_FAILS else "allow it more"
            advice = f"arm, disarm, clear and status cannot reach this daemon: {what}, then start it again"
            log.error("control.no_socket", file=str(path), reason=error.strerror, advice=advice)
            return
        self._server = await asyncio.start_unix_server(
            self._serve, sock=listener, limit=LONGEST_LINE, backlog=MOST_AT_ONCE
        )

    async def close(self) -> None:
        """Stop listening and take the socket away."""
        if self._server is not None:
            self._server.close()
            self._server = None
            with contextlib.suppress(OSError):  # the disk may be read-only by now
                (self._directory / SOCKET).unlink(missing_ok=True)
        if self._lock != NO_LOCK:
            os.close(self._lock)
            self._lock = NO_LOCK

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._client_count += 1
        try:
            async with asyncio.timeout(PATIENCE_S):
                is_many = self._client_count > MOST_CLIENTS
                reply = "error too many clients" if is_many else await self._reply(reader, _peer(writer))
                writer.write(f"{reply}\n".encode())
                await writer.drain()
        except (TimeoutError, OSError):
            pass
        finally:
            self._client_count -= 1
            writer.close()

    async def _reply(self, reader: asyncio.StreamReader, who: str) -> str:
        try:
            line = await reader.readline()
        except ValueError:  # longer than the limit
            return "error the line is too long"
        return self._answer(line.decode("ascii", "replace").strip(), who)


def _peer(writer: asyncio.StreamWriter) -> str:
    """The user at the other end, by number: a name may have to be asked for over the network."""
    peer: socket.socket | None = writer.get_extra_info("socket")
    if peer is None:
        return ""
    _, uid, _ = struct.unpack("3i", peer.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i")))
    return f"uid {uid} on this machine"


def ask(directory: Path, line: str) -> str:
    """Ask the daemon whose state directory this is; returns what stands behind `ok `.

    AcuDaemonError: no daemon, no permission, no answer, or an `error ...`; says what to do.
    """
    path = directory / SOCKET
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
            client.settimeout(ANSWER_S)
            _connect(client, directory)
            client.sendall(f"{line}\n".encode())
            reply = _read(client)
    except PermissionError:
        raise AcuDaemonError(f"{path}: not permitted; be root (sudo), its user or in its group") from None
    except (FileNotFoundError, NotADirectoryError, ConnectionRefusedError):
        raise NoDaemonError(no_daemon(directory)) from None
    except OSError as error:
        raise AcuDaemonError(f"{path}: the daemon does not answer: {error.strerror or error}") from None
    verdict, _, rest = reply.partition(" ")
    if verdict != "ok":
        raise AcuDaemonError(rest or f"{path}: the daemon gave no answer")
    return rest


def no_daemon(directory: Path) -> str:
    """That nobody is there, and what to do."""
    return (
        f"{directory}: no daemon runs with this state directory; name the --state it was started with "
        "(--rehearsal for `rehearse` and `run --at`), or start it: acu-daemon run"
    )


def is_answered(directory: Path) -> bool:
    """Whether a daemon listens there, be it one that this user may not ask."""
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client, _address(directory) as address:
            client.setblocking(False)
            client.connect(address)
    except (BlockingIOError, PermissionError):  # busy, or somebody else's
        return True
    except OSError:
        return False
    return True


def _connect(client: socket.socket, directory: Path) -> None:
    end_s = time.monotonic() + ANSWER_S
    with _address(directory) as address:
        while True:
            try:
                client.connect(address)
            except BlockingIOError:  # others wait to be let in
                if time.monotonic() > end_s:
                    raise
                time.sleep(AGAIN_S)
            else:
                return


def _read(client: socket.socket) -> str:
    parts = []
    while part := client.recv(65536):
        parts.append(part)
    return b"".join(parts).decode().strip()


@contextlib.contextmanager
def _address(directory: Path) -> Iterator[str]:
    """The socket's address by way of a descriptor of its directory: the path itself may be too long for one."""
    descriptor = os.open(directory, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{descriptor}/{SOCKET}"
    finally:
        os.close(descriptor)


def _lock(directory: Path) -> int:
    """Take the directory for this process alone, until the descriptor is closed, be it by SIGKILL.  UsageError."""
    try:
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        if error.errno in SYSTEM_FAILS:
            raise UsageError(denied(error)) from None
        raise UsageError(f"{directory}: {error.strerror}; choose another place with --state DIR") from None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise UsageError(
            f"{directory}: another daemon runs with this state directory; give each its own --state DIR"
        ) from None
    except OSError as error:
        os.close(descriptor)
        raise UsageError(
            f"{directory} cannot be locked: {error.strerror}; give it a local disk by --state DIR"
        ) from None
    return descriptor


def _listen(directory: Path) -> socket.socket:
    path = directory / SOCKET
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        path.unlink(missing_ok=True)
        before = os.umask(0o777 & ~MODE)
        try:
            with _address(directory) as address:
                listener.bind(address)
        finally:
            os.umask(before)
        listener.listen()
        listener.setblocking(False)
    except BaseException:
        listener.close()
        raise
    return listener
