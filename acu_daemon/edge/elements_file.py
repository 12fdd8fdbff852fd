"""From a satellite's TOML to a propagator: reads the file of elements it names, chooses the set, checks it."""

import time
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Literal

from acu_daemon.config.satellite_tables import (
    BrouwerSection,
    ElementsFileSection,
    SatelliteFile,
    StationElementsSection,
)
from acu_daemon.edge.orbit_file import EPHEMERIS_PARSERS, SET_PARSERS, EphemerisParser, read_orbit_file
from acu_daemon.errors import ElementsError
from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.brouwer import BrouwerElements, BrouwerPropagator
from acu_daemon.orbit.contents import FileKind
from acu_daemon.orbit.element_set import Problem
from acu_daemon.orbit.elements import check_brouwer, check_elements, check_ephemeris
from acu_daemon.orbit.ephemeris import Ephemeris, EphemerisPropagator
from acu_daemon.orbit.named_sets import named_sets
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.selection import is_of, select_elements, select_segments
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DEG

NAMED_PROBLEMS = 5
RECENT_S = 2.0  # a file that changed within this time may still be in the writing: so long it is read again
AGAIN_S = 0.2
_NO_ORIENTATION = EarthOrientation()


@dataclass(frozen=True, slots=True)
class LoadedElements:
    """A propagator with what has to be said about its elements: errors forbid a pass, warnings do not."""

    propagator: Propagator
    label: str
    epoch_tai_s: float
    errors: list[str]
    warnings: list[str]
    choice: str = ""  # which of several sets is used, and why
    epochs_tai_s: tuple[float, ...] = ()  # of all the satellite's sets in the file
    file: str = ""  # where it was read
    expected_m: float = inf  # how far off along the track it is expected to be, where sources were compared
    confirmed_tai_s: float | None = None  # epoch of a set that was doubtful, and that the last pass bears out

    @property
    def about(self) -> str:
        """Which they are, for people: their kind and epoch."""
        return f"{self.propagator.kind} of {utc_text(self.epoch_tai_s, 0)}"


def load_elements(
    satellite: SatelliteFile,
    toml_path: Path,
    now_tai_s: float,
    orientation: EarthOrientation = _NO_ORIENTATION,
    at_tai_s: float | None = None,
) -> LoadedElements:
    """Make the satellite's propagator.

    Of a file that is being written just now half may be there: what is wrong with it is looked at again for a moment.
    orientation: the station's; an Earth-fixed ephemeris needs it.  at_tai_s: for when elements are wanted, such as the
    pass, where that is not now: of several sets the nearest to it is taken.
    Raises: ElementsError: names file, line and reason.
    """
    end_s = time.monotonic() + RECENT_S
    while True:
        is_last = time.monotonic() > end_s or not _is_recent(satellite, toml_path)
        try:
            loaded = _load(satellite, toml_path, now_tai_s, orientation, now_tai_s if at_tai_s is None else at_tai_s)
        except ElementsError:
            if is_last:
                raise
        else:
            if is_last or not (loaded.errors or loaded.warnings):
                return loaded
        time.sleep(AGAIN_S)


def _is_recent(satellite: SatelliteFile, toml_path: Path) -> bool:
    """Whether the file has changed just now, or was taken away from its directory just now."""
    section = satellite.elements
    if not isinstance(section, ElementsFileSection):
        return False
    path = toml_path.parent / section.file
    try:
        return abs(time.time() - (path if path.exists() else path.parent).stat().st_mtime) < RECENT_S
    except OSError:
        return False


def _load(
    satellite: SatelliteFile, toml_path: Path, now_tai_s: float, orientation: EarthOrientation, at_tai_s: float
) -> LoadedElements:
    section = satellite.elements
    if isinstance(section, BrouwerSection):
        return _from_brouwer(satellite, section, toml_path, now_tai_s)
    if isinstance(section, StationElementsSection):
        raise ElementsError(f'{toml_path}: elements.kind = "station", but station.toml has no [elements] source')
    path = toml_path.parent / section.file
    try:
        kind, text = read_orbit_file(path)
    except OSError as error:
        raise ElementsError(f"{toml_path}: elements.file = {section.file!r}: {path}: {error.strerror}") from None
    loaded = load_text(satellite, section, path, kind, text, now_tai_s, orientation, at_tai_s)
    if kind == section.kind:
        return loaded
    said = f'{toml_path}: elements.kind = "{section.kind}", but {path} is of kind "{kind}" and read as that'
    return replace(loaded, warnings=[said, *loaded.warnings])


