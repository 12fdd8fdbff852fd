"""SIMULATION: each step of the ACU's modes, and of the loop that follows a signal, by itself."""

from math import cos, radians
from typing import Any

import pytest
from fake_sky import AZIMUTH, ELEVATION

from acu_daemon.acu.commands import AcuMode, Backup
from acu_daemon.sim.acu_modes import BACKUP_MODES, HELD_FAST, Modes
from acu_daemon.sim.autotrack import BANDWIDTH_RAD_S, CLOSING_GAIN_PER_S, Autotrack, AxisTracker
from acu_daemon.sim.parameters import Parameters
from acu_daemon.sim.pedestal import BRAKING_SHARE, STEP_S, Axis, approach_rate_deg_s
from acu_daemon.sim.receiver import Offset

VALID_S, RATE_S, POSITION_S = 5.0, 15.0, 16.0
MODES = list(AcuMode)


def modes(mode: AcuMode = AcuMode.STANDBY, *, is_local: bool = False, **more: Any) -> Modes:
    parameters = Parameters(ELEVATION)
    parameters.write("P", round(POSITION_S / 0.02))
    made = Modes(parameters, is_local=is_local)
    made.mode = mode
    for name, value in more.items():
        assert hasattr(made, name)
        setattr(made, name, value)
    return made


@pytest.mark.parametrize("is_local", [True, False])
def test_it_begins_in_standby_or_under_the_local_panel(is_local: bool) -> None:
    made = Modes(Parameters(ELEVATION), is_local=is_local)
    assert made.mode is (AcuMode.MANUAL if is_local else AcuMode.STANDBY)
    assert (made.is_remote_enabled, made.backup) == (not is_local, Backup.RATE)
    nothing = made.is_autotrack_selected, made.is_loss_latched, made.is_track_valid, made.are_registers_written
    assert (nothing, made.entered_s) == ((False,) * 4, 0.0)


@pytest.mark.parametrize("backup", list(Backup))
@pytest.mark.parametrize("mode", MODES)
def test_registers_are_followed_in_remote_its_backup_and_while_it_waits_with_it(mode: AcuMode, backup: Backup) -> None:
    follows = mode in (AcuMode.REMOTE, AcuMode.REMOTE_BACKUP)
    follows |= mode is AcuMode.ACQUIRE and backup is Backup.REMOTE
    assert modes(mode, backup=backup).follows_registers == follows


@pytest.mark.parametrize("mode", [AcuMode.REMOTE, AcuMode.STANDBY])
def test_what_belongs_to_a_mode_ends_with_it_and_entering_it_again_changes_nothing(mode: AcuMode) -> None:
    made = modes(AcuMode.REMOTE, are_registers_written=True, is_track_valid=True, entered_s=1.0)
    made.enter(mode, 7.0)
    is_same = mode is AcuMode.REMOTE
    assert (made.mode, made.entered_s) == (mode, 1.0 if is_same else 7.0)
    assert (made.are_registers_written, made.is_track_valid) == (is_same, is_same)


@pytest.mark.parametrize("to", [AcuMode.STANDBY, AcuMode.REMOTE, AcuMode.AUTOTRACK])
@pytest.mark.parametrize("mode", MODES)
def test_a_mode_is_selected_but_out_of_stow_and_fault_where_standby_alone_is_taken(mode: AcuMode, to: AcuMode) -> None:
    made = modes(mode)
    is_taken = made.select(to, True, 3.0)
    assert HELD_FAST == (AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)
    assert is_taken == (mode not in HELD_FAST or to is AcuMode.STANDBY)
    stays = not is_taken or mode is AcuMode.FAULT
    assert made.mode is (mode if stays else to)
    assert made.is_autotrack_selected == (is_taken and to is AcuMode.AUTOTRACK)


@pytest.mark.parametrize("has_signal", [True, False])
def test_autotrack_waits_for_a_signal_and_is_selected_once(has_signal: bool) -> None:
    made = modes(AcuMode.REMOTE)
    assert made.select(AcuMode.AUTOTRACK, has_signal, 3.0)
    first = AcuMode.AUTOTRACK if has_signal else AcuMode.ACQUIRE
    assert (made.mode, made.entered_s) == (first, 3.0)
    assert made.select(AcuMode.AUTOTRACK, not has_signal, 5.0)
    assert (made.mode, made.entered_s) == (first, 3.0)
    made.select(AcuMode.STANDBY, True, 6.0)
    assert (made.mode, made.is_autotrack_selected) == (AcuMode.STANDBY, False)


@pytest.mark.parametrize("was_valid", [True, False])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("backup", list(Backup))
def test_another_backup_acts_at_once_in_a_backup_mode_alone(backup: Backup, mode: AcuMode, was_valid: bool) -> None:
    made = modes(mode, _was_track_valid=was_valid, entered_s=1.0)
    made.select_backup(backup, 9.0)
    assert made.backup is backup
    expected = {
        Backup.REMOTE: AcuMode.REMOTE_BACKUP,
        Backup.RATE: AcuMode.RATE_MEMORY if was_valid else AcuMode.POSITION_MEMORY,
    }.get(backup, AcuMode.POSITION_MEMORY)
    assert made.mode is (expected if mode in BACKUP_MODES else mode)


