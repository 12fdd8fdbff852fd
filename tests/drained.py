"""Until a writer's thread has done all that it was given: an empty queue does not tell of the job in hand."""

import threading

from acu_daemon.edge.writer import Writer

PATIENT_S = 60.0


def drain(writer: Writer) -> None:
    """Wait for it: jobs are done in order."""
    is_done = threading.Event()
    assert writer.put(is_done.set)
    assert is_done.wait(PATIENT_S)
