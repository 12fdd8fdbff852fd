"""The links over a real TCP socket and a real pseudo terminal pair; no timing is asserted."""

import asyncio
import contextlib
import errno
import fcntl
import os
import socket
import subprocess
import sys
import termios
import threading
import tty
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
import serial
from unprivileged import as_nobody

from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.edge.arrivals import MAX_WAITING_BYTES, Arrivals
from acu_daemon.edge.link import check_rate, make_link, open_once
from acu_daemon.edge.serial_port import SerialLink
from acu_daemon.errors import LinkError, LinkRefusedError, UsageError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.pty import serve_pty

LONG_S = 300.0
Handler = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


async def read_bytes(link: object, count: int) -> bytes:
    data = b""
    while len(data) < count:
        chunk, _ = await link.read()  # type: ignore[attr-defined]
        data += chunk
    return data


async def tcp_server(handler: Handler) -> tuple[asyncio.Server, str]:
    server = await asyncio.start_server(handler, "127.0.0.1", 0)
    return server, f"tcp://127.0.0.1:{server.sockets[0].getsockname()[1]}"


async def test_bytes_go_both_ways_over_tcp_with_the_time_of_their_arrival() -> None:
    async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while data := await reader.read(100):
            writer.write(data.upper())
        writer.close()

    server, url = await tcp_server(echo)
    async with server:
        link = make_link(url, monotonic=lambda: 42.0)
        for _ in range(2):
            await link.open()
            link.write(b"hello")
            assert await read_bytes(link, 5) == b"HELLO"
            link.write(b"x")
            assert await link.read() == (b"X", 42.0)
            await link.close()


async def test_an_acu_held_by_another_client_is_told_from_a_lost_line() -> None:
    async def close_at_once(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.close()

    async def speak_and_close(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"x")
        writer.close()

    for handler, error, text in (
        (close_at_once, LinkRefusedError, "another client holds the ACU"),
        (speak_and_close, LinkError, "closed by the other side"),
    ):
        server, url = await tcp_server(handler)
        async with server:
            link = make_link(url)
            await link.open()
            with pytest.raises(error, match=text):
                while True:
                    await link.read()
            await link.close()


async def test_a_port_where_nobody_listens_is_refused_with_advice() -> None:
    server, url = await tcp_server(lambda reader, writer: asyncio.sleep(0))
    server.close()
    await server.wait_closed()
    with pytest.raises(LinkRefusedError, match="nobody listens"):
        await make_link(url).open()


@pytest.mark.parametrize("host", ["acu..local", "a" * 70])
async def test_a_name_that_is_none_is_a_link_error(host: str) -> None:
    with pytest.raises(LinkError, match="is no name of a host"):
        await make_link(f"tcp://{host}:3842").open()


class NameServer:
    """Looks names up like the system's until it hangs."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._look_up = socket.getaddrinfo
        self.may_answer = threading.Event()
        self.may_answer.set()
        self.waiting_count = 0
        monkeypatch.setattr(socket, "getaddrinfo", self.getaddrinfo)

    def getaddrinfo(self, *arguments: Any, **more: Any) -> Any:
        self.waiting_count += 1
        self.may_answer.wait(10.0)
        self.waiting_count -= 1
        return self._look_up(*arguments, **more)


def test_a_name_server_that_hangs_is_asked_once_and_holds_no_end_up(monkeypatch: pytest.MonkeyPatch) -> None:
    server = NameServer(monkeypatch)
    server.may_answer.clear()

    async def open_twice() -> None:
        link = make_link("tcp://acu.example:3842")
        for _ in range(2):
            with pytest.raises(LinkError, match="does not answer within 1 s"):
                await link.open()
        assert server.waiting_count == 1

    asyncio.run(open_twice())
    assert server.waiting_count == 1, "the end has waited for the name server"
    server.may_answer.set()


async def test_a_link_is_opened_again_while_the_name_server_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    async def accept(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.close()

    listener, url = await tcp_server(accept)
    server, link = NameServer(monkeypatch), make_link(url.replace("127.0.0.1", "localhost"))
    await link.open()
    await link.close()
    server.may_answer.clear()
    await link.open()
    await link.close()
    server.may_answer.set()
    listener.close()
    await listener.wait_closed()


def no_thread(_: threading.Thread) -> None:
    raise RuntimeError("can't start new thread")


@pytest.mark.parametrize(("host", "bracketed"), [("127.0.0.1", "127.0.0.1"), ("::1", "[::1]")])
async def test_an_address_needs_no_thread_and_no_name_server(
    host: str, bracketed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        server = await asyncio.start_server(lambda _, writer: writer.close(), host, 0)
    except OSError:
        pytest.skip(f"{host} is no address of this machine")
    async with server:
        link = make_link(f"tcp://{bracketed}:{server.sockets[0].getsockname()[1]}")
        monkeypatch.setattr(threading.Thread, "start", no_thread)
        await link.open()
        await link.close()


async def test_a_thread_that_cannot_be_made_is_a_failed_attempt_and_known_addresses_do_without(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0) as server:
        link = make_link(f"tcp://localhost:{server.sockets[0].getsockname()[1]}")
        with monkeypatch.context() as denied:
            denied.setattr(threading.Thread, "start", no_thread)
            with pytest.raises(LinkError, match="'localhost' cannot be looked up: can't start new thread"):
                await link.open()
        await link.open()
        await link.close()
        monkeypatch.setattr(threading.Thread, "start", no_thread)
        await link.open()
        await link.close()


@pytest.fixture
def many_addresses(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A name with three addresses, of which one is dead, one has nobody listening and one the ACU; those tried."""
    addresses, tried = ["192.0.2.1", "127.0.0.2", "127.0.0.1"], []
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: [(0, 0, 0, "", (one, 0)) for one in addresses])
    create = asyncio.BaseEventLoop.create_connection

    async def create_connection(loop: Any, make: Any, host: str, port: int) -> Any:
        tried.append(host)
        if host == "192.0.2.1":  # for documentation, RFC 5737
            now = loop.time
            monkeypatch.setattr(loop, "time", lambda: now() + 2.0 * LONG_S)
            await asyncio.Event().wait()
        if host == "127.0.0.2":
            raise ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused")
        return await create(loop, make, host, port)

    monkeypatch.setattr(asyncio.BaseEventLoop, "create_connection", create_connection)
    monkeypatch.setattr("acu_daemon.edge.tcp.CONNECT_TIMEOUT_S", LONG_S)  # no machine is too slow for the others
    return tried


