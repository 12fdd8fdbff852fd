"""One computation in a process of its own: a thread would share the interpreter with the ticks, and delay them.

The child (edge.apart_child) is niced, loads what the function needs, answers once and ends.
"""

import asyncio
import pickle
from collections.abc import Callable
from typing import Any

from acu_daemon.edge.child_process import answer_of, start_python
from acu_daemon.errors import AcuDaemonError
from acu_daemon.orbit.timescales import leap_dates

LONGEST_S = 120.0
SAID_CHARACTERS = 300


class ApartError(AcuDaemonError):
    """The computation failed, or its process did; the message says how."""


async def apart(function: Callable[..., Any], *given: object) -> Any:
    """Compute function(*given); it is one of a module, and what it takes and gives can be pickled.

    Raises: ApartError: it failed, was not done within LONGEST_S, or the system denies the process.
    """
    question = pickle.dumps((leap_dates(), function, given), protocol=pickle.HIGHEST_PROTOCOL)
    try:
        child = await start_python(
            "acu_daemon.edge.apart_child",
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            process_group=0,  # a Ctrl-C is for the daemon
        )
    except OSError as error:
        raise ApartError(f"no process for it: {error.strerror or error}") from None
    try:
        answer, said = await answer_of(child, LONGEST_S, question)
    except TimeoutError:
        raise ApartError(f"not done within {LONGEST_S:g} s") from None
    if child.returncode:
        words = said.decode("utf-8", "replace").strip()[-SAID_CHARACTERS:]
        raise ApartError(f"its process died (exit status {child.returncode}): {words}")
    is_good, result = pickle.loads(answer)
    if not is_good:
        raise ApartError(result)
    return result
