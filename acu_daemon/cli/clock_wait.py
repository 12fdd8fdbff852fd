"""Before anything else a clock that can be right: one that was never set since the boot is told, and waited for."""

import time
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.cli.options import load_target
from acu_daemon.edge.clock import SystemClock, is_clock_synchronised
from acu_daemon.edge.clock_sense import before_elements, before_release
from acu_daemon.edge.systemd import Notifier
from acu_daemon.errors import AcuDaemonError

LOOK_S = 1.0
LONGER_US = 10_000_000  # so much longer than now the start may take, said at every look (sd_notify(3))


def wait_for_clock(config: Path, satellite: str | None, clock: SystemClock, until_s: float) -> bool:
    """Wait until the system's clock can be right, at most until a reading of CLOCK_MONOTONIC.  False: it is not.

    Nothing is told the ACU meanwhile.  A rehearsal has a clock of its own.  What is wrong with files is told later.
    """
    log: Any = structlog.get_logger("clock")
    notifier, told = Notifier(), ""
    while not clock.is_rehearsal and (wrong := _wrong(config, satellite, clock)):
        if not told:
            told = wrong
            log.warning("clock.wrong", reason=wrong, action="waits until it is set; nothing is commanded before that")
        notifier(f"STATUS=waits for the clock: {wrong}\nEXTEND_TIMEOUT_USEC={LONGER_US}")
        if time.monotonic() >= until_s:
            return False
        time.sleep(LOOK_S)
        clock.obey()
    if told:
        log.info("clock.set", action="the start goes on")
    notifier.close()
    return True


def _wrong(config: Path, satellite: str | None, clock: SystemClock) -> str:
    now_tai_s = clock.tai_s()
    if wrong := before_release(now_tai_s):
        return wrong
    if is_clock_synchronised() is not False or satellite is None:
        return ""
    try:
        elements = load_target(config, satellite, now_tai_s, is_strict=False).elements
    except AcuDaemonError:
        return ""
    return before_elements(elements, now_tai_s, is_synchronised=False)
