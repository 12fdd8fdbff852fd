"""Where the registers shall point: along the path, for the moment they take effect.  Pure."""

from dataclasses import replace
from math import copysign

from acu_daemon.acu.commands import AcuMode
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.by_hand import steered_point
from acu_daemon.control.tracking.causes import path_point
from acu_daemon.control.tracking.scan import pointing
from acu_daemon.control.tracking.slaving import slaved_point
from acu_daemon.control.tracking.state_table import ACTIVE, AUTOTRACKING, HOLDING, TrackState
from acu_daemon.model import Pointing
from acu_daemon.pointing.wrap import nearest_turn

AHEAD_DEG_S = 0.01  # slower is standing


def aim(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> Pointing:
    """The direction the registers shall hold: for the middle of the time they are in force, led by the learned lag."""
    is_followed = state.intake.status is not None and state.intake.status.follows_registers
    if is_followed and state.turn.move_to_deg is not None:
        return replace(_rest(state, is_followed=True), az_deg=state.turn.move_to_deg)
    lag_az_s, lag_el_s = state.lag_s(config) if is_followed else (0.0, 0.0)
    aim_tai_s = now_tai_s + config.effect_delay_s + config.period_s / 2
    az = _point(state, sky, aim_tai_s + lag_az_s, config, is_followed=is_followed)
    el = az if lag_el_s == lag_az_s else _point(state, sky, aim_tai_s + lag_el_s, config, is_followed=is_followed)
    if az is None or el is None:
        return _rest(state, is_followed=is_followed)
    az_deg, el_deg = _on_turn(az.az_deg, state, config, is_followed=is_followed), el.el_deg
    if config.acu.dead_band_deg and is_followed:
        half_deg = config.acu.dead_band_deg / 2
        az_deg += _ahead(az.az_rate_deg_s) * half_deg
        el_deg += _ahead(el.el_rate_deg_s) * half_deg
    return Pointing(az_deg, el_deg, az.az_rate_deg_s, el.el_rate_deg_s)


def _ahead(rate_deg_s: float) -> float:
    """An antenna that is sent on only when it is a dead band behind goes half of that ahead: so it is as far before."""
    return 0.0 if abs(rate_deg_s) < AHEAD_DEG_S else copysign(1.0, rate_deg_s)


def _point(
    state: ControlState, sky: Sky, aim_tai_s: float, config: ControlConfig, *, is_followed: bool
) -> Pointing | None:
    may_jump = not is_followed and state.tracking.track not in AUTOTRACKING and not _is_denied(state, config)
    if state.tracking.track not in ACTIVE or may_jump:
        return None  # a mode that follows the registers must find them where the antenna is, not where it shall go
    if state.tracking.track is TrackState.SLAVED:
        return slaved_point(state)
    if state.tracking.track is TrackState.SEARCH and sky.prediction is not None:
        return pointing(state.search.scan, sky.prediction, aim_tai_s, config) or path_point(sky, aim_tai_s)
    return steered_point(state, sky, aim_tai_s, follow=is_followed)


def _is_denied(state: ControlState, config: ControlConfig) -> bool:
    """Whether the ACU goes on to follow a signal that the receiver beside it denies: the path is held ready."""
    status = state.intake.status
    is_autotracking = status is not None and status.mode is AcuMode.AUTOTRACK
    return config.receiver is not None and is_autotracking and state.tracking.track in HOLDING


def _rest(state: ControlState, *, is_followed: bool) -> Pointing:
    """Where nothing is to be followed: the present angles, or a standstill for an antenna that follows."""
    registers = state.registers
    if is_followed and registers.axis_az is not None and registers.axis_el is not None:
        return Pointing(registers.axis_az.position_deg, registers.axis_el.position_deg, 0.0, 0.0)
    return Pointing(state.intake.az_deg, state.intake.el_deg, 0.0, 0.0)


def _on_turn(az_deg: float, state: ControlState, config: ControlConfig, *, is_followed: bool) -> float:
    """Take a bearing on a turn inside the limits: a follower's own, or past its end the long way round on another.

    PREPOSITION goes to the turn that was planned, and registers that are not followed may hold any.
    """
    near_deg = az_deg
    if is_followed and state.tracking.track is not TrackState.PREPOSITION:
        register = state.registers.axis_az if state.registers.was_followed else None
        near_deg = state.intake.az_deg if register is None else register.position_deg
    turned_deg = nearest_turn(az_deg, near_deg, config.azimuth)
    return az_deg if turned_deg is None else turned_deg
