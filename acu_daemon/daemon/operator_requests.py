"""A person's hand on the running daemon: what it answers to a line, and what it asks of the next tick by it.

Command line, page and other programs' ports all come through `Hands.answer`; daemon.operator_verbs has the verbs.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import structlog

from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.stow import why_not_sent
from acu_daemon.control.tick_input import Asking, HoldWish, NudgeWish, Request, StowBy, StowWish
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.daemon.area import CommonArea
from acu_daemon.daemon.operator_verbs import Said, understood
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.errors import UsageError

STATUS = "status"
ENDS = "error the daemon ends, with a safe stop; nothing more is obeyed"


class Hands:
    """Answers at once; ask: hands a request to the next tick, which does it."""

    def __init__(
        self,
        area: CommonArea,
        control: ControlConfig,
        ask: Callable[[Asking], None],
        snapshot: Callable[[], Snapshot],
        now_tai_s: Callable[[], float],
    ) -> None:
        self._area = area
        self._control = control
        self._ask = ask
        self._snapshot = snapshot
        self._now_tai_s = now_tai_s

    def answer(self, line: str, who: str = "") -> str:
        """`ok ...` or `error ...`.  who: says it, and from where, for the log."""
        if line == STATUS:
            return f"ok {json.dumps(asdict(self._snapshot()))}"
        try:
            said = understood(line)
        except UsageError as error:
            return f"error {error}"
        return self.do(said, who)

    def do(self, said: Said, who: str) -> str:
        """Do what was said."""
        verb = said.verb
        if verb.is_of_station:
            return f"error {verb.name}: only a station has it, `acu-daemon run` without --satellite"
        if self._control.is_shadow:
            return f"error this daemon runs with --shadow: it commands nothing, so there is nothing to {verb.name}"
        match verb.name:
            case "stow" | "unstow":
                answer = self._stow(verb.name)
            case "hold" | "track":
                answer = self._hold(is_wanted=verb.name == "hold")
            case "nudge":
                answer = self._nudge(said.figures)
            case "grant" | "revoke":
                answer = "error there is no rotctld port: [rotctld] listen of station.toml"
            case _:
                answer = self._request(Request(verb.name))
        return tell(line=said.line, who=who, answer=answer)

    def _request(self, request: Request) -> str:
        state = self._area.state
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
            Request.STOP: "ok STOP goes out at once; the daemon is disarmed",
            Request.CLEAR: f"ok cleared: {state.latch.problem}",
        }[request]

    def _stow(self, verb: str) -> str:
        state, by = self._area.state, self._area.state.stow.stow_by
        if verb == "unstow":
            self._ask(StowWish(StowBy.OPERATOR, is_wanted=False))
            return f"ok the stow is over, it was the {by}'s" if by else "ok nothing is stowed"
        if why := why_not_sent(state, self._now_tai_s(), self._control):
            return f"error not stowed: {why}"
        self._ask(StowWish(StowBy.OPERATOR))
        return "ok stowed: the ACU goes to its stow position; `acu-daemon unstow` ends it"

    def _hold(self, *, is_wanted: bool) -> str:
        if not self._control.has_signal:
            return "ok the prediction is followed already: no signal is waited for"
        if why := self._why_not_steered():
            return f"error {why}"
        self._ask(HoldWish(is_wanted))
        if is_wanted:
            return "ok held: autotrack is left, the prediction is followed; `acu-daemon track` ends it, or the pass"
        return "ok autotrack is selected again"

    def _nudge(self, figures: Mapping[str, float]) -> str:
        if not figures:
            return "error nudge: expected along_s=, across_deg= or both"
        if why := self._why_not_steered():
            return f"error {why}"
        now = self._area.state.by_hand.nudge
        along_s = figures.get("along_s", now.along_s if now else 0.0)
        across_deg = figures.get("across_deg", now.across_deg if now else 0.0)
        self._ask(NudgeWish(along_s, across_deg))
        if along_s == across_deg == 0.0:
            return "ok the nudge is undone"
        return f"ok nudged: {along_s:+.2f} s late, {across_deg:+.3f} deg right in all"

    def _why_not_steered(self) -> str:
        """Why no pass can be steered now; empty: one can."""
        if self._control.is_resting or self._area.sky.plan is None or self._area.sky.prediction is None:
            return "no pass is on"
        return "" if self._area.state.is_armed(self._control) else "disarmed: `acu-daemon arm` first"


def tell(*, line: str, who: str, answer: str) -> str:
    """Write into the log what a person said, and return the answer to it."""
    log: Any = structlog.get_logger("operator")
    log.info("operator.asked", line=line, who=who, answer=answer)
    return answer
