"""Any Hamlib rotator through rotctld: position only, no autotrack, no backup (docs/rotators.md).

rotctld answers in the order in which it was asked, and an answer does not say what it answers.  So the answers that
are owed stand in a row: one that comes after its command was given up is the oldest one's, and is dropped.  A line that
cannot be of the oldest shows that that one was lost.

A rotator has no modes.  REMOTE and STANDBY are this driver's: STANDBY after a stop; REMOTE once that is selected, and
at the start, when the rotator may still be on its way to an older angle.  In STANDBY angles are taken, and not sent.
"""

from collections import deque

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import AcuMode, Command, Identify, PointAt, Poll, ReadFaults, SelectMode, Stop
from acu_daemon.acu.driver import Timing
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, FaultReport, Refused, Reply
from acu_daemon.drivers.rotctl.answers import Answer, Awaited, Kind, Position, Report, RotatorState
from acu_daemon.model import AxisLimits

DUMMY_MODEL = 1  # Hamlib's simulated rotator
LONGEST_LINE = 200
IDENTIFY_TRIES = 2  # a server that does not know \dump_state never answers it
REPLY_DEADLINE_S = 1.0  # serial rotators take some tenths of a second
SILENCE_S = 3.0


class RotctlDriver:
    """The dialogue with a rotctld.  dead_band_deg: nearer than this to the last angle sent, no other is."""

    extra_bytes = 0
    must_poll = False  # the row of owed answers tells late ones apart
    free_s = 0.0
    is_sure = True

    def __init__(self, dead_band_deg: float = 0.5, device_delay_s: float = 0.010) -> None:
        self.capabilities = Capabilities(
            has_autotrack=False,
            has_backup=False,
            has_sector_bit=False,
            has_turn_choice=False,
            has_register_watchdog=False,
            has_stow=False,
            has_read_back=False,
            has_combined_write=False,
            is_azimuth_continuous=True,
            angle_step_deg=0.01,
            dead_band_deg=dead_band_deg,
            reply_deadline_s=REPLY_DEADLINE_S,
            silence_s=SILENCE_S,
        )
        self._device_delay_s = device_delay_s
        self._owed: deque[Awaited] = deque()
        self._outstanding: Command | None = None
        self._at_once: Reply | None = None  # of a command for which nothing is sent
        self._unread = b""
        self._follows = True
        self._sent: tuple[float, float] | None = None  # the last angles that the rotator took
        self._identify_count = 0
        self._late_state: RotatorState | None = None  # what it said of itself, after the deadline
        self.discarded_count = 0
        self.garbled_count = 0
        self.late_count = 0
        self.late_s = 0.0
        self.late_at_s = float("-inf")

    def timing(self, byte_time_s: float) -> Timing:
        """A rotator's own delay; there is no baud rate to reckon with."""
        return Timing(self._device_delay_s, self._device_delay_s, self._device_delay_s)

    def wire_bytes(self, command: Command) -> int:
        return 0

    def question(self, now_s: float) -> Command:
        """A poll may always follow."""
        return Poll()

    @property
    def is_outstanding(self) -> bool:
        return self._outstanding is not None

    def begin(self, command: Command, now_s: float) -> bytes:
        """The line to send; none where the driver knows the reply.  RuntimeError: a command is outstanding."""
        if self._outstanding is not None:
            raise RuntimeError("a command is outstanding: receive its reply, or call fail() at its deadline")
        self._outstanding = command
        line, kind, self._at_once = self._asked(command)
        if kind is not None:
            self._owed.append(Awaited(kind, now_s))
        return line

    def _asked(self, command: Command) -> tuple[bytes, Kind | None, Reply | None]:
        """The line, what answers it, or the reply at once."""
        match command:
            case Poll():
                return b"p\n", Kind.POSITION, None
            case PointAt(az_deg, el_deg):
                if not self._follows or self._is_near(az_deg, el_deg):
                    return b"", None, Done()
                return f"P {az_deg:.2f} {el_deg:.2f}\n".encode(), Kind.REPORT, None
            case Stop() | SelectMode(AcuMode.STANDBY):
                return b"S\n", Kind.REPORT, None
            case SelectMode(AcuMode.REMOTE):
                self._follows = True
                return b"", None, Done()
            case Identify() if self._late_state is not None:
                return b"", None, _identity(self._late_state)
            case Identify() if self._identify_count < IDENTIFY_TRIES:
                self._identify_count += 1
                return b"\\dump_state\n", Kind.STATE, None
            case Identify():
                return b"", None, AcuIdentity("rotator that does not say its model", is_known=True, is_simulated=False)
            case ReadFaults():
                return b"", None, FaultReport()
            case _:
                return b"", None, Refused(f"a rotator has no {type(command).__name__}")

    def _is_near(self, az_deg: float, el_deg: float) -> bool:
        if self._sent is None:
            return False
        return max(abs(az_deg - self._sent[0]), abs(el_deg - self._sent[1])) <= self.capabilities.dead_band_deg

    def receive(self, data: bytes, now_s: float) -> Reply | None:
        """Take the next bytes; the reply to the outstanding command once it is complete."""
        reply = None
        *lines, self._unread = (self._unread + data).split(b"\n")
        if len(self._unread) > LONGEST_LINE:
            self._unread = b""
            self.garbled_count += 1
        for line in lines:
            text = line.decode("ascii", "replace").strip()
            reply = self._take(text, now_s) or reply if text else reply
        if self._at_once is not None:
            reply, self._at_once, self._outstanding = self._at_once, None, None
        return reply

    def _take(self, line: str, now_s: float) -> Reply | None:
        while self._owed and self._owed[0].is_given_up and not self._owed[0].takes(line):
            self._owed.popleft()  # it was lost: what comes now is of a later one
        if not self._owed:
            self.discarded_count += 1
            return None
        awaited = self._owed[0]
        try:
            answer = awaited.add(line) if awaited.takes(line) else None
        except ValueError:
            answer, awaited.is_given_up = None, True
        if answer is None:
            self.garbled_count += not awaited.lines or awaited.is_given_up
            return None
        self._owed.popleft()
        if awaited.is_given_up or self._outstanding is None:
            self.late_count += 1
            self.late_s, self.late_at_s = now_s - awaited.begun_s, now_s
            self._late_state = answer if isinstance(answer, RotatorState) else self._late_state
            return None
        command, self._outstanding = self._outstanding, None
        return self._reply(command, answer)

    def _reply(self, command: Command, answer: Answer) -> Reply:
        match answer:
            case Position(az_deg, el_deg):
                mode = AcuMode.REMOTE if self._follows else AcuMode.STANDBY
                return AcuStatus(az_deg % 360.0, el_deg, mode, turns_deg=az_deg)
            case RotatorState():
                return _identity(answer)
            case Report(0):
                self._done(command)
                return Done()
            case Report() if isinstance(command, Identify):
                return AcuIdentity("rotator that does not say its model", is_known=True, is_simulated=False)
            case Report():
                return Refused(answer.text, has_no_contact=answer.has_no_contact)

    def _done(self, command: Command) -> None:
        match command:
            case PointAt(az_deg, el_deg):
                self._sent = az_deg, el_deg
            case Stop() | SelectMode():
                self._follows, self._sent = False, None

    def fail(self, now_s: float) -> None:
        """Give the outstanding command up; what the rotator makes of it is not known."""
        if self._outstanding is not None and self._owed and not self._owed[-1].is_given_up:
            self._owed[-1].is_given_up = True
        if isinstance(self._outstanding, PointAt | Stop):
            self._sent = None
        self._outstanding = self._at_once = None

    def forget(self) -> None:
        """The link was closed: nothing is owed, and somebody else may have moved the rotator since."""
        self._owed.clear()
        self._unread, self._sent = b"", None
        self._identify_count, self._late_state = 0, None


def _identity(state: RotatorState) -> AcuIdentity:
    return AcuIdentity(
        "Hamlib's dummy rotator" if state.model == DUMMY_MODEL else f"Hamlib rotator, model {state.model}",
        is_known=True,
        is_simulated=state.model == DUMMY_MODEL,
        azimuth=_limits(state, "az"),
        elevation=_limits(state, "el"),
    )


def _limits(state: RotatorState, axis: str) -> AxisLimits | None:
    low_deg, high_deg = state.limits_deg.get(f"min_{axis}"), state.limits_deg.get(f"max_{axis}")
    unknown = float("inf")
    return None if low_deg is None or high_deg is None else AxisLimits(low_deg, high_deg, unknown, unknown)
