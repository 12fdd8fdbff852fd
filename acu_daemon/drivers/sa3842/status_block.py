"""The 23 characters of the status block (docs/protocol.md, Status block).  A malformed block raises FieldError."""

from functools import lru_cache
from typing import Any

from acu_daemon.drivers.sa3842.angles import azimuth_code, azimuth_deg, elevation_code, elevation_deg
from acu_daemon.drivers.sa3842.fields import FieldError, bits_value, hex_text, hex_value, nibble_values, nibbles_text
from acu_daemon.drivers.sa3842.messages import BACKUP_NUMBERS, MODE_NIBBLES, Status

STATUS_CHARS = 23
AGC_LSB_DB = 0.05
_AGC_MAX_CODE = 0xFFF
_MODES = {nibble: mode for mode, nibble in MODE_NIBBLES.items()}
_BACKUPS = {number: backup for backup, number in BACKUP_NUMBERS.items()}


def encode_status(status: Status) -> str:
    """Write a status block; an AGC out of range is held at its end."""
    s = status
    agc_code = min(max(round(s.agc_db / AGC_LSB_DB), 0), _AGC_MAX_CODE)
    nibbles = nibbles_text(
        MODE_NIBBLES[s.mode],
        BACKUP_NUMBERS[s.backup_selected] | bits_value(False, False, s.is_backup_active, s.is_autotrack_selected),
        bits_value(s.is_acquired, s.is_loss_latched, s.is_track_valid, s.is_receiver_valid),
        bits_value(s.is_remote_enabled, s.are_registers_written, s.are_registers_idle, s.has_changed),
        bits_value(s.has_azimuth_fault, s.has_elevation_fault, s.has_tilt_fault, s.has_interlock_fault),
        bits_value(s.is_at_cw_limit, s.is_at_ccw_limit, s.is_azimuth_clamped, s.is_sector_high),
        bits_value(s.is_at_up_limit, s.is_at_down_limit, s.is_elevation_clamped, s.is_stow_pin_in),
        bits_value(s.is_tilt_fitted, s.is_tilt_moving, s.is_at_tilt_upper_limit, s.is_at_tilt_lower_limit),
    )
    angles = (azimuth_code(s.az_deg), elevation_code(s.el_deg), elevation_code(s.tilt_deg))
    return "".join(hex_text(code, 4) for code in angles) + hex_text(agc_code, 3) + nibbles


def decode_status(text: str) -> Status:
    """Read a status block.  FieldError: wrong length, hex, nibble, mode or backup."""
    check_length(text)
    flags = decode_flags(text[15:])
    code = hex_value(text[:15])
    return Status(
        az_deg=azimuth_deg(code >> 44),
        el_deg=elevation_deg(code >> 28 & 0xFFFF),
        tilt_deg=elevation_deg(code >> 12 & 0xFFFF),
        agc_db=(code & 0xFFF) * AGC_LSB_DB,
        **flags,
    )


def check_length(text: str) -> None:
    """FieldError: not a status block."""
    if len(text) != STATUS_CHARS:
        raise FieldError(f"status block of {len(text)} characters, expected {STATUS_CHARS}")


@lru_cache(maxsize=64)
def decode_flags(text: str) -> dict[str, Any]:
    """Read the eight nibbles, which stay the same from one status to most of the next: fields of `Status`."""
    n1, n2, n3, n4, n5, n6, n7, n8 = nibble_values(text)
    mode, backup = _MODES.get(n1), _BACKUPS.get(n2 & 3)
    if mode is None or backup is None:
        raise FieldError(f"mode {n1} or backup {n2 & 3} does not exist")
    return {
        "mode": mode,
        "backup_selected": backup,
        "is_backup_active": bool(n2 & 4),
        "is_autotrack_selected": bool(n2 & 8),
        "is_acquired": bool(n3 & 1),
        "is_loss_latched": bool(n3 & 2),
        "is_track_valid": bool(n3 & 4),
        "is_receiver_valid": bool(n3 & 8),
        "is_remote_enabled": bool(n4 & 1),
        "are_registers_written": bool(n4 & 2),
        "are_registers_idle": bool(n4 & 4),
        "has_changed": bool(n4 & 8),
        "has_azimuth_fault": bool(n5 & 1),
        "has_elevation_fault": bool(n5 & 2),
        "has_tilt_fault": bool(n5 & 4),
        "has_interlock_fault": bool(n5 & 8),
        "is_at_cw_limit": bool(n6 & 1),
        "is_at_ccw_limit": bool(n6 & 2),
        "is_azimuth_clamped": bool(n6 & 4),
        "is_sector_high": bool(n6 & 8),
        "is_at_up_limit": bool(n7 & 1),
        "is_at_down_limit": bool(n7 & 2),
        "is_elevation_clamped": bool(n7 & 4),
        "is_stow_pin_in": bool(n7 & 8),
        "is_tilt_fitted": bool(n8 & 1),
        "is_tilt_moving": bool(n8 & 2),
        "is_at_tilt_upper_limit": bool(n8 & 4),
        "is_at_tilt_lower_limit": bool(n8 & 8),
    }
