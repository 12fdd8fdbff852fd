"""SIMULATION of the command registers: the last write wins, every 80 ms at most (docs/protocol.md, Behaviour)."""

from math import ceil, floor

from acu_daemon.model import AxisLimits

HAND_OVER_STEPS = 4  # 80 ms at 50 Hz
_SLACK_DEG = 1e-6


def turns_within(bearing_deg: float, limits: AxisLimits) -> list[float]:
    """Every continuous azimuth of a bearing inside the limits, lowest first."""
    first = ceil((limits.min_deg - _SLACK_DEG - bearing_deg) / 360.0)
    last = floor((limits.max_deg + _SLACK_DEG - bearing_deg) / 360.0)
    return [bearing_deg + 360.0 * turn for turn in range(first, last + 1)]


def choose_turn(bearing_deg: float, present_deg: float, limits: AxisLimits, preference: int) -> float:
    """The turn of a reachable bearing that parameter S asks for: 0 nearest to the present one, 1 low half, 2 high half.

    Where the wanted half does not hold the bearing, the nearest turn is taken.
    """
    turns = turns_within(bearing_deg, limits)
    middle_deg = (limits.min_deg + limits.max_deg) / 2.0
    halves = {1: [turn for turn in turns if turn < middle_deg], 2: [turn for turn in turns if turn >= middle_deg]}
    return min(halves.get(preference) or turns, key=lambda turn: abs(turn - present_deg))


class CommandRegisters:
    """The registers, their count, and the values that were last handed over."""

    def __init__(self, az_deg: float, el_deg: float, tilt_code: int) -> None:
        self.az_deg, self.el_deg, self.tilt_code = az_deg % 360.0, el_deg, tilt_code
        self.count = 0
        self.held = (self.az_deg, self.el_deg, tilt_code)
        self._is_pending = False
        self._steps_since = HAND_OVER_STEPS

    def write(self, az_deg: float, el_deg: float, tilt_code: int | None) -> None:
        """Take a write that was accepted."""
        self.az_deg, self.el_deg = az_deg, el_deg
        if tilt_code is not None:
            self.tilt_code = tilt_code
        self.count = (self.count + 1) % 256
        self._is_pending = True

    def step(self) -> bool:
        """One 50 Hz tick; whether the registers were handed over at it."""
        self._steps_since += 1
        if not self._is_pending or self._steps_since < HAND_OVER_STEPS:
            return False
        self.held = (self.az_deg, self.el_deg, self.tilt_code)
        self._is_pending, self._steps_since = False, 0
        return True
