"""How many processes wait for a core while real processes are tested: on a machine that starves them nothing is shown.

Two busy cores are none of that: the tests of real processes must hold there.  Where each core has four processes to run
or more, a daemon gets less than the processor that its ticks need, and what fails then says nothing of it.
"""

import os
import threading
import time
from pathlib import Path

STARVED_COUNT = 4.0  # processes that can run, for each core, on average
EVERY_S = 0.25


def running_count() -> int:
    """Processes that run or could, without this look itself: proc_loadavg(5)."""
    return int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0]) - 1


class MachineLoad:
    """Looks four times a second, from a thread of its own, from the first `begin` on."""

    def __init__(self) -> None:
        self._seen: list[tuple[float, int]] = []
        self._begun_s: dict[str, float] = {}
        self._thread = threading.Thread(target=self._look, daemon=True)

    def begin(self, what: str) -> None:
        """Something begins, if it has not already."""
        if not self._begun_s:
            self._thread.start()
        self._begun_s.setdefault(what, time.monotonic())

    def per_core(self, what: str) -> float:
        """Processes that could run, for each core, on average since it began."""
        counts = [count for at_s, count in self._seen if at_s >= self._begun_s[what]]
        return sum(counts) / max(len(counts), 1) / (os.cpu_count() or 1)

    def _look(self) -> None:
        while True:
            self._seen.append((time.monotonic(), running_count()))
            time.sleep(EVERY_S)
