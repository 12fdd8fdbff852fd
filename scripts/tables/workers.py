"""The processes of a long computation, and its end by Ctrl-C: at once, with one line."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import NoReturn

from tables.console import say

INTERRUPTED = 130
LAST_RESORT_S = 10.0


@contextmanager
def worker_pool() -> Iterator[ProcessPoolExecutor]:
    """A process for each core, each with one thread of its own for linear algebra.

    They ignore Ctrl-C, which a terminal sends to all of them; where the block ends by an error, they are ended with it.
    """
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    count = os.cpu_count() or 1
    pool = ProcessPoolExecutor(count, mp_context=multiprocessing.get_context("spawn"))
    heeding = signal.signal(signal.SIGINT, signal.SIG_IGN)
    for _ in range(count):
        pool.submit(int)  # begins a process, which inherits that SIGINT is ignored
    signal.signal(signal.SIGINT, heeding)
    try:
        yield pool
    except BaseException:
        for process in multiprocessing.active_children():
            process.kill()
        last_resort = threading.Timer(LAST_RESORT_S, os._exit, (INTERRUPTED,))  # a killed process may have held a lock
        last_resort.daemon = True
        last_resort.start()
        pool.shutdown(cancel_futures=True)
        last_resort.cancel()
        raise
    pool.shutdown()


def run_script(main: Callable[[], int]) -> NoReturn:
    """End the process with what main returns, or, where Ctrl-C ended it, with one line and status 130."""
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        say("\ninterrupted" if sys.stderr.isatty() else "interrupted")  # the bar's line is left first
        sys.exit(INTERRUPTED)
