"""Brouwer mean elements: secular motion by J2, J2^2 and J4, first-order short-period terms of J2.

The elements refer to the true equator and mean equinox of date, the frame SGP4 calls TEME.  They are means over one
revolution; the slow (long-period) motion of the eccentricity vector by J3 is not modelled (1 to 2 km after a day).
Source: Brouwer, Solution of the problem of artificial satellite theory without drag, AJ 64 (1959) 378.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, sqrt

import numpy as np

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction
from acu_daemon.orbit.correction import corrected_ellipse
from acu_daemon.orbit.kepler import OsculatingElements, perifocal_axes, solve_kepler
from acu_daemon.units import EARTH_EQUATORIAL_RADIUS_M, J2, J4, MU_M3_S2, Array

_K2_M2 = J2 * EARTH_EQUATORIAL_RADIUS_M**2 / 2.0  # Brouwer's k2
_K4_M4 = -3.0 / 8.0 * J4 * EARTH_EQUATORIAL_RADIUS_M**4  # Brouwer's k4


@dataclass(frozen=True, slots=True)
class BrouwerElements:
    """Mean elements at an epoch, true equator and mean equinox of date."""

    name: str
    epoch_tai_s: float
    a_m: float
    e: float
    i_rad: float
    raan_rad: float
    argp_rad: float
    mean_anomaly_rad: float


@dataclass(frozen=True, slots=True)
class SecularRates:
    """How fast the mean angles run, rad/s; the mean anomaly's includes the two-body motion."""

    raan_rad_s: float
    argp_rad_s: float
    mean_anomaly_rad_s: float


def secular_rates(a_m: float, e: float, i_rad: float) -> SecularRates:
    """Rates of the mean angles from mean elements.

    Source:  Brouwer 1959, the secular terms of l'', g'', h''; the gammas and eta as there.
    """
    n = sqrt(MU_M3_S2 / a_m**3)
    eta = sqrt(1.0 - e * e)
    t = cos(i_rad)
    t2, t4, eta2 = t * t, t**4, eta * eta
    g2, g4 = _K2_M2 / a_m**2 / eta**4, _K4_M4 / a_m**4 / eta**8
    anomaly = (
        1.0
        + 1.5 * g2 * eta * (3.0 * t2 - 1.0)
        + 3.0
        / 32.0
        * g2**2
        * eta
        * (
            -15.0
            + 16.0 * eta
            + 25.0 * eta2
            + (30.0 - 96.0 * eta - 90.0 * eta2) * t2
            + (105.0 + 144.0 * eta + 25.0 * eta2) * t4
        )
        + 15.0 / 16.0 * g4 * eta * e * e * (3.0 - 30.0 * t2 + 35.0 * t4)
    )
    argp = (
        1.5 * g2 * (5.0 * t2 - 1.0)
        + 3.0
        / 32.0
        * g2**2
        * (
            -35.0
            + 24.0 * eta
            + 25.0 * eta2
            + (90.0 - 192.0 * eta - 126.0 * eta2) * t2
            + (385.0 + 360.0 * eta + 45.0 * eta2) * t4
        )
        + 5.0 / 16.0 * g4 * (21.0 - 9.0 * eta2 + (126.0 * eta2 - 270.0) * t2 + (385.0 - 189.0 * eta2) * t4)
    )
    raan = (
        -3.0 * g2 * t
        + 3.0 / 8.0 * g2**2 * t * (-5.0 + 12.0 * eta + 9.0 * eta2 - (35.0 + 36.0 * eta + 5.0 * eta2) * t2)
        + 5.0 / 4.0 * g4 * (5.0 - 3.0 * eta2) * t * (3.0 - 7.0 * t2)
    )
    return SecularRates(n * raan, n * argp, n * anomaly)


