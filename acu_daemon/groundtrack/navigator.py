"""Our navigator: a Kalman filter on the mean orbit, fed with 20 GPS fixes averaged.

State: deviations of (a, ex, ey, i, raan, alpha) from a nominal mean orbit that is propagated analytically, da/dt, and
the receiver's systematic error in radial, along and across.  What is seen is the mean of position less nominal over
20 fixes, in those directions, at the argument u = alpha of the middle:

    radial  = da - a (dex cos u + dey sin u)
    along   = a (dalpha + cos i draan) + 2 a (dex sin u - dey cos u)
    across  = a (di sin u - draan cos u sin i)

The nominal contains the short-period terms of J2, Sun and Moon and, where there is a table, the tesserals.  It is moved
to the estimate at every block of fixes, so the deviations stay linear.  A manoeuvre enters a with its commanded size
and adds its uncertainty: nothing is forgotten.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.groundtrack.environment import EPOCH_TAI_S, even_steps
from acu_daemon.groundtrack.gps import FIX_S, FIXES, NOISE_M, STEP_SIGMA_M, Ripple, axes_of, displaced
from acu_daemon.groundtrack.lunisolar import plane_rates
from acu_daemon.groundtrack.mean_elements import MeanElements, states_of
from acu_daemon.groundtrack.reference import ReferenceOrbit
from acu_daemon.units import DAY_S, Array

STEP_S = FIX_S * FIXES
A, EX, EY, TILT, RAAN, ALPHA, RATE = range(7)
BIAS = slice(7, 10)
SIZE = 10
# a priori, 1 sigma: metres where the element is an angle or an eccentricity, times the semi-major axis
FIRST_SIGMA = np.array(
    [100.0, 100.0, 100.0, 200.0, 200.0, 500.0, 20.0 / DAY_S, STEP_SIGMA_M, STEP_SIGMA_M, STEP_SIGMA_M]
)
BIAS_TIME_S = 320.0  # the steps last 480 s on average: the half of the correlation is gone after half of that
RATE_WALK_M_S15 = 3.0 / DAY_S**1.5  # of da/dt: 3 m/day in a day
UNMODELLED_M, UNMODELLED_WITHOUT_M = 25.0, 250.0  # left by the field's model on each axis, with a table and without
WALK_A_M_S05 = 2.0 / DAY_S**0.5  # of the semi-major axis
WALK_M_S05 = 5.0 / DAY_S**0.5  # of the elements, each times a: what the nominal leaves out


@dataclass(frozen=True, slots=True)
class NavigatorSetup:
    """What is known on board: the reference orbit, its node at the start, the tesserals where there is a table."""

    reference: ReferenceOrbit
    node_rad: float
    ripple: Ripple | None = None
    start_tai_s: float = EPOCH_TAI_S


class Navigator:
    """Estimates the mean orbit, block by block.  Mutable; belongs to one loop."""

    def __init__(self, setup: NavigatorSetup) -> None:
        self._setup = setup
        reference = setup.reference
        self._scale = np.ones(SIZE)
        self._scale[EX : ALPHA + 1] = 1.0 / reference.a_m
        # offsets from the reference orbit, in the filter's units: metres, and metres a second for the rate
        self._x = np.zeros(SIZE)
        self._p = np.diag(FIRST_SIGMA**2)
        self._f, self._q = _transition(reference, STEP_S)
        self._block, self._covariances = self._x[None], self._p[None]  # of the last block, for `rewind`

    def manoeuvre(self, delta_a_m: float, sigma_m: float) -> None:
        """A step of the semi-major axis was commanded: it is in the estimate from now on."""
        self._x[A] += delta_a_m
        self._p[A, A] += sigma_m**2

    def observe(self, start_s: float, fixes_m: Array) -> Array:
        """Take a block of fixes, some hours of them, (20 N, 3) TEME in metres, the first 9 s after `start_s`.

        Returns: estimates at start_s + 180 s, + 360 s, ...: (N, 6) offsets of a (m), ex, ey, i, raan and alpha (rad)
                 from the reference orbit.
        """
        times_s = even_steps(start_s + FIX_S, FIX_S, len(fixes_m))
        nominal = self._nominal(start_s, times_s)
        r_m, _ = states_of(nominal)
        if self._setup.ripple is not None:
            r_m = r_m + displaced(nominal, self._setup.ripple.at(times_s))
        missing = fixes_m - r_m
        seen = np.stack([np.sum(missing * axis, axis=1) for axis in axes_of(nominal)], axis=1)
        seen = seen.reshape(-1, FIXES, 3).mean(axis=1)
        middle_s = FIX_S * (FIXES - 1) / 2.0
        ends = slice(FIXES - 1, None, FIXES)
        u = nominal.alpha_rad[ends] - self._setup.reference.alpha_rate_rad_s * middle_s
        at_ends = self._offsets(nominal, times_s, ends)
        deviations = self._filter(seen, _partials(u, self._setup.reference, middle_s))
        estimates: Array = at_ends + deviations[:, :RATE] * self._scale[:RATE]
        self._block = np.hstack([estimates / self._scale[:RATE], deviations[:, RATE:]])
        self._block[:, RATE] += self._x[RATE]
        self.rewind(len(estimates))
        return estimates

    def rewind(self, taken: int) -> None:
        """Go back to where it was after so many steps of the last block."""
        self._x, self._p = self._block[taken - 1].copy(), self._covariances[taken - 1].copy()

    def _nominal(self, start_s: float, times_s: Array) -> MeanElements:
        """The present estimate, propagated; what Sun and Moon do is steady over a block."""
        reference, x = self._setup.reference, self._x * self._scale
        t = times_s - start_s
        zero = np.zeros_like(t)
        sky = self._sky(start_s)
        a = x[A] + x[RATE] * t
        summed = x[A] * t + 0.5 * x[RATE] * t * t
        by_a, by_i = reference.by_a, reference.by_i
        tilted = x[TILT] * t + 0.5 * sky[0] * t * t
        raan = reference.raan_rate_rad_s * times_s + x[RAAN] + by_a.raan * summed + by_i.raan * tilted
        alpha = reference.alpha_rate_rad_s * times_s + x[ALPHA] + by_a.alpha * summed + by_i.alpha * tilted
        return MeanElements(
            reference.a_m + a,
            zero + x[EX],
            zero + reference.e + x[EY],
            reference.i_rad + x[TILT] + sky[0] * t,
            self._setup.node_rad + raan + sky[1] * t,
            alpha + sky[2] * t,
        )

    def _sky(self, time_s: float) -> tuple[float, float, float]:
        """What Sun and Moon add to inclination, node and alpha, rad/s."""
        setup, reference = self._setup, self._setup.reference
        node = setup.node_rad + reference.raan_rate_rad_s * time_s
        rates = plane_rates(np.array([setup.start_tai_s + time_s]), reference.a_m, reference.i_rad, np.array([node]))
        return float(rates.inclination[0]), float(rates.raan[0]), float(rates.alpha[0])

    def _offsets(self, nominal: MeanElements, times_s: Array, at: slice) -> Array:
        reference, t = self._setup.reference, times_s[at]
        base = (
            reference.a_m,
            0.0,
            reference.e,
            reference.i_rad,
            self._setup.node_rad + reference.raan_rate_rad_s * t,
            reference.alpha_rate_rad_s * t,
        )
        now = np.stack([one[at] for one in nominal], axis=1)
        return np.asarray(now - np.stack([zero + np.zeros_like(t) for zero in base], axis=1))

    def _filter(self, seen: Array, partials: Array) -> Array:
        """Deviations from the nominal after each step, (N, 10)."""
        f, q, p = self._f, self._q, self._p
        x = np.zeros(SIZE)
        x[BIAS] = self._x[BIAS]
        left_m = UNMODELLED_WITHOUT_M if self._setup.ripple is None else UNMODELLED_M
        noise = np.eye(3) * (NOISE_M**2 / FIXES + left_m**2)
        one = np.eye(SIZE)
        deviations = np.empty((len(seen), SIZE))
        self._covariances = np.empty((len(seen), SIZE, SIZE))
        for k, h in enumerate(partials):
            x, p = f @ x, f @ p @ f.T + q
            hp = h @ p
            gain = np.linalg.solve(hp @ h.T + noise, hp).T
            x = x + gain @ (seen[k] - h @ x)
            kept = one - gain @ h
            p = kept @ p @ kept.T + gain @ noise @ gain.T  # Joseph: the short form diverges within days
            deviations[k], self._covariances[k] = x, p
        return deviations


def drift_of(reference: ReferenceOrbit, estimates: Array) -> Array:
    """D in metres, (N,), of estimates as `observe` gives them.  Source: Galski and Orlando 2011, eq 1."""
    return reference.drift_m(estimates[:, RAAN], estimates[:, ALPHA])


def _transition(reference: ReferenceOrbit, t: float) -> tuple[Array, Array]:
    """Transition and process noise over a step; angles and eccentricities times a."""
    by_a, by_i, a = reference.by_a, reference.by_i, reference.a_m
    f = np.eye(SIZE)
    f[A, RATE] = t
    for row, per_a, per_i in ((RAAN, by_a.raan, by_i.raan), (ALPHA, by_a.alpha, by_i.alpha)):
        f[row, A], f[row, RATE], f[row, TILT] = per_a * a * t, per_a * a * t * t / 2.0, per_i * t
    fade = np.exp(-t / BIAS_TIME_S)
    f[BIAS, BIAS] = np.eye(3) * fade
    q = np.zeros(SIZE)
    q[EX : ALPHA + 1] = WALK_M_S05**2 * t
    q[A] = WALK_A_M_S05**2 * t
    q[RATE] = RATE_WALK_M_S15**2 * t
    q[BIAS] = STEP_SIGMA_M**2 * (1.0 - fade**2)
    return f, np.diag(q)


def _partials(u: Array, reference: ReferenceOrbit, before_s: float) -> Array:
    """What is seen per unit of the state at the end of the step, (N, 3, 10); the middle lies `before_s` earlier."""
    h = np.zeros((u.size, 3, SIZE))
    c, s = np.cos(u), np.sin(u)
    ci, si = np.cos(reference.i_rad), np.sin(reference.i_rad)
    h[:, 0, A], h[:, 0, EX], h[:, 0, EY] = 1.0, -c, -s
    h[:, 1, ALPHA], h[:, 1, RAAN], h[:, 1, EX], h[:, 1, EY] = 1.0, ci, 2.0 * s, -2.0 * c
    h[:, 1, A] = -(reference.by_a.alpha + ci * reference.by_a.raan) * reference.a_m * before_s
    h[:, 2, TILT], h[:, 2, RAAN] = s, -c * si
    h[:, :, BIAS] = np.eye(3)
    return h
