"""`acu-daemon run`: the daemon, in the foreground of its terminal."""

import asyncio
import contextlib
import faulthandler
import gc
import math
import os
import sys
from collections.abc import Coroutine
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import structlog
import typer

from acu_daemon import PROCESS_START_S
from acu_daemon.cli.clock_wait import wait_for_clock
from acu_daemon.cli.elements_watch import ElementsWatch, keep_confirmed
from acu_daemon.cli.options import (
    At,
    AtMonotonic,
    Config,
    Target,
    antenna_of,
    check_duration,
    chosen_acu,
    coming_pass,
    load_target,
    nearest_to_pass,
    whose_recording,
)
from acu_daemon.cli.outlets_beside import Outlets
from acu_daemon.cli.page import PageFrame, RunningPage, WatchedRuns, Web, chosen_page
from acu_daemon.cli.pass_tape import begin_tape
from acu_daemon.cli.rehearsal import clock_text, meet_in_rehearsal, met_by_chance
from acu_daemon.cli.report_after import AT_THE_END_S, report_after
from acu_daemon.cli.run_setup import Prepared, RunSetup, prepare
from acu_daemon.cli.run_station import run_station
from acu_daemon.cli.station_setup import StationSetup, first_usable
from acu_daemon.cli.weather_watch import WeatherWatch
from acu_daemon.config.load import load_station
from acu_daemon.config.to_settings import driver_of
from acu_daemon.control.state import ControlState
from acu_daemon.control.tracking.pass_plan import PASS_OVER
from acu_daemon.daemon.background import fit_deadline_s
from acu_daemon.daemon.health import Health
from acu_daemon.daemon.live import LiveLine
from acu_daemon.daemon.runs import Runs
from acu_daemon.daemon.service import Outcome, Service
from acu_daemon.daemon.snapshot import Snapshot
from acu_daemon.daemon.write_lease import WriteLease
from acu_daemon.edge.clock import STEP_S, SystemClock
from acu_daemon.edge.control_socket import ControlSocket
from acu_daemon.edge.denied import denied
from acu_daemon.edge.elements_fetching import ElementsFetching
from acu_daemon.edge.event_loop import loop_runner
from acu_daemon.edge.fit import ProcessFitRunner
from acu_daemon.edge.link import check_rate, make_link
from acu_daemon.edge.logs import configure_logs, tell_dropped, tell_loop_problem, tell_signal
from acu_daemon.edge.recording import RecordingWriter
from acu_daemon.edge.rehearsal_clock import Meeting, Role
from acu_daemon.edge.scheduling import keep_to_this_thread
from acu_daemon.edge.signals import STOPS, take_signals
from acu_daemon.edge.state_directory import SnapshotFile, antenna_directory, choice_text, older_folders, state_directory
from acu_daemon.edge.systemd import Notifier
from acu_daemon.edge.tape import no_note
from acu_daemon.edge.tape_file import TapeFile
from acu_daemon.edge.writer import QueuedStream, Writer
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.web.recent_events import RecentEvents

STDERR = 2
SNAPSHOT_TICKS = 5  # where no live line is drawn: a snapshot costs a tenth of a tick


class LogLevel(StrEnum):
    """How much the log says."""

    INFO = "info"
    DEBUG = "debug"


