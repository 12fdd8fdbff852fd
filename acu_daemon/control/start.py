"""The order of a start, and of a fresh start after the link was lost (design section 3).

Poll, identify, read the registers (for the tilt), free the sector preference, write the present angles, read them back.
Only then is a path written or a mode selected, and the register watchdog set.  Disarmed, it stops before the first
write.  An ACU that refuses to have its parameters read or written is taken as it is, with a warning.
"""

from acu_daemon.control.axis_watch import AxesWatch
from acu_daemon.control.changed import changed
from acu_daemon.control.state import ControlConfig, ControlState, Event, Exchange, Stage, Watchdog
from acu_daemon.protocol.angles import LSB_DEG, clamp_deg
from acu_daemon.protocol.messages import (
    Ack,
    Command,
    Identify,
    Identity,
    Nak,
    Parameter,
    ReadParameter,
    ReadRegisters,
    Registers,
    SelectBackup,
    Stop,
    WriteParameter,
    WriteRegisters,
)
from acu_daemon.units import wrap_180

SECTOR = "S"  # the ACU's sector preference; 0: a register is followed the nearest way (ICD section 4)
WATCHDOG = "W"  # the ACU's register watchdog: unwritten registers that are followed put it in STANDBY
WATCHDOG_LSB_S = 0.02  # ICD section 3
WATCHDOG_TRY_S = 2.0  # without the answer that is hoped for, and the ACU counts as having no watchdog


def next_command(state: ControlState, config: ControlConfig) -> Command | None:
    """The exchange that brings the start one step further; None when it waits or is done."""
    if state.stage is Stage.NEW:
        return Identify()
    if state.stage is Stage.IDENTIFIED:
        return ReadRegisters()
    if state.latch or not state.is_armed(config) or state.status is None or not state.status.is_remote_enabled:
        return None
    if state.stage is Stage.REGISTERS_KNOWN:
        return WriteParameter(SECTOR, 0) if state.last_extra == ReadParameter(SECTOR) else ReadParameter(SECTOR)
    if state.stage is Stage.SECTOR_FREE:
        return WriteRegisters(*_present(state, config)) if state.is_place_sure else None
    if state.stage is Stage.PRESENT_WRITTEN:
        return ReadRegisters()
    if config.register_watchdog_s > 0.0 and state.watchdog is Watchdog.UNKNOWN:
        if state.last_extra == ReadParameter(WATCHDOG):
            return WriteParameter(WATCHDOG, watchdog_code(config))
        return ReadParameter(WATCHDOG)
    return None


def anew(state: ControlState) -> ControlState:
    """Before the next write the present angles are written, as at a start."""
    return changed(
        state,
        stage=min(state.stage, Stage.REGISTERS_KNOWN),
        last_extra=None,
        axis_az=None,
        axis_el=None,
        was_followed=False,
        axes=AxesWatch(),
        watchdog=state.watchdog if state.watchdog is Watchdog.REFUSED else Watchdog.UNKNOWN,
        is_stop_doubted=False,
    )


def watchdog_code(config: ControlConfig) -> int:
    """Code of the register watchdog's time."""
    return round(config.register_watchdog_s / WATCHDOG_LSB_S)


def _present(state: ControlState, config: ControlConfig) -> tuple[float, float]:
    """Where the ends of the range have one bearing, within a code of it that bearing: both ends are it, and reached."""
    el_deg = state.status.el_deg if state.status else 0.0
    az_deg, ends_deg = state.az_deg, (config.azimuth.min_deg, config.azimuth.max_deg)
    if abs(ends_deg[1] - ends_deg[0] - 360.0) < LSB_DEG:
        az_deg = next((end for end in ends_deg if abs(az_deg - end) <= 1.01 * LSB_DEG), az_deg)
    return (
        clamp_deg(az_deg, *ends_deg),
        clamp_deg(el_deg, config.elevation.min_deg, config.elevation.max_deg),
    )


