#!/usr/bin/env python3
"""SIMULATION: what an operator sees of a night's pass, as text: the live line of the real daemon in virtual time.

A pass through the zenith whose azimuth drive is too slow, with a loss before it, and a dead link and a stuck axis after
it.  Each line is the live line of a terminal of 80 columns, whenever its verdict or its alarms change and every 30 s
between; behind it stands what only the simulator knows: how far the antenna is off the satellite, degrees.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import acu_daemon.cli as cli
from acu_daemon.cli.options import coming_pass, load_target
from acu_daemon.cli.simulated import station_air
from acu_daemon.cli.virtual_pass import Flight, fly
from acu_daemon.daemon.live import live_text
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.verdict import alarms, verdict
from acu_daemon.orbit.timescales import tai_from_utc
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.fault_verbs import parse_fault
from acu_daemon.sim.scenario import AcuChoice, Encoder, Loss, Scenario, SkyErrors

NEAR_TAI_S = tai_from_utc("2026-08-18T12:44:11Z")
LEAD_S = 180.0  # from the start to the rise
CULMINATION_S = 61.0  # from NEAR to it
SLOW_DEG_S = 5.0
EVERY_S = 30.0


@dataclass(frozen=True, slots=True)
class Shown:
    """A live line, the snapshot it was made of, and the beam error that only the simulator knows."""

    seen: Snapshot
    text: str
    beam_error_deg: float | None


def night() -> Flight:
    """Fly the pass."""
    target = load_target(Path(cli.__file__).parent / "demo_config", "demo-1", NEAR_TAI_S)
    azimuth = target.station.acu.azimuth.model_copy(update={"max_rate_deg_s": SLOW_DEG_S})
    station = target.station.model_copy(update={"acu": target.station.acu.model_copy(update={"azimuth": azimuth})})
    target = type(target)(station, target.satellite, target.elements)
    coming = coming_pass(target, NEAR_TAI_S)
    begin_tai_s = coming.rise_tai_s - LEAD_S
    top_s = coming.culmination_tai_s - begin_tai_s
    errors = SkyErrors(along_track_s=0.9, delta_raan_deg=0.015)
    faults = (f"silence start_s={top_s - 20.0:.1f} duration_s=45", f"deaf start_s={top_s + 80.0:.1f} duration_s=12")
    faults = (*faults, f"stuck axis=elevation start_s={top_s + 130.0:.1f} duration_s=60")
    scenario = Scenario(
        sky=errors,
        encoder=Encoder(noise_deg=0.02),
        acu=AcuChoice(azimuth_deg=40.0, elevation_deg=45.0),
        losses=(Loss("receiver", from_utc=coming.rise_tai_s + 100.0, to_utc=coming.rise_tai_s + 140.0),),
        faults=tuple(map(parse_fault, faults)),
    )
    air = station_air(target.station)
    sky = make_sky(target.elements.propagator, target.station.site, scenario, station_air=air)
    return fly(target, sky, scenario, begin_tai_s=begin_tai_s, end_tai_s=coming.set_tai_s + 10.0)


def shown(flight: Flight, columns: int) -> Iterator[Shown]:
    """The lines that tell something new, and one now and then between."""
    errors = {round(row.tai_s, 1): row.beam_error_deg for row in flight.rows}
    told: tuple[str, ...] = ()
    told_tai_s = -1e9
    for seen in flight.snapshots:
        now = (verdict(seen).word, *alarms(seen))
        if now != told or seen.tai_s - told_tai_s >= EVERY_S:
            told, told_tai_s = now, seen.tai_s
            yield Shown(seen, live_text(seen, columns=columns), errors.get(round(seen.tai_s, 1)))


def main() -> None:
    """Print the night."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--columns", type=int, default=80, help="the terminal's width")
    columns = asked.parse_args().columns
    for one in shown(night(), columns - 1):
        error = "-" if one.beam_error_deg is None else f"{one.beam_error_deg:.2f}"
        first, *more = one.text.splitlines()
        print(f"{first:{columns}}| {error}")
        for line in more:
            print(f"{line:{columns}}|")


if __name__ == "__main__":
    main()
