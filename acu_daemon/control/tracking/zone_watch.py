"""Whether path or antenna come near a keep-out zone: autotrack, which knows of none, is taken over in time.  Pure.

An autotrack that follows its signal into a zone must be left before it: early enough for the mode to change, twice
should a command be lost, and for the axes to brake.  Without zones nothing here is computed.
"""

from math import hypot

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.way_round import RIM_DEG

LEAD_S = 4.0  # before the zone: a mode command takes 0.3 s, may be lost, and the axes brake
LOOK_S = 0.25  # between two looks along a path that comes near


def nears_zone(state: ControlState, sky: Sky, now_tai_s: float, config: ControlConfig) -> bool:
    """Whether the path is within a zone's rim, or will be within LEAD_S, or the antenna on its present way."""
    envelope = config.envelope
    if not envelope.has_zones:
        return False
    return _path_nears(sky, now_tai_s, envelope) or antenna_nears(state, now_tai_s, envelope)


def _path_nears(sky: Sky, now_tai_s: float, envelope: Envelope) -> bool:
    """Looked at as far apart in time as the clearance allows at the path's rate."""
    ahead_s = 0.0
    while sky.prediction is not None and ahead_s <= LEAD_S:
        point = sky.prediction.at(now_tai_s + ahead_s)
        if point is None or not point.is_finite:
            return False
        spare_deg = envelope.clearance_deg(point.az_deg, point.el_deg, now_tai_s) - RIM_DEG
        if spare_deg < 0.0:
            return True
        speed = hypot(point.az_rate_deg_s, point.el_rate_deg_s)
        ahead_s += max(spare_deg / (2.0 * max(speed, 1e-6)), LOOK_S)
    return False


def antenna_nears(state: ControlState, now_tai_s: float, envelope: Envelope) -> bool:
    """The same of where the antenna is and how it moves, as the readings of the last half second show it."""
    intake = state.intake
    if len(intake.track_of_readings) < 2:
        return False
    first, last = intake.track_of_readings[0], intake.track_of_readings[-1]
    spare_deg = envelope.clearance_deg(last[1], last[2], now_tai_s)
    if spare_deg < 0.0:
        return True
    span_s = last[0] - first[0]
    if span_s <= 0.0:
        return False
    az_rate, el_rate = (last[1] - first[1]) / span_s, (last[2] - first[2]) / span_s
    if hypot(az_rate, el_rate) * LEAD_S < spare_deg:
        return False
    steps = range(1, 1 + round(LEAD_S / LOOK_S))
    return any(
        envelope.clearance_deg(last[1] + az_rate * LOOK_S * k, last[2] + el_rate * LOOK_S * k, now_tai_s) < 0.0
        for k in steps
    )
