"""A driver to begin with: the least that docs/adding-an-acu.md asks for, for an imaginary ACU that speaks in lines.

    host   status            ACU   status 123.40 56.70 REMOTE      az, el, mode
           point 123.4 56.7        ok                              or: no REASON
           remote | standby        ok
           who                     who NAME

One answer to each line, in order.  Copy it, and put your ACU's bytes in the places of `_line` and `_reply`.
One with autotrack, a backup and bearings: tagged_driver.py.
"""

from math import isfinite

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import AcuMode, Command, Identify, PointAt, Poll, ReadFaults, SelectMode, Stop
from acu_daemon.acu.driver import Timing
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, FaultReport, Refused, Reply

LONGEST_LINE = 100
MODES = {mode.name: mode for mode in (AcuMode.STANDBY, AcuMode.REMOTE)}


class SkeletonDriver:
    """Position only, no signal, no backup; answers come in the order of the questions."""

    capabilities = Capabilities(
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
        reply_deadline_s=0.090,
        silence_s=0.5,
    )
    extra_bytes = 0  # no baud rate: TCP
    must_poll, free_s, is_sure = False, 0.0, True  # the count of owed answers tells late ones apart

    def __init__(self) -> None:
        self._outstanding: Command | None = None
        self._at_once: Reply | None = None
        self._owed_s: list[float] = []  # when those commands were begun whose answers have not come, oldest first
        self._unread = b""
        self.discarded_count = self.garbled_count = self.late_count = 0
        self.late_s, self.late_at_s = 0.0, float("-inf")

    # What is your ACU's

    def _line(self, command: Command) -> str | Reply:
        """The line to send, or the reply where none is needed."""
        match command:
            case Poll():
                return "status"
            case PointAt(az_deg, el_deg):
                return f"point {az_deg:.2f} {el_deg:.2f}"  # a bearing: round(az_deg, 2) % 360.0, so that none is 360.00
            case SelectMode(AcuMode.REMOTE):
                return "remote"
            case Stop() | SelectMode(AcuMode.STANDBY):
                return "standby"
            case Identify():
                return "who"
            case ReadFaults():
                return FaultReport()
            case _:
                return Refused(f"this ACU has no {type(command).__name__}")

    def _reply(self, command: Command, line: str) -> Reply | None:
        """Read an answer; None: it is none of this command's."""
        match command, line.split():
            case Poll(), ["status", az, el, mode] if mode in MODES and _are_numbers(az, el):
                return AcuStatus(float(az) % 360.0, float(el), MODES[mode], turns_deg=float(az))
            case Identify(), ["who", *names]:
                return AcuIdentity(" ".join(names), is_known=True, is_simulated="simulated" in names)
            case ((PointAt() | SelectMode() | Stop()), ["ok"]):
                return Done()
            case ((PointAt() | SelectMode() | Stop()), ["no", *why]):
                return Refused(" ".join(why))
        return None

    # What is every such ACU's

    def timing(self, byte_time_s: float) -> Timing:
        return Timing(0.010, 0.010, 0.010)  # of your ACU; or `[acu] device_delay_s`, by DriverSettings

    def wire_bytes(self, command: Command) -> int:
        return 0

    def question(self, now_s: float) -> Command:
        return Poll()

    @property
    def is_outstanding(self) -> bool:
        return self._outstanding is not None

    def begin(self, command: Command, now_s: float) -> bytes:
        if self._outstanding is not None:
            raise RuntimeError("a command is outstanding")
        self._outstanding = command
        line = self._line(command)
        if not isinstance(line, str):
            self._at_once = line
            return b""
        self._owed_s.append(now_s)
        return line.encode() + b"\n"

    def receive(self, data: bytes, now_s: float) -> Reply | None:
        reply = None
        *lines, self._unread = (self._unread + data).split(b"\n")
        if len(self._unread) > LONGEST_LINE:
            self._unread, self.garbled_count = b"", self.garbled_count + 1
        for line in lines:
            reply = self._take(line.decode("ascii", "replace"), now_s) or reply
        if self._at_once is not None:
            reply, self._at_once, self._outstanding = self._at_once, None, None
        return reply

    def _take(self, line: str, now_s: float) -> Reply | None:
        if not self._owed_s:
            self.discarded_count += 1
            return None
        begun_s = self._owed_s.pop(0)
        if self._owed_s or self._outstanding is None or self._at_once is not None:  # an older command's
            self.late_count, self.late_s, self.late_at_s = self.late_count + 1, now_s - begun_s, now_s
            return None
        reply = self._reply(self._outstanding, line)
        if reply is None:
            self.garbled_count += 1
            self._owed_s.append(begun_s)
            return None
        self._outstanding = None
        return reply

    def fail(self, now_s: float) -> None:
        self._outstanding = self._at_once = None

    def forget(self) -> None:
        self._owed_s.clear()
        self._unread = b""


def _are_numbers(*texts: str) -> bool:
    try:
        return all(isfinite(float(text)) for text in texts)
    except ValueError:
        return False
