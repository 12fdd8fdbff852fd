"""`acu-daemon replay`: recorded readings through the daemon's own fit and prediction."""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from acu_daemon.assist.estimators.estimator import ESTIMATORS
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory
from acu_daemon.assist.screening.another_satellite import why_not_this_satellite
from acu_daemon.assist.session.estimator_comparison import compare, locked_readings, what_is_left_out
from acu_daemon.assist.session.refit import RefitSetup
from acu_daemon.assist.session.replay_readings import BUFFER_S, Replayed, replay
from acu_daemon.cli.options import SPARE_S, Target, lacking, load_target, whose_recording
from acu_daemon.cli.outputs import refuse_unwritable
from acu_daemon.cli.replay_wire import replay_wire
from acu_daemon.config.to_settings import estimator_settings, may_plunge, pedestal_text
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.edge.carry_over_file import reason_of
from acu_daemon.edge.mount_memory_file import from_json
from acu_daemon.edge.recording import read_readings
from acu_daemon.edge.recording_whose import read_whose
from acu_daemon.errors import UsageError
from acu_daemon.model import Reading
from acu_daemon.pointing.keyhole import longest_window_s

ALL = "all"


@dataclass(frozen=True, slots=True)
class _Job:
    """A recording and what it is replayed with; lines: UTC text, reading, TAI."""

    target: Target
    lines: list[tuple[str, Reading | None, float]]
    memory: PedestalMemory | None = None

    @property
    def timed(self) -> list[tuple[float, Reading | None]]:
        return [(tai_s, reading) for _, reading, tai_s in self.lines]


def command(
    config: Annotated[
        Path | None, typer.Option("--config", help="Directory with station.toml and satellites/NAME.toml.")
    ] = None,
    satellite: Annotated[
        str | None, typer.Option("--satellite", help="NAME of satellites/NAME.toml in the config directory.")
    ] = None,
    readings: Annotated[
        Path | None, typer.Option("--readings", metavar="IN.csv", help="Recorded readings: utc,az_deg,el_deg,locked.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="OUT.csv", help="Predictions: utc,az_deg,el_deg,sigma_deg,source.")
    ] = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            "--estimator",
            metavar="E",
            help=f"{', '.join(ESTIMATORS)}; or {ALL}: a file for each (OUT-kalman.csv and so on), a table of their "
            "errors, and OUT.png, their errors over time.  Default: the satellite's TOML.",
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="OUT.png",
            help="Draw the errors over time here, and print the table of them, of a single estimator too.  Default: "
            f"OUT.png beside the files of --estimator {ALL}, else none.",
        ),
    ] = None,
    memory: Annotated[
        Path | None,
        typer.Option(
            "--memory",
            metavar="FILE",
            help="A mount.json of a state directory: what the station then knew of its antenna.  Default: nothing.",
        ),
    ] = None,
    wire: Annotated[
        Path | None,
        typer.Option(
            "--wire",
            metavar="FILE.tape.gz",
            help="In place of all others: a recording that `run` has kept of a pass (docs/recordings.md).  All that "
            "the ACU said goes through the daemon's decision again, and every command has to be the same.",
        ),
    ] = None,
    fits_anew: Annotated[
        bool, typer.Option("--fits-anew", help="With --wire: compute the fits too, and not take them as recorded.")
    ] = False,
) -> None:
    """Predict every recorded instant from the locked readings before it, as the daemon would have.

    Readings: any rate from 0.2 Hz up; `locked` is the raw flag, 0 or 1; angles may be empty where it is 0.  What
    the predictions are compared with, by --estimator all and --plot: readings without lock that have angles, but for
    those of an antenna that did not follow the path, as after a stop; where there are none, the locked ones.

    Exit status: 0; 1 the readings are probably not of this satellite (the files are written all the same), by the JSON
    beside them or by what it takes to fit them, or with --wire a decision differs; 2 wrong use or configuration.
    """
    if wire is not None:
        if any(one is not None for one in (config, satellite, readings, out, estimator, picture, memory)):
            raise UsageError("--wire FILE stands alone, but for --fits-anew: the recording has all that it needs")
        replay_wire(wire, fits_anew=fits_anew)
        return
    if config is None or satellite is None or readings is None or out is None:
        raise UsageError("--config, --satellite, --readings and --out are needed, or --wire alone")
    names: list[str | None] = [*ESTIMATORS] if estimator == ALL else [estimator]
    paths = {name: _beside(out, name) if estimator == ALL else out for name in names}
    if estimator == ALL and picture is None:
        picture = out.with_suffix(".png")
    refuse_unwritable(*paths.values(), *([picture] if picture is not None else []))
    for path in paths.values():
        try:
            is_same = path.exists() and readings.exists() and path.samefile(readings)
        except OSError as error:
            raise UsageError(f"{error.filename}: {error.strerror}") from None
        if is_same:
            raise UsageError(f"--out {path} is the recording itself; give the predictions a file of their own")
    lines = read_readings(readings, lambda said: typer.echo(f"warning: {said}", err=True))
    if not lines:
        raise UsageError(f"{readings}: no readings below the header")
    target = load_target(config, satellite, lines[0][2])
    job = _Job(target, lines, None if memory is None else memory_of(memory, target))
    from_tai_s = lines[0][2] - longest_window_s(job.target.station.acu.azimuth.limits()) - SPARE_S
    if uncovered := lacking(job.target, f"{readings}", from_tai_s, lines[-1][2] + BUFFER_S + SPARE_S):
        raise UsageError(uncovered)
    for warning in job.target.elements.warnings:
        typer.echo(f"warning: {warning}", err=True)
    results: dict[str, list[Replayed]] = {}
    seconds: dict[str, float] = {}
    for asked, path in paths.items():
        name = asked or job.target.station.tracking.estimator
        started_s = time.perf_counter()
        results[name] = _replay_to(job, name, path)
        seconds[name] = time.perf_counter() - started_s
    if picture is not None:
        _compare(job, results, seconds, picture)
    if estimator != ALL:
        (only,) = results.values()
        typer.echo(f"readings left out of the fit: {what_is_left_out(only[-1].left_out)}", err=True)
    if reasons := [*_said_otherwise(readings, job.target), *_fitted_otherwise(job)]:
        typer.echo(f"probably not this satellite, {job.target.elements.label}: {'; '.join(reasons)}", err=True)
        raise typer.Exit(1)


