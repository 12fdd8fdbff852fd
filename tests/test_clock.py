"""The real clock: rehearsals, the timerfd, how UTC is followed.  That nothing is early is asserted; lateness is not."""

import asyncio
import contextlib
import os
import resource
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from acu_daemon.edge import clock as clock_module
from acu_daemon.edge.clock import FOLLOW_GAIN, STEP_S, LoopClock, SystemClock, Timerfd, is_clock_synchronised
from acu_daemon.orbit.timescales import tai_from_unix, tai_from_utc
from acu_daemon.sim.virtual import run_virtual

THEN = tai_from_utc("2016-12-31T23:59:50Z")


class Ground:
    """Stands where the module `time` stands: both of its clocks go as the test says."""

    CLOCK_MONOTONIC = time.CLOCK_MONOTONIC

    def __init__(self) -> None:
        self.monotonic_s, self.unix_s = 1000.0, 1.5e9

    def monotonic(self) -> float:
        return self.monotonic_s

    def time(self) -> float:
        return self.unix_s

    def run(self, seconds: float, drift: float = 0.0) -> None:
        self.monotonic_s += seconds
        self.unix_s += seconds * (1.0 + drift)


@pytest.fixture
def ground(monkeypatch: pytest.MonkeyPatch) -> Ground:
    made = Ground()
    monkeypatch.setattr(clock_module, "time", made)
    return made


def test_without_a_rehearsal_the_clock_shows_the_systems_utc() -> None:
    before = tai_from_unix(time.time())
    clock = SystemClock()
    now = clock.tai_s()
    after = tai_from_unix(time.time())
    assert not clock.is_rehearsal
    assert before - STEP_S <= now <= after + STEP_S


def test_a_rehearsal_begins_at_its_time_when_the_clock_is_made(ground: Ground) -> None:
    clock = SystemClock(THEN)
    assert clock.is_rehearsal
    assert clock.tai_s() == pytest.approx(THEN, abs=1e-6)
    ground.run(3.25)
    assert clock.tai_s() == pytest.approx(THEN + 3.25, abs=1e-6)


def test_a_rehearsal_holds_its_time_at_the_monotonic_instant_it_was_given(ground: Ground) -> None:
    clocks = [SystemClock(THEN, 990.0)]
    ground.run(7.0)
    clocks.append(SystemClock(THEN, 990.0))
    assert [clock.tai_s() for clock in clocks] == pytest.approx([THEN + 17.0] * 2, abs=1e-6)


def test_a_rehearsal_whose_instant_lies_ahead_is_before_its_time(ground: Ground) -> None:
    assert SystemClock(THEN, 1010.0).tai_s() == pytest.approx(THEN - 10.0, abs=1e-6)


def test_a_rehearsal_follows_no_system_clock(ground: Ground) -> None:
    clock = SystemClock(THEN)
    ground.unix_s += 3600.0
    assert clock.follow() == 0.0
    assert clock.tai_s() == pytest.approx(THEN, abs=1e-6)


@pytest.mark.parametrize("step_s", [3600.0, 1.0, -1.0, -0.11])
def test_p7_a_step_of_the_system_clock_is_told_and_never_obeyed(ground: Ground, step_s: float) -> None:
    clock = SystemClock()
    start = clock.tai_s()
    ground.unix_s += step_s
    for second in range(1, 61):
        ground.run(1.0)
        assert clock.follow() == pytest.approx(step_s, abs=1e-5)
        assert clock.tai_s() == pytest.approx(start + second, abs=1e-5)


@pytest.mark.parametrize("drift", [50e-6, -50e-6])
def test_a_drift_of_the_system_clock_is_followed(ground: Ground, drift: float) -> None:
    clock = SystemClock()
    differences = []
    for _ in range(900):
        ground.run(1.0, drift)
        differences.append(abs(clock.follow()))
    assert max(differences) < abs(drift) / FOLLOW_GAIN + 1e-5
    assert clock.tai_s() == pytest.approx(tai_from_unix(ground.unix_s), abs=abs(drift) / FOLLOW_GAIN)


