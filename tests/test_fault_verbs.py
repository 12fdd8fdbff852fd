"""The vocabulary of faults: how one is read, and what it makes of a frame."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import get_args

import pytest

from acu_daemon.acu.commands import AcuMode, Backup, Poll
from acu_daemon.drivers.sa3842.codec import ReplyDecoder, encode_command, encode_reply
from acu_daemon.drivers.sa3842.frame import NAK
from acu_daemon.drivers.sa3842.messages import Ack, Garbled, Nak, Status
from acu_daemon.errors import ConfigError
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import (
    VERBS,
    Fault,
    FaultError,
    VerbName,
    fault_text,
    parse_fault,
    vocabulary,
)
from acu_daemon.sim.frame_faults import FaultyWire, mangle
from acu_daemon.sim.scenario import read_faults, read_scenario
from acu_daemon.sim.virtual import run_virtual

STATUS = Status(
    az_deg=167.93,
    el_deg=20.5,
    mode=AcuMode.REMOTE_BACKUP,
    backup_selected=Backup.REMOTE,
    is_backup_active=True,
    is_autotrack_selected=True,
    is_remote_enabled=True,
)
REPLY = encode_reply(0x31, STATUS)


# Reading


def test_every_verb_has_its_line_in_the_help() -> None:
    assert set(get_args(VerbName)) == set(VERBS)
    assert [line.split()[0] for line in vocabulary().splitlines()] == list(VERBS)


def test_a_fault_is_read_from_a_line_and_written_back() -> None:
    text = "stuck start_s=2 duration_s=3.5 count=2 probability=0.5 axis=both seed=7"
    assert parse_fault(text) == Fault("stuck", 2.0, 3.5, 2, 0.5, None, "both", "reply", 7)
    assert fault_text(parse_fault(text)) == text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("gremlins", "verb = 'gremlins': expected one of 'no-reply'"),
        ("no-reply count", "'count': expected KEY=VALUE"),
        ("no-reply cout=3", "cout is unknown, expected one of verb, start_s"),
        ("no-reply count=1.5", "expected a whole number"),
        ("no-reply count=-1", "expected 0 or more"),
        ("no-reply probability=1.2", "expected 0 to 1"),
        ("no-reply start_s=soon", "expected a number"),
        ("no-reply duration_s=0", "leave it out"),
        ("no-reply value=3", "no-reply takes no value"),
        ("slow-drive value=2", "more than 1 of 1"),
        ("late-reply value=-1", "expected 0 or more"),
        ("bandwidth value=0", "expected more"),
        ("stuck axis=tilt", "expected one of 'azimuth', 'elevation', 'both'"),
        ("cut on=command", "acts on no frame"),
        ("stuck count=2", "count needs duration_s"),
    ],
)
def test_a_fault_that_makes_no_sense_is_told_what_was_expected(text: str, expected: str) -> None:
    with pytest.raises(FaultError, match=expected):
        parse_fault(text)


def test_a_scenario_file_holds_faults_and_names_a_wrong_one(tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text('[[fault]]\nverb = "nak"\ncount = 2\nseed = 1\n[[fault]]\nverb = "stuck"\naxis = "both"\n')
    assert read_scenario(path).faults == (Fault("nak", count=2, seed=1), Fault("stuck", axis="both"))
    assert [fault.seed for fault in read_faults(path, 10)] == [11, 10]
    path.write_text('[[fault]]\nverb = "nak"\n[[fault]]\ncount = 1\n')
    with pytest.raises(ConfigError, match=r"scenario\.toml: \[fault 2\] verb is missing"):
        read_scenario(path)


# Frames


def decoded(data: bytes) -> list[object]:
    return [event.reply for event in ReplyDecoder().feed(data)]


@pytest.mark.parametrize("verb", ["xor-blind", "wrong-address", "not-hex", "truncated", "duplicate"])
def test_what_is_no_whole_frame_passes(verb: VerbName) -> None:
    assert mangle(verb, b"\x06", 3.0, Random(1)) == b"\x06"


@pytest.mark.parametrize("verb", ["bad-checksum", "wrong-address", "not-hex"])
def test_a_frame_that_is_wrong_in_itself_is_garbled_to_a_host(verb: VerbName) -> None:
    for seed in range(20):
        [reply] = decoded(mangle(verb, REPLY, 0.0, Random(seed)))
        assert isinstance(reply, Garbled)


@pytest.mark.parametrize("verb", ["xor-blind", "swapped-digits"])
def test_what_xor_cannot_see_is_another_status_with_a_check_byte_that_fits(verb: VerbName) -> None:
    others = [decoded(mangle(verb, REPLY, 0.0, Random(seed))) for seed in range(50)]
    believed = [reply for [reply] in others if isinstance(reply, Status)]
    assert len(believed) > 25
    assert all(reply != STATUS for reply in believed)


def test_an_elevation_out_of_range_is_a_good_frame() -> None:
    [reply] = decoded(mangle("out-of-range", REPLY, 0.0, Random(1)))
    assert isinstance(reply, Status)
    assert reply.el_deg == 135.0
    assert reply.az_deg == pytest.approx(167.93, abs=0.01)


def test_an_acknowledgement_is_too_short_for_faults_of_data() -> None:
    ack = encode_reply(0x34, Ack())
    for verb in ("xor-blind", "swapped-digits", "not-hex", "out-of-range"):
        assert mangle(verb, ack, 0.0, Random(1)) == ack


def passed(*faults: str, chunks: int = 1, frame_count: int = 3, gap_s: float = 0.1) -> list[tuple[float, bytes]]:
    """What comes out of a wire at the host, and when, of frames sent 0.1 s apart in equal chunks."""

    async def main() -> list[tuple[float, bytes]]:
        loop, out = asyncio.get_running_loop(), []
        board = FaultBoard()
        put: Callable[[bytes], None] = lambda data: out.append((round(loop.time(), 4), data))  # noqa: E731
        wire = FaultyWire(board, put, lambda _data: None)
        for text in faults:
            board.add(parse_fault(text))
        await asyncio.sleep(0.01)
        start_s, size = loop.time(), -(-len(REPLY) // chunks)
        for k in range(frame_count):
            await asyncio.sleep(start_s + k * gap_s - loop.time())
            for i in range(0, len(REPLY), size):
                wire.from_acu(REPLY[i : i + size])
        await asyncio.sleep(1.0)
        return [(round(time_s - start_s, 4), data) for time_s, data in out]

    return run_virtual(main())


def test_without_a_fault_everything_passes_at_once_as_it_comes() -> None:
    assert passed(chunks=4, frame_count=1) == [(0.0, REPLY[i : i + 7]) for i in range(0, 28, 7)]


def test_chunks_make_frames_again_before_a_fault_hits_them() -> None:
    assert passed("duplicate count=1", chunks=5)[0] == (0.0, REPLY + REPLY)


def test_late_shifted_glued_and_slow_frames_come_when_they_should() -> None:
    assert passed("no-reply count=1") == [(0.1, REPLY), (0.2, REPLY)]
    assert passed("late-reply count=1") == [(0.1, REPLY), (0.15, REPLY), (0.2, REPLY)]
    assert passed("shifted") == [(0.1, REPLY), (0.2, REPLY)]
    assert passed("glued count=1") == [(0.1, REPLY + REPLY), (0.2, REPLY)]
    assert passed("latency value=0.04") == [(0.04, REPLY), (0.14, REPLY), (0.24, REPLY)]
    assert passed("bandwidth value=280", gap_s=0.0) == [(0.1, REPLY), (0.2, REPLY), (0.3, REPLY)]
    times = [time_s for time_s, _ in passed("jitter value=0.09", frame_count=20, gap_s=0.01)]
    assert times == sorted(times)
    assert len(set(times)) > 3
    assert passed("split count=1", frame_count=1) == [(round(0.001 * i, 4), REPLY[i : i + 1]) for i in range(28)]
    assert passed("cut") == []
    assert passed("break count=1")[0] == (0.0, b"\0")


def test_a_refused_command_never_reaches_the_acu() -> None:
    async def main() -> tuple[list[bytes], list[bytes]]:
        to_host: list[bytes] = []
        to_acu: list[bytes] = []
        board = FaultBoard()
        wire = FaultyWire(board, to_host.append, to_acu.append)
        board.add(parse_fault("nak count=1"))
        await asyncio.sleep(0.01)
        for _ in range(2):
            wire.from_host(encode_command(Poll()))
        return to_host, to_acu

    to_host, to_acu = run_virtual(main())
    assert decoded(b"".join(to_host)) == [Nak()]
    assert to_host[0][0] == NAK
    assert to_acu == [encode_command(Poll())]


def test_a_frame_that_stops_is_passed_on_after_a_moment() -> None:
    async def main() -> list[bytes]:
        out: list[bytes] = []
        board = FaultBoard()
        wire = FaultyWire(board, out.append, lambda _data: None)
        board.add(parse_fault("duplicate"))
        await asyncio.sleep(0.01)
        wire.from_acu(REPLY[:9])
        await asyncio.sleep(0.1)
        return out

    assert run_virtual(main()) == [REPLY[:9]]
