"""`acu-daemon demo`: one rehearsed pass with losses over a real wire, beside it the ACU's own rate memory."""

import asyncio
import contextlib
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from importlib import resources
from pathlib import Path
from typing import Annotated

import structlog
import typer

from acu_daemon.acu.commands import AcuMode, Backup, SelectBackup, SelectMode
from acu_daemon.cli.options import Target, at_acu, coming_pass, load_target, whose_recording
from acu_daemon.cli.run_setup import make_job
from acu_daemon.cli.simulated import station_air
from acu_daemon.daemon.live import LiveLine
from acu_daemon.daemon.port import AcuPort
from acu_daemon.daemon.service import Outcome, Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.drivers.sa3842.sa3842_driver import Sa3842Driver
from acu_daemon.edge.child_process import start_python
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.fit import ProcessFitRunner
from acu_daemon.edge.link import make_link
from acu_daemon.edge.logs import configure_logs, tell_signal
from acu_daemon.edge.recording import RecordingWriter
from acu_daemon.edge.signals import take_signals
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.model import sky_angle_deg
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.report.pass_trace import Figures, figures_table, measure, read_trace
from acu_daemon.sim.build import make_sky
from acu_daemon.sim.scenario import Loss, Scenario, read_scenario
from acu_daemon.sim.sky import SimulatedSky

SATELLITE = "demo-1"
START_UTC = "2026-08-18T12:44:11Z"  # 62 s before culmination
WINDOW_S = 92.0
LEAD_S = 4.0  # the simulated ACUs start this long before the window
SEED = 1
PLAN = """\
REHEARSAL on a SIMULATION: {satellite} over {station}, {window:.0f} s around the zenith at true speed.
  Two simulated ACUs stand side by side on TCP, under the same sky:
    assisted     the daemon learns the orbit while the ACU autotracks, and steers when the signal is lost
    rate memory  the ACU alone: after a loss it goes on at its last rates
  The elements are wrong by {wrong:.2f} deg.  Then, after the start:
"""


