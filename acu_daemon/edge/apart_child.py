"""The process of edge.apart: a pickled question on its standard input, a pickled answer on its standard output."""

import gc
import os
import pickle
import signal
import sys

from acu_daemon.edge.fit_child import be_nice
from acu_daemon.errors import failure_text


def answer() -> None:
    """Compute what is asked, and say it, or why there is no answer."""
    be_nice()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the daemon ends it
    replies = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a library prints is no answer
    gc.disable()  # it ends before there is much
    from acu_daemon.orbit.timescales import adopt_leap_dates

    dates, function, given = pickle.loads(sys.stdin.buffer.read())
    adopt_leap_dates(dates)
    reply: tuple[bool, object]
    try:
        reply = True, function(*given)
    except Exception as error:  # noqa: BLE001  told where it was asked
        reply = False, failure_text(error)
    pickle.dump(reply, replies, protocol=pickle.HIGHEST_PROTOCOL)
    replies.flush()


if __name__ == "__main__":
    answer()
