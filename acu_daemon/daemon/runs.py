"""One run after another of the same daemon: begun anew where the clock was set or better elements came, before a pass.

Between two runs the link is closed and opened, and nothing is told the ACU: the antenna stays as it is.  Where the next
one cannot begin, it is stopped.
"""

from collections.abc import Callable
from typing import Any

import structlog

from acu_daemon.control.state import ControlState
from acu_daemon.daemon.operator_requests import ENDS, STATUS
from acu_daemon.daemon.service import Outcome, Service
from acu_daemon.errors import AcuDaemonError


class Runs:
    """begin: makes a run, the first without a memory, each other with that of the one before."""

    def __init__(self, begin: Callable[[ControlState | None], Service]) -> None:
        self._begin = begin
        self._service = begin(None)
        self._stop_reason = ""

    def stop(self, reason: str) -> None:
        """End the run that goes on, or comes next, early and safely."""
        self._stop_reason = self._stop_reason or reason
        self._service.stop(reason)

    @property
    def service(self) -> Service:
        """The run that goes on."""
        return self._service

    def answer(self, line: str, who: str = "") -> str:
        """Answer a person's line.  What comes between two runs is for the next one."""
        is_last = self._service.is_over and (self._is_stopping() or not self._service.anew_reason)
        return ENDS if is_last and line != STATUS else self._service.answer(line, who)

    async def run(self) -> Outcome:
        """Run until one has ended for good.  Raises what Service.run and `begin` raise."""
        log: Any = structlog.get_logger("run")
        while True:
            outcome = await self._service.run()
            if not self._service.anew_reason or self._is_stopping():
                return outcome
            log.warning("run.anew", reason=self._service.anew_reason)
            try:
                before = self._service
                self._service = self._begin(before.memory)
            except AcuDaemonError:  # such as elements that are too old by the clock that was set
                await self._service.stop_after_all()
                raise
            for asking in before.unheard:
                self._service.ask(asking)

    def _is_stopping(self) -> bool:
        return bool(self._stop_reason)
