"""SIMULATION: what faults do to a frame on the wire.  `mangle` is pure; FaultyWire runs on the loop's timers."""

import asyncio
from collections.abc import Callable
from random import Random

from acu_daemon.drivers.sa3842.frame import ADDRESSES, ETX, NAK, OVERHEAD_BYTES, Frame, encode_frame
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import Direction, Fault, VerbName

HEX_DIGITS = b"0123456789ABCDEF"
NIBBLES = bytes(range(0x30, 0x40))
DATA_FROM = 3  # start, ADDR, CMD
ANGLES_CHARS = 15  # az4 el4 tl4 agc3 are hex digits, then nibbles: docs/protocol.md, Status block
OUT_OF_RANGE = b"6000"  # 135 deg
IDLE_S = 0.020  # a frame that stops for this long is passed on as it is
_TRIES = 64

Mangle = Callable[[bytes, float, Random], bytes]


def _sealed(frame: bytes, data: bytes, address: int | None = None) -> bytes:
    """A frame with other data or another address, and a check byte that fits."""
    return encode_frame(Frame(frame[0], frame[1] if address is None else address, frame[2], data))


def _data(frame: bytes) -> bytes:
    return frame[DATA_FROM:-2]


def _bad_checksum(frame: bytes, _value: float, random: Random) -> bytes:
    return frame[:-1] + bytes((frame[-1] ^ random.randint(1, 127),))


def _is_likely(data: bytes | bytearray) -> bool:
    return all(c in (HEX_DIGITS if i < ANGLES_CHARS else NIBBLES) for i, c in enumerate(data))


def _xor_blind(frame: bytes, _value: float, random: Random) -> bytes:
    """Flip one bit in two characters so that both still look right; frames too short for it pass."""
    data = _data(frame)
    for _ in range(_TRIES if len(data) > 1 else 0):
        changed = bytearray(data)
        bit = 1 << random.randrange(4)
        for i in random.sample(range(len(data)), 2):
            changed[i] ^= bit
        if _is_likely(changed):
            return frame[:DATA_FROM] + bytes(changed) + frame[-2:]
    return frame


def _swapped_digits(frame: bytes, _value: float, random: Random) -> bytes:
    data = bytearray(_data(frame))
    places = [i for i in range(len(data) - 1) if data[i] != data[i + 1]]
    if places:
        i = random.choice(places)
        data[i], data[i + 1] = data[i + 1], data[i]
    return frame[:DATA_FROM] + bytes(data) + frame[-2:]


def _with_data(frame: bytes, at: int, text: bytes) -> bytes:
    data = _data(frame)
    return _sealed(frame, data[:at] + text + data[at + len(text) :]) if len(data) >= at + len(text) else frame


def _random_bytes(count: float, random: Random) -> bytes:
    return bytes(random.randrange(256) for _ in range(int(count)))


def _other_address(frame: bytes, _value: float, _random: Random) -> bytes:
    return _sealed(frame, _data(frame), frame[1] + 1 if frame[1] + 1 in ADDRESSES else ADDRESSES[0])


_MANGLES: dict[VerbName, Mangle] = {
    "wrong-address": _other_address,
    "not-hex": lambda frame, _value, _random: _with_data(frame, 0, b"NaN."),
    "out-of-range": lambda frame, _value, _random: _with_data(frame, 4, OUT_OF_RANGE),
    "xor-blind": _xor_blind,
    "swapped-digits": _swapped_digits,
    "bad-checksum": _bad_checksum,
    "truncated": lambda frame, value, _random: frame[: max(1, len(frame) - int(value))],
    "garbage-before": lambda frame, value, random: _random_bytes(value, random) + frame,
    "garbage-after": lambda frame, value, random: frame + _random_bytes(value, random),
    "duplicate": lambda frame, _value, _random: frame + frame,
    "wrong-baud": lambda frame, _value, random: _random_bytes(len(frame), random),
    "break": lambda _frame, _value, _random: b"\0",
}


def mangle(verb: VerbName, frame: bytes, value: float, random: Random) -> bytes:
    """What a fault makes of a whole frame; what is no whole frame passes."""
    is_whole = len(frame) >= OVERHEAD_BYTES and frame[-2] == ETX
    return _MANGLES[verb](frame, value, random) if is_whole else frame