@given(st.lists(st.floats(-0.15, 0.15), max_size=30))
def test_utc_never_runs_backwards_while_it_follows(jumps_s: list[float]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        ground = Ground()
        patch.setattr(clock_module, "time", ground)
        clock = SystemClock()
        last = clock.tai_s()
        for jump_s in jumps_s:
            ground.run(0.1)
            ground.unix_s += jump_s
            clock.follow()
            assert clock.tai_s() > last
            last = clock.tai_s()


def test_a_stalled_look_at_the_system_clock_does_not_count(ground: Ground, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SystemClock()
    stalls = iter([0.5, 0.0, 0.3])

    def stalling_time() -> float:
        unix_s = ground.unix_s
        ground.run(next(stalls))
        return unix_s

    monkeypatch.setattr(ground, "time", stalling_time)
    assert clock.follow() == pytest.approx(0.0, abs=1e-6)


async def test_the_timer_wakes_in_order_and_never_early() -> None:
    timer = Timerfd()
    start = time.monotonic()
    for tick in range(50):
        due = start + 0.002 * tick
        await timer.sleep_until(due)
        assert time.monotonic() >= due
    timer.close()


def all_descriptors() -> list[int]:
    """Take every descriptor that is left."""
    taken = []
    with contextlib.suppress(OSError):
        while True:
            taken.append(os.dup(0))
    return taken


@pytest.mark.parametrize(("left_count", "has_timer"), [(0, False), (1, False), (2, True)])
async def test_the_timer_leaves_the_last_descriptor_to_the_link(left_count: int, has_timer: bool) -> None:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, limits[1]))
    taken, clock = all_descriptors(), SystemClock(THEN)
    try:
        for _ in range(left_count):
            os.close(taken.pop())
        await clock.sleep_until(THEN + 0.02)
        taken += (left := all_descriptors())
        assert len(left) == left_count - has_timer
    finally:
        for one in taken:
            os.close(one)
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
        clock.close()


async def test_the_clock_never_wakes_before_its_tai() -> None:
    clock = SystemClock(THEN)
    for tick in range(1, 31):
        due = THEN + 0.0037 * tick
        await clock.sleep_until(due)
        assert clock.tai_s() >= due
    clock.close()


async def test_a_time_that_has_passed_returns_at_once_and_lets_others_run() -> None:
    clock = SystemClock()
    ran = []
    other = asyncio.create_task(asyncio.sleep(0, ran.append(1)))
    await clock.sleep_until(clock.tai_s() - 100.0)
    await other
    assert ran
    clock.close()


async def test_a_cancelled_wait_leaves_the_timer_usable() -> None:
    timer = Timerfd()
    waiting = asyncio.create_task(timer.sleep_until(time.monotonic() + 3600.0))
    await asyncio.sleep(0)
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    due = time.monotonic() + 0.005
    await timer.sleep_until(due)
    assert time.monotonic() >= due
    timer.close()


async def test_a_wait_cancelled_after_the_timer_ran_out_does_not_cut_the_next_one_short() -> None:
    timer = Timerfd()
    waiting = asyncio.create_task(timer.sleep_until(time.monotonic() + 0.002))
    await asyncio.sleep(0)
    ran_out = time.monotonic() + 0.01
    while time.monotonic() < ran_out:
        pass
    waiting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await waiting
    due = time.monotonic() + 0.02
    await timer.sleep_until(due)
    assert time.monotonic() >= due
    timer.close()


async def test_a_clock_can_be_closed_twice_and_used_again() -> None:
    clock = SystemClock()
    clock.close()
    await clock.sleep_until(clock.tai_s() + 0.001)
    clock.close()
    clock.close()
    await clock.sleep_until(clock.tai_s() + 0.001)
    clock.close()


def test_the_loops_clock_keeps_virtual_time_through_a_leap_second() -> None:
    async def main() -> list[float]:
        clock = LoopClock(THEN)
        seen = [clock.tai_s(), clock.monotonic_s()]
        await clock.sleep_until(THEN + 12.5)
        await clock.sleep_until(THEN)
        clock.close()
        return [*seen, clock.tai_s(), clock.monotonic_s(), clock.follow()]

    assert run_virtual(main(), start_s=40.0) == pytest.approx([THEN, 40.0, THEN + 12.5, 52.5, 0.0])


def test_the_kernel_says_whether_its_clock_is_synchronised() -> None:
    assert is_clock_synchronised() in (True, False)


@pytest.mark.parametrize(("said", "is_synchronised"), [("yes", True), ("no", False), ("", None)])
def test_where_the_kernel_may_not_be_asked_systemd_answers(
    said: str, is_synchronised: bool | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Refusing:
        def adjtimex(self, _: object) -> int:
            return -1

    systemd = tmp_path / "timedatectl"
    systemd.write_text(f"#!/bin/sh\necho {said}\n")
    systemd.chmod(0o755)
    monkeypatch.setattr(clock_module, "_LIBC", Refusing())
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert is_clock_synchronised() is is_synchronised
