"""What an ACU of any kind answers (docs/adding-an-acu.md).  Angles are degrees in the encoder frame."""

from dataclasses import dataclass

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.model import AxisLimits


@dataclass(frozen=True, slots=True)
class AcuStatus:
    """Where the antenna is and what the ACU does.  What an ACU cannot show stays at its default.

    az_deg is in [0, 360).  turns_deg: the azimuth's continuous angle, from an ACU that counts its turns itself; else
    is_sector_high tells the half of its range, from one that has a sector bit.
    """

    az_deg: float
    el_deg: float
    mode: AcuMode
    agc_db: float = 0.0
    backup_selected: Backup = Backup.RATE
    is_autotrack_selected: bool = False
    is_acquired: bool = False  # the receiver has the signal, in any mode
    is_receiver_valid: bool = True
    is_remote_enabled: bool = True  # else the local panel has control
    has_azimuth_fault: bool = False
    has_elevation_fault: bool = False
    has_tilt_fault: bool = False
    has_interlock_fault: bool = False  # or any other: a register watchdog that has tripped shows here
    is_at_cw_limit: bool = False
    is_at_ccw_limit: bool = False
    is_at_up_limit: bool = False
    is_at_down_limit: bool = False
    is_sector_high: bool = False
    turns_deg: float | None = None
    tilt_deg: float | None = None  # of the tilt axis; None: there is none
    is_tilt_moving: bool = False
    contradictions: tuple[str, ...] = ()  # what in it cannot be true at once, in words

    @property
    def follows_registers(self) -> bool:
        """Whether commanded angles move the antenna in this mode."""
        return self.mode in (AcuMode.REMOTE, AcuMode.REMOTE_BACKUP) or (
            self.mode is AcuMode.ACQUIRE and self.backup_selected is Backup.REMOTE
        )


@dataclass(frozen=True, slots=True)
class Commanded:
    """The commanded angles as the ACU holds them."""

    az_deg: float
    el_deg: float


@dataclass(frozen=True, slots=True)
class AcuIdentity:
    """Which ACU this is.

    is_known: what it says of itself can be relied on.  One that is not may be garbled, and is asked again.
    azimuth, elevation: the limits that it says it has; rate and acceleration are not known, and infinite.
    """

    text: str
    is_known: bool
    is_simulated: bool
    azimuth: AxisLimits | None = None
    elevation: AxisLimits | None = None

    def __str__(self) -> str:
        return f"{self.text}{' SIMULATION' if self.is_simulated else ''}"


@dataclass(frozen=True, slots=True)
class FaultReport:
    """What is wrong, in words; and what of it the daemon acts on."""

    texts: tuple[str, ...] = ()
    is_emergency_stop: bool = False
    is_door_open: bool = False
    has_watchdog_tripped: bool = False


@dataclass(frozen=True, slots=True)
class TurnChoice:
    """On which turn a bearing is followed that two turns reach: the nearest, or one half of the range."""

    is_nearest: bool


@dataclass(frozen=True, slots=True)
class WatchdogTime:
    """The time of the register watchdog, s; 0: off."""

    after_s: float


@dataclass(frozen=True, slots=True)
class Done:
    """Received and understood; not that the antenna has done it."""


@dataclass(frozen=True, slots=True)
class Refused:
    """Not done, and nothing changed.  why: in words, where the ACU gives a reason.

    has_no_contact: what answers does not reach the antenna, so that this counts as silence.
    """

    why: str = ""
    has_no_contact: bool = False


def beyond_own_limits(identity: AcuIdentity, azimuth: AxisLimits, elevation: AxisLimits) -> str:
    """What of the configured limits the ACU does not reach, and what to do; empty: nothing, or it does not say."""
    told = []
    for name, ours, own in (("azimuth", azimuth, identity.azimuth), ("elevation", elevation, identity.elevation)):
        if own is not None and not own.min_deg <= ours.min_deg <= ours.max_deg <= own.max_deg:
            told.append(
                f"[acu.{name}] is {ours.min_deg:g} to {ours.max_deg:g} deg, the ACU goes from {own.min_deg:g} to "
                f"{own.max_deg:g} deg: set min_deg and max_deg within that"
            )
    return "; ".join(told)


Reply = AcuStatus | Commanded | AcuIdentity | FaultReport | TurnChoice | WatchdogTime | Done | Refused
