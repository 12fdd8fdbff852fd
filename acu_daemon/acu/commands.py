"""What an ACU of any kind is asked and told (docs/adding-an-acu.md).  Angles are degrees in the encoder frame.

The commanded angles are what a host last told the ACU, its command registers: followed only in the modes that say so.
"""

from dataclasses import dataclass, fields
from enum import Enum, auto


class AcuMode(Enum):
    """What an ACU does with the antenna."""

    STANDBY = auto()  # stands
    MANUAL = auto()  # the local panel moves it
    REMOTE = auto()  # follows the commanded angles
    ACQUIRE = auto()  # autotrack is selected, no signal yet: follows them if the backup is remote, else stands
    AUTOTRACK = auto()  # follows the signal
    RATE_MEMORY = auto()  # a backup: goes on at the last rates
    POSITION_MEMORY = auto()  # a backup: stands
    REMOTE_BACKUP = auto()  # a backup: follows the commanded angles
    STOWING = auto()
    STOWED = auto()
    FAULT = auto()  # drives off


class Backup(Enum):
    """What steers after a loss of signal."""

    RATE = auto()  # the last rates
    POSITION = auto()  # none: the antenna stands
    REMOTE = auto()  # the commanded angles


@dataclass(frozen=True, slots=True)
class Identify:
    """Ask which ACU this is."""


@dataclass(frozen=True, slots=True)
class Poll:
    """Ask for the status."""


@dataclass(frozen=True, slots=True)
class PointAt:
    """Command angles; azimuth continuous over the turns of the cable."""

    az_deg: float
    el_deg: float


@dataclass(frozen=True, slots=True)
class PointAndPoll:
    """Command angles and ask for the status after that: the normal cycle.  tilt_deg: None leaves the tilt as it is."""

    az_deg: float
    el_deg: float
    tilt_deg: float | None = None


@dataclass(frozen=True, slots=True)
class ReadCommanded:
    """Ask for the commanded angles."""


@dataclass(frozen=True, slots=True)
class SelectMode:
    """Select STANDBY, REMOTE or AUTOTRACK; no other mode can be selected."""

    mode: AcuMode


@dataclass(frozen=True, slots=True)
class SelectBackup:
    """Select what steers after a loss of signal."""

    backup: Backup


@dataclass(frozen=True, slots=True)
class Stop:
    """Rates to zero, STANDBY."""


@dataclass(frozen=True, slots=True)
class Stow:
    """Drive to the stow position, straight, and stay there."""


@dataclass(frozen=True, slots=True)
class ReadFaults:
    """Ask what a fault is."""


@dataclass(frozen=True, slots=True)
class ReadTurnChoice:
    """Ask on which turn a bearing is followed that two turns of the cable reach."""


@dataclass(frozen=True, slots=True)
class FreeTurnChoice:
    """Let it be followed on the nearest one."""


@dataclass(frozen=True, slots=True)
class ReadWatchdog:
    """Ask for the time of the register watchdog, which stops the antenna when no angles are commanded for so long."""


@dataclass(frozen=True, slots=True)
class SetWatchdog:
    """Set it; 0: off."""

    after_s: float


Command = (
    Identify
    | Poll
    | PointAt
    | PointAndPoll
    | ReadCommanded
    | SelectMode
    | SelectBackup
    | Stop
    | Stow
    | ReadFaults
    | ReadTurnChoice
    | FreeTurnChoice
    | ReadWatchdog
    | SetWatchdog
)
STOW_MODES = (AcuMode.STOWING, AcuMode.STOWED)
READS = (Identify, Poll, ReadCommanded, ReadFaults, ReadTurnChoice, ReadWatchdog)  # they change nothing


def command_text(command: object) -> str:
    """A command in a few words, for people."""
    values = [getattr(command, field.name) for field in fields(command)]  # type: ignore[arg-type]
    return " ".join([type(command).__name__, *(_value_text(value) for value in values if value is not None)])


def _value_text(value: object) -> str:
    if isinstance(value, Enum):
        return value.name
    return f"{value:.3f}" if isinstance(value, float) else str(value)
