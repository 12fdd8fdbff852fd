"""The fit runner, which plans passes too: a spawned, niced child process, or inline with a fixed virtual latency.

The foreground never waits for it; a child that dies or hangs is replaced and given the pass's readings again.
"""

import asyncio
import contextlib
import pickle
import signal
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Protocol

import structlog

from acu_daemon.assist.session.refit import RefitReply, RefitRequest, RefitSetup, Refitter
from acu_daemon.control.tracking.pass_plan import PlanAnswer, PlanRequest, planned_pass
from acu_daemon.edge.child_process import start_python
from acu_daemon.edge.fit_child import LENGTH
from acu_daemon.errors import AcuDaemonError
from acu_daemon.model import Readings
from acu_daemon.orbit.timescales import leap_dates

START_S = 20.0  # a child that starts may take this much longer: niced, on a busy machine, it loads numpy first
END_S = 1.0  # a child that has closed its pipe has ended, or will within this
SAID_LINES = 30  # of a child's standard error, such as a traceback, that the log takes


class FitFailedError(AcuDaemonError):
    """The child died, hung, or could not do what was asked; the message says which."""


class FitDiedError(FitFailedError):
    """The child died or hung: it was ended, and the next question starts another."""


class FitRunner(Protocol):
    """Seam between the background task and whoever computes."""

    async def refit(self, request: RefitRequest) -> RefitReply: ...

    async def plan(self, asked: PlanRequest) -> PlanAnswer: ...

    async def close(self) -> None: ...


class InlineFitRunner:
    """Computes in the loop and answers after a fixed latency of the loop's (virtual) time; a plan is there at once."""

    def __init__(self, setup: RefitSetup, latency_s: float = 0.05) -> None:
        self._setup = setup
        self._refitter = Refitter(setup)
        self._latency_s = latency_s

    async def refit(self, request: RefitRequest) -> RefitReply:
        reply = self._refitter.refit(request)
        await asyncio.sleep(self._latency_s)
        return reply

    async def plan(self, asked: PlanRequest) -> PlanAnswer:
        return planned_pass(self._setup.propagator, self._setup.site, asked)

    async def close(self) -> None:
        """Nothing runs."""


class ProcessFitRunner:
    """Computes in a child process.  One question at a time; owned by the background task."""

    def __init__(self, setup: RefitSetup, timeout_s: float = 5.0) -> None:
        self._setup = setup
        self._timeout_s = timeout_s
        self._child: asyncio.subprocess.Process | None = None
        self._given: list[Readings] = []
        self._said: deque[str] = deque(maxlen=SAID_LINES)
        self._hearing: asyncio.Task[None] | None = None
        self.start_count = 0

    async def refit(self, request: RefitRequest) -> RefitReply:
        """Ask the child.  Raises: FitDiedError, after which the next call starts a new child; FitFailedError."""
        if len(request.readings):
            self._given.append(request.readings)
        reply = await self._answer(request, if_new=lambda: _with_readings(request, self._given))
        if isinstance(reply, RefitReply):
            return reply
        raise FitFailedError(str(reply))

    async def plan(self, asked: PlanRequest) -> PlanAnswer:
        """Ask the child for the plan of a pass.  Raises: as `refit`."""
        reply = await self._answer(asked, if_new=lambda: asked)
        if isinstance(reply, PlanAnswer):
            return reply
        raise FitFailedError(str(reply))

    async def _answer(self, question: object, if_new: Callable[[], object]) -> Any:
        """What the child says to a question; if_new: the question to one that has just been started."""
        if self._child is not None and self._child.returncode is not None:
            structlog.get_logger("fit").warning("fit.process_ended", code=self._child.returncode, action="replaced")
        is_new = self._child is None or self._child.returncode is not None
        timeout_s = self._timeout_s + (START_S if is_new else 0.0)
        try:
            async with asyncio.timeout(timeout_s):
                if is_new:
                    await self._start()
                await self._send(if_new() if is_new else question)
                return await self._receive()
        except TimeoutError:
            await self.close()
            raise FitDiedError(f"the fit process gave no answer within {timeout_s:g} s") from None
        except (OSError, asyncio.IncompleteReadError) as error:
            try:
                why = await self._why_ended(error)
            finally:
                await self.close()
            raise FitDiedError(why) from None
        except BaseException:
            await self.close()  # cancelled in mid-answer: what the child still says must not meet the next question
            raise

    @property
    def pid(self) -> int | None:
        """Process number of the child, for tests and reports."""
        return self._child.pid if self._child else None

    async def _start(self) -> None:
        self._child = await start_python(
            "acu_daemon.edge.fit_child",
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            process_group=0,  # a Ctrl-C is for the daemon; a session of its own would not heed how nice it is
            limit=2**22,
        )
        self._said.clear()
        self._hearing = asyncio.create_task(self._hear(self._child), name="fit process said")
        self.start_count += 1
        await self._send((leap_dates(), self._setup))

    async def _hear(self, child: asyncio.subprocess.Process) -> None:
        """Take what the child says on standard error to the log, the first lines of it."""
        log: Any = structlog.get_logger("fit")
        line_count = 0
        while child.stderr is not None and (line := await child.stderr.readline()):
            text = line.decode("utf-8", "backslashreplace").rstrip()
            self._said.append(text)
            line_count += 1
            if line_count <= SAID_LINES:
                log.warning("fit.process_said", text=text)

    async def _why_ended(self, error: OSError | asyncio.IncompleteReadError) -> str:
        """Why there is no answer: how the child ended, and its last words."""
        child = self._child
        if child is None:
            return f"the fit process cannot be started: {getattr(error, 'strerror', None) or error}"
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(END_S):
                await child.wait()
                if self._hearing is not None:
                    await self._hearing
        said = next((text for text in reversed(self._said) if text), str(error))
        return f"the fit process died ({_ending(child.returncode)}): {said}"

    async def _send(self, message: object) -> None:
        if self._child is None or self._child.stdin is None:
            raise OSError("no child")
        data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
        self._child.stdin.write(LENGTH.pack(len(data)) + data)
        await self._child.stdin.drain()

    async def _receive(self) -> Any:
        if self._child is None or self._child.stdout is None:
            raise OSError("no child")
        (size,) = LENGTH.unpack(await self._child.stdout.readexactly(LENGTH.size))
        data = await self._child.stdout.readexactly(size)
        try:
            return pickle.loads(data)
        except Exception as error:  # noqa: BLE001  of bytes that are no pickle anything may come
            raise FitDiedError(f"the fit process died: its answer makes no sense: {error}") from None

    async def close(self) -> None:
        """End the child."""
        child, self._child = self._child, None
        if child is None:
            return
        if child.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                child.kill()
        await child.wait()
        hearing, self._hearing = self._hearing, None
        if hearing is not None:
            hearing.cancel()
            await asyncio.wait({hearing})


def _ending(code: int | None) -> str:
    if code is None:
        return "it has closed its output"
    return f"exit status {code}" if code >= 0 else signal.Signals(-code).name


def _with_readings(request: RefitRequest, given: list[Readings]) -> RefitRequest:
    if not given:
        return request
    return replace(request, readings=Readings.joined(given))
