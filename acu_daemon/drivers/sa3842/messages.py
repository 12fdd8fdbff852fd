"""What host and ACU say to each other, as frozen values (docs/protocol.md, Status block and Messages).

Angles are degrees in the encoder frame.  The tilt of a command is a wire code, since the host sends back the register
it once read, unchanged.
"""

from dataclasses import dataclass

from acu_daemon.acu.commands import AcuMode, Backup, Identify, Poll, ReadFaults, SelectBackup, SelectMode, Stop, Stow


@dataclass(frozen=True, slots=True)
class WriteRegisters:
    """Write the command registers; without a tilt code the tilt register stays as it is."""

    az_deg: float
    el_deg: float
    tilt_code: int | None = None


@dataclass(frozen=True, slots=True)
class ReadRegisters:
    """Ask for the command registers and the count of writes."""


@dataclass(frozen=True, slots=True)
class ClearChange:
    """Clear the CHANGE bit and the latched loss."""


@dataclass(frozen=True, slots=True)
class ResetFault:
    """Leave FAULT, if the fault is gone."""


@dataclass(frozen=True, slots=True)
class ReadParameter:
    """Ask for a parameter by its one-letter name."""

    name: str


@dataclass(frozen=True, slots=True)
class WriteParameter:
    """Set a parameter to a 16-bit code (docs/protocol.md, Parameters: 0.02 s, 360/65536 deg, 0.05 dB)."""

    name: str
    code: int


@dataclass(frozen=True, slots=True)
class WriteAndPoll:
    """Write the command registers and ask for the status block sampled after that: the normal cycle."""

    az_deg: float
    el_deg: float
    tilt_code: int = 0


Command = (
    Identify
    | Poll
    | WriteRegisters
    | ReadRegisters
    | SelectMode
    | SelectBackup
    | Stow
    | Stop
    | ClearChange
    | ResetFault
    | ReadFaults
    | ReadParameter
    | WriteParameter
    | WriteAndPoll
)


MODE_NIBBLES = {
    AcuMode.STANDBY: 0,
    AcuMode.MANUAL: 1,
    AcuMode.REMOTE: 2,
    AcuMode.ACQUIRE: 3,
    AcuMode.AUTOTRACK: 4,
    AcuMode.RATE_MEMORY: 5,
    AcuMode.POSITION_MEMORY: 6,
    AcuMode.REMOTE_BACKUP: 7,
    AcuMode.STOWING: 8,
    AcuMode.STOWED: 9,
    AcuMode.FAULT: 15,
}
BACKUP_NUMBERS = {Backup.RATE: 0, Backup.POSITION: 1, Backup.REMOTE: 2}


@dataclass(frozen=True, slots=True)
class Status:
    """The status block.  az_deg is in [0, 360), is_sector_high tells the turn; agc_db steps by 0.05 dB."""

    az_deg: float
    el_deg: float
    mode: AcuMode
    tilt_deg: float = 0.0
    agc_db: float = 0.0
    backup_selected: Backup = Backup.RATE
    is_backup_active: bool = False
    is_autotrack_selected: bool = False
    is_acquired: bool = False
    is_loss_latched: bool = False
    is_track_valid: bool = False
    is_receiver_valid: bool = True
    is_remote_enabled: bool = True
    are_registers_written: bool = False
    are_registers_idle: bool = False
    has_changed: bool = False
    has_azimuth_fault: bool = False
    has_elevation_fault: bool = False
    has_tilt_fault: bool = False
    has_interlock_fault: bool = False
    is_at_cw_limit: bool = False
    is_at_ccw_limit: bool = False
    is_azimuth_clamped: bool = False
    is_sector_high: bool = False
    is_at_up_limit: bool = False
    is_at_down_limit: bool = False
    is_elevation_clamped: bool = False
    is_stow_pin_in: bool = False
    is_tilt_fitted: bool = False
    is_tilt_moving: bool = False
    is_at_tilt_upper_limit: bool = False
    is_at_tilt_lower_limit: bool = False


@dataclass(frozen=True, slots=True)
class RegisterContents:
    """The command registers; count is the number of accepted writes modulo 256."""

    az_deg: float
    el_deg: float
    tilt_code: int
    count: int


@dataclass(frozen=True, slots=True)
class Identity:
    """Which ACU this is: the model's digits and two characters of its variant."""

    model: str
    variant: str

    @property
    def is_known(self) -> bool:
        """Whether docs/protocol.md names it; two characters that changed alike make no simulated one of a real one."""
        return self.model == "3842" and self.variant in ("10", "20", "S1", "S2")

    @property
    def is_simulated(self) -> bool:
        return self.variant.startswith("S")

    @property
    def has_tilt(self) -> bool:
        return self.variant in ("20", "S2")

    def __str__(self) -> str:
        return f"SA-{self.model} {self.variant}{' SIMULATION' if self.is_simulated else ''}"


@dataclass(frozen=True, slots=True)
class Ack:
    """Received and understood; not: done."""


@dataclass(frozen=True, slots=True)
class Nak:
    """Refused, without a reason, nothing changed."""


@dataclass(frozen=True, slots=True)
class Faults:
    """Fault detail: eight nibbles in the order of docs/protocol.md, Fault detail."""

    azimuth: int = 0
    elevation: int = 0
    tilt: int = 0
    encoders: int = 0
    interlock: int = 0
    system: int = 0
    receiver: int = 0
    reserved: int = 0

    def texts(self) -> tuple[str, ...]:
        """Name every fault that is set, for people."""
        nibbles = (self.azimuth, self.elevation, self.tilt, self.encoders, self.interlock, self.system, self.receiver)
        return tuple(
            text
            for nibble, names in zip(nibbles, _FAULT_NAMES, strict=True)
            for bit, text in enumerate(names)
            if nibble >> bit & 1
        )


def _drive_faults(axis: str) -> tuple[str, ...]:
    return tuple(f"{axis} {fault}" for fault in ("over-current", "over-temperature", "runaway", "jam"))


_FAULT_NAMES = (
    _drive_faults("azimuth"),
    _drive_faults("elevation"),
    _drive_faults("tilt"),
    ("azimuth encoder", "elevation encoder", "tilt encoder", "encoder reference"),
    ("emergency stop", "door open", "pedestal power off", "brake on"),
    ("memory", "register watchdog", "power", "communication"),
    ("no AGC", "demodulator"),
)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter's one-letter name and its 16-bit code."""

    name: str
    code: int


@dataclass(frozen=True, slots=True)
class Garbled:
    """Bytes that are no good reply; the reason is for people."""

    reason: str


Reply = Status | RegisterContents | Identity | Ack | Nak | Faults | Parameter
