"""Behind a hill: the silence of a satellite that the skyline hides is no loss, and nothing is searched there.  Pure."""

from math import isfinite

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import Sky

EDGE_BEAMS = 0.6  # over the skyline: as far as the lower part of the beam is in the hill, and the prediction is off


def is_hidden(sky: Sky, tai_s: float, config: ControlConfig) -> bool:
    """Whether the path is behind the skyline, or the beam on it is cut by it."""
    envelope = config.envelope
    if envelope.skyline is None or sky.prediction is None:
        return False
    point = sky.prediction.at(tai_s)
    if point is None or not point.is_finite:
        return False
    return envelope.over_skyline_deg(point.az_deg, point.el_deg) < EDGE_BEAMS * config.beamwidth_deg


def hidden_until_tai_s(sky: Sky, tai_s: float) -> float | None:
    """When it comes out again, by the elements and what the fit found, early or late; None: not before it sets."""
    if sky.plan is None:
        return None
    ends = (end + late_s(sky) for _, end in sky.plan.hidden_tai_s)
    return next((end for end in ends if end >= tai_s), None)


def came_out_tai_s(sky: Sky, tai_s: float) -> float:
    """When it came out of the last hill; its rise where there was none yet."""
    if sky.plan is None:
        return tai_s
    ends = [end + late_s(sky) for _, end in sky.plan.hidden_tai_s if end + late_s(sky) <= tai_s]
    return max(ends, default=sky.plan.rise_tai_s)


def late_s(sky: Sky) -> float:
    """By how much the satellite is late, where a fit knows it."""
    return sky.fit.along_s if sky.fit is not None and isfinite(sky.fit.along_s) else 0.0
