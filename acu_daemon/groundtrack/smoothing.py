"""The moving averages of Galski and Orlando 2011, eqs 2 to 4.

Eq 3 keeps two sums alone, so the oldest observation cannot be taken out: what is stored fades by (N-1)/N at each step.
That is an exponential of the time constant N steps, with a delay of N steps; a true window of N has half of it.
"""

from collections import deque
from typing import Protocol

RECURSION, WINDOW = "recursion", "window"


class Average(Protocol):
    """A running mean."""

    def add(self, value: float) -> float:
        """Take a value; the mean with it."""


class RecursiveAverage:
    """Eqs 2 and 3 with all weights 1, as the stored sums make them."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._seen = 0
        self._sum = self._weight = 0.0

    def add(self, value: float) -> float:
        """Take a value; the mean with it."""
        fade = 1.0 if self._seen < self._count else (self._count - 1.0) / self._count
        self._seen += 1
        self._sum = fade * self._sum + value
        self._weight = fade * self._weight + 1.0
        return self._sum / self._weight


class WindowAverage:
    """The mean of the last `count` values."""

    def __init__(self, count: int) -> None:
        self._values: deque[float] = deque(maxlen=count)
        self._sum = 0.0

    def add(self, value: float) -> float:
        """Take a value; the mean with it."""
        if len(self._values) == self._values.maxlen:
            self._sum -= self._values[0]
        self._values.append(value)
        self._sum += value
        return self._sum / len(self._values)


class DriftSmoother:
    """Smoothed D, and dD/dt smoothed from its differences (eq 4); restarted at a manoeuvre."""

    def __init__(self, step_s: float, window_d_s: float, window_rate_s: float, kind: str = RECURSION) -> None:
        self._step_s = step_s
        self._counts = (round(window_d_s / step_s), round(window_rate_s / step_s))
        self._kind = RecursiveAverage if kind == RECURSION else WindowAverage
        self.restart()

    def restart(self) -> None:
        """Forget everything."""
        self._of_d: Average = self._kind(self._counts[0])
        self._of_rate: Average = self._kind(self._counts[1])
        self._last_m: float | None = None
        self._rate_m_s = 0.0

    def add(self, d_m: float) -> tuple[float, float]:
        """Take an observation of D; smoothed D in metres, smoothed dD/dt in m/s (0 before the second one)."""
        smooth_m = self._of_d.add(d_m)
        if self._last_m is not None:
            self._rate_m_s = self._of_rate.add((smooth_m - self._last_m) / self._step_s)
        self._last_m = smooth_m
        return smooth_m, self._rate_m_s