def memory_of(path: Path, target: Target) -> PedestalMemory:
    """The memory of a file, with its newest pass in it.  UsageError: it cannot be used, and why."""
    try:
        kept = from_json(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise UsageError(f"--memory {path}: {reason_of(error)}") from None
    if kept.pedestal != (asked := pedestal_text(target.station)):
        raise UsageError(f"--memory {path}: it is of another pedestal ({kept.pedestal}), not of this one ({asked})")
    return kept.settled(estimator_settings(target.station, target.satellite))[0].memory


def _said_otherwise(readings: Path, target: Target) -> list[str]:
    """That the recording says it is of another satellite or station, by the JSON beside it."""
    try:
        said = read_whose(readings)
    except ValueError as error:
        typer.echo(f"warning: whose the recording is cannot be read: {error}", err=True)
        return []
    asked = whose_recording(target, is_rehearsal=False)
    if said is None or (said.is_of_satellite(asked) and said.is_at_station(asked)):
        return []
    return [f"{readings.name} is of {said}"]


def _fitted_otherwise(job: _Job) -> list[str]:
    station = job.target.station
    settings = estimator_settings(station, job.target.satellite)
    locked = locked_readings(job.timed, station.receiver.lock_dwell_s)
    reason = why_not_this_satellite(job.target.elements.propagator, station.site, settings, locked)
    return [reason] if reason else []


def _beside(out: Path, name: str | None) -> Path:
    return out.with_name(f"{out.stem}-{name}{out.suffix}")


def _replay_to(job: _Job, name: str, out: Path) -> list[Replayed]:
    station = job.target.station
    setup = RefitSetup(
        job.target.elements.propagator,
        station.site,
        name,
        estimator_settings(station, job.target.satellite),
        station.acu.azimuth.limits(),
        memory=job.memory,
        may_plunge=may_plunge(station),
    )
    on_progress = _progress(name, len(job.lines)) if sys.stderr.isatty() else None
    results = list(replay(setup, job.timed, station.receiver.lock_dwell_s, on_progress))
    rows = ["utc,az_deg,el_deg,sigma_deg,source"]
    rows += [_row(utc, result) for (utc, _, _), result in zip(job.lines, results, strict=True)]
    try:
        out.write_text("\n".join(rows) + "\n", encoding="ascii")
    except OSError as error:
        raise UsageError(f"--out {out}: {error.strerror}") from None
    if on_progress is not None:
        typer.echo(f"\r\033[K{len(job.lines)} lines written to {out}", err=True)
    return results


def _compare(job: _Job, results: dict[str, list[Replayed]], seconds: dict[str, float], picture: Path) -> None:
    from acu_daemon.report.comparison_table import plot, table  # matplotlib is slow to load; one estimator needs none

    seen = compare(job.timed, results, job.target.station.receiver.lock_dwell_s)
    typer.echo("\n".join(table(seen, seconds)))
    try:
        plot(picture, seen, f"{job.target.elements.label} over {job.target.station.station.name}")
    except OSError as error:
        raise UsageError(f"{picture}: {error.strerror}") from None


def _row(utc: str, result: Replayed) -> str:
    sigma = "" if result.sigma_deg is None else f"{result.sigma_deg:.5f}"
    az = f"{result.az_deg:.5f}"
    return f"{utc},{'0.00000' if az == '360.00000' else az},{result.el_deg:.5f},{sigma},{state_of(result)}"


def state_of(result: Replayed) -> TrackState:
    """The state in which the daemon would have been, from the signal and the fit."""
    if result.is_acquired:
        return TrackState.AUTOTRACK_FITTED if result.is_fitted else TrackState.AUTOTRACK_TLE
    if result.has_acquired:
        return TrackState.HOLD_FITTED if result.is_fitted else TrackState.HOLD_TLE
    return TrackState.ACQUIRE_TLE


def _progress(name: str, total: int) -> Callable[[int], None]:
    def show(count: int) -> None:
        typer.echo(f"\r\033[Kreplay {name} {count / total:4.0%}", err=True, nl=False)

    return show
