"""The loop of Galski and Orlando 2011, figure 1: orbit, GPS, navigator, D, controller, manoeuvre, and round again.

Time goes in blocks of fixes.  A block is observed as a whole; where the controller manoeuvres within it, what came
after is thrown away and observed anew, on the orbit as the manoeuvre left it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from acu_daemon.groundtrack.environment import even_steps
from acu_daemon.groundtrack.gps import FIX_S, FIXES, NO_STEERING, GpsReceiver, Steering, TrueOrbit
from acu_daemon.groundtrack.navigator import STEP_S, drift_of
from acu_daemon.units import DAY_S, Array

BLOCK_STEPS = 120  # six hours


class Controller(Protocol):
    """Decides from observations of D."""

    def observe(self, step: int, d_m: float) -> float:
        """Take the observation of a step; the size of the manoeuvre to make now in metres, 0 for none."""


class OrbitNavigator(Protocol):
    """Estimates the mean orbit from fixes; `Navigator` and `PaperNavigator` are."""

    def observe(self, start_s: float, fixes_m: Array) -> Array:
        """Take fixes; estimates at each step, (N, 6)."""

    def manoeuvre(self, delta_a_m: float, sigma_m: float) -> None:
        """A step of the semi-major axis was commanded."""

    def rewind(self, taken: int) -> None:
        """Go back to where it was after so many steps of the last block."""


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """One that was made: seconds since the start, and the step of the semi-major axis as executed."""

    time_s: float
    delta_a_m: float


@dataclass(frozen=True, slots=True)
class Flown:
    """What happened: D at each step as it was and as it was seen, and the manoeuvres."""

    times_s: Array
    d_m: Array
    seen_m: Array
    manoeuvres: tuple[Manoeuvre, ...]

    @property
    def sizes_m(self) -> Array:
        return np.array([one.delta_a_m for one in self.manoeuvres])


def fly(
    orbit: TrueOrbit,
    navigator: OrbitNavigator | None,
    controller: Controller,
    days: float,
    rng: np.random.Generator,
    *,
    execution_sigma: float = 0.02,
    on_day: Callable[[float], None] | None = None,
) -> Flown:
    """Run the loop over `days`.  Without a navigator D is observed as it is.

    execution_sigma: relative error of a manoeuvre's size, 1 sigma.
    """
    of_fixes, of_manoeuvres = rng.spawn(2)
    gps = GpsReceiver(days, of_fixes)
    steps, step = int(days * DAY_S / STEP_S), 0
    steering = NO_STEERING
    seen = np.zeros(steps + 1)
    while step < steps:
        count = min(BLOCK_STEPS, steps - step)
        block = _observed(orbit, navigator, gps, steering, step, count)
        taken, size_m = _decided(controller, block, step)
        seen[step + 1 : step + taken + 1] = block[:taken]
        if size_m > 0.0:
            done_m = size_m * (1.0 + execution_sigma * float(of_manoeuvres.standard_normal()))
            steering = Steering(
                np.append(steering.times_s, (step + taken) * STEP_S), np.append(steering.delta_a_m, done_m)
            )
            if navigator is not None:
                navigator.rewind(taken)
                navigator.manoeuvre(size_m, execution_sigma * size_m + 0.1)
        step += taken
        if on_day is not None:
            on_day(step * STEP_S / DAY_S)
    times_s = even_steps(0.0, STEP_S, steps + 1)
    made = tuple(Manoeuvre(float(t), float(a)) for t, a in zip(steering.times_s, steering.delta_a_m, strict=True))
    return Flown(times_s, orbit.drift_m(times_s, steering), seen, made)


def _observed(
    orbit: TrueOrbit, navigator: OrbitNavigator | None, gps: GpsReceiver, steering: Steering, step: int, count: int
) -> Array:
    """D as seen at the steps after `step`, (count,)."""
    start_s = step * STEP_S
    if navigator is None:
        return orbit.drift_m(even_steps(start_s + STEP_S, STEP_S, count), steering)
    times_s = even_steps(start_s + FIX_S, FIX_S, FIXES * count)
    r_m, _ = orbit.states(times_s, steering)
    return drift_of(orbit.free.craft.reference, navigator.observe(start_s, r_m + gps.errors_m(times_s)))


def _decided(controller: Controller, block: Array, step: int) -> tuple[int, float]:
    """How many observations of the block were taken until a manoeuvre, and its size; all of them and 0 without one."""
    for k, d_m in enumerate(block.tolist(), start=1):
        size_m = controller.observe(step + k, d_m)
        if size_m > 0.0:
            return k, size_m
    return block.size, 0.0
