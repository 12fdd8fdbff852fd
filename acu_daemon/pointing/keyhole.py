"""The way through the keyhole: a path the drives can follow where the azimuth of the true one is too fast.  Pure.

Near the zenith the azimuth of a pass turns by nearly half a turn in less time than its drive needs.  The antenna then
leaves the path before culmination, turns at nearly its full rate, and comes back onto path and rate after it.  One
number is free: when it departs.  From there it speeds up, cruises and brakes with MARGIN of its limits, and comes back
at the first instant at which that leads onto path and rate.  Meanwhile the elevation stands at the point of the
antenna's own meridian that is nearest to the satellite, which costs nothing: with d the azimuth that is missing,

    el' = atan2(sin el, cos el cos d), at most the axis's limit;  error = asin(cos el |sin d|) for d up to 90 deg.

Each departure has a largest error, which depends on how the way lies about culmination, and seconds out of the beam.
They have their least at different departures: seconds alone would keep the antenna in the beam until after culmination
and lose all on one side, with errors up to 1.9 times larger, among the side lobes, and more of them where the path is a
little wrong.  So the largest error decides unless it is asked otherwise (docs/pass-plan.md, The zenith).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from acu_daemon.model import AxisLimits, ZenithCrossing
from acu_daemon.pointing.axis import AxisState, step
from acu_daemon.pointing.plunge import Branches, Over, way_over
from acu_daemon.units import Array

MARGIN = 0.98  # of the drive's rate and acceleration: with all of them the servo falls behind, less costs beam
SAFE_BEAM, SAFE_SHARE = 0.9, 0.25  # where seconds decide, those beyond this share of half a beam count so much more
SURE_GAIN = 0.8  # of the largest error of a way in hand: a better one close before the zenith has to be so much better
LEAST_GAIN_DEG = 0.05
NEAR_STEPS = 20
SIDE_STEPS = 120
LEAST_TURN_DEG = 120.0  # of a path past the zenith, for the azimuth to go the other way round
LATE_S = 0.5  # a departure that is chosen anew is at least so far ahead
COARSE_STEPS, MOST_STARTS = 4, 80  # half steps from departure to departure in the first look, and how many at most
TAKEOVER_RATES = 1.2  # of the drive's rate: what autotrack cannot follow
LEAST_AHEAD_S = 2.0  # a way of a slow path, or a fast drive, takes longer than its half turn

Objective = Literal["largest_error", "seconds"]


@dataclass(frozen=True, slots=True)
class SkyPath:
    """Directions at even steps, encoder frame, azimuth continuous: degrees, degrees a second, (N,)."""

    az_deg: Array
    el_deg: Array
    az_rate_deg_s: Array
    el_rate_deg_s: Array
    step_s: float


@dataclass(frozen=True, slots=True)
class KeyholeRules:
    """What the antenna can do, and what counts as better.

    may_plunge: its elevation reaches as far beyond the zenith as a pass is high before it.
    """

    azimuth: AxisLimits
    max_el_deg: float = 90.0
    may_plunge: bool = False
    half_beam_deg: float = 0.5
    objective: Objective = "largest_error"


@dataclass(frozen=True, slots=True)
class Begun:
    """A way in hand: where it departs from, and the time now; all in seconds from the path's start."""

    departure_s: float
    az_deg: float
    az_rate_deg_s: float
    now_s: float
    plunge_to_s: float | None = None  # over the top: its return; None: it goes round


@dataclass(frozen=True, slots=True)
class _Ways:
    """Departures that lead back onto the path, one a row: time, place, rate, the sample of the return, cruise rate.

    Azimuths and rates as if the path turned to the right.
    """

    from_s: Array
    az_deg: Array
    rate_deg_s: Array
    to: npt.NDArray[np.int64]
    cruise_deg_s: Array


def longest_window_s(azimuth: AxisLimits) -> float:
    """Bound the seconds a half turn takes: a path that starts this much before now has its whole window in sight."""
    rate, acceleration = MARGIN * azimuth.max_rate_deg_s, MARGIN * azimuth.max_acceleration_deg_s2
    return 180.0 / rate + 2.0 * rate / acceleration + LEAST_AHEAD_S


