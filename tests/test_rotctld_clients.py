"""Programs that speak to rotators, with their oddities: imitated on a socket, a case each, and Hamlib's own rotctl."""

import asyncio
import shutil
import socket
import subprocess
from dataclasses import dataclass, replace

import pytest
from test_rotctld_port import PEER, Bench

from acu_daemon.outlets.rotctld_lines import LONGEST_LINE_BYTES
from acu_daemon.outlets.rotctld_port import MOST_CLIENTS, MOST_UNREAD_BYTES, PlaceShown, _Client

PATIENCE_S = 60.0
MOST_RECV_BYTES = 128  # Gpredict's buffer
ANGLES = b"123.46\n45.68\n"
ROTCTL = shutil.which("rotctl")
needs_rotctl = pytest.mark.skipif(ROTCTL is None, reason="needs rotctl: apt-get install libhamlib-utils")


@dataclass(frozen=True)
class Client:
    """How a program speaks.  says: pieces as it sends them, with what its next recv is to give, None: it asks none.

    is_apart: each piece over a connection of its own; led: where the antenna is led by it; age_s: of the reading.
    """

    says: tuple[tuple[bytes, bytes | None], ...]
    led: tuple[tuple[float, float], ...] = ()
    is_apart: bool = False
    age_s: float = 0.1


CLIENTS = {
    "Gpredict takes both angles by one recv": Client(((b"p\n", ANGLES),)),
    "Gpredict writes two decimals, asks at once, and quits": Client(
        ((b"P 180.00 45.00\n", b"RPRT 0\n"), (b"p\n", ANGLES), (b"q\n", b"")), ((180.0, 45.0),)
    ),
    "Gpredict disengages after errors to p: a reading of nearly two seconds is none": Client(
        ((b"p\n", ANGLES),) * 6, age_s=1.9
    ),
    "SkyRoof takes exactly RPRT 0 and a line feed for P and for S": Client(
        ((b"P 180.5 45.5\n", b"RPRT 0\n"), (b"p\n", ANGLES), (b"S\n", b"RPRT 0\n")), ((180.5, 45.5),)
    ),
    "SatDump drops the link at its fourth unusable reply: there is none": Client(
        ((b"p\n", ANGLES), (b"P 10.0 20.0\n", b"RPRT 0\n")) * 5, ((10.0, 20.0),) * 5
    ),
    "SDRangel does not wait for the answer to P": Client(
        ((b"P 10.5 20.5\n", None), (b"p\n", b"RPRT 0\n" + ANGLES)), ((10.5, 20.5),)
    ),
    "SDRangel writes small angles with an exponent": Client(((b"P 1e-05 4.5e1\n", b"RPRT 0\n"),), ((1e-05, 45.0),)),
    "SDRangel has an error table of 18: what is refused is in it": Client(((b"P 10.0 95.0\n", b"RPRT -1\n"),)),
    "Look4Sat never reads": Client(((b"P 10.0 20.0\n", None),) * 20, ((10.0, 20.0),) * 20),
    "radiosonde_auto_rx connects anew for each command and keeps the lease": Client(
        ((b"P 10.0 20.0\n", b"RPRT 0\n"), (b"p\n", ANGLES), (b"P 11.0 21.0\n", b"RPRT 0\n")),
        ((10.0, 20.0), (11.0, 21.0)),
        is_apart=True,
    ),
    "lines that end in CR LF, and empty ones before": Client(((b"p\r\n", ANGLES), (b"\n\np\n", ANGLES))),
}


async def opened() -> tuple[Bench, int]:
    bench = Bench()
    await bench.port.open("127.0.0.1", 0)
    return bench, int(bench.port.address.rsplit(":", 1)[1])


def connected(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), PATIENCE_S)


def talked(one: socket.socket, client: Client) -> list[bytes]:
    """What a program takes; what it is sent in answers to pieces that it did not wait for may come in parts."""
    taken, is_behind = [], False
    for said, wanted in client.says:
        one.sendall(said)
        is_behind = is_behind or wanted is None
        if wanted is not None:
            got = one.recv(MOST_RECV_BYTES)
            while is_behind and got and len(got) < len(wanted):
                got += one.recv(MOST_RECV_BYTES)
            taken.append(got)
    return taken


@pytest.mark.parametrize("name", CLIENTS)
async def test_a_program_gets_what_it_depends_on(name: str) -> None:
    client, (bench, port) = CLIENTS[name], await opened()
    bench.antenna.at = PlaceShown(123.456, 45.678, client.age_s)
    bench.grant()
    parts = [replace(client, says=(one,)) for one in client.says] if client.is_apart else [client]
    taken: list[bytes] = []
    async with asyncio.timeout(PATIENCE_S):
        for part in parts:
            with connected(port) as one:
                taken += await asyncio.to_thread(talked, one, part)
                while sum(led[0] is not None for led in bench.antenna.led) < len(client.led) and part is parts[-1]:
                    await asyncio.sleep(0)
    assert taken == [wanted for _, wanted in client.says if wanted is not None]
    assert tuple(led[:2] for led in bench.antenna.led if led[0] is not None) == client.led
    assert bench.antenna.stops == []
    await bench.port.close()