def command(
    config: Config,
    satellite: Annotated[
        str | None,
        typer.Option(
            "--satellite",
            help="NAME of satellites/NAME.toml in the config directory.  Without it: the station, all satellites of "
            "the directory by the schedule, day and night.",
        ),
    ] = None,
    at: At = None,
    at_monotonic: AtMonotonic = None,
    duration: Annotated[
        float | None, typer.Option("--duration", metavar="S", help="End after this many seconds, if not before.")
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(
            "--record",
            metavar="FILE",
            help="Write the readings as CSV, and whose they are into FILE.json, for `acu-daemon replay`.  A file of "
            "another satellite or station is left alone: another one is begun beside it.",
        ),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(
            "--state",
            metavar="DIR",
            help="Where state is kept, that of a rehearsal in DIR-rehearsal, each antenna's in a folder of its own.  "
            "Default: $STATE_DIRECTORY, else the XDG state home.",
        ),
    ] = None,
    log_level: Annotated[
        LogLevel, typer.Option("--log-level", help="debug: also a line for each tick and each fit.")
    ] = LogLevel.INFO,
    shadow: Annotated[
        bool,
        typer.Option("--shadow", help="Command nothing: poll, fit, predict and record while somebody else steers."),
    ] = False,
    acu: Annotated[
        str | None,
        typer.Option(
            "--acu",
            metavar="URL",
            help="In place of acu.url of station.toml, state and all else as of this antenna.  With --at: a simulated "
            "ACU.  Else only together with --same-antenna.",
        ),
    ] = None,
    same_antenna: Annotated[
        bool, typer.Option("--same-antenna", help="The ACU of --acu moves the antenna of station.toml.")
    ] = False,
    web: Web = None,
) -> None:
    """Track a satellite: the pass in progress, else the next one.  Without --satellite: the station, pass after pass.

    Polls the ACU, writes its registers ten times a second, fits the orbit while the signal is locked and steers by the
    prediction while it is not.  Ends after the pass, after --duration, on SIGTERM or Ctrl-C, with a safe stop.

    Without autotrack ([receiver] signal = "none", a rotator) the pass is flown by program track.

    Exit status: 0 done; 1 the satellite was never acquired, of a station with a signal, or the antenna could not be
    stopped; 2 wrong use or configuration; 3 no ACU within 10 s.
    """
    os.umask(0o027)  # what is left belongs to this user and its group
    if not faulthandler.is_enabled():
        faulthandler.enable(STDERR)  # the service's watchdog ends a hung daemon by SIGABRT: say where it hung
    keep_to_this_thread()
    check_duration(duration)
    url = chosen_acu(config, acu, may_choose=at is not None or same_antenna)
    clock, met = meet_in_rehearsal("" if at is None else url, Role.DAEMON, at, at_monotonic)
    end_s = math.inf if duration is None else PROCESS_START_S + duration
    with contextlib.ExitStack() as ends:
        output, files = Writer("log", on_drained=tell_dropped), Writer("files")
        ends.callback(output.close)
        ends.callback(files.close)
        ends.callback(met.close)
        events = RecentEvents()
        live = LiveLine(QueuedStream(sys.stderr, output)) if sys.stderr.isatty() else None
        configure_logs(
            clock.tai_s,
            tags={"REHEARSAL": True} if clock.is_rehearsal else {},
            is_terminal=sys.stdout is not None and sys.stdout.isatty(),
            is_debug=log_level is LogLevel.DEBUG,
            before_line=live.clear if live else None,
            writer=output,
            choice=choice_text(config, state, is_rehearsal=clock.is_rehearsal),
            on_line=events.add,
        )
        if not wait_for_clock(config, satellite, clock, end_s):
            return
        base = state_directory(state, is_rehearsal=clock.is_rehearsal)
        station = load_station(config)
        page = PageFrame(chosen_page(web, station, config), events, WriteLease(clock.monotonic_s))
        antenna = antenna_of(station)
        directory = antenna.folder(base)
        older = () if clock.is_rehearsal else older_folders(base, antenna)  # nothing is carried between rehearsals
        if satellite is None:
            target = first_usable(config, clock.tai_s())
        else:
            target = _load(config, satellite, clock, (directory, *older))
            coming_pass(target, clock.tai_s())
        _tell_clock(met if clock.is_rehearsal else met_by_chance(url, clock), clock)
        link = make_link(url)
        check_rate(link, driver_of(target.station), target.station.acu.period_s, target.station.acu.device_delay_s)
        directory = antenna_directory(base, antenna)
        if satellite is None:
            if record is not None:
                raise UsageError("--record needs --satellite: of a station with many, a file belongs to one pass")
            setup = StationSetup(
                config, clock, link, directory, files, end_s, shadow, older, put=files.put, page=page, acu=acu
            )
            runner = ends.enter_context(loop_runner())
            outcome = _watched(runner, run_station(setup, clock, target, live))
            if not outcome.is_stopped:
                raise typer.Exit(1)
            return
        whose = whose_recording(target, is_rehearsal=clock.is_rehearsal)
        recording = None
        if record is not None:
            recording = ends.enter_context(RecordingWriter(record, files, clock.tai_s(), whose))
        frame = RunSetup(config, satellite, clock, link, directory, files, end_s, shadow, older, acu)
        weather = WeatherWatch(config, target, clock.tai_s())
        first = prepare(frame, weather.on(target))
        runner = ends.enter_context(loop_runner())  # where the system denies even that, another start is refused too
        outcome = _watched(runner, _run(frame, first, live, recording, weather, page))
        structlog.get_logger("run").info("run.done", **asdict(outcome))
    if not outcome.is_stopped:
        raise typer.Exit(1)
    is_missed = first.job.control.is_told_of_signal and not outcome.has_acquired
    if outcome.has_begun and is_missed and outcome.reason not in {number.name for number in STOPS}:
        raise typer.Exit(1)


def _tell_clock(met: Meeting, clock: SystemClock) -> None:
    """Say whose clock a rehearsal has; of a run that is none, that its ACU is a simulator at another time."""
    text, is_warning = clock_text(met, Role.DAEMON, clock.monotonic_s())
    log: Any = structlog.get_logger("rehearsal")
    if is_warning:
        log.warning("rehearsal.clock", clock=text)
    elif clock.is_rehearsal:
        log.info("rehearsal.clock", clock=text)


