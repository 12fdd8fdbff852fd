"""Whether elements are fit for use: sanity limits, age, decay."""

from dataclasses import dataclass

import numpy as np

from acu_daemon.errors import OrbitError
from acu_daemon.orbit.aging import expected_error
from acu_daemon.orbit.brouwer import BrouwerElements
from acu_daemon.orbit.element_set import ElementSet
from acu_daemon.orbit.ephemeris import EphemerisPropagator
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S, DEG, EARTH_EQUATORIAL_RADIUS_M

_DECAYED_PERIGEE_KM = 120.0  # below this an orbit does not last a revolution
_AHEAD_DAYS = 2.0  # a set that far ahead of the clock may mean that the clock is wrong


@dataclass(frozen=True, slots=True)
class ElementLimits:
    """What elements must keep to; the defaults suit low orbits.  `[elements.limits]` of a satellite's TOML."""

    min_semi_major_axis_km: float = 6500.0
    max_semi_major_axis_km: float = 8500.0
    min_eccentricity: float = 0.0
    max_eccentricity: float = 0.1
    min_inclination_deg: float = 0.0
    max_inclination_deg: float = 180.0
    warn_age_days: float = 10.0
    max_age_days: float = 30.0


def check_elements(elements: ElementSet, limits: ElementLimits, now_tai_s: float) -> tuple[list[str], list[str]]:
    """Check one element set against the limits, its age, and decay.

    Returns: errors (it must not be used) and warnings, each with file, line and reason.
    """
    label = f"{elements.where}: {elements.label}"
    a_m, e = elements.semi_major_axis_m, elements.eccentricity
    errors = _outside(label, a_m, e, elements.inclination_rad, limits)
    too_old, warnings = _age(label, elements, limits, now_tai_s)
    errors += too_old
    if not errors:
        try:
            Sgp4Propagator(elements).states_teme(np.array([now_tai_s]))
        except OrbitError as error:
            errors.append(f"{elements.where}: {error}")
    return errors, warnings


def check_brouwer(
    elements: BrouwerElements, limits: ElementLimits, now_tai_s: float, file: str
) -> tuple[list[str], list[str]]:
    """Check elements written in a TOML file against the limits and their age; errors and warnings as texts."""
    label = f"{file}: {elements.name}"
    too_old, warnings = _age(label, elements, limits, now_tai_s)
    return [*_outside(label, elements.a_m, elements.e, elements.i_rad, limits), *too_old], warnings


def check_ephemeris(
    propagator: EphemerisPropagator, limits: ElementLimits, now_tai_s: float
) -> tuple[list[str], list[str]]:
    """Check that an ephemeris covers the present and that its orbit there lies within the limits.

    Its age does not count: it says itself how long it holds.  Returns: errors and warnings as texts.
    """
    ephemeris = propagator.ephemeris
    label = f"{ephemeris.file}: {ephemeris.label}"
    try:
        orbit = osculating_from_state(*propagator.states_teme(np.array([now_tai_s])))
    except OrbitError:
        now = utc_text(now_tai_s, 0)
        text = f"{label}: the ephemeris covers {ephemeris.coverage}, which {now} is not within; fetch one that does"
        return [text], []
    return _outside(label, float(orbit.a_m[0]), float(orbit.e[0]), float(orbit.i_rad[0]), limits), []


def _outside(label: str, a_m: float, e: float, i_rad: float, limits: ElementLimits) -> list[str]:
    ranges = (
        ("semi-major axis", a_m / 1e3, limits.min_semi_major_axis_km, limits.max_semi_major_axis_km, " km"),
        ("eccentricity", e, limits.min_eccentricity, limits.max_eccentricity, ""),
        ("inclination", i_rad / DEG, limits.min_inclination_deg, limits.max_inclination_deg, " deg"),
    )
    errors = [
        f"{label}: {what} {value:.7g}{unit} is outside {low:g}..{high:g}{unit}; "
        "if it is right, widen [elements.limits] in the satellite's file"
        for what, value, low, high, unit in ranges
        if not low <= round(value, 9) <= high
    ]
    perigee_km = (a_m * (1.0 - e) - EARTH_EQUATORIAL_RADIUS_M) / 1e3
    if not perigee_km >= _DECAYED_PERIGEE_KM:
        errors.append(
            f"{label}: mean perigee at {perigee_km:.0f} km height, under {_DECAYED_PERIGEE_KM:.0f} km: "
            "the satellite has decayed, or the elements are wrong"
        )
    return errors


def _age(
    label: str, elements: ElementSet | BrouwerElements, limits: ElementLimits, now_tai_s: float
) -> tuple[list[str], list[str]]:
    """Errors and warnings, with what the age costs and the key that allows it."""
    age_days = (now_tai_s - elements.epoch_tai_s) / DAY_S
    relation = f"{age_days:.1f} days old" if age_days > 0 else f"{-age_days:.1f} days ahead of the clock"
    text = f"{label}: the epoch {utc_text(elements.epoch_tai_s, 0)} is {relation}"
    if abs(age_days) > limits.max_age_days:
        cost = expected_error(elements, now_tai_s)
        return [f"{text}, the limit is {limits.max_age_days:g} days; fetch newer elements: {cost} ({_key(limits)})"], []
    if abs(age_days) > limits.warn_age_days:
        return [], [f"{text}; fetch newer elements: {expected_error(elements, now_tai_s)}"]
    if age_days < -_AHEAD_DAYS:
        return [], [f"{text}: is the clock right?"]
    return [], []


def _key(limits: ElementLimits) -> str:
    """The key of the age limit and where its value comes from."""
    is_default = limits.max_age_days == ElementLimits().max_age_days
    source = "the default; set it in" if is_default else "set in"
    return f"max_age_days = {limits.max_age_days:g}, {source} [elements.limits] of the satellite's file"
