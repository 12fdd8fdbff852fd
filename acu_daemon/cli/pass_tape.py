"""The recording of a run: begun with it, closed after it."""

from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.cli.options import Target
from acu_daemon.cli.tape_head import head_of
from acu_daemon.daemon.service import PassJob
from acu_daemon.edge.hooks import HookResult
from acu_daemon.edge.kept_tapes import PASSES, KeepRules, remove_old, tape_name
from acu_daemon.edge.link import Link
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.edge.writer import Writer
from acu_daemon.errors import ElementsError


def begin_tape(
    directory: Path, target: Target, job: PassJob, link: Link, now_tai_s: float, files: Writer
) -> TapeFile | None:
    """Begin the recording of a run, in its state directory; None: the station keeps none, or the run has no pass."""
    rules = target.station.recording
    if not rules.passes or job.coming is None:
        return None
    folder = directory / PASSES
    files.put(partial(_remove_old, folder, KeepRules(rules.keep_days, rules.keep_mb, rules.keep_reports_days)))
    try:
        head = head_of(target, job, link, now_tai_s)
        return TapeFile(folder / tape_name(job.coming.rise_tai_s, job.satellite), head, files)
    except (ElementsError, ValueError, TypeError) as error:  # no pass is missed for a recording
        log: Any = structlog.get_logger("tape")
        log.warning("tape.ended", reason=str(error))
        return None


def note_hooks(tape: TapeFile, results: Iterable[HookResult]) -> None:
    """Put how hooks ended into a recording, for its report."""
    for one in results:
        tape.note(("I", "hook", one.record))


def _remove_old(folder: Path, rules: KeepRules) -> None:
    remove_old(folder, rules)
