"""From a PASS.toml and the files it names to the pass as the satellite's antenna sees it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from acu_daemon.config.onboard_tables import PassFile, read_pass
from acu_daemon.edge.elements_file import LoadedElements, load_elements
from acu_daemon.errors import AttitudeError, UsageError
from acu_daemon.model import Pass, Station
from acu_daemon.onboard.aem import parse_aem
from acu_daemon.onboard.aem_attitude import AemAttitude
from acu_daemon.onboard.attitude import Attitude, Hold, plan_attitude
from acu_daemon.onboard.gimbal_frames import mount_matrix
from acu_daemon.onboard.missions import angles_to, with_nadir
from acu_daemon.onboard.profile import Task, within
from acu_daemon.onboard.view import view_pass
from acu_daemon.orbit.frames import station_itrs_m
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import Propagator, spans_tai_s
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

_SEARCH_S = DAY_S
_SHORTEST_PASS_S = 30.0
_LONGEST_PASS_S = 2.0 * 3600.0  # of one profile: the plan's time grows with more than its length
_EDGE_S = 1.0
_TOLD = 5


@dataclass(frozen=True, slots=True)
class PlannedPass:
    """A pass, ready to be sampled."""

    file: PassFile
    label: str  # of the satellite
    propagator: Propagator
    attitude: Attitude
    seen: Pass
    imaging_tai_s: tuple[tuple[float, float], ...]
    warnings: list[str]

    @property
    def station(self) -> Station:
        return self.file.site.station

    def task(self, margin_deg: float | None = None, span_tai_s: tuple[float, float] | None = None) -> Task:
        """What the pass, or a span of it, asks of the antenna; margin_deg: in place of the file's.

        Raises:  OrbitError, AttitudeError: no answer for one of the times.
        """
        antenna = self.file.antenna
        mount = mount_matrix(*antenna.mount.angles_deg) @ mount_matrix(*antenna.bus.angles_deg)
        start, end = span_tai_s or (self.seen.rise_tai_s, self.seen.set_tai_s)
        view = view_pass(self.propagator, self.attitude, mount, self.file.site.orientation, start, end)
        return Task(
            view=view,
            station_itrs_m=station_itrs_m(self.station),
            cone=antenna.cone(margin_deg),
            azimuth=antenna.azimuth.limits(),
            elevation=antenna.elevation.limits(),
            imaging=within(view.tai_s, self.imaging_tai_s),
        )

    def with_profile(self, given: Mapping[str, str]) -> "PlannedPass":
        """The same with another method or objective; the words are known ones."""
        section = self.file.profile.model_copy(update=dict(given))
        return replace(self, file=self.file.model_copy(update={"profile": section}))


def load_pass(path: Path) -> PlannedPass:
    """Read a PASS.toml with orbit and attitude, and find the pass.

    Raises:  ConfigError, ElementsError, AttitudeError, UsageError (the station is never in view): say what to change.
             OrbitError: the orbit has no answer.
    """
    file = read_pass(path)
    loaded = _elements(file, path)
    seen = _first_pass(file, loaded.propagator, loaded.label)
    warnings = [*loaded.warnings, *_cut(loaded.propagator, seen)]
    attitude: Attitude
    if file.attitude.file is not None:
        attitude, doubts = _from_file(file, path.parent / file.attitude.file)
        warnings += doubts
        imaging = tuple((row.start_utc, row.start_utc + row.duration_s) for row in file.attitude.imaging)
    else:
        holds = _holds(file, loaded.propagator)
        agility = file.attitude.agility
        attitude = plan_attitude(with_nadir(holds, agility, seen.rise_tai_s, seen.set_tai_s), agility)
        imaging = tuple((hold.start_tai_s, hold.end_tai_s) for hold in holds if hold.is_imaging)
    warnings += _elsewhere(file, seen)
    return PlannedPass(file, loaded.label, loaded.propagator, attitude, seen, imaging, warnings)


def _elements(file: PassFile, path: Path) -> LoadedElements:
    """The orbit, judged where the search begins; of an ephemeris that begins later within a day, at its begin."""
    from_tai_s, orientation = file.when.from_utc, file.site.orientation
    loaded = load_elements(file.as_satellite, path, from_tai_s, orientation)
    begins = [start for start, _ in spans_tai_s(loaded.propagator) if from_tai_s < start < from_tai_s + _SEARCH_S]
    if loaded.errors and begins:
        loaded = load_elements(file.as_satellite, path, begins[0], orientation)
    if loaded.errors:
        raise UsageError("\n".join(loaded.errors))
    return loaded


def _first_pass(file: PassFile, propagator: Propagator, label: str) -> Pass:
    when, station = file.when, file.station
    found = find_passes(propagator, file.site, when.from_utc, when.from_utc + _SEARCH_S, when.min_elevation_deg)
    long = [one for one in found if one.duration_s >= _SHORTEST_PASS_S]
    if not long:
        raise UsageError(
            f"{label} is never above {when.min_elevation_deg:g} deg for {_SHORTEST_PASS_S:.0f} s over {station.name} "
            f"within a day from {utc_text(when.from_utc, 0)}: change from_utc, lower min_elevation_deg, or look "
            f"whether the station's latitude and longitude are right{_covered(propagator)}"
        )
    seen = long[0]
    if seen.duration_s > _LONGEST_PASS_S:
        raise UsageError(
            f"the pass lasts {seen.duration_s / 3600.0:.1f} h, a profile is made for {_LONGEST_PASS_S / 3600.0:g} h at "
            "the most: raise min_elevation_deg, or set from_utc later in the pass"
        )
    return seen


def _covered(propagator: Propagator) -> str:
    spans = [f"{utc_text(start, 0)} to {utc_text(end, 0)}" for start, end in spans_tai_s(propagator) if isfinite(start)]
    return f"; the ephemeris covers {' and '.join(spans)}" if spans else ""


def _cut(propagator: Propagator, seen: Pass) -> list[str]:
    """What is said of a pass of which the ephemeris covers a part only."""
    if not any(
        abs(seen.rise_tai_s - start) < _EDGE_S or abs(seen.set_tai_s - end) < _EDGE_S
        for start, end in spans_tai_s(propagator)
    ):
        return []
    return [f"the pass is cut where the ephemeris ends; the profile is of that part alone{_covered(propagator)}"]


def _holds(file: PassFile, propagator: Propagator) -> list[Hold]:
    holds = []
    for rows, is_imaging in ((file.attitude.hold, False), (file.attitude.strip, True)):
        for row in rows:
            end = row.start_utc + row.duration_s
            holds.append(Hold(row.start_utc, end, row.roll_deg, row.pitch_deg, row.yaw_deg, is_imaging))
    for target in file.attitude.target:
        place = Station("target", target.latitude_deg, target.longitude_deg, target.height_m)
        middle = target.start_utc + target.duration_s / 2.0
        roll_deg, pitch_deg = angles_to(propagator, station_itrs_m(place), middle, file.site.orientation)
        end = target.start_utc + target.duration_s
        holds.append(Hold(target.start_utc, end, roll_deg, pitch_deg, 0.0, is_imaging=True))
    return sorted(holds, key=lambda hold: hold.start_tai_s)


def _elsewhere(file: PassFile, seen: Pass) -> list[str]:
    """What is said of rows of the attitude that lie outside the pass: a slip of the date, most often."""
    span = f"{utc_text(seen.rise_tai_s, 0)} to {utc_text(seen.set_tai_s, 0)}"
    return [
        f"attitude: the {name} of {utc_text(row.start_utc, 0)} lies outside the pass, {span}: it has no effect"
        for name in ("hold", "strip", "target", "imaging")
        for row in getattr(file.attitude, name)
        if row.start_utc > seen.set_tai_s or row.start_utc + row.duration_s < seen.rise_tai_s
    ]


def _from_file(file: PassFile, path: Path) -> tuple[AemAttitude, list[str]]:
    """The attitude, and what is said of segments that cannot be read."""
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise AttitudeError(f"attitude.file = {file.attitude.file!r}: {path}: {error.strerror}") from None
    segments, problems = parse_aem(text, str(path), file.attitude.body_frame)
    texts = [str(one) for one in problems[:_TOLD]]
    if not segments:
        raise AttitudeError("\n".join(texts))
    return AemAttitude(segments, file.site.orientation), texts
