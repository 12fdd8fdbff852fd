"""What a station knows of a pass and its recording does not: a small JSON file beside that, for the report."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.control.phantom import LostSpan, PhantomPass
from acu_daemon.edge.kept_tapes import STATION
from acu_daemon.edge.tape_file import SUFFIX
from acu_daemon.edge.writer import replace_file
from acu_daemon.report.pass_station import StationRecord


def record_path(tape: Path) -> Path:
    """Where it is."""
    return tape.with_name(tape.name.removesuffix(SUFFIX) + STATION)


def write_record(tape: Path, record: Mapping[str, Any]) -> None:
    """Write what PassCourse.record has, with `running_hooks`.  OSError: it cannot be."""
    replace_file(record_path(tape), f"{json.dumps(record)}\n".encode())


def read_record(tape: Path) -> StationRecord | None:
    """None: there is none, as of a run without a schedule, or it is damaged, which is told."""
    path = record_path(tape)
    try:
        read = json.loads(path.read_text(encoding="utf-8"))
        return StationRecord(
            state=str(read["state"]),
            reason=str(read["reason"]),
            locked_s=float(read["locked_s"]),
            phantom=None if read["phantom"] is None else _phantom(read["phantom"]),
            hooks=tuple(dict(one) for one in read["hooks"]),
            running_hooks=tuple(map(str, read["running_hooks"])),
        )
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        log: Any = structlog.get_logger("report")
        log.warning("report.without_station", file=str(path), reason=f"{type(error).__name__}: {error}")
        return None


def _phantom(read: Mapping[str, Any]) -> PhantomPass:
    return PhantomPass(
        up_s=float(read["up_s"]),
        on_path_s=float(read["on_path_s"]),
        largest_off_deg=float(read["largest_off_deg"]),
        lost=tuple(LostSpan(float(one["from_tai_s"]), float(one["to_tai_s"]), str(one["why"])) for one in read["lost"]),
        told=tuple(map(str, read["told"])),
        kept_back=tuple(map(str, read["kept_back"])),
    )