def follow_path(
    path: SkyPath, rules: KeyholeRules, begun: Begun | None = None, plunged: tuple[Array, Array] | None = None
) -> tuple[SkyPath, ZenithCrossing | None]:
    """Give the path that the antenna can follow, and how it crosses the keyhole.

    The path itself, and None, where azimuth rate and acceleration lie within the drive's.  begun: the way that the
    antenna is on, or is about to go: it is gone on with, so that a path which a fit has moved makes no jump, unless
    the antenna has not departed and another way is better for sure.  Where nothing leads back onto the path before it
    ends, it is chased.  The times of the crossing count from the path's start.  plunged: azimuth and elevation of the
    same path for a plunged antenna, where one may be; where that is better than the way round, it is what is followed
    from the zenith on.
    """
    over = None if plunged is None else _over(path, plunged, rules, begun)
    if over is not None and begun is not None:
        return _followed(over, path.step_s)
    beyond = _beyond(path, rules.azimuth)
    if beyond.size == 0:
        return path, None
    followed, crossing = _round(path, rules, begun, beyond)
    if over is None or crossing is None or over.crossing.largest_error_deg >= crossing.largest_error_deg:
        return followed, crossing
    return _followed(over, path.step_s)


def _over(path: SkyPath, plunged: tuple[Array, Array], rules: KeyholeRules, begun: Begun | None) -> Over | None:
    """The way over the top, where the one in hand is it, or where none is in hand and autotrack cannot follow."""
    branches = Branches(path.az_deg, path.el_deg, path.az_rate_deg_s, path.el_rate_deg_s, *plunged, path.step_s)
    if begun is not None:
        if begun.plunge_to_s is None:
            return None
        in_hand = (begun.departure_s, begun.plunge_to_s, begun.az_deg, begun.az_rate_deg_s)
        return way_over(branches, rules.azimuth, rules.half_beam_deg, in_hand)
    is_too_fast = float(np.abs(path.az_rate_deg_s).max()) > TAKEOVER_RATES * rules.azimuth.max_rate_deg_s
    return way_over(branches, rules.azimuth, rules.half_beam_deg) if is_too_fast else None


def _followed(over: Over, step_s: float) -> tuple[SkyPath, ZenithCrossing]:
    return SkyPath(over.az_deg, over.el_deg, over.az_rate_deg_s, over.el_rate_deg_s, step_s), over.crossing


def _round(
    path: SkyPath, rules: KeyholeRules, begun: Begun | None, beyond: npt.NDArray[np.int64]
) -> tuple[SkyPath, ZenithCrossing]:
    """The way round, by a half turn of the azimuth.  beyond: the samples that the drive cannot follow."""
    fastest = int(np.argmax(np.abs(path.az_rate_deg_s)))
    by_deg = path.az_deg[min(fastest + NEAR_STEPS, path.az_deg.size - 1)] - path.az_deg[max(fastest - NEAR_STEPS, 0)]
    sign = 1.0 if by_deg >= 0.0 else -1.0  # not the rate's, where the azimuth goes the other way round
    turned = SkyPath(sign * path.az_deg, path.el_deg, sign * path.az_rate_deg_s, path.el_rate_deg_s, path.step_s)
    best, begun_way = _search(turned, rules, int(beyond[0]), fastest), None
    if begun is not None:
        state = (np.array([begun.departure_s]), np.array([sign * begun.az_deg]), np.array([sign * begun.az_rate_deg_s]))
        begun_way = _best(turned, rules, _ways_from(turned, rules, *state, int(beyond[0]), fastest))
    followed = _chosen(turned, rules, best, begun_way, begun)
    if followed is None:
        az, rate = _chase(path.az_deg, path.az_rate_deg_s, path.step_s, rules.azimuth)
        window = (beyond[0] * path.step_s, (path.az_deg.size - 1) * path.step_s)
        start = (float(az[int(beyond[0])]), float(rate[int(beyond[0])]))
    else:
        window, (start_az, start_rate), turned_az, turned_rate = followed
        az, rate, start = sign * turned_az, sign * turned_rate, (sign * start_az, sign * start_rate)
    return _result(path, rules, az, rate, window, start)


