"""What the station remembers of its antenna, in the state directory: one JSON file, whole at any time, written here.

The file has the memory before the newest pass and, beside it, what that pass says so far.  They are put together when
another pass begins: a daemon that is killed in mid-pass loses nothing, and one that goes on in it counts no reading
twice.
"""

import contextlib
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import structlog

from acu_daemon.assist.estimators.full.noise_correlation import NoiseCorrelation
from acu_daemon.assist.estimators.full.pedestal_prior import IA, IE, PEDESTAL_TERMS, Doubt
from acu_daemon.assist.mount_memory.day_and_night import STATE_COUNT, SWING_DEG, SWINGS
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory, Remembered, first_memory
from acu_daemon.assist.mount_memory.update import Updated, updated
from acu_daemon.assist.mount_memory.whole_pass import PassEstimate
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge.carry_over_file import number, numbers, reason_of
from acu_daemon.edge.writer import Latest, Writer, replace_file
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DEG, Array

MOUNT = "mount.json"
REHEARSAL = "-rehearsal"  # what the state directory of rehearsals ends in
VERSION = 2  # 1: without day and night
MOST_ROWS = 500  # of the passes told, the newest
MOST_DEG = 10.0  # of a term beyond [mount]: no encoder of a station that tracks is so far off
_LARGEST_BYTES = 1_000_000
_SAME_PASS_S = 3600.0  # no satellite rises again so soon
_COUNT = len(PEDESTAL_TERMS)


@dataclass(frozen=True)
class PassRow:
    """A pass for people: IA and IE as its fit had them, their sigmas, and what became of it."""

    utc: str
    satellite: str
    ia_deg: float
    ie_deg: float
    ia_sigma_deg: float
    ie_sigma_deg: float
    what: str = ""


@dataclass(frozen=True)
class MountFile:
    """The memory before the newest pass, that pass, and the passes before it, oldest first.

    pedestal: what the memory is of, in words; of another pedestal it is worth nothing.
    """

    pedestal: str
    memory: PedestalMemory
    rows: tuple[PassRow, ...] = ()
    satellite: str = ""
    rise_tai_s: float = 0.0
    newest: PassEstimate | None = field(default=None, repr=False)

    def is_of(self, satellite: str, rise_tai_s: float) -> bool:
        """Whether its newest pass is this one."""
        return satellite == self.satellite and abs(rise_tai_s - self.rise_tai_s) < _SAME_PASS_S

    def settled(self, settings: EstimatorSettings) -> tuple["MountFile", Updated | None]:
        """With the newest pass in the memory, and what came of that; None: there is none."""
        if self.newest is None:
            return self, None
        found = updated(self.memory, self.newest, settings)
        row = replace(row_of(self), what=found.why_not or found.note)
        rows = (*self.rows, row)[-MOST_ROWS:]
        return MountFile(self.pedestal, found.memory, rows), found


def row_of(kept: MountFile) -> PassRow:
    """The newest pass for people."""
    if kept.newest is None:
        raise ValueError("no pass is kept")
    seen = kept.newest.mount if kept.memory.has_mount else kept.newest.const
    sigma_deg = np.sqrt(np.diag(seen.covariance)) / DEG
    ia_deg, ie_deg = float(seen.mean[IA]) / DEG, float(seen.mean[IE]) / DEG
    at = utc_text(kept.newest.at_tai_s, 0)
    return PassRow(at, kept.satellite, ia_deg, ie_deg, float(sigma_deg[IA]), float(sigma_deg[IE]))


def mount_files(directory: Path, older: Sequence[Path] = ()) -> list[Path]:
    """The files of an antenna that there are, the newest first.  directory: its own folder; older: others of it.

    A service has a state directory for each satellite, beside each other: the antenna is the same.
    """
    folders = [directory, *older]
    if os.environ.get("STATE_DIRECTORY"):
        is_rehearsal = directory.parent.name.endswith(REHEARSAL)
        beside = sorted(directory.parent.parent.glob(f"*/{directory.name}"))
        folders += [one for one in beside if one.parent.name.endswith(REHEARSAL) == is_rehearsal and one != directory]
    found = []
    for one in folders:
        with contextlib.suppress(OSError):
            found.append(((one / MOUNT).stat().st_mtime_ns, one / MOUNT))
    return [path for _, path in sorted(found, key=lambda one: -one[0])]


