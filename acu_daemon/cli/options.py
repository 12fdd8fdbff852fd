"""Options that several commands share, and what they are turned into."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon import PROCESS_START_S
from acu_daemon.assist.estimators.estimator import has_covariance
from acu_daemon.config.load import load_satellite, load_station
from acu_daemon.config.satellite_tables import SatelliteFile
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import estimator_settings
from acu_daemon.control.tracking.approach import longest_lead_s
from acu_daemon.edge.carry_over_file import any_carry_over, carry_over_path
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.earth_orientation_file import EarthUsed, at_date
from acu_daemon.edge.elements_choice import ElementsSources, LastFit, choose_elements
from acu_daemon.edge.elements_file import LoadedElements
from acu_daemon.edge.recording_whose import ElementsUsed, Whose
from acu_daemon.edge.state_directory import StateOwner, refuse_world_writable
from acu_daemon.errors import ElementsError, UsageError
from acu_daemon.model import EarthOrientation, Pass
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import is_ephemeris, spans_tai_s
from acu_daemon.orbit.sgp4_source import Sgp4Propagator
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.pointing.keyhole import longest_window_s
from acu_daemon.units import DAY_S

NEXT_PASS_DAYS = 3.0
SOON_S = 1800.0  # a pass that is over by then is looked for first: a restart in mid-pass is in a hurry
SPARE_S = 30.0  # what a buffer and a fit look at beyond the times they are for, with some to spare

Config = Annotated[
    Path,
    typer.Option("--config", help="Directory with station.toml and satellites/NAME.toml.", show_default=False),
]
Satellite = Annotated[
    str, typer.Option("--satellite", help="NAME of satellites/NAME.toml in the config directory.", show_default=False)
]
At = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="UTC",
        help="Rehearse: take this as the present time, such as 2026-08-18T12:00:00Z.  Only on a simulated ACU.",
    ),
]
AtMonotonic = Annotated[
    float | None,
    typer.Option(
        "--at-monotonic",
        metavar="S",
        help="The reading of CLOCK_MONOTONIC at which --at holds.  Default: that of the simulator, or of the daemon, "
        "at the same ACU address on this machine with the same --at; else the start of this process.",
    ),
]


def parse_utc(option: str, text: str) -> float:
    """TAI of a UTC text given on the command line.  UsageError: says what was expected."""
    try:
        return tai_from_utc(text)
    except ValueError as error:
        raise UsageError(f"{option} {text!r}: {error}") from None


def make_clock(at: str | None, at_monotonic_s: float | None) -> SystemClock:
    """The clock in force: the system's, or a rehearsed one."""
    if at_monotonic_s is not None and not math.isfinite(at_monotonic_s):
        raise UsageError(f"--at-monotonic {at_monotonic_s}: expected seconds of CLOCK_MONOTONIC")
    if at is None:
        if at_monotonic_s is not None:
            raise UsageError("--at-monotonic needs --at: it says at which instant that time holds")
        return SystemClock()
    return SystemClock(parse_utc("--at", at), PROCESS_START_S if at_monotonic_s is None else at_monotonic_s)


def antenna_of(station: StationFile) -> StateOwner:
    """The antenna that a station's file is about, by which its state is kept."""
    return StateOwner.of(station.station.name, station.acu.url, station.acu.address)


def chosen_acu(config: Path, asked: str | None, *, may_choose: bool) -> str:
    """URL of the ACU: that of --acu, else the station's.  UsageError: another one may not be chosen here."""
    if asked is None:
        return load_station(config).acu.url
    if not may_choose:
        raise UsageError(
            f"--acu {asked}: this would track with another ACU than {config / 'station.toml'} names; rehearse there "
            "with --at, or say --same-antenna where that ACU moves the same antenna"
        )
    return asked


def check_duration(duration_s: float | None) -> None:
    """UsageError: --duration is no time."""
    if duration_s is not None and not 0.0 < duration_s < float("inf"):
        raise UsageError(f"--duration {duration_s:g}: expected a number of seconds above 0")


@dataclass(frozen=True, slots=True)
class Target:
    """A satellite over a station: files read, elements chosen."""

    station: StationFile  # with the Earth orientation of the date in it, where it names a file of that
    satellite: SatelliteFile
    elements: LoadedElements
    earth: EarthUsed = EarthUsed(EarthOrientation())


