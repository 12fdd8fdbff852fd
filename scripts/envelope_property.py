#!/usr/bin/env python3
"""Tries the envelope: random sequences of every mover that the daemon commands, and counts what is commanded outside.

What it does
  Each sequence draws an antenna (limits, drives), up to three keep-out boxes and the sun's disc, a place to begin, and
  what moves the registers: a satellite's path, a search beside it, a jump as to the rise point, to a stow position or
  by a person's hand, a standstill, garbage, and registers that are not followed.  Each step goes through the register
  limiter; what comes out is asked of the envelope, and whether axes that brake from it stand outside too.

Prints one line with the counts, and on standard error how far it has come.

Exit status: 0 nothing was outside, 1 something was.

Examples
  scripts/envelope_property.py                        1000000 sequences
  scripts/envelope_property.py --count 20000 --seed 7  a shorter try
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, inf, nan, radians, sin
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from acu_daemon.acu.commands import AcuMode
from acu_daemon.acu.replies import AcuStatus
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.safety.command_permit import of_angles
from acu_daemon.control.state import ControlState, Intake, Registers
from acu_daemon.control.tracking.keep_clear import braked
from acu_daemon.control.tracking.register_limiter import limit
from acu_daemon.model import AxisLimits, Pointing, Site, Station
from acu_daemon.pointing.axis import AxisState
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.pointing.keep_out import KeepOut, Sun
from acu_daemon.pointing.mount import Mount
from acu_daemon.pointing.way_round import RIM_DEG

SITES = tuple(Site(Station("", latitude_deg, 10.0, 100.0)) for latitude_deg in (-75.0, -30.0, 0.0, 25.0, 52.0, 70.0))
SUNS = tuple(
    Sun(site, radius_deg, policy)
    for site in SITES
    for radius_deg in (0.5, 2.0, 5.0, 15.0)
    for policy in ("avoid", "avoid", "warn")
)
DAY_TAI_S = 8.4e8
RANGES = ((-270.0, 270.0), (0.0, 360.0), (-180.0, 180.0), (-400.0, 400.0), (-100.0, 150.0))
MOVERS = ("path", "search", "jump", "rest", "garbage", "unfollowed")
STEP_S = 0.1
SAY_EVERY = 20000
ROUNDED_DEG = 0.006  # one 16-bit code


@dataclass
class Counts:
    """What was tried and what came out."""

    sequences: int = 0
    steps: int = 0
    outside: int = 0
    cannot_brake: int = 0
    held: int = 0
    first: str = ""

    def text(self) -> str:
        return (
            f"{self.sequences} sequences, {self.steps} writes, {self.held} kept out or held: "
            f"{self.outside} outside, {self.cannot_brake} that cannot brake outside"
        )


def an_envelope(draw: Random) -> Envelope:
    """Limits, drives, zones, and a mount now and then."""
    azimuth = AxisLimits(*draw.choice(RANGES), draw.choice((2.0, 5.0, 20.0)), draw.choice((1.0, 5.0, 10.0, 40.0)))
    elevation = AxisLimits(
        draw.choice((0.0, 5.0)),
        draw.choice((85.0, 90.0, 90.0, 180.0)),
        draw.choice((2.0, 5.0, 10.0)),
        draw.choice((1.0, 5.0, 20.0)),
    )
    boxes = []
    for number in range(draw.randrange(4)):
        az_deg, low_deg = draw.uniform(0.0, 360.0), draw.choice((-90.0, draw.uniform(0.0, 60.0)))
        high_deg = draw.choice((90.0, draw.uniform(max(low_deg, 0.0) + 0.5, 89.0)))
        boxes.append(KeepOut(f"box {number}", az_deg, az_deg + draw.uniform(0.5, 120.0), low_deg, high_deg))
    sun = draw.choice(SUNS)
    mount = draw.choice((None, None, Mount(ia_deg=draw.uniform(-90.0, 90.0), an_deg=0.05, tf_deg=0.1)))
    return Envelope(azimuth, elevation, tuple(boxes), sun, None, mount)


def a_place(draw: Random, envelope: Envelope, tai_s: float) -> tuple[float, float] | None:
    """Somewhere outside of all zones; None: none was found."""
    for _ in range(30):
        az_deg = draw.uniform(envelope.azimuth.min_deg, envelope.azimuth.max_deg)
        el_deg = draw.uniform(envelope.elevation.min_deg, min(envelope.elevation.max_deg, 90.0))
        if envelope.clearance_deg(az_deg, el_deg, tai_s) >= RIM_DEG:
            return az_deg, el_deg
    return None


def near_a_zone(draw: Random, envelope: Envelope, tai_s: float) -> tuple[float, float]:
    """Somewhere that matters: in or beside a zone more often than not."""
    zones = envelope.zones_at(tai_s)
    if not zones or draw.random() < 0.3:
        return draw.uniform(envelope.azimuth.min_deg, envelope.azimuth.max_deg), draw.uniform(0.0, 90.0)
    middle_deg, half_deg, low_deg, high_deg = draw.choice(zones).box_deg(2.0)
    turn_deg = 360.0 * draw.choice((-1, 0, 0, 1))
    return middle_deg + turn_deg + draw.uniform(-half_deg, half_deg), draw.uniform(
        max(low_deg, 0.0), min(high_deg, 90.0)
    )


def wanted(draw: Random, mover: str, envelope: Envelope, tai_s: float, count: int) -> Iterator[Pointing | None]:
    """What a mover wants, step by step; None: where the registers are."""
    az_deg, el_deg = near_a_zone(draw, envelope, tai_s)
    if mover == "path" or mover == "unfollowed":
        angle, speed = draw.uniform(0.0, 360.0), draw.choice((0.02, 0.5, 2.0, 10.0))
        az_rate, el_rate = speed * sin(radians(angle)), speed * cos(radians(angle))
        if draw.random() < 0.1:
            az_rate *= 20.0
        for k in range(count):
            t = STEP_S * (k - count / 2)
            yield Pointing(az_deg + az_rate * t, el_deg + el_rate * t, az_rate, el_rate)
    elif mover == "search":
        for _ in range(count):
            yield Pointing(
                az_deg + draw.uniform(-2.0, 2.0), el_deg + draw.uniform(-2.0, 2.0), draw.uniform(-5.0, 5.0), 0.0
            )
    elif mover == "jump":
        for k in range(count):
            if k % 7 == 6:
                az_deg, el_deg = near_a_zone(draw, envelope, tai_s)
            yield Pointing(az_deg, el_deg, 0.0, 0.0)
    elif mover == "rest":
        yield from [None] * count
    else:
        for _ in range(count):
            yield Pointing(*(draw.choice((nan, inf, -inf, 1e9, draw.uniform(-500.0, 500.0))) for _ in range(4)))


def a_state(az: AxisState, el: AxisState, antenna: tuple[float, float], *, was_followed: bool) -> ControlState:
    return ControlState(
        intake=Intake(status=AcuStatus(antenna[0] % 360.0, antenna[1], AcuMode.REMOTE), az_deg=antenna[0]),
        registers=Registers(axis_az=az, axis_el=el, was_followed=was_followed),
    )


def a_sequence(draw: Random, counts: Counts) -> None:
    """One antenna, two or three movers one after the other."""
    envelope = an_envelope(draw)
    tai_s = DAY_TAI_S + 2160.0 * draw.randrange(40)  # of a day: few, so that the sun is not computed anew each time
    start = a_place(draw, envelope, tai_s)
    if start is None:
        return
    config = ControlConfig(envelope)
    az, el = AxisState(start[0]), AxisState(start[1])
    counts.sequences += 1
    while True:
        mover = draw.choice(MOVERS)
        is_followed = mover != "unfollowed"
        for want in wanted(draw, mover, envelope, tai_s, draw.choice((1, 2, 6))):
            point = want or Pointing(az.position_deg, el.position_deg, 0.0, 0.0)
            state = a_state(az, el, (az.position_deg, el.position_deg), was_followed=True)
            passed = limit(point, state, tai_s, is_followed=is_followed, dt_s=STEP_S, config=config)
            counts.steps += 1
            counts.held += bool(passed.limited)
            az, el = passed.az, passed.el
            if not is_followed:
                az, el = AxisState(az.position_deg), AxisState(el.position_deg)
            judge(counts, envelope, az, el, tai_s, mover)
            tai_s += STEP_S
        if draw.random() < 0.5:
            return


def judge(counts: Counts, envelope: Envelope, az: AxisState, el: AxisState, tai_s: float, mover: str) -> None:
    """Count what is outside, or cannot stop outside."""
    if envelope.room_deg(az.position_deg, el.position_deg, tai_s) < -ROUNDED_DEG or of_angles(
        az.position_deg, el.position_deg, tai_s, envelope, ControlConfig(envelope).acu.angle_step_deg
    ):
        counts.outside += 1
        counts.first = counts.first or f"{mover} {envelope} at {tai_s}: {az} {el}"
    still_az, still_el = az, el
    while still_az.rate_deg_s or still_el.rate_deg_s:
        still_az = braked(still_az, STEP_S, envelope.azimuth)
        still_el = braked(still_el, STEP_S, envelope.elevation)
        if envelope.clearance_deg(still_az.position_deg, still_el.position_deg, tai_s) < 0.0:
            counts.cannot_brake += 1
            counts.first = counts.first or f"brakes inside: {mover} {envelope} at {tai_s}: {az} {el}"
            return


def try_all(count: int, seed: int) -> Counts:
    """So many sequences, one after the other, the same for each seed."""
    counts = Counts()
    for number in range(count):
        a_sequence(Random(f"{seed} {number}"), counts)
        if number % SAY_EVERY == SAY_EVERY - 1:
            print(counts.text(), file=sys.stderr, flush=True)
    return counts


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1_000_000, help="sequences; default: 1000000")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    counts = try_all(given.count, given.seed)
    print(counts.text())
    if counts.first:
        print(counts.first)
    return 1 if counts.outside or counts.cannot_brake else 0


if __name__ == "__main__":
    sys.exit(main())
