"""`acu-daemon latency-test`: whether this machine and this link keep the daemon's time, a line per item."""

import json
from collections.abc import Iterator
from importlib import resources
from itertools import count
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from acu_daemon.acu.commands import Poll
from acu_daemon.acu.driver import AcuDriver
from acu_daemon.assist.session.refit import RefitRequest, RefitSetup
from acu_daemon.cli.check import clock_finding
from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.cli.options import check_duration, coming_pass, load_target
from acu_daemon.cli.outputs import refuse_no_picture, refuse_unwritable
from acu_daemon.cli.run_setup import make_job
from acu_daemon.config.load import load_station
from acu_daemon.config.station_tables import StationFile
from acu_daemon.config.to_settings import driver_of
from acu_daemon.daemon.latency_trial import Trial, try_loop
from acu_daemon.daemon.port import CYCLE_SHARE, AcuPort
from acu_daemon.edge.clock import SystemClock
from acu_daemon.edge.event_loop import run_loop
from acu_daemon.edge.fit import ProcessFitRunner
from acu_daemon.edge.link import Link, cycle_s, make_link
from acu_daemon.edge.scheduling import keep_to_this_thread, may_be_real_time
from acu_daemon.errors import UsageError
from acu_daemon.model import Pass, Readings
from acu_daemon.orbit.look import look_at

SKIP = "SKIP"
PERIOD_S = 0.1
HORIZON_S = 90.0
LATE_P99_MS = 5.0  # more of it is worth SCHED_FIFO or a quieter machine
SLOW_REFIT_S = 1.0  # the fit is asked once a second
LOST_SHARE = 0.01
EDGES_MS = (0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, float("inf"))
BAR = 40


def command(
    config: Annotated[
        Path | None,
        typer.Option("--config", help="Directory with station.toml: also polls its ACU.  Default: the machine alone."),
    ] = None,
    duration: Annotated[float, typer.Option("--duration", metavar="S", help="How long to tick.")] = 60.0,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Also write every figure here.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Also draw the histograms here, as PNG.")
    ] = None,
) -> None:
    """Measure whether this machine and this link keep the daemon's time.  Moves nothing.

    Runs the daemon's own clock and loop, ten ticks a second, with a fit each second in the child process.  With
    --config the ACU is asked for its status at each tick, and told nothing; a daemon that holds it must be stopped
    first.  Do it on the machine and with the load of the site, for ten minutes or more:

      acu-daemon latency-test --config config --duration 600

    A line per item, GO, WARN, NO-GO, or SKIP with the reason: scheduling, clock, ticks (NO-GO: one was skipped; WARN:
    one in a hundred is more than 5 ms late), fit, link round trip, what fits at this baud rate.

    Exit status: 0 no item is NO-GO; 1 one is; 2 wrong use or configuration.
    """
    check_duration(duration)
    refuse_unwritable(json_file)
    refuse_no_picture(plot)
    scheduling = keep_to_this_thread()
    station = None if config is None else load_station(config)
    link = None if station is None else make_link(station.acu.url)
    trial = run_loop(_measure, station, link, duration)
    findings = [
        _scheduling(scheduling),
        clock_finding(),
        _ticks(trial),
        _fit(trial),
        *_link(trial, station, link),
    ]
    for finding in findings:
        typer.echo(f"{finding.verdict:6} {finding.what:12} {finding.detail}")
    typer.echo("\n" + histogram("ticks late, ms", trial.lateness.newest_ms()))
    if trial.round_trips_s:
        typer.echo("\n" + histogram("link round trip, ms", 1e3 * np.array(trial.round_trips_s)))
    worst = next((verdict for verdict in (NO_GO, WARN) if any(f.verdict == verdict for f in findings)), GO)
    typer.echo(f"\n{worst}: " + {GO: "keeps time", WARN: "keeps time, with warnings", NO_GO: "does not"}[worst])
    try:
        if json_file is not None:
            json_file.write_text(json.dumps(_as_json(trial, findings, duration), indent=1) + "\n", encoding="utf-8")
        if plot is not None:
            from acu_daemon.report.latency import plot_latency  # matplotlib is slow to load

            plot_latency(plot, trial.lateness.newest_ms(), 1e3 * np.array(trial.round_trips_s), scheduling)
    except OSError as error:
        raise UsageError(f"{error.filename} cannot be written: {error.strerror}") from None
    if worst == NO_GO:
        raise typer.Exit(1)


