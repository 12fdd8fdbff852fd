"""Which element set of a list is used, and which segments of an ephemeris: by number, by name, nearest in time."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from acu_daemon.errors import ElementsError
from acu_daemon.orbit.element_set import ElementSet, Problem
from acu_daemon.orbit.ephemeris_segment import EphemerisSegment
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

_NAMED_IN_MESSAGES = 5
_ALIKE = 0.75  # of get_close_matches
_STATUS = re.compile(r"\s*\[[-+?A-Z]\]\s*$")
_VERSIONS = ("1.0", "2.0", "3.0")  # of orbit ephemeris messages, CCSDS 502.0


@dataclass(frozen=True, slots=True)
class Selected:
    """The set to use; why: which of several for one satellite it is, and why, empty where there is but one.

    epochs_tai_s: of all the satellite's sets, rising.
    """

    elements: ElementSet
    why: str
    warnings: list[str]
    epochs_tai_s: tuple[float, ...]


def nearest_epoch_tai_s(epochs_tai_s: Iterable[float], at_tai_s: float) -> float:
    """The nearest in time, so that its expected error is the least; the older of two that are as near."""
    return min(epochs_tai_s, key=lambda one: (abs(one - at_tai_s), one))


def select_elements(
    sets: Sequence[ElementSet], norad_id: int | None, name: str | None, at_tai_s: float, *, is_whole: bool = True
) -> Selected:
    """Choose a satellite's element set: the nearest in time, the older of two that are as near.

    Searched by `norad_id` if given; else, in a list of several satellites, by name (case, hyphens and blanks do not
    count).  A file with one satellite needs neither, but another name is warned of; without is_whole, sets of the
    file could not be read, and the one satellite left may be another.

    Raises:  ElementsError: no set, none of this satellite, or a name that two satellites bear.
    """
    if not sets:
        raise ElementsError("no usable element set in the file")
    found = list(sets)
    if norad_id is not None:
        found = _matching(sets, lambda one: one.norad_id == norad_id, f"norad_id {norad_id}", norad_id, name)
    elif not is_whole or len({one.norad_id for one in sets}) > 1:
        if name is None:
            raise ElementsError(f"{sets[0].file}: {_contents(sets)}; say which by norad_id")
        found = _matching(sets, lambda one: _plain(one.name) == _plain(name), f"name {name!r}", None, name)
    ids = sorted({one.norad_id for one in found})
    if len(ids) > 1:
        raise ElementsError(f"{sets[0].file}: the name {name!r} fits the satellites {ids}; say which by norad_id")
    warnings: list[str] = []
    if norad_id is None and name is not None and not _are_alike(name, found[0].name):
        warnings.append(_stranger(found[0].file, found[0].label, name))
    epochs_tai_s = tuple(sorted({one.epoch_tai_s for one in found}))
    nearest_tai_s = nearest_epoch_tai_s(epochs_tai_s, at_tai_s)
    chosen = next(one for one in found if one.epoch_tai_s == nearest_tai_s)
    return Selected(chosen, _why(chosen, found, at_tai_s), warnings, epochs_tai_s)


def _why(chosen: ElementSet, found: list[ElementSet], at_tai_s: float) -> str:
    epochs = sorted({one.epoch_tai_s for one in found} - {chosen.epoch_tai_s}, key=lambda one: abs(one - at_tai_s))
    if not epochs:
        return ""
    return (
        f"{chosen.where}: {chosen.label}: of {len(epochs) + 1} sets the one of {utc_text(chosen.epoch_tai_s, 0)} is "
        f"used, {_apart(chosen.epoch_tai_s, at_tai_s)}: nearest in time, so its expected error is the least; the next "
        f"is {_apart(epochs[0], at_tai_s)}"
    )


def _apart(epoch_tai_s: float, at_tai_s: float) -> str:
    apart_s = epoch_tai_s - at_tai_s
    text = f"{abs(apart_s) / DAY_S:.1f} days" if abs(apart_s) > 2 * DAY_S else f"{abs(apart_s) / 3600.0:.1f} h"
    return f"{text} {'after' if apart_s > 0 else 'before'} {utc_text(at_tai_s, 0)}"


def is_of(problem: Problem, norad_id: int | None, name: str) -> bool:
    """Whether a set that could not be read is that of a satellite, or text of a file bears its name."""
    if norad_id is not None and norad_id in problem.norad_ids:
        return True
    is_named = _plain(problem.name) == _plain(name) and problem.name != ""
    return is_named and (norad_id is None or not problem.norad_ids)


def select_segments(
    segments: Sequence[EphemerisSegment], norad_id: int | None, name: str, *, is_whole: bool = True
) -> tuple[list[EphemerisSegment], list[str]]:
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


def _is_named(segment: EphemerisSegment, name: str) -> bool:
    return _plain(name) in (_plain(segment.name), _plain(segment.object_id))


def _doubt_of(segment: EphemerisSegment, norad_id: int | None, name: str) -> list[str]:
    if _are_alike(name, segment.name) or _is_named(segment, name) or _is_number(segment, norad_id):
        return []
    return [_stranger(segment.file, segment.label, name)]


def _are_alike(name: str, other: str) -> bool:
    """A name that is longer or shorter than the file's, such as ISS for ISS (ZARYA), is no other one, nor is none."""
    short, long = sorted((_plain(name), _plain(other)), key=len)
    return short in long


