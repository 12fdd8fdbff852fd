"""Processes of our own: started so that they load what this one would, and watched without a thread."""

import asyncio
import contextlib
import os
import sys
from typing import Any

NOTED_S = 0.005


async def start_python(module: str, *arguments: str, **pipes: Any) -> asyncio.subprocess.Process:
    """Run a module of this package in a process of its own, with the same places to load from and no others.

    -P: Python would put the working directory first, where any file may have a library's name.
    pipes: of asyncio.create_subprocess_exec.  Raises: OSError: the system denies it; it may pass later.
    """
    places = os.pathsep.join(place for place in sys.path if place)
    return await start(sys.executable, "-P", "-m", module, *arguments, env=os.environ | {"PYTHONPATH": places}, **pipes)


async def start(*command: str, **pipes: Any) -> asyncio.subprocess.Process:
    """Start a program.  OSError: the system denies it; it may pass later."""
    _watch_without_a_thread()
    try:
        return await asyncio.create_subprocess_exec(*command, **pipes)
    except RuntimeError as error:  # no thread for its watcher
        raise OSError(f"{error}") from None


async def answer_of(
    process: asyncio.subprocess.Process, longest_s: float, question: bytes = b""
) -> tuple[bytes, bytes]:
    """What a process prints until it ends, on both its outputs; one that nobody waits for any more is killed.

    question: for its standard input.  Raises: TimeoutError: it took longer.
    """
    try:
        async with asyncio.timeout(longest_s):
            return await process.communicate(question or None)
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


async def exited(process: asyncio.subprocess.Process) -> int:
    """Wait for the end of a process alone; its own `wait` waits for every grandchild that keeps a pipe open as well."""
    loop = asyncio.get_running_loop()
    with contextlib.suppress(ProcessLookupError):  # it has ended and was taken note of
        fd, ended = os.pidfd_open(process.pid), asyncio.Event()
        loop.add_reader(fd, ended.set)
        try:
            if process.returncode is None:
                await ended.wait()
        finally:
            loop.remove_reader(fd)
            os.close(fd)
    while process.returncode is None:  # noqa: ASYNC110  the child watcher hears of it in the same turn of the loop
        await asyncio.sleep(NOTED_S)
    return process.returncode


def release(process: asyncio.subprocess.Process) -> None:
    """Close our ends of a process' pipes, though a grandchild may keep the others; asyncio has no word for it."""
    transport: asyncio.SubprocessTransport | None = getattr(process, "_transport", None)
    if transport is not None:
        transport.close()


def _watch_without_a_thread() -> None:
    """Python 3.11 watches each child from a thread of its own, later ones do so only where the kernel is old."""
    if sys.version_info >= (3, 12):
        return
    policy = asyncio.get_event_loop_policy()
    with contextlib.suppress(OSError):  # an old kernel: then from a thread
        os.close(os.pidfd_open(os.getpid()))
        if not isinstance(policy.get_child_watcher(), asyncio.PidfdChildWatcher):
            policy.set_child_watcher(asyncio.PidfdChildWatcher())
        watcher = policy.get_child_watcher()
        if not watcher.is_active():
            watcher.attach_loop(asyncio.get_running_loop())
