"""Memories of the decision for tests: made by the names of their fields, whatever part holds them; and a judge."""

from dataclasses import fields, replace
from typing import Any

from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.safety.status_plausibility import Plausibility, judge
from acu_daemon.control.state import ControlState
from acu_daemon.model import AxisLimits

PART_OF = {
    field.name: part.name
    for part in fields(ControlState)
    if part.name not in ("turn", "encoders", "plausibility")
    for field in fields(getattr(ControlState(), part.name))
}


def remembering(before: ControlState | None = None, /, **changes: Any) -> ControlState:
    """A memory with some fields changed.  changes: fields of the parts, or whole parts, by name."""
    state = before or ControlState()
    for name, value in changes.items():
        part = PART_OF.get(name)
        new = value if part is None else replace(getattr(state, part), **{name: value})
        state = replace(state, **{part or name: new})
    return state


class Judge:
    """Judges one status after another."""

    def __init__(self, azimuth: AxisLimits, elevation: AxisLimits) -> None:
        self._limits = azimuth, elevation
        self.known = Plausibility()

    def believes(self, status: AcuStatus, tai_s: float) -> bool:
        self.known = judge(self.known, status, tai_s, *self._limits, within_s=0.5)
        return self.known.is_believed
