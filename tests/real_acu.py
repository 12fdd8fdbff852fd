"""A small ACU on TCP, built on the codec alone, that says it is a real one; it remembers what it was asked."""

import contextlib
import socket
import threading
from collections.abc import Iterator

from acu_daemon.acu.commands import AcuMode, Identify, Poll
from acu_daemon.drivers.sa3842.codec import CommandDecoder, encode_reply
from acu_daemon.drivers.sa3842.messages import (
    Ack,
    Command,
    Identity,
    Parameter,
    ReadParameter,
    ReadRegisters,
    RegisterContents,
    Reply,
    Status,
)

STANDING = Status(az_deg=100.0, el_deg=40.0, mode=AcuMode.STANDBY)


def answer(command: Command) -> Reply:
    match command:
        case Identify():
            return Identity("3842", "10")
        case Poll():
            return STANDING
        case ReadRegisters():
            return RegisterContents(STANDING.az_deg, STANDING.el_deg, 0, 0)
        case ReadParameter(name):
            return Parameter(name, 0)
    return Ack()


@contextlib.contextmanager
def real_acu() -> Iterator[tuple[str, list[Command]]]:
    """Serve one client; yields the URL, and the commands as they come."""
    asked: list[Command] = []

    def serve() -> None:
        with contextlib.suppress(OSError):  # the client, or the test, has gone
            client, _ = server.accept()
            with client:
                decoder = CommandDecoder(gap_s=1e9)
                while data := client.recv(4096):
                    for event in decoder.feed(data, 0.0):
                        assert event.command is not None
                        asked.append(event.command)
                        client.sendall(encode_reply(event.cmd, answer(event.command)))

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"tcp://127.0.0.1:{server.getsockname()[1]}", asked
        finally:
            server.shutdown(socket.SHUT_RDWR)
            thread.join()