def whose_recording(target: Target, *, is_rehearsal: bool) -> Whose:
    """Whose the readings of a run are."""
    satellite, elements = target.satellite.satellite, target.elements
    file = getattr(target.satellite.elements, "file", "") or Path(elements.file).name
    used = ElementsUsed(elements.propagator.kind, utc_text(elements.epoch_tai_s), file)
    return Whose(target.station.site.station, satellite.name, satellite.norad_id, used, is_rehearsal)


def load_target(
    config: Path,
    name: str,
    now_tai_s: float,
    *,
    is_strict: bool = True,
    at_tai_s: float | None = None,
    folders: Sequence[Path] = (),
) -> Target:
    """Read both files and the elements.  With is_strict, elements that must not be used raise ElementsError.

    at_tai_s: for when elements are wanted, where that is not now.  folders: of the antenna's state, in which the last
    pass may have left a fit, which says what the sources of elements are worth.
    """
    for path in (config, config / "satellites", config / "station.toml", config / "satellites" / f"{name}.toml"):
        refuse_world_writable(path)
    base, earth = at_date(load_station(config), config, now_tai_s if at_tai_s is None else at_tai_s)
    satellite, station = load_satellite(config, name, base)
    path = config / "satellites" / f"{name}.toml"
    elements = choose_elements(
        satellite,
        path,
        now_tai_s,
        station.site.orientation,
        at_tai_s,
        ElementsSources.of(config, base.elements),
        last_fit(satellite, station, folders),
    )
    if is_strict and elements.errors:
        raise ElementsError("\n".join(elements.errors))
    if earth.warning:
        elements = replace(elements, warnings=[*elements.warnings, earth.warning])
    return Target(station, satellite, elements, earth)


def at_acu(target: Target, url: str | None) -> Target:
    """The same over the same station, with its ACU reached at another URL; None: where its file says."""
    return target if url is None else replace(target, station=station_at(target.station, url))


def station_at(station: StationFile, url: str | None) -> StationFile:
    """The same station with its ACU reached at another URL; None: where its file says."""
    if url is None:
        return station
    return station.model_copy(update={"acu": station.acu.model_copy(update={"url": url})})


def last_fit(satellite: SatelliteFile, station: StationFile, folders: Sequence[Path]) -> LastFit | None:
    """What the last pass has left in the first of these folders that has anything; None: nothing that can be used."""
    if not has_covariance(station.tracking.estimator):
        return None
    paths = (carry_over_path(one, satellite.satellite.norad_id, satellite.satellite.name) for one in folders)
    carried = next((found for path in paths if (found := any_carry_over(path)) is not None), None)
    return None if carried is None else LastFit(carried, station.site, estimator_settings(station, satellite))


def nearest_to_pass(
    config: Path,
    name: str,
    target: Target,
    now_tai_s: float,
    *,
    is_strict: bool = True,
    folders: Sequence[Path] = (),
) -> Target:
    """The target with the elements that are the best for the coming pass, where those are not the best for now."""
    if not target.elements.choice or target.elements.errors:
        return target
    found = _passes_until(target, now_tai_s, now_tai_s + NEXT_PASS_DAYS * DAY_S)
    rise_tai_s = next((one.rise_tai_s for one in found if one.set_tai_s > now_tai_s), now_tai_s)
    if rise_tai_s <= now_tai_s:
        return target
    return load_target(config, name, now_tai_s, is_strict=is_strict, at_tai_s=rise_tai_s, folders=folders)


def coming_pass(target: Target, now_tai_s: float) -> Pass:
    """The pass in progress, else the next one.

    UsageError: none within three days, or one that the elements do not cover from its preparation to its last buffer.
    """
    soon_tai_s, last_tai_s = now_tai_s + SOON_S, now_tai_s + NEXT_PASS_DAYS * DAY_S
    early = _passes_until(target, now_tai_s, soon_tai_s)
    found = [one for one in early if now_tai_s < one.set_tai_s < soon_tai_s]
    for coming in found or _passes_until(target, now_tai_s, last_tai_s):
        if coming.set_tai_s > now_tai_s:
            if lacking := not_covered(target, coming, now_tai_s):
                raise UsageError(lacking)
            return coming
    until = ending(target, last_tai_s)
    raise UsageError(
        f"no pass of {target.elements.label} over {target.station.station.name} above "
        f"{target.station.station.min_elevation_deg:g} deg within {NEXT_PASS_DAYS:g} days of {utc_text(now_tai_s, 0)}"
        + (until and f"; {until}")
    )


def _passes_until(target: Target, now_tai_s: float, end_tai_s: float) -> list[Pass]:
    lowest_deg = target.station.station.min_elevation_deg
    return find_passes(target.elements.propagator, target.station.site, now_tai_s, end_tai_s, lowest_deg)


