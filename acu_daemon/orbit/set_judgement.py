"""Whether a new element set of a satellite is believed: not older, and within 5 sigma of where the one before says."""

from dataclasses import dataclass
from enum import StrEnum
from math import hypot, isfinite

import numpy as np

from acu_daemon.errors import OrbitError
from acu_daemon.orbit.aging import expected_error
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.sgp4_source import Sgp4Propagator

MOST_SIGMAS = 5.0


class Judged(StrEnum):
    """What is done with a set that has come."""

    NEWER = "newer"
    SAME = "same"
    OLDER = "older"
    DOUBTFUL = "doubtful"


@dataclass(frozen=True, slots=True)
class Judgement:
    """shift_m: how far the new set puts the satellite from where the old one does at the new epoch, along the track."""

    judged: Judged
    shift_m: float = 0.0
    sigma_m: float = 0.0

    def __str__(self) -> str:
        """In words, for a set that is doubtful."""
        if not isfinite(self.shift_m):
            return "the elements before it have no position there"
        shift = f"{self.shift_m / 1e3:.0f} km, {self.sigmas} sigma"
        return f"it puts the satellite {shift}, from where the elements before it do"

    @property
    def sigmas(self) -> str:
        return f"{self.shift_m / self.sigma_m:.0f}" if self.sigma_m > 0.0 else "many"


def judge(old: ElementSet | None, new: ElementSet) -> Judgement:
    """Compare a set with the newest one that is believed; None: there is none.

    The sigma is what both are expected to be off at the new epoch.  A shift across the track counts alike.
    """
    if old is None:
        return Judgement(Judged.NEWER)
    if new.epoch_tai_s <= old.epoch_tai_s:
        is_same = new.epoch_tai_s == old.epoch_tai_s
        return Judgement(Judged.SAME if is_same else Judged.OLDER)
    at = np.array([new.epoch_tai_s])
    try:
        (r1_m, _), (r2_m, _) = (Sgp4Propagator(one).states_teme(at) for one in (old, new))
    except OrbitError:
        return Judgement(Judged.DOUBTFUL, float("inf"))
    shift_m = float(np.linalg.norm(r2_m - r1_m))
    sigma_m = hypot(*(expected_error(one, new.epoch_tai_s).along_m for one in (old, new)))
    judged = Judged.DOUBTFUL if shift_m > MOST_SIGMAS * sigma_m else Judged.NEWER
    return Judgement(judged, shift_m, sigma_m)
