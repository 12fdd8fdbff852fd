"""Watches the line once a second: replies that are missing, late, garbled or not to be believed are an alarm."""

from collections import deque
from typing import Any

import structlog

from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.port import AcuPort

WINDOW_LOOKS = 5  # seconds
POOR_COUNT = 3  # bad replies in the window; one now and then is no alarm


class LineWatch:
    """The alarm, empty while the line is good or down; only its changes are logged."""

    def __init__(self, port: AcuPort, area: CommonArea) -> None:
        self._port, self._area = port, area
        self._log: Any = structlog.get_logger("link")
        self._counts: deque[int] = deque(maxlen=WINDOW_LOOKS + 1)
        self._is_poor = False
        self._late_count = 0  # while the line was good last
        self.alarm = ""

    def look(self) -> None:
        """Judge the last seconds."""
        port = self._port
        if not port.is_up:
            self._counts.clear()
            self._is_poor, self.alarm = False, ""
            return
        counts = (
            port.failed_exchange_count,
            port.garbled_count,
            port.discarded_count,
            self._area.state.plausibility.doubted_count,
        )
        self._counts.append(sum(counts))
        bad_count = self._counts[-1] - self._counts[0]
        if bad_count >= POOR_COUNT:
            late = f", late ones {port.lateness}" if port.late_count > self._late_count else ""
            self.alarm = f"{bad_count} bad replies in {WINDOW_LOOKS} s{late}: look at the line"
        elif bad_count == 0:
            self.alarm, self._late_count = "", port.late_count
        if bool(self.alarm) != self._is_poor:
            self._is_poor = bool(self.alarm)
            self._report(bad_count, *counts)

    def _report(self, bad_count: int, failed: int, garbled: int, late: int, doubted: int) -> None:
        if not self._is_poor:
            self._log.info("link.good")
            return
        sums = {"failed": failed, "garbled": garbled, "late": late, "doubted": doubted}
        self._log.warning("link.poor", bad=bad_count, in_s=WINDOW_LOOKS, alarm=self.alarm, **sums)
