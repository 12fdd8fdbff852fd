"""The daemon's loop without a pass: ticks on its own clock, a fit each second in the child, a poll at each tick."""

import asyncio
import gc
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from acu_daemon.assist.session.refit import RefitRequest
from acu_daemon.daemon.buffer_keeper import REFIT_PERIOD_S
from acu_daemon.daemon.port import AcuPort
from acu_daemon.daemon.tick_lateness import Lateness
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.fit import FitFailedError, FitRunner
from acu_daemon.edge.link import Link
from acu_daemon.errors import LinkError


@dataclass(slots=True)
class Trial:
    """What a trial has measured so far.  One task writes each field."""

    lateness: Lateness = field(default_factory=Lateness)
    tick_count: int = 0
    skipped_tick_count: int = 0
    round_trips_s: list[float] = field(default_factory=list)
    lost_poll_count: int = 0
    late: str = ""  # how late the replies were that came after their deadline; "": none was
    link_problem: str = ""  # why no ACU was polled
    refits_s: list[float] = field(default_factory=list)
    fit_problem: str = ""


async def try_loop(
    clock: Clock,
    runner: FitRunner,
    requests: Iterator[RefitRequest],
    *,
    duration_s: float,
    period_s: float,
    acu: tuple[Link, AcuPort] | None,
) -> Trial:
    """Tick for duration_s.  acu: a link and the port on it; it is polled, and told nothing else."""
    trial = Trial()
    has_begun = asyncio.Event()
    fit = asyncio.create_task(_fit(trial, clock, runner, requests, has_begun))
    try:
        port = None if acu is None else await _open(trial, acu[1])
        await has_begun.wait()
        gc.collect()
        gc.freeze()
        await _tick(trial, clock, port, duration_s, period_s)
    finally:
        fit.cancel()
        await asyncio.gather(fit, return_exceptions=True)
        await runner.close()
        if acu is not None:
            await acu[0].close()
    return trial


async def _open(trial: Trial, port: AcuPort) -> AcuPort | None:
    try:
        await port.open(tries_all=True)
    except LinkError as error:
        trial.link_problem = str(error)
        trial.late = port.lateness if port.late_count else ""
        return None
    return port


async def _tick(trial: Trial, clock: Clock, port: AcuPort | None, duration_s: float, period_s: float) -> None:
    due_tai_s = math.ceil(clock.tai_s() / period_s + 1) * period_s
    end_tai_s = due_tai_s + duration_s
    while due_tai_s < end_tai_s:
        await clock.sleep_until(due_tai_s)
        trial.lateness.add(clock.tai_s() - due_tai_s)
        trial.tick_count += 1
        if port is not None:
            await _poll(trial, clock, port)
        missed = max(0, math.floor((clock.tai_s() - due_tai_s) / period_s))
        trial.skipped_tick_count += missed
        due_tai_s = round(due_tai_s / period_s + 1 + missed) * period_s


async def _poll(trial: Trial, clock: Clock, port: AcuPort) -> None:
    begun_s, question = clock.monotonic_s(), port.question()
    if question is None or (await port.exchange(question)).reply is None:
        trial.lost_poll_count += 1
        trial.late = port.lateness if port.late_count else ""
    else:
        trial.round_trips_s.append(clock.monotonic_s() - begun_s)


async def _fit(
    trial: Trial, clock: Clock, runner: FitRunner, requests: Iterator[RefitRequest], has_begun: asyncio.Event
) -> None:
    """Fit once a second; the first one starts the child and is not counted in time."""
    try:
        await runner.refit(next(requests))
        has_begun.set()
        for request in requests:
            begun_s = clock.monotonic_s()
            await runner.refit(request)
            trial.refits_s.append(clock.monotonic_s() - begun_s)
            await asyncio.sleep(max(0.0, REFIT_PERIOD_S - trial.refits_s[-1]))
    except FitFailedError as error:
        trial.fit_problem = str(error)
    finally:
        has_begun.set()
