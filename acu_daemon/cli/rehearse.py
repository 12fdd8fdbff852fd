"""`acu-daemon rehearse`: the next pass of one's own satellite over one's own station, now, on a simulated ACU."""

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from acu_daemon import PROCESS_START_S
from acu_daemon.cli.options import (
    NEXT_PASS_DAYS,
    Config,
    Satellite,
    Target,
    check_duration,
    coming_pass,
    load_target,
    nearest_to_pass,
)
from acu_daemon.cli.page import Web
from acu_daemon.cli.run import command as run
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.daemon.words import clock_text
from acu_daemon.edge.clock import SystemClock
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.model import AxisLimits, Pass
from acu_daemon.orbit.look import apparent_at
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.wrap import middle_deg
from acu_daemon.report.pass_trace import Figures, figures_table, measure, read_trace, until
from acu_daemon.sim.scenario import read_scenario
from acu_daemon.units import DAY_S, wrap_180

LEAD_S = 4.0  # until both processes have loaded; the rehearsed time begins after it
BEFORE_S = 30.0
SIMULATED_DIALECT = "sa3842"
MOST_BEFORE_S = 3600.0
LEAST_FLOWN_S = 5.0
OWN_END_S = 1.0  # of the trace: the daemon's own stop
ALONG_TRACK_S, ENCODER_NOISE_DEG = 0.5, 0.02  # what the elements and the encoders are wrong by
FIRST_LOSS, SECOND_LOSS, LONGEST_LOSS_S = (0.35, 0.08), (0.65, 0.08), 60.0  # begin and length, shares of what is flown
ENDS_S = 20.0  # for the simulated ACU to write what it has and end
TRACE, READINGS, SCENARIO, PICTURE = "trace.csv", "readings.csv", "scenario.toml", "rehearsal.png"
SCENARIO_TEXT = """\
# What happened in this rehearsal.  Change it and give it to `acu-daemon rehearse --scenario FILE`; `acu-daemon fake-acu
# --help` tells all that can be chosen.

[sky]
along_track_s = {along_track_s}  # the satellite is late against its elements

[encoder]
noise_deg = {noise_deg}

[acu]
azimuth_deg = {az_deg:.1f}  # where the antenna stands at the start
elevation_deg = {el_deg:.1f}
"""
LOSS_TEXT = """
[[loss]]
cause = "{cause}"
from_utc = {begin}
to_utc = {end}
"""


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """What is flown: a pass of a target, from start to end (TAI seconds), its files in `out`."""

    target: Target
    coming: Pass
    start_tai_s: float
    end_tai_s: float
    out: Path

    @property
    def seconds(self) -> float:
        return self.end_tai_s - self.start_tai_s


def command(
    config: Config,
    satellite: Satellite,
    before: Annotated[
        float,
        typer.Option("--before", metavar="S", help="Begin this long before the rise; negative: in mid-pass."),
    ] = BEFORE_S,
    duration: Annotated[
        float | None, typer.Option("--duration", metavar="S", help="End after this long.  Default: the whole pass.")
    ] = None,
    skip: Annotated[int, typer.Option("--skip", metavar="N", min=0, help="Leave out the next N passes.")] = 0,
    losses: Annotated[bool, typer.Option("--losses/--no-losses", help="Take the signal away twice.")] = True,
    scenario: Annotated[
        Path | None,
        typer.Option("--scenario", metavar="FILE", help="What happens instead, such as an earlier rehearsal's file."),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Where report, picture, trace and recording go.")
    ] = Path("rehearsal-output"),
    web: Web = None,
) -> None:
    """SIMULATION: fly the satellite's next pass now, with your station's files, on a simulated ACU.

    The daemon is the real one, with your limits, drives, mask and satellite; beside it runs an ACU that is simulated,
    with a pedestal of your station.toml.  Your own ACU is not touched, and it need not be there.  The satellite is half
    a second late against its elements, and the signal is lost twice, so that you see what happens then.

    Takes as long as the pass does: `--before -120 --duration 90` shows a minute and a half of its middle.  In another
    terminal: `acu-daemon status --watch --rehearsal`.  Ctrl-C ends it safely, with a report of what was flown.

    Exit status: 0 the antenna was on the satellite at the end; 1 it was not, or the satellite was never acquired; 2
    wrong use or configuration, or no pass within three days.
    """
    check_duration(duration)
    now_tai_s = SystemClock().tai_s()
    target = nearest_to_pass(config, satellite, load_target(config, satellite, now_tai_s), now_tai_s)
    if (dialect := target.station.acu.dialect) != SIMULATED_DIALECT:
        raise UsageError(f'[acu] dialect = "{dialect}": only an ACU with "{SIMULATED_DIALECT}" is simulated here')
    flown = _planned(target, now_tai_s, before, duration, skip, out / satellite)
    chosen = _scenario(flown, scenario, has_losses=losses)
    _tell(flown, chosen, now_tai_s, config)
    at, at_monotonic_s = utc_text(flown.start_tai_s, 3), time.monotonic() + LEAD_S
    with _fake_acu(config, satellite, ("--at", at, "--at-monotonic", str(at_monotonic_s)), flown, chosen) as url:
        end_s = at_monotonic_s + flown.seconds - PROCESS_START_S
        with contextlib.suppress(typer.Exit):  # never acquired: the report says so
            run(config, satellite, at, at_monotonic_s, end_s, flown.out / READINGS, acu=url, web=web)
    if not _report(flown, chosen):
        raise typer.Exit(1)


