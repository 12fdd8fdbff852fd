"""Faults on real sockets and pseudo terminals: the simulated ACU's own line, and the fault proxy before it."""

import asyncio
import contextlib
import os
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Star

from acu_daemon.acu.commands import AcuMode, Poll
from acu_daemon.drivers.sa3842.codec import encode_command
from acu_daemon.drivers.sa3842.exchange import HostExchange
from acu_daemon.drivers.sa3842.messages import Status, WriteAndPoll
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.link import Link, make_link
from acu_daemon.errors import LinkError, LinkRefusedError, UsageError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.acu_faults import break_acu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_control import serve_control
from acu_daemon.sim.fault_verbs import parse_fault
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.proxy import proxy_peer
from acu_daemon.sim.pty import serve_pty
from acu_daemon.sim.scenario import AcuChoice, Scenario
from acu_daemon.sim.server import acu_peer, serve_tcp

BAUD = 115200
PATIENCE_S = 10.0


class Bench:
    """A served line with its board, a link to it, and what it counts."""

    def __init__(self, url: str, board: FaultBoard, acu: FakeAcu) -> None:
        self.url, self.board, self.acu = url, board, acu
        self.link: Link = make_link(url)

    async def breaks(self, text: str) -> None:
        self.board.add(parse_fault(text))
        await asyncio.sleep(0.02)

    async def answers(self) -> Status:
        """Open, if need be, and ask once."""
        host = HostExchange()
        async with asyncio.timeout(PATIENCE_S):
            self.link.write(host.begin(Poll(), 0.0))
            while True:
                reply = host.receive((await self.link.read())[0], 0.0)
                if isinstance(reply, Status):
                    return reply

    async def is_silent(self) -> bool:
        try:
            async with asyncio.timeout(0.3):
                await self.answers()
        except TimeoutError:
            return True
        return False

    async def reopens(self) -> Status:
        """Close, open until it works, and ask once."""
        await self.link.close()
        async with asyncio.timeout(PATIENCE_S):
            while True:
                try:
                    await self.link.open()
                    return await self.answers()
                except LinkError:
                    await self.link.close()
                    await asyncio.sleep(0.05)


Place = Callable[[Path], contextlib.AbstractAsyncContextManager[Bench]]


def make_acu() -> FakeAcu:
    scenario = Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0, reply_latency_s=0.002))
    return FakeAcu(AcuParts(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S, scenario))


@contextlib.asynccontextmanager
async def opened(bench: Bench) -> AsyncIterator[Bench]:
    await bench.link.open()
    try:
        await bench.answers()
        yield bench
    finally:
        await bench.link.close()
        await asyncio.sleep(0.05)


@contextlib.asynccontextmanager
async def acu_on_tcp(_directory: Path) -> AsyncIterator[Bench]:
    acu, clock, board = make_acu(), SystemClock(START_TAI_S), FaultBoard()
    break_acu(acu, board, clock)
    async with (
        serve_tcp(acu_peer(acu, clock, board), board, "127.0.0.1", 0) as url,
        opened(Bench(url, board, acu)) as b,
    ):
        yield b


@contextlib.asynccontextmanager
async def acu_on_pty(directory: Path) -> AsyncIterator[Bench]:
    acu, clock, board = make_acu(), SystemClock(START_TAI_S), FaultBoard()
    peer = acu_peer(acu, clock, board, BAUD)
    async with serve_pty(peer, board, directory / "by-id", BAUD) as url, opened(Bench(url, board, acu)) as bench:
        yield bench


@contextlib.asynccontextmanager
async def proxy_on_tcp(_directory: Path) -> AsyncIterator[Bench]:
    acu, clock, board = make_acu(), SystemClock(START_TAI_S), FaultBoard()
    quiet = FaultBoard()
    async with (
        serve_tcp(acu_peer(acu, clock, quiet), quiet, "127.0.0.1", 0) as to,
        serve_tcp(proxy_peer(lambda: make_link(to), board), board, "127.0.0.1", 0) as url,
        opened(Bench(url, board, acu)) as bench,
    ):
        yield bench
    await asyncio.sleep(0.05)


@contextlib.asynccontextmanager
async def proxy_on_pty(directory: Path) -> AsyncIterator[Bench]:
    acu, clock, board = make_acu(), SystemClock(START_TAI_S), FaultBoard()
    quiet = FaultBoard()
    async with (
        serve_pty(acu_peer(acu, clock, quiet, BAUD), quiet, directory / "acu", BAUD) as to,
        serve_pty(proxy_peer(lambda: make_link(to), board), board, directory / "by-id", BAUD) as url,
        opened(Bench(url, board, acu)) as bench,
    ):
        yield bench
    await asyncio.sleep(0.05)


ALL = pytest.mark.parametrize("place", [acu_on_tcp, acu_on_pty, proxy_on_tcp, proxy_on_pty])
TCP = pytest.mark.parametrize("place", [acu_on_tcp, proxy_on_tcp])
PTY = pytest.mark.parametrize("place", [acu_on_pty, proxy_on_pty])


