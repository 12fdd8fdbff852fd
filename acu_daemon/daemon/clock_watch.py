"""Watches the clock once a second: a system clock that is not synchronised, stepped, or too far from ours, is an alarm.

UTC follows the system clock slowly (edge.clock).  A step is reported.  While the pass is tracked it is not obeyed: it
would throw the beam off, and what is tracked shows that the old one is right.  Else it is: the run begins anew
(daemon.runs), as on a machine that was booted with a wrong clock and has it corrected later.
"""

from math import cos, hypot, radians
from typing import Any

import structlog

from acu_daemon.edge.clock import STEP_S, Clock
from acu_daemon.model import Prediction


class ClockWatch:
    """The alarm, empty while all is well; only its changes are logged."""

    def __init__(self, clock: Clock, alarm_deg: float) -> None:
        self._clock = clock
        self._alarm_deg = alarm_deg
        self._kind = ""
        self._log: Any = structlog.get_logger("clock")
        self.alarm = ""
        self.difference_s = 0.0
        self.sky_rate_deg_s = 0.0  # how fast the satellite moves

    @property
    def step_s(self) -> float:
        """By how much the system clock has stepped, seconds; 0: it has not."""
        return self.difference_s if abs(self.difference_s) > STEP_S else 0.0

    def look(self, prediction: Prediction | None) -> None:
        """Follow the system clock for one second; prediction: how fast the satellite moves now."""
        self.difference_s = self._clock.follow()
        self.sky_rate_deg_s = _sky_rate_deg_s(prediction, self._clock.tai_s())
        kind, self.alarm = self._judge(self.sky_rate_deg_s)
        if kind == self._kind:
            return
        if kind:
            self._log.warning(f"clock.{kind}", difference_s=round(self.difference_s, 4), alarm=self.alarm)
        else:
            self._log.info("clock.back", difference_s=round(self.difference_s, 4))
        self._kind = kind

    def _judge(self, rate_deg_s: float) -> tuple[str, str]:
        if self.step_s:
            stepped = f"the system clock stepped by {self.difference_s:+.3f} s"
            return "stepped", f"{stepped}: not obeyed while a pass is tracked"
        off_deg = abs(self.difference_s) * rate_deg_s
        if off_deg > self._alarm_deg:
            return "off", f"UTC is off by {self.difference_s:+.3f} s: {off_deg:.3f} deg at the present rate"
        if self._clock.is_synchronised is False:
            return "unsynchronised", "the system clock is not synchronised: start chrony or ntpd"
        return "", ""


def _sky_rate_deg_s(prediction: Prediction | None, now_tai_s: float) -> float:
    point = prediction.at(now_tai_s) if prediction is not None else None
    if point is None:
        return 0.0
    return hypot(point.az_rate_deg_s * cos(radians(point.el_deg)), point.el_rate_deg_s)