def _planned(
    target: Target, now_tai_s: float, before_s: float, duration_s: float | None, skip: int, out: Path
) -> Rehearsal:
    if not before_s <= MOST_BEFORE_S:
        raise UsageError(f"--before {before_s:g}: expected at most {MOST_BEFORE_S:g} seconds")
    coming = coming_pass(target, now_tai_s)
    for _ in range(skip):
        coming = coming_pass(target, coming.set_tai_s + 1.0)
    start_tai_s = coming.rise_tai_s - before_s
    end_tai_s = coming.set_tai_s if duration_s is None else min(coming.set_tai_s, start_tai_s + duration_s)
    if end_tai_s - max(start_tai_s, coming.rise_tai_s) < LEAST_FLOWN_S:
        raise UsageError(
            f"--before {before_s:g}: of the pass of {coming.duration_s:.0f} s nothing is left to fly; "
            "it counts from the rise, negative values begin in mid-pass"
        )
    if end_tai_s - start_tai_s > NEXT_PASS_DAYS * DAY_S:
        raise UsageError("the satellite does not set: give --duration")
    return Rehearsal(target, coming, start_tai_s, end_tai_s, out)


def _scenario(flown: Rehearsal, given: Path | None, *, has_losses: bool) -> Path:
    """The scenario's file: that which is given, else one that is written beside the results."""
    try:
        flown.out.mkdir(parents=True, exist_ok=True)
        for name in (READINGS, f"{READINGS}.json", TRACE, PICTURE):  # of an earlier rehearsal
            (flown.out / name).unlink(missing_ok=True)
        if given is not None:
            return given
        az_deg, el_deg = _first_direction(flown)
        text = SCENARIO_TEXT.format(
            along_track_s=ALONG_TRACK_S, noise_deg=ENCODER_NOISE_DEG, az_deg=az_deg, el_deg=el_deg
        )
        (flown.out / SCENARIO).write_text(text + (_losses(flown) if has_losses else ""))
    except OSError as error:
        raise UsageError(f"{flown.out}: {error.strerror}; choose a directory that can be written by --out") from None
    return flown.out / SCENARIO


def _losses(flown: Rehearsal) -> str:
    begin_tai_s = max(flown.start_tai_s, flown.coming.rise_tai_s)
    up_s, text = flown.end_tai_s - begin_tai_s, ""
    for cause, (begin, share) in (("receiver", FIRST_LOSS), ("silence-zone", SECOND_LOSS)):
        at_tai_s = begin_tai_s + begin * up_s
        end_tai_s = at_tai_s + min(share * up_s, LONGEST_LOSS_S)
        text += LOSS_TEXT.format(cause=cause, begin=utc_text(at_tai_s, 1), end=utc_text(end_tai_s, 1))
    return text


def _first_direction(flown: Rehearsal) -> tuple[float, float]:
    """Where the satellite is first, as far as the axes reach, in degrees of the encoders, on the turn for this pass."""
    begin_tai_s = max(flown.start_tai_s, flown.coming.rise_tai_s)
    source, station = flown.target.elements.propagator, flown.target.station
    azimuth, elevation = station.acu.azimuth.limits(), station.acu.elevation.limits()
    seen = apparent_at(source, np.array([begin_tai_s]), station.site)
    stands_deg = _in_the_middle(float(seen.az_deg[0]), azimuth)
    plan = plan_pass(source, station.site, flown.coming, stands_deg, azimuth, begin_tai_s, elevation=elevation)
    return _held(plan.start_az_deg, azimuth), _held(plan.start_el_deg, elevation)


def _in_the_middle(az_deg: float, limits: AxisLimits) -> float:
    """The turn of a bearing that leaves the cable most room either way."""
    middle = middle_deg(limits)
    return middle + wrap_180(az_deg - middle)


def _held(angle_deg: float, limits: AxisLimits) -> float:
    return min(max(angle_deg, limits.min_deg), limits.max_deg)


