"""Where the antenna points beside the path: the measured angles against it, at the reading's own time.  Pure.

The path is the satellite's as it is known, not the one that a slow azimuth drive is led along beside the zenith, and
not what the registers hold.  So an axis that cannot follow, or stands still, shows as what it is.
"""

from dataclasses import dataclass

from acu_daemon.control.state import ControlState
from acu_daemon.control.tick_input import Sky
from acu_daemon.control.tracking.by_hand import nudge_in_force, steered_point
from acu_daemon.control.tracking.causes import path_point
from acu_daemon.control.tracking.path_offset import learned_offset
from acu_daemon.control.tracking.state_table import ACTIVE, TrackState
from acu_daemon.model import Model, sky_angle_deg

MADE_FROM = {Model.NEW_FIT: "fit", Model.LAST_PASS: "last pass's fit", Model.ELEMENTS: "elements"}


@dataclass(frozen=True, slots=True)
class OffPath:
    """Degrees on the sky between antenna and path, and what the path is made from."""

    off_deg: float
    made_from: str


def off_path(state: ControlState, sky: Sky) -> OffPath | None:
    """In every state that steers or tracks; None in others, and where there is no path at the reading's time.

    Before the rise the path stands still where the pass begins.
    """
    reading = state.intake.reading
    if reading is None or state.tracking.track not in ACTIVE - {TrackState.SLAVED}:
        return None
    made_from = MADE_FROM[sky.prediction.model] if sky.prediction is not None else MADE_FROM[Model.ELEMENTS]
    if state.tracking.track is TrackState.PREPOSITION:
        point = path_point(sky, reading.tai_s, follow=False)
    else:
        point = steered_point(state, sky, reading.tai_s, follow=False)
        made_from += ", moved to the signal" if learned_offset(state, sky) is not None else ""
        made_from += ", nudged" if nudge_in_force(state) is not None else ""
    if point is None:
        return None
    return OffPath(sky_angle_deg(reading.az_deg, reading.el_deg, point.az_deg, point.el_deg), made_from)
