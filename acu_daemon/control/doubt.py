"""Whether a status is to be believed.  Pure.

A check byte of XOR passes two characters that changed alike, and two that changed places.  So a status that contradicts
itself, or that shows an axis where no drive can have brought it, counts only when the next one says the same.
"""

from math import cos, radians

from acu_daemon.model import AxisLimits
from acu_daemon.protocol.messages import AcuMode, Backup, Status
from acu_daemon.units import wrap_180

SLACK_DEG = 1.0  # on the sky: noise, and more is left to the gate of readings
LEAST_COS_EL = 0.01
RATE_MARGIN = 1.5  # of the drive's rate
BACKUP_MODES = (AcuMode.RATE_MEMORY, AcuMode.POSITION_MEMORY, AcuMode.REMOTE_BACKUP)
SELECTED_MODES = (AcuMode.ACQUIRE, AcuMode.AUTOTRACK)  # autotrack is selected in these, and in the backup modes
DESELECTED_MODES = (AcuMode.STANDBY, AcuMode.MANUAL, AcuMode.REMOTE, AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)


def contradictions(status: Status) -> tuple[str, ...]:
    """What in a status block cannot be true at once (ICD sections 3 and 5)."""
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
        and (status.follows_registers or not status.are_registers_written),
        "mode and stow pin": (mode is AcuMode.STOWED) != status.is_stow_pin_in,
    }
    return tuple(name for name, is_so in found.items() if is_so)


class Doubt:
    """Remembers the last status that was believed, and the last one that was not.  Owned by the foreground."""

    def __init__(self, azimuth: AxisLimits, elevation: AxisLimits) -> None:
        self._azimuth, self._elevation = azimuth, elevation
        self._believed: tuple[float, Status] | None = None
        self._doubted: tuple[float, Status] | None = None
        self.count = 0
        self.reason = ""

    def believes(self, status: Status, tai_s: float) -> bool:
        """Judge the next status, sampled at an instant; the reason of a doubt is in `reason`."""
        doubted, self._doubted = self._doubted, None
        self.reason = self._why(self._believed, status, tai_s)
        if not self.reason or (doubted is not None and self._agree(doubted, status, tai_s)):
            self._believed = tai_s, status
            if self.reason:
                self._doubted = tai_s, status  # an ACU that always contradicts itself is believed from the second on
            return True
        self._doubted = tai_s, status
        self.count += 1
        return False

    def _agree(self, doubted: tuple[float, Status], status: Status, tai_s: float) -> bool:
        return contradictions(doubted[1]) == contradictions(status) and not self._moved(doubted, status, tai_s)

    def _why(self, believed: tuple[float, Status] | None, status: Status, tai_s: float) -> str:
        wrong = contradictions(status)
        if wrong:
            return f"contradicts itself: {', '.join(wrong)}"
        return "" if believed is None else self._moved(believed, status, tai_s)

    def _moved(self, before: tuple[float, Status], status: Status, tai_s: float) -> str:
        """Which axis moved further than its drive can."""
        span_s = max(tai_s - before[0], 0.0)
        az_deg = abs(wrap_180(status.az_deg - before[1].az_deg))
        el_deg = abs(status.el_deg - before[1].el_deg)
        az_slack_deg = SLACK_DEG / max(cos(radians(status.el_deg)), LEAST_COS_EL)
        for name, moved_deg, slack_deg, limits in (
            ("azimuth", az_deg, az_slack_deg, self._azimuth),
            ("elevation", el_deg, SLACK_DEG, self._elevation),
        ):
            if moved_deg > slack_deg + RATE_MARGIN * limits.max_rate_deg_s * span_s:
                return f"{name} moved {moved_deg:.1f} deg in {span_s:.2f} s"
        return ""
