"""Real daemons, locked, beside simulated ACUs for a while: what their ticks and their processes were like."""

import contextlib
import json
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pass_rig import BenchError, Rig, Scene, make_scene
from process_load import MachineLimit, busy_cores, children, cpu_s, memory_mb, try_fifo

from acu_daemon.edge.control_socket import ask
from acu_daemon.errors import AcuDaemonError

LOCKED = "AUTOTRACK/FITTED"
START_S = 15.0  # until a daemon ticks and its child has loaded, on a machine that does other things too
MORE_START_S = 3.0  # for each one more
LOCK_S = 20.0  # from the signal's first moment to the first fit, at most
POLL_S = 0.02
SAMPLE_S = 10.0  # the snapshot's lateness is of so long
END_S = 2.0


@dataclass(frozen=True)
class Condition:
    """What happens beside the daemon."""

    name: str
    is_loaded: bool = False
    is_fifo: bool = False
    is_polled: bool = False  # and the log at debug


CONDITIONS = {
    one.name: one
    for one in (
        Condition("idle"),
        Condition("loaded", is_loaded=True),
        Condition("fifo", is_loaded=True, is_fifo=True),
        Condition("polled", is_polled=True),
    )
}


@dataclass(frozen=True)
class Ticks:
    """What was measured, of all daemons together; cpu in per cent of one core, averages over the time measured."""

    condition: str
    antennas: int
    seconds: float
    is_permitted: bool  # SCHED_FIFO, where it was asked for
    tick_count: int
    skipped_tick_count: int
    p50_ms: float
    p99_ms: float
    max_ms: float
    cpu_percent: float
    fit_cpu_percent: float  # of that, the children
    acu_cpu_percent: float  # the simulated ACUs, apart
    memory_mb: float  # of one daemon with its child, the largest
    status_count: int
    limit_name: str
    limit_p50_ms: float
    limit_p99_ms: float
    limit_max_ms: float


def run_condition(
    directory: Path, condition: Condition, antennas: int, seconds: float, say: Callable[[str], None] = print
) -> Ticks:
    """Run daemons under a condition for so long.  BenchError: one did not lock, or ended."""
    scene = _scene(directory / "scene", seconds)
    at_monotonic_s = time.monotonic() + START_S + MORE_START_S * (antennas - 1)
    made = [Rig("tcp", scene, directory / f"{number}", at_monotonic_s) for number in range(antennas)]
    try:
        for rig in made:
            rig.start_acu()
        is_permitted = True
        for rig in made:
            left_s = scene.end_tai_s - scene.start_tai_s + at_monotonic_s - time.monotonic()
            rig.start_daemon("--duration", f"{left_s:.3f}", *(("--log-level", "debug") if condition.is_polled else ()))
            if condition.is_fifo and rig.daemon is not None:
                is_permitted = try_fifo(rig.daemon.pid) and is_permitted
        _wait_for_lock(made, at_monotonic_s + LOCK_S)
        say(f"SIMULATION  {condition.name}: {antennas} locked, {seconds:.0f} s")
        return _measure(made, condition, seconds, is_permitted=is_permitted)
    finally:
        for rig in made:
            rig.stop()


def _scene(directory: Path, seconds: float) -> Scene:
    """The demo's pass without a loss of signal, elements good enough to lock at once."""
    scene = make_scene(directory, None, seconds + LOCK_S + END_S)
    scenario = scene.config / "scenario.toml"
    text = scenario.read_text().split("[[loss]]")[0]
    scenario.write_text(text.replace("along_track_s = 0.9", "along_track_s = 0.3"))
    return scene


def _wait_for_lock(made: list[Rig], end_s: float) -> None:
    for rig in made:
        while rig.state != LOCKED:
            if time.monotonic() > end_s or rig.daemon is None or rig.daemon.poll() is not None:
                raise BenchError(f"a daemon did not lock: {rig.errors.read_text().strip() or rig.state}")
            time.sleep(0.25)


@dataclass(frozen=True)
class _Spent:
    """Processor time up to an instant, and the daemons' own counts."""

    at_s: float
    daemon_s: float
    fit_s: float
    acu_s: float
    tick_count: int
    skipped_tick_count: int


