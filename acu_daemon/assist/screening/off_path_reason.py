"""Why readings are off the path: a side lobe, another satellite, or unknown (docs/estimation.md, Screening).  Pure."""

from math import hypot

import numpy as np

from acu_daemon.assist.reading_gate import OFF_PATH, SIDE_LOBE, WRONG_TARGET
from acu_daemon.assist.screening.offsets import Offsets
from acu_daemon.assist.screening_limits import (
    BEFORE_S,
    DRIFT_BEAMS_S,
    DRIFT_SCATTERS,
    LOW_DB,
    RECENT_S,
    SIDE_LOBE_BEAMS,
)
from acu_daemon.model import Readings


def level_db(readings: Readings, newest_s: float) -> float | None:
    """The usual AGC of the newest readings; None where nobody knows."""
    if len(readings) == 0 or readings.agc_db is None:
        return None
    newest = readings.agc_db[readings.tai_s >= readings.tai_s[-1] - newest_s]
    known = newest[~np.isnan(newest)]
    return float(np.median(known)) if known.size else None


def rise_db(kept: Readings, off: Readings) -> float | None:
    """How much stronger the newest readings off the path are than those kept; None where nobody knows."""
    before_db, now_db = level_db(kept, BEFORE_S), level_db(off, RECENT_S)
    return None if before_db is None or now_db is None else now_db - before_db


def reason_of(seen: Offsets, rise: float | None, beamwidth_deg: float) -> str:
    """The reason of readings off the path, oldest first, by the newest of them."""
    newest = seen.tai_s >= seen.tai_s[-1] - RECENT_S
    drift_deg_s = hypot(*seen.drift_deg_s(RECENT_S))
    scatter_deg = hypot(float(np.std(seen.right_deg[newest])), float(np.std(seen.up_deg[newest])))
    is_drift = drift_deg_s * float(np.ptp(seen.tai_s[newest])) > DRIFT_SCATTERS * scatter_deg
    if is_drift and drift_deg_s > DRIFT_BEAMS_S * beamwidth_deg and seen.tai_s.size > 2:
        return WRONG_TARGET
    beams = seen.angle_deg[newest] / beamwidth_deg
    is_beside = float(np.mean((beams >= SIDE_LOBE_BEAMS[0]) & (beams <= SIDE_LOBE_BEAMS[1]))) > 0.5
    return SIDE_LOBE if is_beside and (rise is None or rise < -LOW_DB) else OFF_PATH


def left_path_tai_s(seen: Offsets) -> float:
    """When a track that drifts was on the path: its offset traced back to zero, by RECENT_S at most."""
    right, up = seen.drift_deg_s(RECENT_S)
    first_tai_s = float(seen.tai_s[0])
    speed2 = right * right + up * up
    if speed2 == 0.0:
        return first_tai_s - RECENT_S
    back_s = float(seen.right_deg[0] * right + seen.up_deg[0] * up) / speed2
    return first_tai_s - min(max(back_s, 0.0), RECENT_S)
