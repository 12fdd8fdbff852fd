"""The safe stop: how the daemon leaves the antenna, at its own end and after a crash from which it does not return."""

from typing import Any

import structlog

from acu_daemon.control.hands import NO_STOP_MODES
from acu_daemon.control.start import WATCHDOG
from acu_daemon.daemon.port import AcuPort
from acu_daemon.protocol.messages import Ack, Command, Poll, Status, Stop, WriteParameter

ATTEMPTS = 5


async def stop_antenna(port: AcuPort, status: Status, *, clears_watchdog: bool) -> bool:
    """Send STOP until it is acknowledged, unless somebody else moves the antenna.  True: stopped, or left alone.

    clears_watchdog: then switch the ACU's register watchdog off, so that it does not hinder whoever comes next.
    """
    log: Any = structlog.get_logger("stop")
    is_stopped = True
    await port.idle_gap()
    if status.mode in NO_STOP_MODES or not status.is_remote_enabled:
        log.info("stop.left_alone", mode=status.mode.name)
    elif await _acknowledged(port, Stop()):
        log.info("stop.done")
    else:
        log.warning("stop.unconfirmed", advice="the antenna may still follow its registers: look at the ACU")
        is_stopped = False
    if clears_watchdog and is_stopped and status.is_remote_enabled:
        await _acknowledged(port, WriteParameter(WATCHDOG, 0))
    return is_stopped


async def _acknowledged(port: AcuPort, command: Command) -> bool:
    """Send a command until it is acknowledged, a few times."""
    for _ in range(ATTEMPTS):
        await port.wait_until_up()  # a link that fails meanwhile is reopened, and polled, by its keeper
        if port.must_poll:
            await port.exchange(Poll())
            await port.idle_gap()
            continue
        answer = await port.exchange(command)
        await port.idle_gap()
        if isinstance(answer.reply, Ack):
            return True
    return False
