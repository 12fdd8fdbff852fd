"""A line of `acu-daemon check` and of `latency-test`: go or no-go, what, and why."""

from dataclasses import dataclass

GO, WARN, NO_GO = "GO", "WARN", "NO-GO"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the check."""

    verdict: str
    what: str
    detail: str
