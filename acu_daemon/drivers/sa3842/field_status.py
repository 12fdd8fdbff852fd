"""The status block in the words of the field, and what in it cannot be true at once."""

from dataclasses import fields
from functools import lru_cache
from typing import Any

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.drivers.sa3842.angles import azimuth_deg, elevation_deg
from acu_daemon.drivers.sa3842.fields import hex_value
from acu_daemon.drivers.sa3842.messages import Status
from acu_daemon.drivers.sa3842.status_block import AGC_LSB_DB, check_length, decode_flags

BACKUP_MODES = (AcuMode.RATE_MEMORY, AcuMode.POSITION_MEMORY, AcuMode.REMOTE_BACKUP)
SELECTED_MODES = (AcuMode.ACQUIRE, AcuMode.AUTOTRACK)  # autotrack is selected in these, and in the backup modes
DESELECTED_MODES = (AcuMode.STANDBY, AcuMode.MANUAL, AcuMode.REMOTE, AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)
_SHARED = {field.name for field in fields(AcuStatus)} & {field.name for field in fields(Status)} - {
    "az_deg",
    "el_deg",
    "agc_db",
    "tilt_deg",
}


def read_field_status(text: str) -> AcuStatus:
    """Read a status block into field words.  FieldError: wrong length, hex, nibble, mode or backup."""
    check_length(text)
    flags = _field_flags(text[15:])
    code = hex_value(text[:15])
    return AcuStatus(
        az_deg=azimuth_deg(code >> 44),
        el_deg=elevation_deg(code >> 28 & 0xFFFF),
        agc_db=(code & 0xFFF) * AGC_LSB_DB,
        tilt_deg=elevation_deg(code >> 12 & 0xFFFF) if _is_tilt_fitted(text[15:]) else None,
        **flags,
    )


def field_status(status: Status) -> AcuStatus:
    """The same of a status that was read."""
    tilt_deg = status.tilt_deg if status.is_tilt_fitted else None
    return AcuStatus(status.az_deg, status.el_deg, agc_db=status.agc_db, tilt_deg=tilt_deg, **_flags_of(status))


@lru_cache(maxsize=64)
def _is_tilt_fitted(text: str) -> bool:
    return bool(decode_flags(text)["is_tilt_fitted"])


@lru_cache(maxsize=64)
def _field_flags(text: str) -> dict[str, Any]:
    return _flags_of(Status(0.0, 0.0, **decode_flags(text)))


def _flags_of(status: Status) -> dict[str, Any]:
    return {name: getattr(status, name) for name in _SHARED} | {"contradictions": contradictions(status)}


def contradictions(status: Status) -> tuple[str, ...]:
    """What in a status block cannot be true at once (docs/protocol.md, A status that cannot be true)."""
    mode, is_selected = status.mode, status.is_autotrack_selected
    has_fault = (
        status.has_azimuth_fault or status.has_elevation_fault or status.has_tilt_fault or status.has_interlock_fault
    )
    found = {
        "mode and control": (mode is AcuMode.MANUAL) == status.is_remote_enabled and mode is not AcuMode.FAULT,
        "mode and backup": (mode in BACKUP_MODES) != status.is_backup_active
        or (mode in BACKUP_MODES and (mode is AcuMode.REMOTE_BACKUP) != (status.backup_selected is Backup.REMOTE)),
        "mode and autotrack": is_selected if mode in DESELECTED_MODES else not is_selected,
        "mode and fault": mode is AcuMode.FAULT and not has_fault,
        "mode and registers": status.are_registers_idle
        and (_follows_registers(status) or not status.are_registers_written),
        "mode and stow pin": (mode is AcuMode.STOWED) != status.is_stow_pin_in,
    }
    return tuple(name for name, is_so in found.items() if is_so)


def _follows_registers(status: Status) -> bool:
    return AcuStatus(0.0, 0.0, status.mode, backup_selected=status.backup_selected).follows_registers
