"""Frames of the SA-3842 wire, both directions, cut anywhere (docs/protocol.md, Frame).

    command  STX ADDR CMD [data] ETX CHK
    reply    ACK ADDR CMD [data] ETX CHK
    refusal  NAK ADDR CMD ETX CHK

CHK is the XOR of every byte from the first to ETX, and may have any value: it is never taken for a start.
"""

from dataclasses import dataclass
from functools import reduce
from operator import xor

STX, ETX, ACK, NAK = 0x02, 0x03, 0x06, 0x15
MAX_DATA_BYTES = 128
OVERHEAD_BYTES = 5  # start, ADDR, CMD, ETX, CHK
ADDRESSES = range(0x31, 0x70)
CMDS = range(0x30, 0x80)
DATA = range(0x20, 0x80)
_DATA_BYTES = bytes(DATA)


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame with a good check byte; start is STX, ACK or NAK."""

    start: int
    address: int
    cmd: int
    data: bytes = b""


@dataclass(frozen=True, slots=True)
class BadFrame:
    """A frame that was begun and did not end well."""

    reason: str


def encode_frame(frame: Frame) -> bytes:
    """Turn a frame into bytes."""
    body = bytes((frame.start, frame.address, frame.cmd)) + frame.data + bytes((ETX,))
    return body + bytes((reduce(xor, body),))


class FrameDecoder:
    """Turns a byte stream, cut anywhere, into frames and bad frames, oldest first.  Keeps at most one frame.

    `starts` are the bytes that begin a frame: STX at the ACU, ACK and NAK at the host.
    """

    def __init__(self, starts: bytes) -> None:
        self._starts = starts
        self._frame = bytearray()

    @property
    def is_idle(self) -> bool:
        """Whether no frame has been begun."""
        return not self._frame

    def reset(self) -> None:
        """Forget the frame that was begun."""
        self._frame.clear()

    def feed(self, data: bytes) -> list[Frame | BadFrame]:
        """Take the next bytes; return what they completed."""
        if not self._frame and (frame := _whole_frame(data, self._starts)) is not None:
            return [frame]
        return [event for byte in data if (event := self._take(byte)) is not None]

    def _take(self, byte: int) -> Frame | BadFrame | None:
        frame = self._frame
        if not frame:
            if byte in self._starts:
                frame.append(byte)
            return None
        if frame[-1] == ETX:  # no byte before ETX can equal it, so this one is CHK
            done = bytes(frame)
            frame.clear()
            if reduce(xor, done, byte):
                return BadFrame("check byte")
            return Frame(done[0], done[1], done[2], done[3:-1])
        if self._is_bad_here(byte):
            frame.clear()
            if byte in self._starts:
                frame.append(byte)
            return BadFrame(f"byte {byte:02X}h out of place")
        frame.append(byte)
        return None

    def _is_bad_here(self, byte: int) -> bool:
        length = len(self._frame)
        if length == 1:
            return byte not in ADDRESSES
        if length == 2:
            return byte not in CMDS
        if byte == ETX:
            return False
        is_full = length - 3 >= (0 if self._frame[0] == NAK else MAX_DATA_BYTES)
        return is_full or byte not in DATA


def _whole_frame(data: bytes, starts: bytes) -> Frame | None:
    """The common case at one look, four times as fast as byte by byte: the data is one good frame and nothing else."""
    if len(data) < OVERHEAD_BYTES or data[0] not in starts or data[-2] != ETX or reduce(xor, data):
        return None
    start, address, cmd, content = data[0], data[1], data[2], data[3:-2]
    most = 0 if start == NAK else MAX_DATA_BYTES
    is_good = address in ADDRESSES and cmd in CMDS and len(content) <= most and not content.translate(None, _DATA_BYTES)
    return Frame(start, address, cmd, content) if is_good else None
