"""`acu-daemon status --watch`: the same words as `status`, redrawn in place; what is old is grey and says so."""

import contextlib
import sys
import time
from collections.abc import Callable

from rich.console import Console, Group
from rich.live import Live
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from acu_daemon.daemon import words
from acu_daemon.daemon.overview import OLD_S, headline, status_rows
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import Level, alarms, verdict
from acu_daemon.errors import AcuDaemonError, UsageError

EVERY_S = 0.5
STYLES = {Level.GOOD: "bold green", Level.CALM: "bold cyan", Level.WATCH: "bold yellow", Level.BAD: "bold white on red"}
OLD_STYLE = "dim"


def watch_status(ask: Callable[[], Snapshot]) -> None:
    """Show it until Ctrl-C.  UsageError: standard output is no terminal.

    Raises: AcuDaemonError: there is nothing to show at the start, or the daemon may not be asked.
    """
    if not sys.stdout.isatty():
        raise UsageError("--watch draws on a terminal; scripts take --json, or `acu-daemon wait`")
    seen, seen_s = ask(), time.monotonic()
    try:
        with Live(picture(seen, 0.0), console=Console(), screen=True, auto_refresh=False) as live:
            while True:
                time.sleep(EVERY_S)
                with contextlib.suppress(AcuDaemonError):  # ended, or started again just now
                    seen, seen_s = ask(), time.monotonic()
                live.update(picture(seen, time.monotonic() - seen_s), refresh=True)
    except KeyboardInterrupt:
        return


def picture(seen: Snapshot, silent_s: float) -> Group:
    """What is drawn.  silent_s: since the daemon answered; beyond OLD_S all is grey, under a line that says so."""
    said, is_old = verdict(seen), silent_s > OLD_S
    head: list[Text] = []
    if is_old:
        head.append(
            Text(f"NO ANSWER from the daemon for {words.clock_text(silent_s)}; this was seen last:", "bold red")
        )
    head.append(Text(headline(seen), OLD_STYLE if is_old else STYLES[said.level]))
    if mark := words.marks(seen):
        head.append(Text(mark, "bold magenta"))
    head += [Text(f"ALARM  {text}", OLD_STYLE if is_old else "bold red") for text in alarms(seen)]
    table = Table.grid(padding=(0, 2))
    for name, text in status_rows(seen):
        table.add_row(Text(name, "bold"), Text(text), style=OLD_STYLE if is_old or _is_stale(name, seen) else "")
    return Group(*head, Padding(table, (1, 0, 0, 0)), Text("\nCtrl-C ends this view, not the daemon.", OLD_STYLE))


def _is_stale(name: str, seen: Snapshot) -> bool:
    """Whether a row is about an antenna that is not measured any more."""
    is_measured = seen.is_link_up and seen.reading_age_s is not None and seen.reading_age_s <= OLD_S
    return name in ("antenna", "path", "signal") and not is_measured
