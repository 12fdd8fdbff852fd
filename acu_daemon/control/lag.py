"""The lag from command to encoder, learned per axis while the antenna follows the registers.

Commands stand still between hand-overs, so the servo chases a staircase.  A servo with lag T (first order) that is
given steps s every period h shows, at the moment phi after a step took effect, an angle g * s short of the newest step,
where g = exp(-phi/T) / (1 - exp(-h/T)).  g is learned by least squares over the readings of the pass and turned
back into T, which the aim of the commands then leads (ICD section 6; field lesson: "the antenna always lags").
"""

from dataclasses import dataclass, replace
from math import exp

MAX_LAG_S = 0.5
_PRIOR_STEP_DEG2 = 0.02  # weight of the prior, as the sum of squared steps it is worth: two seconds at 0.3 deg/s


@dataclass(frozen=True, slots=True)
class LagEstimate:
    """Least squares sums of one axis."""

    sum_step2_deg2: float = 0.0
    sum_short_step_deg2: float = 0.0

    def seen(self, step_deg: float, short_deg: float) -> "LagEstimate":
        """Add one reading: the newest step of the command, and how far the encoder is short of the command."""
        if abs(short_deg) > 5.0 * abs(step_deg) + 0.2:  # not a lag: a disturbance, or an encoder fault
            return self
        return replace(
            self,
            sum_step2_deg2=self.sum_step2_deg2 + step_deg**2,
            sum_short_step_deg2=self.sum_short_step_deg2 + step_deg * short_deg,
        )

    def lag_s(self, phase_s: float, period_s: float, prior_s: float = 0.0) -> float:
        """The lag T in seconds, between 0 and MAX_LAG_S; the prior while nothing is learned.

        phase_s: from the moment a command takes effect to the sample of the angles; period_s: between commands.
        """
        prior_g = _shortfall(prior_s, phase_s, period_s)
        g = (self.sum_short_step_deg2 + _PRIOR_STEP_DEG2 * prior_g) / (self.sum_step2_deg2 + _PRIOR_STEP_DEG2)
        low, high = 0.0, MAX_LAG_S
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if _shortfall(middle, phase_s, period_s) < g else (low, middle)
        return (low + high) / 2


def _shortfall(lag_s: float, phase_s: float, period_s: float) -> float:
    if lag_s < 1e-3:
        return 0.0
    return exp(-phase_s / lag_s) / (1.0 - exp(-period_s / lag_s))
