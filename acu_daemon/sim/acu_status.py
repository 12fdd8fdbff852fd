"""SIMULATION of what the ACU shows: status block, and flags that it watches (docs/protocol.md, Status block)."""

from acu_daemon.acu.commands import AcuMode
from acu_daemon.drivers.sa3842.messages import Faults, Status
from acu_daemon.sim.acu_modes import BACKUP_MODES, Modes
from acu_daemon.sim.antenna import SimulatedAntenna


def status_of(
    antenna: SimulatedAntenna, modes: Modes, faults: Faults, *, part_s: float, has_changed: bool, has_tilt: bool
) -> Status:
    """The status block; part_s: since the servo's last tick.  faults: those remembered."""
    az, el, tilt, receiver = antenna.az, antenna.el, antenna.tilt, antenna.receiver
    az_deg, el_deg = antenna.reading_deg(part_s)
    return Status(
        az_deg=az_deg % 360.0,
        el_deg=el_deg,
        mode=modes.mode,
        tilt_deg=tilt.angle_deg,
        agc_db=receiver.agc_db,
        backup_selected=modes.backup,
        is_backup_active=modes.mode in BACKUP_MODES,
        is_autotrack_selected=modes.is_autotrack_selected,
        is_acquired=receiver.is_acquired,
        is_loss_latched=modes.is_loss_latched,
        is_track_valid=modes.is_track_valid,
        is_receiver_valid=receiver.is_valid,
        is_remote_enabled=modes.is_remote_enabled,
        are_registers_written=modes.are_registers_written,
        are_registers_idle=modes.are_registers_written and not modes.follows_registers,
        has_changed=has_changed,
        has_azimuth_fault=faults.azimuth != 0,
        has_elevation_fault=faults.elevation != 0,
        has_tilt_fault=faults.tilt != 0,
        has_interlock_fault=bool(faults.interlock or faults.encoders or faults.system),
        is_at_cw_limit=az.is_at_max,
        is_at_ccw_limit=az.is_at_min,
        is_azimuth_clamped=az.is_clamped,
        is_sector_high=antenna.is_sector_high,
        is_at_up_limit=el.is_at_max,
        is_at_down_limit=el.is_at_min,
        is_elevation_clamped=el.is_clamped,
        is_stow_pin_in=modes.mode is AcuMode.STOWED,
        is_tilt_fitted=has_tilt,
        is_tilt_moving=tilt.is_moving,
        is_at_tilt_upper_limit=has_tilt and tilt.is_at_max,
        is_at_tilt_lower_limit=has_tilt and tilt.is_at_min,
    )


def flags_of(antenna: SimulatedAntenna, modes: Modes, faults: Faults) -> tuple[object, ...]:
    """Everything whose change sets the CHANGE bit, parameters apart."""
    az, el, tilt, receiver = antenna.az, antenna.el, antenna.tilt, antenna.receiver
    return (
        modes.mode,
        modes.backup,
        modes.is_autotrack_selected,
        receiver.is_acquired,
        modes.is_loss_latched,
        modes.is_track_valid,
        receiver.is_valid,
        modes.is_remote_enabled,
        faults,
        az.is_clamped,
        el.is_clamped,
        az.is_at_max,
        az.is_at_min,
        antenna.is_sector_high,
        el.is_at_max,
        el.is_at_min,
        tilt.is_moving,
        tilt.is_at_max,
        tilt.is_at_min,
    )
