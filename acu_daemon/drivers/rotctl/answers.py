"""The answers of a rotctld, put together from its lines (Hamlib 4.5, `rotctld(1)`).

An answer does not say what it answers, so each kind knows which lines can be its own.  A command that failed is
answered by `RPRT` and a negative code, whatever it asked.
"""

from dataclasses import dataclass, field
from enum import Enum, auto
from math import isfinite

ERRORS = {
    1: "invalid parameter",
    2: "invalid configuration",
    3: "memory shortage",
    4: "not implemented",
    5: "communication timed out",
    6: "IO error",
    7: "internal error",
    8: "protocol error",
    9: "command rejected",
    10: "argument truncated",
    11: "not available",
    12: "VFO not targetable",
    13: "bus error",
    14: "bus collision",
    15: "invalid pointer",
    17: "argument out of domain",
    19: "security error",
}
NO_CONTACT = frozenset({5, 6, 8, 13, 14})  # of these the rotator itself has not answered
LONGEST_STATE_LINES = 60
OLD_STATE_LINES = 6  # of protocol 0: version, model, four limits, and no end


class Kind(Enum):
    """What was asked."""

    POSITION = auto()  # p: azimuth and elevation, a line each
    REPORT = auto()  # P, S: RPRT alone
    STATE = auto()  # \\dump_state


@dataclass(frozen=True, slots=True)
class Report:
    """RPRT: 0 is done."""

    code: int

    @property
    def text(self) -> str:
        return f"RPRT {self.code} ({ERRORS.get(-self.code, 'unknown error')})"

    @property
    def has_no_contact(self) -> bool:
        return -self.code in NO_CONTACT


@dataclass(frozen=True, slots=True)
class Position:
    """Azimuth and elevation as the rotator counts them, deg."""

    az_deg: float
    el_deg: float


@dataclass(frozen=True, slots=True)
class RotatorState:
    """What \\dump_state tells: the model, and the limits as far as they were there."""

    model: int
    limits_deg: dict[str, float]


Answer = Report | Position | RotatorState


@dataclass(slots=True)
class Awaited:
    """An answer that is owed, and its lines so far.  Changed by the driver alone."""

    kind: Kind
    begun_s: float
    is_given_up: bool = False
    lines: list[str] = field(default_factory=list)

    def takes(self, line: str) -> bool:
        """Whether a line can be the next one of this answer."""
        if report(line) is not None:
            return not self.lines or self.kind is Kind.STATE
        if self.kind is Kind.POSITION:
            return angle_deg(line) is not None
        return self.kind is Kind.STATE and (bool(self.lines) or line.isdigit())

    def add(self, line: str) -> Answer | None:
        """Take a line; the answer once it is complete.  ValueError: it reads as none."""
        if (refused := report(line)) is not None:
            return refused
        self.lines.append(line)
        if self.kind is Kind.POSITION:
            return _position(self.lines)
        return _state(self.lines) if self.kind is Kind.STATE else None


def report(line: str) -> Report | None:
    """Read an RPRT line; None: it is none."""
    word, _, code = line.partition(" ")
    return Report(int(code)) if word == "RPRT" and code.removeprefix("-").isdigit() else None


def angle_deg(line: str) -> float | None:
    """Read an angle; None: it is none.  NaN and infinity are none."""
    try:
        value = float(line)
    except ValueError:
        return None
    return value if isfinite(value) and abs(value) < 1e4 else None


def _position(lines: list[str]) -> Position | None:
    if len(lines) < 2:
        return None
    az_deg, el_deg = (angle_deg(line) for line in lines)
    if az_deg is None or el_deg is None:
        raise ValueError(f"no angles: {lines}")
    return Position(az_deg, el_deg)


def _state(lines: list[str]) -> RotatorState | None:
    is_old = lines[0] == "0"
    is_complete = len(lines) == OLD_STATE_LINES if is_old else lines[-1] == "done"
    if not is_complete:
        if len(lines) > LONGEST_STATE_LINES:
            raise ValueError("a state without an end")
        return None
    names = ("min_az", "max_az", "min_el", "max_el")
    texts = dict(zip(names, lines[2:], strict=True)) if is_old else dict(line.partition("=")[::2] for line in lines)
    found = {name: angle_deg(texts[name]) for name in names if name in texts}
    model = int(lines[1]) if len(lines) > 1 and lines[1].isdigit() else 0
    return RotatorState(model, {name: value for name, value in found.items() if value is not None})
