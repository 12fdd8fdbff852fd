"""One run of `acu-daemon run`: what the files say and what was left, as the daemon needs it."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import structlog

from acu_daemon.assist.estimators.full.carry_over import CarryOver
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory
from acu_daemon.assist.session.refit import RefitSetup
from acu_daemon.cli.kept import Kept, open_kept
from acu_daemon.cli.options import (
    Target,
    at_acu,
    coming_pass,
    ending,
)
from acu_daemon.config.to_settings import (
    control_config,
    driver_of,
    estimator_settings,
    leaning,
    may_plunge,
    planned_tilt,
)
from acu_daemon.control.state import ControlState
from acu_daemon.daemon.service import PassJob
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.link import Link
from acu_daemon.edge.scheduling import scheduling_text
from acu_daemon.edge.writer import Writer
from acu_daemon.errors import OrbitError
from acu_daemon.model import Pass
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

SHOWN_COUNT = 3  # of the passes to come


class LineRate(Protocol):
    """What of a link a job depends on."""

    @property
    def byte_time_s(self) -> float:
        """Time a character spends on the wire; 0 where it is not known (TCP)."""


@dataclass(frozen=True, slots=True)
class RunSetup:
    """What stays the same from one run of this process to the next.

    end_s: of --duration, on CLOCK_MONOTONIC.  older: other folders of the same antenna's state.  acu: URL of --acu.
    """

    config: Path
    name: str
    clock: SystemClock
    link: Link
    directory: Path
    files: Writer
    end_s: float
    is_shadow: bool
    older: tuple[Path, ...] = ()
    acu: str | None = None

    @property
    def folders(self) -> tuple[Path, ...]:
        """The antenna's own folder first."""
        return (self.directory, *self.older)


@dataclass(frozen=True, slots=True)
class Prepared:
    """A run that can begin."""

    target: Target
    coming: Pass
    job: PassJob
    kept: Kept


def prepare(frame: RunSetup, target: Target, memory: ControlState | None = None) -> Prepared:
    """Find the pass and what was left for it.  memory: of the run before, where this one begins anew.

    Raises: UsageError: no pass is coming, or the elements do not cover it.
    """
    clock, target = frame.clock, at_acu(target, frame.acu)
    coming = coming_pass(target, clock.tai_s())
    _announce(target, coming, clock, is_shadow=frame.is_shadow)
    kept = open_kept(frame.directory, target, coming, clock, frame.files, frame.older)
    job = make_job(
        target,
        coming,
        frame.link,
        is_rehearsal=clock.is_rehearsal,
        end_tai_s=clock.tai_s() + frame.end_s - clock.monotonic_s(),
        carried=kept.carried,
        memory=kept.memory,
    )
    job = replace(job, control=replace(job.control, is_shadow=frame.is_shadow))
    job = replace(job, state=kept.state if memory is None else memory, is_anew=memory is not None)
    job = replace(job, next_passes=next_passes(target, coming))
    return Prepared(target, coming, job, kept)


def next_passes(target: Target, coming: Pass) -> tuple[str, ...]:
    """The passes after this one within a day, in words."""
    begin_tai_s = coming.set_tai_s + 1.0
    lowest_deg, name = target.station.station.min_elevation_deg, target.satellite.satellite.name
    try:
        found = find_passes(
            target.elements.propagator, target.station.site, begin_tai_s, begin_tai_s + DAY_S, lowest_deg
        )
    except OrbitError:  # the elements do not know so far ahead
        return ()
    return tuple(next_text(name, one.rise_tai_s, one.culmination_el_deg) for one in found[:SHOWN_COUNT])


def next_text(satellite: str, rise_tai_s: float, culmination_el_deg: float) -> str:
    """A pass to come, for people."""
    return f"{satellite} {utc_text(rise_tai_s, 0)[11:16]} {culmination_el_deg:.0f} deg"


def make_job(
    target: Target,
    coming: Pass | None,
    link: LineRate,
    *,
    is_rehearsal: bool,
    end_tai_s: float = math.inf,
    carried: CarryOver | None = None,
    memory: PedestalMemory | None = None,
) -> PassJob:
    """What the files say, as the daemon needs it."""
    station = target.station
    driver = driver_of(station)
    tilt = planned_tilt(station, target.elements.propagator, coming)
    control = control_config(station, target.satellite, driver, link.byte_time_s, tilt)
    return PassJob(
        refit=RefitSetup(
            target.elements.propagator,
            leaning(station.site, tilt),
            station.tracking.estimator,
            estimator_settings(station, target.satellite),
            station.acu.azimuth.limits(),
            carried=carried,
            zenith_objective=station.tracking.zenith_objective,
            memory=memory,
            may_plunge=may_plunge(station),
        ),
        control=replace(control, is_rehearsal=is_rehearsal),
        coming=coming,
        horizon_s=station.tracking.horizon_s,
        low_water_s=station.tracking.low_water_s,
        driver=driver,
        device_delay_s=station.acu.device_delay_s,
        signal_udp=station.receiver.signal_udp,
        is_rehearsal=is_rehearsal,
        end_tai_s=end_tai_s,
        elements_epoch_tai_s=target.elements.epoch_tai_s,
        satellite=target.satellite.satellite.name,
        station=station.station.name,
        elements=target.elements.about,
    )


def _announce(target: Target, coming: Pass, clock: SystemClock, *, is_shadow: bool) -> None:
    log: Any = structlog.get_logger("run")
    log.info(
        "run.start",
        satellite=target.elements.label,
        station=target.station.station.name,
        acu=target.station.acu.url,
        elements=target.elements.propagator.kind,
        estimator=target.station.tracking.estimator,
        elements_age_days=round((clock.tai_s() - target.elements.epoch_tai_s) / 86400.0, 2),
        rise=utc_text(coming.rise_tai_s, 0),
        set=utc_text(coming.set_tai_s, 0),
        culmination_deg=round(coming.culmination_el_deg, 1),
        scheduling=scheduling_text(),
    )
    for warning in target.elements.warnings:
        log.warning("elements.warning", reason=warning)
    if air := target.station.atmosphere.told(target.station.site.station):
        log.info("run.air", air=air)
    if target.earth.about:
        log.info("earth.orientation", age=target.earth.about)
    if target.elements.choice:
        log.info("elements.chosen", reason=target.elements.choice)
    if until := ending(target, coming.set_tai_s + DAY_S):
        log.warning("elements.ending", reason=until)
    if is_shadow:
        log.warning("run.shadow", reason="--shadow: nothing is written to the ACU, whatever happens")
    elif target.station.safety.arm == "manual":
        reason = '[safety] arm = "manual": nothing is written to the ACU until `acu-daemon arm`'
        log.warning("run.disarmed", reason=reason)
