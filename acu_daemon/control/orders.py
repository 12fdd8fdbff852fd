"""What a tick decides: what is sent, and facts for the log."""

from dataclasses import dataclass, field
from typing import Any

from acu_daemon.acu.commands import Command


@dataclass(frozen=True, slots=True)
class Event:
    """A fact for the log."""

    name: str
    fields: dict[str, Any] = field(default_factory=dict)
    is_warning: bool = False


@dataclass(frozen=True, slots=True)
class Orders:
    """What this tick sends: an exchange that brings a status, and at most one beside it; or that one in its place."""

    first: Command
    extra: Command | None = None
    events: tuple[Event, ...] = ()
