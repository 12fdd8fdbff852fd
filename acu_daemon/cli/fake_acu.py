"""`acu-daemon fake-acu`: the simulated ACU, pedestal, receiver and sky."""

import asyncio
import contextlib
import sys
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.cli.options import STOP_SIGNALS, At, AtMonotonic, Config, Satellite, load_target, make_clock
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.link import BITS_PER_CHARACTER, DEFAULT_BAUD, make_link
from acu_daemon.errors import UsageError
from acu_daemon.protocol.sa3842 import address_byte
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.build import build_fake_acu
from acu_daemon.sim.server import keep_time, serve_pty, serve_tcp
from acu_daemon.sim.trace import TraceWriter
from acu_daemon.sim.wire_log import WireLogWriter


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

    Prints `listening tcp://HOST:PORT` (or the link of the pseudo terminal) when it is ready; ends on SIGTERM or Ctrl-C.
    Run the daemon beside it with the same --at and --at-monotonic, so that both share one clock.

    A scenario holds [sky] along_track_s, delta_raan_deg; [encoder] azimuth_bias_deg, elevation_bias_deg, noise_deg;
    [receiver] peak_agc_db, agc_noise_db, tracking_noise_deg; [acu] has_tilt, reply_latency_s, mode, azimuth_deg,
    elevation_deg; and any number of [[loss]] with cause ("receiver", "silence-zone", "fade"), and start_s, duration_s
    or from_utc, to_utc.
    """
    clock = make_clock(at, at_monotonic)
    target = load_target(config, satellite, clock.tai_s(), is_strict=False)
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
        seed=seed,
        address=address_byte(station.acu.address),
    )
    typer.echo(f"SIMULATION of an SA-3842 for {target.elements.label} over {station.station.name}", err=True)
    url = station.acu.url
    with contextlib.ExitStack() as files:
        if trace is not None:
            acu.observer = files.enter_context(TraceWriter(trace)).add
        if wire_log is not None:
            acu.on_write = files.enter_context(WireLogWriter(wire_log)).add
        asyncio.run(_serve(acu, clock, *_where(listen, pty, url)))


def _where(listen: str | None, pty: Path | None, url: str) -> tuple[str, int, Path | None, int]:
    """Host and port, or the pseudo terminal and its baud rate."""
    if listen is not None and pty is not None:
        raise UsageError("--listen and --pty exclude each other")
    byte_time_s = make_link(url).byte_time_s
    if pty is not None or (listen is None and url.startswith("serial:")):
        if pty is None:
            raise UsageError(f"the station's acu.url is {url}: give --pty LINK, or --listen HOST:PORT")
        return "", 0, pty, round(BITS_PER_CHARACTER / byte_time_s) if byte_time_s else DEFAULT_BAUD
    text = listen if listen is not None else url.removeprefix("tcp://").split("?")[0]
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or int(port) > 65535:
        raise UsageError(f"--listen {text!r}: expected HOST:PORT, such as 127.0.0.1:3842")
    return host, int(port), None, 0


async def _serve(acu: FakeAcu, clock: SystemClock, host: str, port: int, pty: Path | None, baud: int) -> None:
    stopped = asyncio.Event()
    for number in STOP_SIGNALS:
        asyncio.get_running_loop().add_signal_handler(number, stopped.set)
    server = serve_pty(acu, clock, pty, baud) if pty is not None else serve_tcp(acu, clock, host, port)
    async with server as where:
        sys.stdout.write(f"listening {where}\n")
        sys.stdout.flush()
        keeper = asyncio.create_task(keep_time(acu, clock))
        waiting = asyncio.create_task(stopped.wait())
        done, _ = await asyncio.wait({keeper, waiting}, return_when=asyncio.FIRST_COMPLETED)
        for task in (keeper, waiting):
            task.cancel()
        if keeper in done:
            keeper.result()