@ALL
async def test_a_cut_line_is_silent_and_speaks_again_on_the_same_connection(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("cut")
        assert await bench.is_silent()
        bench.board.clear()
        await bench.answers()


@ALL
async def test_frames_are_lost_on_every_line(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("no-reply count=1")
        assert await bench.is_silent()
        await bench.answers()
        await bench.breaks("bad-checksum count=1")
        assert await bench.is_silent()
        await bench.answers()


@ALL
async def test_what_a_deaf_acu_was_sent_arrives_when_it_reads_again(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("deaf")
        bench.link.write(encode_command(WriteAndPoll(31.0, 41.0)))
        await asyncio.sleep(0.2)
        assert not bench.acu.status().are_registers_written
        bench.board.clear()
        assert (await bench.answers()).are_registers_written


@ALL
async def test_a_reset_ends_the_connection_and_the_next_one_works(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("reset")
        with pytest.raises(LinkError):
            await asyncio.wait_for(bench.link.read(), PATIENCE_S)
        assert isinstance(await bench.reopens(), Status)


@TCP
async def test_a_half_open_connection_swallows_writes_and_a_new_one_works(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("half-open")
        assert await bench.is_silent()
        assert await bench.is_silent()
        assert isinstance(await bench.reopens(), Status)


@TCP
async def test_a_second_client_takes_the_acu_and_gives_it_back(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("second-client")
        with pytest.raises(LinkError):
            await asyncio.wait_for(bench.link.read(), PATIENCE_S)
        await bench.link.close()
        await bench.link.open()
        with pytest.raises(LinkRefusedError, match="another client holds the ACU"):
            await asyncio.wait_for(bench.link.read(), PATIENCE_S)
        bench.board.clear()
        assert isinstance(await bench.reopens(), Status)


@TCP
async def test_accept_then_close_leaves_the_present_client_alone(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("accept-then-close")
        await bench.answers()
        await bench.link.close()
        await asyncio.sleep(0.05)
        await bench.link.open()
        with pytest.raises(LinkRefusedError):
            await asyncio.wait_for(bench.link.read(), PATIENCE_S)
        bench.board.clear()
        await bench.reopens()


@TCP
async def test_refused_connections_find_nobody_listening_until_it_ends(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("refuse")
        await bench.answers()
        await bench.link.close()
        with pytest.raises(LinkRefusedError, match="nobody listens"):
            await bench.link.open()
        bench.board.clear()
        await bench.reopens()


@TCP
async def test_a_slow_close_keeps_the_place_taken(place: Place, tmp_path: Path) -> None:
    async with place(tmp_path) as bench:
        await bench.breaks("slow-close value=3600")
        await bench.link.close()
        await asyncio.sleep(0.05)
        await bench.link.open()
        with pytest.raises(LinkRefusedError):
            await asyncio.wait_for(bench.link.read(), PATIENCE_S)
        bench.board.clear()
        await bench.reopens()


@PTY
async def test_an_adapter_comes_back_under_another_name_behind_the_same_link(place: Place, tmp_path: Path) -> None:
    by_id = tmp_path / "by-id"
    async with place(tmp_path) as bench:
        before = by_id.readlink()
        await bench.breaks("unplug")
        with pytest.raises(LinkError, match="hung up"):
            await asyncio.wait_for(bench.link.read(), PATIENCE_S)
        await bench.link.close()
        with pytest.raises(LinkError, match="is the adapter plugged in"):
            await bench.link.open()
        bench.board.clear()
        assert isinstance(await bench.reopens(), Status)
        assert by_id.readlink() != before
        assert before.parent == by_id.readlink().parent == Path("/dev/pts")


@pytest.mark.parametrize("freed_count", range(4))
async def test_an_adapter_has_another_name_whichever_terminals_have_become_free(
    tmp_path: Path, freed_count: int
) -> None:
    others = [os.openpty() for _ in range(4)]
    async with acu_on_pty(tmp_path) as bench:
        before = (tmp_path / "by-id").readlink()
        for descriptors in others[:freed_count]:
            for descriptor in descriptors:
                os.close(descriptor)
        await bench.breaks("reset")
        assert (tmp_path / "by-id").readlink() != before
    for descriptors in others[freed_count:]:
        for descriptor in descriptors:
            os.close(descriptor)


async def test_an_acu_without_power_is_silent_and_has_forgotten_its_mode(tmp_path: Path) -> None:
    async with acu_on_tcp(tmp_path) as bench:
        bench.acu.set_local(True, START_TAI_S)
        bench.acu.set_local(False, START_TAI_S)
        await bench.breaks("power-cycle")
        assert await bench.is_silent()
        bench.board.clear()
        assert (await bench.answers()).mode is AcuMode.STANDBY


async def test_a_proxy_without_an_acu_behind_it_hangs_up(tmp_path: Path) -> None:
    board = FaultBoard()
    nobody = "serial:///dev/no-such-device?baud=9600"
    async with serve_tcp(proxy_peer(lambda: make_link(nobody), board), board, "127.0.0.1", 0) as url:
        link = make_link(url)
        await link.open()
        with pytest.raises(LinkError):
            await asyncio.wait_for(link.read(), PATIENCE_S)
        await link.close()
        await asyncio.sleep(0.05)


async def test_the_control_port_answers_each_line_with_one() -> None:
    board = FaultBoard()
    async with serve_control(board, "127.0.0.1", 0) as where:
        host, port = where.split(":")
        reader, writer = await asyncio.open_connection(host, int(port))
        for line, answer in ((b"fault nak\n", b"ok 1\n"), (b"\xff\n", b"error"), (b"clear\n", b"ok 1 cleared\n")):
            writer.write(line)
            assert (await asyncio.wait_for(reader.readline(), PATIENCE_S)).startswith(answer)
        writer.write(b"x" * 5000 + b"\n")
        assert await asyncio.wait_for(reader.read(), PATIENCE_S) == b""
        writer.close()
        await asyncio.sleep(0.05)
        with pytest.raises(UsageError, match="--control: cannot listen"):
            async with serve_control(board, host, int(port)):
                pass