def after_reply(
    state: ControlState, extra: Exchange, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Advance by the reply of an extra exchange; a missing or unexpected reply leaves the stage as it is."""
    command, reply = extra.command, extra.reply
    is_refused = isinstance(reply, Nak) and state.status is not None and state.status.is_remote_enabled
    match (state.stage, command, reply):
        case (_, Stop(), Ack()):
            return changed(state, is_stop_due=False, watchdog=_perhaps_set(state, config))
        case (_, ReadParameter("W") | WriteParameter("W"), _):
            return _after_watchdog(state, extra, now_tai_s, config, events, is_refused=is_refused)
        case (Stage.READY, SelectBackup(), Ack()) if state.watchdog is Watchdog.SET:
            return changed(state, watchdog=Watchdog.UNKNOWN)  # a backup to select may come from a power cycle
        case (Stage.NEW, Identify(), Identity() as identity):
            return _identified(state, identity, config, events)
        case (Stage.IDENTIFIED, ReadRegisters(), Registers(tilt_code=tilt_code)):
            return changed(state, stage=Stage.REGISTERS_KNOWN, tilt_code=tilt_code)
        case (Stage.REGISTERS_KNOWN, ReadParameter("S"), Parameter(code=0)) | (
            Stage.REGISTERS_KNOWN,
            WriteParameter("S"),
            Ack(),
        ):
            return changed(state, stage=Stage.SECTOR_FREE)
        case (Stage.REGISTERS_KNOWN, WriteParameter("S"), Nak()) if is_refused:
            advice = "the antenna may turn the long way round: set the ACU's parameter S to 0 by hand"
            events.append(Event("acu.sector_refused", {"advice": advice}, is_warning=True))
            return changed(state, stage=Stage.SECTOR_FREE)
        case (Stage.SECTOR_FREE, WriteRegisters() as written, Ack()):
            return changed(state, stage=Stage.PRESENT_WRITTEN, present_deg=(written.az_deg, written.el_deg))
        case (Stage.PRESENT_WRITTEN, ReadRegisters(), Registers() as read):
            return changed(state, stage=Stage.READY if _matches(state, read) else Stage.SECTOR_FREE)
    return state


def _identified(state: ControlState, identity: Identity, config: ControlConfig, events: list[Event]) -> ControlState:
    """One that nobody knows may be a garbled one: it is asked again.  A rehearsal on a real ACU gets no further."""
    is_sure = identity.is_known or identity == state.identity
    if not is_sure:
        events.append(Event("acu.identity_doubted", {"identity": str(identity)}, is_warning=True))
    may_go_on = is_sure and (identity.is_simulated or not config.is_rehearsal)
    stage = Stage.IDENTIFIED if may_go_on else Stage.NEW
    return changed(state, stage=stage, identity=identity, is_identity_sure=is_sure)


def _perhaps_set(state: ControlState, config: ControlConfig) -> Watchdog:
    """After a STOP the watchdog is cleared also where the link, or a start, was cut off before it was read back."""
    is_ours = config.register_watchdog_s > 0.0 and state.watchdog is Watchdog.UNKNOWN
    return Watchdog.SET if is_ours else state.watchdog


def _after_watchdog(
    state: ControlState,
    extra: Exchange,
    now_tai_s: float,
    config: ControlConfig,
    events: list[Event],
    *,
    is_refused: bool,
) -> ControlState:
    """The watchdog counts as set when it was read back; a clean stop has written 0."""
    if extra.command == WriteParameter(WATCHDOG, 0):
        is_done = is_refused or isinstance(extra.reply, Ack)
        return changed(state, watchdog=Watchdog.UNKNOWN) if is_done else state
    if extra.reply == Parameter(WATCHDOG, watchdog_code(config)):
        return changed(state, watchdog=Watchdog.SET, watchdog_from_tai_s=None)
    from_tai_s = now_tai_s if state.watchdog_from_tai_s is None else state.watchdog_from_tai_s
    if is_refused or now_tai_s - from_tai_s >= WATCHDOG_TRY_S:
        advice = "if this host dies in a loss of signal, the antenna drives to its last command and stays there"
        events.append(Event("acu.watchdog_refused", {"advice": advice}, is_warning=True))
        return changed(state, watchdog=Watchdog.REFUSED, watchdog_from_tai_s=None)
    return changed(state, watchdog_from_tai_s=from_tai_s)


def _matches(state: ControlState, read: Registers) -> bool:
    if state.present_deg is None:
        return False
    az_deg, el_deg = state.present_deg
    return abs(wrap_180(read.az_deg - az_deg)) < LSB_DEG and abs(read.el_deg - el_deg) < LSB_DEG
