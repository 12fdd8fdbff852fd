"""Which mode or backup is asked for: by the state and by what the status shows, until it shows it."""

from dataclasses import replace

import pytest
from memories import remembering
from test_tick import CONFIG

from acu_daemon.acu.commands import STOW_MODES, AcuMode, Backup, Command, SelectBackup, SelectMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tracking.mode_selection import UNDER_AUTOTRACK, wanted_mode_command
from acu_daemon.control.tracking.state_table import LED, TrackState

STANDBY, REMOTE, AUTOTRACK = (SelectMode(mode) for mode in (AcuMode.STANDBY, AcuMode.REMOTE, AcuMode.AUTOTRACK))
OTHERS = sorted(set(AcuMode) - set(STOW_MODES), key=lambda one: one.name)
BARE = replace(CONFIG, acu=replace(CONFIG.acu, has_backup=False))


def asked(
    track: TrackState,
    mode: AcuMode,
    *,
    is_selected: bool = False,
    backup: Backup = Backup.REMOTE,
    is_settled: bool = True,
    config: ControlConfig = CONFIG,
) -> Command | None:
    status = AcuStatus(10.0, 40.0, mode, is_autotrack_selected=is_selected, backup_selected=backup)
    return wanted_mode_command(remembering(status=status, track=track), config, is_settled=is_settled)


@pytest.mark.parametrize("mode", OTHERS)
@pytest.mark.parametrize("track", sorted(LED))
def test_where_the_antenna_is_led_it_is_remote_itself_that_is_asked_for(track: TrackState, mode: AcuMode) -> None:
    """ACQUIRE and REMOTE_BACKUP follow the registers too, but autotrack would take the antenna again by itself."""
    assert asked(track, mode) == (None if mode is AcuMode.REMOTE else REMOTE)


@pytest.mark.parametrize("mode", OTHERS)
@pytest.mark.parametrize("track", sorted(UNDER_AUTOTRACK))
def test_where_the_signal_leads_autotrack_is_selected_once(track: TrackState, mode: AcuMode) -> None:
    assert asked(track, mode) == AUTOTRACK
    assert asked(track, mode, is_selected=True) == (STANDBY if mode is AcuMode.STANDBY else None)


@pytest.mark.parametrize("track", sorted(LED | UNDER_AUTOTRACK))
@pytest.mark.parametrize("mode", sorted(STOW_MODES, key=lambda one: one.name))
def test_out_of_a_stow_it_is_standby_first(track: TrackState, mode: AcuMode) -> None:
    assert asked(track, mode, backup=Backup.RATE, is_settled=False) == STANDBY


@pytest.mark.parametrize("track", sorted(LED | UNDER_AUTOTRACK))
def test_the_backup_comes_before_the_mode_where_there_is_one(track: TrackState) -> None:
    for backup in set(Backup) - {Backup.REMOTE}:
        assert asked(track, AcuMode.MANUAL, backup=backup) == SelectBackup(Backup.REMOTE)
        assert asked(track, AcuMode.MANUAL, backup=backup, config=BARE) == (REMOTE if track in LED else AUTOTRACK)


def test_a_standby_with_autotrack_selected_is_left_once_it_is_no_transient() -> None:
    state = TrackState.ACQUIRE_TLE
    assert asked(state, AcuMode.STANDBY, is_selected=True, backup=Backup.RATE) == STANDBY
    later = asked(state, AcuMode.STANDBY, is_selected=True, backup=Backup.RATE, is_settled=False)
    assert later == SelectBackup(Backup.REMOTE)
    assert asked(state, AcuMode.STANDBY, is_selected=True, is_settled=False) is None


@pytest.mark.parametrize("track", sorted(set(TrackState) - LED - UNDER_AUTOTRACK))
def test_in_other_states_and_without_a_status_nothing_is_asked_for(track: TrackState) -> None:
    assert asked(track, AcuMode.STANDBY, backup=Backup.RATE) is None
    assert wanted_mode_command(remembering(track=TrackState.PREPOSITION), CONFIG, is_settled=True) is None