@pytest.mark.parametrize("mode", MODES)
def test_stop_stow_and_recovery_leave_autotrack_where_they_have_an_effect(mode: AcuMode) -> None:
    made = modes(mode, is_autotrack_selected=True)
    made.stop(2.0)
    is_held = mode in (AcuMode.STOWED, AcuMode.FAULT, AcuMode.MANUAL)
    assert (made.mode, made.is_autotrack_selected) == (mode if is_held else AcuMode.STANDBY, is_held)
    made = modes(mode, is_autotrack_selected=True)
    assert made.stow(2.0) == (mode is not AcuMode.FAULT)
    is_held = mode in (AcuMode.STOWED, AcuMode.FAULT)
    assert (made.mode, made.is_autotrack_selected) == (mode if is_held else AcuMode.STOWING, is_held)
    for is_enabled in (True, False):
        made = modes(mode, is_autotrack_selected=True, is_remote_enabled=is_enabled)
        made.recover(2.0)
        assert made.mode is (AcuMode.STANDBY if is_enabled else AcuMode.MANUAL)
        assert not made.is_autotrack_selected


@pytest.mark.parametrize("is_local", [True, False])
@pytest.mark.parametrize("mode", MODES)
def test_the_local_panel_takes_and_gives_control_and_a_fault_stays(mode: AcuMode, is_local: bool) -> None:
    made = modes(mode, is_autotrack_selected=True)
    made.set_local(is_local, 2.0)
    is_changed = mode is not AcuMode.FAULT and is_local != (mode is AcuMode.MANUAL)
    expected = (AcuMode.MANUAL if is_local else AcuMode.STANDBY) if is_changed else mode
    assert (made.mode, made.is_remote_enabled) == (expected, not is_local)
    assert made.is_autotrack_selected == (not is_changed)


# Ticks


@pytest.mark.parametrize("has_signal", [True, False])
@pytest.mark.parametrize("mode", MODES)
def test_without_autotrack_a_tick_changes_nothing(mode: AcuMode, has_signal: bool) -> None:
    made = modes(mode)
    made.step(has_signal, 1e4)
    assert (made.mode, made.is_loss_latched, made.is_track_valid) == (mode, False, False)


@pytest.mark.parametrize(("lasted_s", "is_valid"), [(VALID_S - 1e-3, False), (VALID_S - 1e-7, True), (VALID_S, True)])
def test_a_track_is_valid_once_it_has_lasted_and_a_loss_then_goes_to_rate_memory(
    lasted_s: float, is_valid: bool
) -> None:
    made = modes(AcuMode.AUTOTRACK, is_autotrack_selected=True, entered_s=10.0)
    made.step(True, 10.0 + lasted_s)
    assert (made.mode, made.is_track_valid, made.is_loss_latched) == (AcuMode.AUTOTRACK, is_valid, False)
    made.step(False, 10.0 + lasted_s)
    assert made.mode is (AcuMode.RATE_MEMORY if is_valid else AcuMode.POSITION_MEMORY)
    assert (made.is_loss_latched, made.is_track_valid, made.entered_s) == (True, False, 10.0 + lasted_s)


@pytest.mark.parametrize("mode", MODES)
def test_a_signal_ends_what_waits_for_one(mode: AcuMode) -> None:
    made = modes(mode, is_autotrack_selected=True)
    made.step(True, 1.0)
    waits = mode in (AcuMode.ACQUIRE, *BACKUP_MODES, AcuMode.AUTOTRACK)
    assert made.mode is (AcuMode.AUTOTRACK if waits else mode)
    assert not made.is_loss_latched


@pytest.mark.parametrize(("mode", "limit_s"), [(AcuMode.RATE_MEMORY, RATE_S), (AcuMode.POSITION_MEMORY, POSITION_S)])
@pytest.mark.parametrize("came_through_acquire", [True, False])
@pytest.mark.parametrize(("by_s", "is_over"), [(-1e-3, False), (0.0, True)])
def test_a_memory_has_its_time_and_then_what_was_before_autotrack_comes_back(
    mode: AcuMode, limit_s: float, came_through_acquire: bool, by_s: float, is_over: bool
) -> None:
    made = modes(AcuMode.REMOTE)
    made.select(AcuMode.AUTOTRACK, not came_through_acquire, 0.0)
    made.enter(mode, 20.0)
    made.step(False, 20.0 + limit_s + by_s)
    if not is_over:
        assert (made.mode, made.is_autotrack_selected) == (mode, True)
    elif came_through_acquire:
        assert (made.mode, made.is_autotrack_selected) == (AcuMode.ACQUIRE, True)
    else:
        assert (made.mode, made.is_autotrack_selected) == (AcuMode.REMOTE, False)


