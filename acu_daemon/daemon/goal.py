"""What scripts wait for, judged by a snapshot.  Pure."""

from enum import StrEnum

from acu_daemon.control.tracking.state_table import AUTOTRACKING, TrackState
from acu_daemon.daemon.snapshot import Snapshot


class Goal(StrEnum):
    """What the daemon should do."""

    TRACKING = "tracking"
    PASS = "pass"
    IDLE = "idle"


def is_reached(goal: Goal, seen: Snapshot) -> bool:
    """tracking: the ACU has the signal and tracks it, or in program track a receiver has it.

    pass: the satellite is up; idle: nothing is steered, none is up.

    Up: between rise and set of the pass in hand, above the station's lowest elevation.
    """
    is_up = seen.rise_in_s is not None and seen.rise_in_s <= 0.0 and seen.set_in_s is not None and seen.set_in_s > 0.0
    if goal is Goal.TRACKING:
        return seen.is_link_up and seen.is_acquired and seen.state in AUTOTRACKING | {TrackState.PROGRAM}
    if goal is Goal.PASS:
        return is_up
    return seen.state == TrackState.IDLE and not is_up
