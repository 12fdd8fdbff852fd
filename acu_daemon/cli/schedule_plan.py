"""The schedule of a configuration directory: every satellite's passes, granted or refused."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from acu_daemon.cli.coming_passes import passes_by_epoch
from acu_daemon.cli.options import load_target
from acu_daemon.config.load import load_station, satellite_names
from acu_daemon.errors import AcuDaemonError, ElementsError
from acu_daemon.schedule.decisions import Decision, decide
from acu_daemon.schedule.exact_plan import AntennaPlace, Slot
from acu_daemon.schedule.pass_track import PassTrack, track_of
from acu_daemon.schedule.rules import PassRequest
from acu_daemon.units import DAY_S


@dataclass(frozen=True, slots=True)
class StationPlan:
    """Decisions in order of the rise, up to a time; omitted: satellites that cannot be used, and why."""

    decisions: tuple[Decision, ...]
    until_tai_s: float
    omitted: dict[str, str]


def station_plan(
    config: Path,
    now_tai_s: float,
    *,
    until_tai_s: float | None = None,
    requests: Sequence[PassRequest] = (),
    frozen: Sequence[Slot] = (),
    place: AntennaPlace | None = None,
) -> StationPlan:
    """Plan all satellites of a directory; until_tai_s: by default the horizon of the station's [schedule].

    Raises: ConfigError: of station.toml.  What is wrong with a satellite's files leaves that satellite out.
    """
    station = load_station(config)
    until_tai_s = now_tai_s + DAY_S * station.schedule.horizon_days if until_tai_s is None else until_tai_s
    azimuth, elevation = station.acu.azimuth.limits(), station.acu.elevation.limits()
    tracks: list[PassTrack] = []
    omitted: dict[str, str] = {}
    for name in satellite_names(config):
        try:
            tracks += _tracks(config, name, now_tai_s, until_tai_s)
        except AcuDaemonError as error:
            omitted[name] = "; ".join(str(error).splitlines())
    rules = station.schedule.rules(azimuth, elevation, tuple(requests))
    return StationPlan(tuple(decide(tracks, rules, frozen=frozen, place=place)), until_tai_s, omitted)


def _tracks(config: Path, name: str, now_tai_s: float, until_tai_s: float) -> list[PassTrack]:
    target = load_target(config, name, now_tai_s, is_strict=False)
    if target.elements.errors:
        raise ElementsError("; ".join(target.elements.errors))
    bounds, rules = target.station.bounds, target.satellite.schedule.rules()
    return [
        track_of(name, one.elements.propagator, one.station.site, coming, rules, bounds)
        for one, passes in passes_by_epoch(config, name, target, now_tai_s, until_tai_s)
        for coming in passes
    ]
