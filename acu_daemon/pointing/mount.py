"""The mount: how an imperfect pedestal's encoders differ from the direction of the beam.  Pure.

    across  = IA cos h + CA + NPAE sin h + (AN sin A + AW cos A) sin h        encoder azimuth - A = across sec h
    upwards = IE + TF cos h + AN cos A - AW sin A                             encoder elevation - h

at the direction A, h of the beam (apparent, that is in air): encoder = direction + terms.  Names are those of TPOINT
(Wallace); what each one is, its sign, and TPOINT's are in docs/antenna-model.md.  First order: what a pedestal that
turns about tilted axes does differs by products of the terms, 1e-4 deg with terms of 0.05 deg at 60 deg of elevation.

Near the zenith sec h grows without limit, and the formula stops being the pedestal's.  Here sec h is
cos h / (cos^2 h + sin^2 0.25 deg): 0.06 % small at 80 deg, 1.5 % at 88, 6 % at 89, at most 115 (at 89.75), zero at the
zenith, across which it changes by at most 920 per degree, and of the other sign beyond it (plunge).  What it leaves out
of the azimuth there is below CA + NPAE + tilt on the sky.
"""

from dataclasses import dataclass, fields
from math import cos, sin

import numpy as np
import numpy.typing as npt

from acu_daemon.units import DEG, Array

_ZENITH_SINE2 = sin(0.25 * DEG) ** 2
MOST_DEG = 0.3  # of CA, NPAE, AN, AW together, up to which the encoders tell one direction everywhere
_SMALL_STEP_DEG = 1e-10
_MOST_STEPS = 50