def read_mount_file(path: Path, pedestal: str) -> MountFile | None:
    """Read the file; None where there is none, or, with a log line, where it is of another pedestal or not whole."""
    log: Any = structlog.get_logger("mount")
    try:
        with path.open("rb") as file:
            kept = from_json(json.loads(file.read(_LARGEST_BYTES)))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError, np.linalg.LinAlgError) as error:
        log.warning("mount.unreadable", file=str(path), reason=reason_of(error), action="the antenna is learnt anew")
        return None
    if kept.pedestal != pedestal:
        log.warning(
            "mount.thrown_away",
            reason="the pedestal's limits, [mount], [atmosphere] refraction or the station's place have changed",
            file=str(path),
        )
        return None
    return kept


def open_mount_file(
    path: Path, pedestal: str, settings: EstimatorSettings, satellite: str, rise_tai_s: float, now_tai_s: float
) -> MountFile:
    """The memory for a pass, with the passes before it in it; says in the log what came of the last."""
    kept = read_mount_file(path, pedestal)
    if kept is None:
        return MountFile(pedestal, first_memory(settings, now_tai_s), (), satellite, rise_tai_s)
    if kept.is_of(satellite, rise_tai_s):
        return kept
    last_utc = "" if kept.newest is None else utc_text(kept.newest.at_tai_s, 0)
    kept, found = kept.settled(settings)
    if found is not None:
        tell(found, last_utc)
    return replace(kept, satellite=satellite, rise_tai_s=rise_tai_s)


def tell(found: Updated, utc: str) -> None:
    """Log what became of a pass."""
    log: Any = structlog.get_logger("mount")
    if found.why_not:
        log.warning("mount.left_out", of=utc, reason=found.why_not)
    elif found.shift_deg is not None:
        log.warning("mount.rezeroed", of=utc, reason=found.note)
    else:
        log.info("mount.updated", of=utc, passes=found.memory.pass_count, note=found.note)


class MountKeeper:
    """Saves what the pass in progress says of the pedestal.

    The loop never waits for the disk; a write that fails is told, and done again with the next.
    """

    def __init__(self, path: Path, kept: MountFile, writer: Writer) -> None:
        self._path = path
        self._kept = kept
        self._latest = Latest(writer, self._save)
        self.problem = ""  # why the newest one is not saved

    def offer(self, seen: PassEstimate) -> None:
        """Take what the pass says so far; of a daemon started again in mid-pass only where it has seen more of it."""
        if self._kept.newest is None or seen.reading_count >= self._kept.newest.reading_count:
            self._kept = replace(self._kept, newest=seen)
            self._latest.offer(self._kept)

    def _save(self, kept: MountFile) -> None:
        log: Any = structlog.get_logger("mount")
        try:
            write_mount_file(self._path, kept)
        except (OSError, ValueError) as error:
            reason = reason_of(error)
            if not self.problem:
                log.warning("mount.not_saved", file=str(self._path), reason=reason)
            self.problem = f"{self._path.name}: {reason}"
            return
        if self.problem:
            log.info("mount.saved_again", file=str(self._path))
            self.problem = ""


def write_mount_file(path: Path, kept: MountFile) -> None:
    """Put the file in place, whole.  OSError: it cannot be."""
    replace_file(path, f"{json.dumps(to_json(kept), indent=1, allow_nan=False)}\n".encode())


def to_json(kept: MountFile) -> dict[str, Any]:
    memory, newest = kept.memory, kept.newest
    return {
        "version": VERSION,
        "pedestal": kept.pedestal,
        "utc": utc_text(memory.at_tai_s),
        "terms": list(PEDESTAL_TERMS),
        "day_and_night": list(SWINGS),
        "memory": {
            "at_tai_s": memory.at_tai_s,
            "passes": memory.pass_count,
            "const": _terms_json(memory.const),
            "mount": _terms_json(memory.mount),
            "still": _terms_json(memory.still),
            "evidence": memory.evidence,
            "still_evidence": memory.still_evidence,
            "doubts": [_doubt_json(one) for one in memory.doubts],
            "noise": [memory.noise.successive, memory.noise.excess],
        },
        "satellite": kept.satellite,
        "rise_tai_s": kept.rise_tai_s,
        "newest": None
        if newest is None
        else {
            "at_tai_s": newest.at_tai_s,
            "span_s": newest.span_s,
            "readings": newest.reading_count,
            "const": _terms_json(newest.const),
            "mount": _terms_json(newest.mount),
            "evidence": newest.evidence,
            "doubt": _doubt_json(newest.doubt),
            "orbit_strain": newest.orbit_strain,
            "noise_scale": newest.noise_scale,
            "noise": [newest.noise.successive, newest.noise.excess],
        },
        "passes": [vars(one) for one in kept.rows],
    }


