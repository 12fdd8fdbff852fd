"""Geomagnetic storms put into a profile: a day of high Kp and a day of recovery, at random days."""

from dataclasses import replace

import numpy as np

from acu_daemon.groundtrack.environment import Flux

LOWEST_KP, HIGHEST_KP = 6.0, 9.0


def with_storms(flux: Flux, count: int, seed: int) -> Flux:
    """The profile with so many storms; the same seed gives the same days."""
    rng = np.random.default_rng([seed, count])
    kp = flux.kp.copy()
    for day in rng.choice(kp.size - 1, size=min(count, kp.size - 1), replace=False):
        peak = rng.uniform(LOWEST_KP, HIGHEST_KP)
        kp[day] = max(kp[day], peak)
        kp[day + 1] = max(kp[day + 1], 0.5 * (peak + kp[day + 1]))
    return replace(flux, kp=kp)
