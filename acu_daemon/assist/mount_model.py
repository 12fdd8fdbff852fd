"""The mount model of a fit: encoder angles from orbit, station's place, angle biases, air and mount.  Pure.

Commands go through the same encoders as readings, so biases that a fit found belong into the commands.  Estimators see
readings without air and mount (`geometric`), and their biases are what is left there; so a predicted direction gets the
biases first, then the site's antenna.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from acu_daemon.assist.estimators.full.estimated_states import (
    MOUNT_TERMS,
    ORBIT,
    STATE_COUNT,
    STATION,
    STEPS,
    states_of,
)
from acu_daemon.assist.estimators.full.path_partials import (
    Curve,
    covariance_on_sky,
    low_shape,
    moved_site,
    node_times,
    orbit_partials_itrs,
    sec_el,
    site_of,
    sky_partials,
)
from acu_daemon.model import AngleBias, Antenna, Correction, FitResult, Site, plunged_bias
from acu_daemon.orbit.look import Look, look_at
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.pointing.antenna_model import AntennaModel
from acu_daemon.pointing.mount import Mount
from acu_daemon.units import DEG, Array

_SIGMA_STEP_S = 5.0
_NEAR_STEPS = 10.0 * np.array(STEPS)  # a path half a kilometre aside: a sigma differs by a few 1000ths


def encoder_look(
    propagator: Propagator,
    tai_s: Array,
    site: Site,
    fit: FitResult | None,
    look: Callable[..., Look] = look_at,
    *,
    is_plunged: bool = False,
) -> Look:
    """What the encoders show when the antenna points at the satellite, at the times (N,).

    propagator: already corrected by the fit.  look: `look_at`, which it is without a fit, or `look_along`.
    is_plunged: beyond the zenith, the azimuth half a turn further on, the elevation over 90 deg.
    Raises:  OrbitError: the propagator has no answer for one of the times.
    """
    seen = look(propagator, tai_s, site if fit is None else moved_site(site, fit.station_shift_enu_m))
    bias = AngleBias() if fit is None else plunged_bias(fit.bias) if is_plunged else fit.bias
    if bias != AngleBias():
        seen = _biased(seen, bias, site)
        mount = Mount(**{name: getattr(bias, name) for name in MOUNT_TERMS})
        seen = seen if mount == Mount() else _on_encoders(seen, AntennaModel(mount))
    if not is_plunged:
        return seen if site.antenna is None else _on_encoders(seen, site.antenna)
    if site.antenna is not None:
        return _wrapped(*site.antenna.with_rates_plunged(*_angles(seen)), range_m=seen.range_m)
    az_deg, el_deg, _, az_rate_deg_s, el_rate_deg_s = _angles(seen)
    return _wrapped(az_deg + 180.0, 180.0 - el_deg, az_rate_deg_s, -el_rate_deg_s, range_m=seen.range_m)


def _on_encoders(seen: Look, antenna: Antenna) -> Look:
    return _wrapped(*antenna.with_rates(*_angles(seen)), range_m=seen.range_m)


def _angles(seen: Look) -> tuple[Array, Array, Array, Array, Array]:
    return seen.az_deg, seen.el_deg, seen.range_m, seen.az_rate_deg_s, seen.el_rate_deg_s


def _wrapped(az_deg: Array, el_deg: Array, az_rate_deg_s: Array, el_rate_deg_s: Array, *, range_m: Array) -> Look:
    return Look(az_deg % 360.0 % 360.0, el_deg, range_m, az_rate_deg_s, el_rate_deg_s)


def _biased(seen: Look, bias: AngleBias, site: Site) -> Look:
    el = np.radians(seen.el_deg)
    sin_el, cos_el = np.sin(el), np.cos(el)
    sec = sec_el(cos_el)
    low, low_slope = low_shape(site, sin_el, cos_el, seen.range_m)
    return Look(
        az_deg=(seen.az_deg + bias.az_deg + bias.az_sec_deg * sec) % 360.0 % 360.0,
        el_deg=seen.el_deg + bias.el_deg + bias.el_cot_deg * low,
        range_m=seen.range_m,
        az_rate_deg_s=seen.az_rate_deg_s + bias.az_sec_deg * DEG * sec * sec * sin_el * seen.el_rate_deg_s,
        el_rate_deg_s=seen.el_rate_deg_s * (1.0 + bias.el_cot_deg * low_slope),
    )


def sigma_deg(propagator: Propagator, tai_s: Array, site: Site, fit: FitResult | None) -> Array | None:
    """1 sigma of the predicted directions at the times (N,): root of the mean eigenvalue of the covariance on the sky.

    None where the fit has no covariance.  Computed every few seconds and interpolated.
    """
    if fit is None or fit.covariance is None:
        return None
    first, last = float(tai_s[0]), float(tai_s[-1])
    times = np.linspace(first, last, 2 + int((last - first) / _SIGMA_STEP_S))
    across, _, upward = sky_covariance(propagator, times, site, fit)
    sigma: Array = np.interp(tai_s, times, np.sqrt((across + upward) / 2.0)) / DEG
    return sigma


@lru_cache(maxsize=16)
def _partials_near(
    source: Propagator, orbit: tuple[float, ...], site: Site, node_tai_s: tuple[float, ...]
) -> tuple[Curve, Curve]:
    """`orbit_partials_itrs` of orbit states near a fit's, remembered: the next fits are near them too."""
    x = np.zeros(STATE_COUNT)
    x[ORBIT] = orbit
    return orbit_partials_itrs(source, x, site, np.array(node_tai_s))


def sky_covariance(propagator: Propagator, tai_s: Array, site: Site, fit: FitResult) -> tuple[Array, Array, Array]:
    """Covariance of predicted directions, (N,) each, rad^2: across the elevation, both together, in elevation.

    Raises:  ValueError: the fit has no covariance.
    """
    if fit.covariance is None:
        raise ValueError(f"the estimator {fit.estimator} gives no covariance")
    x = states_of(fit.correction, fit.bias, fit.station_shift_enu_m)
    nodes = node_times(float(tai_s[0]), float(tai_s[-1]))
    here = site_of(site, x)
    near = tuple((np.round(x[ORBIT] / _NEAR_STEPS) * _NEAR_STEPS).tolist())
    path, partials = _partials_near(propagator.corrected(Correction(*near)), near, site, tuple(nodes.tolist()))
    has_shift = bool(fit.covariance[STATION, STATION].any())
    h = sky_partials(path.at(tai_s), partials.at(tai_s), here, has_shift)
    return covariance_on_sky(fit.covariance, h)
