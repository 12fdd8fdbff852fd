"""An imaginary ACU with autotrack that tags each line: how docs/adding-an-acu.md does for one unlike the others.

    host   @07 status | goto AZ EL | mode track      ACU   @07 AZ EL MODE SIGNAL      or: @07 error WHY

A bearing of three decimals, modes of its own words, one line out and one back, in any order: the tag tells.
"""

from math import isfinite

from acu_daemon.acu.capabilities import Capabilities
from acu_daemon.acu.commands import (
    AcuMode,
    Backup,
    Command,
    Identify,
    PointAndPoll,
    PointAt,
    Poll,
    ReadFaults,
    SelectBackup,
    SelectMode,
    Stop,
)
from acu_daemon.acu.driver import Timing
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Done, FaultReport, Refused, Reply

LONGEST_LINE = 100
MODES = {
    "halt": AcuMode.STANDBY,
    "program": AcuMode.REMOTE,
    "seek": AcuMode.ACQUIRE,
    "track": AcuMode.AUTOTRACK,
    "bridge": AcuMode.REMOTE_BACKUP,
}
SELECTED = (AcuMode.ACQUIRE, AcuMode.AUTOTRACK, AcuMode.REMOTE_BACKUP)


class TaggedDriver:
    """Autotrack that bridges a loss by the commanded angles, always."""

    capabilities = Capabilities(
        has_sector_bit=False,
        has_turn_choice=False,
        has_register_watchdog=False,
        has_stow=False,
        has_read_back=False,
        angle_step_deg=0.001,
    )
    extra_bytes = 0
    must_poll, free_s, is_sure = False, 0.0, True  # the tag tells late replies apart

    def __init__(self) -> None:
        self._outstanding: Command | None = None
        self._at_once: Reply | None = None
        self._tag, self._unread = 0, b""
        self._begun_s: dict[int, float] = {}
        self.discarded_count = self.garbled_count = self.late_count = 0
        self.late_s, self.late_at_s = 0.0, float("-inf")

    def timing(self, byte_time_s: float) -> Timing:
        return Timing(0.010, 0.010, 0.020)

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
        self._outstanding, self._tag = command, (self._tag + 1) % 1000
        match command:
            case Poll() | Identify():
                words = "status" if command == Poll() else "name"
            case PointAt(az_deg, el_deg) | PointAndPoll(az_deg, el_deg):
                words = f"goto {round(az_deg, 3) % 360.0:.3f} {el_deg:.3f}"
            case Stop() | SelectMode(AcuMode.STANDBY):
                words = "mode halt"
            case SelectMode(AcuMode.REMOTE):
                words = "mode program"
            case SelectMode(AcuMode.AUTOTRACK):
                words = "mode track"
            case SelectBackup(Backup.REMOTE):
                self._at_once = Done()
                return b""
            case ReadFaults():
                self._at_once = FaultReport()
                return b""
            case _:
                self._at_once = Refused(f"this ACU has no {type(command).__name__}")
                return b""
        self._begun_s[self._tag] = now_s
        return f"@{self._tag:03d} {words}\n".encode()

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
        tag, *words = line.split() or [""]
        if not (tag.startswith("@") and tag[1:].isascii() and tag[1:].isdigit()):
            self.garbled_count += 1
            return None
        begun_s = self._begun_s.pop(int(tag[1:]), None)
        if begun_s is None:
            self.discarded_count += 1
            return None
        if self._outstanding is None or self._at_once is not None or int(tag[1:]) != self._tag:
            self.late_count, self.late_s, self.late_at_s = self.late_count + 1, now_s - begun_s, now_s
            return None
        reply = self._reply(self._outstanding, words)
        if reply is None:
            self.garbled_count += 1
            return None
        self._outstanding = None
        return reply

    def _reply(self, command: Command, words: list[str]) -> Reply | None:
        match command, words:
            case _, ["error", *why]:
                return Refused(" ".join(why))
            case Identify(), ["name", *names]:
                return AcuIdentity(" ".join(names), is_known=True, is_simulated="simulated" in names)
            case ((Poll() | PointAndPoll()), [az, el, mode, signal]) if mode in MODES and _are_numbers(az, el):
                return AcuStatus(
                    float(az) % 360.0,
                    float(el),
                    MODES[mode],
                    backup_selected=Backup.REMOTE,
                    is_autotrack_selected=MODES[mode] in SELECTED,
                    is_acquired=signal == "signal",
                )
            case ((PointAt() | SelectMode() | Stop()), [_, _, _, _]):
                return Done()
        return None

    def fail(self, now_s: float) -> None:
        self._outstanding = self._at_once = None

    def forget(self) -> None:
        self._begun_s.clear()
        self._unread = b""


def _are_numbers(*texts: str) -> bool:
    try:
        return all(isfinite(float(text)) for text in texts)
    except ValueError:
        return False
