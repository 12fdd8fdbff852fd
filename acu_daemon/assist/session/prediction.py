"""The prediction buffer: where the satellite will be, at even steps ahead of now.  Pure."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from acu_daemon.assist.mount_model import encoder_look, sigma_deg
from acu_daemon.model import FitResult, Prediction, PredictionKind, Site, ZenithCrossing
from acu_daemon.orbit.frames import enu_from_itrs, station_itrs_m
from acu_daemon.orbit.look import Look, look_along
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.keyhole import SIDE_STEPS, Begun, KeyholeRules, SkyPath, follow_path, turned_past_zenith
from acu_daemon.units import DEG, EARTH_RATE_RAD_S, Array, wrap_180, wrap_180_array

Flags = npt.NDArray[np.bool_]


def predict(
    propagator: Propagator,
    site: Site,
    start_tai_s: float,
    made_at_tai_s: float,
    kind: PredictionKind,
    near_az_deg: float,
    *,
    horizon_s: float = 90.0,
    step_s: float = 0.1,
    lead_in_s: float = 0.0,
    keyhole: KeyholeRules | None = None,
    in_hand: ZenithCrossing | None = None,
    zenith_turn: int = 0,
    fit: FitResult | None = None,
    is_plunged: bool = False,
) -> Prediction:
    """Predict pointing from start_tai_s over horizon_s.

    near_az_deg: continuous azimuth (encoder frame) near which the path is at made_at_tai_s, or at its start where that
    is later; it picks the turn.  From there azimuth is continuous, through north and past the zenith.  keyhole: what
    the antenna can do that follows the registers (None: all); its path is made from lead_in_s before the start on, so
    that a buffer that starts inside the keyhole continues what the one before it planned.  in_hand: the crossing of the
    zenith that the antenna is about to begin, is on, or has made (pointing.keyhole).
    zenith_turn: 1 or -1 where the azimuth has to rise or fall past the zenith because of its stops (0: as it does).
    is_plunged: the antenna is beyond the zenith already, the elevation over 90 deg: so is a path that falls.
    fit: what corrected the propagator; its biases and its place of the station are in the prediction, and its
    covariance gives sigma_deg.
    Raises:  OrbitError: the propagator has no answer for one of the times.
    Source:  Kuga and Carrara 1990, section 4; 90 s at 10 Hz: Aguirre and Medeiros 1988, section 2.5.
    """
    if in_hand is not None and start_tai_s - in_hand.departure_tai_s < 2.0 * lead_in_s:
        lead_in_s = max(lead_in_s, start_tai_s - in_hand.departure_tai_s + step_s)
    before = round(lead_in_s / step_s)
    tai_s = start_tai_s + step_s * np.arange(-before, round(horizon_s / step_s) + 1, dtype=np.float64)
    seen = encoder_look(propagator, tai_s, site, fit, look_along)
    az_deg = _continuous(seen.az_deg, seen.az_rate_deg_s, step_s)
    if zenith_turn:
        az_deg = turned_past_zenith(az_deg, seen.az_rate_deg_s, zenith_turn)
    near = min(max(before + round((made_at_tai_s - start_tai_s) / step_s), before), tai_s.size - 1)
    plunged = None
    if keyhole is not None and keyhole.may_plunge:
        plunged = _plunged(propagator, tai_s, site, fit, az_deg)
    is_plunged = is_plunged and plunged is not None and float(seen.el_rate_deg_s[near]) < 0.0
    is_beyond = plunged is not None and (is_plunged or _is_past_top(in_hand, made_at_tai_s))
    az_at_near = plunged[0][near] if plunged is not None and is_beyond else az_deg[near]
    turned_deg = near_az_deg + wrap_180(float(az_at_near) - near_az_deg) - az_at_near
    az_deg += turned_deg
    if plunged is not None:
        plunged[0][:] += turned_deg
    path = SkyPath(az_deg, seen.el_deg, seen.az_rate_deg_s, seen.el_rate_deg_s, step_s)
    followed, crossing = path, None
    if plunged is not None and is_plunged:
        path = followed = _beyond_top(path, plunged, int(np.argmax(path.el_deg)))
    elif keyhole is not None:
        first_tai_s = float(tai_s[0])
        begun = _begun(in_hand, path, first_tai_s, made_at_tai_s)
        followed, crossing = follow_path(path, keyhole, begun, plunged)
        if plunged is not None and crossing is not None and crossing.is_plunge:
            middle = round((crossing.departure_tai_s + crossing.return_tai_s) / 2.0 / step_s)
            path = _beyond_top(path, plunged, middle)
        crossing = crossing and _from_tai_s(crossing, first_tai_s)
    return Prediction(
        start_tai_s=start_tai_s,
        step_s=step_s,
        az_deg=path.az_deg[before:],
        el_deg=path.el_deg[before:],
        az_rate_deg_s=path.az_rate_deg_s[before:],
        el_rate_deg_s=path.el_rate_deg_s[before:],
        follow_az_deg=followed.az_deg[before:],
        follow_az_rate_deg_s=followed.az_rate_deg_s[before:],
        kind=kind,
        made_at_tai_s=made_at_tai_s,
        sigma_deg=sigma_deg(propagator, tai_s[before:], site, fit),
        late_drift_deg_s=_late_drift_deg_s(seen, site, path.el_deg > 90.0)[:, before:],
        follow_el_deg=followed.el_deg[before:] if crossing else None,
        follow_el_rate_deg_s=followed.el_rate_deg_s[before:] if crossing else None,
        crossing=crossing,
    )


def _begun(in_hand: ZenithCrossing | None, path: SkyPath, first_tai_s: float, now_tai_s: float) -> Begun | None:
    """The crossing in hand on the turn of the path, in seconds from its start; None where it begins elsewhere."""
    if in_hand is None:
        return None
    departure_s = in_hand.departure_tai_s - first_tai_s
    k = round(departure_s / path.step_s)
    if not 0 <= k < path.az_deg.size:
        return None
    az_deg = float(path.az_deg[k]) + wrap_180(in_hand.departure_az_deg - float(path.az_deg[k]))
    plunge_to_s = in_hand.return_tai_s - first_tai_s if in_hand.is_plunge else None
    return Begun(departure_s, az_deg, in_hand.departure_rate_deg_s, now_tai_s - first_tai_s, plunge_to_s)


def _plunged(
    propagator: Propagator, tai_s: Array, site: Site, fit: FitResult | None, az_deg: Array
) -> tuple[Array, Array]:
    """Azimuth and elevation of a path for a plunged antenna; the azimuth goes on from az_deg as it was before the top.

    az_deg: of the path itself, continuous.
    """
    seen = encoder_look(propagator, tai_s, site, fit, look_along, is_plunged=True)
    top = int(np.argmin(seen.el_deg))
    first, last = max(top - SIDE_STEPS, 0), min(top + SIDE_STEPS, az_deg.size - 1)
    half_turn_deg = -180.0 if az_deg[last] >= az_deg[first] else 180.0
    return az_deg + half_turn_deg + wrap_180_array(seen.az_deg - az_deg - half_turn_deg), seen.el_deg


def _is_past_top(in_hand: ZenithCrossing | None, tai_s: float) -> bool:
    """Whether an antenna that goes over the top is beyond it."""
    return in_hand is not None and in_hand.is_plunge and tai_s >= (in_hand.departure_tai_s + in_hand.return_tai_s) / 2.0


def _beyond_top(path: SkyPath, plunged: tuple[Array, Array], top: int) -> SkyPath:
    """The path as a plunged antenna has it, from a sample on, where its azimuth is half a turn further."""
    is_beyond = np.arange(path.el_deg.size) >= top
    return SkyPath(
        np.where(is_beyond, plunged[0], path.az_deg),
        np.where(is_beyond, plunged[1], path.el_deg),
        path.az_rate_deg_s,
        np.where(is_beyond, -path.el_rate_deg_s, path.el_rate_deg_s),
        path.step_s,
    )


def _from_tai_s(crossing: ZenithCrossing, first_tai_s: float) -> ZenithCrossing:
    """Its times, which count from the path's start, as TAI."""
    lost_from_s = crossing.lost_from_tai_s
    return replace(
        crossing,
        departure_tai_s=crossing.departure_tai_s + first_tai_s,
        return_tai_s=crossing.return_tai_s + first_tai_s,
        lost_from_tai_s=None if lost_from_s is None else lost_from_s + first_tai_s,
    )