def command(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where picture, traces and recording go.")] = Path(
        "demo-output"
    ),
) -> None:
    """SIMULATION: see assisted tracking work, in about 100 seconds.

    A fake ACU on TCP, one rehearsed pass at true speed: a receiver failure, a silence zone and a real zenith loss;
    beside it the same with the ACU's own rate memory.  Ends with a table and a picture.

    Exit status: 0 the antenna was on the satellite at the end; 1 it was not.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"--out {out}: {error.strerror}; choose a directory that can be written") from None
    with tempfile.TemporaryDirectory(prefix="acu-daemon-demo-") as temporary:
        config = Path(temporary) / "config"
        with resources.as_file(resources.files("acu_daemon.cli") / "demo_config") as files:
            shutil.copytree(files, config)
        try:
            outcome = run_loop(_demo, config, out)
        except ExceptionGroup as group:
            raise group.exceptions[0] from None
    if outcome.reason != "duration over":
        typer.echo(f"stopped early ({outcome.reason}): no report")
        raise typer.Exit(1)
    figures = _report(out)
    if not figures.is_on_satellite_at_end:
        raise typer.Exit(1)


async def _demo(config: Path, out: Path) -> Outcome:
    start_tai_s = tai_from_utc(START_UTC)
    at_monotonic_s = time.monotonic() + LEAD_S
    clock = SystemClock(start_tai_s, at_monotonic_s)
    target = load_target(config, SATELLITE, start_tai_s)
    scenario = read_scenario(config / "scenario.toml")
    air = station_air(target.station)
    sky = make_sky(target.elements.propagator, target.station.site, scenario, station_air=air, seed=SEED)
    _print_plan(target, sky, scenario.losses, start_tai_s)
    async with (
        _fake_acu(config, at_monotonic_s, out / "assisted.csv") as assisted_url,
        _fake_acu(config, at_monotonic_s, out / "rate-memory.csv") as memory_url,
        asyncio.TaskGroup() as group,
    ):
        rival = group.create_task(_rate_memory(memory_url))
        try:
            return await _assisted(config, assisted_url, clock, (scenario, sky), out)
        finally:
            rival.cancel()


def _print_plan(target: Target, sky: SimulatedSky, losses: tuple[Loss, ...], start_tai_s: float) -> None:
    """Say beforehand what will be seen."""
    coming = coming_pass(target, start_tai_s)
    station = target.station
    truth = sky.direction(coming.culmination_tai_s)
    wrong_deg = 0.0
    if truth is not None:
        wrong_deg = sky_angle_deg(truth[0], truth[1], coming.culmination_az_deg, coming.culmination_el_deg)
    text = PLAN.format(satellite=target.elements.label, station=station.station.name, window=WINDOW_S, wrong=wrong_deg)
    for loss in losses:
        begin, end = loss.window_tai_s(start_tai_s)
        text += f"    {begin - start_tai_s:4.0f} s  {loss.cause} for {end - begin:.0f} s\n"
    text += f"    {coming.culmination_tai_s - start_tai_s:4.0f} s  zenith, too fast for the azimuth drive\n"
    typer.echo(text)


@contextlib.asynccontextmanager
async def _fake_acu(config: Path, at_monotonic_s: float, trace: Path) -> AsyncIterator[str]:
    """A simulated ACU in a process of its own; yields the URL it listens on."""
    arguments = ["--config", str(config), "--satellite", SATELLITE, "--listen", "127.0.0.1:0", "--seed", str(SEED)]
    arguments += ["--at", START_UTC, "--at-monotonic", str(at_monotonic_s), "--trace", str(trace)]
    arguments += ["--scenario", str(config / "scenario.toml")]
    process = await start_python(
        "acu_daemon",
        "fake-acu",
        *arguments,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        start_new_session=True,  # a Ctrl-C is for the demo, which ends its children itself
    )
    try:
        line = (await process.stdout.readline()).decode() if process.stdout else ""
        if not line.startswith("listening "):
            said = (await process.stderr.read()).decode().strip() if process.stderr else ""
            raise AcuDaemonError(f"the simulated ACU did not start: {said or 'it ended'}")
        yield line.split()[1]
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGTERM)
        await process.wait()


async def _assisted(
    config: Path, url: str, clock: SystemClock, scene: tuple[Scenario, SimulatedSky], out: Path
) -> Outcome:
    target = at_acu(load_target(config, SATELLITE, clock.tai_s()), url)
    live = LiveLine() if sys.stderr.isatty() else None
    configure_logs(
        clock.tai_s,
        tags={"REHEARSAL": True, "SIMULATION": True},
        is_terminal=True,
        before_line=live.clear if live else None,
    )
    link = make_link(url)
    start_tai_s = tai_from_utc(START_UTC)
    job = make_job(
        target, coming_pass(target, clock.tai_s()), link, is_rehearsal=True, end_tai_s=start_tai_s + WINDOW_S
    )

    def show(seen: Snapshot) -> None:
        if live is not None:
            live.show(seen, beam_error_deg=_beam_error_deg(seen, *scene))

    with RecordingWriter(out / "readings.csv", whose=whose_recording(target, is_rehearsal=True)) as recording:
        service = Service(job, link, clock, ProcessFitRunner(job.refit), on_snapshot=show, on_reading=recording.add)
        take_signals(asyncio.get_running_loop(), service.stop, tell_signal)
        try:
            return await service.run()
        finally:
            if live is not None:
                live.clear()
            clock.close()


def _beam_error_deg(seen: Snapshot, scenario: Scenario, sky: SimulatedSky) -> float | None:
    """Angle between beam and satellite: the demo knows its own pedestal and sky."""
    if seen.az_deg is None or seen.el_deg is None or seen.reading_age_s is None:
        return None
    tai_s = seen.tai_s - seen.reading_age_s
    zero_az_deg, zero_el_deg = scenario.encoder_zero_deg(tai_s)
    beam_deg = scenario.mount.beam_deg(seen.az_deg - zero_az_deg, seen.el_deg - zero_el_deg)
    truth = sky.direction(tai_s)
    return None if truth is None else sky_angle_deg(*beam_deg, truth[0], truth[1])


async def _rate_memory(url: str) -> None:
    """The rival: select rate memory and autotrack, then only look on."""
    link, clock = make_link(url), SystemClock()
    port = AcuPort(link, clock, Sa3842Driver(), 0.1, 0.0)
    try:
        await port.open()
        for wanted in (SelectBackup(Backup.RATE), SelectMode(AcuMode.AUTOTRACK)):
            await port.reply_to(wanted)
        while True:
            await port.ask()
            await asyncio.sleep(0.1)
    finally:
        await link.close()
        clock.close()


def _report(out: Path) -> Figures:
    from acu_daemon.report.plot import plot_passes  # matplotlib is slow to load, and no other command needs it

    traces = {"assisted": read_trace(out / "assisted.csv"), "rate memory": read_trace(out / "rate-memory.csv")}
    figures = {label: measure(trace, beamwidth_deg=1.0) for label, trace in traces.items()}
    first = traces["assisted"]
    title = f"SIMULATION, REHEARSAL: DEMO-1 over Cuiaba, {utc_text(float(first.tai_s[0]), 0)}"
    plot_passes(out / "demo.png", traces, 1.0, title)
    typer.echo("\n" + "\n".join(figures_table(figures)))
    typer.echo(f"\npicture    {out / 'demo.png'}")
    typer.echo(f"traces     {out / 'assisted.csv'}  {out / 'rate-memory.csv'}")
    typer.echo(f"readings   {out / 'readings.csv'}   (acu-daemon replay reads it)")
    structlog.reset_defaults()
    return figures["assisted"]
