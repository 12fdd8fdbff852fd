"""The element sets that were fetched, by satellite: NUMBER.json in the store, and NUMBER.doubtful.json beside it.

Both are lists of orbit mean-elements messages as JSON, which any program reads.  The first has the newest sets that are
believed, never an older one in place of a newer; the second newer ones that those contradict.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees, pi
from pathlib import Path
from typing import Any

from acu_daemon.edge.orbit_file import read_orbit_file
from acu_daemon.edge.writer import remove_file, replace_file
from acu_daemon.errors import ElementsError, UsageError
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.elements import ElementLimits, check_elements
from acu_daemon.orbit.omm import parse_omm
from acu_daemon.orbit.set_judgement import Judged, Judgement, judge
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

MOST_SETS, LONGEST_S = 12, 30 * DAY_S  # of one satellite


@dataclass(frozen=True, slots=True)
class WantedSatellite:
    """A satellite of the station for which elements are fetched."""

    name: str
    norad_id: int
    limits: ElementLimits


@dataclass(frozen=True, slots=True)
class KeptSet:
    """What was done with a new set, and why it is not the one in force; "": it is."""

    satellite: WantedSatellite
    elements: ElementSet
    judgement: Judgement | None
    reason: str = ""


def sets_file(store: Path, norad_id: int) -> Path:
    """Where the believed sets of a satellite are."""
    return store / f"{norad_id}.json"


def doubtful_file(store: Path, norad_id: int) -> Path:
    """Where the set is that the believed ones contradict."""
    return store / f"{norad_id}.doubtful.json"


def read_sets(path: Path, norad_id: int) -> list[ElementSet]:
    """The sets of a file of the store, by epoch; none where there is no such file, or none that can be read."""
    try:
        kind, text = read_orbit_file(path)
    except (OSError, ElementsError, UsageError):
        return []
    sets, _ = parse_omm(text, str(path)) if kind == "omm" else ([], [])
    return sorted((one for one in sets if one.norad_id == norad_id), key=lambda one: one.epoch_tai_s)


def keep_set(store: Path, satellite: WantedSatellite, new: ElementSet, source: str, now_tai_s: float) -> KeptSet:
    """Judge a set that has come, and keep it where it belongs.  OSError: the store cannot be written."""
    errors, _ = check_elements(new, satellite.limits, now_tai_s)
    if errors:
        return KeptSet(satellite, new, None, errors[0])
    path, beside = sets_file(store, satellite.norad_id), doubtful_file(store, satellite.norad_id)
    believed = read_sets(path, satellite.norad_id)
    judgement = judge(believed[-1] if believed else None, new)
    match judgement.judged:
        case Judged.NEWER:
            _write(path, [*believed, new], source)
            remove_file(beside)
            return KeptSet(satellite, new, judgement)
        case Judged.SAME:
            return KeptSet(satellite, new, judgement)
        case Judged.OLDER:
            reason = f"older than what is kept, of {utc_text(believed[-1].epoch_tai_s, 0)}"
            return KeptSet(satellite, new, judgement, reason)
    before = read_sets(beside, satellite.norad_id)
    if not before or before[-1].epoch_tai_s < new.epoch_tai_s:
        _write(beside, [*before, new], source)  # the pass to come may be before the newest, and after the one before
    return KeptSet(satellite, new, judgement, f"{judgement}: kept beside them, the next pass decides")


def confirm_doubtful(store: Path, norad_id: int, epoch_tai_s: float) -> None:
    """A pass bears out the doubtful set of this epoch: it is believed, and newer ones that agree with it.

    OSError: the store cannot be written.
    """
    beside = doubtful_file(store, norad_id)
    found = [one for one in read_sets(beside, norad_id) if one.epoch_tai_s >= epoch_tai_s]
    agreeing = [one for one in found if judge(found[0], one).judged is not Judged.DOUBTFUL]
    if agreeing:
        _write(sets_file(store, norad_id), [*read_sets(sets_file(store, norad_id), norad_id), *agreeing], str(beside))
    remove_file(beside)


def _write(path: Path, sets: Sequence[ElementSet], source: str) -> None:
    newest_tai_s = sets[-1].epoch_tai_s
    kept = [one for one in sets if newest_tai_s - one.epoch_tai_s <= LONGEST_S][-MOST_SETS:]
    replace_file(path, (json.dumps([record_of(one, source) for one in kept], indent=1) + "\n").encode())


def record_of(elements: ElementSet, source: str) -> dict[str, Any]:
    """A set as an orbit mean-elements message (CCSDS 502.0), JSON with the keys of the KVN form."""
    return {
        "COMMENT": f"kept by acu-daemon, from {source}",
        "OBJECT_NAME": elements.name or f"NORAD {elements.norad_id}",
        "CENTER_NAME": "EARTH",
        "REF_FRAME": "TEME",
        "TIME_SYSTEM": "UTC",
        "MEAN_ELEMENT_THEORY": "SGP4",
        "EPOCH": utc_text(elements.epoch_tai_s, 6).removesuffix("Z"),
        "MEAN_MOTION": elements.mean_motion_rad_s * DAY_S / (2.0 * pi),
        "ECCENTRICITY": elements.eccentricity,
        "INCLINATION": degrees(elements.inclination_rad),
        "RA_OF_ASC_NODE": degrees(elements.raan_rad),
        "ARG_OF_PERICENTER": degrees(elements.argp_rad),
        "MEAN_ANOMALY": degrees(elements.mean_anomaly_rad),
        "NORAD_CAT_ID": elements.norad_id,
        "BSTAR": elements.bstar_per_radius,
    }
