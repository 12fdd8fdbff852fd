"""Angles as an ACU can carry them: multiples of a step, rounded before they are held to limits.

Multiples of a power of two in turns are exact in a float, so that such a step loses nothing.
"""

from math import ceil, floor, isfinite

_LIMIT_SLACK_STEPS = 1e-6  # a limit that is a multiple of the step must not move by a float's last bit


def clamp_to_step(angle_deg: float, min_deg: float, max_deg: float, step_deg: float) -> float:
    """The multiple of the step nearest to an angle that still lies within the limits.

    So -0.001 deg with a lower limit of 0 becomes 0, and never a code just below the limit.  An azimuth is the
    continuous one, in the frame of its limits.  ValueError: the angle is not finite, or no multiple lies between.
    """
    if not isfinite(angle_deg):
        raise ValueError(f"an angle must be finite, got {angle_deg}")
    lowest = ceil(min_deg / step_deg - _LIMIT_SLACK_STEPS)
    highest = floor(max_deg / step_deg + _LIMIT_SLACK_STEPS)
    if lowest > highest:
        raise ValueError(f"no multiple of {step_deg} deg lies between {min_deg} and {max_deg} deg")
    return min(max(round(angle_deg / step_deg), lowest), highest) * step_deg
