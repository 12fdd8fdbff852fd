"""The fake ACU against docs/protocol.md, Messages and Behaviour: modes, backups, timers, registers, bits."""

import pytest
from fake_sky import Bench, Star

from acu_daemon.acu.commands import AcuMode, Backup, Identify, Poll, ReadFaults, SelectBackup, SelectMode, Stop, Stow
from acu_daemon.drivers.sa3842.field_status import field_status
from acu_daemon.drivers.sa3842.messages import (
    Ack,
    ClearChange,
    Command,
    Faults,
    Identity,
    Nak,
    Parameter,
    ReadParameter,
    ReadRegisters,
    RegisterContents,
    ResetFault,
    Status,
    WriteAndPoll,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.model import AxisLimits
from acu_daemon.sim.faults import FaultNibble
from acu_daemon.sim.scenario import AcuChoice, Encoder, Loss, Scenario, StartMode

LSB_DEG = 360 / 65536
STANDBY, REMOTE, AUTOTRACK = SelectMode(AcuMode.STANDBY), SelectMode(AcuMode.REMOTE), SelectMode(AcuMode.AUTOTRACK)


def status(bench: Bench) -> Status:
    reply = bench.acu.answer(Poll())
    assert isinstance(reply, Status)
    return reply


STANDING = (AcuMode.STANDBY, Backup.RATE, False, True)


def do(bench: Bench, *commands: Command) -> None:
    for command in commands:
        assert not isinstance(bench.acu.answer(command), Nak), command


def registers(bench: Bench) -> RegisterContents:
    reply = bench.acu.answer(ReadRegisters())
    assert isinstance(reply, RegisterContents)
    return reply


def tracking(backup: Backup, tracked_s: float, before: SelectMode = STANDBY) -> Bench:
    """An ACU in AUTOTRACK for a time, on a star that can be switched off."""
    bench = Bench()
    do(bench, before, SelectBackup(backup), AUTOTRACK)
    bench.wait(tracked_s)
    assert status(bench).mode is AcuMode.AUTOTRACK
    return bench


def lose(bench: Bench) -> None:
    assert isinstance(bench.sky, Star)
    bench.sky.is_on = False
    bench.wait(0.04)


def find(bench: Bench) -> None:
    assert isinstance(bench.sky, Star)
    bench.sky.is_on = True
    bench.wait(0.04)


def test_power_up_is_as_section_5_says() -> None:
    bench = Bench(Star(is_on=False))
    s = status(bench)
    assert (s.mode, s.backup_selected, s.is_autotrack_selected, s.has_changed) == (
        AcuMode.STANDBY,
        Backup.RATE,
        False,
        True,
    )
    assert (s.are_registers_written, s.is_acquired, s.is_loss_latched, s.is_remote_enabled) == (
        False,
        False,
        False,
        True,
    )
    assert registers(bench) == RegisterContents(30.0, 40.0, 0, 0)
    codes = {name: bench.acu.answer(ReadParameter(name)) for name in "ARPMTSW"}
    expected = {"A": 250, "R": 750, "P": 750, "M": 0, "T": 60, "S": 0, "W": 0}
    assert codes == {name: Parameter(name, code) for name, code in expected.items()}


@pytest.mark.parametrize(("has_tilt", "variant"), [(False, "S1"), (True, "S2")])
def test_it_says_that_it_is_simulated(has_tilt: bool, variant: str) -> None:
    reply = Bench(scenario=Scenario(acu=AcuChoice(has_tilt=has_tilt))).acu.answer(Identify())
    assert reply == Identity("3842", variant)
    assert isinstance(reply, Identity)
    assert reply.is_simulated
    assert reply.has_tilt is has_tilt


@pytest.mark.parametrize(
    ("mode", "expected"),
    [("standby", AcuMode.STANDBY), ("manual", AcuMode.MANUAL), ("remote", AcuMode.REMOTE), ("stowed", AcuMode.STOWED)],
)
def test_the_scenario_chooses_how_the_daemon_finds_it(mode: StartMode, expected: AcuMode) -> None:
    assert status(Bench(scenario=Scenario(acu=AcuChoice(mode=mode)))).mode is expected


def test_under_local_control_only_what_is_always_allowed_is_not_refused() -> None:
    bench = Bench(scenario=Scenario(acu=AcuChoice(mode="manual")))
    assert (status(bench).mode, status(bench).is_remote_enabled) == (AcuMode.MANUAL, False)
    for allowed in (Identify(), Poll(), ReadRegisters(), Stop(), ReadFaults(), ReadParameter("A")):
        assert not isinstance(bench.acu.answer(allowed), Nak), allowed
    for refused in (
        *(WriteRegisters(1, 2), WriteAndPoll(1, 2), STANDBY, SelectBackup(Backup.RATE), Stow(), ClearChange()),
        *(ResetFault(), WriteParameter("A", 1)),
    ):
        assert bench.acu.answer(refused) == Nak(), refused
    assert status(bench).mode is AcuMode.MANUAL
    bench.acu.set_local(False, bench.tai_s)
    assert (status(bench).mode, status(bench).is_remote_enabled) == (AcuMode.STANDBY, True)


def test_the_count_rises_with_each_accepted_write_and_turns_over() -> None:
    bench = Bench()
    for _ in range(255):
        do(bench, WriteRegisters(30, 40))
    assert registers(bench).count == 255
    do(bench, WriteAndPoll(31, 40))
    assert registers(bench).count == 0
    assert bench.acu.answer(WriteRegisters(30, 95)) == Nak()
    assert registers(bench).count == 0


def test_a_power_cycle_shows_in_count_and_change_bit_and_keeps_the_position() -> None:
    bench = Bench()
    do(bench, WriteParameter("R", 9), WriteRegisters(50, 45), REMOTE, ClearChange())
    bench.wait(20.0)
    bench.acu.power_cycle(bench.tai_s)
    s = status(bench)
    assert (s.mode, s.has_changed, s.are_registers_written) == (AcuMode.STANDBY, True, False)
    assert s.az_deg == pytest.approx(50.0, abs=0.01)
    assert registers(bench).count == 0
    assert registers(bench).az_deg == pytest.approx(50.0, abs=0.01)
    assert bench.acu.answer(ReadParameter("R")) == Parameter("R", 750)


@pytest.mark.parametrize("target", [(30.0, 90.01), (30.0, -0.01), (30.0, -90.0)])
def test_a_target_outside_the_soft_limits_is_refused_and_changes_nothing(target: tuple[float, float]) -> None:
    bench = Bench()
    before = registers(bench)
    assert bench.acu.answer(WriteRegisters(*target)) == Nak()
    assert bench.acu.answer(WriteAndPoll(*target)) == Nak()
    assert registers(bench) == before


def test_a_bearing_that_no_turn_reaches_is_out_of_range() -> None:
    bench = Bench(azimuth=AxisLimits(10.0, 350.0, 20.0, 10.0))
    assert bench.acu.answer(WriteRegisters(5.0, 40.0)) == Nak()
    assert bench.acu.answer(WriteRegisters(355.0, 40.0)) == Nak()
    assert bench.acu.answer(WriteRegisters(10.0, 40.0)) == Ack()
    assert bench.acu.answer(WriteRegisters(350.0, 90.0)) == Ack()


def test_registers_are_handed_over_eighty_milliseconds_after_the_last_ones() -> None:
    """Target 31 is handed over at 20 ms, 40 waits for 100 ms; seen by the motion that begins one tick later."""
    bench = Bench(Star(is_on=False))
    do(bench, REMOTE)
    bench.wait(0.2)
    do(bench, WriteRegisters(30.0, 41.0))
    bench.wait(0.02)
    do(bench, WriteRegisters(40.0, 41.0))
    moved = []
    for _ in range(6):
        bench.wait(0.02)
        moved.append((status(bench).az_deg != 30.0, status(bench).el_deg != 40.0))
    assert [el for _, el in moved] == [True] * 6
    assert [az for az, _ in moved] == [False] * 4 + [True] * 2


def test_what_is_written_just_before_a_hand_over_wins() -> None:
    bench = Bench(Star(is_on=False))
    do(bench, REMOTE, WriteRegisters(100.0, 60.0), WriteRegisters(31.0, 41.0))
    bench.wait(5.0)
    assert status(bench).az_deg == pytest.approx(31.0, abs=0.01)


def test_remote_follows_the_registers_from_whatever_they_hold() -> None:
    bench = Bench(Star(is_on=False))
    do(bench, WriteRegisters(35.0, 45.0))
    bench.wait(3.0)
    s = status(bench)
    assert s.az_deg == 30.0
    assert (s.are_registers_written, s.are_registers_idle) == (True, True)
    do(bench, REMOTE)
    assert status(bench).are_registers_written is False
    bench.wait(5.0)
    assert status(bench).az_deg == pytest.approx(35.0, abs=0.01)
    do(bench, WriteAndPoll(36.0, 45.0))
    assert (status(bench).are_registers_written, status(bench).are_registers_idle) == (True, False)


def test_write_and_status_reports_the_write_it_carried() -> None:
    bench = Bench()
    reply = bench.acu.answer(WriteAndPoll(30.0, 40.0))
    assert isinstance(reply, Status)
    assert reply.are_registers_written


def test_without_a_tilt_its_register_is_ignored_and_a_long_write_refused() -> None:
    bench = Bench()
    assert bench.acu.answer(WriteRegisters(30.0, 40.0, 5)) == Nak()
    do(bench, WriteAndPoll(30.0, 40.0, 777))
    assert registers(bench).tilt_code == 0
    assert not status(bench).is_tilt_fitted


def test_a_tilt_is_written_kept_and_moved_to_while_the_registers_are_followed() -> None:
    bench = Bench(Star(is_on=False), Scenario(acu=AcuChoice(has_tilt=True)))
    do(bench, WriteRegisters(0.0, 90.0, 364), WriteRegisters(0.0, 89.0))
    assert registers(bench).tilt_code == 364
    do(bench, REMOTE)
    bench.wait(1.0)
    assert status(bench).is_tilt_moving
    bench.wait(20.0)
    s = status(bench)
    assert (s.is_tilt_fitted, s.is_tilt_moving) == (True, False)
    assert s.tilt_deg == pytest.approx(364 * LSB_DEG, abs=LSB_DEG)
    assert bench.acu.answer(WriteRegisters(0.0, 89.0, 0x4000)) == Nak()


def test_mode_select_autotrack_needs_no_signal_and_waits_for_one() -> None:
    assert status(tracking(Backup.RATE, 1.0)).is_autotrack_selected
    bench = Bench(Star(is_on=False))
    do(bench, AUTOTRACK)
    s = status(bench)
    assert (s.mode, s.is_autotrack_selected, field_status(s).follows_registers) == (AcuMode.ACQUIRE, True, False)
    do(bench, WriteRegisters(35.0, 45.0))
    bench.wait(3.0)
    assert status(bench).az_deg == 30.0
    find(bench)
    assert status(bench).mode is AcuMode.AUTOTRACK


def test_acquire_follows_the_registers_while_the_backup_is_remote() -> None:
    bench = Bench(Star(az_deg=35.0, el_deg=45.0))
    do(bench, SelectBackup(Backup.REMOTE), WriteRegisters(34.9, 45.0), AUTOTRACK)
    assert status(bench).mode is AcuMode.ACQUIRE
    assert field_status(status(bench)).follows_registers
    bench.wait(5.0)
    s = status(bench)
    assert s.mode is AcuMode.AUTOTRACK
    assert s.az_deg == pytest.approx(35.0, abs=0.02)


def test_selecting_autotrack_again_changes_nothing() -> None:
    bench = tracking(Backup.RATE, 6.0)
    lose(bench)
    assert status(bench).mode is AcuMode.RATE_MEMORY
    do(bench, AUTOTRACK)
    assert status(bench).mode is AcuMode.RATE_MEMORY


@pytest.mark.parametrize(
    ("backup", "tracked_s", "expected"),
    [
        (Backup.REMOTE, 1.0, AcuMode.REMOTE_BACKUP),
        (Backup.REMOTE, 6.0, AcuMode.REMOTE_BACKUP),
        (Backup.RATE, 4.9, AcuMode.POSITION_MEMORY),
        (Backup.RATE, 5.1, AcuMode.RATE_MEMORY),
        (Backup.POSITION, 6.0, AcuMode.POSITION_MEMORY),
    ],
)
def test_a_loss_goes_to_the_backup_section_5_names(backup: Backup, tracked_s: float, expected: AcuMode) -> None:
    bench = tracking(backup, tracked_s)
    assert status(bench).is_track_valid is (tracked_s >= 5.0)
    lose(bench)
    s = status(bench)
    assert (s.mode, s.is_backup_active, s.is_loss_latched, s.is_acquired) == (expected, True, True, False)
    assert s.is_autotrack_selected
    find(bench)
    assert status(bench).mode is AcuMode.AUTOTRACK


def test_the_loss_bit_is_latched_in_autotrack_only() -> None:
    bench = Bench()
    bench.wait(1.0)
    assert status(bench).is_acquired
    lose(bench)
    assert not status(bench).is_loss_latched


@pytest.mark.parametrize("backup", [Backup.RATE, Backup.POSITION])
@pytest.mark.parametrize("before", [STANDBY, REMOTE])
def test_when_a_memory_ends_the_mode_before_autotrack_returns(backup: Backup, before: SelectMode) -> None:
    bench = tracking(backup, 6.0, before)
    lose(bench)
    bench.wait(14.9)
    assert status(bench).is_backup_active
    bench.wait(0.2)
    s = status(bench)
    assert (s.mode, s.is_autotrack_selected) == (before.mode, False)


@pytest.mark.parametrize("name", ["R", "P"])
def test_when_a_memory_ends_acquire_returns_if_autotrack_came_through_it(name: str) -> None:
    bench = Bench(Star(is_on=False))
    backup = Backup.RATE if name == "R" else Backup.POSITION
    do(bench, WriteParameter(name, 100), WriteParameter("A", 50), SelectBackup(backup), AUTOTRACK)
    find(bench)
    bench.wait(3.0)
    lose(bench)
    bench.wait(1.9)
    assert status(bench).is_backup_active
    bench.wait(0.1)
    assert (status(bench).mode, status(bench).is_autotrack_selected) == (AcuMode.ACQUIRE, True)


def test_remote_backup_has_no_timer() -> None:
    bench = tracking(Backup.REMOTE, 6.0)
    lose(bench)
    bench.wait(600.0)
    assert status(bench).mode is AcuMode.REMOTE_BACKUP


def test_backup_select_acts_at_once_in_the_backup_modes() -> None:
    bench = tracking(Backup.POSITION, 6.0)
    lose(bench)
    for backup, mode in (
        (Backup.REMOTE, AcuMode.REMOTE_BACKUP),
        (Backup.RATE, AcuMode.RATE_MEMORY),
        (Backup.POSITION, AcuMode.POSITION_MEMORY),
    ):
        do(bench, SelectBackup(backup))
        assert status(bench).mode is mode


def test_stale_registers_make_the_antenna_jump_at_the_loss() -> None:
    bench = tracking(Backup.REMOTE, 2.0)
    do(bench, WriteRegisters(33.0, 42.0))
    bench.wait(2.0)
    assert status(bench).az_deg == pytest.approx(30.0, abs=0.01)
    lose(bench)
    bench.wait(3.0)
    assert status(bench).az_deg == pytest.approx(33.0, abs=0.01)


@pytest.mark.parametrize("command", [STANDBY, REMOTE, Stop(), Stow()])
def test_what_deselects_autotrack_ends_the_remote_backup(command: Command) -> None:
    bench = tracking(Backup.REMOTE, 1.0)
    lose(bench)
    do(bench, command)
    s = status(bench)
    assert not s.is_autotrack_selected
    assert s.mode is not AcuMode.REMOTE_BACKUP
    find(bench)
    assert status(bench).mode is not AcuMode.AUTOTRACK


def test_stop_brings_the_rates_to_zero_and_keeps_the_registers() -> None:
    bench = Bench(Star(is_on=False))
    do(bench, WriteRegisters(100.0, 40.0), REMOTE)
    bench.wait(2.0)
    do(bench, Stop())
    bench.wait(3.0)
    first = status(bench)
    bench.wait(3.0)
    assert (first.mode, status(bench).az_deg) == (AcuMode.STANDBY, first.az_deg)
    assert registers(bench).az_deg == pytest.approx(100.0, abs=LSB_DEG)


def test_stow_drives_up_puts_the_pin_in_and_only_standby_leaves_it() -> None:
    bench = Bench(Star(is_on=False))
    do(bench, Stow())
    assert status(bench).mode is AcuMode.STOWING
    for refused in (REMOTE, AUTOTRACK):
        assert bench.acu.answer(refused) == Nak()
    bench.wait(30.0)
    s = status(bench)
    assert (s.mode, s.is_stow_pin_in, s.el_deg) == (AcuMode.STOWED, True, pytest.approx(90.0, abs=0.01))
    for refused in (REMOTE, AUTOTRACK):
        assert bench.acu.answer(refused) == Nak()
    do(bench, Stop(), Stow())
    assert status(bench).mode is AcuMode.STOWED
    do(bench, STANDBY)
    assert (status(bench).mode, status(bench).is_stow_pin_in) == (AcuMode.STANDBY, False)


def test_stop_ends_stowing() -> None:
    bench = Bench(Star(is_on=False))
    do(bench, Stow())
    bench.wait(1.0)
    do(bench, Stop())
    assert status(bench).mode is AcuMode.STANDBY


@pytest.mark.parametrize(
    ("nibble", "bit", "field"),
    [
        ("azimuth", 2, "has_azimuth_fault"),
        ("elevation", 0, "has_elevation_fault"),
        ("tilt", 3, "has_tilt_fault"),
        ("interlock", 0, "has_interlock_fault"),
        ("encoders", 1, "has_interlock_fault"),
    ],
)
def test_a_fault_switches_the_drives_off_until_it_is_gone_and_reset(nibble: FaultNibble, bit: int, field: str) -> None:
    bench = tracking(Backup.REMOTE, 1.0)
    bench.acu.begin_fault(nibble, bit, bench.tai_s)
    bench.wait(0.04)
    s = status(bench)
    assert (s.mode, s.is_autotrack_selected, getattr(s, field)) == (AcuMode.FAULT, False, True)
    assert bench.acu.answer(ReadFaults()) == Faults(**{nibble: 1 << bit})
    for refused in (REMOTE, AUTOTRACK, Stow(), ResetFault()):
        assert bench.acu.answer(refused) == Nak(), refused
    do(bench, Stop(), WriteRegisters(50.0, 50.0))
    assert status(bench).mode is AcuMode.FAULT
    bench.acu.end_fault(nibble, bit, bench.tai_s)
    bench.wait(1.0)
    assert getattr(status(bench), field)
    assert status(bench).mode is AcuMode.FAULT
    do(bench, ResetFault())
    s = status(bench)
    assert (s.mode, getattr(s, field)) == (AcuMode.STANDBY, False)
    assert bench.acu.answer(ReadFaults()) == Faults()


def test_the_local_panel_ends_autotrack() -> None:
    bench = tracking(Backup.REMOTE, 1.0)
    bench.acu.set_local(True, bench.tai_s)
    s = status(bench)
    assert (s.mode, s.is_remote_enabled, s.is_autotrack_selected) == (AcuMode.MANUAL, False, False)


@pytest.mark.parametrize("backup", [Backup.REMOTE, Backup.RATE])
def test_the_watchdog_puts_an_acu_in_standby_whose_followed_registers_are_not_written(backup: Backup) -> None:
    bench = Bench(Star(is_on=False))
    do(bench, WriteParameter("W", 100), SelectBackup(backup), REMOTE)
    for _ in range(5):
        do(bench, WriteRegisters(30.0, 40.0))
        bench.wait(1.9)
    assert status(bench).mode is AcuMode.REMOTE
    bench.wait(0.2)
    assert (status(bench).mode, status(bench).has_interlock_fault) == (AcuMode.STANDBY, True)
    assert bench.acu.answer(ReadFaults()) == Faults(system=2)
    do(bench, ResetFault(), AUTOTRACK)
    bench.wait(3.0)
    assert status(bench).mode is (AcuMode.STANDBY if backup is Backup.REMOTE else AcuMode.ACQUIRE)


def test_the_watchdog_ends_the_remote_backup_but_not_autotrack() -> None:
    bench = tracking(Backup.REMOTE, 1.0)
    do(bench, WriteParameter("W", 100))
    bench.wait(10.0)
    assert status(bench).mode is AcuMode.AUTOTRACK
    lose(bench)
    bench.wait(2.1)
    assert (status(bench).mode, status(bench).is_autotrack_selected) == (AcuMode.STANDBY, False)


def test_clear_change_clears_change_and_loss_and_nothing_else_does() -> None:
    bench = tracking(Backup.REMOTE, 1.0)
    lose(bench)
    for command in (Poll(), ReadRegisters(), WriteAndPoll(30.0, 40.0), Stop()):
        do(bench, command)
        assert (status(bench).has_changed, status(bench).is_loss_latched) == (True, True)
    do(bench, ClearChange())
    assert (status(bench).has_changed, status(bench).is_loss_latched) == (False, False)
    bench.wait(1.0)
    assert not status(bench).has_changed


@pytest.mark.parametrize(
    ("command", "is_change"),
    [
        (Poll(), False),
        (WriteRegisters(31.0, 41.0), False),
        (WriteAndPoll(31.0, 41.0), False),
        (STANDBY, False),
        (REMOTE, True),
        (SelectBackup(Backup.RATE), False),
        (SelectBackup(Backup.REMOTE), True),
        (WriteParameter("A", 250), False),
        (WriteParameter("A", 251), True),
        (Stow(), True),
    ],
)
def test_the_change_bit_rises_with_what_section_3_names(command: Command, is_change: bool) -> None:
    bench = Bench(Star(is_on=False))
    do(bench, ClearChange(), command)
    assert status(bench).has_changed is is_change


def test_the_change_bit_rises_with_the_signal_and_the_local_panel_and_not_with_motion() -> None:
    bench = Bench(Star(is_on=False))
    do(bench, REMOTE, WriteRegisters(60.0, 60.0), ClearChange())
    bench.wait(10.0)
    assert not status(bench).has_changed
    bench.acu.set_local(True, bench.tai_s)
    assert status(bench).has_changed
    bench = Bench(Star(is_on=False))
    do(bench, ClearChange())
    find(bench)
    assert status(bench).has_changed


@pytest.mark.parametrize(("name", "code"), [("S", 3), ("T", 0x1000), ("M", 0x4001)])
def test_a_parameter_out_of_range_is_refused(name: str, code: int) -> None:
    bench = Bench()
    before = bench.acu.answer(ReadParameter(name))
    assert bench.acu.answer(WriteParameter(name, code)) == Nak()
    assert bench.acu.answer(ReadParameter(name)) == before


def test_the_threshold_parameter_decides_what_is_a_signal() -> None:
    bench = Bench()
    bench.wait(0.1)
    assert status(bench).is_acquired
    do(bench, WriteParameter("T", 200))
    bench.wait(0.1)
    assert not status(bench).is_acquired


def test_autotrack_does_not_drive_below_the_lowest_elevation() -> None:
    bench = Bench(Star(el_deg=40.0, el_rate_deg_s=-0.1))
    do(bench, WriteParameter("M", round(39.8 / LSB_DEG)), AUTOTRACK)
    bench.wait(5.0)
    assert status(bench).el_deg == pytest.approx(39.8, abs=0.02)


@pytest.mark.parametrize(
    ("preference", "present_deg", "expected_deg", "is_high"),
    [(0, 150.0, 200.0, True), (0, -120.0, -160.0, False), (1, 150.0, -160.0, False), (2, -120.0, 200.0, True)],
)
def test_the_sector_preference_chooses_the_turn(
    preference: int, present_deg: float, expected_deg: float, is_high: bool
) -> None:
    """Bearing 200 deg can be reached at 200 and at -160; the halves of -270..270 meet at 0."""
    bench = Bench(Star(is_on=False), Scenario(acu=AcuChoice(azimuth_deg=present_deg, elevation_deg=40.0)))
    do(bench, WriteParameter("S", preference), WriteRegisters(200.0, 40.0), REMOTE)
    assert bench.acu.trace_row().encoder_az_deg == present_deg
    bench.wait(40.0)
    assert bench.acu.trace_row().encoder_az_deg == pytest.approx(expected_deg, abs=0.01)
    assert status(bench).az_deg == pytest.approx(200.0, abs=0.01)
    assert status(bench).is_sector_high is is_high


def test_limits_show_in_their_bits() -> None:
    for az_deg, el_deg, field in (
        (270.0, 40.0, "is_at_cw_limit"),
        (-270.0, 40.0, "is_at_ccw_limit"),
        (0.0, 90.0, "is_at_up_limit"),
        (0.0, 0.0, "is_at_down_limit"),
    ):
        bench = Bench(scenario=Scenario(acu=AcuChoice(azimuth_deg=az_deg, elevation_deg=el_deg)))
        bits = ("is_at_cw_limit", "is_at_ccw_limit", "is_at_up_limit", "is_at_down_limit")
        assert [name for name in bits if getattr(status(bench), name)] == [field]


def test_autotrack_that_is_led_beyond_a_soft_limit_is_clamped_there() -> None:
    scenario = Scenario(acu=AcuChoice(azimuth_deg=269.0, elevation_deg=40.0))
    bench = Bench(Star(az_deg=269.0, az_rate_deg_s=0.3), scenario)
    do(bench, WriteParameter("A", 0), AUTOTRACK)
    bench.wait(4.5)
    s = status(bench)
    assert (s.is_at_cw_limit, s.is_azimuth_clamped) == (True, True)
    assert bench.acu.trace_row().encoder_az_deg <= 270.0


def test_a_disconnected_receiver_shows_and_comes_back() -> None:
    loss = Loss("receiver", start_s=5.0, duration_s=5.0)
    bench = Bench(scenario=Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0), losses=(loss,)))
    do(bench, SelectBackup(Backup.REMOTE), AUTOTRACK, WriteRegisters(30.0, 40.0))
    bench.wait(6.0)
    s = status(bench)
    assert (s.mode, s.is_receiver_valid, s.is_acquired, s.agc_db) == (AcuMode.REMOTE_BACKUP, False, False, 0.0)
    assert bench.acu.answer(ReadFaults()) == Faults(receiver=1)
    bench.wait(5.0)
    s = status(bench)
    assert (s.mode, s.is_receiver_valid) == (AcuMode.AUTOTRACK, True)


