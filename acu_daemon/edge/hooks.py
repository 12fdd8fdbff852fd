"""Programs of the operator's, started at what happens in a pass: receivers, recorders, a horn, a message.

A hook gets one line of JSON on its standard input and runs in a process group of its own, at low priority, without the
rights that this process was given (edge.hook_rights).  The loop only starts it and looks at its end: a hook that hangs
is killed with its group, one that prints without end is cut off, one that fails is told.
"""

import asyncio
import contextlib
import json
import os
import signal
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import structlog

from acu_daemon.edge.child_process import exited, release, start
from acu_daemon.edge.hook_rights import UMASK, HookUser, directory, environment, launch

KEPT_BYTES = 2000  # of what a hook prints
MOST_BYTES = 65536  # it may print; then nobody reads on
GRACE_S = 3.0  # between SIGTERM and SIGKILL
MOST_RUNNING = 16
SAID_CHARACTERS = 300  # the last of them are kept for the report


class Hook(StrEnum):
    """When a program is started."""

    BEFORE_PASS = "before_pass"
    DURING_PASS = "during_pass"
    AT_LOCK = "at_lock"
    AT_LOSS = "at_loss"
    AFTER_PASS = "after_pass"
    ON_NO_GO = "on_no_go"
    ON_ALARM = "on_alarm"
    BEFORE_MOVE = "before_move"


@dataclass(frozen=True, slots=True)
class HookResult:
    """How a hook ended.  status: its exit status, -N for signal N, None where it was never started.

    number: of the pass in the schedule; 0: it was about none.
    """

    hook: Hook
    status: int | None
    lasted_s: float
    said: str  # the last of what it printed
    problem: str = ""  # in words; "": all is well
    number: int = 0

    @property
    def is_good(self) -> bool:
        return self.problem == ""

    @property
    def record(self) -> dict[str, Any]:
        """For the report of the pass; JSON."""
        return {
            "hook": str(self.hook),
            "status": self.status,
            "lasted_s": round(self.lasted_s, 2),
            "problem": self.problem,
            "said": self.said.strip()[-SAID_CHARACTERS:],
        }


