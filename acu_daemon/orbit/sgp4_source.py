"""SGP4/SDP4 through the sgp4 package, with the WGS72 constants element sets are made with."""

from functools import lru_cache
from math import pi
from typing import Any

import numpy as np
from sgp4.api import SGP4_ERRORS, WGS72, Satrec

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction
from acu_daemon.orbit.correction import corrected_ellipse
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.timescales import utc_days, utc_text
from acu_daemon.units import DAY_S, Array

_DAY_ZERO_JD = 2433281.5  # 1949-12-31T00:00, from where sgp4init counts the epoch's days
_DECAYED = 6


class Sgp4Propagator:
    """A satellite's motion by SGP4, the correction added to the mean elements before SGP4 is set up.

    Times enter as the seconds elapsed since the epoch, so a leap second in between moves nothing.
    Immutable; compared and pickled as the elements and the correction.
    """

    def __init__(self, elements: ElementSet, correction: Correction | None = None) -> None:
        self.elements = elements
        self.correction = correction or Correction()
        self._satrec = _satrec(elements, self.correction)

    @property
    def kind(self) -> str:
        return self.elements.kind

    @property
    def epoch_tai_s(self) -> float:
        return self.elements.epoch_tai_s

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and velocities (N, 3) in m/s, TEME of date, at the times (N,).

        Raises:  OrbitError: SGP4 has no answer for one of the times; names satellite, the first such time and why.
        """
        day = np.full(tai_s.shape, self._satrec.jdsatepoch)
        fraction = self._satrec.jdsatepochF + (tai_s - self.epoch_tai_s) / DAY_S
        codes, r_km, v_km_s = self._satrec.sgp4_array(day, fraction)
        if codes.any() or not np.isfinite(r_km).all():
            bad = int(np.argmax((codes != 0) | ~np.isfinite(r_km).all(axis=1)))
            raise OrbitError(_refusal(self, float(tai_s[bad]), int(codes[bad])))
        return r_km * 1e3, v_km_s * 1e3

    def corrected(self, correction: Correction) -> "Sgp4Propagator":
        """The same elements with this correction in place of any earlier one."""
        return Sgp4Propagator(self.elements, correction)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sgp4Propagator):
            return NotImplemented
        return (self.elements, self.correction) == (other.elements, other.correction)

    def __hash__(self) -> int:
        return hash((self.elements, self.correction))

    def __reduce__(self) -> tuple[Any, ...]:
        return Sgp4Propagator, (self.elements, self.correction)


def _satrec(elements: ElementSet, correction: Correction) -> Any:
    ellipse = corrected_ellipse(elements.eccentricity, elements.argp_rad, elements.mean_anomaly_rad, correction)
    satrec = Satrec()
    satrec.sgp4init(
        WGS72,
        "i",  # improved mode of AIAA 2006-6753
        0,  # the catalogue number takes no part, and large ones do not fit
        _epoch_days(elements.epoch_tai_s),
        elements.bstar_per_radius,
        0.0,  # the mean motion's derivatives take no part in SGP4
        0.0,
        ellipse.e,
        ellipse.argp_rad,
        elements.inclination_rad + correction.delta_inclination_rad,
        ellipse.mean_anomaly_rad % (2.0 * pi),
        (elements.mean_motion_rad_s + correction.delta_mean_motion_rad_s) * 60.0,
        (elements.raan_rad + correction.delta_raan_rad) % (2.0 * pi),
    )
    return satrec


@lru_cache(maxsize=64)
def _epoch_days(epoch_tai_s: float) -> float:
    day, fraction = utc_days(np.array(epoch_tai_s))
    return float(day) - _DAY_ZERO_JD + float(fraction)


def _refusal(source: Sgp4Propagator, tai_s: float, code: int) -> str:
    elements = source.elements
    reason = "the satellite has decayed" if code == _DECAYED else SGP4_ERRORS.get(code, "the position is not finite")
    age_days = (tai_s - elements.epoch_tai_s) / DAY_S
    advice = "use newer elements"
    if code != _DECAYED and source.correction != Correction():
        advice = (
            "so far do the readings correct the elements: are they this satellite's, and is [uncertainty] too wide?"
        )
    return (
        f"{elements.label}: no position at {utc_text(tai_s)}, {age_days:.1f} days after the epoch of the elements: "
        f"{reason} (SGP4 error {code}); {advice}"
    )
