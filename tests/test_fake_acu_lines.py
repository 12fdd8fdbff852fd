"""The fake ACU on its lines: in virtual time with exact times, over a real TCP socket, over a real pseudo terminal."""

import asyncio
from contextlib import AbstractAsyncContextManager
from itertools import pairwise
from pathlib import Path

import pytest
from fake_sky import AZIMUTH, ELEVATION, START_TAI_S, Star

from acu_daemon.acu.commands import AcuMode, Identify, Poll, SelectMode
from acu_daemon.drivers.sa3842.codec import encode_command
from acu_daemon.drivers.sa3842.exchange import HostExchange
from acu_daemon.drivers.sa3842.messages import Ack, Command, Reply, Status, WriteAndPoll
from acu_daemon.edge.clock import LoopClock, SystemClock
from acu_daemon.edge.link import Link, make_link
from acu_daemon.errors import LinkError, LinkRefusedError, UsageError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.line import AcuLine
from acu_daemon.sim.memory import MemoryLink
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.pty import serve_pty
from acu_daemon.sim.scenario import AcuChoice, Scenario
from acu_daemon.sim.server import acu_peer, keep_time, serve_tcp
from acu_daemon.sim.trace import TraceRow
from acu_daemon.sim.virtual import StandstillError, VirtualTimeLoop, run_virtual

BYTE_S = 10 / 9600
LATENCY_S = 0.010


def fake_acu(latency_s: float = LATENCY_S) -> FakeAcu:
    scenario = Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0, reply_latency_s=latency_s))
    return FakeAcu(AcuParts(AZIMUTH, ELEVATION, 1.0, Star(), START_TAI_S, scenario))


async def ask(link: Link, host: HostExchange, command: Command) -> Reply:
    link.write(host.begin(command, 0.0))
    while True:
        data, _ = await link.read()
        if (reply := host.receive(data, 0.0)) is not None:
            return reply


async def dialogue(link: Link) -> list[Reply]:
    host = HostExchange()
    commands: list[Command] = [Identify(), WriteAndPoll(30.0, 40.0), SelectMode(AcuMode.REMOTE), Poll()]
    return [await ask(link, host, command) for command in commands]


def serving_tcp(host: str, port: int) -> AbstractAsyncContextManager[str]:
    board = FaultBoard()
    return serve_tcp(acu_peer(fake_acu(), SystemClock(START_TAI_S), board), board, host, port)


def serving_pty(path: Path, baud: int) -> AbstractAsyncContextManager[str]:
    board = FaultBoard()
    return serve_pty(acu_peer(fake_acu(), SystemClock(START_TAI_S), board, baud), board, path, baud)


def check(replies: list[Reply]) -> None:
    assert str(replies[0]) == "SA-3842 S1 SIMULATION"
    assert isinstance(replies[1], Status)
    assert replies[1].are_registers_written
    assert replies[2] == Ack()
    assert isinstance(replies[3], Status)
    assert replies[3].mode is AcuMode.REMOTE


def test_virtual_time_jumps_and_stands_still_when_nothing_can_happen() -> None:
    async def sleep() -> float:
        await asyncio.sleep(1e6)
        return asyncio.get_running_loop().time()

    assert run_virtual(sleep(), start_s=5.0) == 5.0 + 1e6

    async def wait_for_ever() -> None:
        await asyncio.Event().wait()

    with pytest.raises(StandstillError):
        run_virtual(wait_for_ever())


def test_the_answer_to_a_command_takes_the_time_of_the_wire_and_the_latency() -> None:
    """docs/protocol.md, Timing: 17 bytes out and 28 back at 9600 baud are 46.9 ms, with 10 ms of latency 56.9."""

    async def exchange() -> tuple[float, float, float]:
        clock = LoopClock(START_TAI_S)
        link = MemoryLink(fake_acu(), clock, BYTE_S)
        await link.open()
        host = HostExchange()
        link.write(host.begin(WriteAndPoll(30.0, 40.0), 0.0))
        _, first_s = await link.read()
        await link.read()
        return first_s, clock.monotonic_s(), link.byte_time_s

    first_s, done_s, byte_time_s = run_virtual(exchange())
    assert byte_time_s == BYTE_S
    assert first_s == pytest.approx(18 * BYTE_S + LATENCY_S)
    assert done_s == pytest.approx(0.0469 + LATENCY_S, abs=1e-4)


