"""What `acu-daemon check` sees of a daemon that runs here, or ran."""

import contextlib
import json
import os
import time
from collections.abc import Iterator
from pathlib import Path

from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.cli.options import antenna_of
from acu_daemon.cli.own_daemon import OwnDaemon
from acu_daemon.config.load import load_station
from acu_daemon.config.station_tables import StationFile
from acu_daemon.daemon.health import status_line
from acu_daemon.daemon.verdict import Level, alarms, verdict
from acu_daemon.edge.latch import ADVICE, DISARMED, LATCH, STOWED
from acu_daemon.edge.state_directory import SNAPSHOT, choice_text, folders_in, older_folders, state_path, with_choice
from acu_daemon.errors import UsageError

HEALTHY_AGE_S = 5.0
ALARM_KEYS = (  # of a snapshot
    *("acu_faults", "clock_alarm", "encoder_problem", "envelope_alarm", "files_alarm", "turn_alarm"),
    *("limit_alarm", "line_alarm", "signal_alarm", "stow_alarm", "tilt_alarm"),
)


def held_finding(daemon: OwnDaemon) -> Finding:
    """A daemon that tracks has the ACU for itself: what it sees of it stands for what would be asked."""
    if daemon.seen is None:
        return Finding(WARN, "running daemon", f"one runs with {daemon.directory}: {daemon.problem}")
    seen = daemon.seen
    is_well = verdict(seen).level < Level.WATCH and not alarms(seen)
    about = f"a daemon runs and holds the ACU, which is not asked: {status_line(seen)}; {verdict(seen).why}"
    return Finding(GO if is_well else WARN, "running daemon", f"{about} ({daemon.directory})")


def left_behind(config: Path, station: StationFile, state: Path | None) -> Iterator[Finding]:
    """What of the last run forbids the next one to move."""
    directory, antenna = state_path(state, is_rehearsal=False), antenna_of(station)
    advice = {name: with_choice(text, choice_text(config, state, is_rehearsal=False)) for name, text in ADVICE.items()}
    for grade, name in ((NO_GO, LATCH), (WARN, DISARMED), (WARN, STOWED)):
        for folder in (antenna.folder(directory), *older_folders(directory, antenna)):
            if os.access(folder / name, os.F_OK):  # one that is not ours to look into says nothing
                yield Finding(grade, name, f"{folder / name} is there: {advice[name]}")


def _snapshot(config: Path, directory: Path) -> Path:
    """The newest one of the configuration's antenna, by this or an older name; of any, where it cannot be read."""
    folders = [directory]
    with contextlib.suppress(OSError):
        folders = folders_in(directory)
    with contextlib.suppress(UsageError):
        antenna = antenna_of(load_station(config))
        folders = [antenna.folder(directory), *older_folders(directory, antenna)]
    ages = {}
    for folder in folders:
        with contextlib.suppress(OSError):
            ages[folder / SNAPSHOT] = (folder / SNAPSHOT).stat().st_mtime
    return max(ages, key=lambda path: ages[path], default=folders[0] / SNAPSHOT)


def running_finding(config: Path, state: Path | None, *, is_rehearsal: bool) -> Finding:
    path = _snapshot(config, state_path(state, is_rehearsal=is_rehearsal))
    try:
        age_s = time.time() - path.stat().st_mtime
    except OSError:
        return Finding(NO_GO, "running daemon", f"{path}: no daemon has written it")
    verdict = GO if age_s < HEALTHY_AGE_S else NO_GO
    alarms = _alarms(path)
    detail = "; ".join([f"{path}: written {age_s:.1f} s ago", *alarms])
    return Finding(WARN if alarms and verdict == GO else verdict, "running daemon", detail)


def _alarms(snapshot: Path) -> list[str]:
    """What a person should see to: a latched axis, a daemon that was disarmed, the clock, an encoder, a disk."""
    try:
        seen = json.loads(snapshot.read_text(encoding="utf-8"))
        latch, disarmed_by = seen.get("latch", ""), seen.get("disarmed_by", "")
        others = [seen.get(name, "") for name in ALARM_KEYS]
    except (OSError, ValueError, AttributeError):
        return []
    texts = [latch and f"latched: {latch}", disarmed_by and f"disarmed by {disarmed_by}", *others]
    return [text for text in texts if text]