def _tell(flown: Rehearsal, scenario: Path, now_tai_s: float, config: Path) -> None:
    """Say beforehand what will be seen."""
    station, coming = flown.target.station, flown.coming
    losses = read_scenario(scenario).losses
    windows = [loss.window_tai_s(flown.start_tai_s) for loss in losses]
    lost = [
        f"{clock_text(begin - flown.start_tai_s)} after the start for {end - begin:.0f} s ({loss.cause})"
        for loss, (begin, end) in zip(losses, windows, strict=True)
    ]
    away_s = coming.rise_tai_s - now_tai_s
    really = f"really in {clock_text(away_s)}" if away_s > 0 else "really in progress now"
    rows = (
        ("pass", f"rises {utc_text(coming.rise_tai_s, 0)}, up to {coming.culmination_el_deg:.0f} deg, sets "
                 f"{utc_text(coming.set_tai_s, 0)}; {really}"),
        ("rehearsed", f"from {utc_text(flown.start_tai_s, 0)} on, now; takes {clock_text(flown.seconds)}"),
        ("ACU", f"simulated, with the pedestal of {config / 'station.toml'}; {station.acu.url} is not touched"),
        ("signal", "lost " + " and ".join(lost) if lost else "never lost"),
        ("results", str(flown.out)),
        ("meanwhile", f"acu-daemon status --watch --config {config} --rehearsal"),
    )  # fmt: skip
    typer.echo(f"REHEARSAL on a SIMULATION: {flown.target.elements.label} over {station.station.name}")
    typer.echo("\n".join(f"  {name:10} {text}" for name, text in rows) + "\n")


@contextlib.contextmanager
def _fake_acu(config: Path, satellite: str, clock: tuple[str, ...], flown: Rehearsal, scenario: Path) -> Iterator[str]:
    """A simulated ACU in a process of its own; yields the URL it listens on.  AcuDaemonError: it does not start."""
    arguments = ["fake-acu", "--config", str(config), "--satellite", satellite, "--listen", "127.0.0.1:0", *clock]
    arguments += ["--scenario", str(scenario), "--trace", str(flown.out / TRACE)]
    places = os.pathsep.join(place for place in sys.path if place)
    with (flown.out / "fake-acu.log").open("w+") as said:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "acu_daemon", *arguments],
            env=os.environ | {"PYTHONPATH": places},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            start_new_session=True,  # a Ctrl-C is for the daemon, which stops the antenna before the ACU goes
        )
        try:
            line = process.stdout.readline() if process.stdout else ""
            if not line.startswith("listening "):
                process.wait(ENDS_S)
                said.seek(0)
                raise AcuDaemonError(f"the simulated ACU did not start: {said.read().strip() or 'it ended'}")
            yield line.split()[1]
        finally:
            process.terminate()
            with process:
                try:
                    process.wait(ENDS_S)
                except subprocess.TimeoutExpired:
                    process.kill()


def _report(flown: Rehearsal, scenario: Path) -> bool:
    """Print what was flown; whether the antenna was on the satellite at the end."""
    from acu_daemon.report.plot import plot_passes  # matplotlib is slow to load, and no other command needs it

    beamwidth_deg = flown.target.station.receiver.beamwidth_deg
    whole = read_trace(flown.out / TRACE)
    end_tai_s = min(flown.end_tai_s, float(whole.tai_s[-1])) if whole.tai_s.size else flown.end_tai_s
    trace = until(whole, end_tai_s - OWN_END_S)
    try:
        figures = measure(trace, beamwidth_deg)
    except ValueError as error:
        typer.echo(f"\nREHEARSAL, SIMULATION: {error}; {flown.out / TRACE} has what happened")
        return False
    title = f"SIMULATION, REHEARSAL: {flown.target.elements.label} over {flown.target.station.station.name}"
    plot_passes(flown.out / PICTURE, {"this station": trace}, beamwidth_deg, f"{title}, {utc_text(trace.tai_s[0], 0)}")
    typer.echo("\nREHEARSAL\n" + "\n".join(figures_table({"this station": figures})))
    if end_tai_s < flown.end_tai_s - OWN_END_S:
        flown_s = max(end_tai_s - flown.start_tai_s, 0.0)
        typer.echo(f"\nEnded early, after {clock_text(flown_s)} of {clock_text(flown.seconds)}.")
    typer.echo(f"\n{_in_words(figures)}")
    for name, file in (("picture", PICTURE), ("trace", TRACE), ("readings", READINGS)):
        typer.echo(f"{name:10} {flown.out / file}")
    typer.echo(f"{'scenario':10} {scenario}   (change it, then --scenario)")
    return figures.is_on_satellite_at_end


def _in_words(figures: Figures) -> str:
    if figures.is_on_satellite_at_end and figures.seconds_on_satellite >= (1.0 - 0.02) * figures.seconds:
        also = ", also while there was no signal" if figures.seconds_without_signal > 0.0 else ""
        return f"The antenna was on the satellite throughout{also}."
    if figures.is_on_satellite_at_end:
        return "The antenna was on the satellite at the end; the picture shows where it was not in between, and why."
    return "The antenna was not on the satellite at the end: see the picture, and `acu-daemon check` for the limits."