def _late_drift_deg_s(seen: Look, site: Site, is_plunged: Flags) -> Array:
    """How far beside its path, right and up, a satellite is seen that comes a second late: the Earth turns on, (2, N).

    For a plunged antenna both are the other way.

    An orbit that is a second late puts the satellite at the same place in space a second later; seen from the Earth
    that place has moved by the turn of a second, westward.
    """
    az, el = np.radians(seen.az_deg), np.radians(seen.el_deg)
    sin_az, cos_az, sin_el, cos_el = np.sin(az), np.cos(az), np.sin(el), np.cos(el)
    axes = enu_from_itrs(site.station)
    from_centre_m = (axes @ station_itrs_m(site.station))[:, None] + seen.range_m * np.stack(
        (cos_el * sin_az, cos_el * cos_az, sin_el)
    )
    turn_rad_s = axes @ np.array((0.0, 0.0, EARTH_RATE_RAD_S))
    moved_m_s = -np.cross(turn_rad_s, from_centre_m, axisb=0, axisc=0)
    right = cos_az * moved_m_s[0] - sin_az * moved_m_s[1]
    up = cos_el * moved_m_s[2] - sin_el * (sin_az * moved_m_s[0] + cos_az * moved_m_s[1])
    drift: Array = np.where(is_plunged, -1.0, 1.0) * np.stack((right, up)) / seen.range_m / DEG
    return drift


def _continuous(az_deg: Array, az_rate_deg_s: Array, step_s: float) -> Array:
    """Unwrap [0, 360) azimuths; a step past the zenith turns the way the rates say, even by nearly 180 degrees."""
    steps = wrap_180_array(np.diff(az_deg))
    turning = az_rate_deg_s[:-1] + az_rate_deg_s[1:]
    against = (np.abs(steps) > 90.0) & (steps * turning < 0.0)
    steps += np.where(against, 360.0 * np.sign(turning), 0.0)
    continuous: Array = float(az_deg[0]) + np.concatenate(([0.0], np.cumsum(steps)))
    return continuous