def _stranger(file: str, label: str, name: str) -> str:
    return f"{file}: the file is of {label}, the satellite is named {name!r}: is it the right file?"


def _version_of(segment: EphemerisSegment) -> list[str]:
    if segment.kind != "oem" or segment.version in _VERSIONS:
        return []
    given = f"CCSDS_OEM_VERS is {segment.version[:40]!r}" if segment.version else "CCSDS_OEM_VERS is missing"
    return [f"{segment.file}: {given}; versions {', '.join(_VERSIONS)} are known, the file is read as those are"]


def _labels(segments: Sequence[EphemerisSegment]) -> list[str]:
    return list(dict.fromkeys(one.label for one in segments))


def _is_number(segment: EphemerisSegment, norad_id: int | None) -> bool:
    text = segment.object_id
    return norad_id is not None and text.isascii() and text.isdigit() and int(text) == norad_id


def _matching(
    sets: Sequence[ElementSet], fits: Callable[[ElementSet], bool], wanted: str, norad_id: int | None, name: str | None
) -> list[ElementSet]:
    found = [one for one in sets if fits(one)]
    if not found:
        near = list(dict.fromkeys(one.label for one in _near(sets, norad_id, name)))[:_NAMED_IN_MESSAGES]
        meant = f" (did you mean {' or '.join(near)}?)" if near else ""
        raise ElementsError(f"{sets[0].file}: no element set with {wanted}{meant}; {_contents(sets)}")
    return found


def _near(sets: Sequence[ElementSet], norad_id: int | None, name: str | None) -> list[ElementSet]:
    """Sets that may be meant: of a name alike, then of a number with one wrong digit or two changed ones."""
    by_name = {_plain(one.name): one for one in reversed(sets) if one.name}
    plain = _plain(name or "")
    alike = [by_name[near] for near in get_close_matches(plain, list(by_name), _NAMED_IN_MESSAGES, _ALIKE)]
    within = sorted((one for key, one in by_name.items() if plain and plain in key), key=lambda one: len(one.name))
    numbered = [one for one in sets if norad_id is not None and _is_slip(str(norad_id), str(one.norad_id))]
    return [*(one for one in alike if _plain(one.name) == plain), *within, *alike, *numbered]


def _is_slip(one: str, other: str) -> bool:
    """Whether two numbers differ by one digit, or by two neighbours changed."""
    if len(one) != len(other):
        return False
    apart = [i for i in range(len(one)) if one[i] != other[i]]
    if len(apart) == 2 and apart[1] == apart[0] + 1:
        return one[apart[0]] == other[apart[1]] and one[apart[1]] == other[apart[0]]
    return len(apart) == 1


def _contents(sets: Sequence[ElementSet]) -> str:
    labels = list(dict.fromkeys(one.label for one in sets))
    if len(labels) > _NAMED_IN_MESSAGES:
        return f"the file holds {len(labels)} satellites, such as {', '.join(labels[:2])}"
    return f"the file holds {', '.join(labels)}"


def _plain(name: str) -> str:
    """Without case, blanks, hyphens, and the status that lists put after a name, such as [+]."""
    name = _STATUS.sub("", name)
    return "".join(c for c in name.casefold() if c not in " -_")
