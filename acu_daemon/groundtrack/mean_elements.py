"""Mean elements of a nearly circular orbit without a singularity, to and from states.

alpha = argp + mean anomaly (Galski and Orlando 2011, eq 1); with the true anomaly in its place D has a ripple of 930 m
once a revolution.  The first-order short-period terms of J2 are removed: left in they are 194 m in D, twice a
revolution.
"""

from typing import NamedTuple

import numpy as np

from acu_daemon.orbit.brouwer import states_of_mean
from acu_daemon.orbit.kepler import OsculatingElements, osculating_from_state
from acu_daemon.units import Array

_PASSES = 3  # of the fixed point; each gains a factor of J2


class MeanElements(NamedTuple):
    """Arrays (N,): metres and radians; (ex, ey) = e (cos, sin) of the argument of perigee."""

    a_m: Array
    ex: Array
    ey: Array
    i_rad: Array
    raan_rad: Array
    alpha_rad: Array


def states_of(mean: MeanElements) -> tuple[Array, Array]:
    """Positions (N, 3) in metres and velocities (N, 3) in m/s, with the short-period terms of J2."""
    argp = np.arctan2(mean.ey, mean.ex)
    e = np.hypot(mean.ex, mean.ey)
    return states_of_mean(
        OsculatingElements(mean.a_m, e, mean.i_rad, mean.raan_rad, argp, np.asarray(mean.alpha_rad - argp))
    )


def osculating_of(r_m: Array, v_m_s: Array) -> MeanElements:
    """The same six numbers of the osculating orbit.  ValueError: a state on no ellipse."""
    o = osculating_from_state(r_m, v_m_s)
    alpha = o.argp_rad + o.mean_anomaly_rad
    return MeanElements(o.a_m, o.e * np.cos(o.argp_rad), o.e * np.sin(o.argp_rad), o.i_rad, o.raan_rad, alpha)


def mean_of(r_m: Array, v_m_s: Array) -> MeanElements:
    """Mean elements whose states these are, (N, 3) each.  ValueError: a state on no ellipse."""
    osculating = osculating_of(r_m, v_m_s)
    mean = osculating
    for _ in range(_PASSES):
        again = osculating_of(*states_of(mean))
        missing = [now - then for now, then in zip(osculating, again, strict=True)]
        missing[4], missing[5] = _wrapped(missing[4]), _wrapped(missing[5])
        mean = MeanElements(*(one + step for one, step in zip(mean, missing, strict=True)))
    return mean


def _wrapped(angle_rad: Array) -> Array:
    wrapped: Array = np.remainder(angle_rad + np.pi, 2.0 * np.pi) - np.pi
    return wrapped
