"""Whether a status is to be believed.  Pure.

A check byte of XOR passes two characters that changed alike, and two that changed places.  So a status that shows an
axis where no drive can have brought it counts only when the next one agrees, and one that contradicts itself, whose
mode may be anything, when half a second of them agree.
"""

from acu_daemon.control.axis_watch import sky_scale
from acu_daemon.model import AxisLimits
from acu_daemon.protocol.messages import AcuMode, Backup, Status
from acu_daemon.units import wrap_180

MOVED_COUNT, CONTRADICTING_COUNT = 2, 5  # in a row, before they are believed
SLACK_DEG = 1.0  # on the sky: noise, and more is left to the gate of readings
RATE_MARGIN = 1.5  # of the drive's rate
CONFIRMED_COUNT = 3  # in a row show the antenna in one place: then it is there, and not garbled alike
CONFIRMED_S, CONFIRMED_DEG = 0.5, 0.5  # between two of them; on the sky, where no satellite is faster in a tick
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
        self._agreeing_count = 0
        self._last: tuple[float, Status] | None = None
        self._steady_count = 0  # in a row, the last one among them
        self.count = 0
        self.reason = ""

    def believes(self, status: Status, tai_s: float) -> bool:
        """Judge the next status, sampled at an instant; the reason of a doubt is in `reason`."""
        last, self._last = self._last, (tai_s, status)
        self._steady_count = 1 + (self._steady_count if last is not None and _is_steady(last, status, tai_s) else 0)
        wrong = contradictions(status)
        self.reason = f"contradicts itself: {', '.join(wrong)}" if wrong else self._moved(self._believed, status, tai_s)
        if not self.reason:
            self._doubted, self._agreeing_count = None, 0
        else:
            self._agreeing_count = 1 + (self._agreeing_count if self._agrees(status, wrong, tai_s) else 0)
            self._doubted = tai_s, status
            if self._agreeing_count < (CONTRADICTING_COUNT if wrong else MOVED_COUNT):
                self.count += 1
                return False
            if not wrong:
                self._steady_count = 0  # where it has jumped to is to be confirmed by more than those two
        self._believed = tai_s, status
        return True

    @property
    def is_confirmed(self) -> bool:
        """Whether the place in the last status is sure: after a silence one alone proves little."""
        return self._steady_count >= CONFIRMED_COUNT

    def _agrees(self, status: Status, wrong: tuple[str, ...], tai_s: float) -> bool:
        """Whether the last doubted status, just before this one, says the same."""
        doubted = self._doubted
        return doubted is not None and contradictions(doubted[1]) == wrong and not self._moved(doubted, status, tai_s)

    def _moved(self, before: tuple[float, Status] | None, status: Status, tai_s: float) -> str:
        """Which axis moved further than its drive can; empty: none, or nothing is known of before."""
        if before is None:
            return ""
        span_s = max(tai_s - before[0], 0.0)
        az_deg = abs(wrap_180(status.az_deg - before[1].az_deg))
        el_deg = abs(status.el_deg - before[1].el_deg)
        az_slack_deg = SLACK_DEG / sky_scale(status.el_deg)
        for name, moved_deg, slack_deg, limits in (
            ("azimuth", az_deg, az_slack_deg, self._azimuth),
            ("elevation", el_deg, SLACK_DEG, self._elevation),
        ):
            if moved_deg > slack_deg + RATE_MARGIN * limits.max_rate_deg_s * span_s:
                return f"{name} moved {moved_deg:.1f} deg in {span_s:.2f} s"
        return ""


def _is_steady(before: tuple[float, Status], status: Status, tai_s: float) -> bool:
    """Whether two in a row show the antenna in one place."""
    az_deg = abs(wrap_180(status.az_deg - before[1].az_deg)) * sky_scale(status.el_deg)
    el_deg = abs(status.el_deg - before[1].el_deg)
    return tai_s - before[0] <= CONFIRMED_S and max(az_deg, el_deg) <= CONFIRMED_DEG
