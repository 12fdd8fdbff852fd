"""Which of several sources of a satellite's orbit is used for a pass: the one that is expected to be off the least.

Sources are the satellite's own file, what the station's fetcher keeps, and the directories of [elements] source.  What
a source is expected to be off, along the track at the pass, follows from its kind and age (orbit.aging).  The last
pass's fit counts too: elements that it corrects are as good as the fit, aged; elements that it contradicts are off by
so much; a set that the fetcher doubts is off by its shift, until a fit of a later time bears it out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import hypot, inf
from pathlib import Path

import numpy as np

from acu_daemon.assist.estimators.full.aged_prior import aged_prior
from acu_daemon.assist.estimators.full.carry_over import CarryOver, why_not, why_other_frame
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.config.satellite_tables import BrouwerSection, SatelliteFile
from acu_daemon.edge.elements_file import LoadedElements, load_elements, load_text
from acu_daemon.edge.elements_store import doubtful_file, read_sets, sets_file
from acu_daemon.edge.fetch_state_file import group_file
from acu_daemon.edge.orbit_file import SET_PARSERS, begins_with_sets, read_orbit_file
from acu_daemon.errors import ElementsError, OrbitError, UsageError
from acu_daemon.model import EarthOrientation, Site
from acu_daemon.orbit.aging import expected_error, predicted_error
from acu_daemon.orbit.elements import check_elements
from acu_daemon.orbit.ephemeris import EphemerisPropagator, moved_elements
from acu_daemon.orbit.kepler import osculating_from_state, state_from_elements
from acu_daemon.orbit.propagator import Propagator, spans_tai_s
from acu_daemon.orbit.set_judgement import MOST_SIGMAS, Judged, Judgement, judge
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

BEFORE_S, AFTER_S = 600.0, 1800.0  # of the time asked for: an ephemeris covers a pass with what is looked at beside it
FIT_LEAST_M = 100.0  # no fit is better at its next pass
MOST_FILES = 500  # of a directory
_UNREADABLE = (".toml", ".tmp", ".part", ".new", "~")


@dataclass(frozen=True, slots=True)
class ElementsSources:
    """Where the elements of the station's satellites come from."""

    store: Path
    urls: tuple[str, ...] = ()
    directories: tuple[Path, ...] = ()

    @classmethod
    def of(cls, config: Path, section: ElementsSourcesSection) -> "ElementsSources | None":
        """Those of a station.toml in a directory; None: it names none."""
        if not section.source:
            return None
        directories = tuple(config / one for one in section.directories)
        return cls(config / section.store, tuple(section.urls), directories)

    def files(self, norad_id: int) -> list[Path]:
        """The files that may say where a satellite is; those that a fetcher keeps for it before the whole groups."""
        return [*self.kept_files(norad_id), *self.others()]

    def kept_files(self, norad_id: int) -> list[Path]:
        """Those with the sets that were fetched for it."""
        return [sets_file(self.store, norad_id), doubtful_file(self.store, norad_id)] if self.urls else []

    def others(self) -> list[Path]:
        """The groups as they were fetched, and what stands in the directories."""
        groups = [group_file(self.store, url) for url in self.urls]
        return [*groups, *(one for directory in self.directories for one in files_of(directory))]


def files_of(directory: Path) -> list[Path]:
    """The files of a directory that others fill, sorted; none where it cannot be looked into."""
    try:
        found = sorted(one for one in directory.iterdir() if not one.name.startswith(".") and one.is_file())
    except OSError:
        return []
    return [one for one in found if not one.name.endswith(_UNREADABLE)][:MOST_FILES]


