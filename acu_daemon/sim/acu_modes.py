"""SIMULATION of the ACU's modes: autotrack, its backups and their timers (docs/protocol.md, Behaviour).  No angles."""

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.sim.parameters import Parameters

HELD_FAST = (AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)  # REMOTE and AUTOTRACK cannot be selected from here
BACKUP_MODES = (AcuMode.RATE_MEMORY, AcuMode.POSITION_MEMORY, AcuMode.REMOTE_BACKUP)
_WAITS_FOR_SIGNAL = (AcuMode.ACQUIRE, *BACKUP_MODES)
_DUE_EPS_S = 1e-6


class Modes:
    """Mode, selected backup and what goes with them.  now_s is any time that rises with the servo's ticks."""

    def __init__(self, parameters: Parameters, *, is_local: bool) -> None:
        self._parameters = parameters
        self.mode = AcuMode.MANUAL if is_local else AcuMode.STANDBY
        self.backup = Backup.RATE
        self.is_remote_enabled = not is_local
        self.is_autotrack_selected = False
        self.is_loss_latched = False
        self.is_track_valid = False
        self.are_registers_written = False
        self.entered_s = 0.0
        self._was_track_valid = False
        self._came_through_acquire = False
        self._mode_before = AcuMode.STANDBY

    @property
    def follows_registers(self) -> bool:
        """Whether the antenna follows the registers."""
        mode = self.mode
        return (
            mode is AcuMode.REMOTE
            or mode is AcuMode.REMOTE_BACKUP
            or (mode is AcuMode.ACQUIRE and self.backup is Backup.REMOTE)
        )

    def enter(self, mode: AcuMode, now_s: float) -> None:
        """Change the mode; what belongs to the old one ends."""
        if mode is self.mode:
            return
        self.mode, self.entered_s = mode, now_s
        self.are_registers_written = False
        self.is_track_valid = False

    def leave_autotrack(self, mode: AcuMode, now_s: float) -> None:
        """Change the mode and deselect autotrack."""
        self.is_autotrack_selected = False
        self.enter(mode, now_s)

    def select(self, mode: AcuMode, has_signal: bool, now_s: float) -> bool:
        """MODE SELECT; whether it is accepted."""
        if self.mode in HELD_FAST and mode is not AcuMode.STANDBY:
            return False
        if mode is not AcuMode.AUTOTRACK:
            if self.mode is not AcuMode.FAULT:
                self.leave_autotrack(mode, now_s)
        elif not self.is_autotrack_selected:
            self.is_autotrack_selected = True
            self._mode_before = self.mode
            self._came_through_acquire = not has_signal
            self.enter(AcuMode.AUTOTRACK if has_signal else AcuMode.ACQUIRE, now_s)
        return True

    def select_backup(self, backup: Backup, now_s: float) -> None:
        """BACKUP SELECT; acts at once in the modes it chooses between."""
        self.backup = backup
        if self.mode in BACKUP_MODES:
            self.enter(self._backup_mode(), now_s)

    def _backup_mode(self) -> AcuMode:
        if self.backup is Backup.REMOTE:
            return AcuMode.REMOTE_BACKUP
        if self.backup is Backup.RATE and self._was_track_valid:
            return AcuMode.RATE_MEMORY
        return AcuMode.POSITION_MEMORY

    def stop(self, now_s: float) -> None:
        """STOP; no effect in STOWED and FAULT, and the local panel keeps its control."""
        if self.mode not in (AcuMode.STOWED, AcuMode.FAULT, AcuMode.MANUAL):
            self.leave_autotrack(AcuMode.STANDBY, now_s)

    def stow(self, now_s: float) -> bool:
        """STOW; whether it is accepted: not in FAULT."""
        if self.mode is AcuMode.FAULT:
            return False
        if self.mode is not AcuMode.STOWED:
            self.leave_autotrack(AcuMode.STOWING, now_s)
        return True

    def set_local(self, is_local: bool, now_s: float) -> None:
        """The local panel takes control, or gives it back."""
        self.is_remote_enabled = not is_local
        if self.mode is not AcuMode.FAULT and is_local != (self.mode is AcuMode.MANUAL):
            self.leave_autotrack(AcuMode.MANUAL if is_local else AcuMode.STANDBY, now_s)

    def recover(self, now_s: float) -> None:
        """A fault was reset."""
        self.leave_autotrack(AcuMode.STANDBY if self.is_remote_enabled else AcuMode.MANUAL, now_s)

    def step(self, has_signal: bool, now_s: float) -> None:
        """One tick of the servo: signal and timers."""
        if not self.is_autotrack_selected:
            return
        mode = self.mode
        if mode is AcuMode.AUTOTRACK:
            if has_signal:
                self.is_track_valid = self._has_lasted(self._parameters.track_valid_s, now_s)
            else:
                self.is_loss_latched = True
                self._was_track_valid = self._has_lasted(self._parameters.track_valid_s, now_s)
                self.enter(self._backup_mode(), now_s)
        elif has_signal and mode in _WAITS_FOR_SIGNAL:
            self.enter(AcuMode.AUTOTRACK, now_s)
        elif (limit_s := self._memory_s(mode)) is not None and self._has_lasted(limit_s, now_s):
            self._end_memory(now_s)

    def _memory_s(self, mode: AcuMode) -> float | None:
        if mode is AcuMode.RATE_MEMORY:
            return self._parameters.rate_memory_s
        return self._parameters.position_memory_s if mode is AcuMode.POSITION_MEMORY else None

    def _has_lasted(self, time_s: float, now_s: float) -> bool:
        return now_s - self.entered_s >= time_s - _DUE_EPS_S

    def _end_memory(self, now_s: float) -> None:
        if self._came_through_acquire:
            self.enter(AcuMode.ACQUIRE, now_s)
        else:
            self.leave_autotrack(self._mode_before, now_s)
