"""The order of a start, and of a fresh start after the link was lost (docs/adding-an-acu.md, The start).

Poll, identify, read the registers, free the choice of the turn, write the present angles, read them back.
Only then is a path written or a mode selected, and the register watchdog set.  Disarmed, it stops before the first
write.  What an ACU has not (`Capabilities`) is left out; one that refuses to have its choice of the turn or its
watchdog read or written is taken as it is, with a warning.

Owner of `Startup`.
"""

from dataclasses import replace

from acu_daemon.acu.angle_steps import clamp_to_step
from acu_daemon.acu.commands import (
    Backup,
    Command,
    FreeTurnChoice,
    Identify,
    PointAt,
    ReadCommanded,
    ReadTurnChoice,
    ReadWatchdog,
    SelectBackup,
    SetWatchdog,
    Stop,
)
from acu_daemon.acu.replies import AcuIdentity, AcuStatus, Commanded, Done, Refused, TurnChoice, WatchdogTime
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState, StartStage, Startup, Watchdog
from acu_daemon.control.tick_input import Exchange
from acu_daemon.control.with_parts import with_parts
from acu_daemon.units import wrap_180

WATCHDOG_TRY_S = 2.0  # without the answer that is hoped for, and the ACU counts as having no watchdog


def next_command(state: ControlState, config: ControlConfig) -> Command | None:
    """The exchange that brings the start one step further; None when it waits or is done."""
    startup, status, asked = state.startup, state.intake.status, state.asked.command
    stage = reached(startup.stage, config)
    if stage is StartStage.NEW:
        return Identify()
    if stage is StartStage.IDENTIFIED:
        return ReadCommanded()
    if state.latch.problem or not state.is_armed(config) or status is None or not status.is_remote_enabled:
        return None
    if stage is StartStage.REGISTERS_KNOWN:
        return FreeTurnChoice() if asked == ReadTurnChoice() else ReadTurnChoice()
    if stage is StartStage.SECTOR_FREE:
        return PointAt(*_present(state, config)) if state.intake.is_place_sure else None
    if stage is StartStage.PRESENT_WRITTEN:
        return ReadCommanded()
    if config.register_watchdog_s > 0.0 and startup.watchdog is Watchdog.UNKNOWN:
        return SetWatchdog(config.register_watchdog_s) if asked == ReadWatchdog() else ReadWatchdog()
    return None


def reached(stage: StartStage, config: ControlConfig) -> StartStage:
    """The stage from which the start goes on: what the ACU has not is left out."""
    if stage is StartStage.IDENTIFIED and not config.acu.has_read_back:
        stage = StartStage.REGISTERS_KNOWN
    if stage is StartStage.REGISTERS_KNOWN and not config.acu.has_turn_choice:
        return StartStage.SECTOR_FREE
    return StartStage.READY if stage is StartStage.PRESENT_WRITTEN and not config.acu.has_read_back else stage


def begin_again(state: ControlState, *, keeps_watchdog: bool) -> ControlState:
    """Free the choice of the turn and write the present angles again; who the ACU is, is known.

    keeps_watchdog: it stays as it is set.  Else it is set again, but where the ACU has none.
    """
    startup = state.startup
    is_kept = keeps_watchdog or startup.watchdog is Watchdog.REFUSED
    watchdog = startup.watchdog if is_kept else Watchdog.UNKNOWN
    stage = min(startup.stage, StartStage.REGISTERS_KNOWN)
    return with_parts(state, startup=replace(startup, stage=stage, watchdog=watchdog))


def begin_after_lost_link(state: ControlState) -> ControlState:
    """Begin with the first question; the watchdog, where it was set, is set again."""
    startup = replace(state.startup, stage=StartStage.NEW, watchdog=_unset(state.startup), watchdog_from_tai_s=None)
    return with_parts(state, startup=startup)


def watch_for_power_cycle(state: ControlState, status: AcuStatus) -> ControlState:
    """A backup that changed by itself shows a power cycle.

    Then the registers, the tilt among them, are read again, and the watchdog is off.
    """
    before = state.intake.status
    was_remote = before is not None and before.backup_selected is Backup.REMOTE
    if state.startup.stage is not StartStage.READY or not was_remote or status.backup_selected is Backup.REMOTE:
        return state
    startup = replace(state.startup, stage=StartStage.IDENTIFIED, watchdog=_unset(state.startup))
    return with_parts(state, startup=startup)


def _unset(startup: Startup) -> Watchdog:
    return Watchdog.UNKNOWN if startup.watchdog is Watchdog.SET else startup.watchdog


def _present(state: ControlState, config: ControlConfig) -> tuple[float, float]:
    """Where the ends of the range have one bearing, within a step of it that bearing: both ends are it, and reached."""
    az_deg, ends_deg = state.intake.az_deg, (config.azimuth.min_deg, config.azimuth.max_deg)
    step_deg = config.acu.angle_step_deg
    if abs(ends_deg[1] - ends_deg[0] - 360.0) < step_deg:
        az_deg = next((end for end in ends_deg if abs(az_deg - end) <= 1.01 * step_deg), az_deg)
    return (
        clamp_to_step(az_deg, *ends_deg, step_deg),
        clamp_to_step(state.intake.el_deg, config.elevation.min_deg, config.elevation.max_deg, step_deg),
    )