def turned_past_zenith(az_deg: Array, az_rate_deg_s: Array, sign: int) -> Array:
    """The same directions with an azimuth that rises (sign 1) or falls (-1) past the zenith.

    A path that does not come so near to it that both ways are half a turn is left as it is.  (N,), continuous but for
    the sample after the fastest, where the other way begins.
    """
    top = int(np.argmax(np.abs(az_rate_deg_s)))
    first, last = max(top - SIDE_STEPS, 0), min(top + SIDE_STEPS, az_deg.size - 1)
    turned_deg = float(az_deg[last] - az_deg[first])
    if turned_deg * sign >= 0.0 or abs(turned_deg) < LEAST_TURN_DEG:
        return az_deg
    turned = az_deg.copy()
    middle = first + int(np.argmax(np.abs(az_deg[first : last + 1] - az_deg[first]) >= abs(turned_deg) / 2.0))
    turned[middle:] += 360.0 * sign
    return turned


def _beyond(path: SkyPath, azimuth: AxisLimits) -> npt.NDArray[np.int64]:
    is_beyond = np.abs(path.az_rate_deg_s) > azimuth.max_rate_deg_s
    acceleration = np.abs(np.diff(path.az_rate_deg_s)) / path.step_s
    is_beyond[:-1] |= acceleration > azimuth.max_acceleration_deg_s2
    return np.flatnonzero(is_beyond)


def _search(path: SkyPath, rules: KeyholeRules, first: int, fastest: int) -> "_Best | None":
    """The best way from a half turn before culmination to the first instant beyond the drive: coarsely, then closely.

    Departures stand on the half steps of the path's own times, so that the next buffer finds the same.
    """
    begin_s, end_s = max(fastest * path.step_s - longest_window_s(rules.azimuth), 0.0), first * path.step_s
    half_s, most = path.step_s / 2.0, MARGIN * rules.azimuth.max_rate_deg_s
    found: _Best | None = None
    for apart in (max(COARSE_STEPS, round((end_s - begin_s) / half_s / MOST_STARTS)), 1):
        if found is not None:
            at_s, wide_s = float(found[0].from_s[0]), COARSE_STEPS * half_s
            begin_s, end_s = max(at_s - wide_s, begin_s), min(at_s + wide_s, end_s)
        steps = np.arange(round(end_s / half_s), round(begin_s / half_s) - 1, -apart)[::-1]
        from_s: Array = half_s * steps.astype(np.float64)
        az_deg, rate_deg_s = _interpolated(path, from_s)
        can = np.abs(rate_deg_s) <= most
        ways = _ways_from(path, rules, from_s[can], az_deg[can], rate_deg_s[can], first, fastest)
        found = _best(path, rules, ways) or found
    return found


def _interpolated(path: SkyPath, at_s: Array) -> tuple[Array, Array]:
    """Cubic Hermite azimuth and rate at times within the path."""
    x = at_s / path.step_s
    i = np.clip(x.astype(np.int64), 0, path.az_deg.size - 2)
    u, h = x - i, path.step_s
    y0, y1, d0, d1 = path.az_deg[i], path.az_deg[i + 1], path.az_rate_deg_s[i] * h, path.az_rate_deg_s[i + 1] * h
    a, b = 2 * (y0 - y1) + d0 + d1, 3 * (y1 - y0) - 2 * d0 - d1
    return ((a * u + b) * u + d0) * u + y0, ((3 * a * u + 2 * b) * u + d0) / h


