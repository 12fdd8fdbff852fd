"""The clocks: CLOCK_MONOTONIC for intervals, TAI through one slowly followed offset for the sky."""

import asyncio
import contextlib
import ctypes
import math
import os
import subprocess
import time
from typing import Protocol

from acu_daemon.edge.child_process import start
from acu_daemon.orbit.timescales import tai_from_unix

STEP_S = 0.1  # a jump of the system clock larger than this is reported, and obeyed only where nothing is tracked
ASK_EVERY_S = 30.0
FOLLOW_GAIN = 0.02  # of the difference to the system clock, each second: a drift is followed, a step is not

_LIBC = ctypes.CDLL(None, use_errno=True)
_TIMER_ABSOLUTE = 1
_TIME_ERROR = 5  # adjtimex: the clock is not synchronised
_TIMEX_BYTES = 512  # more than struct timex; all zero asks and sets nothing
_ASK_SYSTEMD = ("timedatectl", "show", "--property=NTPSynchronized", "--value")
_SYSTEMD_SAYS = {"yes": True, "no": False}
SYSTEMD_S = 1.0
_NONBLOCK_CLOEXEC = os.O_NONBLOCK | os.O_CLOEXEC


class Clock(Protocol):
    """Seam between the daemon and time.  is_synchronised: of the system clock; None: nobody could tell, or needs to."""

    is_synchronised: bool | None
    is_rehearsal: bool

    def monotonic_s(self) -> float: ...

    def tai_s(self) -> float: ...

    def follow(self) -> float:
        """Follow the system's UTC for one second; return its difference to ours, seconds (0 where there is none)."""
        ...

    def obey(self) -> None:
        """Take the system's UTC as it is, a step included; not while anything depends on ours."""
        ...

    async def sleep_until(self, tai_s: float) -> None: ...

    def close(self) -> None: ...


class Timerfd:
    """A Linux timerfd on CLOCK_MONOTONIC: asyncio's own timer is 0.6 ms late by construction.

    One waiter at a time, in one loop.
    """

    def __init__(self) -> None:
        self._fd = _LIBC.timerfd_create(time.CLOCK_MONOTONIC, _NONBLOCK_CLOEXEC)
        if self._fd < 0:
            raise OSError(ctypes.get_errno(), "timerfd_create failed")
        try:
            os.close(os.dup(self._fd))
        except OSError:  # it took the last descriptor, which is the link's
            os.close(self._fd)
            raise
        self._loop: asyncio.AbstractEventLoop | None = None
        self._woken: asyncio.Future[None] | None = None

    async def sleep_until(self, monotonic_s: float) -> None:
        """Return at that reading of CLOCK_MONOTONIC, at once if it has passed."""
        if monotonic_s <= time.monotonic():
            await asyncio.sleep(0)
            return
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
            self._loop.add_reader(self._fd, self._wake)
        self._woken = self._loop.create_future()
        spec = (ctypes.c_long * 4)(0, 0, *divmod(math.ceil(monotonic_s * 1e9), 1_000_000_000))  # never early
        if _LIBC.timerfd_settime(self._fd, _TIMER_ABSOLUTE, ctypes.byref(spec), None) != 0:
            raise OSError(ctypes.get_errno(), "timerfd_settime failed")
        await self._woken

    def _wake(self) -> None:
        try:
            os.read(self._fd, 8)
        except BlockingIOError:  # set anew since it rang
            return
        if self._woken is not None and not self._woken.done():
            self._woken.set_result(None)

    def close(self) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.remove_reader(self._fd)
        os.close(self._fd)