def load_text(
    satellite: SatelliteFile,
    section: ElementsFileSection | StationElementsSection,
    path: Path,
    kind: FileKind,
    text: str,
    now_tai_s: float,
    orientation: EarthOrientation,
    at_tai_s: float,
    *,
    must_match: bool = False,
) -> LoadedElements:
    """Make the satellite's propagator of a file's text.  ElementsError: names file, line and reason.

    must_match: nobody has said that the file is this satellite's: an ephemeris must bear its name or number.
    """
    loaded = (
        _from_ephemeris(satellite, section, path, text, now_tai_s, orientation, EPHEMERIS_PARSERS[kind], must_match)
        if kind != "tle" and kind != "omm"
        else _from_sets(satellite, section, path, text, now_tai_s, at_tai_s, kind)
    )
    return replace(loaded, file=str(path))


def _from_brouwer(
    satellite: SatelliteFile, section: BrouwerSection, toml_path: Path, now_tai_s: float
) -> LoadedElements:
    elements = BrouwerElements(
        name=satellite.satellite.name,
        epoch_tai_s=section.epoch_utc,
        a_m=section.semi_major_axis_km * 1e3,
        e=section.eccentricity,
        i_rad=section.inclination_deg * DEG,
        raan_rad=section.raan_deg * DEG,
        argp_rad=section.arg_perigee_deg * DEG,
        mean_anomaly_rad=section.mean_anomaly_deg * DEG,
    )
    errors, warnings = check_brouwer(elements, section.limits.limits(), now_tai_s, str(toml_path))
    propagator = BrouwerPropagator(elements, section.short_period)
    return LoadedElements(propagator, elements.name, elements.epoch_tai_s, errors, warnings)


def _from_sets(
    satellite: SatelliteFile,
    section: ElementsFileSection | StationElementsSection,
    path: Path,
    text: str,
    now_tai_s: float,
    at_tai_s: float,
    kind: Literal["tle", "omm"],
) -> LoadedElements:
    wanted = satellite.satellite
    sets, problems = named_sets(kind, text, str(path), wanted.norad_id) if wanted.norad_id else ([], [])
    if not sets:
        sets, problems = SET_PARSERS[kind](text, str(path))
    lost = [one for one in problems if one.kind == "lost"]
    own = [one for one in problems if one.kind != "note" and is_of(one, wanted.norad_id, wanted.name)]
    if not sets:
        raise ElementsError("\n".join(_few([*own, *_others(lost, own)] or problems)))
    try:
        selected = select_elements(sets, wanted.norad_id, wanted.name, at_tai_s, is_whole=not (lost or own))
    except ElementsError as error:
        raise ElementsError("\n".join([*_few(own), str(error), *_few(_others(lost, own))])) from None
    chosen = selected.elements
    notes = [one for one in problems if one.kind == "note" and one.line == chosen.line and one.record == chosen.record]
    errors, more = check_elements(chosen, section.limits.limits(), now_tai_s)
    warnings = [*selected.warnings, *more, *map(str, notes), *_few([*own, *_others(lost, own)])]
    return LoadedElements(
        Sgp4Propagator(chosen),
        chosen.label,
        chosen.epoch_tai_s,
        errors,
        warnings,
        choice=selected.why,
        epochs_tai_s=selected.epochs_tai_s,
    )


def _others(problems: list[Problem], own: list[Problem]) -> list[Problem]:
    return [one for one in problems if one not in own]


def _from_ephemeris(
    satellite: SatelliteFile,
    section: ElementsFileSection | StationElementsSection,
    path: Path,
    text: str,
    now_tai_s: float,
    orientation: EarthOrientation,
    parse: EphemerisParser,
    must_match: bool,
) -> LoadedElements:
    segments, problems = parse(text, str(path))
    if not segments:
        raise ElementsError("\n".join(_few(problems, "segments")))
    wanted = satellite.satellite
    try:
        segments, doubts = select_segments(
            segments, wanted.norad_id, section.object or wanted.name, is_whole=not problems and not must_match
        )
    except ElementsError as error:
        raise ElementsError("\n".join([str(error), *_few(problems, "segments")])) from None
    propagator = EphemerisPropagator(Ephemeris(segments, orientation))
    errors, warnings = check_ephemeris(propagator, section.limits.limits(), now_tai_s)
    return LoadedElements(
        propagator,
        propagator.ephemeris.label,
        propagator.epoch_tai_s,
        errors,
        [*doubts, *warnings, *(note for one in segments for note in one.notes), *_few(problems, "segments")],
    )


def _few(problems: list[Problem], what: str = "element sets") -> list[str]:
    """The first problems as texts, and how many there are beside them."""
    texts = [str(problem) for problem in problems[:NAMED_PROBLEMS]]
    left = len(problems) - len(texts)
    return [*texts, f"{problems[0].file}: {left} more {what} cannot be read"] if left else texts
