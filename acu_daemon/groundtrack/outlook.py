"""From a real satellite's D to its drag factor and the date of its next manoeuvre.

The filter of `our_controller` runs over the history, manoeuvres found in it included, and looks ahead from its end.
"""

from dataclasses import dataclass

import numpy as np

from acu_daemon.groundtrack.environment import Flux, Spacecraft, free_motion
from acu_daemon.groundtrack.history import History
from acu_daemon.groundtrack.kinks import FoundManoeuvre
from acu_daemon.groundtrack.our_controller import FORECAST_S, DriftFilter, Forecast
from acu_daemon.units import DAY_S, Array

STEP_S = 3600.0
FIRST_RATE_SIGMA_M_S = 1000.0 / DAY_S
SHARE_SIGMA, SHARE_TIME_S = 1.0, 365.0 * DAY_S  # the area and mass of a foreign satellite are guessed


@dataclass(frozen=True, slots=True)
class Outlook:
    """What is known at the last point, 1 sigma beside each, and what D will do, if nobody steers.

    drag_factor: real drag over that of the ballistic coefficient and flux given.
    next_tai_s: when D reaches `limit_m`; None: not within the forecast, or no limit is known.
    """

    tai_s: float
    d_m: float
    d_sigma_m: float
    rate_m_day: float
    rate_sigma_m_day: float
    drag_factor: float
    drag_factor_sigma: float
    limit_m: float | None
    next_tai_s: float | None
    next_sigma_days: float
    ahead_tai_s: Array
    ahead_m: Array


def outlook(
    craft: Spacecraft,
    flux: Flux,
    history: History,
    sigma_m: Array,
    manoeuvres: list[FoundManoeuvre],
    limit_m: float | None = None,
) -> Outlook:
    """Filter the points, (N,) with their sigmas, and look ahead.

    limit_m: the D at which the next manoeuvre is made; by default where the last ones up were made.
    """
    start_s = float(history.tai_s[0])
    days = (float(history.tai_s[-1]) - start_s + FORECAST_S) / DAY_S + 2.0
    free = free_motion(craft, days, flux, start_tai_s=start_s, step_s=STEP_S, has_semi_annual=True)
    drift = DriftFilter(
        Forecast(STEP_S, free.drag_m_s2, free.lunisolar_m_s2),
        (float(sigma_m[0]), FIRST_RATE_SIGMA_M_S, SHARE_SIGMA),
        SHARE_TIME_S,
    )
    drift.state[0] = history.d_m[0]
    steps = np.round((history.tai_s - start_s) / STEP_S).astype(int)
    pushes = {round((one.tai_s - start_s) / STEP_S): one for one in manoeuvres}
    at = 0
    for step, d_m, sigma in zip(steps.tolist()[1:], history.d_m.tolist()[1:], sigma_m.tolist()[1:], strict=True):
        for push_step in sorted(one for one in pushes if at < one <= step):
            drift.advance(at, push_step)
            at, push = push_step, pushes[push_step]
            per_m = craft.reference.by_a.drift
            drift.push(per_m * push.delta_a_m, abs(per_m) * max(3.0 * push.sigma_m, 0.05 * abs(push.delta_a_m)))
        if step > at:
            drift.advance(at, step)
            at = step
        drift.update(d_m, sigma)
    limit = _usual_limit_m(history, manoeuvres) if limit_m is None else limit_m
    return _looked_ahead(drift, at, start_s, limit)


def _usual_limit_m(history: History, manoeuvres: list[FoundManoeuvre]) -> float | None:
    """D where the manoeuvres up were made, the last three on average; None: there was none."""
    up = [one for one in manoeuvres if one.delta_a_m > 0.0][-3:]
    if not up:
        return None
    return float(np.mean([np.interp(one.tai_s, history.tai_s, history.d_m) for one in up]))


def _looked_ahead(drift: DriftFilter, at: int, start_s: float, limit_m: float | None) -> Outlook:
    d_m, rate_m_s, share = drift.state.tolist()
    sigmas = np.sqrt(np.diag(drift.covariance)).tolist()
    elapsed_s, path_m = drift.coming(at)
    now_s = start_s + at * STEP_S
    next_tai_s, next_sigma_days = None, 0.0
    if limit_m is not None and elapsed_s.size:
        beyond = np.flatnonzero(path_m >= limit_m)
        if d_m >= limit_m:
            next_tai_s = now_s
        elif beyond.size:
            k = int(beyond[0])
            before_s, before_m = (float(elapsed_s[k - 1]), float(path_m[k - 1])) if k else (0.0, d_m)
            slope = (float(path_m[k]) - before_m) / (float(elapsed_s[k]) - before_s)
            reached_s = before_s + (limit_m - before_m) / slope
            next_tai_s = now_s + reached_s
            next_sigma_days = drift.sigma_m(at, reached_s) / slope / DAY_S
    return Outlook(
        tai_s=now_s,
        d_m=d_m,
        d_sigma_m=sigmas[0],
        rate_m_day=rate_m_s * DAY_S,
        rate_sigma_m_day=sigmas[1] * DAY_S,
        drag_factor=1.0 + share,
        drag_factor_sigma=sigmas[2],
        limit_m=limit_m,
        next_tai_s=next_tai_s,
        next_sigma_days=next_sigma_days,
        ahead_tai_s=now_s + elapsed_s,
        ahead_m=path_m,
    )
