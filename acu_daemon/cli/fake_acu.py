"""`acu-daemon fake-acu`: the simulated ACU, pedestal, receiver and sky."""

import contextlib
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.options import At, AtMonotonic, Config, Satellite, load_target, nearest_to_pass
from acu_daemon.cli.rehearsal import clock_text, meet_in_rehearsal
from acu_daemon.cli.serving import Control, Place, parse_place, serve_until_stopped
from acu_daemon.cli.simulated import station_air, tilt_of
from acu_daemon.config.load import load_station
from acu_daemon.drivers.sa3842.codec import address_byte
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.link import BITS_PER_CHARACTER, DEFAULT_BAUD, make_link
from acu_daemon.edge.rehearsal_clock import Meeting, Role
from acu_daemon.errors import UsageError
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.acu_faults import break_acu
from acu_daemon.sim.build import build_fake_acu
from acu_daemon.sim.fault_board import FaultBoard
from acu_daemon.sim.fault_verbs import FRAME_VERBS, PEDESTAL_VERBS
from acu_daemon.sim.server import ADVANCE_S, acu_peer, keep_time
from acu_daemon.sim.trace import TraceWriter
from acu_daemon.sim.wire_log import WireLogWriter

SIMULATED_DIALECT = "sa3842"
OTHERS = "for a rotator start Hamlib's dummy in its place: rotctld -m 1 -T HOST -t PORT"


