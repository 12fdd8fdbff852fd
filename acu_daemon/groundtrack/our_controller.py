"""Our controller: a Kalman filter on (D, dD/dt, drag factor), and sizes by what the forecast flux will do.

Between observations D follows  D'' = (1 + f) s(t) + l(t):  s is the drag's acceleration by the polynomials at the flux
of the day, measured or forecast, l that of Sun and Moon, f the share by which this atmosphere and this satellite
differ.  f returns to 0 within months: what is learned at a low flux must not scale the drag of the next maximum.
A manoeuvre of da adds by_a da to dD/dt and its uncertainty to the variance, and nothing is forgotten: the filter knows
dD/dt at once, where a restarted mean needs a day, and f in a few weeks.

The size is the least push w after which the predicted path nowhere comes below a target,
    w = max over tau of [(target - D - g(tau)) / tau] - dD/dt,  g the path that the accelerations make.
The target lies above the lower limit by three sigma of the lowest point: what D, dD/dt and f are uncertain by, carried
that far, and the error of the size, which moves it by w tau.
"""

from dataclasses import dataclass
from math import exp, hypot, sqrt

import numpy as np

from acu_daemon.groundtrack.environment import even_steps, running_integral
from acu_daemon.groundtrack.reference import ReferenceOrbit
from acu_daemon.units import DAY_S, Array

OBSERVATIONS = 20  # averaged: an hour of them
NOISE_M = 20.0  # of that mean: the navigator's errors last longer than an hour
SHARE_SIGMA, SHARE_TIME_S = 0.15, 40.0 * DAY_S  # of f: what models of the atmosphere are worth, and for how long
FIRST_SIGMA = (50.0, 100.0 / DAY_S, SHARE_SIGMA)
RATE_WALK_M_S15 = 0.5 / DAY_S**1.5
EXECUTION_SIGMA = 0.02
MARGIN_SIGMAS = 3.0
DECIDING_SIGMAS = 1.5  # of D, before the upper limit; in a band of kilometres they are nothing
LEAST_MARGIN, LARGEST_MARGIN = 0.1, 0.5  # of the range
_PASSES = 3  # of the size and its margin
FORECAST_STEP_S = 3.0 * 3600.0
FORECAST_S = 120.0 * DAY_S


@dataclass(frozen=True, slots=True)
class Forecast:
    """Acceleration of D at even steps, (N,), m/s2: s of drag for f = 1, and l of Sun and Moon."""

    step_s: float
    drag_m_s2: Array
    lunisolar_m_s2: Array


@dataclass(frozen=True, slots=True)
class OurSettings:
    """Control range; the execution error the sizes allow for; 1 sigma of an hour's mean of D."""

    d_max_m: float
    d_min_m: float
    execution_sigma: float = EXECUTION_SIGMA
    noise_m: float = NOISE_M


