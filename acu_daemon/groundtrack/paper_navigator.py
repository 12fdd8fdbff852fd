"""The simplified navigator of Galski and Orlando 2011 (Galski et al. 2001): an extended Kalman filter at each fix.

State: position and velocity (TEME) and the systematic error of the receiver's position, which is constant but for a
random walk.  Dynamics: the point mass and J2, by one Runge-Kutta step from fix to fix; what they leave out, above all
the tesserals, is noise of the acceleration.  The fixes' positions alone are observed.
"""

import numpy as np

from acu_daemon.groundtrack.environment import even_steps
from acu_daemon.groundtrack.gps import FIX_S, FIXES, NOISE_M, STEP_SIGMA_M
from acu_daemon.groundtrack.mean_elements import MeanElements, mean_of, states_of
from acu_daemon.groundtrack.navigator import NavigatorSetup
from acu_daemon.groundtrack.reference import tangential_m_s
from acu_daemon.units import EARTH_EQUATORIAL_RADIUS_M, J2, MU_M3_S2, Array

ACCELERATION_M_S15 = (
    1e-3  # white noise of the acceleration; with a tenth of it the estimate is hardly better than raw fixes
)
BIAS_TIME_S = 320.0
FIRST_SIGMA = np.array([500.0] * 3 + [1.0] * 3 + [STEP_SIGMA_M] * 3)
_R, _V, _B = slice(0, 3), slice(3, 6), slice(6, 9)


class PaperNavigator:
    """Estimates the osculating orbit fix by fix.  Mutable; belongs to one loop."""

    def __init__(self, setup: NavigatorSetup, *, has_bias: bool = True) -> None:
        """Take the reference orbit; without `has_bias` the state is the orbit alone."""
        self._setup = setup
        reference = setup.reference
        start = (reference.a_m, 0.0, reference.e, reference.i_rad, setup.node_rad, 0.0)
        r_m, v_m_s = states_of(MeanElements(*(np.array([one]) for one in start)))
        self._x = np.concatenate([r_m[0], v_m_s[0], np.zeros(3)])
        self._p = np.diag(FIRST_SIGMA**2)
        fade = np.exp(-FIX_S / BIAS_TIME_S)
        q = np.zeros((9, 9))
        walk = ACCELERATION_M_S15**2 * FIX_S
        q[_R, _R], q[_V, _V] = np.eye(3) * walk * FIX_S**2 / 3.0, np.eye(3) * walk
        q[_R, _V] = q[_V, _R] = np.eye(3) * walk * FIX_S / 2.0
        if has_bias:
            q[_B, _B] = np.eye(3) * STEP_SIGMA_M**2 * (1.0 - fade**2)
        else:
            self._p[_B, _B] = 0.0
        self._q, self._fade = q, fade
        self._h = np.hstack([np.eye(3), np.zeros((3, 3)), np.eye(3)])
        noise_m2 = NOISE_M**2 + (0.0 if has_bias else STEP_SIGMA_M**2)
        self._noise = np.eye(3) * noise_m2
        self._block = [(self._x, self._p)]
        self._states = self._x[None]

    @property
    def states(self) -> Array:
        """Estimated positions and velocities (N, 6) after each fix of the last block."""
        return self._states

    def manoeuvre(self, delta_a_m: float, sigma_m: float) -> None:
        """A step of the semi-major axis was commanded."""
        speed = np.linalg.norm(self._x[_V])
        along = self._x[_V] / speed
        reference = self._setup.reference
        self._x = self._x.copy()
        self._x[_V] += tangential_m_s(reference, delta_a_m) * along
        self._p = self._p.copy()
        self._p[_V, _V] += np.outer(along, along) * tangential_m_s(reference, sigma_m) ** 2

    def rewind(self, taken: int) -> None:
        """Go back to where it was after so many steps of the last block."""
        self._x, self._p = self._block[taken - 1]

    def observe(self, start_s: float, fixes_m: Array) -> Array:
        """Take fixes, (20 N, 3) TEME in metres; estimates after each 20, (N, 6), as `Navigator.observe` gives them."""
        states = np.empty((len(fixes_m), 6))
        self._block = []
        for k, fix_m in enumerate(fixes_m):
            self._advance()
            self._update(fix_m)
            states[k] = self._x[:6]
            if (k + 1) % FIXES == 0:
                self._block.append((self._x, self._p))
        self._states = states
        times_s = even_steps(start_s + FIX_S * FIXES, FIX_S * FIXES, len(self._block))
        return offsets_of(self._setup, times_s, states[FIXES - 1 :: FIXES])

    def _advance(self) -> None:
        r, v = self._x[_R], self._x[_V]
        h = FIX_S
        k1 = _acceleration(r)
        k2 = _acceleration(r + 0.5 * h * v + 0.125 * h * h * k1)
        k3 = _acceleration(r + h * v + 0.5 * h * h * k2)  # Nystrom's three stages for r'' = f(r)
        f = _transition(r, h)
        x = np.empty(9)
        x[_R] = r + h * v + h * h / 6.0 * (k1 + 2.0 * k2)
        x[_V] = v + h / 6.0 * (k1 + 4.0 * k2 + k3)
        x[_B] = self._x[_B] * self._fade
        f[_B, _B] *= self._fade
        self._x, self._p = x, f @ self._p @ f.T + self._q

    def _update(self, fix_m: Array) -> None:
        h, p = self._h, self._p
        hp = h @ p
        gain = np.linalg.solve(hp @ h.T + self._noise, hp).T
        kept = np.eye(9) - gain @ h
        self._x = self._x + gain @ (fix_m - h @ self._x)
        self._p = kept @ p @ kept.T + gain @ self._noise @ gain.T


def offsets_of(setup: NavigatorSetup, times_s: Array, states: Array) -> Array:
    """Offsets of the mean elements from the reference orbit, (N, 6), of states (N, 6) at seconds since the start."""
    mean = mean_of(states[:, :3], states[:, 3:])
    reference = setup.reference
    raan = mean.raan_rad - (setup.node_rad + reference.raan_rate_rad_s * times_s)
    alpha = mean.alpha_rad - reference.alpha_rate_rad_s * times_s
    offsets = [mean.a_m - reference.a_m, mean.ex, mean.ey - reference.e, mean.i_rad - reference.i_rad]
    offsets += [np.remainder(angle + np.pi, 2.0 * np.pi) - np.pi for angle in (raan, alpha)]
    return np.stack(offsets, axis=1)


def _acceleration(r_m: Array) -> Array:
    """Point mass and J2, m/s2."""
    x, y, z = r_m.tolist()
    r2 = x * x + y * y + z * z
    pull = -MU_M3_S2 / (r2 * r2**0.5)
    flat = 1.5 * J2 * EARTH_EQUATORIAL_RADIUS_M**2 / r2
    slope = 5.0 * z * z / r2
    plane = pull * (1.0 + flat * (1.0 - slope))
    return np.array([plane * x, plane * y, pull * (1.0 + flat * (3.0 - slope)) * z])


def _transition(r_m: Array, h: float) -> Array:
    """Of the point mass, to the second order in the step."""
    r2 = float(r_m @ r_m)
    gradient = MU_M3_S2 / r2**1.5 * (3.0 * np.outer(r_m, r_m) / r2 - np.eye(3))
    f = np.eye(9)
    f[_R, _R] += 0.5 * h * h * gradient
    f[_R, _V] = np.eye(3) * h
    f[_V, _R] = h * gradient
    f[_V, _V] += 0.5 * h * h * gradient
    return f
