"""Options that several commands share, and what they are turned into."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon import PROCESS_START_S
from acu_daemon.config import SatelliteFile, StationFile, load_satellite, load_station
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.elements_file import LoadedElements, load_elements
from acu_daemon.errors import ElementsError, UsageError
from acu_daemon.model import Pass
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.units import DAY_S

NEXT_PASS_DAYS = 3.0

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
        help="The reading of CLOCK_MONOTONIC at which --at holds, so that daemon and simulator share one clock.  "
        "Default: the start of this process.",
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


@dataclass(frozen=True, slots=True)
class Target:
    """A satellite over a station: files read, elements chosen."""

    station: StationFile
    satellite: SatelliteFile
    elements: LoadedElements


def load_target(config: Path, name: str, now_tai_s: float, *, is_strict: bool = True) -> Target:
    """Read both files and the elements.  With is_strict, elements that must not be used raise ElementsError."""
    base = load_station(config)
    satellite, station = load_satellite(config, name, base)
    elements = load_elements(satellite, config / "satellites" / f"{name}.toml", now_tai_s)
    if is_strict and elements.errors:
        raise ElementsError("\n".join(elements.errors))
    return Target(station, satellite, elements)


def coming_pass(target: Target, now_tai_s: float) -> Pass:
    """The pass in progress, else the next one.  UsageError: none within three days."""
    passes = find_passes(
        target.elements.propagator,
        target.station.site,
        now_tai_s,
        now_tai_s + NEXT_PASS_DAYS * DAY_S,
        target.station.station.min_elevation_deg,
    )
    for coming in passes:
        if coming.set_tai_s > now_tai_s:
            return coming
    raise UsageError(
        f"no pass of {target.elements.label} over {target.station.station.name} above "
        f"{target.station.station.min_elevation_deg:g} deg within {NEXT_PASS_DAYS:g} days of {utc_text(now_tai_s, 0)}"
    )