class Hooks:
    """Starts hooks and follows them.  Owned by the loop; `close` before the loop ends."""

    def __init__(
        self, commands: Mapping[Hook, Sequence[str]], time_limit_s: float, user: HookUser | None = None
    ) -> None:
        """user: as whom they run; None: as this process."""
        self.take(commands, time_limit_s, user)
        self._running: dict[asyncio.Task[HookResult], tuple[Hook, int]] = {}  # and the number of its pass
        self._during: asyncio.Task[HookResult] | None = None
        self._results: list[HookResult] = []
        self._log: Any = structlog.get_logger("hooks")

    def take(self, commands: Mapping[Hook, Sequence[str]], time_limit_s: float, user: HookUser | None) -> None:
        """Which programs are started from here on, and as whom."""
        self._commands = {hook: tuple(command) for hook, command in commands.items() if command}
        self._time_limit_s, self._user = time_limit_s, user

    def call(self, hook: Hook, about: Mapping[str, Any]) -> None:
        """Start a hook, if there is one.  Never waits.  about: `number` in it is that of the pass."""
        command = self._commands.get(hook)
        if command is None:
            return
        if len(self._running) >= MOST_RUNNING and hook is not Hook.BEFORE_MOVE:  # who stands at the antenna is warned
            why = f"not started: {MOST_RUNNING} hooks are running"
            self._end(HookResult(hook, None, 0.0, "", why, about.get("number", 0)))
            return
        limit_s = None if hook is Hook.DURING_PASS else self._time_limit_s
        task = asyncio.create_task(self._follow(hook, command, about, limit_s), name=f"hook {hook}")
        self._running[task] = hook, about.get("number", 0)
        task.add_done_callback(self._running.pop)
        if hook is Hook.DURING_PASS:
            self._during = task

    def running(self, number: int) -> list[Hook]:
        """The hooks of a pass that have not ended."""
        return [hook for task, (hook, of) in self._running.items() if of == number and not task.done()]

    async def ended(self, number: int, longest_s: float) -> None:
        """Wait for the hooks of a pass."""
        if tasks := [task for task, (_, of) in self._running.items() if of == number]:
            await asyncio.wait(tasks, timeout=longest_s)

    def end_during(self) -> None:
        """End what runs during a pass: SIGTERM, and SIGKILL where that is not enough."""
        if self._during is not None:
            self._during.cancel()
            self._during = None

    def take_results(self) -> list[HookResult]:
        """How the hooks ended since this was asked last."""
        taken, self._results = self._results, []
        return taken

    async def close(self) -> None:
        """End all hooks; one that is ending already keeps its grace."""
        for task in self._running:
            if not task.cancelling():
                task.cancel()
        await asyncio.gather(*self._running, return_exceptions=True)

    async def _follow(
        self, hook: Hook, command: Sequence[str], about: Mapping[str, Any], limit_s: float | None
    ) -> HookResult:
        result = replace(await self._run(hook, command, about, limit_s), number=about.get("number", 0))
        self._end(result)
        return result

    def _end(self, result: HookResult) -> None:
        self._results.append(result)
        tell = self._log.info if result.is_good else self._log.warning
        more = {} if result.is_good else {"reason": result.problem}
        tell("hook.done", hook=str(result.hook), status=result.status, lasted_s=round(result.lasted_s, 1), **more)

    async def _run(
        self, hook: Hook, command: Sequence[str], about: Mapping[str, Any], limit_s: float | None
    ) -> HookResult:
        loop, is_over = asyncio.get_running_loop(), False
        begun_s = loop.time()
        starting = asyncio.ensure_future(
            start(
                *launch(command, self._user),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
                start_new_session=True,
                env=environment(self._user) | {"ACU_HOOK": str(hook)},
                cwd=directory(self._user),
                umask=UMASK,
            )
        )
        try:
            try:
                process = await asyncio.shield(starting)
            except asyncio.CancelledError:  # it may run already: it is ended like any other
                process, is_over = await starting, True
        except OSError as error:
            return HookResult(hook, None, 0.0, "", f"{command[0]}: {error.strerror or error}")
        if process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.write(json.dumps({"hook": str(hook)} | dict(about)).encode() + b"\n")
                process.stdin.close()
        output = asyncio.create_task(_read(process.stdout))
        try:
            status, problem = (await _killed(process), "") if is_over else await _ended(process, limit_s)
            said = await _last_words(output)
        finally:
            output.cancel()
            release(process)
        return HookResult(hook, status, loop.time() - begun_s, said, problem)


async def _ended(process: asyncio.subprocess.Process, limit_s: float | None) -> tuple[int, str]:
    """Wait for a hook; its status, and what went wrong."""
    try:
        async with asyncio.timeout(limit_s):
            status = await exited(process)
    except TimeoutError:
        return await _killed(process), f"killed after {limit_s:g} s"
    except asyncio.CancelledError:  # the end of the pass, or of the daemon
        return await asyncio.shield(asyncio.ensure_future(_killed(process))), ""
    if status == 0:
        return status, ""
    return status, f"exit status {status}" if status > 0 else f"ended by signal {-status}"


async def _read(stream: asyncio.StreamReader | None) -> bytes:
    """The last of what is printed; after MOST_BYTES nobody reads, and who prints on waits to be killed."""
    last, count = b"", 0
    while stream is not None and count < MOST_BYTES and (data := await stream.read(4096)):
        last, count = (last + data)[-KEPT_BYTES:], count + len(data)
    return last


async def _last_words(output: asyncio.Task[bytes]) -> str:
    """What was printed, without waiting for a grandchild that keeps the pipe open."""
    done, _ = await asyncio.wait([output], timeout=0.2)
    if not done:
        output.cancel()
        return ""
    return output.result().decode("utf-8", "replace").strip()


async def _killed(process: asyncio.subprocess.Process) -> int:
    """End a hook with its whole group; returns the status."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, number)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(GRACE_S):
                return await exited(process)
    return await exited(process)
