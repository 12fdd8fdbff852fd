"""Memories of the decision for tests: made by the names of their fields, whatever part holds them."""

from dataclasses import fields, replace
from typing import Any

from acu_daemon.control.state import ControlState

PART_OF = {
    field.name: part.name
    for part in fields(ControlState)
    if part.name not in ("turn", "encoders")
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
