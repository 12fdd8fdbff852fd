"""Which element set of a list is used, and whether it is fit for use: sanity limits, age, decay."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from acu_daemon.errors import ElementsError, OrbitError
from acu_daemon.orbit.brouwer import BrouwerElements
from acu_daemon.orbit.element_set import ElementSet, Problem
from acu_daemon.orbit.ephemeris import OemPropagator
from acu_daemon.orbit.kepler import osculating_from_state
from acu_daemon.orbit.oem import OemSegment
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S, DEG, EARTH_EQUATORIAL_RADIUS_M

__all__ = [
    "ElementLimits",
    "ElementSet",
    "Problem",
    "check_brouwer",
    "check_elements",
    "check_ephemeris",
    "select_elements",
    "select_segments",
]

_DECAYED_PERIGEE_KM = 120.0  # below this an orbit does not last a revolution
_NAMED_IN_MESSAGES = 5
_VERSIONS = ("1.0", "2.0", "3.0")  # of orbit ephemeris messages, CCSDS 502.0


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
    errors, warnings = _check(label, a_m, e, elements.inclination_rad, elements.epoch_tai_s, limits, now_tai_s)
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
    return _check(label, elements.a_m, elements.e, elements.i_rad, elements.epoch_tai_s, limits, now_tai_s)


def check_ephemeris(propagator: OemPropagator, limits: ElementLimits, now_tai_s: float) -> tuple[list[str], list[str]]:
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
    return _check(label, float(orbit.a_m[0]), float(orbit.e[0]), float(orbit.i_rad[0]), now_tai_s, limits, now_tai_s)


def _check(
    label: str, a_m: float, e: float, i_rad: float, epoch_tai_s: float, limits: ElementLimits, now_tai_s: float
) -> tuple[list[str], list[str]]:
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
    warnings: list[str] = []
    age_days = (now_tai_s - epoch_tai_s) / DAY_S
    if abs(age_days) > limits.warn_age_days:
        relation = f"{age_days:.1f} days old" if age_days > 0 else f"{-age_days:.1f} days ahead of the clock"
        text = f"{label}: the epoch {utc_text(epoch_tai_s, 0)} is {relation}"
        if abs(age_days) > limits.max_age_days:
            errors.append(f"{text}, the limit is {limits.max_age_days:g} days; fetch newer elements")
        else:
            warnings.append(f"{text}; predictions may be off, fetch newer elements")
    return errors, warnings


def select_elements(
    sets: Sequence[ElementSet], norad_id: int | None, name: str | None, now_tai_s: float, *, is_whole: bool = True
) -> tuple[ElementSet, list[str]]:
    """Choose a satellite's element set: the newest not after now, else the oldest.

    Searched by `norad_id` if given; else, in a list of several satellites, by name (case, hyphens and blanks do not
    count).  A file with one satellite needs neither, but another name is warned of; without is_whole, sets of the
    file could not be read, and the one satellite left may be another.

    Returns: the set, and warnings.
    Raises:  ElementsError: no set, none of this satellite, or a name that two satellites bear.
    """
    if not sets:
        raise ElementsError("no usable element set in the file")
    found = list(sets)
    if norad_id is not None:
        found = _matching(sets, lambda one: one.norad_id == norad_id, f"norad_id {norad_id}")
    elif not is_whole or len({one.norad_id for one in sets}) > 1:
        if name is None:
            raise ElementsError(f"{sets[0].file}: {_contents(sets)}; say which by norad_id")
        found = _matching(sets, lambda one: _plain(one.name) == _plain(name), f"name {name!r}")
    ids = sorted({one.norad_id for one in found})
    if len(ids) > 1:
        raise ElementsError(f"{sets[0].file}: the name {name!r} fits the satellites {ids}; say which by norad_id")
    warnings: list[str] = []
    if norad_id is None and name is not None and not _are_alike(name, found[0].name):
        warnings.append(_stranger(found[0].file, found[0].label, name))
    past = [one for one in found if one.epoch_tai_s <= now_tai_s]
    if past:
        return max(past, key=lambda one: one.epoch_tai_s), warnings
    oldest = min(found, key=lambda one: one.epoch_tai_s)
    ahead = f"every epoch is ahead of the clock, the oldest ({utc_text(oldest.epoch_tai_s, 0)}) is used"
    return oldest, [*warnings, f"{oldest.where}: {oldest.label}: {ahead}"]


def select_segments(
    segments: Sequence[OemSegment], norad_id: int | None, name: str, *, is_whole: bool = True
) -> tuple[list[OemSegment], list[str]]:
    """Choose a satellite's segments of an ephemeris.

    A file with one satellite is taken as it is, with a warning where nothing in it says that it is this one; else, or
    without is_whole (segments could not be read), the name must be the OBJECT_NAME or the OBJECT_ID (case, hyphens and
    blanks do not count), or the OBJECT_ID be the norad_id.
    An OBJECT_ID that is another catalogue number is never taken.
    Returns: the segments, and warnings.
    Raises:  ElementsError: none of this satellite, or two.
    """
    file, labels = segments[0].file, _labels(segments)
    found = [one for one in segments if norad_id is None or not one.object_id.isdigit() or _is_number(one, norad_id)]
    if not is_whole or len(labels) > 1:
        found = [one for one in found if _is_named(one, name) or _is_number(one, norad_id)]
    if not found:
        also = f" or with norad_id {norad_id}" if norad_id is not None else ""
        raise ElementsError(
            f"{file}: no segment with name {name!r}{also}; the file holds {', '.join(labels)}: write one's name or "
            "designator as the satellite's name"
        )
    if len(labels := _labels(found)) > 1:
        raise ElementsError(
            f"{file}: the name {name!r} fits {', '.join(labels)}; write one's designator as the satellite's name"
        )
    return found, [*_doubt_of(found[0], norad_id, name), *_version_of(found[0])]


def _is_named(segment: OemSegment, name: str) -> bool:
    return _plain(name) in (_plain(segment.name), _plain(segment.object_id))


def _doubt_of(segment: OemSegment, norad_id: int | None, name: str) -> list[str]:
    if _are_alike(name, segment.name) or _is_named(segment, name) or _is_number(segment, norad_id):
        return []
    return [_stranger(segment.file, segment.label, name)]


def _are_alike(name: str, other: str) -> bool:
    """A name that is longer or shorter than the file's, such as ISS for ISS (ZARYA), is no other one, nor is none."""
    short, long = sorted((_plain(name), _plain(other)), key=len)
    return short in long


