"""Codec of the SA-3842's messages, host side and ACU side, without IO (docs/protocol.md).

`driver` makes field words of them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from acu_daemon.acu.commands import AcuMode, Identify, Poll, ReadFaults, SelectBackup, SelectMode, Stop, Stow
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.drivers.sa3842.angles import azimuth_code, azimuth_deg, elevation_code, elevation_deg
from acu_daemon.drivers.sa3842.fields import FieldError, hex_text, hex_value, nibble_values, nibbles_text
from acu_daemon.drivers.sa3842.frame import ACK, NAK, OVERHEAD_BYTES, STX, BadFrame, Frame, FrameDecoder, encode_frame
from acu_daemon.drivers.sa3842.messages import (
    BACKUP_NUMBERS,
    MODE_NIBBLES,
    Ack,
    ClearChange,
    Command,
    Faults,
    Garbled,
    Identity,
    Nak,
    Parameter,
    ReadParameter,
    ReadRegisters,
    RegisterContents,
    Reply,
    ResetFault,
    Status,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.drivers.sa3842.status_block import STATUS_CHARS, decode_status, encode_status

Chosen = TypeVar("Chosen")
DEFAULT_ADDRESS = ord("1")
STOW_GUARD = "ST"
PARAMETER_NAMES = "ARPMTSW"
SELECTABLE_MODES = (AcuMode.STANDBY, AcuMode.REMOTE, AcuMode.AUTOTRACK)

CMD_OF: dict[type[Command], int] = {
    Identify: 0x30,
    Poll: 0x31,
    WriteRegisters: 0x32,
    ReadRegisters: 0x33,
    SelectMode: 0x34,
    SelectBackup: 0x35,
    Stow: 0x36,
    Stop: 0x37,
    ClearChange: 0x38,
    ResetFault: 0x39,
    ReadFaults: 0x3A,
    ReadParameter: 0x3B,
    WriteParameter: 0x3C,
    WriteAndPoll: 0x41,
}
_WITHOUT_DATA: dict[int, Command] = {
    CMD_OF[type(command)]: command
    for command in (Identify(), Poll(), ReadRegisters(), Stop(), ClearChange(), ResetFault(), ReadFaults())
}
_REPLY_CHARS = {0x30: 6, 0x31: STATUS_CHARS, 0x33: 14, 0x3A: 8, 0x3B: 5, 0x41: STATUS_CHARS}  # the others: 0


def address_byte(text: str) -> int:
    """Address of the TOML's one character, '1' (31h) to 'o' (6Fh).  ValueError: anything else."""
    if len(text) != 1 or not 0x31 <= ord(text) <= 0x6F:
        raise ValueError(f"{text!r} is not an ACU address, expected one character from '1' to 'o'")
    return ord(text)


def encode_command(command: Command, address: int = DEFAULT_ADDRESS) -> bytes:
    """Turn a command into its frame; angles are rounded to their 16-bit codes."""
    return encode_frame(Frame(STX, address, CMD_OF[type(command)], _command_data(command).encode("ascii")))


def _command_data(command: Command) -> str:
    match command:
        case WriteRegisters(az_deg, el_deg, None):
            return _angles_text(az_deg, el_deg)
        case WriteRegisters(az_deg, el_deg, int(tilt_code)) | WriteAndPoll(az_deg, el_deg, tilt_code):
            return _angles_text(az_deg, el_deg) + hex_text(tilt_code, 4)
        case SelectMode(mode):
            return nibbles_text(MODE_NIBBLES[mode])
        case SelectBackup(backup):
            return nibbles_text(BACKUP_NUMBERS[backup])
        case Stow():
            return STOW_GUARD
        case ReadParameter(name):
            return name
        case WriteParameter(name, code):
            return name + hex_text(code, 4)
        case _:
            return ""


def decode_command(cmd: int, text: str) -> Command:
    """Read the data of a command.

    Raises: FieldError: whatever an ACU answers with NAK before it looks at its own state: unknown CMD, wrong length,
        not upper-case hex, a value that does not exist.
    """
    if (bare := _WITHOUT_DATA.get(cmd)) is not None:
        _check_length(text, 0)
        return bare
    match cmd:
        case 0x32:
            _check_length(text, 8, 12)
            tilt_code = hex_value(text[8:]) if len(text) == 12 else None
            return WriteRegisters(*_angles(text), tilt_code)
        case 0x34:
            return SelectMode(_choice(text, {mode: MODE_NIBBLES[mode] for mode in SELECTABLE_MODES}))
        case 0x35:
            return SelectBackup(_choice(text, BACKUP_NUMBERS))
        case 0x36 if text == STOW_GUARD:
            return Stow()
        case 0x3B:
            _check_length(text, 1)
            return ReadParameter(_parameter_name(text))
        case 0x3C:
            _check_length(text, 5)
            return WriteParameter(_parameter_name(text[0]), hex_value(text[1:]))
        case 0x41:
            _check_length(text, 12)
            return WriteAndPoll(*_angles(text), hex_value(text[8:]))
    raise FieldError(f"command {cmd:02X}h with data {text!r} does not exist")


def encode_reply(cmd: int, reply: Reply, address: int = DEFAULT_ADDRESS) -> bytes:
    """Turn the ACU's reply to a command byte into its frame."""
    start = NAK if isinstance(reply, Nak) else ACK
    return encode_frame(Frame(start, address, cmd, _reply_data(reply).encode("ascii")))


