"""How many processes wait for a core while real processes are tested: on a machine that starves them nothing is shown.

Two busy cores are none of that: the tests of real processes must hold there.  Where each core has four processes to run
or more, a daemon gets less than the processor that its ticks need, and what fails then says nothing of it.  Nor does
what fails where the machine as a whole stood still, as a virtual one does whose host is busy: links fall silent then.
"""

import os
import threading
import time
from pathlib import Path

STARVED_COUNT = 4.0  # processes that can run, for each core, on average
STILL_S = 0.5  # nobody was woken for so long
EVERY_S = 0.25


def running_count() -> int:
    """Processes that run or could, without this look itself: proc_loadavg(5)."""
    return int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0]) - 1


class MachineLoad:
    """Looks four times a second, from a thread of its own, from the first `begin` on."""

    def __init__(self) -> None:
        self._seen: list[tuple[float, int, float]] = []  # when, processes, seconds that the look was late
        self._begun_s: dict[str, float] = {}
        self._thread = threading.Thread(target=self._look, daemon=True)

    def begin(self, what: str) -> None:
        """Something begins, if it has not already."""
        if not self._begun_s:
            self._thread.start()
        self._begun_s.setdefault(what, time.monotonic())

    def why_no_verdict(self, what: str) -> str:
        """Why what has failed since it began says nothing; "": it does."""
        seen = [(count, late_s) for at_s, count, late_s in self._seen if at_s >= self._begun_s[what]]
        per_core = sum(count for count, _ in seen) / max(len(seen), 1) / (os.cpu_count() or 1)
        if per_core > STARVED_COUNT:
            return f"{per_core:.0f} processes waited for each core of this machine meanwhile"
        still_s = max((late_s for _, late_s in seen), default=0.0)
        return f"this machine stood still for {still_s:.1f} s meanwhile" if still_s > STILL_S else ""

    def _look(self) -> None:
        due_s = time.monotonic()
        while True:
            now_s = time.monotonic()
            self._seen.append((now_s, running_count(), now_s - due_s))
            due_s = now_s + EVERY_S
            time.sleep(EVERY_S)
