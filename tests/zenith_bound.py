"""What no azimuth drive can beat at the zenith, and passes over a spherical, turning Earth to measure it on.

The elevation is free at each instant, so only azimuth and its rate are states.  The least largest error: all azimuths
with an error below some E lie, at each instant, in one interval; the states that a drive can be in are a convex set,
so for each rate an interval of azimuths is enough, and E is bisected.  The least seconds out of the beam: dynamic
programming over azimuth and rate on a grid.  Nothing here comes from acu_daemon.pointing.
"""

import numpy as np

Array = np.ndarray
EARTH_M, MU_M3_S2, TURN_RAD_S = 6371e3, 3.986004418e14, 7.2921159e-5
STEP_S = 0.1


def overhead_pass(height_km: float, culmination_deg: float, i_deg: float = 97.5, span_s: float = 45.0) -> Array:
    """Rows t, azimuth (continuous), elevation, and their rates, of a circular orbit; culmination at about t = 0."""
    target = np.radians(90.0 - culmination_deg)
    low, high = 0.0, 0.2
    for _ in range(60):
        mid = (low + high) / 2.0
        t = np.arange(-8.0, 8.0, 0.005)
        east, north, up = _enu(height_km, i_deg, mid, t)
        if np.arctan2(np.hypot(east, north), up).min() < target:
            low = mid
        else:
            high = mid
    t = STEP_S * np.arange(-round(span_s / STEP_S), round(span_s / STEP_S) + 1)
    (east, north, up), h = _enu(height_km, i_deg, high, t), 1e-3
    after, before = _enu(height_km, i_deg, high, t + h), _enu(height_km, i_deg, high, t - h)
    d_east, d_north, d_up = ((a - b) / (2 * h) for a, b in zip(after, before, strict=True))
    ground = np.hypot(east, north)
    az = np.degrees(np.unwrap(np.arctan2(east, north)))
    el = np.degrees(np.arctan2(up, ground))
    az_rate = np.degrees((d_east * north - d_north * east) / ground**2)
    d_ground = (east * d_east + north * d_north) / ground
    el_rate = np.degrees((d_up * ground - up * d_ground) / (ground**2 + up**2))
    if np.sign(az[-1] - az[0]) != np.sign(az_rate[np.argmax(np.abs(az_rate))]):
        top = int(np.argmax(np.abs(np.diff(az)))) + 1
        az[top:] += 360.0 * np.sign(az_rate[top])
    return np.stack([t, az, el, az_rate, el_rate])


def _enu(height_km: float, i_deg: float, across_rad: float, t: Array) -> tuple[Array, Array, Array]:
    """From a station at 20 deg north, whose meridian the orbit passes across_rad beside it."""
    r = EARTH_M + height_km * 1e3
    latitude, i, n = np.radians(20.0), np.radians(i_deg), np.sqrt(MU_M3_S2 / r**3)
    u0 = np.arcsin(np.sin(latitude) / np.sin(i))
    u = u0 + n * t
    x, y, z = r * np.cos(u), r * np.sin(u) * np.cos(i), r * np.sin(u) * np.sin(i)
    node = -np.arctan2(np.sin(u0) * np.cos(i), np.cos(u0)) + across_rad - TURN_RAD_S * t
    x, y = x * np.cos(node) - y * np.sin(node), x * np.sin(node) + y * np.cos(node)
    east = y
    north = -np.sin(latitude) * x + np.cos(latitude) * z
    up = np.cos(latitude) * x + np.sin(latitude) * z - EARTH_M
    return east, north, up


def least_error_deg(path: Array, rate_deg_s: float, acceleration_deg_s2: float) -> float:
    """The least largest error, to 0.001 deg."""
    low, high = 0.0, 8.0
    while high - low > 1e-3:
        mid = (low + high) / 2.0
        if _can_stay_within(path, mid, rate_deg_s, acceleration_deg_s2):
            high = mid
        else:
            low = mid
    return high


def _can_stay_within(path: Array, error_deg: float, rate_deg_s: float, acceleration_deg_s2: float) -> bool:
    t, az, el = path[0], path[1], path[2]
    step_s, change = float(t[1] - t[0]), acceleration_deg_s2 * float(t[1] - t[0])
    rates = change * np.arange(-round(rate_deg_s / change), round(rate_deg_s / change) + 1)
    share = np.sin(np.radians(error_deg)) / np.cos(np.radians(el))
    room = np.where(share < 1.0, np.degrees(np.arcsin(np.minimum(share, 1.0))), np.inf)
    near = np.abs(rates - path[3][0]) <= change
    low, high = np.where(near, az[0], np.inf), np.where(near, az[0], -np.inf)
    for k in range(1, t.size):
        new_low, new_high = np.full_like(low, np.inf), np.full_like(high, -np.inf)
        for by in (-1, 0, 1):
            to = slice(max(by, 0), rates.size + min(by, 0))
            of = slice(max(-by, 0), rates.size + min(-by, 0))
            moved = (rates[to] + rates[of]) / 2.0 * step_s
            new_low[to] = np.minimum(new_low[to], low[of] + moved)
            new_high[to] = np.maximum(new_high[to], high[of] + moved)
        low, high = np.maximum(new_low, az[k] - room[k]), np.minimum(new_high, az[k] + room[k])
        is_empty = low > high
        low[is_empty], high[is_empty] = np.inf, -np.inf
        if is_empty.all():
            return False
    return True


def least_lost_s(path: Array, rate_deg_s: float, acceleration_deg_s2: float, half_beam_deg: float) -> float:
    """The least seconds above half a beam, of the step each; azimuth on a grid as fine as a change of rate moves it."""
    t, az, el = path[0], path[1], path[2]
    sign = 1.0 if az[-1] >= az[0] else -1.0
    step_s = float(t[1] - t[0])
    change = acceleration_deg_s2 * step_s
    grid_deg = change * step_s / 2.0
    speeds = round(rate_deg_s / change)
    begin, end = sign * az[0] - 20.0, sign * az[-1] + 20.0
    places = begin + grid_deg * np.arange(int((end - begin) / grid_deg) + 1)
    cost = np.full((speeds + 1, places.size), np.float32(1e6))
    cost[min(round(abs(float(path[3][0])) / change), speeds), round((sign * az[0] - begin) / grid_deg)] = 0.0
    limit = np.sin(np.radians(half_beam_deg))
    for k in range(1, t.size):
        new = np.full_like(cost, np.float32(1e6))
        for to in range(speeds + 1):
            for of in range(max(to - 1, 0), min(to + 1, speeds) + 1):
                moved = to + of
                new[to, moved:] = np.minimum(new[to, moved:], cost[of, : places.size - moved])
        missing = np.radians(places - sign * az[k])
        off = np.where(np.cos(missing) > 0.0, np.cos(np.radians(el[k])) * np.abs(np.sin(missing)), 1.0)
        off = np.where(np.cos(missing) > 0.0, off, np.sin(np.radians(90.0 - el[k])))
        cost = new + (off > limit).astype(np.float32)
    at_end = np.abs(places - sign * az[-1]) < 2.0
    return float(cost[:, at_end].min()) * step_s
