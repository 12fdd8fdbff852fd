"""Which mode or backup the present state needs: judged by the status, so a command repeats until it shows."""

from acu_daemon.acu.commands import STOW_MODES, AcuMode, Backup, Command, SelectBackup, SelectMode
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tracking.state_table import AUTOTRACKING, HOLDING, LED, TrackState

STANDBY = SelectMode(AcuMode.STANDBY)  # the one mode command that the ACU takes in stow: docs/adding-an-acu.md, Modes
UNDER_AUTOTRACK = AUTOTRACKING | HOLDING | {TrackState.ACQUIRE_TLE, TrackState.SEARCH}


def wanted_mode_command(state: ControlState, config: ControlConfig, *, is_settled: bool) -> Command | None:
    """The next command on the way to what the state needs; None when the ACU is there.

    The backup comes before the mode, and the registers are written before either (docs/adding-an-acu.md, Modes).
    is_settled: nothing was commanded for a while, so that what the status says of the mode is no transient.
    """
    status = state.intake.status
    if status is None:
        return None
    if state.tracking.track not in LED | UNDER_AUTOTRACK:
        return None
    is_stuck = status.mode is AcuMode.STANDBY and status.is_autotrack_selected  # selected again, it would not change
    if status.mode in STOW_MODES or (is_stuck and is_settled):
        return STANDBY
    if config.acu.has_backup and status.backup_selected is not Backup.REMOTE:
        return SelectBackup(Backup.REMOTE)
    if state.tracking.track in LED:
        return SelectMode(AcuMode.REMOTE) if status.mode is not AcuMode.REMOTE else None
    return SelectMode(AcuMode.AUTOTRACK) if not status.is_autotrack_selected else None
