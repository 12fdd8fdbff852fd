"""The interlock: what a fault is, and the emergency stop or open door that disarms.  Owner of `Interlock`.  Pure."""

from acu_daemon.acu.commands import Command, ReadFaults
from acu_daemon.acu.replies import AcuStatus, FaultReport
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState, Interlock, StartStage
from acu_daemon.control.tick_input import STOWED_BY_US, Observation
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.control.with_parts import with_parts


def watch_interlock(state: ControlState, seen: Observation, config: ControlConfig) -> tuple[ControlState, str]:
    """Whether a person is at the antenna, and only a person can say that this is over; empty: nobody is seen."""
    faults = seen.extra.reply if seen.extra is not None else None
    if not isinstance(faults, FaultReport) or state.intake.status is None:
        is_asked = state.tracking.track is TrackState.FAULT or state.stow.stow_by in STOWED_BY_US
        return state if is_asked else forget_faults(state), ""
    is_alone = faults.has_watchdog_tripped and len(faults.texts) == 1
    state = with_parts(state, interlock=Interlock(fault_bits(state.intake.status), is_alone))
    if not (faults.is_emergency_stop or faults.is_door_open) or not state.is_armed_by_people(config):
        return state, ""
    return state, "the emergency stop" if faults.is_emergency_stop else "an open door"


def question(state: ControlState) -> Command | None:
    """Ask what a fault is, until it is answered, again when its bits change; and what put the antenna in STANDBY."""
    if state.startup.stage is StartStage.NEW or state.intake.status is None:
        return None
    if state.foreign_stop.is_doubted:
        return ReadFaults()
    is_before_stow = state.stow.stow_by in STOWED_BY_US and state.intake.status.has_interlock_fault
    if state.tracking.track is not TrackState.FAULT and not is_before_stow:
        return None
    return ReadFaults() if state.interlock.faults_read != fault_bits(state.intake.status) else None


def forget_faults(state: ControlState) -> ControlState:
    """The next fault is asked about anew."""
    return state if state.interlock.faults_read is None else with_parts(state, interlock=Interlock())


def fault_bits(status: AcuStatus) -> tuple[bool, ...]:
    """Its faults: azimuth, elevation, tilt, interlock or any other."""
    return (
        status.has_azimuth_fault,
        status.has_elevation_fault,
        status.has_tilt_fault,
        status.has_interlock_fault,
    )