class SystemClock:
    """Real time.  With at_tai_s: a rehearsal, whose TAI is at_tai_s at at_monotonic_s (default: now)."""

    def __init__(self, at_tai_s: float | None = None, at_monotonic_s: float | None = None) -> None:
        self.is_rehearsal = at_tai_s is not None
        self.is_synchronised: bool | None = None
        if at_tai_s is None:
            self._offset_s = _system_offset_s()
        else:
            self._offset_s = at_tai_s - (time.monotonic() if at_monotonic_s is None else at_monotonic_s)
        self._timer: Timerfd | None = None
        self._is_timer_denied = False

    def monotonic_s(self) -> float:
        return time.monotonic()

    def tai_s(self) -> float:
        return time.monotonic() + self._offset_s

    def follow(self) -> float:
        if self.is_rehearsal:
            return 0.0
        difference_s = _system_offset_s() - self._offset_s
        if abs(difference_s) < STEP_S:
            self._offset_s += FOLLOW_GAIN * difference_s
        return difference_s

    def obey(self) -> None:
        if not self.is_rehearsal:
            self._offset_s = _system_offset_s()

    async def sleep_until(self, tai_s: float) -> None:
        if self._timer is None and not self._is_timer_denied:
            try:
                self._timer = Timerfd()
            except OSError:
                self._is_timer_denied = True  # asyncio's own is good for 0.6 ms
        if self._timer is None:
            await asyncio.sleep(max(0.0, tai_s - self.tai_s()))
        else:
            await self._timer.sleep_until(tai_s - self._offset_s)

    def close(self) -> None:
        if self._timer is not None:
            self._timer.close()
            self._timer = None

    async def watch_synchronisation(self) -> None:
        """Ask now and then whether the system clock is synchronised, beside the loop: the answer may take a second."""
        while not self.is_rehearsal:
            self.is_synchronised = await _watched_synchronisation()
            await asyncio.sleep(ASK_EVERY_S)


class LoopClock:
    """The running loop's own time, for tests in virtual time: TAI is at_tai_s when the clock is made."""

    is_synchronised: bool | None = None
    is_rehearsal = False

    def __init__(self, at_tai_s: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._offset_s = at_tai_s - self._loop.time()

    def monotonic_s(self) -> float:
        return self._loop.time()

    def tai_s(self) -> float:
        return self._loop.time() + self._offset_s

    def follow(self) -> float:
        return 0.0

    def obey(self) -> None:
        """There is no other clock."""

    async def sleep_until(self, tai_s: float) -> None:
        await asyncio.sleep(max(0.0, tai_s - self.tai_s()))

    def close(self) -> None:
        """Nothing to give back."""


def system_tai_s() -> float:
    """TAI by the system clock now."""
    return tai_from_unix(time.time())


def _system_offset_s() -> float:
    """TAI minus CLOCK_MONOTONIC by the system clock; the quickest of three looks, so that a stall does not count."""
    looks = []
    for _ in range(3):
        before = time.monotonic()
        unix_s = time.time()
        after = time.monotonic()
        looks.append((after - before, tai_from_unix(unix_s) - (before + after) / 2))
    return min(looks)[1]


def is_clock_synchronised() -> bool | None:
    """Whether the clock's discipline (chrony, ntpd) reports a synchronised clock: adjtimex(2).

    A hardened service may not ask the kernel; systemd then answers for it, within a second.  None: nobody could tell.
    """
    if (said := _kernel_says()) is not None:
        return said
    try:
        asked = subprocess.run(_ASK_SYSTEMD, capture_output=True, text=True, timeout=SYSTEMD_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return _SYSTEMD_SAYS.get(asked.stdout.strip())


async def _watched_synchronisation() -> bool | None:
    """The same beside the loop, without a thread."""
    if (said := _kernel_says()) is not None:
        return said
    try:
        asked = await start(*_ASK_SYSTEMD, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL)
    except OSError:
        return None
    try:
        async with asyncio.timeout(SYSTEMD_S):
            answer, _ = await asked.communicate()
    except TimeoutError:
        return None
    finally:
        if asked.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                asked.kill()
            await asked.wait()
    return _SYSTEMD_SAYS.get(answer.decode("ascii", "replace").strip())


def _kernel_says() -> bool | None:
    status = _LIBC.adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    return bool(status != _TIME_ERROR) if status >= 0 else None
