"""A few of many times, between which what changes slowly along a path is interpolated.  Pure."""

import numpy as np

from acu_daemon.units import Array


def spaced(tai_s: Array, step_s: float) -> Array:
    """Of times (N,), oldest first, the first of each step since the first one, and the last: none that is not there."""
    firsts = np.searchsorted(tai_s, np.arange(tai_s[0], tai_s[-1], step_s))
    few: Array = np.unique(tai_s[np.append(firsts, tai_s.size - 1)])
    return few