def from_json(read: Any) -> MountFile:
    """Raises: ValueError, TypeError, KeyError: what is wrong."""
    if not isinstance(read, dict) or read.get("version") not in (1, VERSION):
        raise ValueError(f"expected a JSON object with version {VERSION}")
    if read["terms"] != list(PEDESTAL_TERMS):
        raise ValueError(f"expected the terms {', '.join(PEDESTAL_TERMS)}")
    memory, newest, has_swings = read["memory"], read["newest"], read["version"] == VERSION
    mount = _kept(memory["mount"], has_swings=has_swings)
    return MountFile(
        pedestal=str(read["pedestal"]),
        memory=PedestalMemory(
            number(memory["at_tai_s"]),
            _count(memory["passes"]),
            _kept(memory["const"], has_swings=has_swings),
            mount,
            _terms(memory["still"], STATE_COUNT) if "still" in memory else mount.still,
            number(memory["evidence"]),
            number(memory.get("still_evidence", 0.0)),
            tuple(_doubt(one) for one in memory["doubts"]),
            _noise(memory["noise"]),
        ),
        rows=tuple(_row(one) for one in read["passes"]),
        satellite=str(read["satellite"]),
        rise_tai_s=number(read["rise_tai_s"]),
        newest=None if newest is None else _estimate(newest),
    )


def _estimate(read: Any) -> PassEstimate:
    return PassEstimate(
        at_tai_s=number(read["at_tai_s"]),
        span_s=number(read["span_s"]),
        reading_count=_count(read["readings"]),
        const=_terms(read["const"]),
        mount=_terms(read["mount"]),
        evidence=number(read["evidence"]),
        doubt=_doubt(read["doubt"]),
        orbit_strain=number(read["orbit_strain"]),
        noise_scale=number(read["noise_scale"]),
        noise=_noise(read["noise"]),
    )


def _row(read: Any) -> PassRow:
    degrees = {name: number(read[name]) for name in ("ia_deg", "ie_deg", "ia_sigma_deg", "ie_sigma_deg")}
    return PassRow(utc=str(read["utc"]), satellite=str(read["satellite"]), what=str(read["what"]), **degrees)


def _terms_json(one: Remembered) -> dict[str, Any]:
    return {"mean_deg": (one.mean / DEG).tolist(), "covariance_deg2": (one.covariance / DEG**2).tolist()}


def _doubt_json(one: Doubt) -> dict[str, Any]:
    return {"gradient": one.gradient.tolist(), "information": one.information.tolist()}


def _kept(read: Any, *, has_swings: bool) -> Remembered:
    if has_swings:
        return _terms(read, STATE_COUNT)
    found = _terms(read)
    mean, variance = np.zeros(STATE_COUNT), np.full(STATE_COUNT, (SWING_DEG * DEG) ** 2)  # ageing bounds it
    covariance = np.diag(variance)
    mean[:_COUNT], covariance[:_COUNT, :_COUNT] = found.mean, found.covariance
    return Remembered(mean, covariance)


def _terms(read: Any, count: int = _COUNT) -> Remembered:
    mean, covariance = numbers(read["mean_deg"], (count,)), numbers(read["covariance_deg2"], (count, count))
    _must_be_covariance(covariance)
    if max(float(np.max(np.abs(mean))), float(np.sqrt(np.max(covariance)))) > MOST_DEG:
        raise ValueError(f"mean_deg: expected terms within {MOST_DEG:g} deg")
    return Remembered(mean * DEG, covariance * DEG**2)


def _doubt(read: Any) -> Doubt:
    information = numbers(read["information"], (2, 2))
    _must_be_covariance(information)
    return Doubt(numbers(read["gradient"], (2,)), information)


def _noise(read: Any) -> NoiseCorrelation:
    successive, excess = numbers(read, (2,)).tolist()
    if not 0.0 <= successive < 1.0 or excess <= 0.0:
        raise ValueError("noise: expected a correlation from 0 to below 1 and a variance above 0")
    return NoiseCorrelation(successive, excess)


def _count(value: Any) -> int:
    count = number(value)
    if count < 0.0 or count != int(count):
        raise ValueError(f"{value!r}: expected a count")
    return int(count)


def _must_be_covariance(matrix: Array) -> None:
    """ValueError: it has a negative eigenvalue, or is not symmetric."""
    size = float(np.max(np.abs(matrix), initial=0.0))
    if not np.isfinite(size) or not np.allclose(matrix, matrix.T, rtol=1e-6, atol=1e-9 * size):
        raise ValueError("expected a symmetric matrix")
    if float(np.linalg.eigvalsh(matrix)[0]) < -1e-6 * size:
        raise ValueError("expected a matrix without negative eigenvalues")