def ending(target: Target, end_tai_s: float) -> str:
    """Say that nothing is known up to the end of a search, empty where the elements reach that far."""
    propagator = target.elements.propagator
    last_tai_s = spans_tai_s(propagator)[-1][1]
    if last_tai_s >= end_tai_s:
        return ""
    if isinstance(propagator, Sgp4Propagator):
        return f"from {utc_text(last_tai_s, 0)} on nothing is known: by the elements {propagator.end_reason}"
    return f"the ephemeris ends at {utc_text(last_tai_s, 0)}"


def beginning(target: Target, start_tai_s: float) -> str:
    """Say that nothing is known of an element set's satellite at the start of a search; empty where something is."""
    propagator = target.elements.propagator
    first_tai_s = spans_tai_s(propagator)[0][0]
    if is_ephemeris(propagator) or first_tai_s <= start_tai_s:
        return ""
    return (
        f"before {utc_text(first_tai_s, 0)} nothing is known: so far back from their epoch the elements give no orbit"
    )


def not_covered(target: Target, coming: Pass, now_tai_s: float) -> str:
    """Say what an ephemeris lacks for a pass; empty for other elements and where it lacks nothing."""
    tracking = target.station.tracking
    from_tai_s = max(coming.rise_tai_s - longest_lead(target), now_tai_s)
    from_tai_s -= longest_window_s(target.station.acu.azimuth.limits()) + SPARE_S
    to_tai_s = coming.set_tai_s + tracking.horizon_s + SPARE_S
    return lacking(
        target, f"the pass of {target.elements.label} at {utc_text(coming.rise_tai_s, 0)}", from_tai_s, to_tai_s
    )


def longest_lead(target: Target) -> float:
    """How long before a rise the antenna sets out at most, s: from the far end of its drives."""
    acu, preposition_s = target.station.acu, target.station.tracking.preposition_s
    tilt = None if acu.tilt is None else acu.tilt.limits()
    return longest_lead_s(acu.azimuth.limits(), acu.elevation.limits(), preposition_s, tilt)


def lacking(target: Target, what: str, from_tai_s: float, to_tai_s: float) -> str:
    """Say that an ephemeris does not cover a span for what it is needed; empty where the elements do.

    A satellite about to decay is followed as long as anything is known of it.
    """
    spans = spans_tai_s(target.elements.propagator)
    if not is_ephemeris(target.elements.propagator) or any(
        start <= from_tai_s and to_tai_s <= end for start, end in spans
    ):
        return ""
    covered = " and ".join(f"{utc_text(start, 0)} to {utc_text(end, 0)}" for start, end in spans)
    return (
        f"{what} needs an ephemeris from {utc_text(from_tai_s, 0)} to {utc_text(to_tai_s, 0)}; "
        f"this one covers {covered}: fetch a longer one"
    )


def cut_passes(target: Target, passes: list[Pass]) -> list[str]:
    """Say which passes begin or end only because an ephemeris does, or because the satellite decays."""
    spans = spans_tai_s(target.elements.propagator)
    what = "the ephemeris" if is_ephemeris(target.elements.propagator) else "what the elements know"
    starts, ends = {start for start, _ in spans}, {end for _, end in spans}
    said = []
    for one in passes:
        of = f"the pass from {utc_text(one.rise_tai_s, 0)} to {utc_text(one.set_tai_s, 0)} is cut:"
        if one.rise_tai_s in starts:
            said.append(f"{of} {what} begins within it")
        if one.set_tai_s in ends:
            said.append(f"{of} {what} ends within it")
    return said


def open_ends(one: Pass, start_tai_s: float, end_tai_s: float) -> str:
    """Say in words that a pass has no rise or no set; empty where it has both.  From and to: those of the search."""
    has_no_rise, has_no_set = one.rise_tai_s == start_tai_s, one.set_tai_s == end_tai_s
    if has_no_rise and has_no_set:
        return "always up: does not set"
    return "does not rise" if has_no_rise else "does not set" if has_no_set else ""


def gaps(target: Target, start_tai_s: float, end_tai_s: float) -> list[str]:
    """Say where a search has nothing to look at between the spans of an ephemeris."""
    return [
        f"the ephemeris has a gap from {utc_text(end, 0)} to {utc_text(start, 0)}, no pass is looked for in it"
        for (_, end), (start, _) in pairwise(spans_tai_s(target.elements.propagator))
        if end < end_tai_s and start > start_tai_s
    ]
