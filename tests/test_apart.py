"""edge.apart: what is computed in a process of its own comes back, or why it did not, and nothing is left of it."""

import asyncio
import os
import signal
import time
from math import hypot, log

import pytest

from acu_daemon.edge import apart as module
from acu_daemon.edge.apart import ApartError, apart
from acu_daemon.edge.fit_child import NICENESS

pytestmark = pytest.mark.realtime


async def test_the_answer_comes_back_from_a_process_that_gives_way() -> None:
    assert await apart(hypot, 3.0, 4.0) == 5.0
    assert await apart(os.getpid) != os.getpid()
    assert await apart(os.getpriority, os.PRIO_PROCESS, 0) == min(19, os.nice(0) + NICENESS)


async def test_why_there_is_no_answer_is_said() -> None:
    with pytest.raises(ApartError, match=r"^ValueError: math domain error$"):
        await apart(log, 0.0)
    with pytest.raises(ApartError, match="its process died"):
        await apart(signal.raise_signal, signal.SIGKILL)


async def test_one_that_takes_too_long_or_is_given_up_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[asyncio.subprocess.Process] = []
    start = module.start_python

    async def noted(*command: str, **pipes: object) -> asyncio.subprocess.Process:
        started.append(await start(*command, **pipes))
        return started[-1]

    monkeypatch.setattr(module, "start_python", noted)
    asking = asyncio.create_task(apart(time.sleep, 600.0))
    while not started:
        await asyncio.sleep(0.01)
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    monkeypatch.setattr(module, "LONGEST_S", 0.2)
    with pytest.raises(ApartError, match=r"not done within 0.2 s"):
        await apart(time.sleep, 600.0)
    assert [one.returncode for one in started] == [-signal.SIGKILL] * 2


async def test_where_the_system_denies_a_process_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    async def denied(*_: str, **__: object) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(module, "start_python", denied)
    with pytest.raises(ApartError, match="no process for it: Resource temporarily unavailable"):
        await apart(time.sleep, 0.0)