def _load(config: Path, name: str, clock: SystemClock, folders: tuple[Path, ...]) -> Target:
    """The elements for the coming pass.  folders: of the antenna's state, in which the last pass's fit is."""
    target = load_target(config, name, clock.tai_s(), folders=folders)
    target = nearest_to_pass(config, name, target, clock.tai_s(), folders=folders)
    keep_confirmed(config, target)
    return target


def _watched(runner: asyncio.Runner, run: Coroutine[Any, Any, Outcome]) -> Outcome:
    """Run it.  AcuDaemonError: the system denied something in mid-run, so that a supervisor starts the daemon again."""
    try:
        return runner.run(run)
    except (OSError, MemoryError, RuntimeError, ImportError, ExceptionGroup) as error:
        if words := denied(error):
            raise AcuDaemonError(f"the system denies what the run needs: {words}") from error
        raise


async def _run(
    frame: RunSetup,
    first: Prepared,
    live: LiveLine | None,
    recording: RecordingWriter | None,
    weather: WeatherWatch,
    page_frame: PageFrame,
) -> Outcome:
    clock, now = frame.clock, first
    tape: TapeFile | None = None
    notifier = Notifier()
    health = Health(notifier)
    is_looked_at = live is not None or page_frame.choice is not None
    snapshot_ticks = 1 if is_looked_at else SNAPSHOT_TICKS
    snapshots = SnapshotFile(frame.directory, frame.files, snapshot_ticks)
    elements = ElementsWatch(frame.config, frame.name, first.target, clock, frame.folders)
    section = first.target.station.elements
    outlets = Outlets(
        first.target.station, frame.directory, clock, page_frame, lambda: runs.service, config=frame.config
    )
    fetching = ElementsFetching(
        frame.config, section, clock, is_rehearsal=clock.is_rehearsal, on_asked=outlets.asked_for_elements
    )

    def show(seen: Snapshot) -> None:
        health.see(seen)
        snapshots.write(seen)
        page.see(seen)
        outlets.see(seen)
        if live is not None:
            live.show(seen)

    def files_alarm() -> str:
        kept = (one.problem for one in (frame.files, recording, now.kept, tape) if one is not None)
        return "; ".join(problem for problem in kept if problem)

    def why_anew(is_waiting: bool, step_s: float) -> str:
        if step_s:
            return f"the system clock was set by {step_s:+.1f} s, and nothing is tracked"
        fetching.look()
        if is_waiting and elements.look(now.coming):
            return "other elements were taken"
        return "the weather has changed" if is_waiting and weather.look(clock.tai_s()) else ""

    def begin(memory: ControlState | None) -> Service:
        nonlocal now, tape
        if memory is not None:
            now.kept.flush()
            if abs(clock.follow()) > STEP_S:
                clock.obey()
                elements.target = _load(frame.config, frame.name, clock, frame.folders)
            now = prepare(frame, weather.on(elements.target), memory)
        if tape is not None:
            tape.close()
        tape = begin_tape(frame.directory, now.target, now.job, frame.link, clock.tai_s(), frame.files)
        return Service(
            now.job,
            frame.link,
            clock,
            ProcessFitRunner(now.job.refit, fit_deadline_s(now.job.low_water_s)),
            on_snapshot=show,
            snapshot_ticks=snapshot_ticks,
            on_reading=recording.add if recording else None,
            on_fit=now.kept.offer,
            on_estimate=now.kept.mount.offer,
            on_state=now.kept.see,
            on_end=lambda: notifier("STOPPING=1"),  # no tick feeds the watchdog from here on: it lets the daemon stop
            files_alarm=files_alarm,
            elements_problem=lambda: fetching.problem,
            why_anew=why_anew,
            note=no_note if tape is None else tape.note,
            tally=outlets.tally,
        )

    runs = Runs(begin)
    page = RunningPage(page_frame, WatchedRuns(lambda: runs.service, outlets.counted(runs.answer)), clock)
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(tell_loop_problem)
    ignored = take_signals(loop, runs.stop, tell_signal)
    if ignored:
        reason = "whoever started this daemon ignores them, as nohup does"
        structlog.get_logger("run").info("signals.ignored", signals=ignored, reason=reason)
    control = ControlSocket(frame.directory, outlets.counted(runs.answer))
    await control.open()
    await page.open()
    await outlets.open()
    await weather.open()
    gc.freeze()  # a full collection over the start-up heap would stall a tick by tens of milliseconds
    sync = asyncio.create_task(clock.watch_synchronisation())
    try:
        outcome = await runs.run()
        if tape is not None and outcome.reason == PASS_OVER and now.target.station.recording.report:
            tape.close()
            await report_after(tape, frame.files, frame.config, AT_THE_END_S)
        return outcome
    finally:
        sync.cancel()
        await fetching.close()
        now.kept.flush()
        if tape is not None:
            tape.close()
        await control.close()
        await page.close()
        await outlets.close()
        weather.close()
        notifier.close()
        if live is not None:
            live.clear()
        clock.close()
