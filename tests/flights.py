"""Flights in virtual time for the tests of the daemon: targets, skies, and what a flight tells."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import acu_daemon.cli as cli
from acu_daemon.acu.commands import SelectBackup, SelectMode
from acu_daemon.cli.options import Target, coming_pass, load_target
from acu_daemon.cli.simulated import station_air
from acu_daemon.cli.virtual_pass import Flight, ScriptAccess, fly
from acu_daemon.drivers.sa3842.messages import Command, WriteAndPoll, WriteParameter, WriteRegisters
from acu_daemon.model import Pass, sky_angle_deg
from acu_daemon.orbit.brouwer import BrouwerPropagator
from acu_daemon.orbit.timescales import gmst_rad, tai_from_utc
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.fault_verbs import parse_fault
from acu_daemon.sim.scenario import AcuChoice, Encoder, Loss, ReceiverChoice, Scenario, SkyErrors
from acu_daemon.sim.sky import SimulatedSky
from acu_daemon.sim.trace import TraceRow
from acu_daemon.units import wrap_180

DEMO_TAI_S = tai_from_utc("2026-08-18T12:44:11Z")  # in mid-pass, 61 s before it culminates 0.2 deg from the zenith
DEMO_ANTENNA = AcuChoice(azimuth_deg=167.4, elevation_deg=58.0)  # where the satellite is then
RISING_TAI_S = DEMO_TAI_S - 150.0  # in the climb of the same pass, slow on both axes
RISING_ANTENNA = AcuChoice(azimuth_deg=168.0, elevation_deg=20.0)
SCD_HIGH_TAI_S = tai_from_utc("1989-02-01T01:58:45Z") + 350.0  # SCD-1 climbs over Cuiaba
WRONG_ORBIT = SkyErrors(along_track_s=0.9, delta_raan_deg=0.015)
NOISE_DEG = 0.02
DRAWN_BY = 1  # the seed of the air, as `fly` has it
EFFECT_S = 0.020  # start of a write to the moment it takes effect, on TCP: docs/protocol.md, Time tags
LSB_DEG = 360.0 / 65536
ORDERS = (WriteAndPoll, WriteRegisters, SelectMode, SelectBackup, WriteParameter)

Script = Sequence[tuple[float, Callable[[ScriptAccess], None]]]


def demo_target(**sections: dict[str, Any]) -> Target:
    """The satellite of the demo; sections: keys of station.toml to change, by table (azimuth: acu.azimuth)."""
    return changed(load_target(Path(cli.__file__).parent / "demo_config", "demo-1", DEMO_TAI_S), **sections)


def scd_target(now_tai_s: float, **sections: dict[str, Any]) -> Target:
    """SCD-1 over Cuiaba, with Brouwer elements."""
    config = Path(__file__).resolve().parents[1] / "config"
    return changed(load_target(config, "scd-1", now_tai_s), **sections)


def changed(target: Target, **sections: dict[str, Any]) -> Target:
    """The target with other values in tables of its files."""
    station, satellite = target.station, target.satellite
    for name, values in sections.items():
        if name == "azimuth":
            azimuth = station.acu.azimuth.model_copy(update=values)
            station = station.model_copy(update={"acu": station.acu.model_copy(update={"azimuth": azimuth})})
        elif name == "fallback":
            satellite = satellite.model_copy(update={name: satellite.fallback.model_copy(update=values)})
        else:
            station = station.model_copy(update={name: getattr(station, name).model_copy(update=values)})
    return Target(station, satellite, target.elements)


def loss(from_tai_s: float, to_tai_s: float) -> Loss:
    """No signal between two instants."""
    return Loss(cause="receiver", from_utc=from_tai_s, to_utc=to_tai_s)


def flight_of(
    target: Target,
    begin_tai_s: float,
    duration_s: float,
    *,
    antenna: AcuChoice,
    losses: Iterable[tuple[float, float]] = (),
    script: Script = (),
    faults: Iterable[str] = (),
    errors: SkyErrors = WRONG_ORBIT,
    noise_deg: float = NOISE_DEG,
    sky: SimulatedSky | None = None,
    receiver: ReceiverChoice | None = None,
    biases_deg: tuple[float, float] = (0.0, 0.0),
    **parts: Any,
) -> Flight:
    """Fly; losses, script and faults (as for a control port) in seconds from the beginning."""
    scenario = Scenario(
        sky=errors,
        encoder=Encoder(*biases_deg, noise_deg),
        receiver=receiver or ReceiverChoice(),
        acu=antenna,
        losses=tuple(loss(begin_tai_s + a, begin_tai_s + b) for a, b in losses),
        faults=tuple(map(parse_fault, faults)),
    )
    return fly(
        target,
        sky or sky_of(target, errors),
        scenario,
        begin_tai_s=begin_tai_s,
        end_tai_s=begin_tai_s + duration_s,
        script=[(begin_tai_s + at_s, action) for at_s, action in script],
        **parts,
    )


def climb(duration_s: float, target: Target | None = None, **changes: Any) -> Flight:
    """A flight in the climb of the demo's pass, on the satellite from the start."""
    return flight_of(target or demo_target(), RISING_TAI_S, duration_s, **{"antenna": RISING_ANTENNA, **changes})