class BrouwerPropagator:
    """A satellite's motion from Brouwer mean elements.  Immutable and picklable."""

    kind = "brouwer"

    def __init__(
        self, elements: BrouwerElements, short_period: bool = True, correction: Correction | None = None
    ) -> None:
        """Take the elements; without `short_period` the mean orbit itself is followed.

        Raises:  OrbitError: elements that are no elliptic orbit, as given or as corrected.
        """
        self.elements = elements
        self.short_period = short_period
        self.correction = correction or Correction()
        self.epoch_tai_s = elements.epoch_tai_s
        start = _corrected(elements, self.correction)
        if not (0.0 <= start.e < 1.0 and start.a_m > 0.0):
            raise OrbitError(f"{elements.name}: not an ellipse: a = {start.a_m} m, e = {start.e}")
        rates = secular_rates(start.a_m, start.e, start.i_rad)
        self._start = (start.a_m, start.e, start.i_rad, start.raan_rad, start.argp_rad, start.mean_anomaly_rad)
        self._rates = (0.0, 0.0, 0.0, rates.raan_rad_s, rates.argp_rad_s, rates.mean_anomaly_rad_s)

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and velocities (N, 3) in m/s, TEME of date, at the times (N,).

        Raises:  OrbitError: a time that is not finite.
        """
        self._refuse_infinite(tai_s)
        return states_of_mean(self.mean_elements(tai_s), self.short_period)

    def _refuse_infinite(self, tai_s: Array) -> None:
        if not np.isfinite(tai_s).all():
            raise OrbitError(f"{self.elements.name}: no position at a time that is not finite")

    def states_together(self, corrections: Sequence[Correction], tai_s: Array) -> tuple[Array, Array]:
        """Positions and velocities (M, N, 3) with each of the M corrections, like `states_teme`.

        Raises:  OrbitError: a time that is not finite, or a correction that leaves no elliptic orbit.
        """
        self._refuse_infinite(tai_s)
        mean = self._mean_of([self.corrected(one) for one in corrections], tai_s)
        r_m, v_m_s = states_of_mean(mean, self.short_period)
        shape = len(corrections), tai_s.size, 3
        return r_m.reshape(shape), v_m_s.reshape(shape)

    def mean_elements(self, tai_s: Array) -> OsculatingElements:
        """The mean elements with their secular motion at the times (N,)."""
        return self._mean_of([self], tai_s)

    def _mean_of(self, sources: "Sequence[BrouwerPropagator]", tai_s: Array) -> OsculatingElements:
        """The mean elements of M sources of this epoch at the times (N,), one source after the other, (M N,)."""
        starts = np.array([one._start for one in sources]).T[:, :, None]
        rates = np.array([one._rates for one in sources]).T[:, :, None]
        return OsculatingElements(*(starts + rates * (tai_s - self.epoch_tai_s)).reshape(6, -1))

    def corrected(self, correction: Correction) -> "BrouwerPropagator":
        """The same elements with this correction in place of any earlier one."""
        return BrouwerPropagator(self.elements, self.short_period, correction)


def states_of_mean(mean: OsculatingElements, short_period: bool = True) -> tuple[Array, Array]:
    """Positions (N, 3) in metres and velocities (N, 3) in m/s of mean elements, in their frame."""
    return _state(*(_osculating_hill(mean) if short_period else _mean_hill(mean)))


def _corrected(elements: BrouwerElements, correction: Correction) -> BrouwerElements:
    """Add the correction; the mean motion's by Kepler's third law to the semi-major axis."""
    ellipse = corrected_ellipse(elements.e, elements.argp_rad, elements.mean_anomaly_rad, correction)
    a_m = elements.a_m
    if correction.delta_mean_motion_rad_s != 0.0:
        n = sqrt(MU_M3_S2 / a_m**3) + correction.delta_mean_motion_rad_s
        a_m = (MU_M3_S2 / n**2) ** (1.0 / 3.0)
    return replace(
        elements,
        a_m=a_m,
        e=ellipse.e,
        i_rad=elements.i_rad + correction.delta_inclination_rad,
        raan_rad=elements.raan_rad + correction.delta_raan_rad,
        argp_rad=ellipse.argp_rad,
        mean_anomaly_rad=ellipse.mean_anomaly_rad,
    )


# Hill (polar-nodal) variables: radius, argument of latitude, node, radial speed, momentum, its z component.  The
# short-period terms have no small divisor in them, whatever the eccentricity.
_Hill = tuple[Array, Array, Array, Array, Array, Array]


def _mean_hill(mean: OsculatingElements) -> _Hill:
    anomaly = solve_kepler(mean.mean_anomaly_rad, mean.e)
    e_cos, e_sin = mean.e * np.cos(anomaly), mean.e * np.sin(anomaly)
    eta = np.sqrt(1.0 - mean.e**2)
    r = mean.a_m * (1.0 - e_cos)
    momentum = np.sqrt(MU_M3_S2 * mean.a_m) * eta
    true_minus_eccentric = 2.0 * np.arctan2(e_sin, 1.0 + eta - e_cos)
    latitude = mean.argp_rad + anomaly + true_minus_eccentric
    radial = np.sqrt(MU_M3_S2 * mean.a_m) * e_sin / r
    return r, latitude, mean.raan_rad, radial, momentum, momentum * np.cos(mean.i_rad)


def _osculating_hill(mean: OsculatingElements) -> _Hill:
    """Add the first-order short-period terms of J2: {x, W} in Hill variables, f - M the equation of the centre, with

        W = -G eps [ (1 - 3/2 s^2) (f - M + sigma) + s^2 ((3/4 + kappa) sin 2u - 1/2 sigma cos 2u) ],
        eps = k2/p^2, kappa = p/r - 1 = e cos f, sigma = p R/G = e sin f, s = sin i.

    Source:  Brouwer 1959, determining function S1, rewritten in Hill variables as by Izsak, AJ 68 (1963) 559.
    """
    r, latitude, raan, radial, momentum, polar = _mean_hill(mean)
    eta = np.sqrt(1.0 - mean.e**2)
    p = mean.a_m * eta * eta
    kappa, sigma = p / r - 1.0, p * radial / momentum
    eps = _K2_M2 / p**2
    c = polar / momentum
    s2 = 1.0 - c * c
    oblate = 1.0 - 1.5 * s2
    sin2u, cos2u = np.sin(2.0 * latitude), np.cos(2.0 * latitude)
    centre = latitude - mean.argp_rad - mean.mean_anomaly_rad + sigma
    wave = (0.75 + kappa) * sin2u - 0.5 * sigma * cos2u
    by_sigma = kappa / (1.0 + eta) + 2.0 * eta / (1.0 + kappa) + 1.0
    by_kappa = -sigma * (1.0 / (1.0 + eta) + eta / (1.0 + kappa) ** 2)
    by_momentum = (
        2.0 * c * c * (wave - 1.5 * centre)
        + oblate * (2.0 * (1.0 + kappa) * by_kappa + sigma * by_sigma)
        + s2 * (2.0 * (1.0 + kappa) * sin2u - 0.5 * sigma * cos2u)
    )
    return (
        r - eps * p * (oblate * by_sigma - 0.5 * s2 * cos2u),
        latitude + eps * (3.0 * (oblate * centre + s2 * wave) - by_momentum),
        raan + 2.0 * eps * c * (wave - 1.5 * centre),
        radial - momentum * eps * (1.0 + kappa) / r * (oblate * by_kappa + s2 * sin2u),
        momentum * (1.0 + eps * s2 * ((1.5 + 2.0 * kappa) * cos2u + sigma * sin2u)),
        polar,
    )


def _state(r: Array, latitude: Array, raan: Array, radial: Array, momentum: Array, polar: Array) -> tuple[Array, Array]:
    inclination = np.arccos(np.clip(polar / momentum, -1.0, 1.0))
    outward, along = perifocal_axes(inclination, raan, latitude)
    return r[:, None] * outward, radial[:, None] * outward + (momentum / r)[:, None] * along