async def _measure(station: StationFile | None, link: Link | None, duration_s: float) -> Trial:
    clock = SystemClock()
    period_s = PERIOD_S if station is None else station.acu.period_s
    acu = None
    if station is not None and link is not None:
        acu = link, AcuPort(link, clock, driver_of(station), period_s, station.acu.device_delay_s)
    setup, coming = _made_up_pass()
    try:
        return await try_loop(
            clock,
            ProcessFitRunner(setup),
            requests(setup, coming),
            duration_s=duration_s,
            period_s=period_s,
            acu=acu,
        )
    finally:
        clock.close()


def _made_up_pass() -> tuple[RefitSetup, Pass]:
    """The demo's satellite and station: something to fit, the same on every machine."""
    with resources.as_file(resources.files("acu_daemon.cli") / "demo_config") as files:
        target = load_target(files, "demo-1", 0.0, is_strict=False)
    coming = coming_pass(target, target.elements.epoch_tai_s)
    return make_job(target, coming, make_link(target.station.acu.url), is_rehearsal=True).refit, coming


def requests(setup: RefitSetup, coming: Pass) -> Iterator[RefitRequest]:
    """What the background asks, second after second of a pass, with noise; for ever, without news after its end."""
    rng = np.random.default_rng(0)
    for second in count():
        tai_s = coming.rise_tai_s + second + np.linspace(0.0, 0.9, 10)
        tai_s = tai_s[tai_s < coming.set_tai_s]
        look = look_at(setup.propagator, tai_s, setup.site)
        az_deg = look.az_deg + rng.normal(0.0, 0.03, tai_s.size) / np.cos(np.radians(look.el_deg))
        readings = Readings(tai_s, az_deg, look.el_deg + rng.normal(0.0, 0.03, tai_s.size))
        now_tai_s = min(coming.rise_tai_s + second + 1.0, coming.set_tai_s)
        yield RefitRequest(readings, now_tai_s - 1.0, HORIZON_S, now_tai_s, coming.culmination_az_deg)


def _scheduling(scheduling: str) -> Finding:
    if scheduling.startswith(("SCHED_FIFO", "SCHED_RR")):
        return Finding(GO, "scheduling", f"{scheduling}; the fit and all threads stay at normal priority")
    permitted = "is permitted here" if may_be_real_time() else "is not permitted here"
    return Finding(GO, "scheduling", f"{scheduling}; SCHED_FIFO {permitted} (optional: docs/realtime.md)")


def _ticks(trial: Trial) -> Finding:
    late = trial.lateness.figures()
    detail = f"{late.p50_ms:.2f} / {late.p99_ms:.2f} / {late.max_ms:.2f} ms late (50 %, 99 %, max)"
    detail += f", {trial.skipped_tick_count} of {trial.tick_count} skipped"
    if trial.skipped_tick_count:
        return Finding(NO_GO, "ticks", f"{detail}: free a processor core, or use SCHED_FIFO")
    if late.p99_ms > LATE_P99_MS:
        return Finding(WARN, "ticks", f"{detail}: use SCHED_FIFO, or a quieter machine")
    return Finding(GO, "ticks", detail)


def _fit(trial: Trial) -> Finding:
    if trial.fit_problem or not trial.refits_s:
        return Finding(NO_GO, "fit", trial.fit_problem or "no fit was finished: use a longer --duration")
    took_ms = 1e3 * np.array(trial.refits_s)
    detail = f"{took_ms.size} fits, {np.median(took_ms):.0f} ms, the longest {took_ms.max():.0f} ms"
    is_slow = took_ms.max() > 1e3 * SLOW_REFIT_S
    return Finding(WARN if is_slow else GO, "fit", detail + (": the prediction is renewed late" if is_slow else ""))


