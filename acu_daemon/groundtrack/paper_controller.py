"""The controller of Galski and Orlando 2011: conditions 6 and 7, sizes by eqs 12 and 13, guard, restart.

Eq 12's root covers the whole product; eq 11 is not needed.  The acceleration is that of the moment: a size cannot know
what the 27-day wave of the flux will do, so D overshoots to the west when the flux falls after a manoeuvre.
"""

from dataclasses import dataclass
from math import sqrt

from acu_daemon.groundtrack.reference import ReferenceOrbit, micheau_size_m
from acu_daemon.groundtrack.smoothing import RECURSION, DriftSmoother
from acu_daemon.units import DAY_S, Array

HOUR_S = 3600.0
SHORTEST_GUARD_S = DAY_S  # the paper's


@dataclass(frozen=True, slots=True)
class PaperSettings:
    """Control range, windows of D and dD/dt, and the paper's n of eqs 6 and 7 (which is 0)."""

    d_max_m: float
    d_min_m: float
    window_d_s: float
    window_rate_s: float
    smoothing: str = RECURSION
    acceleration_scale: float = 1.0  # 1: the right acceleration; others are fitted to the paper's counts
    sigma_margin_m: float = 0.0  # n sigma of eqs 6 and 7

    @property
    def guard_s(self) -> float:
        """No manoeuvre for so long after one: the mean's slope is wrong until both windows are full again."""
        return max(SHORTEST_GUARD_S, self.window_d_s + self.window_rate_s)


class PaperController:
    """Decides at each observation of D.  Mutable; belongs to one loop."""

    def __init__(
        self, settings: PaperSettings, reference: ReferenceOrbit, step_s: float, acceleration_m_s2: Array
    ) -> None:
        """Take the acceleration of D at each step, (N,), as the polynomials give it on board."""
        self._settings, self._reference, self._step_s = settings, reference, step_s
        self._acceleration = acceleration_m_s2 * settings.acceleration_scale
        self._smoother = DriftSmoother(step_s, settings.window_d_s, settings.window_rate_s, settings.smoothing)
        self._rested_s = 0.0

    def observe(self, step: int, d_m: float) -> float:
        """Take the observation of a step; the size of the manoeuvre to make now in metres, 0 for none."""
        smooth_m, rate_m_s = self._smoother.add(d_m)
        self._rested_s += self._step_s
        if self._rested_s < self._settings.guard_s:
            return 0.0
        settings, acceleration = self._settings, float(self._acceleration[step])
        limit_m = settings.d_max_m - settings.sigma_margin_m
        coming_m = smooth_m + rate_m_s * self._step_s + 0.5 * acceleration * self._step_s**2
        if max(smooth_m, coming_m) <= limit_m or acceleration <= 0.0 or smooth_m <= settings.d_min_m:
            return 0.0
        wanted_m_s = -sqrt(2.0 * acceleration * (smooth_m - settings.d_min_m))
        size_m = micheau_size_m(self._reference, (wanted_m_s - rate_m_s) * DAY_S)
        if size_m <= 0.0:
            return 0.0
        self._smoother.restart()
        self._rested_s = 0.0
        return size_m


class ConstantController:
    """The controller of Galski et al. 2001, as the paper of 2011 has it: equal steps, at most one in a revolution.

    Where it aims is not said; here at D = 0: a step is made while smoothed D is east of it and drifts further east.
    """

    def __init__(self, size_m: float, reference: ReferenceOrbit, step_s: float, window_d_s: float) -> None:
        """Take the size; D and dD/dt are smoothed over the same window, and restarted by a step."""
        self._size_m, self._step_s, self._rest_s = size_m, step_s, max(reference.revolution_s, window_d_s / 2.0)
        self._smoother = DriftSmoother(step_s, window_d_s, window_d_s)
        self._rested_s = 0.0

    def observe(self, step: int, d_m: float) -> float:
        """Take the observation of a step; the size of the manoeuvre to make now in metres, 0 for none."""
        smooth_m, rate_m_s = self._smoother.add(d_m)
        self._rested_s += self._step_s
        if self._rested_s < self._rest_s or smooth_m <= 0.0 or rate_m_s <= 0.0:
            return 0.0
        self._smoother.restart()
        self._rested_s = 0.0
        return self._size_m