async def test_each_address_of_a_name_has_its_own_time_and_the_one_that_answered_comes_first(
    many_addresses: list[str],
) -> None:
    async with await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0) as server:
        link = make_link(f"tcp://acu.example:{server.sockets[0].getsockname()[1]}")
        with pytest.raises(LinkError, match=r"does not answer within 300 s at 192\.0\.2\.1, one of 3 of its name"):
            await link.open()
        for _ in range(2):
            await link.open()
            await link.close()
    assert many_addresses == ["192.0.2.1", "127.0.0.2", "127.0.0.1", "127.0.0.1"]


async def test_who_opens_a_link_once_tries_every_address(many_addresses: list[str]) -> None:
    async with await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0) as server:
        link = make_link(f"tcp://acu.example:{server.sockets[0].getsockname()[1]}")
        await open_once(link)
        await link.close()
    many_addresses.clear()
    with pytest.raises(LinkError):
        await open_once(make_link("tcp://acu.example:1"))
    assert set(many_addresses) == {"192.0.2.1", "127.0.0.2", "127.0.0.1"}


async def test_of_a_line_that_babbles_only_the_newest_bytes_wait() -> None:
    arrivals = Arrivals()
    for k in range(100):
        arrivals.put(b"x" * 65536 + b"%02d" % k, float(k))
    waiting, arrival_s = await arrivals.get()
    assert len(waiting) <= MAX_WAITING_BYTES
    assert (waiting[-2:], arrival_s) == (b"99", 99.0)
    for k in range(2 * MAX_WAITING_BYTES):
        arrivals.put(b"y", float(k))
    newest = [await arrivals.get() for _ in range(MAX_WAITING_BYTES)]
    assert newest[-1] == (b"y", 2.0 * MAX_WAITING_BYTES - 1.0)


async def test_a_wait_ends_at_its_deadline_but_what_has_come_is_taken_even_after_it() -> None:
    arrivals, loop = Arrivals(), asyncio.get_running_loop()
    until_s = loop.time() + 0.02
    with pytest.raises(TimeoutError):
        await arrivals.get(until_s)
    assert loop.time() >= until_s
    arrivals.put(b"late", 1.0)
    assert await arrivals.get(until_s) == (b"late", 1.0)
    loop.call_soon(arrivals.put, b"next", 2.0)
    assert await arrivals.get() == (b"next", 2.0)