@pytest.mark.parametrize(
    "loss",
    [Loss("silence-zone", start_s=5.0, duration_s=5.0), Loss("fade", start_s=5.0, duration_s=5.0, depth_db=6.0)],
)
def test_a_silence_zone_and_a_deep_fade_lose_the_signal_with_a_valid_receiver(loss: Loss) -> None:
    bench = Bench(scenario=Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0), losses=(loss,)))
    do(bench, SelectBackup(Backup.POSITION), AUTOTRACK)
    bench.wait(6.0)
    assert (status(bench).mode, status(bench).is_receiver_valid) == (AcuMode.POSITION_MEMORY, True)
    bench.wait(5.0)
    assert status(bench).mode is AcuMode.AUTOTRACK


def test_a_shallow_fade_is_survived() -> None:
    loss = Loss("fade", start_s=5.0, duration_s=5.0, depth_db=2.0)
    bench = Bench(scenario=Scenario(acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0), losses=(loss,)))
    do(bench, AUTOTRACK)
    bench.wait(7.0)
    assert status(bench).mode is AcuMode.AUTOTRACK
    assert status(bench).agc_db == pytest.approx(4.0, abs=0.5)


def test_an_encoder_bias_moves_the_beam_and_registers_act_through_the_same_encoders() -> None:
    scenario = Scenario(
        encoder=Encoder(azimuth_bias_deg=0.05, elevation_bias_deg=-0.04),
        acu=AcuChoice(azimuth_deg=30.0, elevation_deg=40.0),
    )
    bench = Bench(scenario=scenario)
    do(bench, WriteRegisters(35.0, 45.0), REMOTE)
    bench.wait(5.0)
    row = bench.acu.trace_row()
    assert (status(bench).az_deg, status(bench).el_deg) == (pytest.approx(35.0, abs=LSB_DEG), pytest.approx(45.0))
    assert (row.boresight_az_deg, row.boresight_el_deg) == (
        pytest.approx(34.95, abs=LSB_DEG),
        pytest.approx(45.04, abs=LSB_DEG),
    )
    bench = Bench(scenario=scenario)
    do(bench, AUTOTRACK)
    bench.wait(5.0)
    assert status(bench).az_deg == pytest.approx(30.05, abs=0.005)
    assert status(bench).el_deg == pytest.approx(39.96, abs=0.005)
