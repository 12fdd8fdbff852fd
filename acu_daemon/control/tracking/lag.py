"""The lag from command to encoder, learned per axis while the antenna follows the registers.

Commands stand still between hand-overs, so the servo chases a staircase.  A servo with lag T (first order) that is
given steps s every period h shows, at the moment phi after a step took effect, an angle g * s short of the newest
step, where g = exp(-phi/T) / (1 - exp(-h/T)).  g is found by least squares over the readings of the pass and turned
back into T, weighed against what the servo lets one expect; the aim of the commands then leads by T
(docs/adding-an-acu.md, Timing; the field's complaint: "the antenna always lags").
"""

from dataclasses import dataclass
from functools import cache, lru_cache
from math import exp

MAX_LAG_S = 0.5
PRIOR_LAG_S = 0.0125  # a good servo follows a steady rate within 0.025 deg per deg/s; half of it
PRIOR_SIGMA_S = 0.0075
CODE_SIGMA_DEG = 0.0016  # of rounding to a step of 0.0055 deg: the least noise a reading has
DOUBT_COUNT, DOUBT_SIGMA_DEG = 10, 0.02  # few readings agree by chance: as if so many of this noise were among them


@dataclass(frozen=True, slots=True)
class LagEstimate:
    """Least squares sums of one axis: steps s of the command, and how far x the encoder was short of it."""

    count: int = 0
    sum_ss_deg2: float = 0.0
    sum_sx_deg2: float = 0.0
    sum_xx_deg2: float = 0.0

    def seen(self, step_deg: float, short_deg: float) -> "LagEstimate":
        """Add one reading; what cannot be a lag (a disturbance, an encoder fault) is left out."""
        if abs(short_deg) > 5.0 * abs(step_deg) + 0.2:
            return self
        return LagEstimate(
            self.count + 1,
            self.sum_ss_deg2 + step_deg * step_deg,
            self.sum_sx_deg2 + step_deg * short_deg,
            self.sum_xx_deg2 + short_deg * short_deg,
        )

    def lag_s(self, phase_s: float, period_s: float) -> float:
        """The most likely lag T, seconds, between 0 and MAX_LAG_S; the prior while nothing is learned.

        phase_s: from the moment a command takes effect to the sample of the angles; period_s: between commands.
        """
        return _most_likely_lag_s(self, phase_s, period_s)


@lru_cache(maxsize=8)  # asked several times a tick, for two axes
def _most_likely_lag_s(seen: LagEstimate, phase_s: float, period_s: float) -> float:
    if seen.sum_ss_deg2 <= 0.0:
        return PRIOR_LAG_S
    g = seen.sum_sx_deg2 / seen.sum_ss_deg2
    rest_deg2 = max(seen.sum_xx_deg2 - g * seen.sum_sx_deg2, 0.0) + DOUBT_COUNT * DOUBT_SIGMA_DEG**2
    weight = seen.sum_ss_deg2 / (rest_deg2 / (seen.count + DOUBT_COUNT) + CODE_SIGMA_DEG**2)

    def misfit(candidate: tuple[float, float]) -> float:
        lag_s, shortfall = candidate
        return weight * (shortfall - g) ** 2 + ((lag_s - PRIOR_LAG_S) / PRIOR_SIGMA_S) ** 2

    return min(_candidates(phase_s, period_s), key=misfit)[0]


@cache
def _candidates(phase_s: float, period_s: float) -> tuple[tuple[float, float], ...]:
    """Lags to choose from with their g: every 2.5 ms up to 50 ms, then in steps of a twentieth."""
    lags_s = [0.0025 * k for k in range(21)]
    while lags_s[-1] < MAX_LAG_S:
        lags_s.append(min(lags_s[-1] * 1.05, MAX_LAG_S))
    return tuple((lag_s, _shortfall(lag_s, phase_s, period_s)) for lag_s in lags_s)


def _shortfall(lag_s: float, phase_s: float, period_s: float) -> float:
    if lag_s <= 0.0:
        return 0.0
    return exp(-phase_s / lag_s) / (1.0 - exp(-period_s / lag_s))