def after_reply(
    state: ControlState, extra: Exchange, now_tai_s: float, config: ControlConfig, events: list[Event]
) -> ControlState:
    """Advance by the reply of an extra exchange; a missing or unexpected reply leaves the stage as it is."""
    startup, command, reply = state.startup, extra.command, extra.reply
    is_refused = (
        isinstance(reply, Refused) and state.intake.status is not None and state.intake.status.is_remote_enabled
    )
    match (reached(startup.stage, config), command, reply):
        case (_, Stop(), Done()):
            startup = replace(startup, watchdog=_perhaps_set(startup, config))
        case (_, ReadWatchdog() | SetWatchdog(), _):
            startup = _after_watchdog(startup, extra, now_tai_s, config, events, is_refused=is_refused)
        case (StartStage.READY, SelectBackup(), Done()) if startup.watchdog is Watchdog.SET:
            startup = replace(startup, watchdog=Watchdog.UNKNOWN)  # a backup to select may come from a power cycle
        case (StartStage.NEW, Identify(), AcuIdentity() as identity):
            startup = _identified(startup, identity, config, events)
        case (StartStage.IDENTIFIED, ReadCommanded(), Commanded()):
            startup = replace(startup, stage=StartStage.REGISTERS_KNOWN)
        case (StartStage.REGISTERS_KNOWN, ReadTurnChoice(), TurnChoice(is_nearest=True)) | (
            StartStage.REGISTERS_KNOWN,
            FreeTurnChoice(),
            Done(),
        ):
            startup = replace(startup, stage=StartStage.SECTOR_FREE)
        case (StartStage.REGISTERS_KNOWN, FreeTurnChoice(), Refused()) if is_refused:
            advice = "the antenna may turn the long way round: let the ACU follow a bearing on the nearest turn"
            events.append(Event("acu.sector_refused", {"advice": advice}, is_warning=True))
            startup = replace(startup, stage=StartStage.SECTOR_FREE)
        case (StartStage.SECTOR_FREE, PointAt() as written, Done()):
            stage = reached(StartStage.PRESENT_WRITTEN, config)
            startup = replace(startup, stage=stage, present_deg=(written.az_deg, written.el_deg))
        case (StartStage.PRESENT_WRITTEN, ReadCommanded(), Commanded() as read):
            startup = replace(
                startup, stage=StartStage.READY if _matches(startup, read, config) else StartStage.SECTOR_FREE
            )
    return state if startup is state.startup else with_parts(state, startup=startup)


def _identified(startup: Startup, identity: AcuIdentity, config: ControlConfig, events: list[Event]) -> Startup:
    """One that nobody knows may be a garbled one: it is asked again.  A rehearsal on a real ACU gets no further."""
    is_sure = identity.is_known or identity == startup.identity
    if not is_sure:
        events.append(Event("acu.identity_doubted", {"identity": str(identity)}, is_warning=True))
    may_go_on = is_sure and (identity.is_simulated or not config.is_rehearsal)
    stage = StartStage.IDENTIFIED if may_go_on else StartStage.NEW
    return replace(startup, stage=stage, identity=identity, is_identity_sure=is_sure)


def _perhaps_set(startup: Startup, config: ControlConfig) -> Watchdog:
    """After a STOP the watchdog is cleared also where the link, or a start, was cut off before it was read back."""
    is_ours = config.register_watchdog_s > 0.0 and startup.watchdog is Watchdog.UNKNOWN
    return Watchdog.SET if is_ours else startup.watchdog


def _after_watchdog(
    startup: Startup,
    extra: Exchange,
    now_tai_s: float,
    config: ControlConfig,
    events: list[Event],
    *,
    is_refused: bool,
) -> Startup:
    """The watchdog counts as set when it was read back; a clean stop has written 0."""
    if extra.command == SetWatchdog(0.0):
        is_done = is_refused or isinstance(extra.reply, Done)
        return replace(startup, watchdog=Watchdog.UNKNOWN) if is_done else startup
    if isinstance(extra.reply, WatchdogTime) and _is_as_wanted(extra.reply, config):
        return replace(startup, watchdog=Watchdog.SET, watchdog_from_tai_s=None)
    from_tai_s = now_tai_s if startup.watchdog_from_tai_s is None else startup.watchdog_from_tai_s
    if is_refused or now_tai_s - from_tai_s >= WATCHDOG_TRY_S:
        advice = "if this host dies in a loss of signal, the antenna drives to its last command and stays there"
        events.append(Event("acu.watchdog_refused", {"advice": advice}, is_warning=True))
        return replace(startup, watchdog=Watchdog.REFUSED, watchdog_from_tai_s=None)
    return replace(startup, watchdog_from_tai_s=from_tai_s)


def _is_as_wanted(read: WatchdogTime, config: ControlConfig) -> bool:
    return abs(read.after_s - config.register_watchdog_s) <= 0.501 * config.acu.watchdog_step_s


def _matches(startup: Startup, read: Commanded, config: ControlConfig) -> bool:
    if startup.present_deg is None:
        return False
    (az_deg, el_deg), step_deg = startup.present_deg, config.acu.angle_step_deg
    return abs(wrap_180(read.az_deg - az_deg)) < step_deg and abs(read.el_deg - el_deg) < step_deg
