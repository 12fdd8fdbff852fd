"""The permit of each command that is sent: none goes out without it, whoever wants it.  Pure.

The register limiter makes good register writes out of a path; the permit knows nothing of paths.  It lets a command out
only where stage, arming, latch and limits allow it, and what it keeps back is an error of ours: counted and logged.
"""

from math import isfinite

from acu_daemon.acu.commands import (
    READS,
    AcuMode,
    Backup,
    Command,
    FreeTurnChoice,
    PointAndPoll,
    PointAt,
    Poll,
    SelectBackup,
    SelectMode,
    SetWatchdog,
    Stop,
    Stow,
    command_text,
)
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event, Orders
from acu_daemon.control.registers import count_refusals
from acu_daemon.control.safety.stow import why_not_sent
from acu_daemon.control.startup import reached
from acu_daemon.control.state import ControlState, StartStage
from acu_daemon.control.tick_input import STOWED_BY_US
from acu_daemon.pointing.envelope import Envelope

DEEPER_DEG = 0.1  # what is no way further in: noise of a reading, rounding
SELECTED_MODES = (AcuMode.STANDBY, AcuMode.REMOTE, AcuMode.AUTOTRACK)


def permit(state: ControlState, orders: Orders, now_tai_s: float, config: ControlConfig) -> tuple[ControlState, Orders]:
    """Let orders out; a poll goes in the place of a first command that is kept back, nothing in that of an extra."""
    first_refusal = refusal(orders.first, state, now_tai_s, config)
    extra_refusal = refusal(orders.extra, state, now_tai_s, config) if orders.extra is not None else ""
    if not first_refusal and not extra_refusal:
        return state, orders
    events = list(orders.events)
    for command, reason in ((orders.first, first_refusal), (orders.extra, extra_refusal)):
        if command is not None and reason:
            events.append(Event("fence.refused", {"command": command_text(command), "reason": reason}, is_warning=True))
    return count_refusals(state, bool(first_refusal) + bool(extra_refusal)), Orders(
        Poll() if first_refusal else orders.first, None if extra_refusal else orders.extra, tuple(events)
    )


def refusal(command: Command, state: ControlState, now_tai_s: float, config: ControlConfig) -> str:
    """Why a command must not go out; empty: it may."""
    if isinstance(command, READS):
        return ""
    if config.is_shadow:
        return "a shadow commands nothing"
    if isinstance(command, Stop) or command == SetWatchdog(0.0):
        return ""
    if isinstance(command, Stow):
        is_wanted = state.stow.stow_by in STOWED_BY_US and state.startup.stage is not StartStage.NEW
        return why_not_sent(state, now_tai_s, config) if is_wanted else "not in its place"
    if state.latch.problem:
        return f"latched: {state.latch.problem}"
    if not state.is_armed(config):
        return "resting between passes" if config.is_resting else "disarmed"
    if state.intake.status is None or not state.intake.status.is_remote_enabled:
        return "the local panel has control"
    return _of_kind(command, state, now_tai_s, config)


def _of_kind(command: Command, state: ControlState, now_tai_s: float, config: ControlConfig) -> str:
    stage = reached(state.startup.stage, config)
    is_ready = stage is StartStage.READY
    match command:
        case PointAndPoll(az_deg=az_deg, el_deg=el_deg, tilt_deg=tilt_deg) if is_ready:
            if tilt_deg is not None and not _may_tilt(tilt_deg, config):
                return "tilt outside its limits"
            return _of_write(az_deg, el_deg, state, now_tai_s, config)
        case PointAt(az_deg=az_deg, el_deg=el_deg) if stage >= StartStage.SECTOR_FREE:
            return _of_write(az_deg, el_deg, state, now_tai_s, config)
        case SelectMode(mode=mode) if is_ready and mode in SELECTED_MODES:
            return ""
        case SelectBackup(backup=Backup.REMOTE) if is_ready:
            return ""
        case FreeTurnChoice() | SetWatchdog() if stage >= StartStage.REGISTERS_KNOWN:
            return ""
    return "not in its place"


def _may_tilt(tilt_deg: float, config: ControlConfig) -> bool:
    return config.tilt is not None and config.tilt.min_deg <= tilt_deg <= config.tilt.max_deg


def _of_write(az_deg: float, el_deg: float, state: ControlState, now_tai_s: float, config: ControlConfig) -> str:
    """An antenna within a keep-out may be led out of it, or stay; never further in than it or its registers are."""
    envelope, status = config.envelope, state.intake.status
    refused = of_angles(az_deg, el_deg, now_tai_s, envelope, config.acu.angle_step_deg)
    if not refused or not envelope.has_zones or status is None or not isfinite(az_deg + el_deg):
        return refused
    if envelope.beyond_limits(az_deg, el_deg, config.acu.angle_step_deg):
        return refused
    antenna_deg = least_deg = envelope.clearance_deg(state.intake.az_deg, status.el_deg, now_tai_s)
    if state.registers.in_force is not None:
        least_deg = min(antenna_deg, envelope.clearance_deg(*state.registers.in_force[1:], now_tai_s))
    is_out = envelope.clearance_deg(az_deg, el_deg, now_tai_s) >= least_deg - DEEPER_DEG
    return "" if antenna_deg < DEEPER_DEG and is_out else refused


def of_angles(az_deg: float, el_deg: float, now_tai_s: float, envelope: Envelope, step_deg: float) -> str:
    """Why registers must not be written with such angles; empty: they may."""
    refused = envelope.why_not(az_deg, el_deg, now_tai_s, step_deg)
    if refused:  # what is not finite is within no limits
        for name, angle_deg in (("azimuth", az_deg), ("elevation", el_deg)):
            if not isfinite(angle_deg):
                return f"{name} is not a finite angle"
    return refused
