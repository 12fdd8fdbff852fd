"""What is said when the antenna sets out: too late to be at the rise point, or into a pass that has begun.  Pure."""

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Event
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.approach import BEGIN_S, way_s, way_to
from acu_daemon.control.tracking.causes import path_point
from acu_daemon.model import sky_angle_deg

_MEETINGS = 4  # of way and moving path: the next one is nearer than the prediction matters


def lateness(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> list[Event]:
    """Say by how much the rise is missed; in mid-pass, how long after it and how long until the path is reached."""
    if sky.plan is None or state.signal.has_acquired:
        return []
    after_rise_s = now_tai_s - sky.plan.rise_tai_s
    if after_rise_s >= 0.0:
        return _joined(state, sky, now_tai_s, after_rise_s, config)
    way = way_to(sky.plan, state, config)
    late_s = after_rise_s + way.both_s
    if late_s <= 0.0:
        return []
    seconds = {"late_s": late_s, "azimuth_s": way.azimuth_s, "elevation_s": way.elevation_s}
    fields = {name: round(value, 1) for name, value in seconds.items()}
    return [Event("pass.late", fields, is_warning=True)]


def _joined(state: ControlState, sky: Sky, now_tai_s: float, after_rise_s: float, config: ControlConfig) -> list[Event]:
    path = path_point(sky, now_tai_s)
    if state.intake.status is None or path is None or not path.is_finite:
        return []
    off_deg = sky_angle_deg(state.intake.az_deg, state.intake.status.el_deg, path.az_deg, path.el_deg)
    is_on_turn = abs(path.az_deg - state.intake.az_deg) < 180.0
    is_on = is_on_turn and off_deg <= config.beamwidth_deg / 2
    on_path_s = 0.0 if is_on else _until_on_path_s(state, sky, now_tai_s, config)
    fields = {
        "after_rise_s": round(after_rise_s, 1),
        "off_path_deg": round(off_deg, 2),
        "on_path_s": round(on_path_s, 1),
    }
    return [Event("pass.joined", fields, is_warning=not is_on)]


def _until_on_path_s(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> float:
    """Until the antenna meets the path, which moves on meanwhile, as far as the buffer knows it."""
    el_deg = state.intake.status.el_deg if state.intake.status is not None else 0.0
    until_s = 0.0
    for _ in range(_MEETINGS):
        path = path_point(sky, now_tai_s + until_s)
        if path is None or not path.is_finite:
            break
        az_way_deg, el_way_deg = path.az_deg - state.intake.az_deg, path.el_deg - el_deg  # to the turn that is planned
        ways_s = way_s(az_way_deg, config.azimuth), way_s(el_way_deg, config.elevation)
        until_s = BEGIN_S + max(ways_s)
    return until_s
