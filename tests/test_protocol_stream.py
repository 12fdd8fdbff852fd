"""The wire as a stream: any segmentation, docs/protocol.md, Acceptance, row by row, both ends back to back."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.acu.commands import AcuMode, Backup, Identify, Poll, ReadFaults, SelectMode, Stop
from acu_daemon.drivers.sa3842.angles import (
    azimuth_code,
    azimuth_deg,
    clamp_code,
    clamp_deg,
    elevation_code,
    elevation_deg,
)
from acu_daemon.drivers.sa3842.codec import (
    CommandDecoder,
    CommandEvent,
    ReplyDecoder,
    address_byte,
    cycle_s,
    encode_command,
    encode_reply,
    exchange_bytes,
)
from acu_daemon.drivers.sa3842.exchange import HostExchange
from acu_daemon.drivers.sa3842.field_status import field_status
from acu_daemon.drivers.sa3842.frame import ACK, MAX_DATA_BYTES, NAK, STX, BadFrame, Frame, FrameDecoder, encode_frame
from acu_daemon.drivers.sa3842.messages import (
    Ack,
    Command,
    Faults,
    Garbled,
    Identity,
    Nak,
    ReadParameter,
    ReadRegisters,
    Reply,
    Status,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)

LSB_DEG = 360 / 65536
STARTS = bytes((ACK, NAK))
STATUS = Status(45.0, 22.5, AcuMode.REMOTE)
angles_deg = st.floats(-720.0, 720.0, allow_nan=False)
codes = st.integers(0, 0xFFFF)
commands = st.one_of(
    st.builds(WriteAndPoll, angles_deg, angles_deg, codes),
    st.builds(WriteRegisters, angles_deg, angles_deg, st.none() | codes),
    st.builds(WriteParameter, st.sampled_from("ARPMTSW"), codes),
    st.just(Poll()),
)


def cut(data: bytes, places: list[int]) -> list[bytes]:
    edges = [0, *sorted(place % (len(data) + 1) for place in places), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


framed = st.builds(
    lambda start, address, cmd, data: encode_frame(Frame(start, address, cmd, data)),
    st.sampled_from((STX, ACK, NAK)),
    st.sampled_from((0x30, 0x31, 0x6F, 0x70)),
    st.sampled_from((0x2F, 0x30, 0x41, 0x7F, 0x80)),
    st.lists(st.sampled_from((0x03, 0x06, 0x1F, 0x20, 0x41, 0x7F, 0x80)), max_size=3).map(bytes)
    | st.sampled_from((b"A" * MAX_DATA_BYTES, b"A" * (MAX_DATA_BYTES + 1))),
)


@given(framed, st.binary(max_size=2), st.none() | st.tuples(st.integers(0, 200), st.integers(0, 255)))
def test_what_comes_at_once_is_what_comes_byte_by_byte(
    frame: bytes, after: bytes, change: tuple[int, int] | None
) -> None:
    data = bytearray(frame + after)
    if change is not None:
        data[change[0] % len(data)] = change[1]
    at_once, byte_by_byte = FrameDecoder(STARTS), FrameDecoder(STARTS)
    assert at_once.feed(bytes(data)) == [event for byte in data for event in byte_by_byte.feed(bytes((byte,)))]
    assert at_once.is_idle == byte_by_byte.is_idle


@given(st.lists(commands, max_size=4), st.lists(st.integers(0, 200)))
def test_commands_cut_anywhere_come_out_as_they_went_in(sent: list[Command], places: list[int]) -> None:
    decoder = CommandDecoder()
    stream = b"".join(encode_command(command) for command in sent)
    events = [event for piece in cut(stream, places) for event in decoder.feed(piece, 0.0)]
    assert [encode_command(event.command) for event in events if event.command] == [encode_command(c) for c in sent]


@given(codes, codes, st.integers(0, 4095), st.lists(st.integers(0, 200)))
def test_replies_cut_anywhere_come_out_as_they_went_in(az: int, el: int, agc: int, places: list[int]) -> None:
    status = Status(azimuth_deg(az), elevation_deg(el), AcuMode.AUTOTRACK, agc_db=agc * 0.05, is_sector_high=True)
    decoder = ReplyDecoder()
    events = [event for piece in cut(encode_reply(0x41, status), places) for event in decoder.feed(piece)]
    assert [(event.cmd, event.reply) for event in events] == [(0x41, status)]


@given(st.binary(max_size=400))
def test_noise_never_raises_and_never_grows_the_memory(noise: bytes) -> None:
    decoder = FrameDecoder(b"\x02")
    for event in decoder.feed(noise):
        assert isinstance(event, Frame | BadFrame)
    assert len(decoder._frame) <= 133
    ReplyDecoder().feed(noise)


@given(st.binary(max_size=30))
def test_after_noise_and_silence_the_next_command_is_understood(noise: bytes) -> None:
    decoder = CommandDecoder()
    decoder.feed(noise, 0.0)
    assert decoder.feed(encode_command(Poll()), 1.0) == [CommandEvent(0x31, Poll())]


POLL = encode_command(Poll())


@pytest.mark.parametrize(
    "frame",
    [
        pytest.param(POLL[:-1] + bytes((POLL[-1] ^ 1,)), id="bad check byte"),
        pytest.param(encode_command(Poll(), ord("2")), id="other address"),
        pytest.param(encode_frame(Frame(STX, 0x31, 0x31, b" " * (MAX_DATA_BYTES + 1))), id="over 133 bytes"),
        pytest.param(encode_frame(Frame(STX, 0x31, 0x31, b"\x1f")), id="data byte below 20h"),
        pytest.param(encode_frame(Frame(STX, 0x31, 0x31, b"\x80")), id="data byte over 7Fh"),
        pytest.param(encode_frame(Frame(STX, 0x30, 0x31)), id="address below 31h"),
        pytest.param(encode_frame(Frame(STX, 0x31, 0x2F)), id="command below 30h"),
        pytest.param(POLL[1:], id="no start"),
    ],
)
def test_a_bad_frame_meets_silence_and_the_next_one_is_understood(frame: bytes) -> None:
    assert CommandDecoder().feed(frame + POLL, 0.0)[-1:] == [CommandEvent(0x31, Poll())]
    assert CommandDecoder().feed(frame, 0.0) == []


@pytest.mark.parametrize(
    ("cmd", "data"),
    [
        (0x5A, b""),
        (0x40, b""),
        (0x30, b"1"),
        (0x31, b"0"),
        (0x32, b"57CA200"),
        (0x32, b"57CA200004FA0"),
        (0x32, b"57ca2000"),
        (0x32, b"57CA 000"),
        (0x33, b"1"),
        (0x34, b""),
        (0x34, b"1"),
        (0x34, b"3"),
        (0x34, b"22"),
        (0x35, b"3"),
        (0x35, b""),
        (0x36, b""),
        (0x36, b"st"),
        (0x37, b"0"),
        (0x38, b"0"),
        (0x39, b"0"),
        (0x3A, b"0"),
        (0x3B, b""),
        (0x3B, b"X"),
        (0x3B, b"AR"),
        (0x3C, b"X0000"),
        (0x3C, b"A00fA"),
        (0x3C, b"A00F"),
        (0x41, b"57CA2000"),
        (0x41, b"57CA200004F "),
    ],
)
def test_a_good_frame_that_makes_no_sense_is_refused(cmd: int, data: bytes) -> None:
    assert CommandDecoder().feed(encode_frame(Frame(STX, 0x31, cmd, data)), 0.0) == [CommandEvent(cmd, None)]


def test_the_longest_legal_frame_is_refused_not_ignored() -> None:
    frame = encode_frame(Frame(STX, 0x31, 0x31, b" " * MAX_DATA_BYTES))
    assert len(frame) == 133
    assert CommandDecoder().feed(frame, 0.0) == [CommandEvent(0x31, None)]


def test_a_start_in_the_middle_of_a_frame_begins_a_new_one() -> None:
    assert CommandDecoder().feed(POLL[:2] + POLL, 0.0) == [CommandEvent(0x31, Poll())]
    reply = encode_reply(0x31, STATUS)
    assert ReplyDecoder().feed(reply[:10] + reply)[-1].reply == STATUS


def test_a_check_byte_that_looks_like_a_start_is_only_a_check_byte() -> None:
    frame = encode_frame(Frame(STX, 0x31, 0x41, b"s"))
    assert frame[-1] == STX
    assert CommandDecoder().feed(frame + POLL, 0.0) == [CommandEvent(0x41, None), CommandEvent(0x31, Poll())]
    wrong_check = POLL[:-1] + bytes((STX,))
    assert CommandDecoder().feed(wrong_check + POLL[1:], 0.0) == []


@pytest.mark.parametrize("gap_s", [0.010, 0.050, 0.250])
def test_characters_that_stop_for_longer_than_the_gap_drop_the_frame(gap_s: float) -> None:
    for pause_s, expected in ((gap_s * 0.99, [CommandEvent(0x31, Poll())]), (gap_s * 1.01, [])):
        decoder = CommandDecoder(gap_s=gap_s)
        decoder.feed(POLL[:3], 5.0)
        assert decoder.feed(POLL[3:], 5.0 + pause_s) == expected


class Acu:
    """The other end of a HostExchange in memory; answers each command byte with what it is told."""

    def __init__(self) -> None:
        self.decoder = CommandDecoder()
        self.heard: list[Command | None] = []
        self.reply_of: dict[int, Reply] = {
            0x31: STATUS,
            0x41: STATUS,
            0x30: Identity("3842", "S1"),
            0x3A: Faults(interlock=1),
        }

    def answer(self, data: bytes) -> bytes:
        events = self.decoder.feed(data, 0.0)
        self.heard += [event.command for event in events]
        return b"".join(encode_reply(e.cmd, self.reply_of.get(e.cmd, Ack()) if e.command else Nak()) for e in events)


@given(st.lists(st.integers(0, 100)))
def test_two_ends_back_to_back_understand_each_other(places: list[int]) -> None:
    host, acu = HostExchange(), Acu()
    for command in (Identify(), Poll(), WriteAndPoll(370.0, 45.0, 3), SelectMode(AcuMode.REMOTE)):
        answer = acu.answer(host.begin(command, 0.0))
        replies = [reply for piece in cut(answer, places) if (reply := host.receive(piece, 0.0)) is not None]
        assert replies == [acu.reply_of.get(0x31 if isinstance(command, Poll) else answer[2], Ack())]
        assert not host.is_outstanding
    assert acu.heard[2] == WriteAndPoll(azimuth_deg(azimuth_code(10.0)), 45.0, 3)


def test_a_late_reply_is_not_taken_for_the_next_one_but_its_lateness_known() -> None:
    host = HostExchange()
    host.begin(WriteAndPoll(1.0, 2.0), 10.0)
    host.fail(10.09)
    assert host.must_poll
    host.begin(Poll(), 10.1)
    assert host.receive(encode_reply(0x41, STATUS), 10.13) is None
    assert (host.discarded_count, host.late_count, host.late_s) == (1, 1, pytest.approx(0.13))
    assert host.receive(encode_reply(0x31, STATUS), 10.14) == STATUS
    assert host.is_sure
    assert not host.must_poll


def test_after_a_failed_poll_come_identify_read_registers_and_fault_detail_in_turn() -> None:
    """docs/protocol.md, Late replies."""
    host, asked = HostExchange(), []
    for tick in range(8):
        now_s = 0.1 * tick
        command = host.question(now_s) if tick else WriteAndPoll(1.0, 2.0)
        asked.append(command)
        if command is not None:
            host.begin(command, now_s)
            host.fail(now_s + 0.09)
    questions = [Poll(), Identify(), ReadRegisters(), ReadFaults()]
    assert asked == [WriteAndPoll(1.0, 2.0), *questions, None, None, Poll()]
    assert host.free_s == pytest.approx(0.2 + 0.09 + 0.5)


def test_an_answer_is_unsure_while_a_reply_to_an_earlier_command_of_its_kind_may_come() -> None:
    host = HostExchange()
    host.begin(WriteAndPoll(1.0, 2.0), 0.0)
    host.fail(0.09)
    host.begin(Poll(), 0.1)
    assert host.receive(encode_reply(0x31, STATUS), 0.11) == STATUS
    for now_s, is_sure in ((0.2, False), (0.5, False), (0.6, True)):
        host.begin(WriteAndPoll(1.0, 2.0), now_s)
        assert host.receive(encode_reply(0x41, STATUS), now_s + 0.01) == STATUS
        assert host.is_sure == is_sure


def test_what_arrives_while_nothing_is_asked_is_discarded_and_counted() -> None:
    host = HostExchange()
    host.begin(Poll(), 0.0)
    host.fail(0.09)
    assert host.receive(encode_reply(0x31, STATUS), 0.095) is None
    assert (host.discarded_count, host.late_count, host.must_poll) == (1, 1, True)


def test_the_second_half_of_a_late_reply_is_not_taken_for_the_next_one() -> None:
    host = HostExchange()
    late = encode_reply(0x31, STATUS)
    host.begin(Poll(), 0.0)
    assert host.receive(late[:10], 0.08) is None
    host.fail(0.09)
    host.begin(Identify(), 0.1)
    assert host.receive(late[10:], 0.11) is None
    assert host.is_outstanding


def test_after_a_failed_exchange_only_a_free_question_is_accepted() -> None:
    host = HostExchange()
    host.begin(Stop(), 0.0)
    with pytest.raises(RuntimeError, match="outstanding"):
        host.begin(Poll(), 0.01)
    host.fail(0.09)
    with pytest.raises(RuntimeError, match="Poll or another free question, not Stop"):
        host.begin(Stop(), 1.0)
    host.begin(Poll(), 1.0)
    host.fail(1.09)
    with pytest.raises(RuntimeError, match="free question, not Poll"):
        host.begin(Poll(), 1.1)


def test_a_reply_from_another_address_is_garble_not_an_answer() -> None:
    host = HostExchange()
    host.begin(Poll(), 0.0)
    assert host.receive(encode_reply(0x31, STATUS, ord("2")), 0.01) is None
    assert (host.garbled_count, host.is_outstanding) == (1, True)


@pytest.mark.parametrize(
    ("cmd", "data"),
    [
        (0x31, b"57CA200004FA12C48=1000"),
        (0x31, b"57ca200004FA12C48=10001"),
        (0x31, b"57CA200004FA12CA8=10001"),
        (0x31, b"57CA200004FA12C:8=10001"),
        (0x31, b"57CA200004FA12C43=10001"),
        (0x30, b"3842"),
        (0x33, b"57CA200004FA2"),
        (0x3A, b"000000A0"),
        (0x34, b"1"),
    ],
)
def test_a_reply_that_does_not_read_is_garbled_and_the_command_stays_outstanding(cmd: int, data: bytes) -> None:
    (event,) = ReplyDecoder().feed(encode_frame(Frame(0x06, 0x31, cmd, data)))
    assert isinstance(event.reply, Garbled)


def test_a_refusal_with_data_is_garbled() -> None:
    (event,) = ReplyDecoder().feed(encode_frame(Frame(0x15, 0x31, 0x34, b"1")))
    assert isinstance(event.reply, Garbled)


@given(angles_deg)
def test_an_angle_survives_the_wire_to_half_a_bit(angle_deg: float) -> None:
    for back_deg in (azimuth_deg(azimuth_code(angle_deg)), elevation_deg(elevation_code(angle_deg))):
        assert abs((back_deg - angle_deg + 180) % 360 - 180) <= LSB_DEG / 2 + 1e-9


@given(codes)
def test_a_code_survives_degrees_exactly(code: int) -> None:
    assert azimuth_code(azimuth_deg(code)) == elevation_code(elevation_deg(code)) == code


@given(angles_deg, st.floats(-300, 0), st.floats(1, 300))
def test_a_clamped_angle_lies_within_the_limits_after_rounding(angle_deg: float, low: float, high: float) -> None:
    clamped_deg = clamp_deg(angle_deg, low, high)
    assert low - 1e-8 <= clamped_deg <= high + 1e-8
    assert abs(clamped_deg - min(max(angle_deg, low), high)) <= LSB_DEG


def test_just_below_zero_is_not_sent_as_a_full_turn() -> None:
    assert clamp_code(-0.01, 0.0, 360.0) == 0
    assert clamp_code(90.1, 0.0, 90.0) == 0x4000
    assert clamp_code(0.0, 0.001, 90.0) == 1
    with pytest.raises(ValueError, match="finite"):
        clamp_code(float("nan"), 0.0, 90.0)


@pytest.mark.parametrize(
    ("sent", "byte_count", "wire_ms", "cycles_ms"),
    [
        ((Poll(), WriteRegisters(1, 2, 3)), 55, 57.3, (63.4, 79.4, 99.4)),
        ((WriteAndPoll(1, 2),), 45, 46.9, (49.9, 57.9, 67.9)),
        ((WriteAndPoll(1, 2), WriteRegisters(1, 2)), 63, 65.6, (71.7, 87.7, 107.7)),
    ],
)
def test_the_cycle_takes_what_section_6_says(
    sent: tuple[Command, ...], byte_count: int, wire_ms: float, cycles_ms: tuple[float, ...]
) -> None:
    assert sum(sum(exchange_bytes(command)) for command in sent) == byte_count
    assert byte_count / 0.96 == pytest.approx(wire_ms, abs=0.05)
    for latency_s, expected_ms in zip((0.002, 0.010, 0.020), cycles_ms, strict=True):
        assert 1e3 * cycle_s(sent, 10 / 9600, latency_s) == pytest.approx(expected_ms, abs=0.05)


@pytest.mark.parametrize(
    ("command", "reply", "byte_counts"),
    [
        (Identify(), Identity("3842", "S1"), (5, 11)),
        (Poll(), STATUS, (5, 28)),
        (ReadParameter("A"), None, (6, 10)),
        (ReadRegisters(), None, (5, 19)),
        (WriteAndPoll(1, 2), STATUS, (17, 28)),
        (WriteParameter("A", 1), Ack(), (10, 5)),
    ],
)
def test_the_frames_are_as_long_as_section_4_says(
    command: Command, reply: Reply | None, byte_counts: tuple[int, int]
) -> None:
    assert exchange_bytes(command) == byte_counts
    assert len(encode_command(command)) == byte_counts[0]
    if reply is not None:
        assert len(encode_reply(0x31, reply)) == byte_counts[1]


def test_the_registers_are_followed_in_the_modes_section_5_names() -> None:
    followed = {
        (mode, backup)
        for mode in AcuMode
        for backup in Backup
        if field_status(Status(0, 0, mode, backup_selected=backup)).follows_registers
    }
    assert followed == {
        *((mode, backup) for mode in (AcuMode.REMOTE, AcuMode.REMOTE_BACKUP) for backup in Backup),
        (AcuMode.ACQUIRE, Backup.REMOTE),
    }


def test_faults_are_named_for_people() -> None:
    faults = Faults(azimuth=4, interlock=1, system=2)
    assert faults.texts() == ("azimuth runaway", "emergency stop", "register watchdog")
    assert str(Identity("3842", "S1")) == "SA-3842 S1 SIMULATION"


def test_an_address_is_one_character_from_1_to_o() -> None:
    assert address_byte("1") == 0x31
    with pytest.raises(ValueError, match="from '1' to 'o'"):
        address_byte("0")


@pytest.mark.parametrize("address", ["1", "o"])
@pytest.mark.parametrize("cmd", [0x30, 0x7F])
def test_the_ends_of_the_addresses_and_of_the_commands_are_heard_whole_and_byte_by_byte(address: str, cmd: int) -> None:
    sent = Frame(ACK, address_byte(address), cmd)
    data = encode_frame(sent)
    assert FrameDecoder(bytes((ACK, NAK))).feed(data) == [sent]
    decoder = FrameDecoder(bytes((ACK, NAK)))
    assert [event for byte in data for event in decoder.feed(bytes((byte,)))] == [sent]
