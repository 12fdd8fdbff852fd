"""What processes cost, from /proc: processor time and memory; and how late the machine itself is."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

FIFO_PRIORITY = 30
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
_BUSY = (sys.executable, "-I", "-S", "-c", "while True: pass")
_BARE_LOOP = """\
import json, sys, time
late, due = [], time.monotonic() + 1.05
for _ in range(int(sys.argv[1])):
    time.sleep(max(0.0, due - time.monotonic()))
    late.append(time.monotonic() - due)
    due += 0.1
late.sort()
print(json.dumps([1e3 * late[int(share * (len(late) - 1))] for share in (0.5, 0.99, 1.0)]))
"""


def cpu_s(pid: int) -> float:
    """Processor time that a process has used, user and system, all threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) * _TICK_S


def children(pid: int) -> list[int]:
    """The processes that a process has started."""
    lists = [(task / "children").read_text() for task in Path(f"/proc/{pid}/task").iterdir()]
    return [int(child) for one in lists for child in one.split()]


def memory_mb(pids: Iterable[int]) -> float:
    """Memory of a daemon and its child, megabytes of 2**20 bytes, libraries that both have mapped counted once.

    Unlike the kernel's PSS it does not shrink with the number of other processes that share a library.
    """
    own_kb, library_kb = 0, 0
    for pid in pids:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()[1:]
        kb = {line.split(":")[0]: int(line.split()[1]) for line in lines}
        dirty_kb = kb["Private_Dirty"] + kb["Shared_Dirty"]
        own_kb += dirty_kb
        library_kb = max(library_kb, kb["Rss"] - dirty_kb)
    return (own_kb + library_kb) / 1024.0


@contextmanager
def busy_cores(count: int) -> Iterator[None]:
    """Keep so many cores busy."""
    with ExitStack() as ends:
        for _ in range(count):
            process = ends.enter_context(subprocess.Popen(_BUSY, start_new_session=True))
            ends.callback(process.kill)
        yield


def try_nice(pid: int, niceness: int) -> bool:
    """Give a process in a session of its own this niceness.  False: not permitted.

    Where the kernel shares the processor between sessions first, the session gets it too.
    """
    try:
        os.setpriority(os.PRIO_PROCESS, pid, niceness)
        session = Path(f"/proc/{pid}/autogroup")
        if session.exists():
            session.write_text(str(niceness))
    except PermissionError:
        return False
    return True


def try_fifo(pid: int) -> bool:
    """Schedule a process by SCHED_FIFO.  False: not permitted."""
    try:
        os.sched_setscheduler(pid, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except PermissionError:
        return False
    return True


class MachineLimit:
    """A bare loop beside the daemon: how late this machine itself wakes a process ten times a second.

    cyclictest where it is installed, else ten lines of Python that do nothing but sleep.
    """

    def __init__(self, seconds: float, *, is_fifo: bool) -> None:
        self.name = "cyclictest" if shutil.which("cyclictest") else "bare loop"
        count = str(max(int(10 * (seconds - 2.0)), 1))
        arguments = [sys.executable, "-I", "-S", "-c", _BARE_LOOP, count]
        if self.name == "cyclictest":
            policy = [f"--priority={FIFO_PRIORITY}"] if is_fifo else ["--policy=other"]
            arguments = [
                "cyclictest",
                "--quiet",
                "--interval=100000",
                f"--loops={count}",
                "--histogram=100000",
                *policy,
            ]
        self._process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True, start_new_session=True)
        if is_fifo:
            try_fifo(self._process.pid)

    def figures_ms(self) -> tuple[float, float, float]:
        """Wait for its end; lateness at 50 %, 99 % and the greatest."""
        said = self._process.communicate()[0]
        if self.name == "cyclictest":
            return cyclictest_ms(said)
        p50_ms, p99_ms, max_ms = json.loads(said)
        return p50_ms, p99_ms, max_ms

    def stop(self) -> None:
        """End it early."""
        with self._process:
            self._process.kill()


def cyclictest_ms(said: str) -> tuple[float, float, float]:
    """Read cyclictest's histogram: lines of microseconds and count."""
    rows = [line.split() for line in said.splitlines() if line[:1].isdigit()]
    late_us = [(int(us), int(count)) for us, count, *_ in rows if int(count)]
    total, seen = sum(count for _, count in late_us), 0
    figures: dict[float, float] = {}
    for us, count in late_us:
        seen += count
        for share in (0.5, 0.99):
            if share not in figures and seen >= share * total:
                figures[share] = us / 1e3
    return figures[0.5], figures[0.99], late_us[-1][0] / 1e3