def _stranger(file: str, label: str, name: str) -> str:
    return f"{file}: the file is of {label}, the satellite is named {name!r}: is it the right file?"


def _version_of(segment: OemSegment) -> list[str]:
    if segment.version in _VERSIONS:
        return []
    given = f"CCSDS_OEM_VERS is {segment.version[:40]!r}" if segment.version else "CCSDS_OEM_VERS is missing"
    return [f"{segment.file}: {given}; versions {', '.join(_VERSIONS)} are known, the file is read as those are"]


def _labels(segments: Sequence[OemSegment]) -> list[str]:
    return list(dict.fromkeys(one.label for one in segments))


def _is_number(segment: OemSegment, norad_id: int | None) -> bool:
    text = segment.object_id
    return norad_id is not None and text.isascii() and text.isdigit() and int(text) == norad_id


def _matching(sets: Sequence[ElementSet], fits: Callable[[ElementSet], bool], wanted: str) -> list[ElementSet]:
    found = [one for one in sets if fits(one)]
    if not found:
        raise ElementsError(f"{sets[0].file}: no element set with {wanted}; {_contents(sets)}")
    return found


def _contents(sets: Sequence[ElementSet]) -> str:
    labels = list(dict.fromkeys(one.label for one in sets))
    more = f" and {len(labels) - _NAMED_IN_MESSAGES} more" if len(labels) > _NAMED_IN_MESSAGES else ""
    return f"the file holds {', '.join(labels[:_NAMED_IN_MESSAGES])}{more}"


def _plain(name: str) -> str:
    return "".join(c for c in name.casefold() if c not in " -_")
