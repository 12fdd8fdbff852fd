"""The safe stop: how the daemon leaves the antenna, at its own end and after a crash from which it does not return."""

import asyncio
from typing import Any

import structlog

from acu_daemon.acu.commands import SetWatchdog, Stop
from acu_daemon.acu.replies import AcuStatus, Done, Reply
from acu_daemon.control.safety.arming import NO_STOP_MODES
from acu_daemon.daemon.port import AcuPort

DEADLINE_S = 5.0  # a link that is down may come back; the service's TimeoutStopSec is longer
REPEAT_S = 0.1


async def stop_antenna(port: AcuPort, deadline_s: float, *, clears_watchdog: bool) -> bool:
    """Send STOP until it is acknowledged, unless somebody else moves the antenna.  True: stopped, or left alone.

    Before each STOP the ACU is polled: meanwhile, and while the link was down, a person may have stowed the antenna or
    taken the local panel.  It is tried for deadline_s, over as many connections as it takes.
    clears_watchdog: then switch the ACU's register watchdog off, so that it does not hinder whoever comes next.
    """
    log: Any = structlog.get_logger("stop")
    is_stopped = False
    try:
        async with asyncio.timeout(deadline_s):
            status = await _stopped(port)
            is_stopped = True
            if clears_watchdog and status.is_remote_enabled:
                await port.reply_to(SetWatchdog(0.0))
    except TimeoutError:
        if not is_stopped:
            why = port.problem or "the ACU does not acknowledge it"
            log.error("stop.timeout", reason=why, advice="the antenna may still follow its registers: look at the ACU")
    return is_stopped


def is_left_alone(reply: Reply) -> bool:
    """Whether a status shows an antenna that somebody else moves by now, or that is in stow: no STOP is sent."""
    return isinstance(reply, AcuStatus) and (reply.mode in NO_STOP_MODES or not reply.is_remote_enabled)


async def _stopped(port: AcuPort) -> AcuStatus:
    """Return the last status before the STOP that was acknowledged, or one that forbids it."""
    log: Any = structlog.get_logger("stop")
    while True:
        status = await port.status()
        if is_left_alone(status):
            log.info("stop.left_alone", mode=status.mode.name)
            return status
        answer = await port.exchange(Stop())
        await port.idle_gap()
        if isinstance(answer.reply, Done):
            log.info("stop.done")
            return status
        await asyncio.sleep(REPEAT_S)