class _Cutter:
    """Cuts a stream behind every check byte; keeps what is not complete."""

    def __init__(self) -> None:
        self.rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        frames, self.rest = [], self.rest + data
        while 0 <= (end := self.rest.find(ETX)) < len(self.rest) - 1:
            frames.append(self.rest[: end + 2])
            self.rest = self.rest[end + 2 :]
        return frames


class _Way:
    """One direction of the wire."""

    def __init__(self, on: Direction, send: Callable[[bytes], None]) -> None:
        self.on, self.send = on, send
        self.cutter = _Cutter()
        self.kept = b""  # by `shifted` and `glued`
        self.free_s = 0.0
        self.flush: asyncio.TimerHandle | None = None


class FaultyWire:
    """Stands between host and ACU; without a fault of frames it passes everything on at once, as it comes."""

    def __init__(self, board: FaultBoard, to_host: Callable[[bytes], None], to_acu: Callable[[bytes], None]) -> None:
        self._board = board
        self._loop = asyncio.get_running_loop()
        self._to_host, self._to_acu = _Way("reply", to_host), _Way("command", to_acu)

    def from_acu(self, data: bytes) -> None:
        """Bytes on their way to the host."""
        self._take(self._to_host, data)

    def from_host(self, data: bytes) -> None:
        """Bytes on their way to the ACU."""
        self._take(self._to_acu, data)

    def _take(self, way: _Way, data: bytes) -> None:
        if self._board.is_on("cut"):
            return
        is_late = way.free_s > self._loop.time()
        if not self._board.touches_frames and not (way.cutter.rest or way.kept or is_late):
            way.send(data)
            return
        for frame in way.cutter.feed(data):
            self._pass(way, frame)
        if way.flush is not None:
            way.flush.cancel()
        way.flush = self._loop.call_later(IDLE_S, self._flush, way) if way.cutter.rest else None

    def _flush(self, way: _Way) -> None:
        rest, way.cutter.rest = way.cutter.rest, b""
        way.send(rest)

    def _pass(self, way: _Way, frame: bytes) -> None:
        strike, on = self._board.strike, way.on
        if on == "command" and len(frame) >= OVERHEAD_BYTES and strike("nak", "reply"):
            self._to_host.send(encode_frame(Frame(NAK, frame[1], frame[2])))
            return
        if strike("no-reply", on):
            return
        for verb in _MANGLES:
            if hit := strike(verb, on):
                frame = mangle(verb, frame, hit[0].amount, hit[1])
        frame = self._keep_back(way, frame)
        if frame:
            self._send_later(way, frame)

    def _keep_back(self, way: _Way, frame: bytes) -> bytes:
        """What goes out now: the frame, or what was kept, or both."""
        if self._board.strike("shifted", way.on):
            way.kept, frame = frame, way.kept
        elif way.kept:
            way.kept, frame = b"", way.kept + frame
        elif self._board.strike("glued", way.on):
            way.kept, frame = frame, b""
        return frame

    def _send_later(self, way: _Way, frame: bytes) -> None:
        strike, on, now_s = self._board.strike, way.on, self._loop.time()
        if hit := strike("late-reply", on):
            self._loop.call_later(hit[0].amount, way.send, frame)
            return
        due_s = now_s + _amount(strike("latency", on))
        if hit := strike("jitter", on):
            due_s += hit[1].uniform(0.0, hit[0].amount)
        due_s = max(due_s, way.free_s)
        if hit := strike("bandwidth", on):
            due_s += len(frame) / hit[0].amount
        if hit := strike("split", on):
            for i in range(len(frame)):
                self._loop.call_at(due_s + i * hit[0].amount, way.send, frame[i : i + 1])
            due_s += (len(frame) - 1) * hit[0].amount
        elif due_s > now_s:
            self._loop.call_at(due_s, way.send, frame)
        else:
            way.send(frame)
        way.free_s = due_s


def _amount(hit: tuple[Fault, Random] | None) -> float:
    return hit[0].amount if hit else 0.0
