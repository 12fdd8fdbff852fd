"""SIMULATION of the ACU's faults: what is wrong, what stays until FAULT RESET (docs/protocol.md, Fault detail)."""

from dataclasses import fields, replace
from typing import Literal

from acu_daemon.drivers.sa3842.messages import Faults

FaultNibble = Literal["azimuth", "elevation", "tilt", "encoders", "interlock", "system", "receiver"]
WATCHDOG_BIT = 1
NO_AGC_BIT = 0
_NONE = Faults()
_DRIVES_OFF: tuple[FaultNibble, ...] = ("azimuth", "elevation", "tilt", "encoders", "interlock", "system")


class FaultMemory:
    """Faults present and remembered; stops_the_drives: one is present that switches the drives off.

    Faults of the receiver pass by themselves and stop no drive.
    """

    def __init__(self) -> None:
        self.present = _NONE
        self.remembered = _NONE
        self.stops_the_drives = False

    def begin(self, nibble: FaultNibble, bit: int) -> None:
        """Something breaks."""
        self._set_present(_with_bit(self.present, nibble, bit))
        self.note(nibble, bit)

    def note(self, nibble: FaultNibble, bit: int) -> None:
        """Remember an event that does not last."""
        self.remembered = _with_bit(self.remembered, nibble, bit)

    def end(self, nibble: FaultNibble, bit: int) -> None:
        """It is mended; the memory stays."""
        self._set_present(replace(self.present, **{nibble: getattr(self.present, nibble) & ~(1 << bit)}))

    def _set_present(self, present: Faults) -> None:
        self.present = present
        self.stops_the_drives = any(getattr(present, nibble) for nibble in _DRIVES_OFF)

    def detail(self, *, is_receiver_valid: bool) -> Faults:
        """The reply to 3Ah."""
        if is_receiver_valid:
            return self.remembered
        return _with_bit(self.remembered, "receiver", NO_AGC_BIT)

    def reset(self) -> bool:
        """FAULT RESET; False while a fault persists."""
        if self.stops_the_drives:
            return False
        self.remembered = self.present
        return True

    @property
    def has_any(self) -> bool:
        """Whether anything is remembered."""
        return any(getattr(self.remembered, item.name) for item in fields(Faults))


def _with_bit(faults: Faults, nibble: FaultNibble, bit: int) -> Faults:
    return replace(faults, **{nibble: getattr(faults, nibble) | 1 << bit})
