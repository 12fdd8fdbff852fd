"""What is kept of a station's passes: how it is called, and what is removed so that a disk does not fill."""

import contextlib
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.edge.tape_file import SUFFIX, tapes_in
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

_LONGEST_NAME = 40
STATION = ".station.json"  # what the station knows of a pass beside its recording
MESSAGES = (".tdm", ".omm", ".oem", STATION)  # of the pass, which go with its recording
REPORTS = (".html", ".json")  # of a pass, which outlive its recording
PASSES = "passes"  # the folder in a state directory
_OF_A_PASS = re.compile(r"\d{8}T\d{6}Z-")  # how the names of this module begin: what others put there is not ours


@dataclass(frozen=True, slots=True)
class KeepRules:
    """How long recordings are kept, and how much of them; how long reports are."""

    days: float
    megabytes: float
    report_days: float


def tape_name(rise_tai_s: float, satellite: str) -> str:
    """Names sort by the time of the pass."""
    utc = utc_text(rise_tai_s, 0).replace("-", "").replace(":", "")
    return f"{utc}-{safe_name(satellite)}{SUFFIX}"


def safe_name(satellite: str) -> str:
    """A satellite's name as a part of a file's."""
    return re.sub(r"[^\w.]+", "-", satellite, flags=re.ASCII).strip("-.")[:_LONGEST_NAME] or "satellite"


def remove_old(directory: Path, rules: KeepRules, now_unix_s: float | None = None) -> list[Path]:
    """Remove what is too old or too much, told in the log; the recordings that are gone.

    Recordings go with their messages, the oldest first; reports by their age alone.
    """
    now_s = time.time() if now_unix_s is None else now_unix_s
    _remove_reports(directory, rules.report_days, now_s)
    found: list[tuple[float, int, Path]] = []
    for path in tapes_in(directory):
        with contextlib.suppress(OSError):
            stat = path.stat()
            found.append((stat.st_mtime, stat.st_size + sum(map(_size, messages_beside(path))), path))
    removed, why = _too_old_or_many(sorted(found), rules, now_s)
    log: Any = structlog.get_logger("tape")
    gone = []
    for path in removed:
        try:
            for one in (*messages_beside(path), path):
                one.unlink()
        except OSError as error:
            log.warning("tape.not_removed", file=str(path), reason=error.strerror or str(error))
        else:
            gone.append(path)
    if gone:
        log.info("tape.removed", count=len(gone), newest=gone[-1].name, reason=why)
    return gone


def _remove_reports(directory: Path, days: float, now_s: float) -> None:
    count = 0
    for path in reports_in(directory):
        with contextlib.suppress(OSError):  # it is tried again at the next pass
            if now_s - path.stat().st_mtime > days * DAY_S:
                path.unlink()
                count += 1
    if count:
        log: Any = structlog.get_logger("report")
        log.info("report.removed", file_count=count, reason=f"older than {days:g} d")


def reports_in(directory: Path) -> list[Path]:
    """The files of the reports of a directory's passes, without the index."""
    try:
        return [
            path
            for path in directory.iterdir()
            if path.suffix in REPORTS and _OF_A_PASS.match(path.name) and not path.name.endswith(STATION)
        ]
    except OSError:
        return []


def messages_beside(tape: Path) -> list[Path]:
    """The messages of a recording's pass, and what the station said of it."""
    name = tape.name.removesuffix(SUFFIX)
    return [path for path in (tape.with_name(name + ending) for ending in MESSAGES) if path.exists()]


def _size(path: Path) -> int:
    return path.stat().st_size


def _too_old_or_many(
    found: Sequence[tuple[float, int, Path]], rules: KeepRules, now_s: float
) -> tuple[list[Path], str]:
    total_bytes = sum(size for _, size, _ in found)
    removed, reasons = [], []
    for modified_s, size, path in found:
        is_old, is_too_much = now_s - modified_s > rules.days * DAY_S, total_bytes > rules.megabytes * 1e6
        if not (is_old or is_too_much):
            break
        reasons.append(f"older than {rules.days:g} d" if is_old else f"more than {rules.megabytes:g} MB")
        removed.append(path)
        total_bytes -= size
    return removed, ", ".join(dict.fromkeys(reasons))