@dataclass(frozen=True, slots=True)
class Mount:
    """The terms, degrees."""

    ia_deg: float = 0.0  # zero point of the azimuth encoder
    ie_deg: float = 0.0  # zero point of the elevation encoder
    ca_deg: float = 0.0  # collimation: beam left of the perpendicular to the elevation axis
    npae_deg: float = 0.0  # elevation axis not perpendicular to the azimuth axis: its right end high
    an_deg: float = 0.0  # azimuth axis leans north
    aw_deg: float = 0.0  # azimuth axis leans west
    tf_deg: float = 0.0  # flexure: the beam sags by TF cos h

    @property
    def is_square(self) -> bool:
        """Whether the zero points of the encoders are all that there is."""
        return self.ca_deg == self.npae_deg == self.an_deg == self.aw_deg == self.tf_deg == 0.0

    def encoders_deg(self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike) -> tuple[Array, Array]:
        """Turn the beam's direction into what the encoders read, both continuous (not wrapped to 360), () or (N,)."""
        az, el = np.asarray(az_deg, dtype=np.float64), np.asarray(el_deg, dtype=np.float64)
        if self.is_square:
            return az + self.ia_deg, el + self.ie_deg
        azimuths, elevations = shares(az, el)
        terms = self.terms_deg()
        return az + azimuths @ terms, el + elevations @ terms

    def beam_deg(self, encoder_az_deg: npt.ArrayLike, encoder_el_deg: npt.ArrayLike) -> tuple[Array, Array]:
        """Turn what the encoders read into the beam's direction, the inverse of encoders_deg to 1e-9 deg."""
        encoder_az = np.asarray(encoder_az_deg, dtype=np.float64)
        encoder_el = np.asarray(encoder_el_deg, dtype=np.float64)
        az, el = encoder_az - self.ia_deg, encoder_el - self.ie_deg
        if self.is_square:
            return az, el
        for _ in range(_MOST_STEPS):
            there_az, there_el = self.encoders_deg(az, el)
            off_az, off_el = encoder_az - there_az, encoder_el - there_el
            if not np.any(np.maximum(np.abs(off_az), np.abs(off_el)) > _SMALL_STEP_DEG):
                break
            (aa, ae), (ea, ee) = self.by_direction(az, el)
            determinant = aa * ee - ae * ea
            az, el = az + (ee * off_az - ae * off_el) / determinant, el + (aa * off_el - ea * off_az) / determinant
        return az, el

    def beam_near(self, encoder_az_deg: float, encoder_el_deg: float) -> tuple[float, float]:
        """The same for one direction, quickly, to 0.01 deg on the sky (the greatest terms, from the horizon on)."""
        az_deg, el_deg = encoder_az_deg - self.ia_deg, encoder_el_deg - self.ie_deg
        for _ in range(2):
            a, h = az_deg * DEG, el_deg * DEG
            sine, cosine = sin(h), cos(h)
            secant = cosine / (cosine * cosine + _ZENITH_SINE2)
            leaning = self.npae_deg + self.an_deg * sin(a) + self.aw_deg * cos(a)
            along = self.an_deg * cos(a) - self.aw_deg * sin(a)
            az_deg = encoder_az_deg - self.ia_deg - (self.ca_deg + leaning * sine) * secant
            el_deg = encoder_el_deg - self.ie_deg - self.tf_deg * cosine - along
        return az_deg, el_deg

    def by_direction(self, az_deg: Array, el_deg: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Derivatives of the encoders by the direction: ((azimuth by A, by h), (elevation by A, by h))."""
        a, h = az_deg * DEG, el_deg * DEG
        sine, cosine, secant = np.sin(h), np.cos(h), _secant(h)
        secant_slope = sine * (cosine * cosine - _ZENITH_SINE2) / (cosine * cosine + _ZENITH_SINE2) ** 2
        tilt = self.an_deg * np.sin(a) + self.aw_deg * np.cos(a)
        along = self.an_deg * np.cos(a) - self.aw_deg * np.sin(a)
        leaning = self.npae_deg + tilt
        azimuth_by_h = self.ca_deg * secant_slope + leaning * (cosine * secant + sine * secant_slope)
        return (
            (1.0 + DEG * along * sine * secant, DEG * azimuth_by_h),
            (-DEG * tilt, 1.0 - DEG * self.tf_deg * sine),
        )

    def terms_deg(self) -> Array:
        """The terms in the order of TERMS, (7,)."""
        return np.array([getattr(self, name) for name in TERMS])


TERMS = tuple(field.name for field in fields(Mount))


def shares(az_deg: Array, el_deg: Array) -> tuple[Array, Array]:
    """Give by how much one degree of each term moves the encoders at a direction: the derivatives by the terms.

    Args:    az_deg, el_deg: () or (N,).
    Returns: azimuth's and elevation's, each (7,) or (N, 7), in the order of TERMS.
    """
    a, h = az_deg * DEG, el_deg * DEG
    sin_a, cos_a, secant = np.sin(a), np.cos(a), _secant(h)
    tangent = np.sin(h) * secant
    zero, one = np.zeros_like(secant), np.ones_like(secant)
    azimuths = np.stack([one, zero, secant, tangent, sin_a * tangent, cos_a * tangent, zero], axis=-1)
    elevations = np.stack([zero, one, zero, zero, cos_a * one, -sin_a * one, np.cos(h)], axis=-1)
    return azimuths, elevations


def axes_on_the_sky(sin_az: Array, cos_az: Array, sin_el: Array, cos_el: Array) -> Array:
    """Give by how much a unit of NPAE, AN, AW and TF moves what is shown on the sky: across and upwards, (4, 2, N).

    The formula of this module before the secant, so that it is finite at the zenith; sines and cosines (N,).
    """
    out: Array = np.zeros((4, 2, sin_el.size))
    out[0, 0] = sin_el
    out[1] = sin_az * sin_el, cos_az
    out[2] = cos_az * sin_el, -sin_az
    out[3, 1] = cos_el
    return out


def _secant(el_rad: Array) -> Array:
    """1 / cos h, bounded near the zenith."""
    cosine = np.cos(el_rad)
    bounded: Array = cosine / (cosine * cosine + _ZENITH_SINE2)
    return bounded
