"""The SA-3842's driver: field words become its commands, and its replies field words (docs/protocol.md)."""

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import (
    Command,
    FreeTurnChoice,
    PointAndPoll,
    PointAt,
    Poll,
    ReadCommanded,
    ReadTurnChoice,
    ReadWatchdog,
    SetWatchdog,
)
from acu_daemon.acu.driver import Timing
from acu_daemon.acu.replies import (
    AcuIdentity,
    AcuStatus,
    Commanded,
    Done,
    FaultReport,
    Refused,
    Reply,
    TurnChoice,
    WatchdogTime,
)
from acu_daemon.drivers.sa3842 import messages as wire
from acu_daemon.drivers.sa3842.angles import LSB_DEG, elevation_code
from acu_daemon.drivers.sa3842.codec import DEFAULT_ADDRESS, exchange_bytes
from acu_daemon.drivers.sa3842.exchange import HostExchange
from acu_daemon.drivers.sa3842.field_status import field_status, read_field_status

SECTOR = "S"  # docs/protocol.md, Parameters: the turn preference; 0: a register is followed the nearest way
WATCHDOG = "W"  # the register watchdog
WATCHDOG_LSB_S = 0.02
LONGEST_EXTRA = 18  # bytes of the longest housekeeping exchange that goes beside a write: docs/protocol.md, Timing
HALF_SERVO_TICK_S = 0.010  # a command waits for half a 50 Hz servo tick on average: docs/protocol.md, Servo
EMERGENCY_STOP, DOOR_OPEN = 1, 2  # of the interlock nibble: docs/protocol.md, Fault detail
WATCHDOG_TRIPPED = 2  # of the system nibble
SA3842 = Capabilities(angle_step_deg=LSB_DEG, watchdog_step_s=WATCHDOG_LSB_S)


class Sa3842Driver:
    """The host's side of the dialogue in field words; `HostExchange` has its rules.

    Remembers the tilt register, which a write that says nothing of the tilt gives back as it was read.
    """

    capabilities = SA3842
    extra_bytes = LONGEST_EXTRA

    def __init__(self, address: int = DEFAULT_ADDRESS, device_delay_s: float = 0.010) -> None:
        self._exchange = HostExchange(address, read_field_status)
        self._device_delay_s = device_delay_s
        self._tilt_code = 0
        self._wire_bytes: dict[type[Command], int] = {}  # by kind: all of one kind are of one length

    def timing(self, byte_time_s: float) -> Timing:
        """docs/protocol.md, Time tags."""
        write_s, poll_s = (
            exchange_bytes(wire_command(command, 0))[0] * byte_time_s for command in (PointAndPoll(0.0, 0.0), Poll())
        )
        sample_delay_s = write_s + self._device_delay_s
        return Timing(sample_delay_s, poll_s + self._device_delay_s, sample_delay_s + HALF_SERVO_TICK_S)

    def wire_bytes(self, command: Command) -> int:
        """Bytes of a command's frame and of its good reply."""
        kind = type(command)
        if kind not in self._wire_bytes:
            self._wire_bytes[kind] = sum(exchange_bytes(wire_command(command, 0)))
        return self._wire_bytes[kind]

    def begin(self, command: Command, now_s: float) -> bytes:
        """The frame to send.  RuntimeError: a command is outstanding, or after a failed one no free question."""
        return self._exchange.begin(wire_command(command, self._tilt_code), now_s)

    def receive(self, data: bytes, now_s: float) -> Reply | None:
        """Take the next bytes; the reply to the outstanding command once it is complete."""
        reply = self._exchange.receive(data, now_s)
        if reply is None or isinstance(reply, AcuStatus):
            return reply
        if isinstance(reply, wire.RegisterContents):
            self._tilt_code = reply.tilt_code
        return field_reply(reply)

    def fail(self, now_s: float) -> None:
        """Give the outstanding command up."""
        self._exchange.fail(now_s)

    def forget(self) -> None:
        """A reply names its command: what was begun on a link before this one tells itself."""

    def question(self, now_s: float) -> Command | None:
        """docs/protocol.md, Late replies."""
        question = self._exchange.question(now_s)
        return ReadCommanded() if isinstance(question, wire.ReadRegisters) else question

    @property
    def is_outstanding(self) -> bool:
        return self._exchange.is_outstanding

    @property
    def must_poll(self) -> bool:
        return self._exchange.must_poll

    @property
    def free_s(self) -> float:
        return self._exchange.free_s

    @property
    def is_sure(self) -> bool:
        return self._exchange.is_sure

    @property
    def discarded_count(self) -> int:
        return self._exchange.discarded_count

    @property
    def garbled_count(self) -> int:
        return self._exchange.garbled_count

    @property
    def late_count(self) -> int:
        return self._exchange.late_count

    @property
    def late_s(self) -> float:
        return self._exchange.late_s

    @property
    def late_at_s(self) -> float:
        return self._exchange.late_at_s


def wire_command(command: Command, tilt_code: int = 0) -> wire.Command:
    """The SA-3842's own command for one in field words."""
    match command:
        case PointAndPoll(az_deg, el_deg, tilt_deg):
            return wire.WriteAndPoll(az_deg, el_deg, tilt_code if tilt_deg is None else elevation_code(tilt_deg))
        case PointAt(az_deg, el_deg):
            return wire.WriteRegisters(az_deg, el_deg)
        case ReadCommanded():
            return wire.ReadRegisters()
        case ReadTurnChoice():
            return wire.ReadParameter(SECTOR)
        case FreeTurnChoice():
            return wire.WriteParameter(SECTOR, 0)
        case ReadWatchdog():
            return wire.ReadParameter(WATCHDOG)
        case SetWatchdog(after_s):
            return wire.WriteParameter(WATCHDOG, round(after_s / WATCHDOG_LSB_S))
        case _:
            return command


def field_reply(reply: wire.Reply) -> Reply:
    """A reply in the words of the field."""
    match reply:
        case wire.Status():
            return field_status(reply)
        case wire.RegisterContents(az_deg, el_deg):
            return Commanded(az_deg, el_deg)
        case wire.Identity():
            return AcuIdentity(f"SA-{reply.model} {reply.variant}", reply.is_known, reply.is_simulated)
        case wire.Faults():
            return FaultReport(
                reply.texts(),
                is_emergency_stop=bool(reply.interlock & EMERGENCY_STOP),
                is_door_open=bool(reply.interlock & DOOR_OPEN),
                has_watchdog_tripped=bool(reply.system & WATCHDOG_TRIPPED),
            )
        case wire.Parameter(name, code) if name == SECTOR:
            return TurnChoice(is_nearest=code == 0)
        case wire.Parameter(name, code):
            return WatchdogTime(code * WATCHDOG_LSB_S) if name == WATCHDOG else Refused(f"answers parameter {name}")
        case wire.Ack():
            return Done()
        case wire.Nak():
            return Refused()
