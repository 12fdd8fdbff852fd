"""Between a geometric direction and the encoders: refraction, tilt, mount; both ways, with partials.  Pure.

Geometric (a vacuum, from the orbit) -> apparent (in air) -> about the axes, where a tilt leans the pedestal -> encoders
(what the ACU counts).  Everything that compares a reading with an orbit, or commands a direction, goes through here
once.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from acu_daemon.pointing.mount import TERMS, Mount, shares
from acu_daemon.pointing.refraction import Refraction
from acu_daemon.pointing.tilt import Tilt
from acu_daemon.units import Array


@dataclass(frozen=True, slots=True)
class Partials:
    """Derivatives of the encoders (azimuth, elevation) at N directions.

    by_direction: (N, 2, 2) or (2, 2), by geometric azimuth and elevation; by_state: (N, 2, 8) or (2, 8), by STATES:
    the mount's terms (deg / deg) and the scale of the refraction (deg).
    """

    by_direction: Array
    by_state: Array


STATES = (*TERMS, "refraction_scale")


@lru_cache(maxsize=8)
def refraction_at_45_deg(refraction: Refraction) -> float:
    """Refraction of a source at infinity at 45 deg of elevation, where cot(el) is 1."""
    return float(refraction.raised_deg(np.array(45.0), np.inf)[0])


@dataclass(frozen=True, slots=True)
class AntennaModel:
    """A mount in air; refraction None is a vacuum.  Angles in degrees, () or (N,); azimuths continuous, not wrapped."""

    mount: Mount = Mount()
    refraction: Refraction | None = None
    refraction_scale: float = 1.0
    tilt: Tilt | None = None  # None: the pedestal stands upright

    def encoders_deg(
        self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike, range_m: npt.ArrayLike = np.inf
    ) -> tuple[Array, Array]:
        """Turn a geometric direction, and the satellite's distance, into what the encoders read on it."""
        if self.refraction is not None:
            el_deg = self.refraction.apparent_el_deg(el_deg, range_m, self.refraction_scale)
        if self.tilt is not None:
            az_deg, el_deg = self.tilt.to_pedestal(az_deg, el_deg)
        return self.mount.encoders_deg(az_deg, el_deg)

    def geometric_deg(
        self, encoder_az_deg: npt.ArrayLike, encoder_el_deg: npt.ArrayLike, range_m: npt.ArrayLike = np.inf
    ) -> tuple[Array, Array]:
        """Turn what the encoders read into the geometric direction of the satellite, whose distance is range_m.

        The inverse of encoders_deg up to the zenith.  Of a plunged antenna, whose elevation is over 90 deg, it is the
        sky's: the azimuth half a turn on, the elevation 180 deg less.
        A distance that is wrong by a tenth costs 0.0006 deg at 5 deg of elevation.
        """
        az, el = self.mount.beam_deg(encoder_az_deg, encoder_el_deg)
        is_plunged = el > 90.0
        az, el = np.where(is_plunged, az + 180.0, az), np.where(is_plunged, 180.0 - el, el)
        if self.tilt is not None:
            az, el = self.tilt.from_pedestal(az, el)
        if self.refraction is not None:
            el = self.refraction.geometric_el_deg(el, range_m, self.refraction_scale)
        return az, el

    def apparent_el_deg(self, el_deg: npt.ArrayLike, range_m: npt.ArrayLike = np.inf) -> Array:
        """Turn a geometric elevation into the one in air."""
        if self.refraction is None:
            return np.asarray(el_deg, dtype=np.float64)
        return self.refraction.apparent_el_deg(el_deg, range_m, self.refraction_scale)

    @property
    def has_air(self) -> bool:
        """Whether there is refraction."""
        return self.refraction is not None

    @property
    def frame(self) -> str:
        """What fits' biases are relative to, as text; the weather of the day does not matter, a scale is fitted."""
        terms = [
            f"{name} {value:g}" for name, value in zip(TERMS, self.mount.terms_deg().tolist(), strict=True) if value
        ]
        return "; ".join(["air" if self.has_air else "vacuum", *terms])

    def refraction_shape(self, el_deg: Array, range_m: npt.ArrayLike = np.inf) -> tuple[Array, Array]:
        """Give the refraction at geometric elevations, its value at 45 deg being 1, and its derivative, 1 / deg.

        What a scale of the refraction moves.  ValueError: there is none.
        """
        if self.refraction is None:
            raise ValueError("no air, no refraction")
        at_45_deg = refraction_at_45_deg(self.refraction)
        raised_deg, _ = self.refraction.raised_deg(el_deg, range_m)
        raised_deg, slope = self.refraction.raised_deg(el_deg + raised_deg, range_m)
        return raised_deg / at_45_deg, slope / at_45_deg

    def with_rates(
        self, az_deg: Array, el_deg: Array, range_m: Array, az_rate_deg_s: Array, el_rate_deg_s: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Turn geometric directions and their rates into angles and rates of the encoders; the range's is left out."""
        return self._on_mount(*self._about_axes(az_deg, el_deg, range_m, az_rate_deg_s, el_rate_deg_s))

    def with_rates_plunged(
        self, az_deg: Array, el_deg: Array, range_m: Array, az_rate_deg_s: Array, el_rate_deg_s: Array
    ) -> tuple[Array, Array, Array, Array]:
        """The same for an antenna beyond the zenith: azimuth half a turn further on, elevation over 90 deg."""
        az, el, az_rate, el_rate = self._about_axes(az_deg, el_deg, range_m, az_rate_deg_s, el_rate_deg_s)
        return self._on_mount(az + 180.0, 180.0 - el, az_rate, -el_rate)

    def _about_axes(
        self, az_deg: Array, el_deg: Array, range_m: Array, az_rate_deg_s: Array, el_rate_deg_s: Array
    ) -> tuple[Array, Array, Array, Array]:
        """In air, and about the leaning axes of a tilt."""
        if self.refraction is not None:
            el_deg, slope, _ = self.refraction.apparent_with_slope(el_deg, range_m, self.refraction_scale)
            el_rate_deg_s = slope * el_rate_deg_s
        if self.tilt is None:
            return az_deg, el_deg, az_rate_deg_s, el_rate_deg_s
        rates = self.tilt.rates_to_pedestal(az_deg, el_deg, az_rate_deg_s, el_rate_deg_s)
        return *self.tilt.to_pedestal(az_deg, el_deg), *rates

    def _on_mount(
        self, az_deg: Array, el_deg: Array, az_rate_deg_s: Array, el_rate_deg_s: Array
    ) -> tuple[Array, Array, Array, Array]:
        encoder_az_deg, encoder_el_deg = self.mount.encoders_deg(az_deg, el_deg)
        if self.mount.is_square:
            return encoder_az_deg, encoder_el_deg, az_rate_deg_s, el_rate_deg_s
        (aa, ae), (ea, ee) = self.mount.by_direction(az_deg, el_deg)
        az_rate, el_rate = aa * az_rate_deg_s + ae * el_rate_deg_s, ea * az_rate_deg_s + ee * el_rate_deg_s
        return encoder_az_deg, encoder_el_deg, az_rate, el_rate

    def with_partials(
        self, az_deg: npt.ArrayLike, el_deg: npt.ArrayLike, range_m: npt.ArrayLike = np.inf
    ) -> tuple[Array, Array, Partials]:
        """Give encoders_deg, with the derivatives.  The one by the range is left out: 3e-6 deg per km at 5 deg."""
        az = np.asarray(az_deg, dtype=np.float64)
        el: Array = np.asarray(el_deg, dtype=np.float64)
        slope, by_scale = np.ones_like(el), np.zeros_like(el)
        if self.refraction is not None:
            el, slope, by_scale = self.refraction.apparent_with_slope(el, range_m, self.refraction_scale)
        az, el, slope, by_scale = np.broadcast_arrays(az, el, slope, by_scale)
        ground_az, ground_el = az, el
        if self.tilt is not None:
            az, el = self.tilt.to_pedestal(az, el)
        azimuths, elevations = shares(az, el)
        terms = self.mount.terms_deg()
        (aa, ae), (ea, ee) = self.mount.by_direction(az, el)
        if self.tilt is not None:
            one, zero = np.ones_like(el), np.zeros_like(el)
            at, et = self.tilt.rates_to_pedestal(ground_az, ground_el, one, zero)  # by the ground's azimuth
            ah, eh = self.tilt.rates_to_pedestal(ground_az, ground_el, zero, one)  # and elevation
            aa, ae, ea, ee = aa * at + ae * et, aa * ah + ae * eh, ea * at + ee * et, ea * ah + ee * eh
        by_direction = np.stack([np.stack([aa, ae * slope], axis=-1), np.stack([ea, ee * slope], axis=-1)], axis=-2)
        by_state = np.stack(
            [
                np.concatenate([azimuths, (ae * by_scale)[..., None]], axis=-1),
                np.concatenate([elevations, (ee * by_scale)[..., None]], axis=-1),
            ],
            axis=-2,
        )
        return az + azimuths @ terms, el + elevations @ terms, Partials(by_direction, by_state)
