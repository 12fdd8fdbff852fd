"""The report of a pass that is over: made beside the daemon, in a process of its own that gives way to everything."""

import asyncio
import contextlib
import os
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.edge.child_process import start_python
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.edge.writer import Writer

NICE = 19
LONGEST_S = 600.0  # of a report in a station
AT_THE_END_S = 20.0  # of a run that ends after its pass: then the recording stays, and `acu-daemon report` makes it
SAID_BYTES = 500


async def report_after(tape: TapeFile, files: Writer, config: Path, longest_s: float = LONGEST_S) -> None:
    """Make it once the recording is closed; what fails is logged, and ends nothing."""
    log: Any = structlog.get_logger("report")
    closed, loop = asyncio.Event(), asyncio.get_running_loop()
    files.put(lambda: _tell(loop, closed))
    try:
        async with asyncio.timeout(longest_s):
            await closed.wait()
            status, said = await _make(tape.path, config)
    except TimeoutError:
        log.warning("report.failed", file=str(tape.path), reason=f"not made within {longest_s:g} s")
        return
    except OSError as error:
        log.warning("report.failed", file=str(tape.path), reason=error.strerror or str(error))
        return
    if status:
        log.warning("report.failed", file=str(tape.path), reason=said or f"exit status {status}")
    else:
        log.info("report.made", file=said.partition("\n")[0])


def _tell(loop: asyncio.AbstractEventLoop, closed: asyncio.Event) -> None:
    with contextlib.suppress(RuntimeError):  # the loop has ended
        loop.call_soon_threadsafe(closed.set)


async def _make(path: Path, config: Path) -> tuple[int, str]:
    """Exit status, and the last of what it said."""
    made = await start_python(
        "acu_daemon",
        "report",
        str(path),
        "--config",
        str(config),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        process_group=0,
    )
    try:
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, made.pid, NICE)
        out, err = await made.communicate()
    finally:
        if made.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                made.kill()
            await made.wait()
    said = err if made.returncode else out
    return made.returncode or 0, said[-SAID_BYTES:].decode("utf-8", "replace").strip()