@pytest.mark.parametrize("mode", [AcuMode.REMOTE_BACKUP, AcuMode.ACQUIRE])
def test_what_has_no_timer_waits_for_ever(mode: AcuMode) -> None:
    made = modes(mode, is_autotrack_selected=True)
    made.step(False, 1e6)
    assert (made.mode, made.is_autotrack_selected) == (mode, True)


# The loop that follows the signal


class Driven(Axis):
    """An axis that remembers at which rate it was last driven."""

    def __init__(self, limits: Any, angle_deg: float, rate_deg_s: float = 0.0) -> None:
        super().__init__(limits, angle_deg)
        self.rate_deg_s = rate_deg_s
        self.driven_deg_s: float | None = None

    def drive_at(self, rate_deg_s: float) -> None:
        self.driven_deg_s = rate_deg_s


@pytest.mark.parametrize("rate_deg_s", [-1.5, 0.0, 1.5])
def test_it_begins_with_the_rate_of_the_axis_and_goes_on_with_it(rate_deg_s: float) -> None:
    axis = Driven(AZIMUTH, 30.0, rate_deg_s)
    tracker = AxisTracker(axis)
    tracker.start(0.2)
    assert tracker.rate_deg_s == rate_deg_s
    tracker.coast()
    assert axis.driven_deg_s == rate_deg_s


@pytest.mark.parametrize("offset_deg", [-0.3, -0.01, 0.0, 0.01, 0.3])
@pytest.mark.parametrize("rate_deg_s", [-1.0, 2.0])
def test_a_step_is_that_of_an_alpha_beta_filter_and_of_a_drive_that_closes_in(
    rate_deg_s: float, offset_deg: float
) -> None:
    axis = Driven(AZIMUTH, 30.0, rate_deg_s)
    tracker = AxisTracker(axis)
    tracker.start(0.1)
    axis.angle_deg = 30.05
    tracker.drive(offset_deg)
    expected_deg = 30.1 + rate_deg_s * STEP_S
    surprise_deg = 30.05 + offset_deg - expected_deg
    angle_deg = expected_deg + 2.0 * BANDWIDTH_RAD_S * STEP_S * surprise_deg
    now_deg_s = rate_deg_s + BANDWIDTH_RAD_S**2 * STEP_S * surprise_deg
    assert tracker.rate_deg_s == pytest.approx(now_deg_s)
    closing = approach_rate_deg_s(
        angle_deg - 30.05, CLOSING_GAIN_PER_S, BRAKING_SHARE * AZIMUTH.max_acceleration_deg_s2
    )
    assert axis.driven_deg_s == pytest.approx(now_deg_s + closing)
    tracker.coast()
    assert axis.driven_deg_s == pytest.approx(now_deg_s)


def loop(el_deg: float) -> tuple[Driven, Driven, Autotrack]:
    azimuth, elevation = Driven(AZIMUTH, 30.0), Driven(ELEVATION, 45.0)
    elevation.angle_deg = el_deg
    return azimuth, elevation, Autotrack(azimuth, elevation)


@pytest.mark.parametrize(
    ("el_deg", "per_right"),
    [(0.0, 1.0), (60.0, 2.0), (120.0, -2.0), (89.99, 1e3), (90.01, -1e3), (85.0, 1.0 / cos(radians(85.0)))],
)
def test_an_offset_to_the_right_asks_the_more_of_the_azimuth_the_higher_the_beam(
    el_deg: float, per_right: float
) -> None:
    _, _, both = loop(el_deg)
    assert both._axis_offsets_deg(Offset(0.01, -0.02)) == (pytest.approx(0.01 * per_right), -0.02)


def test_both_axes_begin_and_are_driven_by_their_own_offsets() -> None:
    azimuth, elevation, both = loop(60.0)
    both.start(Offset(0.1, -0.05))
    assert [one._angle_deg for one in both._trackers] == [pytest.approx(30.2), pytest.approx(59.95)]
    both.drive(Offset(0.1, -0.05), -5.0)
    assert (azimuth.driven_deg_s or 0.0) > 0.0
    assert (elevation.driven_deg_s or 0.0) < 0.0
    azimuth.driven_deg_s = elevation.driven_deg_s = None
    both.coast()
    assert (azimuth.driven_deg_s, elevation.driven_deg_s) == tuple(one.rate_deg_s for one in both._trackers)


@pytest.mark.parametrize(("lowest_el_deg", "taken_deg"), [(9.0, -0.5), (9.5, -0.5), (9.8, -0.2), (10.3, 0.3)])
def test_the_elevation_is_not_led_below_its_lowest(lowest_el_deg: float, taken_deg: float) -> None:
    _, free, both = loop(10.0)
    both.start(Offset(0.0, 0.0))
    both.drive(Offset(0.0, taken_deg), -5.0)
    _, held, bounded = loop(10.0)
    bounded.start(Offset(0.0, 0.0))
    bounded.drive(Offset(0.0, -0.5), lowest_el_deg)
    assert held.driven_deg_s == pytest.approx(free.driven_deg_s)
