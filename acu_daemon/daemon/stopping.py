"""The safe stop: how the daemon leaves the antenna, at its own end and after a crash from which it does not return."""

from typing import Any

import structlog

from acu_daemon.daemon.port import AcuPort
from acu_daemon.protocol.messages import Ack, AcuMode, Poll, Status, Stop

NO_STOP_MODES = (AcuMode.MANUAL, AcuMode.STOWING, AcuMode.STOWED, AcuMode.FAULT)  # a stop would disturb, or do nothing
ATTEMPTS = 5


async def stop_antenna(port: AcuPort, status: Status) -> bool:
    """Send STOP until it is acknowledged, unless somebody else moves the antenna.  True: stopped, or left alone."""
    log: Any = structlog.get_logger("stop")
    if status.mode in NO_STOP_MODES or not status.is_remote_enabled:
        log.info("stop.left_alone", mode=status.mode.name)
        return True
    for _ in range(ATTEMPTS):
        if port.must_poll:
            await port.exchange(Poll())
            await port.idle_gap()
            continue
        answer = await port.exchange(Stop())
        if isinstance(answer.reply, Ack):
            log.info("stop.done")
            return True
        await port.idle_gap()
    log.warning("stop.unconfirmed", advice="the antenna may still follow its registers: look at the ACU")
    return False