def _spent(made: list[Rig]) -> _Spent:
    daemons = [rig.daemon.pid for rig in made if rig.daemon is not None]
    acus = [rig.acu.pid for rig in made if rig.acu is not None]
    seen = [_status(rig) for rig in made]
    return _Spent(
        time.monotonic(),
        sum(map(cpu_s, daemons)),
        sum(cpu_s(child) for daemon in daemons for child in children(daemon)),
        sum(map(cpu_s, acus)),
        sum(int(one["tick_count"]) for one in seen),
        sum(int(one["skipped_tick_count"]) for one in seen),
    )


def _status(rig: Rig) -> dict[str, float]:
    """The daemon's snapshot over its control socket; a rehearsal's state is in a directory of its own."""
    status: dict[str, float] = json.loads(ask(rig.kept, "status"))
    return status


def _measure(made: list[Rig], condition: Condition, seconds: float, *, is_permitted: bool) -> Ticks:
    samples: list[dict[str, float]] = []
    with contextlib.ExitStack() as ends:
        if condition.is_loaded:
            ends.enter_context(busy_cores(os.cpu_count() or 1))
        polls = ends.enter_context(_polled(made[0])) if condition.is_polled else []
        limit = MachineLimit(seconds, is_fifo=condition.is_fifo)
        ends.callback(limit.stop)
        before = _spent(made)
        while (left_s := before.at_s + seconds - time.monotonic()) > 0.0:
            time.sleep(min(SAMPLE_S, left_s))
            samples += map(_status, made)
        after = _spent(made)
        largest_mb = max(memory_mb([rig.daemon.pid, *children(rig.daemon.pid)]) for rig in made if rig.daemon)
        status_count = len(polls)
        limits_ms = limit.figures_ms()
    span_s = after.at_s - before.at_s
    fit_s = after.fit_s - before.fit_s
    return Ticks(
        condition.name,
        len(made),
        seconds,
        is_permitted,
        after.tick_count - before.tick_count,
        after.skipped_tick_count - before.skipped_tick_count,
        *_lateness_ms(made, samples),
        cpu_percent=100.0 * (after.daemon_s - before.daemon_s + fit_s) / span_s,
        fit_cpu_percent=100.0 * fit_s / span_s,
        acu_cpu_percent=100.0 * (after.acu_s - before.acu_s) / span_s,
        memory_mb=largest_mb,
        status_count=status_count,
        limit_name=limit.name,
        limit_p50_ms=limits_ms[0],
        limit_p99_ms=limits_ms[1],
        limit_max_ms=limits_ms[2],
    )


def _lateness_ms(made: list[Rig], samples: list[dict[str, float]]) -> tuple[float, float, float]:
    """Of one daemon: its own figures of the whole run, start-up included.  Of several: what the snapshots said.

    Several start one after the other and disturb each other then: p50 and p99 are medians of ten seconds each.
    """
    if len(made) == 1 and made[0].daemon is not None:
        made[0].daemon.send_signal(signal.SIGTERM)
        made[0].daemon.wait(START_S)
        (done,) = made[0].events("run.done")
        return done["lateness_p50_ms"], done["lateness_p99_ms"], done["lateness_max_ms"]
    p50_ms, p99_ms = (
        sorted(one[f"lateness_{name}_ms"] for one in samples)[len(samples) // 2] for name in ("p50", "p99")
    )
    return p50_ms, p99_ms, max(one["lateness_max_ms"] for one in samples)


@contextlib.contextmanager
def _polled(rig: Rig) -> Iterator[list[float]]:
    """Ask a daemon for its status fifty times a second; yields the moments at which it answered."""
    answered: list[float] = []
    is_over = threading.Event()

    def poll() -> None:
        next_s = time.monotonic()
        while not is_over.wait(max(0.0, next_s - time.monotonic())):
            next_s += POLL_S
            with contextlib.suppress(AcuDaemonError):
                _status(rig)
                answered.append(time.monotonic())

    thread = threading.Thread(target=poll)
    thread.start()
    try:
        yield answered
    finally:
        is_over.set()
        thread.join()