def _reply_data(reply: Reply) -> str:
    match reply:
        case Status():
            return encode_status(reply)
        case RegisterContents(az_deg, el_deg, tilt_code, count):
            return _angles_text(az_deg, el_deg) + hex_text(tilt_code, 4) + hex_text(count, 2)
        case Identity(model, variant):
            return model + variant
        case Faults():
            f = reply
            return nibbles_text(
                f.azimuth, f.elevation, f.tilt, f.encoders, f.interlock, f.system, f.receiver, f.reserved
            )
        case Parameter(name, code):
            return name + hex_text(code, 4)
        case _:
            return ""


StatusReader = Callable[[str], Status | AcuStatus]


def decode_reply(cmd: int, text: str, read_status: StatusReader = decode_status) -> Reply | AcuStatus:
    """Read the data of an ACK frame.  FieldError: it does not fit the command byte.

    read_status: what to make of the status block: all of it, or the field's words.
    """
    _check_length(text, _REPLY_CHARS.get(cmd, 0))
    match cmd:
        case 0x30:
            return Identity(text[:4], text[4:])
        case 0x31 | 0x41:
            return read_status(text)
        case 0x33:
            return RegisterContents(*_angles(text), hex_value(text[8:12]), hex_value(text[12:]))
        case 0x3A:
            return Faults(*nibble_values(text))
        case 0x3B:
            return Parameter(text[0], hex_value(text[1:]))
        case _:
            return Ack()


@dataclass(frozen=True, slots=True)
class ReplyEvent:
    """What the host's decoder found: a reply to a command byte, or garble."""

    cmd: int | None
    reply: Reply | AcuStatus | Garbled


class ReplyDecoder:
    """The host's side: turns a byte stream, cut anywhere, into replies, oldest first; memory is bounded by a frame."""

    def __init__(self, address: int = DEFAULT_ADDRESS, read_status: StatusReader = decode_status) -> None:
        self._address = address
        self._read_status = read_status
        self._frames = FrameDecoder(bytes((ACK, NAK)))

    def reset(self) -> None:
        """Forget a reply that was begun."""
        self._frames.reset()

    def feed(self, data: bytes) -> list[ReplyEvent]:
        """Take the next bytes; return what they completed."""
        return [self._event(frame) for frame in self._frames.feed(data)]

    def _event(self, frame: Frame | BadFrame) -> ReplyEvent:
        if isinstance(frame, BadFrame):
            return ReplyEvent(None, Garbled(frame.reason))
        if frame.address != self._address:
            return ReplyEvent(frame.cmd, Garbled(f"reply of address {chr(frame.address)!r}"))
        if frame.start == NAK:
            return ReplyEvent(frame.cmd, Nak())
        try:
            return ReplyEvent(frame.cmd, decode_reply(frame.cmd, frame.data.decode("ascii"), self._read_status))
        except FieldError as error:
            return ReplyEvent(frame.cmd, Garbled(str(error)))


@dataclass(frozen=True, slots=True)
class CommandEvent:
    """What the ACU's decoder found: a command byte to answer, with None where the answer is NAK."""

    cmd: int
    command: Command | None


class CommandDecoder:
    """The ACU's side: frames that deserve silence give nothing; a frame whose characters stop for gap_s is dropped."""

    def __init__(self, address: int = DEFAULT_ADDRESS, gap_s: float = 0.010) -> None:
        self._address = address
        self._gap_s = gap_s
        self._frames = FrameDecoder(bytes((STX,)))
        self._last_byte_s = 0.0

    def feed(self, data: bytes, now_s: float) -> list[CommandEvent]:
        """Take the bytes that arrived at now_s (any clock that never goes back)."""
        if now_s - self._last_byte_s > self._gap_s:
            self._frames.reset()
        self._last_byte_s = now_s
        frames = self._frames.feed(data)
        return [_command_event(f) for f in frames if isinstance(f, Frame) and f.address == self._address]


def _command_event(frame: Frame) -> CommandEvent:
    try:
        return CommandEvent(frame.cmd, decode_command(frame.cmd, frame.data.decode("ascii")))
    except FieldError:
        return CommandEvent(frame.cmd, None)


def exchange_bytes(command: Command) -> tuple[int, int]:
    """Bytes of a command's frame and of its good reply, for the arithmetic of docs/protocol.md, Timing."""
    return OVERHEAD_BYTES + len(_command_data(command)), reply_bytes(command)


def reply_bytes(command: Command) -> int:
    """Bytes of a command's good reply."""
    return OVERHEAD_BYTES + _REPLY_CHARS.get(CMD_OF[type(command)], 0)


def cycle_s(commands: tuple[Command, ...], byte_time_s: float, latency_s: float) -> float:
    """Time that exchanges take one after the other: wire, one idle character and the latency each (docs/protocol.md,
    Timing)."""
    byte_count = sum(sum(exchange_bytes(command)) for command in commands)
    return (byte_count + len(commands)) * byte_time_s + len(commands) * latency_s


def _angles_text(az_deg: float, el_deg: float) -> str:
    return hex_text(azimuth_code(az_deg), 4) + hex_text(elevation_code(el_deg), 4)


def _angles(text: str) -> tuple[float, float]:
    return azimuth_deg(hex_value(text[:4])), elevation_deg(hex_value(text[4:8]))


def _check_length(text: str, *char_counts: int) -> None:
    if len(text) not in char_counts:
        raise FieldError(f"{len(text)} characters of data, expected {' or '.join(map(str, char_counts))}")


def _choice(text: str, numbers: Mapping[Chosen, int]) -> Chosen:
    for choice, number in numbers.items():
        if text == str(number):
            return choice
    raise FieldError(f"{text!r} cannot be selected")


def _parameter_name(text: str) -> str:
    if text not in PARAMETER_NAMES:
        raise FieldError(f"there is no parameter {text!r}")
    return text
