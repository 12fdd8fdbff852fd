"""A person's hand on the running daemon: what it answers to a line of the control socket."""

import json
from collections.abc import Callable
from dataclasses import asdict

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.tick_input import Request
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.snapshot import Snapshot


class Hands:
    """Answers at once; ask: hands a request to the next tick, which does it."""

    def __init__(
        self,
        area: CommonArea,
        control: ControlConfig,
        ask: Callable[[Request], None],
        snapshot: Callable[[], Snapshot],
    ) -> None:
        self._area = area
        self._control = control
        self._ask = ask
        self._snapshot = snapshot

    def answer(self, line: str) -> str:
        """`ok ...` or `error ...`."""
        if line == "status":
            return f"ok {json.dumps(asdict(self._snapshot()))}"
        if line not in set(Request):
            return f"error {line!r} is unknown, expected status, {', '.join(Request)}"
        return self._request(Request(line))

    def _request(self, request: Request) -> str:
        state = self._area.state
        if self._control.is_shadow:
            return f"error this daemon runs with --shadow: it commands nothing, so there is nothing to {request}"
        if request is Request.CLEAR and not state.latch.problem:
            return "ok nothing is latched"
        self._ask(request)
        if request is Request.ARM and state.latch.problem:
            return f"ok armed, but latched: {state.latch.problem}; look at the antenna, then `acu-daemon clear`"
        if request is Request.ARM and state.tracking.track is TrackState.FAULT:
            return "ok armed, but the ACU reports a fault: an emergency stop or an open door disarms again"
        return {
            Request.ARM: "ok armed",
            Request.DISARM: "ok disarmed: STOP is sent if the daemon moves the antenna, then nothing",
            Request.CLEAR: f"ok cleared: {state.latch.problem}",
        }[request]