def _ways_from(
    path: SkyPath, rules: KeyholeRules, from_s: Array, az_deg: Array, rate_deg_s: Array, first: int, fastest: int
) -> _Ways:
    """For each departure the first return after the path has overtaken the antenna; those that have none are left out.

    first, fastest: the samples at which the path leaves what the drive can do, and is fastest.

    In a time T an axis that begins with r0 and ends with r1 comes at most c T - ((c - r0)^2 + (c - r1)^2) / (2 A) far,
    with c the lesser of its full rate and (r0 + r1 + A T) / 2.  Where that is first as far as the path again, it meets
    the path and its rate; c is then made a little less, so that it does so at a sample.
    """
    most, a = MARGIN * rules.azimuth.max_rate_deg_s, MARGIN * rules.azimuth.max_acceleration_deg_s2
    span = round(longest_window_s(rules.azimuth) / path.step_s)
    begin = max(int(from_s.min() / path.step_s), 0) if from_s.size else 0
    k = np.arange(begin, min(fastest + span, path.az_deg.size))
    time_s = k * path.step_s - from_s[:, None]
    r0, r1 = rate_deg_s[:, None], path.az_rate_deg_s[k]
    c = np.minimum(most, (r0 + r1 + a * time_s) / 2.0)
    ahead_deg = c * time_s - ((c - r0) ** 2 + (c - r1) ** 2) / (2.0 * a) - (path.az_deg[k] - az_deg[:, None])
    is_behind = (ahead_deg < 0.0) & (time_s > 0.0) & (k >= first)  # not what a fit has moved a way in hand beside
    is_back = np.maximum.accumulate(is_behind, axis=1) & (ahead_deg >= 0.0) & (r1 <= c) & (r0 <= c)
    has_return = is_back.any(axis=1)
    to = k[np.argmax(is_back, axis=1)][has_return]
    from_s, az_deg, rate_deg_s = from_s[has_return], az_deg[has_return], rate_deg_s[has_return]
    return _Ways(from_s, az_deg, rate_deg_s, to, _cruise_deg_s(path, from_s, az_deg, rate_deg_s, to, a))


def _cruise_deg_s(path: SkyPath, from_s: Array, az_deg: Array, r0: Array, to: npt.NDArray[np.int64], a: float) -> Array:
    """The cruise rate that leads from place and rate onto a sample of the path and its rate."""
    span_s, r1 = to * path.step_s - from_s, path.az_rate_deg_s[to]
    b = r0 + r1 + a * span_s
    inside = b * b - 2.0 * (r0 * r0 + r1 * r1) - 4.0 * a * (path.az_deg[to] - az_deg)
    cruise: Array = (b - np.sqrt(np.maximum(inside, 0.0))) / 2.0
    return np.maximum(cruise, np.maximum(r0, r1))