async def one_recv(port: int, line: bytes) -> bytes:
    """One send, one recv, close."""
    with connected(port) as one:
        return (await asyncio.to_thread(talked, one, Client(((line, b""),))))[0]


async def test_a_line_that_is_too_long_is_not_cut_to_another_command() -> None:
    bench, port = await opened()
    bench.grant()
    assert await one_recv(port, b"P 10 4".ljust(LONGEST_LINE_BYTES - 1) + b" 5 6 7\n") == b""
    assert bench.antenna.led == []
    await bench.port.close()


async def test_commands_in_pieces_and_several_in_a_piece_are_served_in_order() -> None:
    bench, port = await opened()
    bench.grant()
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    for piece in (b"P", b" 10", b"0.0 4", b"5\n", b"p\nP 1", b"e1 5\r\n_\n"):
        writer.write(piece)
        await writer.drain()
        await asyncio.sleep(0.01)
    async with asyncio.timeout(PATIENCE_S):
        told = [await reader.readline() for _ in range(5)]
    assert told == [b"RPRT 0\n", b"123.46\n", b"45.68\n", b"RPRT 0\n", b"acu-daemon\n"]
    assert [led[:2] for led in bench.antenna.led] == [(100.0, 45.0), (10.0, 5.0)]
    writer.write(b"q\n")
    async with asyncio.timeout(PATIENCE_S):
        assert await reader.read() == b""
    writer.close()
    await bench.port.close()


async def test_who_never_reads_is_obeyed_and_its_answers_are_dropped() -> None:
    bench, port = await opened()
    bench.grant()
    with socket.create_connection(("127.0.0.1", port)) as deaf:
        deaf.setblocking(False)
        for k in range(1500):
            try:
                deaf.sendall(b"P %d 10\n1\n" % (k % 90))
            except BlockingIOError:
                await asyncio.sleep(0.001)
            await asyncio.sleep(0.001 if k % 20 == 0 else 0.0)
        assert await one_recv(port, b"p\n") == b"123.46\n45.68\n"
    assert len(bench.antenna.led) > 1000
    await bench.port.close()


def test_answers_for_who_does_not_read_are_not_kept() -> None:
    bench = Bench()
    client = _Client(bench.port)
    transport = Unread()
    client.connection_made(transport)
    for _ in range(10_000):
        client.data_received(b"p\n")
    assert transport.get_write_buffer_size() < 2 * MOST_UNREAD_BYTES
    client.drop()
    assert transport.is_aborted


class Unread(asyncio.Transport):
    """A connection whose other end does not read."""

    def __init__(self) -> None:
        super().__init__({"peername": (PEER, 1)})
        self._waiting = b""
        self.is_aborted = False

    def write(self, data: bytes | bytearray | memoryview) -> None:
        self._waiting += bytes(data)

    def get_write_buffer_size(self) -> int:
        return len(self._waiting)

    def abort(self) -> None:
        self.is_aborted = True


async def test_a_flood_a_line_without_end_and_too_many_clients_make_room_for_others() -> None:
    bench, port = await opened()
    crowd = [await asyncio.open_connection("127.0.0.1", port) for _ in range(MOST_CLIENTS + 8)]
    for flood in (b"p\n" * 5000, b"x" * 5000):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(flood)
        async with asyncio.timeout(PATIENCE_S):
            while await reader.read(1000):
                pass
        writer.close()
    assert await one_recv(port, b"p\n") == b"123.46\n45.68\n"
    assert len(bench.port._clients) <= MOST_CLIENTS
    for _, writer in crowd:
        writer.close()
    await bench.port.close()


async def test_an_address_that_is_taken_is_told_and_nothing_else_happens() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        bench = Bench()
        await bench.port.open("127.0.0.1", taken.getsockname()[1])
        assert bench.port.address == ""
        await bench.port.close()


# Hamlib's own client


async def rotctl(port: int, *words: str) -> tuple[int, str]:
    """`rotctl -m 2`, Hamlib's network model, with one command."""

    def talk() -> tuple[int, str]:
        command = ["rotctl", "-m", "2", "-r", f"127.0.0.1:{port}", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
        return done.returncode, done.stdout + done.stderr

    return await asyncio.to_thread(talk)


@needs_rotctl
@pytest.mark.realtime
async def test_every_command_of_hamlibs_rotctl_is_understood() -> None:
    bench, port = await opened()
    assert "123.46" in (await rotctl(port, "p"))[1]
    code, told = await rotctl(port, "P", "10", "20")
    assert "rejected" in told or code != 0
    bench.grant()
    for words, led in ((("P", "200.5", "30.25"), (200.5, 30.25)), (("K",), (0.0, 80.0))):
        code, told = await rotctl(port, *words)
        assert (code, told) == (0, "")
        assert bench.antenna.led[-1][:2] == led
    assert await rotctl(port, "S") == (0, "")
    assert bench.antenna.led[-1][:2] == (None, None)
    assert "acu-daemon" in (await rotctl(port, "_"))[1]
    for words in (("R", "1"), ("M", "8", "50")):
        code, told = await rotctl(port, *words)
        assert "not implemented" in told.lower() or "not available" in told.lower() or code != 0
    assert (await rotctl(port, "1"))[0] == 0
    assert (await rotctl(port, "dump_state"))[0] == 0
    assert bench.antenna.stops == []
    await bench.port.close()