def sky_of(target: Target, errors: SkyErrors = WRONG_ORBIT, truth: Path | None = None) -> SimulatedSky:
    """Where the satellite appears, in air that is not quite what the daemon is told."""
    source, station = target.elements.propagator, target.station
    air = station_air(station)
    return make_sky(source, station.site, Scenario(sky=errors), truth, station_air=air, seed=DRAWN_BY)


def the_pass(target: Target, now_tai_s: float) -> Pass:
    return coming_pass(target, now_tai_s)


# What a flight tells


def state_at(flight: Flight, tai_s: float) -> str:
    """The daemon's state in the last tick before an instant."""
    before = [seen.state for seen in flight.snapshots if seen.tai_s < tai_s]
    return before[-1] if before else ""


def seconds_to_state(flight: Flight, state: str, from_tai_s: float) -> float:
    """From an instant until the daemon is in a state; infinite if it never is."""
    found = (seen.tai_s - from_tai_s for seen in flight.snapshots if seen.tai_s > from_tai_s and seen.state == state)
    return min(found, default=float("inf"))


def rows_between(flight: Flight, from_tai_s: float, to_tai_s: float) -> list[TraceRow]:
    return [row for row in flight.rows if from_tai_s <= row.tai_s <= to_tai_s]


def worst_error_deg(flight: Flight, from_tai_s: float, to_tai_s: float) -> float:
    """Largest beam error between two instants."""
    errors = [row.beam_error_deg for row in rows_between(flight, from_tai_s, to_tai_s)]
    return max(180.0 if error is None else error for error in errors)


def commands_between(flight: Flight, from_tai_s: float, to_tai_s: float) -> list[Command]:
    return [command for tai_s, command in flight.commands if from_tai_s <= tai_s <= to_tai_s]


def count(flight: Flight, kind: type | tuple[type, ...]) -> int:
    return sum(isinstance(command, kind) for _, command in flight.commands)


def events_named(flight: Flight, name: str) -> list[dict[str, Any]]:
    return [event for event in flight.events if event["event"] == name]


def register_errors_deg(flight: Flight, sky: SimulatedSky, from_tai_s: float, to_tai_s: float) -> list[float]:
    """Registers against the satellite at the moment each write takes effect."""
    errors = []
    for tai_s, command in flight.commands:
        truth = sky.direction(tai_s + EFFECT_S)
        if isinstance(command, WriteAndPoll) and from_tai_s <= tai_s <= to_tai_s and truth is not None:
            errors.append(sky_angle_deg(command.az_deg, command.el_deg, truth[0], truth[1]))
    return errors


def fastest_followed_deg_s(flight: Flight) -> tuple[float, float]:
    """Largest rates of azimuth and elevation between two writes that the antenna follows, rounding taken off.

    The first write after a loss is still one for an antenna that tracks by itself: the daemon learns from its reply.
    """
    fastest_az, fastest_el = 0.0, 0.0
    for before, first, second in zip(flight.writes, flight.writes[1:], flight.writes[2:], strict=False):
        if before.is_followed and first.is_followed and second.is_followed:
            span_s = second.tai_s - first.tai_s
            az_deg, el_deg = abs(wrap_180(second.az_deg - first.az_deg)), abs(second.el_deg - first.el_deg)
            fastest_az = max(fastest_az, (az_deg - LSB_DEG) / span_s)
            fastest_el = max(fastest_el, (el_deg - LSB_DEG) / span_s)
    return fastest_az, fastest_el


def shifted(moment_tai_s: float) -> Target:
    """SCD-1's orbit with another epoch, so that it stands high over the station at an instant."""
    known = scd_target(SCD_HIGH_TAI_S)
    source = known.elements.propagator
    assert isinstance(source, BrouwerPropagator)
    sidereal_rad = gmst_rad(np.array([SCD_HIGH_TAI_S, moment_tai_s]), 0.0)
    elements = replace(
        source.elements,
        epoch_tai_s=source.epoch_tai_s + moment_tai_s - SCD_HIGH_TAI_S,
        raan_rad=source.elements.raan_rad + float(sidereal_rad[1] - sidereal_rad[0]),
    )
    loaded = replace(known.elements, propagator=BrouwerPropagator(elements), epoch_tai_s=elements.epoch_tai_s)
    return replace(known, elements=loaded)
