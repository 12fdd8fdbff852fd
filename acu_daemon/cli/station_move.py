"""Moves between passes that nobody asked for: the warning before them, the run that makes one, and its end."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from acu_daemon.control.tick_input import PassPlan
from acu_daemon.control.tracking.approach import Way, way_s
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.service import PassJob
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import STILL_DEG_S
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.hooks import Hook, Hooks

IN_PLACE_DEG = 0.1
GONE_ON_S = 10.0  # a move that nobody has wanted for so long is warned of anew
MOVE_S = 60.0  # so much longer than reckoned a move may take
FAR_S = 3600.0  # when the pass of a move "rises"
IN_PLACE = "in place"


class Horn:
    """The hook before a move, begun once and heard long enough."""

    def __init__(self, hooks: Hooks, clock: Clock) -> None:
        self._hooks, self._clock = hooks, clock
        self._begun_tai_s = self._asked_tai_s = -math.inf

    def is_heard(self, about: Mapping[str, Any], for_s: float, *, is_wanted: bool) -> bool:
        """Whether whoever is at the antenna was warned early enough; the first call begins the warning."""
        now_tai_s = self._clock.tai_s()
        if not is_wanted:
            return True
        if not 0.0 <= now_tai_s - self._asked_tai_s < GONE_ON_S:  # a no-go put the move off, or the clock was set
            self._begun_tai_s = now_tai_s
            self._hooks.call(Hook.BEFORE_MOVE, about)
        self._asked_tai_s = now_tai_s
        return now_tai_s - self._begun_tai_s >= for_s

    def forget(self) -> None:
        """The antenna moves: the next move is warned of anew."""
        self._asked_tai_s = -math.inf


def move_job(job: PassJob, az_deg: float, el_deg: float, now_tai_s: float) -> tuple[PassJob, float]:
    """The run that only leads to a place, and until when it may take."""
    azimuth, elevation = job.control.azimuth, job.control.elevation
    way = Way(
        way_s(azimuth.max_deg - azimuth.min_deg, azimuth), way_s(elevation.max_deg - elevation.min_deg, elevation)
    )
    plan = PassPlan(now_tai_s + FAR_S, now_tai_s + 2.0 * FAR_S, now_tai_s + FAR_S, az_deg, el_deg)
    control = replace(job.control, preposition_s=math.inf)
    return replace(job, control=control, move=plan, satellite=""), now_tai_s + way.both_s + MOVE_S


def why_move_ends(seen: Snapshot, until_tai_s: float) -> str:
    """Why a move is over; empty: it goes on."""
    is_still = seen.speed_deg_s is not None and seen.speed_deg_s < STILL_DEG_S
    if is_still and seen.off_path_deg is not None and seen.off_path_deg < IN_PLACE_DEG:
        return IN_PLACE
    if seen.state == TrackState.STOW:
        return "stowed"
    return "not in place" if seen.tai_s > until_tai_s else ""