@dataclass(frozen=True, slots=True)
class LastFit:
    """What the last pass left, and what is needed to age it."""

    carried: CarryOver
    site: Site
    settings: EstimatorSettings

    def corrects(self, propagator: Propagator, now_tai_s: float) -> bool:
        """Whether it is of these elements and may be used."""
        return not (
            why_other_frame(self.carried, self.site) or why_not(self.carried, propagator, self.settings, now_tai_s)
        )

    def expected_m(self, propagator: Propagator, at_tai_s: float) -> float:
        """1 sigma along the track of these elements with the fit, at another time."""
        covariance = aged_prior(self.carried, propagator, self.site, self.settings, at_tai_s).covariance
        since_s = at_tai_s - self.carried.elements_epoch_tai_s
        along = np.zeros(covariance.shape[0])
        along[1], along[2] = 1.0, since_s  # mean anomaly and mean motion
        return hypot(FIT_LEAST_M, float(along @ covariance @ along) ** 0.5 * self._a_m)

    @property
    def _a_m(self) -> float:
        return float(osculating_from_state(self.carried.states[1:, :3], self.carried.states[1:, 3:]).a_m[0])

    @property
    def place_m(self) -> Array:
        """Where the satellite was by the fit, at its time, TEME (3,)."""
        carried, states = self.carried, self.carried.states[1:]
        given = carried.correction
        moved_rad = given.delta_mean_anomaly_rad + given.delta_mean_motion_rad_s * (
            carried.at_tai_s - carried.elements_epoch_tai_s
        )
        orbit = moved_elements(osculating_from_state(states[:, :3], states[:, 3:]), given, np.zeros(1))
        r_m, _ = state_from_elements(replace(orbit, mean_anomaly_rad=orbit.mean_anomaly_rad + moved_rad))
        return np.asarray(r_m[0])

    def off_m(self, propagator: Propagator) -> float:
        """How far a source is off the fit at its time; inf: it has no position there."""
        try:
            r_m, _ = propagator.states_teme(np.array([self.carried.at_tai_s]))
        except OrbitError:
            return inf
        return float(np.linalg.norm(r_m[0] - self.place_m))


def choose_elements(
    satellite: SatelliteFile,
    toml_path: Path,
    now_tai_s: float,
    orientation: EarthOrientation,
    at_tai_s: float | None = None,
    sources: ElementsSources | None = None,
    fit: LastFit | None = None,
) -> LoadedElements:
    """The satellite's propagator: of its own file, or, where the station has sources, the best of all for a time.

    Raises: ElementsError: there is none; says why for each.
    """
    norad_id = satellite.satellite.norad_id
    if sources is None or norad_id is None or isinstance(satellite.elements, BrouwerSection):
        return load_elements(satellite, toml_path, now_tai_s, orientation, at_tai_s)
    at = now_tai_s if at_tai_s is None else at_tai_s
    found: list[LoadedElements] = []
    reasons: list[str] = []
    if satellite.elements.kind != "station":
        try:
            found.append(load_elements(satellite, toml_path, now_tai_s, orientation, at_tai_s))
        except ElementsError as error:
            reasons.append(str(error))
    found += _from_sources(satellite, norad_id, now_tai_s, orientation, at, sources)
    if not found:
        looked = " and ".join(
            str(one) for one in (sources.store if sources.urls else None, *sources.directories) if one
        )
        none = f"{toml_path}: no elements of norad_id {norad_id} in {looked}"
        hint = "; `acu-daemon elements show` says what became of the sources"
        raise ElementsError("\n".join([*reasons, none + hint]))
    doubts = [_doubt(one, found, norad_id, sources) for one in found]
    judged = [
        _judged(one, 0.0 if doubt is None else doubt.shift_m, at, now_tai_s, fit)
        for one, doubt in zip(found, doubts, strict=True)
    ]
    best = min(judged, key=lambda one: (bool(one.errors), one.expected_m))
    confirmed = [one.epoch_tai_s for one in judged if one.confirmed_tai_s and _is_doubted(one, norad_id, sources)]
    why = _why(best, judged, at)
    warnings = [*reasons, *best.warnings, *_doubts_told(best, judged, doubts)]
    return replace(best, warnings=warnings, choice=why, confirmed_tai_s=max(confirmed, default=None))


def _from_sources(
    satellite: SatelliteFile,
    norad_id: int,
    now_tai_s: float,
    orientation: EarthOrientation,
    at_tai_s: float,
    sources: ElementsSources,
) -> Iterator[LoadedElements]:
    """What the sources have of a satellite; files of others, and damaged ones, are passed over."""
    section = satellite.elements
    kept = {path: read_sets(path, norad_id) for path in sources.kept_files(norad_id)}
    for path, sets in kept.items():
        epochs_tai_s = tuple(one.epoch_tai_s for one in sets)
        for one in sets:
            errors, warnings = check_elements(one, section.limits.limits(), now_tai_s)
            source = Sgp4Propagator(one)
            yield LoadedElements(
                source, one.label, one.epoch_tai_s, errors, warnings, epochs_tai_s=epochs_tai_s, file=str(path)
            )
    has_kept = any(kept.values())
    for path in sources.others():
        try:
            if has_kept and path.parent == sources.store and begins_with_sets(path):
                continue  # what is believed of a group is kept apart; not to read it all is worth a tick
            kind, text = read_orbit_file(path)
            is_of_sets = kind in SET_PARSERS
            if isinstance(section, BrouwerSection) or (is_of_sets and f"{norad_id}"[-4:] not in text):
                continue
            found = load_text(satellite, section, path, kind, text, now_tai_s, orientation, at_tai_s, must_match=True)
        except (OSError, ElementsError, UsageError):
            continue
        yield found