def test_a_paced_line_sends_no_faster_than_its_baud_rate() -> None:
    async def arrivals() -> list[float]:
        times: list[float] = []
        clock = LoopClock(START_TAI_S)
        line = AcuLine(
            fake_acu(), clock, lambda piece: times.append(clock.monotonic_s()), gap_s=0.05, byte_time_s=BYTE_S
        )
        line.receive(encode_command(Poll()))
        line.receive(encode_command(Poll()))
        await asyncio.sleep(1.0)
        return times

    times = run_virtual(arrivals())
    assert len(times) == 56
    assert all(b - a >= BYTE_S - 1e-9 for a, b in pairwise(times))


@pytest.mark.parametrize(("pause_s", "reply_count"), [(0.04, 1), (0.06, 0)])
def test_a_frame_whose_characters_stop_for_too_long_is_dropped(pause_s: float, reply_count: int) -> None:
    async def replies() -> int:
        sent: list[bytes] = []
        line = AcuLine(fake_acu(), LoopClock(START_TAI_S), sent.append, gap_s=0.05)
        frame = encode_command(Poll())
        line.receive(frame[:2])
        await asyncio.sleep(pause_s)
        line.receive(frame[2:])
        await asyncio.sleep(0.1)
        return len(sent)

    assert run_virtual(replies()) == reply_count


def test_a_status_is_of_the_moment_its_command_is_executed() -> None:
    """The satellite is switched off 5 ms after the command arrived and before its latency has passed."""

    async def acquired() -> bool:
        acu = fake_acu(latency_s=0.050)
        link = MemoryLink(acu, LoopClock(START_TAI_S))
        await link.open()
        host = HostExchange()
        await ask(link, host, Poll())
        link.write(host.begin(Poll(), 0.0))
        await asyncio.sleep(0.005)
        assert isinstance(acu.parts.sky, Star)
        acu.parts.sky.is_on = False
        reply = host.receive((await link.read())[0], 0.0)
        assert isinstance(reply, Status)
        return reply.is_acquired

    assert run_virtual(acquired()) is False


def test_the_memory_link_can_be_cut_hung_up_refused_and_opened_again() -> None:
    async def story() -> None:
        link = MemoryLink(fake_acu(), LoopClock(START_TAI_S))
        with pytest.raises(LinkError, match="not open"):
            link.write(b"x")
        link.is_refused = True
        with pytest.raises(LinkRefusedError, match="another client"):
            await link.open()
        link.is_refused = False
        await link.open()
        check(await dialogue(link))
        link.is_cut = True
        link.write(encode_command(Poll()))
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(1.0):
                await link.read()
        link.is_cut = False
        link.hang_up()
        with pytest.raises(LinkError, match="closed"):
            await link.read()
        await link.close()
        await link.open()
        await ask(link, HostExchange(), Poll())
        await link.close()

    run_virtual(story())


@pytest.mark.long
def test_a_quarter_of_an_hour_of_exchanges_repeats_bit_for_bit() -> None:
    async def pass_of_two_minutes() -> list[TraceRow]:
        clock = LoopClock(START_TAI_S)
        acu = fake_acu()
        rows: list[TraceRow] = []
        acu.observer = rows.append
        link = MemoryLink(acu, clock, BYTE_S)
        await link.open()
        host = HostExchange()
        await ask(link, host, SelectMode(AcuMode.REMOTE))
        for k in range(1, 1200):
            await clock.sleep_until(START_TAI_S + 0.1 * k)
            await ask(link, host, WriteAndPoll(30.0 + 0.05 * k, 40.0))
        return rows

    assert run_virtual(pass_of_two_minutes()) == run_virtual(pass_of_two_minutes())


