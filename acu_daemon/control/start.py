"""The order of a start, and of a fresh start after the link was lost (design section 3).

Poll, identify, read the registers (for the tilt), free the sector preference, write the present angles, read them back.
Only then is a path written or a mode selected.  Disarmed, it stops before the first write.
"""

from dataclasses import replace

from acu_daemon.control.state import ControlConfig, ControlState, Exchange, Stage
from acu_daemon.protocol.angles import LSB_DEG, clamp_deg
from acu_daemon.protocol.messages import (
    Ack,
    Command,
    Identify,
    Identity,
    Parameter,
    ReadParameter,
    ReadRegisters,
    Registers,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.units import wrap_180

SECTOR = "S"  # the ACU's sector preference; 0: a register is followed the nearest way (ICD section 4)


def next_command(state: ControlState, config: ControlConfig) -> Command | None:
    """The exchange that brings the start one step further; None when it waits or is done."""
    if state.stage is Stage.NEW:
        return Identify()
    if state.stage is Stage.IDENTIFIED:
        return ReadRegisters()
    if not config.is_armed or state.status is None or not state.status.is_remote_enabled:
        return None
    if state.stage is Stage.REGISTERS_KNOWN:
        return WriteParameter(SECTOR, 0) if state.last_extra == ReadParameter(SECTOR) else ReadParameter(SECTOR)
    if state.stage is Stage.SECTOR_FREE:
        return WriteRegisters(*_present(state, config))
    if state.stage is Stage.PRESENT_WRITTEN:
        return ReadRegisters()
    return None


def _present(state: ControlState, config: ControlConfig) -> tuple[float, float]:
    el_deg = state.status.el_deg if state.status else 0.0
    return (
        clamp_deg(state.az_deg, config.azimuth.min_deg, config.azimuth.max_deg),
        clamp_deg(el_deg, config.elevation.min_deg, config.elevation.max_deg),
    )


def after_reply(state: ControlState, extra: Exchange) -> ControlState:
    """Advance by the reply of an extra exchange; a missing or unexpected reply leaves the stage as it is."""
    command, reply = extra.command, extra.reply
    match (state.stage, command, reply):
        case (Stage.NEW, Identify(), Identity()):
            return replace(state, stage=Stage.IDENTIFIED)
        case (Stage.IDENTIFIED, ReadRegisters(), Registers(tilt_code=tilt_code)):
            return replace(state, stage=Stage.REGISTERS_KNOWN, tilt_code=tilt_code)
        case (Stage.REGISTERS_KNOWN, ReadParameter("S"), Parameter(code=0)) | (
            Stage.REGISTERS_KNOWN,
            WriteParameter("S"),
            Ack(),
        ):
            return replace(state, stage=Stage.SECTOR_FREE)
        case (Stage.SECTOR_FREE, WriteRegisters() as written, Ack()):
            return replace(state, stage=Stage.PRESENT_WRITTEN, present_deg=(written.az_deg, written.el_deg))
        case (Stage.PRESENT_WRITTEN, ReadRegisters(), Registers() as read):
            return replace(state, stage=Stage.READY if _matches(state, read) else Stage.SECTOR_FREE)
    return state


def _matches(state: ControlState, read: Registers) -> bool:
    if state.present_deg is None:
        return False
    az_deg, el_deg = state.present_deg
    return abs(wrap_180(read.az_deg - az_deg)) < LSB_DEG and abs(read.el_deg - el_deg) < LSB_DEG