def _link(trial: Trial, station: StationFile | None, link: Link | None) -> Iterator[Finding]:
    if station is None or link is None:
        yield Finding(SKIP, "link", "no --config: no ACU is known")
        return
    driver = driver_of(station)
    if trial.link_problem or not trial.round_trips_s:
        verdict = NO_GO if trial.late else SKIP
        yield Finding(verdict, "link", "; ".join(trial.link_problem.splitlines()) or "no poll was answered")
        yield fits(link, driver, station.acu.period_s, station.acu.device_delay_s, "as configured")
        return
    trips_ms = np.sort(1e3 * np.array(trial.round_trips_s))
    p50_ms, p99_ms = (trips_ms[int(share * (trips_ms.size - 1))] for share in (0.5, 0.99))
    asked_count = trips_ms.size + trial.lost_poll_count
    detail = f"{link.description}: {p50_ms:.2f} / {p99_ms:.2f} / {trips_ms[-1]:.2f} ms (50 %, 99 %, max)"
    detail += f", {trial.lost_poll_count} of {asked_count} polls lost"
    detail += trial.late and f", replies {trial.late}"
    lost_share = trial.lost_poll_count / asked_count
    verdict = NO_GO if lost_share > LOST_SHARE else WARN if lost_share else GO
    yield Finding(verdict, "link", detail + (": look at cable, ground and baud rate" if lost_share else ""))
    wire_s = driver.wire_bytes(Poll()) * link.byte_time_s
    yield fits(link, driver, station.acu.period_s, max(0.0, p99_ms / 1e3 - wire_s), "measured")


def fits(link: Link, driver: AcuDriver, period_s: float, latency_s: float, source: str) -> Finding:
    """Whether a write each period fits with this latency, and one beside it (docs/adding-an-acu.md, Timing)."""
    allowed_ms = 1e3 * CYCLE_SHARE * period_s
    one_s = cycle_s(driver, link.byte_time_s, latency_s)
    one_ms, both_ms = 1e3 * one_s, 1e3 * (one_s + (driver.extra_bytes + 1) * link.byte_time_s + latency_s)
    baud = f"{round(10.0 / link.byte_time_s)} baud" if link.byte_time_s else "no baud rate in the URL"
    detail = (
        f"{baud}, latency {1e3 * latency_s:.1f} ms {source}: a command and its status {one_ms:.1f} of {allowed_ms:g} ms"
    )
    if one_ms > allowed_ms:
        return Finding(NO_GO, "cycle", f"{detail}: use a higher baud rate or a longer period")
    if both_ms > allowed_ms:
        return Finding(GO, "cycle", f"{detail}; a second exchange beside it does not fit ({both_ms:.1f} ms): it waits")
    return Finding(GO, "cycle", f"{detail}; with a second exchange {both_ms:.1f} ms")


def histogram(title: str, values_ms: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    """Counts in steps that grow, as text; empty steps at both ends are left out."""
    counts = np.histogram(values_ms, EDGES_MS)[0].tolist()
    filled = [i for i, number in enumerate(counts) if number]
    lines = [title]
    for i in range(filled[0], filled[-1] + 1) if filled else ():
        bar = "#" * max(round(BAR * counts[i] / max(counts)), 1 if counts[i] else 0)
        upper = f"{EDGES_MS[i + 1]:<5g}" if i + 2 < len(EDGES_MS) else "     "
        lines.append(f"{EDGES_MS[i]:>6g} .. {upper} {counts[i]:>7}  {bar}".rstrip())
    return "\n".join(lines)


def _as_json(trial: Trial, findings: list[Finding], duration_s: float) -> dict[str, Any]:
    late = trial.lateness.figures()
    return {
        "duration_s": duration_s,
        "findings": [{"verdict": one.verdict, "what": one.what, "detail": one.detail} for one in findings],
        "tick_count": trial.tick_count,
        "skipped_tick_count": trial.skipped_tick_count,
        "lateness_p50_ms": late.p50_ms,
        "lateness_p99_ms": late.p99_ms,
        "lateness_max_ms": late.max_ms,
        "lateness_ms": [round(float(value), 4) for value in trial.lateness.newest_ms()],
        "round_trip_ms": [round(1e3 * value, 4) for value in trial.round_trips_s],
        "lost_poll_count": trial.lost_poll_count,
        "refit_ms": [round(1e3 * value, 2) for value in trial.refits_s],
    }