def _is_doubted(one: LoadedElements, norad_id: int, sources: ElementsSources) -> bool:
    return one.file == str(doubtful_file(sources.store, norad_id))


def _doubt(
    one: LoadedElements, found: Sequence[LoadedElements], norad_id: int, sources: ElementsSources
) -> Judgement | None:
    """How far a set is off the newest older one of another file, where it is so far that one of them is wrong.

    What stands in a satellite's own file is a person's word.
    """
    is_doubted = _is_doubted(one, norad_id, sources)
    is_given = any(Path(one.file).parent == directory for directory in sources.directories)
    if not isinstance(one.propagator, Sgp4Propagator) or not (is_doubted or is_given):
        return None
    older = [
        other.propagator.elements
        for other in found
        if isinstance(other.propagator, Sgp4Propagator)
        and other.file != one.file
        and other.epoch_tai_s < one.epoch_tai_s
        and not _is_doubted(other, norad_id, sources)
    ]
    judgement = judge(max(older, key=lambda each: each.epoch_tai_s, default=None), one.propagator.elements)
    return judgement if judgement.judged is Judged.DOUBTFUL else None


def _doubts_told(
    best: LoadedElements, judged: Sequence[LoadedElements], doubts: Sequence[Judgement | None]
) -> Iterator[str]:
    """Which sets are not used because they are doubted."""
    for one, doubt in zip(judged, doubts, strict=True):
        if doubt is not None and one.confirmed_tai_s is None and one is not best:
            about = f"{one.file}: {one.label}: the set of {utc_text(one.epoch_tai_s, 0)} is doubted"
            yield f"{about}: {doubt}; a pass will decide"


def _judged(
    one: LoadedElements, doubt_m: float, at_tai_s: float, now_tai_s: float, fit: LastFit | None
) -> LoadedElements:
    """With what it is expected to be off.  doubt_m: by how much older sets contradict it."""
    propagator = one.propagator
    expected_m = _by_age_m(propagator, at_tai_s)
    is_confirmed = False
    if fit is not None and fit.carried.at_tai_s >= one.epoch_tai_s:
        if fit.corrects(propagator, now_tai_s):
            return replace(one, expected_m=min(expected_m, fit.expected_m(propagator, at_tai_s)))
        off_m, allowed_m = fit.off_m(propagator), MOST_SIGMAS * _by_age_m(propagator, fit.carried.at_tai_s)
        is_confirmed = doubt_m > 0.0 and off_m <= allowed_m
        doubt_m = 0.0 if is_confirmed else max(doubt_m, off_m if off_m > allowed_m else 0.0)
    confirmed_tai_s = one.epoch_tai_s if is_confirmed else None
    return replace(one, expected_m=hypot(expected_m, doubt_m), confirmed_tai_s=confirmed_tai_s)


def _by_age_m(propagator: Propagator, at_tai_s: float) -> float:
    if isinstance(propagator, Sgp4Propagator):
        return expected_error(propagator.elements, at_tai_s).along_m
    if isinstance(propagator, EphemerisPropagator):
        if not any(
            start <= at_tai_s - BEFORE_S and at_tai_s + AFTER_S <= end for start, end in spans_tai_s(propagator)
        ):
            return inf
        return predicted_error(propagator.ephemeris.semi_major_axis_m, at_tai_s - propagator.epoch_tai_s).along_m
    return inf


def _why(best: LoadedElements, judged: Sequence[LoadedElements], at_tai_s: float) -> str:
    if len(judged) == 1:
        return best.choice
    others = sorted((one for one in judged if one is not best), key=lambda one: (bool(one.errors), one.expected_m))
    confirmed = ", borne out by the last pass" if best.confirmed_tai_s is not None else ""
    return (
        f"{best.file}: {best.label}: of {len(judged)} sources the one of {utc_text(best.epoch_tai_s, 0)} is used "
        f"({best.propagator.kind}){confirmed}: expected to be {_km(best.expected_m)} off along the track at "
        f"{utc_text(at_tai_s, 0)}; the next is {others[0].file} ({others[0].propagator.kind} of "
        f"{utc_text(others[0].epoch_tai_s, 0)}), {_km(others[0].expected_m)}"
    )


def _km(metres: float) -> str:
    return f"{float(f'{metres / 1e3:.2g}'):g} km" if metres < inf else "of no use then"
