"""The newest lines of the log, as the page shows them."""

from collections import deque
from collections.abc import Mapping
from typing import Any

KEPT = 120
LONGEST = 300  # characters of a line
HIDDEN = frozenset({"utc", "event", "level", "REHEARSAL", "SIMULATION"})


class RecentEvents:
    """Keeps them; what they say is put together when somebody looks.  Owned by the loop."""

    def __init__(self) -> None:
        self._lines: deque[Mapping[str, Any]] = deque(maxlen=KEPT)
        self.count = 0

    def add(self, entry: Mapping[str, Any]) -> None:
        """Take a line of the log; those for debugging are left out."""
        if entry.get("level") != "debug":
            self._lines.append(dict(entry))
            self.count += 1

    def lines(self) -> list[dict[str, str]]:
        """The newest first."""
        return [_shown(entry) for entry in reversed(self._lines)]


def _shown(entry: Mapping[str, Any]) -> dict[str, str]:
    said = "  ".join(f"{key}={_short(value)}" for key, value in entry.items() if key not in HIDDEN)
    return {
        "utc": str(entry.get("utc", "")),
        "level": str(entry.get("level", "info")),
        "event": str(entry.get("event", ""))[:LONGEST],
        "text": said[:LONGEST],
    }


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
