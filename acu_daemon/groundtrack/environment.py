"""What the sky does to a phased orbit while nobody steers it: drag, Sun and Moon, over even steps of time.

Drag is averaged over the revolution: da/dt = -B rho v a (1 - w/n cos i)^2, B = Cd A / m.  Offsets from the reference
orbit are small, so their rates are linear in them (`ReferenceOrbit.by_a`, `by_i`), and a manoeuvre of da at tM adds
by_a da (t - tM) to node, alpha and D: a year is integrated once, and steered any number of times.
"""

from dataclasses import dataclass, field

import numpy as np

from acu_daemon.groundtrack.atmosphere import Activity, density_table, exospheric_k, semi_annual
from acu_daemon.groundtrack.lunisolar import plane_rates, sun
from acu_daemon.groundtrack.reference import CBERS_CYCLE, ReferenceOrbit, plane_drag_factor, sun_synchronous
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.units import DAY_S, EARTH_EQUATORIAL_RADIUS_M, EARTH_FLATTENING, Array

STEP_S = 180.0  # of the grid: an observation of D, Galski and Orlando 2011, section 3
BALLISTIC_M2_KG = 0.0682  # makes the paper's yearly sums; about three times a real CBERS (docs/groundtrack.md)
EPOCH_TAI_S = tai_from_utc("2010-01-01T00:00:00Z")
NODE_HOUR = 22.5  # local time of the ascending node: CBERS descends at 10:30
_COARSE_S = 3600.0  # drag, Sun and Moon are computed this often, and interpolated
_POINTS = 24  # on the revolution, for its mean density
_YEAR_DAYS = 365.2422


@dataclass(frozen=True, slots=True)
class Flux:
    """Daily solar flux at 10.7 cm (sfu) and geomagnetic Kp: values hold at the middle of their day, linear between."""

    start_tai_s: float  # the first day's begin
    f107: Array
    kp: Array

    @property
    def end_tai_s(self) -> float:
        return self.start_tai_s + self.f107.size * DAY_S

    def at(self, tai_s: Array) -> Activity:
        """Flux, its mean over 81 days around, and Kp, at the times (N,)."""
        days = (tai_s - self.start_tai_s) / DAY_S - 0.5
        index = np.arange(self.f107.size)
        sums = np.concatenate([[0.0], np.cumsum(self.f107)])
        low, high = np.maximum(index - 40, 0), np.minimum(index + 41, self.f107.size)
        mean = (sums[high] - sums[low]) / (high - low)
        return Activity(*(np.interp(days, index, one) for one in (self.f107, mean, self.kp)))


def effective_flux(activity: Activity) -> Array:
    """The constant flux that heats the air as much: 3.24 of the mean and 1.3 of the day's excess (J71 eq 14)."""
    flux: Array = activity.f107_mean + 1.3 / 3.24 * (activity.f107 - activity.f107_mean)
    return flux


@dataclass(frozen=True, slots=True)
class Spacecraft:
    """The orbit that is kept, and what the air sees of the satellite."""

    reference: ReferenceOrbit = field(default_factory=lambda: sun_synchronous(CBERS_CYCLE))
    ballistic_m2_kg: float = BALLISTIC_M2_KG
    node_hour: float = NODE_HOUR