class DriftFilter:
    """State (D, dD/dt, f) and its covariance (3, 3), at a step of the forecast.  Mutable; belongs to one owner."""

    def __init__(
        self,
        forecast: Forecast,
        first_sigma: tuple[float, float, float] = FIRST_SIGMA,
        share_time_s: float = SHARE_TIME_S,
    ) -> None:
        """Begin at zero with these sigmas of D (m), dD/dt (m/s) and f; f returns to 0 with the time given."""
        self.forecast = forecast
        self.state = np.zeros(3)
        self.covariance = np.diag(np.square(first_sigma))
        self._share_sigma, self._share_time_s = first_sigma[2], share_time_s
        self._speed = [running_integral(one, forecast.step_s) for one in (forecast.drag_m_s2, forecast.lunisolar_m_s2)]
        self._path = [running_integral(one, forecast.step_s) for one in self._speed]

    def path(self, start: int, steps: Array) -> tuple[Array, Array]:
        """What drag with f = 0, and Sun and Moon add to D from a step on, from rest, (M,) each."""
        elapsed_s = (steps - start) * self.forecast.step_s
        made = [
            path[steps] - path[start] - speed[start] * elapsed_s
            for path, speed in zip(self._path, self._speed, strict=True)
        ]
        return made[0], made[1]

    def advance(self, start: int, end: int) -> None:
        """Predict from a step to a later one."""
        t = (end - start) * self.forecast.step_s
        drag_m, sky_m = (float(one[0]) for one in self.path(start, np.array([end])))
        drag_m_s, sky_m_s = (float(speed[end] - speed[start]) for speed in self._speed)
        fade = exp(-t / self._share_time_s)
        f = np.array([[1.0, t, drag_m], [0.0, 1.0, drag_m_s], [0.0, 0.0, fade]])
        self.state = f @ self.state + np.array([drag_m + sky_m, drag_m_s + sky_m_s, 0.0])
        walk = RATE_WALK_M_S15**2 * t
        noise = np.diag([walk * t * t / 3.0, walk, self._share_sigma**2 * (1.0 - fade**2)])
        noise[0, 1] = noise[1, 0] = walk * t / 2.0
        self.covariance = f @ self.covariance @ f.T + noise

    def update(self, d_m: float, sigma_m: float) -> None:
        """Take an observation of D."""
        gain = self.covariance[:, 0] / (self.covariance[0, 0] + sigma_m**2)
        self.state = self.state + gain * (d_m - self.state[0])
        kept = np.eye(3)
        kept[:, 0] -= gain
        self.covariance = kept @ self.covariance @ kept.T + np.outer(gain, gain) * sigma_m**2

    def push(self, change_m_s: float, sigma_m_s: float) -> None:
        """A manoeuvre changed dD/dt by so much."""
        self.state[1] += change_m_s
        self.covariance[1, 1] += sigma_m_s**2

    def coming(self, start: int) -> tuple[Array, Array]:
        """Seconds after the step `start` and the predicted D there, if nobody steers; (M,) each."""
        forecast = self.forecast
        stride = max(1, round(FORECAST_STEP_S / forecast.step_s))
        last = min(forecast.drag_m_s2.size - 1, start + round(FORECAST_S / forecast.step_s))
        steps = np.arange(start, last + 1, stride)
        elapsed_s = even_steps(0.0, stride * forecast.step_s, steps.size)
        d_m, rate_m_s, share = self.state
        drag = forecast.drag_m_s2[steps] * (1.0 + share * np.exp(-elapsed_s / self._share_time_s))
        made_m = running_integral(
            running_integral(drag + forecast.lunisolar_m_s2[steps], stride * forecast.step_s), stride * forecast.step_s
        )
        return elapsed_s[1:], (d_m + rate_m_s * elapsed_s + made_m)[1:]

    def sigma_m(self, start: int, tau_s: float) -> float:
        """1 sigma of the predicted D a time after the step `start`."""
        end = min(start + round(tau_s / self.forecast.step_s), self.forecast.drag_m_s2.size - 1)
        drag_m = float(self.path(start, np.array([end]))[0][0])
        of_state = np.array([1.0, tau_s, drag_m])
        return float(np.sqrt(of_state @ self.covariance @ of_state))


class OurController:
    """Decides once an hour.  Mutable; belongs to one loop."""

    def __init__(self, settings: OurSettings, reference: ReferenceOrbit, forecast: Forecast) -> None:
        self._settings, self._reference = settings, reference
        self.filter = DriftFilter(forecast)
        self._at = 0
        self._waiting: list[float] = []

    def observe(self, step: int, d_m: float) -> float:
        """Take the observation of a step; the size of the manoeuvre to make now in metres, 0 for none."""
        self._waiting.append(d_m)
        if len(self._waiting) < OBSERVATIONS:
            return 0.0
        middle = step - OBSERVATIONS // 2
        self.filter.advance(self._at, middle)
        self.filter.update(sum(self._waiting) / OBSERVATIONS, self._settings.noise_m)
        self.filter.advance(middle, step)
        self._waiting, self._at = [], step
        return self._decide(step)

    def _decide(self, step: int) -> float:
        settings = self._settings
        d_m, rate_m_s, _ = self.filter.state
        next_m = d_m + rate_m_s * OBSERVATIONS * self.filter.forecast.step_s
        sigma_m = DECIDING_SIGMAS * sqrt(self.filter.covariance[0, 0])
        if max(d_m, next_m) < settings.d_max_m - sigma_m or rate_m_s <= 0.0:
            return 0.0
        size_m = self._push_m_s(step) / self._reference.by_a.drift
        if size_m <= 0.0:
            return 0.0
        change_m_s = self._reference.by_a.drift * size_m
        self.filter.push(change_m_s, settings.execution_sigma * abs(change_m_s))
        return size_m

    def _push_m_s(self, step: int) -> float:
        """The change of dD/dt, negative, after which D comes down to three sigma above the lower limit; 0 for none."""
        settings = self._settings
        elapsed_s, path_m = self.filter.coming(step)
        if not elapsed_s.size:
            return 0.0
        span_m, margin, push_m_s = settings.d_max_m - settings.d_min_m, LEAST_MARGIN, 0.0
        for _ in range(_PASSES):
            needed = (settings.d_min_m + margin * span_m - path_m) / elapsed_s
            lowest = int(np.argmax(needed))
            push_m_s, tau_s = float(needed[lowest]), float(elapsed_s[lowest])
            sigma_m = hypot(self.filter.sigma_m(step, tau_s), settings.execution_sigma * push_m_s * tau_s)
            margin = min(max(MARGIN_SIGMAS * sigma_m / span_m, LEAST_MARGIN), LARGEST_MARGIN)
        return push_m_s