async def test_a_closed_link_says_so_and_closing_twice_is_harmless() -> None:
    for link in (make_link("tcp://127.0.0.1:1"), make_link("serial:///dev/null")):
        with pytest.raises(LinkError, match="not open"):
            link.write(b"x")
        await link.close()
        await link.close()


async def test_drained_input_is_never_read() -> None:
    async def speak(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"old")
        await reader.readexactly(1)
        writer.write(b"new")
        writer.close()

    server, url = await tcp_server(speak)
    async with server:
        link = make_link(url)
        await link.open()
        await link.read()
        link.drain_input()
        link.write(b"x")
        assert await read_bytes(link, 3) == b"new"
        await link.close()


class DeafAcu:
    """A listener whose client's bytes nobody reads until the test does; so much fits into no buffer on the way."""

    LOTS = bytes(range(256)) * 40_000

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.link = make_link(f"tcp://127.0.0.1:{self._listener.getsockname()[1]}")

    async def open(self) -> socket.socket:
        await self.link.open()
        client, _ = self._listener.accept()
        client.settimeout(10.0)
        return client

    @staticmethod
    def waiting_count(client: socket.socket) -> int:
        """Bytes that have arrived and wait to be read."""
        return int.from_bytes(fcntl.ioctl(client, termios.FIONREAD, bytes(4)), sys.byteorder)

    @staticmethod
    def read_to_the_end(client: socket.socket) -> tuple[int, bool]:
        """How much comes, and whether the end is a reset."""
        count = 0
        with client:
            while True:
                try:
                    data = client.recv(1_000_000)
                except ConnectionResetError:
                    return count, True
                if not data:
                    return count, False
                count += len(data)

    def close(self) -> None:
        self._listener.close()


@pytest.mark.parametrize("answered_count", [0, 1, 2])
async def test_what_was_not_sent_before_a_close_never_arrives_over_tcp(answered_count: int) -> None:
    acu = DeafAcu()
    client = await acu.open()
    for _ in range(answered_count):
        acu.link.write(b"poll")
        client.sendall(b"answer")
        await read_bytes(acu.link, 6)
        assert client.recv(4) == b"poll"
    acu.link.write(acu.LOTS)
    await acu.link.close()
    arrived_count = acu.waiting_count(client)
    assert arrived_count < len(acu.LOTS)
    count, is_reset = acu.read_to_the_end(client)
    assert count <= arrived_count
    assert is_reset
    again = await acu.open()
    acu.link.write(b"new")
    assert again.recv(100) == b"new"
    await acu.link.close()
    again.close()
    acu.close()


@pytest.mark.parametrize("write_count", [0, 1, 3])
async def test_a_close_after_the_last_answer_is_an_orderly_end(write_count: int) -> None:
    acu = DeafAcu()
    client = await acu.open()
    for _ in range(write_count):
        acu.link.write(b"stop")
        client.sendall(b"done")
        await read_bytes(acu.link, 4)
    await acu.link.close()
    assert acu.read_to_the_end(client) == (4 * write_count, False)
    acu.close()