def command(
    config: Config,
    satellite: Satellite,
    listen: Annotated[
        str | None,
        typer.Option(
            "--listen",
            metavar="HOST:PORT",
            help="Serve on TCP; port 0 takes a free one.  Default: the station's acu.url.",
        ),
    ] = None,
    pty: Annotated[
        Path | None,
        typer.Option("--pty", metavar="LINK", help="Serve on a pseudo terminal and put a symbolic link to it here."),
    ] = None,
    control: Control = None,
    at: At = None,
    at_monotonic: AtMonotonic = None,
    scenario: Annotated[
        Path | None, typer.Option("--scenario", metavar="FILE", help="TOML with losses, errors and the ACU's fitting.")
    ] = None,
    truth: Annotated[
        Path | None,
        typer.Option("--truth", metavar="FILE", help="The sky as CSV: utc,az_deg,el_deg,range_km.  Default: an orbit."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of all noise.")] = 0,
    trace: Annotated[
        Path | None,
        typer.Option("--trace", metavar="FILE", help="Write what really happens as CSV, ten lines a second."),
    ] = None,
    wire_log: Annotated[
        Path | None,
        typer.Option("--wire-log", metavar="FILE", help="Write every register write that was accepted as CSV."),
    ] = None,
) -> None:
    """SIMULATION: a Scientific-Atlanta 3842 with pedestal, receiver and sky, for rehearsals and tests.

    Faults: [[fault]] tables of the scenario (verb, start_s, duration_s, count, probability, value, axis, on, seed), or
    live, one line in, one line out:  echo 'fault no-reply count=3' | nc 127.0.0.1 3900;  `help` lists all verbs.

    There is air over the antenna: without [air] in the scenario what the station's [atmosphere] tells the daemon, its
    refractivity within +-10 % of that, by --seed; with refraction = false none.  A truth CSV stays geometric; the trace
    has beam and satellite where they are in that air.

    Prints `listening tcp://HOST:PORT` (or the link of the pseudo terminal) when it is ready; ends on SIGTERM or Ctrl-C.
    Run the daemon beside it with the same --at: whichever starts first, on one machine both share its clock, and either
    can be ended and started again in mid-rehearsal.

    A scenario holds [sky] along_track_s, delta_raan_deg, light_time; [air] pressure_hpa, temperature_c,
    humidity_percent, refractivity_factor, refractivity_drawn_within, profile ("quartic", "exponential"); [mount]
    ia_deg, ie_deg, ca_deg, npae_deg, an_deg, aw_deg, tf_deg (docs/antenna-model.md); [drift] azimuth_deg,
    elevation_deg, peak_utc_h; [encoder] azimuth_bias_deg, elevation_bias_deg, noise_deg; [receiver] peak_agc_db,
    agc_noise_db, tracking_noise_deg; [acu] has_tilt, reply_latency_s, mode, azimuth_deg, elevation_deg, sector_bit
    ("driven", "undriven", "random", "stuck-0", "stuck-1"); and any number of [[loss]] with cause ("receiver",
    "silence-zone", "fade"), and start_s, duration_s or from_utc, to_utc; and [[fault]], as above.
    """
    if listen is not None and pty is not None:
        raise UsageError("--listen and --pty exclude each other")
    acu_section = load_station(config).acu
    if acu_section.dialect != SIMULATED_DIALECT:
        raise UsageError(f'[acu] dialect = "{acu_section.dialect}": fake-acu is a simulated SA-3842; {OTHERS}')
    place = _where(listen, pty, acu_section.url)
    clock, met = meet_in_rehearsal(place.url, Role.ACU, at, at_monotonic)
    target = load_target(config, satellite, clock.tai_s(), is_strict=False)
    target = nearest_to_pass(config, satellite, target, clock.tai_s(), is_strict=False)  # as the daemon chooses
    station = target.station
    acu = build_fake_acu(
        azimuth=station.acu.azimuth.limits(),
        elevation=station.acu.elevation.limits(),
        beamwidth_deg=station.receiver.beamwidth_deg,
        propagator=target.elements.propagator,
        site=station.site,
        start_tai_s=clock.tai_s(),
        scenario=scenario,
        truth=truth,
        station_air=station_air(station),
        seed=seed,
        address=address_byte(station.acu.address),
        tilt=tilt_of(station),
    )
    for text in target.elements.errors:
        typer.echo(f"warning: {text}", err=True)
    typer.echo(f"SIMULATION of an SA-3842 for {target.elements.label} over {station.station.name}", err=True)
    with contextlib.ExitStack() as files:
        files.callback(lambda: met.close())
        _tell_clock(met, clock)
        if trace is not None:
            acu.observer = files.enter_context(TraceWriter(trace)).add
        if wire_log is not None:
            acu.on_write = files.enter_context(WireLogWriter(wire_log)).add
        run_loop(_serve, acu, clock, place, control, met)


def _tell_clock(met: Meeting, clock: SystemClock) -> None:
    if met.clock.at_tai_s is not None or met.other is not None:
        text, is_warning = clock_text(met, Role.ACU, clock.monotonic_s())
        typer.echo(f"{'warning: ' if is_warning else ''}REHEARSAL clock: {text}", err=True)


def _where(listen: str | None, pty: Path | None, url: str) -> Place:
    """Where to serve, by the options or by the station's URL."""
    byte_time_s = make_link(url).byte_time_s
    if pty is not None or (listen is None and url.startswith("serial:")):
        if pty is None:
            raise UsageError(f"the station's acu.url is {url}: give --pty LINK, or --listen HOST:PORT")
        return Place(pty=pty, baud=round(BITS_PER_CHARACTER / byte_time_s) if byte_time_s else DEFAULT_BAUD)
    return Place(*parse_place("--listen", listen or url.removeprefix("tcp://").split("?")[0]))


async def _serve(acu: FakeAcu, clock: SystemClock, place: Place, control: str | None, met: Meeting) -> None:
    board = FaultBoard(FRAME_VERBS | PEDESTAL_VERBS | place.line_verbs)
    break_acu(acu, board, clock)
    peer, faults = acu_peer(acu, clock, board, place.baud), acu.parts.scenario.faults
    try:
        await serve_until_stopped(peer, board, place, control, faults, lambda: keep_time(acu, clock), met.move_to)
    finally:
        acu.advance(clock.tai_s() + ADVANCE_S)  # the trace's last line shows how the antenna was left