async def test_a_host_speaks_with_the_simulation_over_tcp() -> None:
    async with serving_tcp("127.0.0.1", 0) as url:
        link = make_link(url)
        for _ in range(2):
            await link.open()
            host = HostExchange()
            await ask(link, host, SelectMode(AcuMode.STANDBY))
            await link.close()
            await asyncio.sleep(0.02)
        await link.open()
        check(await dialogue(link))
        await link.close()


async def test_a_second_client_is_closed_at_once_while_the_first_one_speaks() -> None:
    async with serving_tcp("127.0.0.1", 0) as url:
        first, second = make_link(url), make_link(url)
        await first.open()
        await ask(first, HostExchange(), Poll())
        await second.open()
        with pytest.raises(LinkRefusedError, match="another client holds the ACU"):
            await second.read()
        await second.close()
        check(await dialogue(first))
        await first.close()


async def test_a_first_client_that_was_silent_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    async with serving_tcp("127.0.0.1", 0) as url:
        first, second = make_link(url), make_link(url)
        await first.open()
        await ask(first, HostExchange(), Poll())
        monkeypatch.setattr("acu_daemon.sim.server.SILENT_S", 0.0)
        await second.open()
        check(await dialogue(second))
        with pytest.raises(LinkError):
            await first.read()
        await first.close()
        await second.close()


async def test_a_port_that_is_taken_is_a_usage_error() -> None:
    async with serving_tcp("127.0.0.1", 0) as url:
        with pytest.raises(UsageError, match="cannot listen"):
            async with serving_tcp("127.0.0.1", int(url.rsplit(":", 1)[1])):
                pass


@pytest.mark.parametrize("options", ["", "&format=7E1"])
async def test_a_host_speaks_with_the_simulation_over_a_pseudo_terminal(tmp_path: Path, options: str) -> None:
    path = tmp_path / "acu"
    async with serving_pty(path, 38400) as url:
        assert url == f"serial://{path}?baud=38400"
        link = make_link(url + options)
        for _ in range(2):
            await link.open()
            check(await dialogue(link))
            link.write(encode_command(SelectMode(AcuMode.STANDBY)))
            await link.read()
            await link.close()
            await asyncio.sleep(0.02)
    assert not path.is_symlink()


async def test_a_pty_link_that_is_served_is_refused_and_works_on_and_a_dead_one_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "acu"
    path.symlink_to("/dev/pts/4000000")
    async with serving_pty(path, 38400) as url:
        device = path.readlink()
        with pytest.raises(UsageError, match="is served already"):
            async with serving_pty(tmp_path / "." / "acu", 9600):
                pass
        assert path.readlink() == device
        link = make_link(url)
        await link.open()
        check(await dialogue(link))
        await link.close()
    async with serving_pty(path, 9600):
        assert path.is_symlink()


async def test_a_pty_link_never_replaces_an_adapters_name(tmp_path: Path) -> None:
    (tmp_path / "ttyUSB0").touch()
    (tmp_path / "by-id").symlink_to(tmp_path / "ttyUSB0")
    with pytest.raises(UsageError, match="no link to a pseudo terminal"):
        async with serving_pty(tmp_path / "by-id", 9600):
            pass
    assert (tmp_path / "by-id").readlink() == tmp_path / "ttyUSB0"


async def test_a_pty_link_never_replaces_a_file(tmp_path: Path) -> None:
    file = tmp_path / "precious"
    file.write_text("data")
    with pytest.raises(UsageError, match="no link to a pseudo terminal"):
        async with serving_pty(file, 9600):
            pass
    with pytest.raises(UsageError, match="cannot be made"):
        async with serving_pty(tmp_path / "no" / "acu", 9600):
            pass
    assert file.read_text() == "data"


def test_the_servo_ticks_while_nobody_speaks() -> None:
    async def rows() -> int:
        acu, seen = fake_acu(), []
        acu.observer = seen.append
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(5.05):
                await keep_time(acu, LoopClock(START_TAI_S))
        return len(seen)

    assert run_virtual(rows()) in (49, 50)


def test_a_virtual_loop_has_no_threads_to_wait_for() -> None:
    loop = VirtualTimeLoop()
    loop.call_later(3.0, loop.stop)
    loop.run_forever()
    assert loop.time() == 3.0
    loop.close()
