"""The fit's child process: requests in, replies out, as length-prefixed pickles over its standard input and output.

It loads what a fit needs and nothing else: no event loop, no logging.  It makes itself nice before it loads that: the
daemon that starts it has its first commands to write meanwhile.
"""

import contextlib
import gc
import os
import pickle
import signal
import struct
import sys
from typing import TYPE_CHECKING, Any

from acu_daemon.errors import OrbitError

if TYPE_CHECKING:
    from acu_daemon.assist.session.refit import RefitReply, RefitRequest
    from acu_daemon.control.tracking.pass_plan import PlanAnswer

LENGTH = struct.Struct("<Q")
NICENESS = 10  # more than the daemon's, and at least this where that one's is negative


def _read(size: int) -> bytes:
    data = sys.stdin.buffer.read(size)
    if len(data) < size:
        raise EOFError
    return data


def _receive() -> Any:
    (size,) = LENGTH.unpack(_read(LENGTH.size))
    return pickle.loads(_read(size))


def be_nice() -> None:
    """Leave the processor to the daemon and to everybody else."""
    os.nice(max(NICENESS, NICENESS - os.getpriority(os.PRIO_PROCESS, 0)))


def serve() -> None:
    """Serve requests until the parent closes the pipe."""
    be_nice()
    replies = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what a library prints is no reply
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is for the daemon, which ends the child itself
    gc.disable()  # what is loaded is no garbage
    import numpy as np

    from acu_daemon.assist.session.refit import Refitter
    from acu_daemon.control.tracking.pass_plan import PlanRequest, planned_pass
    from acu_daemon.orbit.timescales import adopt_leap_dates

    gc.freeze()
    gc.enable()
    dates, setup = _receive()
    adopt_leap_dates(dates)  # the daemon's, whatever the system's list has become meanwhile
    refitter = Refitter(setup)
    while True:
        request: RefitRequest | PlanRequest = _receive()
        reply: RefitReply | PlanAnswer | str
        try:
            if isinstance(request, PlanRequest):
                reply = planned_pass(setup.propagator, setup.site, request)
            else:
                reply = refitter.refit(request)
        except (OrbitError, ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            reply = f"the {'plan' if isinstance(request, PlanRequest) else 'fit'} failed: {error}"
        data = pickle.dumps(reply, protocol=pickle.HIGHEST_PROTOCOL)
        replies.write(LENGTH.pack(len(data)) + data)
        replies.flush()


if __name__ == "__main__":
    with contextlib.suppress(EOFError, BrokenPipeError):
        serve()
