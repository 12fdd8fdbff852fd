"""SGP4/SDP4 through the sgp4 package, with the WGS72 constants element sets are made with."""

from collections.abc import Sequence
from functools import lru_cache
from math import isfinite, pi
from typing import Any

import numpy as np
from sgp4.api import SGP4_ERRORS, WGS72, Satrec, SatrecArray

from acu_daemon.errors import OrbitError
from acu_daemon.model import Correction
from acu_daemon.orbit.believed import DECAYED, INSIDE_EARTH, TOO_LARGE, BelievedSpan, States, believed_span
from acu_daemon.orbit.correction import corrected_ellipse
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.timescales import utc_days, utc_text
from acu_daemon.units import DAY_S, Array

_DAY_ZERO_JD = 2433281.5  # 1949-12-31T00:00, from where sgp4init counts the epoch's days
_DECAYS = (DECAYED, INSIDE_EARTH)
_SPARE_S = 120.0  # so much of what is believed stays outside the spans: fits and buffers look beyond their times


class Sgp4Propagator:
    """A satellite's motion by SGP4, the correction added to the mean elements before SGP4 is set up.

    Times enter as the seconds elapsed since the epoch, so a leap second in between moves nothing.
    Answers are given as long as those of the elements themselves are believed (`orbit.believed`).
    Immutable; compared and pickled as the elements and the correction.
    """

    def __init__(self, elements: ElementSet, correction: Correction | None = None) -> None:
        self.elements = elements
        self.correction = correction or Correction()
        self._satrec = _satrec(elements, self.correction)
        self._believed = _believed_span(elements)
        self._first_tai_s = elements.epoch_tai_s + self._believed.first_days * DAY_S
        self._last_tai_s = elements.epoch_tai_s + self._believed.last_days * DAY_S

    @property
    def kind(self) -> str:
        return self.elements.kind

    @property
    def epoch_tai_s(self) -> float:
        return self.elements.epoch_tai_s

    @property
    def spans_tai_s(self) -> tuple[tuple[float, float], ...]:
        """When there are answers: from the epoch to both sides up to the decay, for most satellites always."""
        first, last = self._first_tai_s + _SPARE_S, self._last_tai_s - _SPARE_S
        return ((first, last) if first < last else (self.epoch_tai_s, self.epoch_tai_s),)

    @property
    def end_reason(self) -> str:
        """Why there are no answers after the last span."""
        return _reason(self._believed.error_after)

    def states_teme(self, tai_s: Array) -> tuple[Array, Array]:
        """Positions (N, 3) in metres and velocities (N, 3) in m/s, TEME of date, at the times (N,).

        Raises:  OrbitError: SGP4 has no answer for one of the times, or none that is believed; names satellite, the
                 first such time and why.
        """
        codes, r_km, v_km_s = self._satrec.sgp4_array(*self._days(tai_s))
        if codes.any() or not np.isfinite(r_km).all():
            bad = int(np.argmax((codes != 0) | ~np.isfinite(r_km).all(axis=1)))
            reason = _reason(int(codes[bad])) if codes[bad] else "the position is not finite"
            raise OrbitError(_refusal(self, float(tai_s[bad]), reason))
        return r_km * 1e3, v_km_s * 1e3

    def states_together(self, corrections: Sequence[Correction], tai_s: Array) -> tuple[Array, Array]:
        """Positions and velocities (M, N, 3) with each of the M corrections, like `states_teme`.

        Raises:  OrbitError: as `states_teme` does.
        """
        satrecs = SatrecArray([_satrec(self.elements, one) for one in corrections])
        codes, r_km, v_km_s = satrecs.sgp4(*self._days(tai_s))
        if codes.any() or not np.isfinite(r_km).all():
            for one in corrections:
                self.corrected(one).states_teme(tai_s)  # says which time it was, and why
        return r_km * 1e3, v_km_s * 1e3

    def _days(self, tai_s: Array) -> tuple[Array, Array]:
        """Julian days of the times (N,), and their fractions.  OrbitError: what is not believed."""
        if tai_s.size and not (self._first_tai_s <= tai_s.min() and tai_s.max() <= self._last_tai_s):
            raise OrbitError(self._disbelief(tai_s))
        day = np.full(tai_s.shape, self._satrec.jdsatepoch)
        return day, self._satrec.jdsatepochF + (tai_s - self.epoch_tai_s) / DAY_S

    def _disbelief(self, tai_s: Array) -> str:
        """What is said of times outside what is believed, or not finite."""
        is_in = (tai_s >= self._first_tai_s) & (tai_s <= self._last_tai_s)
        at = float(tai_s[np.argmin(is_in)])
        if not isfinite(at):
            return f"{self.elements.label}: no position at a time that is not finite"
        is_after = at > self._last_tai_s
        error = self._believed.error_after if is_after else self._believed.error_before
        edge = self._last_tai_s if is_after else self._first_tai_s
        if not is_after and error in _DECAYS:
            return _refusal(self, at, f"so far back from the epoch SGP4 has no orbit, up to {utc_text(edge, 0)}")
        return _refusal(self, at, f"{_reason(error)}, {'from' if is_after else 'up to'} {utc_text(edge, 0)}")

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


@lru_cache(maxsize=1024)
def _believed_span(elements: ElementSet) -> BelievedSpan:
    satrec = _satrec(elements, Correction())

    def states(days: Array) -> States:
        codes, r_km, v_km_s = satrec.sgp4_array(np.full(days.shape, satrec.jdsatepoch), satrec.jdsatepochF + days)
        return codes, r_km * 1e3, v_km_s * 1e3

    return believed_span(states, elements.semi_major_axis_m, elements.eccentricity)


def _reason(error: int) -> str:
    if error == TOO_LARGE:
        return "what SGP4 gives is no orbit near that of the elements"
    if error == INSIDE_EARTH:
        return "the satellite has decayed (its perigee lies inside the Earth)"
    text = "the satellite has decayed" if error == DECAYED else SGP4_ERRORS.get(error, "no answer")
    return f"{text} (SGP4 error {error})"


def _refusal(source: Sgp4Propagator, tai_s: float, reason: str) -> str:
    elements = source.elements
    age_days = (tai_s - elements.epoch_tai_s) / DAY_S
    relation = "after" if age_days >= 0.0 else "before"
    advice = "use newer elements"
    if source.correction != Correction() and "decayed" not in reason:
        advice = (
            "so far do the readings correct the elements: are they this satellite's, and is [uncertainty] too wide?"
        )
    return (
        f"{elements.label}: no position at {utc_text(tai_s)}, {abs(age_days):.1f} days {relation} the epoch of the "
        f"elements: {reason}; {advice}"
    )