class Pty:
    """A pseudo terminal pair; the test holds the master."""

    def __init__(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        self.slave = slave

    def close(self) -> None:
        os.close(self.slave)
        if self.master >= 0:
            os.close(self.master)

    def hang_up(self) -> None:
        os.close(self.master)
        self.master = -1


@pytest.fixture
def pty() -> object:
    pair = Pty()
    yield pair
    pair.close()


@pytest.mark.parametrize("options", ["", "?baud=19200&format=8N1"])
async def test_bytes_go_both_ways_over_a_pseudo_terminal(pty: Pty, options: str) -> None:
    link = make_link(f"serial://{pty.path}{options}", monotonic=lambda: 7.0)
    for _ in range(2):
        await link.open()
        every_byte = bytes(range(256))
        link.write(every_byte)
        assert os.read(pty.master, 300) == every_byte
        os.write(pty.master, every_byte)
        assert await link.read() == (every_byte, 7.0)
        await link.close()


async def test_a_write_larger_than_the_port_takes_goes_out_in_pieces(pty: Pty) -> None:
    link = make_link(f"serial://{pty.path}")
    await link.open()
    data = bytes(200_000)
    link.write(data)
    os.set_blocking(pty.master, False)
    got = 0
    while got < len(data):
        try:
            got += len(os.read(pty.master, 65536))
        except BlockingIOError:
            await asyncio.sleep(0)
    await link.close()


def drained(master: int) -> bytes:
    """All that has come out of the line by now."""
    os.set_blocking(master, False)
    data = b""
    with contextlib.suppress(BlockingIOError):
        while True:
            data += os.read(master, 65536)
    return data


async def test_what_a_serial_port_did_not_take_before_a_close_never_goes_out(pty: Pty) -> None:
    link = make_link(f"serial://{pty.path}")
    for _ in range(2):
        await link.open()
        link.write(bytes(200_000))
        await link.close()
        assert len(drained(pty.master)) < 200_000
        await link.open()
        await asyncio.sleep(0)
        link.write(b"new")
        assert drained(pty.master) == b"new"
        await link.close()


async def test_what_a_serial_port_took_but_has_not_sent_is_thrown_away_before_it_is_closed(
    pty: Pty, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pseudo terminal sends at once; a port at 9600 baud still holds a command for 20 ms."""
    done: list[str] = []
    discard, close = serial.Serial.reset_output_buffer, serial.Serial.close
    monkeypatch.setattr(serial.Serial, "reset_output_buffer", lambda port: (done.append("discard"), discard(port)))
    monkeypatch.setattr(serial.Serial, "close", lambda port: (done.append("close"), close(port)))
    link = make_link(f"serial://{pty.path}")
    await link.open()
    link.write(b"x")
    done.clear()
    await link.close()
    assert done[:2] == ["discard", "close"]


async def test_a_serial_line_that_hangs_up_is_a_link_error(pty: Pty) -> None:
    link = make_link(f"serial://{pty.path}")
    await link.open()
    pty.hang_up()
    with pytest.raises(LinkError, match="hung up"):
        await link.read()
    await link.close()


async def test_a_serial_port_is_opened_exclusively(pty: Pty) -> None:
    first, second = make_link(f"serial://{pty.path}"), make_link(f"serial://{pty.path}")
    await first.open()
    with pytest.raises(LinkRefusedError, match="another program"):
        await second.open()
    await first.close()
    await second.open()
    await second.close()


def open_as_another_user(path: str) -> str:
    """What a user without rights gets who opens it: "opened", or the error."""
    code = f"import os\ntry: os.open({path!r}, os.O_RDWR | os.O_NOCTTY); print('opened')\nexcept OSError as e: print(e)"
    done = subprocess.run([*as_nobody(), sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


async def test_while_the_link_is_open_no_other_user_can_open_the_port_and_afterwards_each_can(pty: Pty) -> None:
    Path(pty.path).chmod(0o666)
    link = make_link(f"serial://{pty.path}")
    assert open_as_another_user(pty.path) == "opened"
    await link.open()
    assert "Device or resource busy" in open_as_another_user(pty.path)
    await link.close()
    assert open_as_another_user(pty.path) == "opened"


async def test_a_simulated_port_that_a_killed_client_kept_to_itself_can_be_opened_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("acu_daemon.sim.pty.FREE_S", 0.01)
    async with serve_pty(lambda _send, _hang_up: Deaf(), FaultBoard(), tmp_path / "acu", 9600):
        device = str((tmp_path / "acu").readlink())
        Path(device).chmod(0o666)
        with open(device, "rb", 0) as client:  # noqa: PTH123
            fcntl.flock(client, fcntl.LOCK_EX)
            fcntl.ioctl(client, termios.TIOCEXCL)
            await asyncio.sleep(0.05)  # several looks
            assert "busy" in open_as_another_user(device)
        while "busy" in open_as_another_user(device):
            await asyncio.sleep(0)


class Deaf:
    """A peer that hears nothing."""

    def receive(self, data: bytes) -> None: ...

    def close(self) -> None: ...


async def test_who_holds_a_port_is_told_by_name(pty: Pty) -> None:
    code = f"import fcntl; f = open({pty.path!r}, 'rb', 0); fcntl.flock(f, fcntl.LOCK_EX); print('held'); input()"
    command = [sys.executable, "-uc", code]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        other.stdout.readline()
        with pytest.raises(LinkRefusedError, match=rf"held by another program \(python.*, process {other.pid}\)"):
            await make_link(f"serial://{pty.path}").open()
        other.kill()


async def test_a_program_that_reads_the_line_beside_us_is_told_and_not_called_an_unplugged_adapter(pty: Pty) -> None:
    link = make_link(f"serial://{pty.path}")
    await link.open()
    os.write(pty.master, b"stolen")
    assert os.read(pty.slave, 100) == b"stolen"
    link._on_readable()  # type: ignore[attr-defined]  # as when the loop was woken before
    with pytest.raises(LinkRefusedError, match="another program reads this line"):
        await link.read()
    await link.close()


async def test_what_was_drained_in_the_same_turn_is_no_other_programs_theft(pty: Pty) -> None:
    link = make_link(f"serial://{pty.path}")
    await link.open()
    link.drain_input()
    link._on_readable()  # type: ignore[attr-defined]
    os.write(pty.master, b"x")
    assert (await link.read())[0] == b"x"
    await link.close()


async def test_a_missing_port_is_named_with_a_hint(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="is the adapter plugged in"):
        await make_link(f"serial://{tmp_path}/ttyUSB9").open()


@pytest.mark.parametrize(
    ("step", "error"), [("_update_dtr_state", OSError(5, "EIO")), ("reset_input_buffer", termios.error(5, "EIO"))]
)
async def test_an_adapter_that_is_unplugged_while_it_is_opened_is_a_link_error(
    pty: Pty, step: str, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_port: serial.Serial) -> None:
        raise error

    link = make_link(f"serial://{pty.path}")
    with monkeypatch.context() as unplugged, pytest.raises(LinkError, match="EIO"):
        unplugged.setattr(serial.Serial, step, fail)
        await link.open()
    await link.open()
    await link.close()


@pytest.mark.parametrize(("text", "expected"), [("8N1", (8, "N")), ("7E1", (7, "E"))])
async def test_the_character_format_is_asked_of_the_port(
    text: str, expected: tuple[int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[object, ...]] = []

    def port(path: str, baud: int, bytesize: int, parity: str, **others: object) -> None:
        asked.append((path, baud, bytesize, parity, others["exclusive"]))
        raise serial.SerialException(errno.EACCES, "no")

    monkeypatch.setattr("acu_daemon.edge.serial_port.serial.Serial", port)
    with pytest.raises(LinkError, match="dialout"):
        await make_link(f"serial:///dev/ttyUSB7?format={text}&baud=38400").open()
    assert asked == [("/dev/ttyUSB7", 38400, *expected, True)]


async def test_a_pseudo_terminal_can_be_opened_again_and_again_with_seven_bits(pty: Pty) -> None:
    link = make_link(f"serial://{pty.path}?format=7E1")
    for _ in range(3):
        await link.open()
        await link.close()


@pytest.mark.parametrize(
    ("url", "text"),
    [
        ("udp://127.0.0.1:1", "expected tcp://"),
        ("tcp://127.0.0.1", "host and port"),
        ("tcp://127.0.0.1:99999", "host and port"),
        ("tcp://127.0.0.1:1/x", "host and port"),
        ("tcp://127.0.0.1:1?bauds=9600", "unknown option 'bauds'"),
        ("serial://ttyUSB0", "not absolute"),
        ("serial:///dev/ttyUSB0?baud=9601", "expected one of"),
        ("serial:///dev/ttyUSB0?format=8E2", "8N1 or 7E1"),
    ],
)
def test_a_link_that_is_not_understood_says_what_is_expected(url: str, text: str) -> None:
    with pytest.raises(UsageError, match=text):
        make_link(url)


def test_the_time_of_a_character_comes_from_the_baud_rate_named_in_the_url() -> None:
    assert make_link("tcp://acu:3842").byte_time_s == 0.0
    paced = make_link("tcp://acu:3842?baud=9600")
    assert paced.byte_time_s == pytest.approx(1.0417e-3, abs=1e-7)
    assert paced.description == "tcp://acu:3842?baud=9600"
    link = make_link("serial:///dev/ttyS0?baud=19200&format=7E1")
    assert isinstance(link, SerialLink)
    assert link.byte_time_s == pytest.approx(0.52083e-3, abs=1e-8)


def test_a_rate_that_cannot_carry_the_cycle_is_refused_with_the_arithmetic() -> None:
    check_rate(make_link("tcp://acu:3842"), Sa3842Driver(), 0.1, 0.010)
    check_rate(make_link("serial:///dev/ttyS0"), Sa3842Driver(), 0.1, 0.020)
    with pytest.raises(UsageError, match=r"46 characters of 2\.083 ms and 10 ms .* make 105\.8 ms, and only 95 ms"):
        check_rate(make_link("serial:///dev/ttyS0?baud=4800"), Sa3842Driver(), 0.1, 0.010)
