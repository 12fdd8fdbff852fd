"""GPS fixes of a simulated satellite: the truth with the errors of Galski and Orlando 2011, section 2.

Random errors of 100 m and 1 m/s on each axis, and a systematic error that steps each time the set of satellites in
view changes: every 1 to 15 minutes, about 100 m in length.  In three dimensions that makes 202 m rms.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.groundtrack.environment import FreeMotion
from acu_daemon.groundtrack.mean_elements import MeanElements, states_of
from acu_daemon.orbit.kepler import perifocal_axes
from acu_daemon.units import Array

FIX_S = 9.0
FIXES = 20  # to an observation of D
NOISE_M, NOISE_M_S = 100.0, 1.0  # on each axis
STEP_SIGMA_M = 60.0  # of the systematic error on each axis: 104 m rms in length
SHORTEST_S, LONGEST_S = 60.0, 900.0


@dataclass(frozen=True, slots=True)
class Ripple:
    """What the tesserals add to the position over a repeat cycle: radial, along, across, (N, 3) m at even steps.

    It repeats with the ground track; between the steps it is linear.
    """

    step_s: float
    radial_along_across_m: Array

    def at(self, times_s: Array) -> Array:
        """(M, 3) at seconds since the begin of a cycle."""
        count = len(self.radial_along_across_m)
        x = np.remainder(times_s / self.step_s, count)
        i = x.astype(int) % count
        u = (x - np.floor(x))[:, None]
        table = self.radial_along_across_m
        between: Array = (1.0 - u) * table[i] + u * table[(i + 1) % count]
        return between


@dataclass(frozen=True, slots=True)
class Steering:
    """Manoeuvres so far: seconds since the start, and steps of the semi-major axis as executed, each (N,)."""

    times_s: Array
    delta_a_m: Array

    def offsets(self, times_s: Array) -> tuple[Array, Array]:
        """Semi-major axis added, and its integral over time in m s, at the times (M,)."""
        elapsed = np.maximum(times_s[:, None] - self.times_s, 0.0)
        return (elapsed > 0.0) @ self.delta_a_m, elapsed @ self.delta_a_m


NO_STEERING = Steering(np.zeros(0), np.zeros(0))


@dataclass(frozen=True, slots=True)
class TrueOrbit:
    """The simulated satellite: free motion, manoeuvres, and the tesserals' ripple where there is one."""

    free: FreeMotion
    node_rad: float  # right ascension of the node at the start
    ripple: Ripple | None = None

    def elements(self, times_s: Array, steering: Steering) -> MeanElements:
        """Mean elements at seconds since the start, (N,)."""
        free, reference = self.free, self.free.craft.reference
        a, i, raan, alpha = (np.interp(times_s, free.times_s, one) for one in _offsets(free))
        added, summed = steering.offsets(times_s)
        zero = np.zeros_like(times_s)
        return MeanElements(
            reference.a_m + a + added,
            zero,
            zero + reference.e,
            reference.i_rad + i,
            self.node_rad + reference.raan_rate_rad_s * times_s + raan + reference.by_a.raan * summed,
            reference.alpha_rate_rad_s * times_s + alpha + reference.by_a.alpha * summed,
        )

    def states(self, times_s: Array, steering: Steering) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and velocities (N, 3) in m/s, TEME."""
        elements = self.elements(times_s, steering)
        r_m, v_m_s = states_of(elements)
        return (r_m, v_m_s) if self.ripple is None else (r_m + displaced(elements, self.ripple.at(times_s)), v_m_s)

    def drift_m(self, times_s: Array, steering: Steering) -> Array:
        """True D at the times (N,)."""
        reference = self.free.craft.reference
        free = np.interp(times_s, self.free.times_s, self.free.d_m)
        drift: Array = free + reference.by_a.drift * steering.offsets(times_s)[1]
        return drift


def axes_of(elements: MeanElements) -> tuple[Array, Array, Array]:
    """Unit vectors outwards, along the motion, and across (the orbit's normal), each (N, 3)."""
    outward, along = perifocal_axes(elements.i_rad, elements.raan_rad, elements.alpha_rad)
    return outward, along, np.cross(outward, along)


def displaced(elements: MeanElements, radial_along_across_m: Array) -> Array:
    """A displacement (N, 3) in the frame of the elements."""
    axes = axes_of(elements)
    moved: Array = sum(radial_along_across_m[:, k : k + 1] * axis for k, axis in enumerate(axes))  # type: ignore[assignment]
    return moved


class GpsReceiver:
    """Draws the errors; the systematic one is a schedule over the whole span, so that fixes may be taken in pieces."""

    def __init__(self, days: float, rng: np.random.Generator) -> None:
        count = int(days * 86400.0 / ((SHORTEST_S + LONGEST_S) / 2.0) * 1.2) + 60
        self._starts_s = np.cumsum(rng.uniform(SHORTEST_S, LONGEST_S, count)) - LONGEST_S
        self._steps_m = rng.normal(0.0, STEP_SIGMA_M, (count, 3))
        self._rng = rng

    def errors_m(self, times_s: Array) -> Array:
        """Errors of the positions, (N, 3) m."""
        step = np.maximum(np.searchsorted(self._starts_s, times_s, side="right") - 1, 0)
        errors: Array = self._steps_m[step] + self._rng.normal(0.0, NOISE_M, (times_s.size, 3))
        return errors

    def velocity_errors_m_s(self, times_s: Array) -> Array:
        """Errors of the velocities, (N, 3) m/s."""
        return self._rng.normal(0.0, NOISE_M_S, (times_s.size, 3))


def _offsets(free: FreeMotion) -> tuple[Array, Array, Array, Array]:
    return free.a_m, free.i_rad, free.raan_rad, free.alpha_rad