def decay_m_s(craft: Spacecraft, tai_s: Array, activity: Activity, *, has_semi_annual: bool = False) -> Array:
    """da/dt in m/s at the times (N,), negative."""
    reference = craft.reference
    around = np.linspace(0.0, 2.0 * np.pi, _POINTS, endpoint=False)
    si, ci = np.sin(reference.i_rad), np.cos(reference.i_rad)
    latitude = np.arcsin(si * np.sin(around))
    hour = (craft.node_hour - 12.0) * np.pi / 12.0 + np.arctan2(ci * np.sin(around), np.cos(around))
    declination = np.arcsin(sun(tai_s).direction[:, 2])
    ground_m = EARTH_EQUATORIAL_RADIUS_M * (1.0 - EARTH_FLATTENING * np.sin(latitude) ** 2)
    height_km = (reference.a_m * (1.0 - reference.e * np.sin(around)) - ground_m) / 1e3
    exospheric = exospheric_k(
        Activity(*(one[:, None] for one in activity)), hour[None], latitude[None], declination[:, None]
    )
    height_km = np.broadcast_to(height_km, exospheric.shape)
    log_density = density_table().log10_at(exospheric, height_km)
    if has_semi_annual:
        log_density = log_density + semi_annual(height_km, ((tai_s - EPOCH_TAI_S) / DAY_S / _YEAR_DAYS)[:, None])
    density = (10.0**log_density).mean(axis=1)
    speed = reference.speed_m_s * plane_drag_factor(reference)
    decay: Array = -craft.ballistic_m2_kg * density * speed * reference.a_m
    return decay


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """Offsets from the reference orbit and D at even steps from `start_tai_s` on, each (N,), while nobody steers.

    `drag_m_s2`, `lunisolar_m_s2`: the two parts of D's acceleration.
    """

    craft: Spacecraft
    start_tai_s: float
    step_s: float
    a_m: Array
    i_rad: Array
    raan_rad: Array
    alpha_rad: Array
    d_m: Array
    drag_m_s2: Array
    lunisolar_m_s2: Array

    @property
    def times_s(self) -> Array:
        """Since the start, (N,)."""
        return even_steps(0.0, self.step_s, self.a_m.size)


def free_motion(
    craft: Spacecraft,
    days: float,
    flux: Flux | None,
    *,
    start_tai_s: float = EPOCH_TAI_S,
    step_s: float = STEP_S,
    has_semi_annual: bool = False,
    has_lunisolar: bool = True,
    density_factor: Array | None = None,
) -> FreeMotion:
    """Integrate the offsets from zero over `days`; without `flux` there is no air.

    density_factor: what the true density is times the model's, one value a day from the start on.
    """
    reference = craft.reference
    coarse_s = np.arange(0.0, days * DAY_S + 2.0 * _COARSE_S, _COARSE_S)
    times_s = np.arange(0.0, days * DAY_S + step_s / 2.0, step_s)
    tai_s = start_tai_s + coarse_s
    decay = np.zeros_like(coarse_s)
    if flux is not None:
        decay = decay_m_s(craft, tai_s, flux.at(tai_s), has_semi_annual=has_semi_annual)
    if density_factor is not None:
        decay = decay * np.interp(coarse_s / DAY_S, np.arange(density_factor.size), density_factor)
    node = node_rad(craft, start_tai_s) + reference.raan_rate_rad_s * coarse_s
    by_sky = np.zeros((3, coarse_s.size))
    if has_lunisolar:
        by_sky = np.array(plane_rates(tai_s, reference.a_m, reference.i_rad, node))
    decay, tilt, raan_rate, alpha_rate = (np.interp(times_s, coarse_s, one) for one in (decay, *by_sky))
    a, i = running_integral(decay, step_s), running_integral(tilt, step_s)
    by_a, by_i = reference.by_a, reference.by_i
    raan = running_integral(by_a.raan * a + by_i.raan * i + raan_rate, step_s)
    alpha = running_integral(by_a.alpha * a + by_i.alpha * i + alpha_rate, step_s)
    pull = np.gradient(EARTH_EQUATORIAL_RADIUS_M * (raan_rate + alpha_rate / reference.cycle.per_day), step_s)
    d = reference.drift_m(raan, alpha)
    return FreeMotion(craft, start_tai_s, step_s, a, i, raan, alpha, d, by_a.drift * decay, by_i.drift * tilt + pull)


def node_rad(craft: Spacecraft, tai_s: float) -> float:
    """Right ascension of the node whose local time is the craft's, by the true sun of the instant."""
    sun_x, sun_y, _ = sun(np.array([tai_s])).direction[0]
    return float(np.arctan2(sun_y, sun_x) + (craft.node_hour - 12.0) * np.pi / 12.0)


def even_steps(first: float, step: float, count: int) -> Array:
    """first, first + step, ..., (count,)."""
    return np.asarray(first + step * np.arange(count), dtype=np.float64)


def running_integral(rate: Array, step_s: float) -> Array:
    """Integral by trapezoids, from zero."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * step_s])