def _profiles(path: SkyPath, ways: _Ways, a: float, k: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Azimuth and rate of every way at the samples k, both (ways, k); the path's own outside of its window."""
    t = k * path.step_s - ways.from_s[:, None]
    left_s = (ways.to * path.step_s)[:, None] - k * path.step_s
    r0, r1, c = ways.rate_deg_s[:, None], path.az_rate_deg_s[ways.to][:, None], ways.cruise_deg_s[:, None]
    up_s, down_s = (c - r0) / a, (c - r1) / a
    before = np.clip(up_s - t, 0.0, None)
    after = np.clip(down_s - left_s, 0.0, None)
    az = ways.az_deg[:, None] - (c - r0) / 2.0 * up_s + c * t + a / 2.0 * before**2 - a / 2.0 * after**2
    rate = c - a * before - a * after
    is_in = (t > 1e-9) & (left_s > 1e-9)
    return np.where(is_in, az, path.az_deg[k]), np.where(is_in, rate, path.az_rate_deg_s[k])


_Best = tuple[_Ways, float]  # one way, and its largest error
_Chosen = tuple[tuple[float, float], tuple[float, float], Array, Array]


def _chosen(
    path: SkyPath, rules: KeyholeRules, best: _Best | None, kept: _Best | None, begun: Begun | None
) -> _Chosen | None:
    """Window, place and rate of the departure, and azimuth and rate of the way that is taken; None: there is none."""
    if begun is not None and kept is not None:
        is_sure = (
            best is not None
            and begun.now_s + LATE_S <= min(best[0].from_s[0], begun.departure_s)
            and best[1] < SURE_GAIN * kept[1] - LEAST_GAIN_DEG
        )
        best = best if is_sure else kept
    if best is None:
        return None
    way = best[0]
    a = MARGIN * rules.azimuth.max_acceleration_deg_s2
    az, rate = _profiles(path, way, a, np.arange(path.az_deg.size))
    window = (float(way.from_s[0]), float(way.to[0]) * path.step_s)
    return window, (float(way.az_deg[0]), float(way.rate_deg_s[0])), az[0], rate[0]


def _best(path: SkyPath, rules: KeyholeRules, ways: _Ways) -> _Best | None:
    """The way with the least of what is asked for, the latest of those as good, and its largest error."""
    if ways.from_s.size == 0:
        return None
    k = np.arange(int(ways.from_s.min() / path.step_s), int(ways.to.max()) + 1)
    az, _ = _profiles(path, ways, MARGIN * rules.azimuth.max_acceleration_deg_s2, k)
    error_deg = off_deg(az, path.az_deg[k], path.el_deg[k], rules.max_el_deg)[1]
    largest = error_deg.max(axis=1)
    if rules.objective == "seconds":
        out = (error_deg > rules.half_beam_deg).sum(axis=1) + SAFE_SHARE * (
            error_deg > SAFE_BEAM * rules.half_beam_deg
        ).sum(axis=1)
        good = np.flatnonzero(out <= out.min() + 0.5)
        chosen = int(good[-1]) if out.min() > 0.0 else int(good[np.argmin(largest[good])])
    else:
        chosen = int(np.flatnonzero(largest <= largest.min() + 1e-9)[-1])
    one = slice(chosen, chosen + 1)
    only = _Ways(ways.from_s[one], ways.az_deg[one], ways.rate_deg_s[one], ways.to[one], ways.cruise_deg_s[one])
    return only, float(largest[chosen])


def off_deg(antenna_az_deg: Array, az_deg: Array, el_deg: Array, max_el_deg: float) -> tuple[Array, Array]:
    """The elevation of an antenna's meridian that is nearest to a direction, and how far off it is on the sky.

    Azimuths and elevation () or (N,), degrees; any broadcast of them.
    """
    missing, el = np.radians(antenna_az_deg - az_deg), np.radians(el_deg)
    nearest_el = np.minimum(np.arctan2(np.sin(el), np.cos(el) * np.cos(missing)), np.radians(max_el_deg))
    cos_off = np.sin(nearest_el) * np.sin(el) + np.cos(nearest_el) * np.cos(el) * np.cos(missing)
    across = np.cos(el) * np.sin(missing)
    along = np.cos(nearest_el) * np.sin(el) - np.sin(nearest_el) * np.cos(el) * np.cos(missing)
    return np.degrees(nearest_el), np.degrees(np.arctan2(np.hypot(across, along), cos_off))


def _result(
    path: SkyPath,
    rules: KeyholeRules,
    az: Array,
    rate: Array,
    window_s: tuple[float, float],
    start: tuple[float, float],
) -> tuple[SkyPath, ZenithCrossing]:
    time_s = path.step_s * np.arange(az.size)
    is_off = (time_s > window_s[0] + 1e-9) & (time_s < window_s[1] - 1e-9) | (az != path.az_deg)
    el, error_deg = off_deg(az, path.az_deg, path.el_deg, rules.max_el_deg)
    el = np.where(is_off, el, path.el_deg)
    el_rate = np.where(is_off, np.gradient(el, path.step_s), path.el_rate_deg_s)
    lost = np.flatnonzero(is_off & (error_deg > rules.half_beam_deg))
    crossing = ZenithCrossing(
        departure_tai_s=window_s[0],
        return_tai_s=window_s[1],
        departure_az_deg=start[0],
        departure_rate_deg_s=start[1],
        peak_rate_deg_s=float(np.abs(path.az_rate_deg_s).max()),
        largest_error_deg=float(error_deg[is_off].max()) if is_off.any() else 0.0,
        lost_s=path.step_s * lost.size,
        lost_from_tai_s=path.step_s * float(lost[0]) if lost.size else None,
    )
    return SkyPath(az, el, rate, el_rate, path.step_s), crossing


def _chase(az: Array, rate: Array, step_s: float, azimuth: AxisLimits) -> tuple[Array, Array]:
    most = azimuth.max_rate_deg_s
    state = AxisState(float(az[0]), min(max(float(rate[0]), -most), most))
    states = [state]
    for target, target_rate in zip(az[1:].tolist(), rate[1:].tolist(), strict=True):
        state = step(state, target, target_rate, step_s, azimuth)
        states.append(state)
    return np.array([s.position_deg for s in states]), np.array([s.rate_deg_s for s in states])
